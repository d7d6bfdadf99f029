/*
 * The linear algebra of one Newton step of Gauss collocation, interval by interval in cache.
 *
 * The mathematics is that of linear.py, where it is explained; names are the same. Sizes are fixed
 * when this is compiled: SIZE unknowns m, LEFT rows at the first node, EXPLICIT unknowns that need
 * no factorisation, STAGES s. With EXACT, every stage keeps its own Jacobian; without, the mean
 * over the stages stands for all of them, and their equations fall apart into PAIRS complex ones.
 *
 * The node equations are almost block diagonal. Each node is eliminated from the rows of its
 * interval and those carried over from the interval before, with pivoting over all these rows:
 * the same rows as the band of linear.py has.
 */
#define _POSIX_C_SOURCE 199309L
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

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

/* who watches may stop the work; asked again after some milliseconds */
struct watch {
    int (*stop)(void);
    double asked; /* [s] */
};

static const double PATIENCE = 5e-3; /* [s] */

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec + 1e-9 * now.tv_nsec;
}

static int ask(struct watch *watch)
{
    watch->asked = seconds();
    return watch->stop();
}

/* whether to stop; the clock is looked at every few intervals only */
static int interrupted(struct watch *watch, long long interval)
{
    if (!watch || interval % 8 || seconds() - watch->asked < PATIENCE) return 0;
    return ask(watch);
}

/* what `pack_rule` of core.py writes, in this order; complex rows are laid out as lanes */
struct rule {
    double eigenvalue[LANES];      /* of the Butcher matrix A */
    double weight[LANES];          /* b^T V times V^-1 1 */
    double split[STAGES][LANES];   /* (V^-1)^T */
    double constant[LANES];        /* V^-1 1 */
    double advance[LANES];         /* b^T V, conjugate */
    double join[STAGES][LANES];    /* V, conjugate */
    double matrix[STAGES][STAGES]; /* A */
    double b[STAGES];
};

struct interval {
    double step;
#if EXACT
    double jacobian[STAGES][SIZE][SIZE];
    double factors[TERMS * UP(TERMS) + 1];
    int stage_pivots[TERMS + 1];
    double forced[STAGES][SIZE];
#else
    double jacobian[SIZE][SIZE];
    double across[IMPLICIT][EXPLICIT], among[EXPLICIT][EXPLICIT]; /* J_IE, J_EE */
    double down[EXPLICIT][IMPLICIT], down_again[EXPLICIT][IMPLICIT]; /* J_EI, J_EE J_EI */
    double inverse[IMPLICIT][IMPLICIT][LANES]; /* of the Schur complements */
    double forced[SIZE][LANES];
#endif
    double upper[SIZE][WIDTH];        /* U of the node, and its rows in the next node */
    double lower[SIZE][UP(ROWS)];     /* L by columns */
    int pivots[SIZE];
};

struct last_node {
    double factors[SIZE * SIZE];
    int pivots[SIZE];
};

struct scales {
    int explicit[EXPLICIT + 1], implicit[IMPLICIT + 1];
    double unknown[SIZE], row[SIZE]; /* magnitudes of unknowns, largest entries of boundary rows */
};

/* what is kept of a factorisation, in memory of the caller */
struct factorisation {
    struct rule rule;
    struct watch *watch; /* or none */
    struct scales scales;
    struct last_node last;
    struct interval intervals[];
};

long long factorisation_size(long long count)
{
    return (long long)(sizeof(struct factorisation) + count * sizeof(struct interval));
}

static inline void add_multiple(int n, double *a, double factor, const double *b)
{
    INDEPENDENT
    for (int j = 0; j < n; ++j) a[j] += factor * b[j];
}

static inline double dot(int n, const double *a, const double *b)
{
    double part[4] = {0, 0, 0, 0}, sum = 0;
    int whole = n / 4 * 4;
    for (int j = 0; j < whole; j += 4)
        for (int l = 0; l < 4; ++l) part[l] += a[j + l] * b[j + l];
    for (int j = whole; j < n; ++j) sum += a[j] * b[j];
    return (part[0] + part[1]) + (part[2] + part[3]) + sum;
}

static inline void swap_rows(int n, double *a, double *b)
{
    INDEPENDENT
    for (int j = 0; j < n; ++j) {
        double held = a[j];
        a[j] = b[j];
        b[j] = held;
    }
}

static inline int usable(double pivot)
{
    return pivot > 0 && pivot < INFINITY;
}

/* L and U of a square matrix in place, rows interchanged as a whole; 0 if it has none */
static int factorise(int n, int stride, double *matrix, int *pivots)
{
    for (int k = 0; k < n; ++k) {
        int best = k;
        for (int i = k + 1; i < n; ++i)
            if (fabs(matrix[i * stride + k]) > fabs(matrix[best * stride + k])) best = i;
        double *pivot = matrix + k * stride;
        if (best != k) swap_rows(n, pivot, matrix + best * stride);
        pivots[k] = best;
        if (!usable(fabs(pivot[k]))) return 0;
        double inverse = 1 / pivot[k];
        for (int i = k + 1; i < n; ++i) {
            double *row = matrix + i * stride, factor = row[k] * inverse;
            row[k] = factor;
            if (factor != 0) add_multiple(n - k - 1, row + k + 1, -factor, pivot + k + 1);
        }
    }
    return 1;
}

static void substitute(int n, int stride, const double *matrix, const int *pivots, double *x)
{
    for (int k = 0; k < n; ++k) {
        double held = x[pivots[k]];
        x[pivots[k]] = x[k];
        x[k] = held;
    }
    for (int k = 0; k < n; ++k) x[k] -= dot(k, matrix + k * stride, x);
    for (int k = n - 1; k >= 0; --k) {
        const double *row = matrix + k * stride;
        x[k] = (x[k] - dot(n - k - 1, row + k + 1, x + k + 1)) / row[k];
    }
}

/* ---- Stages ---------------------------------------------------------------------------------- */

#if !EXACT

