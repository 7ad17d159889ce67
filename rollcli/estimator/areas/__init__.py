"""The planes of the earlier papers: one area, or many small ones that agree."""
