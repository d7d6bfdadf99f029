"""
Kinds of motion: tasks have several extremals, of which a start finds one.

An arm may swing a joint back first, or go too far and return. `paths` are the starts, `explorer`
solves the rigid arm's motion from each of them, `clusters` tells which of the results are of one
kind and says it in words. Read `search` first.

"""
