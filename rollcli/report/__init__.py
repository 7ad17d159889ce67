"""A result as one HTML page, and its charts as files."""
