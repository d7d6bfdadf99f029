/* The equations of the problem: their residual, and the Jacobians that a factorisation takes. */

/*
 * A compiled function of many points: in[0] holds points (n, m), the other inputs are the same for
 * all of them; out[0] receives F (n, m), out[1] dF/dz (n, m, m) if the function has it.
 */
typedef int batch(long long n, int chain, const double *const *in, double *const *out);

/* the boundary rows at the first and last node, and where asked for (not NULL) their Jacobians */
typedef int boundary_rows(const double *first, const double *last, double *left, double *right,
                          double *left_rows, double *right_rows);

/* the gap (m,) at a junction between two nodes (2, m), and if asked for its rows (m, 2 m) */
typedef int junction_rows(long long junction, const double *nodes, double *gap, double *rows);

enum { MOST_INPUTS = 8 };

struct problem {
    batch *rate, *rate_jacobian;
    boundary_rows *ends;
    junction_rows *junction;
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
