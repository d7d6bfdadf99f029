"""
Gains of feedback along a plan, looked at before they are handed out.

`differing_arm` carries a plan out under a law on arms that differ from the model, `gains` says
what was found, and `find_gains` chooses among laws.

"""
