"""Many frames: one job a frame, workers, order, resume, counts."""
