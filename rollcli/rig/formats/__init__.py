"""The formats of calibration files; `FORMATS` of `read_calibration.py` lists them."""
