/* What a factorisation consists of, the watch over long work, and small dense matrices. */

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

/* intervals of no length, in order, and what holds there in the place of a step */
struct junctions {
    long long count;
    const long long *intervals;
    double *rows; /* (count, m, 2 m) */
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
