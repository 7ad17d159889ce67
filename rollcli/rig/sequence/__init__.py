"""One quantity over the frames of one drive: mounting value, drift and jumps, with intervals that hold."""
