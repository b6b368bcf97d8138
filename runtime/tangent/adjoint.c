/* The discrete adjoint of the explicit method of order 8: backwards over the steps that a run has made.
 *
 * Of each step the state at its beginning is known (a checkpoint); its stages are computed again, then each is pulled back
 * by the transposed derivative of the rates (Griewank, Walther, Evaluating Derivatives, ch. 15; Hager 2000). The lengths
 * of the steps count as given. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "dop853_tableau.h"

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

EXPORT int mech_adjoint_stages(void);
EXPORT int mech_adjoint_sweep(const sweep_record *s);

int mech_adjoint_stages(void)
{
    return STAGES;
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
            for (size i = 0; i < n; i++) {
                double sum = 0;
                for (int l = 0; l < j; l++) sum += TABLEAU.a[j + 1][l + 1] * k[l * n + i];
                x[i] = y[i] + h * sum;
            }
            if (nu) s->inputs(at, x, NULL, z, s->p, u);
            for (size l = 0; l < s->n_tabled; l++)
                u[s->tabled[l]] = s->from_tables[(m * STAGES + j) * s->n_tabled + l];
            s->rhs(at, x, u, z, s->p, k + j * n);
            if (s->rate != 0 && TABLEAU.b[j + 1] != 0) {
                s->goal(at, x, u, z, s->p, g);
                *s->integral += h * TABLEAU.b[j + 1] * *g;
            }
        }
        for (int j = 0; j < STAGES; j++)
            for (size i = 0; i < n; i++) bar[j * n + i] = h * TABLEAU.b[j + 1] * s->lambda[i];
        for (int j = STAGES - 1; j >= 0; j--) {
            memcpy(seeds, bar + j * n, (size_t)n * sizeof(double));
            seeds[n] = s->rate * h * TABLEAU.b[j + 1];
            s->pull_back(t + TABLEAU.c[j + 1] * h, ys + j * n, us + j * nu, z, s->p, out);
            for (size i = 0; i < n; i++) s->lambda[i] += out[i];
            for (size i = 0; i < s->n_free; i++) s->gradient[i] += out[n + i];
            for (int l = 0; l < j; l++) {
                const double a = h * TABLEAU.a[j + 1][l + 1];
                if (a != 0)
                    for (size i = 0; i < n; i++) bar[l * n + i] += a * out[i];
            }
        }
    }
    if (s->n_steps) across_rotations(s, s->y, s->lambda);
    free(room);
    return 1;
}
