"""
Capacity maps: what an arm can carry, or how fast, cell by cell over a grid.

`study` says what is computed, `cell_solver` solves one cell, `block_solver` neighbouring cells one
after the other, `store` keeps the results, `scheduling` spreads blocks over processes.

"""
