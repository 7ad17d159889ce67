"""Places other than local disk: object stores and web servers. Loaded when the first URL is used."""
