"""Bags and videos as rigs record them, and their frames."""
