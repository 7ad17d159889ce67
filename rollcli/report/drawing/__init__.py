"""Charts as pictures that need neither a script nor a browser: laid out once, written as SVG or as PNG."""
