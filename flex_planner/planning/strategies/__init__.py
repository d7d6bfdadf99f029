"""
Ways to a first solution of a motion.

Read `catalogue` first, which lists them in the order in which they are tried; `strategy` says what
one is. Searches for a limit start in `first_extremals` and go on in `price_continuation`.

"""