/* the inverse of a complex matrix in place, by Gauss and Jordan with pivoting; 0 if it has none */
static int invert(double matrix[IMPLICIT][2 * INNER])
{
    int pivots[IMPLICIT + 1];
    for (int c = 0; c < IMPLICIT; ++c) {
        int best = c;
        double largest = -1;
        for (int i = c; i < IMPLICIT; ++i) {
            double size = fabs(matrix[i][c]) + fabs(matrix[i][INNER + c]);
            if (size > largest) largest = size, best = i;
        }
        pivots[c] = best;
        if (!usable(largest)) return 0;
        if (best != c) swap_rows(2 * INNER, matrix[best], matrix[c]);
        double *re = matrix[c], *im = matrix[c] + INNER;
        double inverse = 1 / (re[c] * re[c] + im[c] * im[c]);
        double p = re[c] * inverse, q = -im[c] * inverse;
        re[c] = 1, im[c] = 0;
        for (int j = 0; j < INNER; ++j) {
            double a = re[j], b = im[j];
            re[j] = a * p - b * q;
            im[j] = a * q + b * p;
        }
        for (int i = 0; i < IMPLICIT; ++i) {
            if (i == c) continue;
            double *row = matrix[i];
            const double *pivot = matrix[c];
            double f = row[c], g = row[INNER + c];
            row[c] = row[INNER + c] = 0;
            INDEPENDENT
            for (int j = 0; j < INNER; ++j) {
                row[j] -= f * pivot[j] - g * pivot[INNER + j];
                row[INNER + j] -= f * pivot[INNER + j] + g * pivot[j];
            }
        }
    }
    for (int c = IMPLICIT - 1; c >= 0; --c) {
        if (pivots[c] == c) continue;
        for (int i = 0; i < IMPLICIT; ++i)
            for (int part = 0; part < 2; ++part) {
                double *row = matrix[i] + part * INNER, held = row[pivots[c]];
                row[pivots[c]] = row[c];
                row[c] = held;
            }
    }
    return 1;
}

static double frobenius(double matrix[IMPLICIT][2 * INNER])
{
    double sum = 0;
    for (int i = 0; i < IMPLICIT; ++i) sum += dot(2 * INNER, matrix[i], matrix[i]);
    return sqrt(sum);
}

/* whether rounding may have made a system I - T of one without an inverse, see linear.py */
static int may_be_singular(double system[IMPLICIT][2 * INNER], double inverse[IMPLICIT][2 * INNER])
{
    const double limit = 0.1 / 2.220446049250313e-16;
    if (frobenius(inverse) * (frobenius(system) + 2 * sqrt(IMPLICIT)) < limit) return 0;
    double sensitivity = 0;
    for (int i = 0; i < IMPLICIT; ++i)
        for (int j = 0; j < IMPLICIT; ++j) {
            double one = i == j;
            double term = hypot(system[j][i] - one, system[j][INNER + i]) + one;
            sensitivity += hypot(inverse[i][j], inverse[i][INNER + j]) * term;
        }
    return !(sensitivity < limit);
}

/* products of the rows of J over the explicit unknowns */
struct products {
    double implicit[IMPLICIT][SIZE], explicit[EXPLICIT][SIZE]; /* J_I, J_E */
    double once[IMPLICIT][SIZE], again[EXPLICIT][SIZE];        /* J_IE J_E, J_EE J_E */
    double twice[IMPLICIT][SIZE];                              /* J_IE J_EE J_E */
    double across[IMPLICIT][EXPLICIT], across_once[IMPLICIT][EXPLICIT]; /* columns of J_I, once */
};

static void multiply_rows(struct interval *k, const struct scales *s, struct products *p)
{
    memset(p, 0, sizeof *p);
    for (int i = 0; i < IMPLICIT; ++i) {
        memcpy(p->implicit[i], k->jacobian[s->implicit[i]], sizeof p->implicit[i]);
        for (int e = 0; e < EXPLICIT; ++e) k->across[i][e] = p->implicit[i][s->explicit[e]];
    }
    for (int i = 0; i < EXPLICIT; ++i) {
        memcpy(p->explicit[i], k->jacobian[s->explicit[i]], sizeof p->explicit[i]);
        for (int e = 0; e < EXPLICIT; ++e) k->among[i][e] = p->explicit[i][s->explicit[e]];
        for (int c = 0; c < IMPLICIT; ++c) k->down[i][c] = p->explicit[i][s->implicit[c]];
    }
    /* many of these entries are zero */
    for (int i = 0; i < EXPLICIT; ++i)
        for (int e = 0; e < EXPLICIT; ++e)
            if (k->among[i][e] != 0) add_multiple(SIZE, p->again[i], k->among[i][e], p->explicit[e]);
    for (int i = 0; i < EXPLICIT; ++i)
        for (int c = 0; c < IMPLICIT; ++c) k->down_again[i][c] = p->again[i][s->implicit[c]];
    for (int i = 0; i < IMPLICIT; ++i)
        for (int e = 0; e < EXPLICIT; ++e) {
            double factor = k->across[i][e];
            if (factor == 0) continue;
            add_multiple(SIZE, p->once[i], factor, p->explicit[e]);
            add_multiple(SIZE, p->twice[i], factor, p->again[e]);
        }
    for (int i = 0; i < IMPLICIT; ++i)
        for (int e = 0; e < EXPLICIT; ++e) {
            p->across[i][e] = k->across[i][e];
            p->across_once[i][e] = p->once[i][s->explicit[e]];
        }
}

/* weighted sums over the pairs: of mu^(p - 1) S^-1 in `of`, of mu^(p - 1) in `ones`, p = 0 to 4 */
struct powers {
    double of[5][IMPLICIT][INNER], ones[5];
};

static void add_to_powers(struct powers *powers, double inverse[IMPLICIT][2 * INNER], double step,
                          double re, double im, double weight_re, double weight_im)
{
    double square = re * re + im * im;
    double a = (weight_re * re + weight_im * im) / square;
    double b = (weight_im * re - weight_re * im) / square;
    double scale = 1 / step;
    for (int p = 0; p < 5; ++p) {
        double f = a * scale, g = b * scale, next = a * re - b * im;
        for (int i = 0; i < IMPLICIT; ++i)
            for (int c = 0; c < INNER; ++c)
                powers->of[p][i][c] += f * inverse[i][c] - g * inverse[i][INNER + c];
        powers->ones[p] += f;
        b = a * im + b * re;
        a = next;
        scale *= step;
    }
}

