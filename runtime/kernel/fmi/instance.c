/* Creation, logging, reset, and saved states of an instance. */
#include "instance.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "method.h"

const char *const fmu_categories[FMU_N_CATEGORIES] = {"logStatusWarning", "logStatusDiscard", "logStatusError",
                                                      "logStatusFatal", "logEvents"};

int fmu_fail(fmu *f, int status, const char *format, ...)
{
    char text[1024];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    /* errors are told even where logging is off */
    if (f->log && (status >= FMU_ERROR || (f->logging && (f->categories >> (status - 1) & 1u))))
        f->log(f, status, fmu_categories[status - 1], text);
    return status;
}

int fmu_undefined(fmu *f, const char *what)
{
    /* an importer can take a smaller step in continuous time only */
    const int smaller = f->st->mode & (FMU_CONTINUOUS | FMU_STEP);
    return fmu_fail(f, smaller ? FMU_DISCARD : FMU_ERROR, "at time %g %s", f->st->t, what);
}

int fmu_finite(const mech_real *x, int n)
{
    mech_real sum = 0;
    for (int i = 0; i < n; i++) sum += x[i] - x[i];
    return sum == 0;
}

void fmu_tell(fmu *f, int category, const char *message)
{
    if (f->log && f->logging && (f->categories >> category & 1u))
        f->log(f, FMU_OK, fmu_categories[category], message);
}

int fmu_allowed(fmu *f, int modes, const char *function)
{
    if (f->st->mode & modes) return FMU_OK;
    return fmu_fail(f, FMU_ERROR, "%s is not allowed in the present state of the FMU", function);
}

int fmu_set_categories(fmu *f, int on, size_t n, const char *const *names)
{
    unsigned chosen = n ? 0 : ~0u;
    for (size_t i = 0; i < n; i++) {
        int known = 0;
        for (int k = 0; k < FMU_N_CATEGORIES; k++)
            if (names && names[i] && !strcmp(names[i], fmu_categories[k])) {
                chosen |= 1u << k;
                known = 1;
            }
        if (!known) return fmu_fail(f, FMU_ERROR, "there is no such category of log messages");
    }
    f->logging = on;
    f->categories = chosen;
    return FMU_OK;
}

static uint64_t layout_hash(const char *token)
{
    uint64_t h = 1469598103934665603u; /* FNV-1a */
    for (; *token; token++) h = (h ^ (unsigned char)*token) * 1099511628211u;
    return h;
}

static int make_solver(fmu *f)
{
    mech_options o;
    memset(&o, 0, sizeof o);
    o.method = mech_method_index(f->d->method);
    o.n_tables = f->m->nu;
    o.t0 = f->d->t0;
    o.dt_max = f->d->stop > f->d->t0 ? (f->d->stop - f->d->t0) / 10 : 1;
    o.apart = f->d->stop > f->d->t0 ? (f->d->stop - f->d->t0) / MECH_LOOKS : 0;
    o.dt = f->d->dt;
    o.rtol = f->d->tolerance;
    o.atol = f->atol;
    o.y0 = f->y;
    o.z = f->z;
    o.p = f->p;
    o.tables = f->tables;
    f->s = mech_create(f->m, &o);
    if (!f->s) return 0;
    f->z = (mech_real *)f->s->o.z; /* of a model with events those of the solver */
    return fmu_save(f, &f->saved) == FMU_OK;
}

/* Inputs that the importer has set are tables of one row, first in the list; all others follow the model. */
void fmu_list_tables(fmu *f)
{
    int n = 0;
    for (int i = 0; i < f->m->nu; i++)
        if (f->u_set[i]) {
            f->tables[n].input = i;
            f->tables[n].interpolation = MECH_STEP;
            f->tables[n].n = 1;
            f->tables[n].t = &f->d->t0;
            f->tables[n].value = &f->u[i];
            n++;
        }
    f->s->o.n_tables = n;
    f->st->n_driven = n;
    for (int k = 0; k < n; k++) f->s->segments[k] = mech_segment(&f->tables[k], f->st->t);
}

