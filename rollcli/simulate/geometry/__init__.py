"""Cameras, rays, and the surfaces and solids that rays hit."""