/* invert the Schur complements of all pairs */
static int invert_stages(struct interval *k, const struct scales *s, const struct rule *rule,
                         const struct products *p, struct powers *powers)
{
    double first[IMPLICIT][INNER], second[IMPLICIT][INNER], third[IMPLICIT][INNER];
    for (int i = 0; i < IMPLICIT; ++i)
        for (int c = 0; c < INNER; ++c) {
            int column = c < IMPLICIT ? s->implicit[c] : 0;
            first[i][c] = c < IMPLICIT ? p->implicit[i][column] : 0;
            second[i][c] = c < IMPLICIT ? p->once[i][column] : 0;
            third[i][c] = c < IMPLICIT ? p->twice[i][column] : 0;
        }
    memset(powers, 0, sizeof *powers);
    for (int j = 0; j < PAIRS; ++j) {
        double re = rule->eigenvalue[j], im = rule->eigenvalue[PAIRS + j];
        double a = k->step * re, b = k->step * im;
        double a2 = a * a - b * b, b2 = 2 * a * b, a3 = a2 * a - b2 * b, b3 = a2 * b + b2 * a;
        double system[IMPLICIT][2 * INNER], inverse[IMPLICIT][2 * INNER];
        for (int i = 0; i < IMPLICIT; ++i) {
            for (int c = 0; c < INNER; ++c) {
                system[i][c] = -(a * first[i][c] + a2 * second[i][c] + a3 * third[i][c]);
                system[i][INNER + c] = -(b * first[i][c] + b2 * second[i][c] + b3 * third[i][c]);
            }
            system[i][i] += 1;
        }
        memcpy(inverse, system, sizeof system);
        if (!invert(inverse) || may_be_singular(system, inverse)) return 0;
        add_to_powers(powers, inverse, k->step, re, im, rule->weight[j], rule->weight[PAIRS + j]);
        for (int i = 0; i < IMPLICIT; ++i)
            for (int c = 0; c < IMPLICIT; ++c) {
                k->inverse[i][c][j] = inverse[i][c];
                k->inverse[i][c][PAIRS + j] = inverse[i][INNER + c];
            }
    }
    return 1;
}

/*
 * The weighted sums of mu^p times the implicit stages of all columns, p = 0 to 2.
 *
 * In the columns of the implicit unknowns these are also (S^-1 - I) / mu, without any product; but
 * for p = 0 the difference would cost digits on short steps.
 */
static void find_moments(const struct scales *s, const struct products *p,
                         const struct powers *powers, double moments[3][IMPLICIT][SIZE])
{
    memset(moments, 0, 3 * sizeof *moments);
    for (int i = 0; i < IMPLICIT; ++i)
        for (int c = 0; c < IMPLICIT; ++c) {
            double *row = moments[0][i];
            add_multiple(SIZE, row, powers->of[1][i][c], p->implicit[c]);
            add_multiple(SIZE, row, powers->of[2][i][c], p->once[c]);
            add_multiple(SIZE, row, powers->of[3][i][c], p->twice[c]);
        }
    for (int n = 1; n < 3; ++n)
        for (int i = 0; i < IMPLICIT; ++i) {
            double row[EXPLICIT + 1], *moment = moments[n][i];
            memset(row, 0, sizeof row);
            for (int c = 0; c < IMPLICIT; ++c) {
                add_multiple(EXPLICIT, row, powers->of[n + 1][i][c], p->across[c]);
                add_multiple(EXPLICIT, row, powers->of[n + 2][i][c], p->across_once[c]);
            }
            for (int e = 0; e < EXPLICIT; ++e) moment[s->explicit[e]] = row[e];
            for (int c = 0; c < IMPLICIT; ++c) moment[s->implicit[c]] = powers->of[n][i][c];
            moment[s->implicit[i]] -= powers->ones[n];
        }
}

/* factorise the stages of an interval and find d z_1 / d z_0; 0 if they are singular */
static int factorise_stages(struct interval *k, const struct scales *s, const struct rule *rule,
                            const double *jacobian, double transition[SIZE][SIZE])
{
    struct products p;
    struct powers powers;
    double moments[3][IMPLICIT][SIZE], h = k->step;
    memcpy(k->jacobian, jacobian, sizeof k->jacobian);
    multiply_rows(k, s, &p);
    if (!invert_stages(k, s, rule, &p, &powers)) return 0;
    find_moments(s, &p, &powers, moments);
    for (int i = 0; i < IMPLICIT; ++i) {
        double *row = transition[s->implicit[i]];
        for (int j = 0; j < SIZE; ++j) row[j] = h * moments[0][i][j];
    }
    for (int i = 0; i < EXPLICIT; ++i) {
        double *row = transition[s->explicit[i]];
        for (int j = 0; j < SIZE; ++j) row[j] = p.explicit[i][j] + h / 2 * p.again[i][j];
        for (int c = 0; c < IMPLICIT; ++c) {
            if (k->down[i][c] != 0) add_multiple(SIZE, row, k->down[i][c], moments[1][c]);
            if (k->down_again[i][c] != 0)
                add_multiple(SIZE, row, k->down_again[i][c], moments[2][c]);
        }
        for (int j = 0; j < SIZE; ++j) row[j] *= h;
    }
    for (int i = 0; i < SIZE; ++i) transition[i][i] += 1;
    return 1;
}

/* a += mu b, pair by pair */
static inline void add_times(const double mu[LANES], double *a, const double *b)
{
    INDEPENDENT
    for (int j = 0; j < PAIRS; ++j) {
        double re = mu[j] * b[j] - mu[PAIRS + j] * b[PAIRS + j];
        double im = mu[j] * b[PAIRS + j] + mu[PAIRS + j] * b[j];
        a[j] += re;
        a[PAIRS + j] += im;
    }
}

/* x of (I - mu J) x = r for all pairs */
static void solve_stages(const struct interval *k, const struct scales *s, const struct rule *rule,
                         double r[SIZE][LANES], double x[SIZE][LANES])
{
    double mu[LANES], among[EXPLICIT][LANES], rhs[IMPLICIT][LANES], moved[IMPLICIT][LANES];
    for (int l = 0; l < LANES; ++l) mu[l] = k->step * rule->eigenvalue[l];
    memset(among, 0, sizeof among);
    memset(moved, 0, sizeof moved);
    for (int i = 0; i < EXPLICIT; ++i)
        for (int e = 0; e < EXPLICIT; ++e)
            if (k->among[i][e] != 0)
                add_multiple(LANES, among[i], k->among[i][e], r[s->explicit[e]]);
    for (int i = 0; i < IMPLICIT; ++i) {
        double once[LANES], twice[LANES];
        memset(once, 0, sizeof once);
        memset(twice, 0, sizeof twice);
        for (int e = 0; e < EXPLICIT; ++e) {
            double factor = k->across[i][e];
            if (factor == 0) continue;
            add_multiple(LANES, once, factor, r[s->explicit[e]]);
            add_multiple(LANES, twice, factor, among[e]);
        }
        add_times(mu, once, twice);
        memcpy(rhs[i], r[s->implicit[i]], sizeof rhs[i]);
        add_times(mu, rhs[i], once);
    }
    for (int i = 0; i < IMPLICIT; ++i) {
        double re[PAIRS], im[PAIRS], *solved = x[s->implicit[i]];
        for (int j = 0; j < PAIRS; ++j) re[j] = im[j] = 0;
        for (int c = 0; c < IMPLICIT; ++c) {
            const double *a = k->inverse[i][c], *b = rhs[c];
            for (int j = 0; j < PAIRS; ++j) {
                re[j] += a[j] * b[j] - a[PAIRS + j] * b[PAIRS + j];
                im[j] += a[j] * b[PAIRS + j] + a[PAIRS + j] * b[j];
            }
        }
        memcpy(solved, re, sizeof re);
        memcpy(solved + PAIRS, im, sizeof im);
        add_times(mu, moved[i], solved);
    }
    for (int i = 0; i < EXPLICIT; ++i) {
        double once[LANES], twice[LANES], *solved = x[s->explicit[i]];
        memcpy(once, r[s->explicit[i]], sizeof once);
        memcpy(twice, among[i], sizeof twice);
        for (int c = 0; c < IMPLICIT; ++c) {
            if (k->down[i][c] != 0) add_multiple(LANES, once, k->down[i][c], moved[c]);
            if (k->down_again[i][c] != 0)
                add_multiple(LANES, twice, k->down_again[i][c], moved[c]);
        }
        add_times(mu, once, twice);
        memcpy(solved, once, sizeof once);
    }
}

