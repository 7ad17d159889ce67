"""Places other than local disk: object stores and web servers."""
