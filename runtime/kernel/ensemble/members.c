/* Single members of an ensemble: run, judged by a second run, and written. */
#include "ensemble.h"

#include <stdlib.h>
#include <string.h>

#include "member.h"

enum { SLICE = 4096, SMOOTH_RECORDS = 16, INSTANTS = 16 };

/* ---- the room of a thread */

static void *take(char **next, size_t count, size_t size)
{
    void *taken = *next;
    if (*next) *next += (count * size + 15) / 16 * 16;
    return taken;
}

/* Room for events: four for each instant, and at one of them many for everything that may switch. */
static size_t n_events(const mech_model *m) { return m->hybrid ? 4 * INSTANTS + 256 + 64 * (size_t)m->nz : 0; }

static int n_records(const mech_ensemble *e)
{
    return !mech_keeps_steps(e) ? 0 : e->model->hybrid ? 1 : SMOOTH_RECORDS;
}

/* Sets the pointers of the room into a block, NULL: gives its size all the same. */
size_t mech_room_in(mech_room *r, const mech_ensemble *e, char *block)
{
    const mech_model *m = e->model;
    const mech_options *o = e->options;
    const size_t number = sizeof(mech_real), ny = (size_t)(m->nq + m->nv + m->nx), nz = (size_t)m->nz;
    const size_t grid = (size_t)o->n_grid, kept = (size_t)e->n_kept;
    const size_t dense = 2 + (size_t)mech_method_n_dense(o->method) * ny;
    char *const base = block ? block : (char *)16; /* never read */
    char *next = base;
    r->e = e;
    r->p = take(&next, (size_t)(m->np + m->nh), number);
    r->z = take(&next, nz, number);
    r->z_before = take(&next, nz, number);
    r->y = take(&next, ny, number);
    r->plain = take(&next, ny, number);
    r->before = take(&next, ny, number);
    r->end = take(&next, ny, number);
    r->nominal = take(&next, ny, number);
    r->atol = take(&next, ny, number);
    r->u = take(&next, (size_t)m->nu, number);
    r->outputs = take(&next, (size_t)m->n_outputs, number);
    r->numbers = take(&next, (size_t)(e->n_numbers + e->n_settings), number);
    r->chosen = take(&next, (size_t)e->n_settings, number);
    r->p_set = take(&next, (size_t)m->np, 1);
    r->y_given = take(&next, ny, 1);
    r->tables = take(&next, (size_t)o->n_tables, sizeof(mech_table));
    r->table_values = take(&next, (size_t)o->n_tables, number);
    r->grid_y = take(&next, grid * ny, number);
    r->other_y = take(&next, grid * ny, number);
    r->grid_z = take(&next, grid * nz, number);
    r->other_z = take(&next, grid * nz, number);
    r->record = take(&next, (size_t)n_records(e) * dense, number);
    r->kept = take(&next, kept, number);
    r->other_kept = take(&next, kept, number);
    r->events = take(&next, n_events(m), sizeof(mech_event));
    r->instants = take(&next, m->hybrid ? INSTANTS * (1 + 2 * (ny + nz)) : 0, number);
    r->watch = take(&next, mech_watch_bytes(e), 1);
    return (size_t)(next - base);
}

size_t mech_room_bytes(const mech_ensemble *e)
{
    mech_room r;
    return mech_room_in(&r, e, NULL);
}

/* ---- one run */

static int enough(const mech_ensemble *e, const mech_report *report, long most)
{
    return (most && report->steps >= most) || *e->stopped;
}

/* Runs from the start of the room to the stop; end state in `end`, rows in grid_y and grid_z, kept numbers in out. 0, or 1
 * where memory is missing. */