/* what the residual of the stages adds to the end of an interval, shape (m,) */
static void force_stages(struct interval *k, const struct scales *s, const struct rule *rule,
                         const double (*residual)[SIZE], double *end)
{
    double r[SIZE][LANES];
    memset(r, 0, sizeof r);
    for (int i = 0; i < STAGES; ++i)
        for (int j = 0; j < SIZE; ++j) add_multiple(LANES, r[j], residual[i][j], rule->split[i]);
    solve_stages(k, s, rule, r, k->forced);
    for (int j = 0; j < SIZE; ++j) end[j] = k->step * dot(LANES, k->forced[j], rule->advance);
}

/* the correction of the stages that that of the node before makes necessary */
static void correct_stages(const struct interval *k, const struct scales *s,
                           const struct rule *rule, const double *node, double (*stages)[SIZE])
{
    double r[SIZE][LANES], x[SIZE][LANES], by_lane[LANES][SIZE];
    for (int i = 0; i < SIZE; ++i) {
        double rate = dot(SIZE, k->jacobian[i], node);
        for (int l = 0; l < LANES; ++l) r[i][l] = rate * rule->constant[l];
    }
    solve_stages(k, s, rule, r, x);
    for (int l = 0; l < LANES; ++l)
        for (int j = 0; j < SIZE; ++j) by_lane[l][j] = x[j][l] - k->forced[j][l];
    for (int i = 0; i < STAGES; ++i) {
        memset(stages[i], 0, sizeof stages[i]);
        for (int l = 0; l < LANES; ++l) add_multiple(SIZE, stages[i], rule->join[i][l], by_lane[l]);
    }
}
#else

/*
 * The stage equations with the Jacobian of every stage.
 *
 * The rates of the explicit unknowns depend on one another through blocks J_EE(i) of which any two
 * multiply to zero, so that (I - h J_EE A)^-1 = I + h J_EE A over all stages, and only the TERMS
 * equations of the implicit unknowns are factorised.
 */

/* out = J_ab(i) x for the rows a and columns b of one stage, `width` right-hand sides at once */
static inline void add_product(const double jacobian[SIZE][SIZE], int rows, const int *row,
                               int columns, const int *column, int width, double factor,
                               const double *x, double *out)
{
    for (int i = 0; i < rows; ++i)
        for (int c = 0; c < columns; ++c) {
            double entry = factor * jacobian[row[i]][column[c]];
            if (entry != 0) add_multiple(width, out + i * width, entry, x + c * width);
        }
}

/* out = sum_j A_ij x_j over the stages, each of `length` numbers */
static inline void combine(const struct rule *rule, int i, int length, const double *x, double *out)
{
    memset(out, 0, length * sizeof *out);
    for (int j = 0; j < STAGES; ++j) add_multiple(length, out, rule->matrix[i][j], x + j * length);
}

/* what stage j of the implicit unknowns adds to the rates of the explicit ones at all stages */
static void find_response(const struct interval *k, const struct scales *s, const struct rule *rule,
                          int j, double *response)
{
    double direct[STAGES * CROSSED + 1], combined[CROSSED + 1];
    for (int i = 0; i < STAGES; ++i)
        for (int e = 0; e < EXPLICIT; ++e)
            for (int c = 0; c < IMPLICIT; ++c)
                direct[i * CROSSED + e * IMPLICIT + c] =
                    k->step * rule->matrix[i][j]
                    * k->jacobian[i][s->explicit[e]][s->implicit[c]];
    memcpy(response, direct, sizeof direct);
    for (int i = 0; i < STAGES; ++i) {
        combine(rule, i, CROSSED, direct, combined);
        add_product(k->jacobian[i], EXPLICIT, s->explicit, EXPLICIT, s->explicit, IMPLICIT, k->step,
                    combined, response + i * CROSSED);
    }
}

static int factorise_terms(struct interval *k, const struct scales *s, const struct rule *rule)
{
    double response[STAGES * CROSSED + 1], combined[CROSSED + 1];
    double block[IMPLICIT * IMPLICIT + 1];
    for (int j = 0; j < STAGES; ++j) {
        find_response(k, s, rule, j, response);
        for (int i = 0; i < STAGES; ++i) {
            combine(rule, i, CROSSED, response, combined);
            memset(block, 0, sizeof block);
            add_product(k->jacobian[i], IMPLICIT, s->implicit, EXPLICIT, s->explicit, IMPLICIT,
                        -k->step, combined, block);
            for (int a = 0; a < IMPLICIT; ++a) {
                const double *row = k->jacobian[i][s->implicit[a]];
                double *out = k->factors + (i * IMPLICIT + a) * UP(TERMS) + j * IMPLICIT;
                for (int c = 0; c < IMPLICIT; ++c)
                    out[c] = block[a * IMPLICIT + c] - k->step * rule->matrix[i][j] * row[s->implicit[c]];
                if (i == j) out[a] += 1;
            }
        }
    }
    return factorise(TERMS, UP(TERMS), k->factors, k->stage_pivots);
}

/* as `substitute`, for many right-hand sides */
static void substitute_many(const struct interval *k, double x[TERMS][SIZE])
{
    for (int i = 0; i < TERMS; ++i)
        if (k->stage_pivots[i] != i) swap_rows(SIZE, x[i], x[k->stage_pivots[i]]);
    for (int i = 0; i < TERMS; ++i) {
        const double *row = k->factors + i * UP(TERMS);
        for (int j = 0; j < i; ++j) add_multiple(SIZE, x[i], -row[j], x[j]);
    }
    for (int i = TERMS - 1; i >= 0; --i) {
        const double *row = k->factors + i * UP(TERMS);
        for (int j = i + 1; j < TERMS; ++j) add_multiple(SIZE, x[i], -row[j], x[j]);
        for (int c = 0; c < SIZE; ++c) x[i][c] /= row[i];
    }
}

