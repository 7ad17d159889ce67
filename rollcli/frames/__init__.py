"""One frame: found, read, checked, named, encoded."""
