/*
 * Newton's method for Gauss collocation; its linear algebra goes interval by interval, in cache.
 *
 * The mathematics is that of linear.py, where it is explained; names are the same. Sizes are fixed
 * when this is compiled: SIZE unknowns m, LEFT rows at the first node, EXPLICIT unknowns that need
 * no factorisation, STAGES s. With EXACT, every stage keeps its own Jacobian; without, the mean
 * over the stages stands for all of them, and their equations fall apart into PAIRS complex ones.
 *
 * The node equations are almost block diagonal. Each node is eliminated from the rows of its
 * interval and those carried over from the interval before, with pivoting over all these rows:
 * the same rows as the band of linear.py has.
 *
 * The parts are compiled as one: core.py puts them in the place of their #include.
 */
#define _POSIX_C_SOURCE 199309L
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/*
 * Of what GCC has at -O3, this is all that makes loops of fixed size faster. With -O2 it takes 50 to
 * 90 % of the time to compile. Exact stages of 12 to 16 unknowns are faster than with -O3, those of
 * 24 and 48 a tenth slower. Clang has it at -O2.
 */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("vect-cost-model=dynamic", "peel-loops", "tree-partial-pre")
#endif

#define UP(n) (((n) + 3) / 4 * 4)  /* whole vectors */

/*
 * The steps of the next loop do not touch what one another write. `restrict` would promise that
 * for too long: GCC 12 holds on to it when it unrolls a loop around an inlined function.
 */
#ifdef __clang__
#define INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#else
#define INDEPENDENT _Pragma("GCC ivdep")
#endif

enum {
    IMPLICIT = SIZE - EXPLICIT,
    RIGHT = SIZE - LEFT,
    PAIRS = (STAGES + 1) / 2,
    LANES = 2 * PAIRS,        /* real parts of all pairs, then imaginary parts */
    ROWS = LEFT + SIZE,       /* of which a node is eliminated */
    WIDTH = UP(2 * SIZE),     /* columns of two nodes */
    INNER = UP(IMPLICIT),
    CROSSED = EXPLICIT * IMPLICIT,
    TERMS = STAGES * IMPLICIT /* unknowns of exact stage equations */
};

enum {
    SOLVED = 0,
    SINGULAR_STAGES = 1,
    BAD_BOUNDARY_ROW = 2,
    SINGULAR_NODES = 3,
    RATE_NOT_FINITE = 4,
    CORRECTION_NOT_FINITE = 5,
    NO_STEP_HELPS = 6,
    NOT_CONVERGED = 7,
    REFUSED = 8, /* by the boundary rows of the problem */
    STOPPED = 9, /* by who watches */
    NO_MEMORY = 10
};

#include "core_parts/basics.c"
#if EXACT
#include "core_parts/exact_stages.c"
#else
#include "core_parts/mean_stages.c"
#endif
#include "core_parts/nodes.c"
#include "core_parts/equations.c"
#include "core_parts/newton.c"
