"""The method: arrays in, numbers out. NumPy only; knows no file, no command, no OpenCV."""
