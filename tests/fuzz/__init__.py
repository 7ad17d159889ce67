"""Broken files for the readers: `python -m tests.fuzz [--reader tiff] --seconds 60`."""
