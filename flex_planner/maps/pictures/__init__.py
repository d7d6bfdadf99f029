"""The pictures of a map: what they need of its store, and their parts."""
