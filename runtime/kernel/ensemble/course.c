/* The runs of a member, one after the other, whoever steps them. */
#include "course.h"

#include <string.h>

#include "threads.h"

enum phase { MAIN = 0, TIGHT, LOOSE };

/* Lets a run begin at a tolerance. */
static void set_out(const mech_ensemble *e, mech_course *c, int phase, mech_real rtol, mech_real dt_max, long bound)
{
    mech_room *r = &c->room;
    const mech_options *o = e->options;
    const size_t ny = (size_t)(e->model->nq + e->model->nv + e->model->nx);
    c->phase = phase;
    c->rtol = rtol;
    c->dt_max = dt_max;
    c->bound = bound;
    for (size_t i = 0; i < ny; i++) r->atol[i] = rtol * r->nominal[i];
    mech_real *rows = mech_course_rows(c);
    for (c->n_grid = 0; c->n_grid < o->n_grid && o->grid[c->n_grid] <= o->t0; c->n_grid++)
        memcpy(rows + (size_t)c->n_grid * ny, r->y, ny * sizeof(mech_real));
    mech_watch_begin(r);
    if (mech_keeps_steps(e)) mech_watch_jump(r, o->t0, r->y, r->z);
}

int mech_course_begin(const mech_ensemble *e, mech_course *c, long k)
{
    c->k = k;
    mech_member_waits(e, k, &c->told);
    c->room.values = e->values + (size_t)k * (size_t)e->n_varied;
    c->told.stage = mech_member_start(&c->room, &c->told);
    const size_t ny = (size_t)(e->model->nq + e->model->nv + e->model->nx);
    memcpy(e->ends + (size_t)k * ny, c->room.y, ny * sizeof(mech_real));
    c->told.t = e->options->t0;
    if (c->told.stage != MECH_MEMBER_RAN) return 0;
    set_out(e, c, MAIN, e->options->rtol, e->options->dt_max, e->max_steps);
    return 1;
}

mech_real *mech_course_end(const mech_course *c) { return c->phase == MAIN ? c->room.end : c->room.before; }

mech_real *mech_course_rows(const mech_course *c) { return c->phase == MAIN ? c->room.grid_y : c->room.other_y; }

static long companion_bound(const mech_companion *c, long long steps)
{
    return !c->most ? 0 : steps > c->most / 10 ? (long)(10 * steps) : c->most;
}

int mech_course_ended(const mech_ensemble *e, mech_course *c, int status, mech_real t, mech_real steps, long n_grid,
                      mech_real stiff_time)
{
    const mech_companion *second = &e->companion;
    mech_room *r = &c->room;
    mech_outcome *told = c->phase == MAIN ? &c->main : &c->other;
    *told = (mech_outcome){.status = status};
    told->report.t = t;
    told->report.steps = (long long)steps;
    told->report.n_grid = n_grid;
    told->report.stiff_time = stiff_time;
    told->report.failed_index = -1;
    mech_watch_end(r, t, mech_course_end(c), r->z, c->phase == MAIN ? r->kept : r->other_kept);
    if (c->phase == MAIN) {
        mech_member_ran(r, c->k, &c->main, &c->told);
        if (status != MECH_REACHED || !e->estimated[c->k]) return 0;
        set_out(e, c, TIGHT, second->rtol, second->dt_max, companion_bound(second, told->report.steps));
        return 1;
    }
    if (c->phase == TIGHT && status == MECH_RUNNING) {
        set_out(e, c, LOOSE, second->loose_rtol, second->dt_max, 0);
        return 1;
    }
    const mech_real factor = c->phase == TIGHT ? second->factor : second->loose_factor;
    mech_member_compare(r, &c->main, &c->other, factor, &c->told, e->kept_errors + (size_t)c->k * (size_t)e->n_kept);
    return 0;
}

void mech_course_by_scalar(const mech_ensemble *e, mech_course *c)
{
    mech_member_waits(e, c->k, &c->told);
    c->told.stage = mech_member_make(&c->room, c->k, &c->told);
}

void mech_course_keep(const mech_ensemble *e, const mech_course *c)
{
    e->members[c->k] = c->told;
    if (c->told.stage != MECH_MEMBER_WAITS) mech_count(e->done);
}
