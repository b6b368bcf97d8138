#include "output.h"

#include <string.h>

void mech_output_grid(mech_solver *s, mech_real t_new, mech_real h)
{
    mech_report *r = &s->run->report;
    const size_t bytes = (size_t)s->ny * sizeof(mech_real);
    const size_t nz = (size_t)s->model->nz; /* a caller that keeps no history of z gives no room for it */
    const int turns = s->model->n_rotations > 0;
    for (; r->n_grid < s->o.n_grid && s->o.grid[r->n_grid] <= t_new; r->n_grid++) {
        if (s->listener && r->n_grid >= s->told_next) {
            s->listener(r->n_grid);
            s->told_next = r->n_grid + s->told_every;
        }
        if (s->look_back) s->look_back(s, s->o.grid[r->n_grid]);
        if (s->events && s->o.grid_z) memcpy(s->o.grid_z + (size_t)r->n_grid * nz, s->o.z, nz * sizeof(mech_real));
        mech_real *row = s->o.grid_y + (size_t)r->n_grid * (size_t)s->ny;
        if (s->o.grid[r->n_grid] == t_new) {
            memcpy(row, s->y_new, bytes);
            continue;
        }
        mech_dense_at(s->dense, s->n_dense, s->ny, (s->o.grid[r->n_grid] - r->t) / h, row);
        if (turns) mech_normalise(s->model, row);
    }
}

void mech_output_record(mech_solver *s, mech_real h)
{
    mech_report *r = &s->run->report;
    const size_t n = (size_t)s->ny * (size_t)s->n_dense;
    mech_real *row = s->o.record + (size_t)r->n_record * (n + 2);
    row[0] = r->t;
    row[1] = h;
    memcpy(row + 2, s->dense, n * sizeof(mech_real));
    r->n_record++;
}
