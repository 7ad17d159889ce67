"""What the frames of a drive say about the rig: mean, drift, jumps and alignment, with intervals."""
