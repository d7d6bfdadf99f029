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
