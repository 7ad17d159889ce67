"""Broken files for the readers: `python -m tests.fuzz --seconds 60`."""
