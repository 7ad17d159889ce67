"""Bytes to arrays and back: formats, encodings, inputs, results."""
