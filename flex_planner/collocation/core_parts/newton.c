/* Newton's method on one mesh, damped by the natural monotonicity test: see newton.py. */

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
    struct junctions junctions;
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
    for (long long j = 0; j < n->junctions.count && !failure; ++j) {
        const long long first = n->junctions.intervals[j] * SIZE;
        failure = n->problem.junction(j, at->nodes + first, r->residual.gaps + first,
                                      with_jacobians ? n->junctions.rows + 2 * SIZE * SIZE * j
                                                     : NULL);
    }
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
                               n->implicit, &n->junctions, &r->watch);
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
    /* its watch ends here */
    ((struct factorisation *)n->factorisation)->watch = NULL;
    free(memory);
    return outcome;
}