/* Tolerance and times of the experiment, as the solver wants them. */
void fmu_set_experiment(fmu *f)
{
    const fmu_state *st = f->st;
    f->s->o.t0 = st->start;
    f->s->o.rtol = st->tolerance;
    f->s->o.dt_max = st->stop > st->start ? (st->stop - st->start) / 10 : 1;
    f->s->o.apart = st->stop > st->start ? (st->stop - st->start) / MECH_LOOKS : 0;
}

void fmu_touch(fmu *f)
{
    f->st->stale_rates = f->st->stale_outputs = 1;
}

void fmu_reset(fmu *f)
{
    const mech_model *m = f->m;
    const fmu_description *d = f->d;
    memset(f->st, 0, f->size);
    f->st->layout = layout_hash(d->token);
    f->st->mode = FMU_INSTANTIATED;
    f->st->t = f->st->start = f->st->last_step_end = d->t0;
    f->st->stop = d->stop;
    f->st->tolerance = d->tolerance;
    f->st->stale_parameters = f->st->stale_initial = f->st->stale_inputs = 1;
    f->st->next = (mech_real)INFINITY;
    fmu_touch(f);
    for (int k = 0; k < f->n_w; k++) f->noise[k] = 1;
    for (int i = 0; i < m->np; i++) {
        f->p_set[i] = d->p_given[i];
        f->p[i] = d->p[i];
    }
    for (int i = 0; i < f->ny; i++) {
        f->y[i] = d->y[i];
        f->atol[i] = d->tolerance * d->nominal[i];
    }
    for (int i = 0; i < m->nu; i++) {
        f->u_set[i] = d->u_given[i];
        f->u[i] = d->u[i];
    }
    if (f->s) {
        /* the block of a new solver, whose pointers are none of its business */
        memset(f->s->run, 0, f->s->size);
        f->s->method = f->s->chosen->explicit_part ? f->s->chosen->explicit_part : f->s->chosen;
        f->s->run->report.method = mech_method_index(f->s->method->name);
        f->s->run->report.failed_index = -1;
        f->s->run->report.stiff_time = f->s->run->report.switch_time = (mech_real)NAN;
        fmu_set_experiment(f);
        fmu_list_tables(f);
    }
    f->st->solver_stale = 1;
}

static size_t numbers(const fmu *f)
{
    const mech_model *m = f->m;
    const size_t drives = (size_t)f->d->n_drives * (sizeof(fmu_drive) / sizeof(mech_real));
    return drives + (size_t)(3 * f->ny + m->nu + m->np + m->nh + m->nz + m->n_outputs + f->n_w);
}

