/* The solver: creation, and all access to it but taking a run on (advance.c). */
#include "solver.h"

#include <stdlib.h>
#include <string.h>

#include "events.h"
#include "method.h"

int mech_kernel_version(void) { return MECH_KERNEL_VERSION; }

void mech_layout(size_t sizes[7])
{
    sizes[0] = sizeof(mech_model);
    sizes[1] = sizeof(mech_hybrid);
    sizes[2] = sizeof(mech_branch);
    sizes[3] = sizeof(mech_table);
    sizes[4] = sizeof(mech_options);
    sizes[5] = sizeof(mech_report);
    sizes[6] = sizeof(mech_event);
}

static size_t work_numbers(const mech_model *model, const mech_method *method, int ny)
{
    if (method->explicit_part) {
        const size_t a = work_numbers(model, method->explicit_part, ny);
        const size_t b = method->implicit_part->lacks(model) ? 0 : work_numbers(model, method->implicit_part, ny);
        return a > b ? a : b;
    }
    return (size_t)ny * (size_t)method->n_work +
           (method->n_extra && !(method->lacks && method->lacks(model)) ? method->n_extra(model) : 0);
}

/* Residuals, then a correction with residuals, a change of the coordinates, and a state. */
static size_t projection_numbers(const mech_model *model)
{
    if (!model->project_velocity) return 0;
    return (size_t)(model->n_position + 2 * model->n_velocity + 2 * (model->nq + model->nv) + model->nx);
}

/* The changing block: run, then y, dy, y_new, dy_new, work, dense, u, checks, drift, project, events, segments. */
static size_t block_numbers(const mech_model *model, const mech_method *method, int ny)
{
    return (size_t)ny * (size_t)(4 + method->n_dense) + work_numbers(model, method, ny) + (size_t)model->nu +
           (size_t)model->n_assertions + projection_numbers(model) +
           (model->hybrid ? mech_events->numbers(model) : 0);
}

mech_solver *mech_create(const mech_model *model, const mech_options *options)
{
    if (model->version != MECH_MODEL_VERSION || (model->hybrid && !mech_events)) return NULL;
    if (options->method < 0 || options->method >= mech_n_methods) return NULL;
    const mech_method *method = mech_methods[options->method];
    const int ny = model->nq + model->nv + model->nx;
    const size_t numbers = block_numbers(model, method, ny) * sizeof(mech_real);
    const size_t size = sizeof(mech_run) + numbers + (size_t)options->n_tables * sizeof(int);
    mech_solver *s = calloc(1, sizeof *s);
    mech_run *run = calloc(1, size);
    mech_event_state *events = model->hybrid ? calloc(1, sizeof *events) : NULL;
    const int delays = model->hybrid && model->hybrid->delays;
    struct mech_history *history = delays ? mech_events->new_history(model, method->n_dense, method->order) : NULL;
    if (!s || !run || (model->hybrid && !events) || (delays && !history)) {
        if (history) mech_events->free_history(history);
        free(s);
        free(run);
        free(events);
        return NULL;
    }
    s->model = model;
    s->chosen = method;
    s->method = method->explicit_part ? method->explicit_part : method;
    s->n_dense = method->n_dense;
    s->o = *options;
    s->ny = ny;
    s->size = size;
    s->run = run;
    s->y = (mech_real *)(run + 1);
    s->dy = s->y + ny;
    s->y_new = s->dy + ny;
    s->dy_new = s->y_new + ny;
    s->work = s->dy_new + ny;
    s->dense = s->work + work_numbers(model, method, ny);
    s->u = s->dense + (size_t)ny * (size_t)method->n_dense;
    s->checks = s->u + model->nu;
    s->drift = s->checks + model->n_assertions;
    s->project = model->project_velocity ? s->drift + model->n_position + model->n_velocity : NULL;
    mech_real *rest = s->drift + projection_numbers(model);
    s->events = events;
    if (events) {
        mech_events->attach(events, model, rest);
        rest += mech_events->numbers(model);
        if (method->impulses) events->n = model->hybrid->n_switches; /* rows are not events then */
        memcpy(events->z, options->z, (size_t)model->nz * sizeof(mech_real));
        s->o.z = events->z;
    }
    s->history = history;
    s->look_back = history ? mech_events->look_back : NULL;
    s->segments = (int *)rest;
    run->report.t = run->origin = options->t0;
    run->report.dt = options->dt;
    run->report.dt_min = options->dt_max;
    run->report.stiff_time = run->report.switch_time = run->halfway = (mech_real)NAN;
    run->report.method = mech_method_index(s->method->name);
    run->report.failed_index = -1;
    memcpy(s->y, options->y0, (size_t)ny * sizeof(mech_real));
    mech_normalise(model, s->y);
    return s;
}

void mech_free(mech_solver *s)
{
    if (!s) return;
    if (s->history) mech_events->free_history(s->history);
    free(s->run);
    free(s->events);
    free(s);
}

void mech_read(const mech_solver *s, mech_report *report, mech_real *y)
{
    if (report) *report = s->run->report;
    if (y) memcpy(y, s->y, (size_t)s->ny * sizeof(mech_real));
}

void mech_write(mech_solver *s, const mech_real *y)
{
    memcpy(s->y, y, (size_t)s->ny * sizeof(mech_real));
    mech_normalise(s->model, s->y);
    mech_restart(s);
}

void mech_restart(mech_solver *s)
{
    s->run->started = 0;
    s->run->error_old = 0;
    s->run->report.status = MECH_RUNNING;
    s->run->report.failed_index = -1;
}

void mech_drift(const mech_solver *s, mech_real *out)
{
    memcpy(out, s->drift, (size_t)(s->model->n_position + s->model->n_velocity) * sizeof(mech_real));
}

void mech_listen(mech_solver *s, void (*listener)(long n_grid), long every)
{
    s->listener = listener;
    s->told_every = s->told_next = every;
}

void mech_set_record(mech_solver *s, mech_real *record, long capacity)
{
    s->o.record = record;
    s->o.record_capacity = capacity;
    s->run->report.n_record = 0;
}

void mech_set_events(mech_solver *s, mech_event *events, long event_capacity, mech_real *instants,
                     long instant_capacity)
{
    s->o.events = events;
    s->o.event_capacity = event_capacity;
    s->o.instants = instants;
    s->o.instant_capacity = instant_capacity;
    s->run->report.n_events = s->run->report.n_instants = 0;
}

void mech_read_discretes(const mech_solver *s, mech_real *z)
{
    memcpy(z, s->o.z, (size_t)s->model->nz * sizeof(mech_real));
}

size_t mech_save_size(const mech_solver *s) { return s->size + (s->history ? mech_events->history_size(s) : 0); }

void mech_save(const mech_solver *s, void *memory)
{
    memcpy(memory, s->run, s->size);
    if (s->history) mech_events->save_history(s, (char *)memory + s->size);
}

void mech_load(mech_solver *s, const void *memory)
{
    memcpy(s->run, memory, s->size);
    if (s->history) mech_events->load_history(s, (const char *)memory + s->size);
    s->method = mech_methods[s->run->report.method];
    if (s->run->started && s->method->attach) s->method->attach(s);
}