static int run(mech_room *r, const mech_options *options, long most, mech_real *end, mech_real *out, mech_outcome *told)
{
    const mech_ensemble *e = r->e;
    const mech_model *m = e->model;
    const int records = n_records(e), n_dense = mech_method_n_dense(options->method);
    const size_t ny = (size_t)(m->nq + m->nv + m->nx), row = 2 + (size_t)n_dense * ny;
    mech_options o = *options;
    o.record = records ? r->record : NULL;
    o.record_capacity = records;
    o.events = m->hybrid ? r->events : NULL;
    o.instants = m->hybrid ? r->instants : NULL;
    o.event_capacity = (long)n_events(m);
    o.instant_capacity = m->hybrid ? INSTANTS : 0;
    mech_solver *s = mech_create(m, &o);
    if (!s) return 1;
    memcpy(r->z_before, r->z, (size_t)m->nz * sizeof(mech_real));
    mech_watch_begin(r);
    mech_report *report = &told->report;
    long slice = 0; /* what happens at the start happens */
    int status;
    do {
        const long left = slice && most ? most - (long)report->steps : slice;
        status = mech_advance(s, e->stop, left < slice ? left : slice);
        mech_read(s, report, end);
        if (m->hybrid) {
            mech_watch_events(r, r->events, report->n_events);
            mech_set_events(s, r->events, o.event_capacity, r->instants, INSTANTS);
        }
        for (long k = 0; k < report->n_record; k++)
            mech_watch_step(r, r->record + (size_t)k * row, n_dense, m->hybrid ? r->z_before : r->z);
        if (records) mech_set_record(s, r->record, records);
        if (m->hybrid) mech_read_discretes(s, r->z_before);
        if (records && (m->hybrid || slice == 0)) mech_watch_jump(r, report->t, end, m->hybrid ? r->z_before : r->z);
        if (status == MECH_RECORD_FULL || status == MECH_EVENTS_FULL) status = MECH_RUNNING;
        slice = m->hybrid && records ? 1 : SLICE; /* what events change holds for the next step */
    } while (status == MECH_RUNNING && !enough(e, report, most));
    told->status = status;
    mech_watch_end(r, report->t, end, m->hybrid ? r->z_before : r->z, out);
    mech_free(s);
    return 0;
}

static mech_options with_tolerance(mech_room *r, mech_real rtol, mech_real dt, mech_real dt_max, mech_real *rows,
                                   mech_real *discretes)
{
    const int ny = r->e->model->nq + r->e->model->nv + r->e->model->nx;
    mech_options o = r->options;
    for (int i = 0; i < ny; i++) r->atol[i] = rtol * r->nominal[i];
    o.atol = r->atol;
    o.rtol = rtol;
    o.dt = dt;
    o.dt_max = dt_max;
    o.grid_y = rows;
    o.grid_z = discretes;
    return o;
}

static mech_real row_error(const mech_room *r, const mech_real *y, const mech_real *other, mech_real factor, mech_real error)
{
    const int ny = r->e->model->nq + r->e->model->nv + r->e->model->nx;
    for (int i = 0; i < ny; i++) {
        const mech_real e = factor * mech_abs(y[i] - other[i]) / (r->nominal[i] + mech_abs(other[i]));
        if (!(e <= error)) error = e;
    }
    return error;
}

void mech_member_compare(const mech_room *r, const mech_outcome *main, const mech_outcome *other, mech_real factor,
                         mech_member *told, mech_real *errors)
{
    const mech_ensemble *e = r->e;
    const size_t ny = (size_t)(e->model->nq + e->model->nv + e->model->nx);
    told->companion = other->status == main->status ? 1 : -1;
    if (told->companion < 0) return;
    mech_real error = MECH_EPSILON * mech_sqrt(mech_max((mech_real)main->report.steps, 1));
    const long rows = main->report.n_grid < other->report.n_grid ? main->report.n_grid : other->report.n_grid;
    for (long k = 0; k < rows; k++)
        error = row_error(r, r->grid_y + (size_t)k * ny, r->other_y + (size_t)k * ny, factor, error);
    told->error = row_error(r, r->end, r->before, factor, error);
    for (int k = 0; k < e->n_kept; k++) errors[k] = factor * mech_abs(r->kept[k] - r->other_kept[k]);
}

/* A second, tighter run, and how far the first one is off. 0, or 1 where memory is missing. */
static int compare(mech_room *r, const mech_outcome *main, mech_member *told, mech_real *errors)
{
    const mech_ensemble *e = r->e;
    const mech_companion *c = &e->companion;
    mech_real factor = c->factor;
    long most = 0;
    if (c->most) most = main->report.steps > c->most / 10 ? (long)(10 * main->report.steps) : c->most;
    mech_outcome other;
    mech_options o = with_tolerance(r, c->rtol, c->dt, c->dt_max, r->other_y, r->other_z);
    o.halves = 1;
    if (run(r, &o, most, r->before, r->other_kept, &other)) return 1;
    if (other.status == MECH_RUNNING && most && !*e->stopped) {
        o = with_tolerance(r, c->loose_rtol, c->dt, c->dt_max, r->other_y, r->other_z);
        o.halves = 1;
        factor = c->loose_factor;
        if (run(r, &o, 0, r->before, r->other_kept, &other)) return 1;
    }
    mech_member_compare(r, main, &other, factor, told, errors);
    return 0;
}

