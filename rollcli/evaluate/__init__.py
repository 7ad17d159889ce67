"""The experiments of the paper, and accuracy against known angles."""
