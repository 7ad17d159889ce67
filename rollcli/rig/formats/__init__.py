"""Calibration files, one module a format; `table` lists them."""
