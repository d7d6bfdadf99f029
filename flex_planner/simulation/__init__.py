"""
A flexible arm carried through time under a joint controller.

Shows what a plan is worth on an arm that may differ from the one that was planned for.

"""
