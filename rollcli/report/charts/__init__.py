"""The charts of a report: what they hold, as plotly takes it."""
