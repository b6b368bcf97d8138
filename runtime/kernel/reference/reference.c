/* The kernel in higher precision, for callers that have doubles only: numbers go in exactly, states come out as
 * the unevaluated sum of two doubles.
 */
#include "reference.h"

#include "projection.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

struct mech_reference {
    mech_solver *solver;
    mech_real *numbers;
    mech_table *tables;
    mech_real *y;
    int ny;
};

static mech_real *copy(mech_real **next, const double *from, long n)
{
    mech_real *to = *next;
    for (long i = 0; i < n; i++) to[i] = (mech_real)from[i];
    *next += n;
    return to;
}

/* Takes exact numbers in place of doubles that are their rounding, or that of a formula of them. */
static void take_exact(mech_real *to, const mech_real *exact, int n, unsigned char *changed)
{
    const mech_real unit = (mech_real)DBL_EPSILON;
    for (int i = 0; i < n; i++) {
        const int rounded = mech_abs(to[i] - exact[i]) <= 4 * unit * mech_abs(exact[i]);
        if (changed) changed[i] = !rounded;
        if (rounded) to[i] = exact[i];
    }
}

/* Parameters and initial values as the model states them in decimals. */
static int state_exactly(const mech_model *model, const mech_reference_case *c, mech_real *p, mech_real *y0,
                         const mech_real *z, unsigned char *set)
{
    const int ny = model->nq + model->nv + model->nx, np = model->np + model->nh;
    mech_real *numbers = calloc((size_t)(np + ny + model->nu) + 1, sizeof(mech_real));
    if (!numbers) return 0;
    mech_real *exact = numbers, *y = exact + np, *u = y + ny;
    memset(set, 0, (size_t)np + 1);
    model->parameters(exact, set);
    take_exact(p, exact, model->np, set);
    memcpy(exact, p, (size_t)np * sizeof(mech_real));
    model->parameters(exact, set); /* what depends on changed ones */
    take_exact(p, exact, model->np, NULL);
    if (model->inputs) model->inputs((mech_real)c->t0, y, u, z, p, u);
    memset(set, 1, (size_t)np + 1);
    model->parameters(p, set);
    model->initial((mech_real)c->t0, y, u, z, p, y);
    take_exact(y0, y, ny, NULL);
    free(numbers);
    return 1;
}

mech_reference *mech_reference_new(const mech_model *model, const char *method, const mech_reference_case *c)
{
    const int ny = model->nq + model->nv + model->nx, np = model->np + model->nh;
    long count = 3L * ny + model->nz + np + c->n_stops;
    for (int k = 0; k < c->n_tables; k++) count += 3L * c->tables[k].n;
    mech_reference *r = calloc(1, sizeof *r);
    unsigned char *set = malloc((size_t)(np + 1));
    if (r) r->numbers = calloc((size_t)count + 1, sizeof(mech_real));
    if (r) r->tables = calloc((size_t)c->n_tables + 1, sizeof(mech_table));
    if (!r || !set || !r->numbers || !r->tables) goto failed;
    mech_real *next = r->numbers;
    mech_options o = {.method = mech_method_index(method), .t0 = c->t0, .dt_max = c->dt_max, .rtol = c->rtol};
    mech_real *y0 = copy(&next, c->y0, ny), *z = copy(&next, c->z, model->nz);
    o.y0 = y0;
    o.z = z;
    mech_real *p = copy(&next, c->p, np);
    memset(set, 1, (size_t)np + 1);
    model->parameters(p, set);
    if (c->decimals && !state_exactly(model, c, p, y0, z, set)) goto failed;
    o.p = p;
    mech_real *atol = copy(&next, c->nominal, ny);
    for (int i = 0; i < ny; i++) atol[i] *= o.rtol;
    o.atol = atol;
    o.n_stops = c->n_stops;
    o.stops = copy(&next, c->stops, c->n_stops);
    o.n_tables = c->n_tables;
    o.tables = r->tables;
    for (int k = 0; k < c->n_tables; k++) {
        const mech_reference_table *t = c->tables + k;
        r->tables[k] = (mech_table){.input = t->input, .interpolation = t->interpolation, .n = t->n};
        r->tables[k].t = copy(&next, t->t, t->n);
        r->tables[k].value = copy(&next, t->value, t->n);
        if (t->slope) r->tables[k].slope = copy(&next, t->slope, t->n);
    }
    r->ny = ny;
    r->y = next;
    r->solver = mech_create(model, &o);
    if (!r->solver) goto failed;
    /* doubles fulfil constraints to their own digits: what the others are must not depend on the first step */
    if (model->n_velocity && !model->hybrid) mech_project(r->solver, o.t0, r->solver->y);
    mech_normalise(model, r->solver->y);
    free(set);
    return r;
failed:
    free(set);
    mech_reference_free(r);
    return NULL;
}

void mech_reference_free(mech_reference *r)
{
    if (!r) return;
    mech_free(r->solver);
    free(r->tables);
    free(r->numbers);
    free(r);
}

int mech_reference_advance(mech_reference *r, double t_end, long max_steps)
{
    return mech_advance(r->solver, (mech_real)t_end, max_steps);
}

long long mech_reference_read(const mech_reference *r, double *t, double *high, double *low)
{
    mech_report report;
    mech_read(r->solver, &report, r->y);
    *t = (double)report.t;
    for (int i = 0; i < r->ny; i++) {
        high[i] = (double)r->y[i];
        low[i] = (double)(r->y[i] - (mech_real)high[i]);
    }
    return report.evaluations;
}

double mech_reference_epsilon(void) { return (double)MECH_EPSILON; }