/*
 * Replace right-hand sides r_i by k_i of ``k_i = h J_i sum_j a_ij k_j + r_i``.
 *
 * They stand as the explicit unknowns of all stages and the implicit ones, `width` side by side.
 */
static inline void solve_stages(const struct interval *k, const struct scales *s,
                                const struct rule *rule, int width, double *explicit,
                                double *implicit)
{
    enum { MOST = SIZE };
    double first[STAGES * EXPLICIT * MOST + 1], combined[SIZE * MOST];
    const int e = EXPLICIT * width, c = IMPLICIT * width;
    memcpy(first, explicit, STAGES * e * sizeof *first);
    for (int i = 0; i < STAGES; ++i) {
        combine(rule, i, e, explicit, combined);
        add_product(k->jacobian[i], EXPLICIT, s->explicit, EXPLICIT, s->explicit, width, k->step,
                    combined, first + i * e);
    }
    for (int i = 0; i < STAGES; ++i) {
        combine(rule, i, e, first, combined);
        add_product(k->jacobian[i], IMPLICIT, s->implicit, EXPLICIT, s->explicit, width, k->step,
                    combined, implicit + i * c);
    }
    if (width == 1)
        substitute(TERMS, UP(TERMS), k->factors, k->stage_pivots, implicit);
    else
        substitute_many(k, (double (*)[SIZE])implicit);
    for (int i = 0; i < STAGES; ++i) {
        combine(rule, i, c, implicit, combined);
        add_product(k->jacobian[i], EXPLICIT, s->explicit, IMPLICIT, s->implicit, width, k->step,
                    combined, explicit + i * e);
    }
    memcpy(first, explicit, STAGES * e * sizeof *first);
    for (int i = 0; i < STAGES; ++i) {
        combine(rule, i, e, explicit, combined);
        add_product(k->jacobian[i], EXPLICIT, s->explicit, EXPLICIT, s->explicit, width, k->step,
                    combined, first + i * e);
    }
    memcpy(explicit, first, STAGES * e * sizeof *first);
}

/* factorise the stages of an interval and find d z_1 / d z_0; 0 if they are singular */
static int factorise_stages(struct interval *k, const struct scales *s, const struct rule *rule,
                            const double *jacobian, double transition[SIZE][SIZE])
{
    double E[STAGES * EXPLICIT + 1][SIZE], I[TERMS + 1][SIZE];
    memcpy(k->jacobian, jacobian, sizeof k->jacobian);
    if (!factorise_terms(k, s, rule)) return 0;
    for (int i = 0; i < STAGES; ++i) {
        for (int e = 0; e < EXPLICIT; ++e)
            memcpy(E[i * EXPLICIT + e], k->jacobian[i][s->explicit[e]], sizeof *E);
        for (int c = 0; c < IMPLICIT; ++c)
            memcpy(I[i * IMPLICIT + c], k->jacobian[i][s->implicit[c]], sizeof *I);
    }
    solve_stages(k, s, rule, SIZE, (double *)E, (double *)I);
    memset(transition, 0, SIZE * sizeof *transition);
    for (int i = 0; i < STAGES; ++i) {
        double factor = k->step * rule->b[i];
        for (int e = 0; e < EXPLICIT; ++e)
            add_multiple(SIZE, transition[s->explicit[e]], factor, E[i * EXPLICIT + e]);
        for (int c = 0; c < IMPLICIT; ++c)
            add_multiple(SIZE, transition[s->implicit[c]], factor, I[i * IMPLICIT + c]);
    }
    for (int i = 0; i < SIZE; ++i) transition[i][i] += 1;
    return 1;
}

/* replace right-hand sides of the stages by their solution */
static void solve_in_place(const struct interval *k, const struct scales *s,
                           const struct rule *rule, double (*r)[SIZE])
{
    double explicit[STAGES * EXPLICIT + 1], implicit[TERMS + 1];
    for (int i = 0; i < STAGES; ++i) {
        for (int e = 0; e < EXPLICIT; ++e) explicit[i * EXPLICIT + e] = r[i][s->explicit[e]];
        for (int c = 0; c < IMPLICIT; ++c) implicit[i * IMPLICIT + c] = r[i][s->implicit[c]];
    }
    solve_stages(k, s, rule, 1, explicit, implicit);
    for (int i = 0; i < STAGES; ++i) {
        for (int e = 0; e < EXPLICIT; ++e) r[i][s->explicit[e]] = explicit[i * EXPLICIT + e];
        for (int c = 0; c < IMPLICIT; ++c) r[i][s->implicit[c]] = implicit[i * IMPLICIT + c];
    }
}

/* what the residual of the stages adds to the end of an interval, shape (m,) */
static void force_stages(struct interval *k, const struct scales *s, const struct rule *rule,
                         const double (*residual)[SIZE], double *end)
{
    memcpy(k->forced, residual, sizeof k->forced);
    solve_in_place(k, s, rule, k->forced);
    memset(end, 0, SIZE * sizeof *end);
    for (int i = 0; i < STAGES; ++i) add_multiple(SIZE, end, k->step * rule->b[i], k->forced[i]);
}

/* the correction of the stages that that of the node before makes necessary */
static void correct_stages(const struct interval *k, const struct scales *s,
                           const struct rule *rule, const double *node, double (*stages)[SIZE])
{
    for (int i = 0; i < STAGES; ++i)
        for (int j = 0; j < SIZE; ++j) stages[i][j] = dot(SIZE, k->jacobian[i][j], node);
    solve_in_place(k, s, rule, stages);
    for (int i = 0; i < STAGES; ++i) add_multiple(SIZE, stages[i], -1, k->forced[i]);
}
#endif

/* ---- Nodes ----------------------------------------------------------------------------------- */

/* the largest entries of the boundary rows, to scale them by; 0 if one is zero or not finite */
static int measure_rows(struct scales *s, const double *left, const double *right)
{
    for (int i = 0; i < SIZE; ++i) {
        const double *row = i < LEFT ? left + i * SIZE : right + (i - LEFT) * SIZE;
        double largest = 0;
        for (int j = 0; j < SIZE; ++j) {
            double entry = fabs(row[j] * s->unknown[j]);
            if (!(entry < INFINITY)) return 0;
            if (entry > largest) largest = entry;
        }
        if (largest == 0) return 0;
        s->row[i] = largest;
    }
    return 1;
}

