"""One module per section of the paper: computes it, and returns the evidence."""