static void write_series(mech_room *r, long rows, mech_real *out)
{
    const mech_ensemble *e = r->e;
    const mech_model *m = e->model;
    const long n = e->options->n_grid;
    const size_t ny = (size_t)(m->nq + m->nv + m->nx);
    int outputs = 0;
    for (int k = 0; k < e->n_series; k++) outputs |= e->series[k].array == MECH_IN_OUTPUTS;
    for (long i = 0; i < n; i++) {
        const mech_real *y = r->grid_y + (size_t)i * ny;
        const mech_real *z = m->hybrid ? r->grid_z + (size_t)i * (size_t)m->nz : r->z;
        if (outputs && i < rows) mech_member_outputs(r, r->options.grid[i], y, z, r->u, r->outputs);
        for (int k = 0; k < e->n_series; k++) {
            const mech_place *place = &e->series[k];
            const mech_real *from = place->array == MECH_IN_Y ? y : place->array == MECH_IN_Z ? z : r->outputs;
            out[k * n + i] = i < rows ? from[place->index] : (mech_real)NAN;
        }
    }
}

/* ---- a member, and all of them */

static void write_undefined(const mech_ensemble *e, long k)
{
    const size_t n = (size_t)e->n_kept, rows = (size_t)e->n_series * (size_t)e->options->n_grid;
    for (size_t i = 0; i < n; i++) e->kept_values[(size_t)k * n + i] = (mech_real)NAN;
    for (size_t i = 0; i < rows; i++) e->series_values[(size_t)k * rows + i] = (mech_real)NAN;
}

static int ended(int status) { return status == MECH_REACHED || status == MECH_TERMINATED; }

void mech_member_waits(const mech_ensemble *e, long k, mech_member *told)
{
    *told = (mech_member){.t = (mech_real)NAN, .error = (mech_real)NAN, .failed_value = (mech_real)NAN, .index = -1};
    for (int i = 0; i < e->n_kept; i++) e->kept_errors[k * e->n_kept + i] = (mech_real)NAN;
    write_undefined(e, k);
}

int mech_member_ran(mech_room *r, long k, const mech_outcome *main, mech_member *told)
{
    const mech_ensemble *e = r->e;
    const size_t ny = (size_t)(e->model->nq + e->model->nv + e->model->nx), n = (size_t)e->n_kept;
    told->t = main->report.t;
    told->failed_value = main->report.failed_value;
    told->steps = main->report.steps;
    told->status = main->status;
    told->index = main->report.failed_index;
    told->part = main->report.failed_part;
    told->stiff = main->report.stiff_time == main->report.stiff_time;
    memcpy(e->ends + (size_t)k * ny, r->end, ny * sizeof(mech_real));
    write_series(r, main->report.n_grid, e->series_values + (size_t)k * (size_t)e->n_series * (size_t)e->options->n_grid);
    if (ended(main->status)) memcpy(e->kept_values + (size_t)k * n, r->kept, n * sizeof(mech_real));
    return ended(main->status);
}

int mech_member_make(mech_room *r, long k, mech_member *told)
{
    const mech_ensemble *e = r->e;
    const size_t ny = (size_t)(e->model->nq + e->model->nv + e->model->nx), n = (size_t)e->n_kept;
    const mech_options *all = e->options;
    r->values = e->values + (size_t)k * (size_t)e->n_varied;
    const int stage = mech_member_start(r, told);
    memcpy(e->ends + (size_t)k * ny, r->y, ny * sizeof(mech_real));
    told->t = all->t0;
    if (stage != MECH_MEMBER_RAN) return stage;
    mech_outcome main;
    const mech_options o = with_tolerance(r, all->rtol, all->dt, all->dt_max, r->grid_y, r->grid_z);
    if (run(r, &o, e->max_steps, r->end, r->kept, &main)) return MECH_MEMBER_MEMORY;
    if (main.status == MECH_RUNNING && *e->stopped) return MECH_MEMBER_WAITS;
    if (!mech_member_ran(r, k, &main, told)) return stage;
    if (e->estimated[k] && compare(r, &main, told, e->kept_errors + (size_t)k * n)) return MECH_MEMBER_MEMORY;
    return *e->stopped && e->estimated[k] && !told->companion ? MECH_MEMBER_WAITS : stage;
}
