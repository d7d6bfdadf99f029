/* The node equations: factorised interval by interval, and solved for corrections. */

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

/* the rows of a junction between two nodes at the same time, see junctions.py */
static void join_nodes(const double *rows, const double *scale, double panel[ROWS][WIDTH])
{
    for (int i = 0; i < SIZE; ++i)
        for (int j = 0; j < 2 * SIZE; ++j)
            panel[LEFT + i][j] = rows[2 * SIZE * i + j] * scale[j % SIZE] / scale[i];
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
 * Factorise the linearised equations; what comes of it is kept in f. Nobody need watch; who
 * does is asked by `correct`, too.
 *
 * jacobians (N, m, m), or (N, s, m, m) with EXACT; left (l, m) and right (m - l, m): boundary rows.
 * At `junctions` intervals of no length, in order, rows (m, 2 m) stand for the step.
 */
int factorise_system(struct factorisation *f, long long count, const struct rule *rule,
                     const double *steps, const double *jacobians, const double *left,
                     const double *right, const double *scale, const int *explicit,
                     const int *implicit, const struct junctions *junctions, struct watch *watch)
{
    long long passed = 0;
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
        if (passed < junctions->count && junctions->intervals[passed] == n)
            join_nodes(junctions->rows + 2 * SIZE * SIZE * passed++, scale, panel);
        else
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
