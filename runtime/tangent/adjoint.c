/* The discrete adjoint of the explicit method of order 8: backwards over the steps that a run has made.
 *
 * Of each step the state at its beginning is known (a checkpoint); its stages are computed again, then each is pulled back
 * by the transposed derivative of the rates (Griewank, Walther, Evaluating Derivatives, ch. 15; Hager 2000). The lengths
 * of the steps count as given. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "dop853_tableau.h"
#include "solver.h"

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef ptrdiff_t size;

typedef struct {
    mech_function *rhs, *inputs, *goal, *pull_back;
    size ny, nu, nz, n_free, n_steps, n_tabled, n_rotations;
    const int *rotations; /* first index in y of four                                                  */
    const int *tabled;    /* index in u of the inputs that tables give                                 */
    const double *z;      /* [nz] discrete variables without seeds                                     */
    const double *p;
    const double *t, *h;  /* [n_steps]                                                                 */
    const double *y;      /* [n_steps + 1][ny], at the beginning of each step, and at the end          */
    const double *from_tables; /* [n_steps][STAGES][n_tabled]                                          */
    double rate;          /* how the goal counts along the motion: 1 for an integral, else 0           */
    double *lambda;       /* [ny]: in: derivative of the goal by the last state; out: by the first     */
    double *gradient;     /* [n_free]: what belongs to parameters and inputs is added                  */
    double *integral;     /* the goal along the motion is added                                        */
} sweep_record;

typedef int advance_function(mech_solver *, double, long);
typedef void read_function(const mech_solver *, mech_report *, double *);

EXPORT int mech_adjoint_stages(void);
EXPORT int mech_adjoint_steps(mech_solver *s, advance_function *advance, read_function *read, double stop, size ny,
                              size room, mech_report *report, double *t, double *y, size *count);
EXPORT int mech_adjoint_sweep(const sweep_record *s);

int mech_adjoint_stages(void)
{
    return STAGES;
}

/* Up to `room` steps of a run one by one: times t and states y [ny] at their ends, so many as `count` says. The functions are
 * those of the kernel, which is another library. */
int mech_adjoint_steps(mech_solver *s, advance_function *advance, read_function *read, double stop, size ny, size room,
                       mech_report *report, double *t, double *y, size *count)
{
    int status = MECH_RUNNING;
    double before;
    read(s, report, y);
    before = report->t;
    *count = 0;
    while (status == MECH_RUNNING && *count < room) {
        status = advance(s, stop, 1);
        read(s, report, y + *count * ny);
        if (report->t == before) continue;
        t[(*count)++] = before = report->t;
    }
    return status;
}

/* A rotation is scaled to unit length behind each step: what is along it, is lost. */
static void across_rotations(const sweep_record *s, const double *y, double *lambda)
{
    for (size r = 0; r < s->n_rotations; r++) {
        const double *q = y + s->rotations[r];
        double *l = lambda + s->rotations[r];
        double along = q[0] * l[0] + q[1] * l[1] + q[2] * l[2] + q[3] * l[3];
        for (int k = 0; k < 4; k++) l[k] -= along * q[k];
    }
}

/* x += a v, in vectors where the build allows them */
static void add(size n, double a, const double *restrict v, double *restrict x)
{
    if (a == 0) return;
#if defined(MECH_SIMD)
#pragma omp simd
#endif
    for (size i = 0; i < n; i++) x[i] += a * v[i];
}

int mech_adjoint_sweep(const sweep_record *s)
{
    const size n = s->ny, nu = s->nu, width = n + s->n_free;
    double *room = calloc((size_t)((3 * STAGES) * n + STAGES * nu + s->nz + n + 1 + width + 1), sizeof(double));
    if (!room) return 0;
    double *k = room, *ys = k + STAGES * n, *bar = ys + STAGES * n, *us = bar + STAGES * n;
    double *z = us + STAGES * nu, *seeds = z + s->nz, *out = seeds + n + 1, *g = out + width;
    if (s->nz) memcpy(z, s->z, (size_t)s->nz * sizeof(double));
    for (size m = s->n_steps - 1; m >= 0; m--) {
        const double t = s->t[m], h = s->h[m], *y = s->y + m * n;
        across_rotations(s, y + n, s->lambda);
        for (int j = 0; j < STAGES; j++) {
            double *x = ys + j * n, *u = us + j * nu, at = t + TABLEAU.c[j + 1] * h;
            memcpy(x, y, (size_t)n * sizeof(double));
            for (int l = 0; l < j; l++) add(n, h * TABLEAU.a[j + 1][l + 1], k + l * n, x);
            if (nu) s->inputs(at, x, NULL, z, s->p, u);
            for (size l = 0; l < s->n_tabled; l++)
                u[s->tabled[l]] = s->from_tables[(m * STAGES + j) * s->n_tabled + l];
            if (j + 1 < STAGES) s->rhs(at, x, u, z, s->p, k + j * n);
            if (s->rate != 0 && TABLEAU.b[j + 1] != 0) {
                s->goal(at, x, u, z, s->p, g);
                *s->integral += h * TABLEAU.b[j + 1] * *g;
            }
        }
        memset(bar, 0, (size_t)(STAGES * n) * sizeof(double));
        for (int j = 0; j < STAGES; j++) add(n, h * TABLEAU.b[j + 1], s->lambda, bar + j * n);
        for (int j = STAGES - 1; j >= 0; j--) {
            memcpy(seeds, bar + j * n, (size_t)n * sizeof(double));
            seeds[n] = s->rate * h * TABLEAU.b[j + 1];
            s->pull_back(t + TABLEAU.c[j + 1] * h, ys + j * n, us + j * nu, z, s->p, out);
            add(n, 1, out, s->lambda);
            add(s->n_free, 1, out + n, s->gradient);
            for (int l = 0; l < j; l++) add(n, h * TABLEAU.a[j + 1][l + 1], out, bar + l * n);
        }
    }
    if (s->n_steps) across_rotations(s, s->y, s->lambda);
    free(room);
    return 1;
}
