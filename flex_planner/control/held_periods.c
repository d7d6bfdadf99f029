/*
 * Periods of a joint controller, or of a linear law, one after another: see held_periods.py and
 * feedback_motion.py.
 *
 * Steps are those of Cash and Karp, ACM Transactions on Mathematical Software 16 (1990), order 5
 * with an error estimate of order 4 from six stages. `rate` is the arm's x' of (x, torques).
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef int batch(long long n, int chain, const double *const *in, double *const *out);

enum { STAGES = 6, NO_MEMORY = -1 };

/* steps twice as long have an error so many times as large, with some margin */
static const double HALVED = 1.0 / 48;

static const double A[STAGES][STAGES - 1] = {
    {0},
    {1.0 / 5},
    {3.0 / 40, 9.0 / 40},
    {3.0 / 10, -9.0 / 10, 6.0 / 5},
    {-11.0 / 54, 5.0 / 2, -70.0 / 27, 35.0 / 27},
    {1631.0 / 55296, 175.0 / 512, 575.0 / 13824, 44275.0 / 110592, 253.0 / 4096}};
static const double C[STAGES] = {0, 1.0 / 5, 3.0 / 10, 3.0 / 5, 1, 7.0 / 8};
static const double B[STAGES] = {37.0 / 378, 0, 250.0 / 621, 125.0 / 594, 0, 512.0 / 1771};
/* B less the weights of order 4 */
static const double E[STAGES] = {
    37.0 / 378 - 2825.0 / 27648, 0, 250.0 / 621 - 18575.0 / 48384, 125.0 / 594 - 13525.0 / 55296,
    -277.0 / 14336, 512.0 / 1771 - 1.0 / 4};

struct periods {
    batch *rate;
    long long joints, size, count, most_steps;
    double length, rtol, atol; /* of a period [s]; of an error */
    const double *reference;   /* (count, 4 n): angles, speeds, efforts at both ends */
    const double *controller;  /* (5 n): stiffness, damping, stall torque, its loss, largest torque */
    const double *physical;
    double *states; /* (count + 1, size), the first one given */
    /* of a law, NULL for a PD: A, B, C, D, E column by column; the controller then begins with 2 n
       numbers that are not looked at, and the reference has (2 n): angles, efforts */
    const double *law;
    long long order;
    double resolution;              /* of the encoders, 0 for exact ones */
    double *law_states, *torques;   /* (count + 1, order), the first one given; (count, n) */
};

/* comparisons, where fmin and fmax are calls of the mathematical library */
static double clip(double value, double lower, double upper)
{
    return value < lower ? lower : value > upper ? upper : value;
}

static void add_multiple(long long size, double *sum, double factor, const double *values)
{
    for (long long i = 0; i < size; ++i) sum[i] += factor * values[i];
}

/* a torque within the limits of a motor at the speed of a state */
static double limit(const struct periods *g, long long i, double asked, const double *x)
{
    const long long n = g->joints;
    const double *stall = g->controller + 2 * n, *loss = stall + n, *cap = loss + n;
    double lost = loss[i] * x[g->size / 2 + i];
    double lowest = -stall[i] - lost, highest = stall[i] - lost;
    return clip(asked, clip(-cap[i], lowest, highest), clip(cap[i], lowest, highest));
}

/* torques at a share of a period; those of a law are held, within the limits when it began */
static void find_torques(const struct periods *g, const double *row, const double *feedback,
                         double share, const double *x, double *torques)
{
    const long long n = g->joints;
    const double *first = row + 2 * n, *last = row + 3 * n;
    if (g->law) memcpy(torques, feedback, n * sizeof *torques);
    else
        for (long long i = 0; i < n; ++i)
            torques[i] = limit(g, i, first[i] + share * (last[i] - first[i]) + feedback[i], x);
}

/* sum += M v, with M (rows, columns) column by column */
static void add_product(long long rows, long long columns, double *sum, const double *matrix,
                        const double *values)
{
    for (long long j = 0; j < columns; ++j)
        add_multiple(rows, sum, values[j], matrix + rows * j);
}

