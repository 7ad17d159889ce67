"""Bags as rigs record them: their topics, and the frames of a topic, each by its place in the file."""
