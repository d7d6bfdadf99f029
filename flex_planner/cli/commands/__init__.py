"""
The commands of ``flex-planner``, one module for each group of them.

A module adds its options to the parser, and runs the command that was given.

"""