/* eliminate a node from the rows that contain it; the last LEFT rows are carried to the next */
static int eliminate_node(struct interval *k, double panel[ROWS][WIDTH])
{
    for (int c = 0; c < SIZE; ++c) {
        int best = c;
        for (int i = c + 1; i < ROWS; ++i)
            if (fabs(panel[i][c]) > fabs(panel[best][c])) best = i;
        k->pivots[c] = best;
        if (!usable(fabs(panel[best][c]))) return 0;
        if (best != c) {
            swap_rows(WIDTH, panel[best], panel[c]);
            for (int j = 0; j < c; ++j) { /* their multipliers move with them */
                double held = k->lower[j][best];
                k->lower[j][best] = k->lower[j][c];
                k->lower[j][c] = held;
            }
        }
        const double inverse = 1 / panel[c][c];
        const int from = (c + 1) / 4 * 4;
        for (int i = c + 1; i < ROWS; ++i) {
            double factor = panel[i][c] * inverse;
            k->lower[c][i] = factor;
            if (factor != 0) add_multiple(WIDTH - from, panel[i] + from, -factor, panel[c] + from);
        }
        memcpy(k->upper[c], panel[c], sizeof panel[c]);
    }
    return 1;
}

/*
 * Factorise the linearised equations; what comes of it is kept in f. Nobody need watch.
 *
 * jacobians (N, m, m), or (N, s, m, m) with EXACT; left (l, m) and right (m - l, m): boundary rows.
 */
int factorise_system(struct factorisation *f, long long count, const struct rule *rule,
                     const double *steps, const double *jacobians, const double *left,
                     const double *right, const double *scale, const int *explicit,
                     const int *implicit, struct watch *watch)
{
    struct scales *s = &f->scales;
    double panel[ROWS][WIDTH], carried[LEFT + 1][SIZE], transition[SIZE][SIZE];
    f->rule = *rule;
    f->watch = watch;
    memcpy(s->explicit, explicit, EXPLICIT * sizeof *explicit);
    memcpy(s->implicit, implicit, IMPLICIT * sizeof *implicit);
    memcpy(s->unknown, scale, sizeof s->unknown);
    if (!measure_rows(s, left, right)) return BAD_BOUNDARY_ROW;
    for (int i = 0; i < LEFT; ++i)
        for (int j = 0; j < SIZE; ++j) carried[i][j] = left[i * SIZE + j] * scale[j] / s->row[i];
    for (long long n = 0; n < count; ++n) {
        struct interval *k = f->intervals + n;
        if (interrupted(f->watch, n)) return STOPPED;
        k->step = steps[n];
        if (!factorise_stages(k, s, &f->rule, jacobians + n * (long long)(sizeof k->jacobian / 8),
                              transition))
            return SINGULAR_STAGES;
        memset(panel, 0, sizeof panel);
        for (int i = 0; i < LEFT; ++i) memcpy(panel[i], carried[i], sizeof carried[i]);
        for (int i = 0; i < SIZE; ++i) {
            double *row = panel[LEFT + i];
            for (int j = 0; j < SIZE; ++j) row[j] = -transition[i][j] * scale[j] / scale[i];
            row[SIZE + i] = 1;
        }
        if (!eliminate_node(k, panel)) return SINGULAR_NODES;
        for (int i = 0; i < LEFT; ++i) memcpy(carried[i], panel[SIZE + i] + SIZE, sizeof carried[i]);
    }
    memcpy(f->last.factors, carried, LEFT * sizeof carried[0]);
    for (int i = 0; i < RIGHT; ++i)
        for (int j = 0; j < SIZE; ++j)
            f->last.factors[(LEFT + i) * SIZE + j] = right[i * SIZE + j] * scale[j] / s->row[LEFT + i];
    return factorise(SIZE, SIZE, f->last.factors, f->last.pivots) ? SOLVED : SINGULAR_NODES;
}

/* eliminate the nodes from the right-hand side; what is left of it stands in `nodes` */
static int substitute_forwards(struct factorisation *f, long long count, const double *stages,
                               const double *gaps, const double *left, const double *right,
                               double *nodes)
{
    const struct scales *s = &f->scales;
    double rhs[ROWS], end[SIZE];
    for (int i = 0; i < LEFT; ++i) rhs[i] = -left[i] / s->row[i];
    for (long long n = 0; n < count; ++n) {
        struct interval *k = f->intervals + n;
        if (interrupted(f->watch, n)) return STOPPED;
        force_stages(k, s, &f->rule, (const double (*)[SIZE])(stages + n * STAGES * SIZE), end);
        for (int i = 0; i < SIZE; ++i)
            rhs[LEFT + i] = (-gaps[n * SIZE + i] - end[i]) / s->unknown[i];
        for (int c = 0; c < SIZE; ++c) {
            double held = rhs[k->pivots[c]];
            rhs[k->pivots[c]] = rhs[c];
            rhs[c] = held;
        }
        for (int c = 0; c < SIZE; ++c)
            add_multiple(ROWS - c - 1, rhs + c + 1, -rhs[c], k->lower[c] + c + 1);
        memcpy(nodes + n * SIZE, rhs, SIZE * sizeof *rhs);
        memmove(rhs, rhs + SIZE, LEFT * sizeof *rhs);
    }
    for (int i = 0; i < RIGHT; ++i) rhs[LEFT + i] = -right[i] / s->row[LEFT + i];
    memcpy(nodes + count * SIZE, rhs, SIZE * sizeof *rhs);
    return SOLVED;
}

/*
 * The Newton correction of nodes (N + 1, m) and stage derivatives (N, s, m) for a residual.
 *
 * stages (N, s, m), gaps (N, m), left (l,), right (m - l,): see `Residual` of linear.py.
 */
int correct(struct factorisation *f, long long count, const double *stages, const double *gaps,
            const double *left, const double *right, double *nodes, double *corrections)
{
    const struct scales *s = &f->scales;
    if (substitute_forwards(f, count, stages, gaps, left, right, nodes)) return STOPPED;
    substitute(SIZE, SIZE, f->last.factors, f->last.pivots, nodes + count * SIZE);
    for (long long n = count - 1; n >= 0; --n) {
        double *node = nodes + n * SIZE;
        for (int i = SIZE - 1; i >= 0; --i) { /* the next node stands behind this one */
            const double *row = f->intervals[n].upper[i];
            node[i] = (node[i] - dot(2 * SIZE - i - 1, row + i + 1, node + i + 1)) / row[i];
        }
    }
    for (long long n = 0; n <= count; ++n)
        for (int i = 0; i < SIZE; ++i) nodes[n * SIZE + i] *= s->unknown[i];
    for (long long n = 0; n < count; ++n) {
        if (interrupted(f->watch, n)) return STOPPED;
        correct_stages(f->intervals + n, s, &f->rule, nodes + n * SIZE,
                       (double (*)[SIZE])(corrections + n * STAGES * SIZE));
    }
    return SOLVED;
}

/* ---- The equations --------------------------------------------------------------------------- */

