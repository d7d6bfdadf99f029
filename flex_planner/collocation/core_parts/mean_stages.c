/*
 * The stage equations of an interval, with the mean Jacobian of its stages: see mean_stages.py.
 *
 * Complex numbers of all pairs stand side by side in lanes, real parts first.
 */

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

/* weighted sums over the pairs: of mu^(p - 1) S^-1 in `of`, of mu^(p - 1) in `ones`, p = 1 to 4 */
struct powers {
    double of[5][IMPLICIT][INNER], ones[5];
};

static void add_to_powers(struct powers *powers, double inverse[IMPLICIT][2 * INNER], double step,
                          double re, double im, double weight_re, double weight_im)
{
    double a = weight_re, b = weight_im, scale = 1;
    for (int p = 1; p < 5; ++p) {
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
