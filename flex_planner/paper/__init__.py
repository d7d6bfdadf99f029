"""
Every simulation of Korayem et al. 2009 (Robotica), recomputed and checked.

One module a section of the paper makes its tables, pictures and what became of its statements
(`evidence`); `document` writes them down, `run` does it all.

"""
