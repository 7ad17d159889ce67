"""One module a file format: bytes to the numbers they hold, and back."""
