"""The common parts of all nodes: start and end, logging, and parameters."""
