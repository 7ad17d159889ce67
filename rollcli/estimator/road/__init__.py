"""Which pixels of a map are road."""
