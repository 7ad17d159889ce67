"""Any tasks, in order, on any workers: this process, a pool of others, or a Dask cluster. Knows no frame."""
