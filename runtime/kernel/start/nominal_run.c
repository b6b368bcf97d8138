/* Nominal values of a run: by the rules, and by a cheap first run where nothing in the model gives a state a size. */
#include <stdlib.h>
#include <string.h>

#include "nominal.h"

enum { POINTS = 200, MOST_STEPS = 5000 }; /* a motion of more steps is judged by its beginning */

static const mech_real TOLERANCE = MECH_C(1e-6), ROUNDING = MECH_C(1e-12);

static void keep_largest(int ny, const mech_real *y, mech_real *largest)
{
    for (int i = 0; i < ny; i++)
        if (mech_finite(y[i])) largest[i] = mech_max(largest[i], mech_abs(y[i]));
}

/* The largest size of each state in a run with provisional nominal values. Its tolerance is loose, but not too loose: these
   may be far too large. Of a run that fails, the part before. 0, or 1 where memory is missing. */
static int run_ahead(const mech_model *m, const mech_options *given, mech_real stop, const mech_real *nominal,
                     mech_real *reached)
{
    const int ny = m->nq + m->nv + m->nx, n = stop > given->t0 ? POINTS : 1, dop853 = mech_method_index("dop853");
    const size_t numbers = (size_t)n * (size_t)(1 + ny + m->nz) + 2 * (size_t)ny;
    mech_real *grid = calloc(numbers, sizeof *grid);
    if (!grid) return 1;
    mech_real *rows = grid + n, *discretes = rows + (size_t)n * (size_t)ny, *atol = discretes + (size_t)n * (size_t)m->nz;
    mech_real *y = atol + ny;
    for (int i = 0; i < n; i++) grid[i] = n > 1 ? given->t0 + i * ((stop - given->t0) / (n - 1)) : stop;
    if (n > 1) grid[n - 1] = stop;
    for (int i = 0; i < ny; i++) atol[i] = TOLERANCE * nominal[i];
    mech_options o = *given;
    if (dop853 >= 0) o.method = dop853;
    if (dop853 >= 0) o.dt = 0;
    o.rtol = TOLERANCE;
    o.atol = atol;
    o.n_grid = n;
    o.grid = grid;
    o.grid_y = rows;
    o.grid_z = discretes;
    o.record = NULL;
    o.record_capacity = 0;
    o.dense = 0;
    o.events = NULL;
    o.instants = NULL;
    o.event_capacity = o.instant_capacity = 0;
    mech_solver *solver = mech_create(m, &o);
    if (solver) {
        mech_report r;
        mech_advance(solver, stop, MOST_STEPS);
        mech_read(solver, &r, y);
        memset(reached, 0, (size_t)ny * sizeof(mech_real));
        for (long i = 0; i < r.n_grid; i++) keep_largest(ny, rows + (size_t)i * (size_t)ny, reached);
        keep_largest(ny, y, reached);
        mech_free(solver);
    }
    free(grid);
    return !solver;
}

int mech_nominal_values(const mech_model *m, const mech_sizes *sizes, const mech_options *o, mech_real stop,
                        const mech_real *plain, mech_real *nominal)
{
    const size_t ny = (size_t)(m->nq + m->nv + m->nx);
    mech_real *work = calloc(3 * ny + (size_t)(m->nu + m->n_outputs) + 1, sizeof *work);
    if (!work) return 1;
    mech_real *reached = work + 2 * ny, *u = reached + ny;
    mech_motion x = {m, sizes, o->p, work, work + ny, 0, stop - o->t0};
    mech_look_at_start(&x, o, plain, u, u + m->nu);
    int status = 0;
    if (mech_nominal_rules(&x, NULL, NULL, nominal)) {
        status = run_ahead(m, o, stop, nominal, reached);
        for (size_t i = 0; i < ny && m->hybrid && m->hybrid->n_rows; i++) /* what frictions and contacts hold moves by rounding */
            if (reached[i] < ROUNDING * nominal[i]) reached[i] = 0;
        if (!status) mech_drop_rounding(m, sizes, reached);
        if (!status) mech_nominal_rules(&x, reached, reached, nominal);
    }
    free(work);
    return status;
}
