"""Calibrations, pitch and height, and what the frames of a drive say about the rig."""