fmu *fmu_create(const char *name, const char *token, int is_co_simulation, fmu_logger *log, void *environment,
                void *callback, int logging)
{
    fmu *f = calloc(1, sizeof *f);
    if (!f) return NULL;
    const fmu_description *d = f->d = &mech_fmu_description;
    const mech_model *m = f->m = mech_model_get();
    const int ny = f->ny = m->nq + m->nv + m->nx;
    f->is_co_simulation = is_co_simulation;
    f->log = log;
    f->environment = environment;
    f->callback = callback;
    f->logging = logging;
    f->categories = ~0u;
    if (!name || !*name) name = "instance";
    f->name = calloc(strlen(name) + 1, 1);
    if (f->name) memcpy(f->name, name, strlen(name));
    if (!token || strcmp(token, d->token)) {
        fmu_fail(f, FMU_ERROR, "the model description does not belong to this binary: its token is %s, not %s",
                 token ? token : "missing", d->token);
        fmu_destroy(f);
        return NULL;
    }
    f->n_w = m->hybrid ? m->hybrid->n_switches + m->hybrid->n_rows : 0;
    f->size = sizeof(fmu_state) + numbers(f) * sizeof(mech_real) + (size_t)(m->np + ny + m->nu);
    f->size = (f->size + 7) / 8 * 8;
    f->st = calloc(1, f->size);
    f->tables = calloc((size_t)m->nu + 1, sizeof *f->tables);
    const int widest = ny + m->nu + 1 + m->np + m->n_outputs;
    const int slopes = ny + m->nu + 1 + m->np, own = widest + m->n_assertions + m->nz + slopes;
    f->scratch = calloc((size_t)(own + f->n_w), sizeof *f->scratch);
    f->slopes = f->scratch ? f->scratch + own - slopes : NULL;
    f->w = f->scratch ? f->scratch + own : NULL;
    f->known = calloc((size_t)ny + 1, 1);
    f->elements = calloc(2 * (size_t)d->n_sizes + 1, sizeof *f->elements);
    if (!f->name || !f->st || !f->tables || !f->scratch || !f->elements || !f->known) {
        fmu_destroy(f);
        return NULL;
    }
    f->y = (mech_real *)(f->st + 1);
    f->dy = f->y + ny;
    f->atol = f->dy + ny;
    f->u = f->atol + ny;
    f->p = f->u + m->nu;
    f->z = f->p + m->np + m->nh;
    f->out = f->z + m->nz;
    f->noise = f->out + m->n_outputs;
    f->drives = (fmu_drive *)(f->noise + f->n_w);
    f->p_set = (unsigned char *)(f->drives + d->n_drives);
    f->y_set = f->p_set + m->np;
    f->u_set = f->y_set + ny;
    fmu_reset(f);
    if (!make_solver(f)) {
        fmu_destroy(f);
        return NULL;
    }
    fmu_reset(f);
    return f;
}

void fmu_destroy(fmu *f)
{
    if (!f) return;
    mech_free(f->s);
    free(f->saved);
    free(f->elements);
    free(f->scratch);
    free(f->known);
    free(f->tables);
    free(f->st);
    free(f->name);
    free(f);
}

size_t fmu_saved_size(const fmu *f, const void *state)
{
    fmu_state head;
    if (!state) return f->size + mech_save_size(f->s);
    memcpy(&head, state, sizeof head);
    return (size_t)head.bytes;
}

/* Room for a state, where another may lie already. */
static int give_room(fmu *f, size_t size, void **state)
{
    if (!state) return fmu_fail(f, FMU_ERROR, "no place for the state is given");
    if (*state && fmu_saved_size(f, *state) >= size) return FMU_OK;
    void *room = realloc(*state, size);
    if (!room) return fmu_fail(f, FMU_ERROR, "no memory for a state of the FMU");
    *state = room;
    return FMU_OK;
}

int fmu_save(fmu *f, void **state)
{
    const size_t size = fmu_saved_size(f, NULL);
    const int status = give_room(f, size, state);
    if (status) return status;
    f->st->bytes = size;
    memcpy(*state, f->st, f->size);
    mech_save(f->s, (char *)*state + f->size);
    return FMU_OK;
}

int fmu_check_state(fmu *f, const void *bytes, size_t size)
{
    fmu_state head;
    const size_t least = f->s->history ? f->size + f->s->size : fmu_saved_size(f, NULL);
    if (!bytes || size < least || fmu_saved_size(f, bytes) != size)
        return fmu_fail(f, FMU_ERROR, "a state of this FMU has %lu bytes, not %lu", (unsigned long)least, (unsigned long)size);
    memcpy(&head, bytes, sizeof head);
    if (head.layout != f->st->layout)
        return fmu_fail(f, FMU_ERROR, "the state was saved by another FMU or on another machine");
    return FMU_OK;
}

int fmu_copy_state(fmu *f, const void *bytes, size_t size, void **state)
{
    const int status = give_room(f, size, state);
    if (!status) memcpy(*state, bytes, size);
    return status;
}

int fmu_load(fmu *f, const void *state)
{
    if (!state) return fmu_fail(f, FMU_ERROR, "no state is given");
    memcpy(f->st, state, f->size);
    mech_load(f->s, (const char *)state + f->size);
    fmu_set_experiment(f);
    fmu_list_tables(f);
    return FMU_OK;
}