/* torques of a law in a state, and its next state; `memory` of 2 n */
static void sample_law(const struct periods *g, const double *row, const double *x,
                       const double *law_state, double *torques, double *following,
                       double *memory)
{
    const long long n = g->joints, m = g->order;
    const double *A = g->law, *B = A + m * m, *C = B + m * n, *D = C + n * m, *E = D + n * n;
    const double *efforts = row + n;
    const double step = g->resolution;
    double *error = memory, *added = error + n;
    for (long long i = 0; i < n; ++i)
        error[i] = (step > 0 ? floor(x[i] / step + 0.5) * step : x[i]) - row[i];
    memcpy(torques, efforts, n * sizeof *torques);
    add_product(n, m, torques, C, law_state);
    add_product(n, n, torques, D, error);
    for (long long i = 0; i < n; ++i) {
        torques[i] = limit(g, i, torques[i], x);
        added[i] = torques[i] - efforts[i];
    }
    memset(following, 0, m * sizeof *following);
    add_product(m, m, following, A, law_state);
    add_product(m, n, following, B, error);
    add_product(m, n, following, E, added);
}

/* one step from share `begin` of a period on; its error, at most 1 if the tolerances are kept */
static double take_step(const struct periods *g, const double *row, const double *feedback,
                        double begin, double part, const double *x, double *after, double *memory)
{
    const long long size = g->size;
    const double step = part * g->length;
    double *slopes = memory, *at = slopes + STAGES * size, *torques = at + size;
    for (int s = 0; s < STAGES; ++s) {
        memcpy(at, x, size * sizeof *at);
        for (int r = 0; r < s; ++r) add_multiple(size, at, step * A[s][r], slopes + r * size);
        find_torques(g, row, feedback, begin + C[s] * part, at, torques);
        const double *in[] = {at, torques, g->physical};
        double *out[] = {slopes + s * size};
        if (g->rate(1, 0, in, out)) return NAN;
    }
    double *wrong = at, error = 0;
    memcpy(after, x, size * sizeof *after);
    memset(wrong, 0, size * sizeof *wrong);
    for (int s = 0; s < STAGES; ++s) {
        add_multiple(size, after, step * B[s], slopes + s * size);
        add_multiple(size, wrong, step * E[s], slopes + s * size);
    }
    for (long long i = 0; i < size; ++i) {
        double before = fabs(x[i]), now = fabs(after[i]);
        double share = wrong[i] / (g->atol + g->rtol * (before > now ? before : now));
        error += share * share;
    }
    return sqrt(error / size);
}

/* torques that the controller adds throughout a period, or those of a law */
static void find_feedback(const struct periods *g, const double *row, long long number,
                          double *feedback, double *memory)
{
    const long long n = g->joints, m = g->order;
    const double *state = g->states + g->size * number;
    if (g->law) {
        double *now = g->law_states + m * number;
        sample_law(g, row, state, now, feedback, now + m, memory);
        memcpy(g->torques + n * number, feedback, n * sizeof *feedback);
        return;
    }
    for (long long i = 0; i < n; ++i)
        feedback[i] = g->controller[i] * (row[i] - state[i])
                      + g->controller[n + i] * (row[n + i] - state[g->size / 2 + i]);
}

/* cross a period in equal steps; the largest error of one, above 1 if it breaks the tolerances */
static double cross(const struct periods *g, const double *row, const double *feedback,
                    const double *state, long long steps, double *after, double *memory)
{
    double *x = memory, *rest = x + g->size, worst = 0;
    memcpy(x, state, g->size * sizeof *x);
    for (long long k = 0; k < steps; ++k) {
        double error = take_step(g, row, feedback, (double)k / steps, 1.0 / steps, x, after, rest);
        if (!(error <= 1)) return INFINITY;
        if (error > worst) worst = error;
        memcpy(x, after, g->size * sizeof *x);
    }
    return worst;
}

/* fill in the states after the periods; returns how many were crossed */
long long cross_periods(const struct periods *g)
{
    const long long n = g->joints, width = g->law ? 2 * n : 4 * n;
    double *feedback = malloc((4 * n + (STAGES + 2) * g->size) * sizeof *feedback);
    if (!feedback) return NO_MEMORY;
    double *memory = feedback + n;
    long long done = 0, steps = 1;
    for (; done < g->count; ++done) {
        const double *row = g->reference + width * done;
        double *state = g->states + g->size * done;
        double error;
        find_feedback(g, row, done, feedback, memory);
        while ((error = cross(g, row, feedback, state, steps, state + g->size, memory)) > 1
               && steps < g->most_steps)
            steps *= 2;
        if (error > 1) break;
        if (steps > 1 && error < HALVED) steps /= 2;
    }
    free(feedback);
    return done;
}
