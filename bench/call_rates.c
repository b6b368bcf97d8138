/* Processor seconds of many evaluations of all accelerations, called from C: independent states one after the other, or each
 * state from the derivative before, as in an integrator. */
#define _POSIX_C_SOURCE 199309L
#include <string.h>
#include <time.h>

#include "model.h"

enum { MOST = 1024 };
static const double STEP = 1e-9;

typedef int casadi_function(const double **, double **, long long *, double *, int);
typedef struct task {
    const mech_model *ours;      /* either this, */
    casadi_function *theirs;     /* or this, of positions, velocities and parameters */
    double *work;
    int n, states;               /* freedoms; states of 2 n numbers in y */
    const double *y, *p, *z;     /* z: memory, of what switches */
} task;

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Accelerations behind velocities. */
static void rates(const task *of, const double *y, double *out)
{
    if (of->ours) {
        of->ours->rhs(0, y, NULL, of->z, of->p, out);
    } else {
        const double *arguments[] = {y, y + of->n, of->p};
        double *results[] = {out + of->n};
        of->theirs(arguments, results, NULL, of->work, 0);
    }
}

__attribute__((visibility("default"))) void accelerations(const task *of, double *out)
{
    for (int k = 0; k < of->states; k++) rates(of, of->y + 2 * k * of->n, out + 2 * k * of->n);
}

__attribute__((visibility("default"))) double time_of(const task *of, long calls, int chained)
{
    const int n = of->n;
    double out[2 * MOST] = {0}, y[2 * MOST];
    memcpy(y, of->y, sizeof(double) * 2 * (size_t)n);
    const double begun = seconds();
    if (chained)
        for (long k = 0; k < calls; k++) {
            rates(of, y, out);
            for (int i = 0; i < n; i++) {
                y[i] = of->y[i] + STEP * out[n + i];
                y[n + i] = of->y[n + i] + STEP * out[n + i];
            }
        }
    else
        for (long k = 0; k < calls; k++) rates(of, of->y + 2 * (k % of->states) * n, out);
    return seconds() - begun;
}
