"""Road stereo pairs with known roll, by ray casting."""
