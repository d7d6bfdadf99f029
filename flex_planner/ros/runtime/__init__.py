"""What all nodes share: how they start, end, log, and declare their parameters."""
