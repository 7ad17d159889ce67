"""One frame, a map or a stereo pair: found, checked, read, its outputs named and encoded."""
