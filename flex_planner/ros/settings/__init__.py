"""The parameters of the nodes, each with its description, range and default."""
