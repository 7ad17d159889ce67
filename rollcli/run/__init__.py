"""How a command works through frames: find, read, estimate, write; one row a frame."""
