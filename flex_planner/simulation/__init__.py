"""
A flexible arm carried through time under a joint controller.

The simulated arm may differ from the one that a motion was planned for.

"""