/*
 * A compiled function of many points: in[0] holds points (n, m), the other inputs are the same for
 * all of them; out[0] receives F (n, m), out[1] dF/dz (n, m, m) if the function has it.
 */
typedef int batch(long long n, int chain, const double *const *in, double *const *out);

/* the boundary rows at the first and last node, and where asked for (not NULL) their Jacobians */
typedef int boundary_rows(const double *first, const double *last, double *left, double *right,
                          double *left_rows, double *right_rows);

enum { MOST_INPUTS = 8 };

struct problem {
    batch *rate, *rate_jacobian;
    boundary_rows *ends;
    const double *shared[MOST_INPUTS]; /* inputs of the functions after the first */
};

struct residual {
    double *stages, *gaps, left[LEFT + 1], right[RIGHT + 1];
};

static int all_finite(long long n, const double *x)
{
    double sum = 0; /* of zeros, unless one is not finite */
    for (long long j = 0; j < n; ++j) sum += 0 * x[j];
    return sum == 0;
}

static void find_stage_values(const struct rule *rule, double step, const double *node,
                              const double *rates, double (*values)[SIZE])
{
    for (int i = 0; i < STAGES; ++i) {
        memcpy(values[i], node, sizeof values[i]);
        for (int j = 0; j < STAGES; ++j)
            add_multiple(SIZE, values[i], step * rule->matrix[i][j], rates + j * SIZE);
    }
}

/* the residual of one interval, and if asked for its Jacobian: the mean, or those of all stages */
static int evaluate_interval(const struct problem *p, const struct rule *rule, double step,
                             const double *node, const double *rates, double *residual,
                             double *gap, double *jacobian)
{
    double values[STAGES][SIZE], rate[STAGES * SIZE], at_stages[STAGES * SIZE * SIZE];
    const double *in[1 + MOST_INPUTS];
    double *out[2] = {rate, at_stages};
    find_stage_values(rule, step, node, rates, values);
    in[0] = values[0];
    memcpy(in + 1, p->shared, sizeof p->shared);
    if ((jacobian ? p->rate_jacobian : p->rate)(STAGES, 0, in, out)) return NO_MEMORY;
    for (int j = 0; j < STAGES * SIZE; ++j) residual[j] = rates[j] - rate[j];
    for (int j = 0; j < SIZE; ++j) gap[j] = node[SIZE + j] - node[j];
    for (int i = 0; i < STAGES; ++i) add_multiple(SIZE, gap, -step * rule->b[i], rates + i * SIZE);
    if (!jacobian) return SOLVED; /* a correction that is not finite will tell */
#if EXACT
    memcpy(jacobian, at_stages, sizeof at_stages);
    if (!all_finite(STAGES * SIZE * SIZE, jacobian)) return RATE_NOT_FINITE;
#else
    memset(jacobian, 0, SIZE * SIZE * sizeof *jacobian);
    for (int i = 0; i < STAGES; ++i)
        add_multiple(SIZE * SIZE, jacobian, rule->b[i], at_stages + i * SIZE * SIZE);
    if (!all_finite(SIZE * SIZE, jacobian)) return RATE_NOT_FINITE;
#endif
    return all_finite(STAGES * SIZE, rate) ? SOLVED : RATE_NOT_FINITE;
}

/* the residual of all equations but the boundary rows, and if asked for the Jacobians */
int evaluate(const struct problem *p, long long count, const struct rule *rule,
             const double *steps, const double *nodes, const double *stages, double *residual,
             double *gaps, double *jacobians, struct watch *watch)
{
    const int block = SIZE * SIZE * (EXACT ? STAGES : 1);
    for (long long n = 0; n < count; ++n) {
        if (interrupted(watch, n)) return STOPPED;
        int failure = evaluate_interval(p, rule, steps[n], nodes + n * SIZE,
                                        stages + n * STAGES * SIZE, residual + n * STAGES * SIZE,
                                        gaps + n * SIZE, jacobians ? jacobians + n * block : NULL);
        if (failure) return failure;
    }
    return SOLVED;
}

/* ---- Newton's method ------------------------------------------------------------------------- */

/* nodes (N + 1, m) and stage derivatives (N, s, m): a point, or a correction and its size */
struct point {
    double *nodes, *stages, norm;
};

/* one run on one mesh, see newton.py; core.py has the same fields in the same order */
struct newton {
    long long count, most_iterations;
    double tolerance, kept, smallest_step;
    const struct rule *rule;
    const double *steps, *least_scale;
    const int *explicit, *implicit;
    struct problem problem;
    int (*stop)(void);
    void (*report)(double norm);
    double *nodes, *stages; /* first the guess, then the last point accepted */
    /* the last linear system, and what it was made of */
    struct factorisation *factorisation;
    double *jacobians, *left_rows, *right_rows, *scale;
    /* what comes of it */
    double norm;
    long long iterations, factorised, coarse;
};

/* what one run keeps besides */
struct run {
    struct newton *n;
    struct watch watch;
    struct point solution, trial, full, simplified, following;
    struct residual residual;
    double step;
    /* whether the simplified correction is still that of the last damped step, and its norm then */
    int remembers;
    double before_norm;
};

static double size_of(const struct run *r, const double *nodes)
{
    double sum = 0, inverse[SIZE];
    const long long rows = r->n->count + 1;
    for (int j = 0; j < SIZE; ++j) inverse[j] = 1 / r->n->scale[j];
    for (long long n = 0; n < rows; ++n) {
        double scaled[SIZE];
        for (int j = 0; j < SIZE; ++j) scaled[j] = nodes[n * SIZE + j] * inverse[j];
        sum += dot(SIZE, scaled, scaled);
    }
    return sqrt(sum / (rows * SIZE));
}

static void find_scale(struct run *r)
{
    memcpy(r->n->scale, r->n->least_scale, SIZE * sizeof(double));
    for (long long n = 0; n <= r->n->count; ++n)
        for (int j = 0; j < SIZE; ++j) {
            double size = fabs(r->solution.nodes[n * SIZE + j]);
            if (!(size <= r->n->scale[j])) r->n->scale[j] = size;
        }
}

static int find_residual(struct run *r, const struct point *at, int with_jacobians)
{
    const struct newton *n = r->n;
    const double *last = at->nodes + n->count * SIZE;
    int failure = evaluate(&n->problem, n->count, n->rule, n->steps, at->nodes, at->stages,
                           r->residual.stages, r->residual.gaps,
                           with_jacobians ? n->jacobians : NULL, &r->watch);
    if (failure) return failure;
    return n->problem.ends(at->nodes, last, r->residual.left, r->residual.right,
                           with_jacobians ? n->left_rows : NULL,
                           with_jacobians ? n->right_rows : NULL);
}

