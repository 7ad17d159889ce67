"""The appearance of surfaces: textures and materials."""
