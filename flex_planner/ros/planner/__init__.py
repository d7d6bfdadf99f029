"""The planner node, from the request at its endpoint to the recording of its outcome."""
