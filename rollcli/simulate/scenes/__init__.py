"""Scenes: the road, what stands beside it and on it, and the light."""
