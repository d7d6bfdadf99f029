"""
Capacity maps: what an arm can carry, or how fast, cell by cell over a grid.

`study` says what is asked, `cells` what a cell may come to, `blocks` how neighbours are solved one
after the other, `store` keeps what is done, `execution` spreads blocks over processes.

"""
