/*
 * Periods of a joint controller one after another, see held_periods.py.
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

/* torques at a share of a period, within the limits of the motors at the speeds of a state */
static void find_torques(const struct periods *g, const double *row, const double *feedback,
                         double share, const double *x, double *torques)
{
    const long long n = g->joints;
    const double *stall = g->controller + 2 * n, *loss = stall + n, *cap = loss + n;
    const double *first = row + 2 * n, *last = row + 3 * n;
    for (long long i = 0; i < n; ++i) {
        double lost = loss[i] * x[g->size / 2 + i];
        double lowest = -stall[i] - lost, highest = stall[i] - lost;
        double asked = first[i] + share * (last[i] - first[i]) + feedback[i];
        torques[i] = clip(asked, clip(-cap[i], lowest, highest), clip(cap[i], lowest, highest));
    }
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

/* cross a period in equal steps; the largest error of one, above 1 if it breaks the tolerances */
static double cross(const struct periods *g, const double *row, const double *state, long long steps,
                 double *after, double *memory)
{
    const long long n = g->joints, size = g->size;
    double *feedback = memory, *x = feedback + n, *rest = x + size;
    for (long long i = 0; i < n; ++i)
        feedback[i] = g->controller[i] * (row[i] - state[i])
                      + g->controller[n + i] * (row[n + i] - state[size / 2 + i]);
    memcpy(x, state, size * sizeof *x);
    double worst = 0;
    for (long long k = 0; k < steps; ++k) {
        double error = take_step(g, row, feedback, (double)k / steps, 1.0 / steps, x, after, rest);
        if (!(error <= 1)) return INFINITY;
        if (error > worst) worst = error;
        memcpy(x, after, size * sizeof *x);
    }
    return worst;
}

/* fill in the states after the periods; returns how many were crossed */
long long cross_periods(const struct periods *g)
{
    double *memory = malloc((2 * g->joints + (STAGES + 2) * g->size) * sizeof *memory);
    if (!memory) return NO_MEMORY;
    long long done = 0, steps = 1;
    for (; done < g->count; ++done) {
        const double *row = g->reference + 4 * g->joints * done;
        double *state = g->states + g->size * done;
        double error;
        while ((error = cross(g, row, state, steps, state + g->size, memory)) > 1
               && steps < g->most_steps)
            steps *= 2;
        if (error > 1) break;
        if (steps > 1 && error < HALVED) steps /= 2;
    }
    free(memory);
    return done;
}
