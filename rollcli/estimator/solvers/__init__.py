"""One solver a file: from the energy of some pixels to a roll angle."""
