"""
Every simulation of Korayem et al. 2009 (Robotica), recomputed and checked.

One module per section of the paper computes its tables, pictures and verdicts on its statements
(`evidence`); `document` writes the page, `run` computes all sections.

"""
