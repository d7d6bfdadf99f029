/*
 * The loop of integration.py over the intervals of a torque, where it is explained.
 *
 * One call of `step` takes equal steps of the Dormand-Prince method one after another: in[0] is the
 * state before the first, in[1] torques at the stages, in[2] lengths, in[3] physical parameters;
 * out[0] are the states after each step, out[1] and out[2] their error estimates of order 5 and 3.
 */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef int batch(long long n, int chain, const double *const *in, double *const *out);
/* torques at the stages of equal steps of an interval; NULL to stop, as where these are too many */
typedef const double *torques(long long interval, long long count);
/* whether to stop; asked before every try */
typedef int stop(void);

enum { STOPPED = -1, NO_MEMORY = -2 };

struct integration {
    batch *step;
    torques *torques;
    stop *stop;
    /* tables[c]: torques of all intervals for c steps, once they were asked for; c up to `tabled` */
    const double **tables;
    long long tabled, width, intervals, size; /* width: torques at the stages of a step */
    const double *breaks, *physical;
    double rtol, atol, safety, largest_growth;
    double *states; /* (N + 1, size), the first one given */
};

/* `step_errors` of integration.py for one step */
static double step_error(const struct integration *g, const double *before, const double *after,
                         const double *fifth, const double *third)
{
    double first = 0, second = 0;
    for (long long i = 0; i < g->size; ++i) {
        double scale = g->atol + g->rtol * fmax(fabs(before[i]), fabs(after[i]));
        first += fifth[i] / scale * (fifth[i] / scale);
        second += third[i] / scale * (third[i] / scale);
    }
    double error = first / sqrt(fmax((first + 0.01 * second) * g->size, DBL_MIN));
    return isnan(error) ? INFINITY : error;
}

/* cross an interval in equal steps; `memory` ends with the states after each of them */
static int cross(const struct integration *g, const double *state, const double *at_stages,
                 double length, long long count, double **memory, double *error)
{
    const long long block = count * g->size;
    double *grown = realloc(*memory, (3 * block + count) * sizeof *grown);
    if (!grown) return NO_MEMORY;
    *memory = grown;
    double *after = grown, *fifth = after + block, *third = fifth + block, *steps = third + block;
    for (long long n = 0; n < count; ++n) steps[n] = length / count;
    const double *in[] = {state, at_stages, steps, g->physical};
    double *out[] = {after, fifth, third};
    if (g->step(count, 1, in, out)) return NO_MEMORY;
    *error = 0;
    for (long long n = 0; n < count; ++n) {
        const double *before = n ? after + (n - 1) * g->size : state;
        *error = fmax(*error, step_error(g, before, after + n * g->size, fifth + n * g->size,
                                         third + n * g->size));
    }
    return 0;
}

/* torques of an interval, looked up where those of all intervals stand in a table */
static const double *find_torques(const struct integration *g, long long interval, long long count)
{
    if (g->stop()) return NULL;
    if (count > g->tabled) return g->torques(interval, count);
    if (!g->tables[count]) g->tables[count] = g->torques(0, count);
    return g->tables[count] ? g->tables[count] + interval * count * g->width : NULL;
}

/* fill in the states at the breaks; returns how many intervals were crossed, or why it stopped */
long long integrate(const struct integration *g)
{
    double steps = 1, *memory = NULL; /* steps that an interval needs */
    long long outcome = 0;
    for (long long k = 0; k < g->intervals && outcome == k; ++k) {
        double *state = g->states + k * g->size, error = INFINITY;
        long long count = 0;
        while (!(error <= 1)) {
            count = (long long)ceil(steps);
            const double *at_stages = find_torques(g, k, count);
            if (!at_stages) {
                outcome = STOPPED;
                break;
            }
            if (cross(g, state, at_stages, g->breaks[k + 1] - g->breaks[k], count, &memory,
                      &error)) {
                outcome = NO_MEMORY;
                break;
            }
            double needed = isfinite(error) ? pow(error, 0.125) / g->safety : g->largest_growth;
            steps = count * fmin(fmax(needed, 1 / g->largest_growth), g->largest_growth);
        }
        if (!(error <= 1)) break;
        memcpy(state + g->size, memory + (count - 1) * g->size, g->size * sizeof *memory);
        outcome = k + 1;
    }
    free(memory);
    return outcome;
}
