"""What frames say about the rig: its calibration, and its pose over the road."""