/* the correction that belongs to the residual found last */
static int measure(struct run *r, struct point *correction)
{
    int failure = correct(r->n->factorisation, r->n->count, r->residual.stages, r->residual.gaps,
                          r->residual.left, r->residual.right, correction->nodes,
                          correction->stages);
    if (failure) return failure;
    correction->norm = size_of(r, correction->nodes);
    return isfinite(correction->norm) ? SOLVED : CORRECTION_NOT_FINITE;
}

static void move(const struct run *r, const struct point *step, double factor)
{
    const long long nodes = (r->n->count + 1) * SIZE, stages = r->n->count * STAGES * SIZE;
    INDEPENDENT
    for (long long j = 0; j < nodes; ++j)
        r->trial.nodes[j] = r->solution.nodes[j] + factor * step->nodes[j];
    INDEPENDENT
    for (long long j = 0; j < stages; ++j)
        r->trial.stages[j] = r->solution.stages[j] + factor * step->stages[j];
}

static void swap_points(struct point *a, struct point *b)
{
    struct point held = *a;
    *a = *b;
    *b = held;
}

/* how far a simplified correction is from what a linear problem would have, relative to scale */
static double find_bend(struct run *r, double step)
{
    double *bend = r->following.nodes; /* free while a step is damped */
    for (long long j = 0; j < (r->n->count + 1) * SIZE; ++j)
        bend[j] = r->simplified.nodes[j] - (1 - step) * r->full.nodes[j];
    return size_of(r, bend);
}

/* the step that the nonlinearity observed at the last one allows */
static double predict(const struct run *r)
{
    if (!r->remembers) return 1;
    double size = 0, difference = 0;
    for (long long j = 0; j < (r->n->count + 1) * SIZE; ++j) {
        double before = r->simplified.nodes[j], apart = before - r->full.nodes[j];
        size += before * before;
        difference += apart * apart;
    }
    if (difference == 0) return 1;
    double ratio = sqrt(size) * r->before_norm / (sqrt(difference) * r->full.norm);
    return fmin(1, fmax(r->step * ratio, r->n->smallest_step));
}

/* move to the first point along the correction that passes the test */
static int damp(struct run *r)
{
    double step = r->step = predict(r), bent = 0, tried = 1;
    while (step >= r->n->smallest_step) {
        if (ask(&r->watch)) return STOPPED;
        move(r, &r->full, step);
        int failure = find_residual(r, &r->trial, 0);
        if (!failure) failure = measure(r, &r->simplified);
        if (failure == REFUSED || failure == CORRECTION_NOT_FINITE) {
            step /= 4;
            continue;
        }
        if (failure) return failure;
        if (r->simplified.norm <= (1 - step / 4) * r->full.norm) {
            swap_points(&r->solution, &r->trial);
            r->step = step;
            return SOLVED;
        }
        bent = find_bend(r, step);
        tried = step;
        step = fmin(step / 2, fmax(step * step * r->full.norm / (2 * bent), step / 10));
    }
    /* a wrong matrix bends the correction with the step, nonlinearity with its square */
    r->n->coarse = bent > 0.5 * tried * r->full.norm;
    return NO_STEP_HELPS;
}

/* a damped step, then corrections with the same matrix while they converge */
static int advance(struct run *r)
{
    struct newton *n = r->n;
    int failure = damp(r);
    if (failure) return failure;
    r->remembers = 1;
    r->before_norm = r->full.norm;
    double last = r->full.norm;
    while (r->step == 1 && r->simplified.norm <= fmax(n->kept * last, n->tolerance)) {
        n->norm = last = r->simplified.norm;
        move(r, &r->simplified, 1);
        if (last <= n->tolerance) {
            swap_points(&r->solution, &r->trial);
            return SOLVED;
        }
        failure = find_residual(r, &r->trial, 0);
        if (!failure) failure = measure(r, &r->following);
        if (failure) return failure;
        if (r->following.norm > last) break;
        swap_points(&r->solution, &r->trial);
        swap_points(&r->simplified, &r->following);
        r->remembers = 0;
    }
    return NOT_CONVERGED;
}

/* factorise once and move as far as the matrix is good for */
static int iterate(struct run *r)
{
    struct newton *n = r->n;
    if (ask(&r->watch)) return STOPPED;
    find_scale(r);
    int failure = find_residual(r, &r->solution, 1);
    if (failure) return failure;
    if (ask(&r->watch)) return STOPPED; /* between the two long parts */
    n->factorised = 0;
    failure = factorise_system(n->factorisation, n->count, n->rule, n->steps, n->jacobians,
                               n->left_rows, n->right_rows, n->scale, n->explicit,
                               n->implicit, &r->watch);
    if (failure) return failure;
    n->factorised = 1;
    failure = measure(r, &r->full);
    if (failure) return failure;
    n->iterations += 1;
    n->norm = r->full.norm;
    n->report(n->norm);
    if (n->norm <= n->tolerance) {
        move(r, &r->full, 1);
        swap_points(&r->solution, &r->trial);
        return SOLVED;
    }
    return advance(r);
}

/* share out memory among the points of a run; how much it takes where there is none */
static long long place_points(struct run *r, double *memory)
{
    const long long nodes = (r->n->count + 1) * SIZE, stages = r->n->count * STAGES * SIZE;
    struct point *points[] = {&r->trial, &r->full, &r->simplified, &r->following};
    long long used = 0;
    for (int i = 0; i < 4; ++i) {
        points[i]->nodes = memory + used;
        points[i]->stages = memory + used + nodes;
        used += nodes + stages;
    }
    r->residual.gaps = memory + used;
    r->residual.stages = memory + used + nodes;
    return used + nodes + stages;
}

/* solve the collocation equations on one mesh; returns why it ended */
int solve_newton(struct newton *n)
{
    struct run r = {.n = n, .watch = {.stop = n->stop}, .step = 1};
    static double none[1];
    double *memory = malloc(place_points(&r, none) * sizeof *memory);
    int outcome = NOT_CONVERGED;
    if (!memory) return NO_MEMORY;
    place_points(&r, memory);
    r.solution.nodes = n->nodes;
    r.solution.stages = n->stages;
    n->norm = INFINITY;
    n->iterations = n->factorised = n->coarse = 0;
    while (outcome == NOT_CONVERGED && n->iterations < n->most_iterations) outcome = iterate(&r);
    if (r.solution.nodes != n->nodes) {
        memcpy(n->nodes, r.solution.nodes, (n->count + 1) * SIZE * sizeof *memory);
        memcpy(n->stages, r.solution.stages, n->count * STAGES * SIZE * sizeof *memory);
    }
    free(memory);
    return outcome;
}
