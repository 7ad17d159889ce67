"""The view of a camera: trace rays, shade what they hit, and expose the image."""
