/* Environments by solvers, and the queue from which threads take them. */
#include "environments.h"

#include <stdlib.h>
#include <string.h>

#include "lane_environments.h"
#include "method.h"
#include "threads.h"

enum { EVENTS = 1024, INSTANTS = 64, SLICE = 16 };

/* What changes of one environment beside its solver and the caller's rows. */
typedef struct place {
    long long periods; /* that it has taken since its start                                          */
    long long last;    /* steps after which the present call ends; 0: none is under way               */
} place;

typedef struct environments {
    mech_solver **solvers; /* [n]; NULL: lanes                                                        */
    place *places;         /* [n]                                                                     */
    mech_table *tables;    /* [n][n_tables]                                                           */
    mech_real *u_before;   /* [n][n_held] inputs of the last control step                             */
    mech_real zero;
    void *fresh;           /* what a solver is at the start                                           */
} environments;

typedef struct team {
    mech_environments *e;
    volatile long next, unfinished, troubles;
    int going_on; /* this call ends what the last one interrupted: what had reached the end of its step then waits */
} team;

static environments *of(const mech_environments *e) { return e->memory; }

static size_t states(const mech_environments *e) { return (size_t)(e->model->nq + e->model->nv + e->model->nx); }

static int ended(int status) { return status < 0 || status == MECH_TERMINATED; }

size_t mech_environments_layout(void) { return sizeof(mech_environments); }

static void copy(mech_real *to, const mech_real *from, size_t n)
{
    if (n) memcpy(to, from, n * sizeof(mech_real));
}

static int open_solver(mech_environments *e, long k)
{
    environments *own = of(e);
    const mech_options *o = e->options;
    const int n_tables = o->n_tables + e->n_held;
    const size_t ny = states(e), nz = (size_t)e->model->nz;
    mech_table *tables = own->tables + k * n_tables;
    for (int i = 0; i < o->n_tables; i++) tables[i] = o->tables[i];
    for (int i = 0; i < e->n_held; i++) {
        mech_real *value = own->u_before + k * e->n_held + i;
        tables[o->n_tables + i] = (mech_table){e->held[i], MECH_STEP, 1, &own->zero, value, &own->zero};
    }
    mech_options mine = *o;
    mine.n_tables = n_tables;
    mine.tables = tables;
    copy(e->y + (size_t)k * ny, o->y0, ny);
    copy(e->z + (size_t)k * nz, o->z, nz);
    return !(own->solvers[k] = e->kernel->create(e->model, &mine));
}

int mech_environments_open(mech_environments *e)
{
    const size_t n = (size_t)e->n, n_tables = (size_t)(e->options->n_tables + e->n_held);
    environments *own = e->memory = calloc(1, sizeof *own);
    if (!own) return 1;
    own->places = calloc(n, sizeof *own->places);
    own->u_before = calloc(n * (size_t)e->n_held + 1, sizeof(mech_real));
    if (!own->places || !own->u_before) return 1;
    copy(own->u_before, e->u, n * (size_t)e->n_held);
    for (long k = 0; k < e->n; k++) e->t[k] = e->options->t0;
    if (e->lanes) {
        for (long k = 0; k < e->n; k++) copy(e->y + (size_t)k * states(e), e->options->y0, states(e));
        return 0;
    }
    own->solvers = calloc(n, sizeof *own->solvers);
    own->tables = calloc(n * n_tables + 1, sizeof(mech_table));
    if (!own->solvers || !own->tables) return 1;
    for (long k = 0; k < e->n; k++)
        if (open_solver(e, k)) return 1;
    own->fresh = malloc(e->kernel->save_size(own->solvers[0]));
    if (!own->fresh) return 1;
    e->kernel->save(own->solvers[0], own->fresh);
    return 0;
}

void mech_environments_close(mech_environments *e)
{
    environments *own = of(e);
    if (!own) return;
    for (long k = 0; own->solvers && k < e->n; k++) e->kernel->free(own->solvers[k]);
    free(own->solvers);
    free(own->places);
    free(own->tables);
    free(own->u_before);
    free(own->fresh);
    free(own);
    e->memory = NULL;
}

/* Inputs that have changed begin to act; a method that chooses its steps goes on with the length that it had. */
static void take_inputs(mech_environments *e, long k)
{
    const size_t n = (size_t)e->n_held;
    mech_real *before = of(e)->u_before + (size_t)k * n;
    const mech_real *u = e->u + (size_t)k * n;
    if (!n || !memcmp(before, u, n * sizeof *u)) return;
    mech_solver *s = of(e)->solvers[k];
    copy(before, u, n);
    if (!s->run->started) return;
    if (s->method->adaptive) s->o.dt = s->run->report.dt;
    e->kernel->restart(s);
}

/* All inputs at the present time. */
static void inputs_of(const mech_environments *e, long k, mech_real *u)
{
    if (!e->model->nu) return;
    mech_inputs(e->model, e->options->tables, e->options->n_tables, NULL, e->t[k], e->options->p, u);
    for (int i = 0; i < e->n_held; i++) u[e->held[i]] = of(e)->u_before[k * e->n_held + i];
}

static mech_real end_of_step(const mech_environments *e, long k)
{
    if (e->until == e->until) return e->until;
    return e->options->t0 + (mech_real)(of(e)->places[k].periods + 1) * e->period;
}

static int interrupted(const mech_environments *e)
{
    for (long k = 0; k < e->n; k++)
        if (of(e)->places[k].last) return 1;
    return 0;
}

/* Takes one environment on. 1 where it is interrupted. */
static int step_one(mech_environments *e, long k, int going_on, mech_event *events, mech_real *instants)
{
    mech_solver *s = of(e)->solvers[k];
    place *at = &of(e)->places[k];
    const mech_report *r = &s->run->report;
    if (ended(e->status[k]) || (going_on && !at->last)) return 0;
    if (!at->last || e->until == e->until) {
        take_inputs(e, k);
        at->last = r->steps + e->max_steps;
    }
    const mech_real end = end_of_step(e, k);
    int status;
    do {
        if (events) e->kernel->set_events(s, events, EVENTS, instants, INSTANTS);
        status = e->kernel->advance(s, end, (long)(at->last - r->steps));
    } while (status == MECH_EVENTS_FULL);
    if (events) e->kernel->set_events(s, NULL, 0, NULL, 0);
    e->t[k] = r->t;
    e->status[k] = status;
    copy(e->y + (size_t)k * states(e), s->y, states(e));
    copy(e->z + (size_t)k * (size_t)e->model->nz, s->o.z, (size_t)e->model->nz);
    if (status == MECH_RUNNING && r->steps < at->last) return 1;
    at->last = 0;
    if (status == MECH_REACHED && e->until != e->until) at->periods++;
    return 0;
}

static void by_solvers(void *shared)
{
    team *c = shared;
    mech_environments *e = c->e;
    const size_t width = 1 + 2 * (states(e) + (size_t)e->model->nz);
    mech_event *events = NULL;
    mech_real *instants = NULL;
    if (e->model->hybrid) {
        events = malloc(EVENTS * sizeof *events);
        instants = malloc(INSTANTS * width * sizeof *instants);
        if (!events || !instants) {
            mech_count(&c->troubles);
            free(events);
            free(instants);
            return;
        }
    }
    for (;;) {
        const long first = SLICE * mech_count(&c->next);
        if (first >= e->n) break;
        for (long k = first; k < first + SLICE && k < e->n; k++)
            if (step_one(e, k, c->going_on, events, instants)) mech_count(&c->unfinished);
    }
    free(events);
    free(instants);
}

static void by_lanes(void *shared)
{
    team *c = shared;
    mech_environments *e = c->e;
    mech_lane_team lanes;
    if (mech_lane_team_open(&lanes, e)) {
        mech_count(&c->troubles);
        return;
    }
    const long size = mech_lane_team_size(e);
    for (;;) {
        const long first = size * mech_count(&c->next);
        if (first >= e->n) break;
        mech_real begin[MECH_MOST_LANES];
        long n = e->n - first < size ? e->n - first : size;
        for (long k = 0; k < n; k++) begin[k] = e->options->t0 + (mech_real)of(e)->places[first + k].periods * e->period;
        copy(of(e)->u_before + first * e->n_held, e->u + first * e->n_held, (size_t)(n * e->n_held));
        mech_lane_team_step(&lanes, first, n, begin);
        for (long k = 0; k < n; k++)
            if (e->status[first + k] == MECH_REACHED) of(e)->places[first + k].periods++;
    }
    mech_lane_team_close(&lanes);
}

long mech_environments_step(mech_environments *e)
{
    team c = {.e = e, .going_on = interrupted(e)};
    const long tasks = e->n / (e->lanes ? mech_lane_team_size(e) : SLICE) + 1;
    const int threads = e->threads < tasks ? e->threads : (int)tasks;
    mech_together(e->lanes ? by_lanes : by_solvers, &c, threads);
    return c.troubles ? -1 : c.unfinished;
}

int mech_environments_reset(mech_environments *e, long k, int guess)
{
    const mech_model *m = e->model;
    const size_t ny = states(e), n = (size_t)e->n_held;
    mech_real *y = e->y + (size_t)k * ny;
    environments *own = of(e);
    own->places[k] = (place){0, 0};
    copy(own->u_before + (size_t)k * n, e->u + (size_t)k * n, n);
    copy(e->z + (size_t)k * (size_t)m->nz, e->options->z, (size_t)m->nz);
    mech_normalise(m, y);
    e->t[k] = e->options->t0;
    e->status[k] = MECH_REACHED;
    if (guess && m->start && m->start->n_rows) {
        mech_real u[m->nu + 1];
        mech_start_report told;
        inputs_of(e, k, u);
        if (e->kernel->assemble(m, e->t[k], NULL, u, e->options->z, e->options->p, y, &told))
            e->status[k] = MECH_OFF_CONSTRAINTS;
    }
    if (own->solvers) {
        e->kernel->load(own->solvers[k], own->fresh);
        e->kernel->write(own->solvers[k], y);
        own->solvers[k]->o.dt = e->options->dt;
    }
    return e->status[k];
}

long mech_environments_read(mech_environments *e)
{
    const mech_model *m = e->model;
    const size_t ny = states(e);
    mech_real u[m->nu + 1];
    if (!m->n_outputs) return 0;
    for (long k = 0; k < e->n; k++) {
        const mech_real *z = e->z + (size_t)k * (size_t)m->nz;
        inputs_of(e, k, u);
        m->outputs(e->t[k], e->y + (size_t)k * ny, u, z, e->options->p, e->outputs + (size_t)k * (size_t)m->n_outputs);
    }
    return 0;
}

size_t mech_environments_save_size(const mech_environments *e, long k)
{
    const environments *own = of(e);
    return sizeof(place) + (size_t)e->n_held * sizeof(mech_real) + sizeof(mech_real) +
           (own->solvers ? e->kernel->save_size(own->solvers[k]) : 0);
}

void mech_environments_save(const mech_environments *e, long k, void *memory)
{
    const environments *own = of(e);
    const size_t n = (size_t)e->n_held;
    char *to = memory;
    memcpy(to, &own->places[k], sizeof(place));
    to += sizeof(place);
    memcpy(to, own->solvers ? &own->solvers[k]->o.dt : &own->zero, sizeof(mech_real));
    to += sizeof(mech_real);
    memcpy(to, own->u_before + (size_t)k * n, n * sizeof(mech_real));
    if (own->solvers) e->kernel->save(own->solvers[k], to + n * sizeof(mech_real));
}

void mech_environments_load(mech_environments *e, long k, const void *memory)
{
    environments *own = of(e);
    const size_t n = (size_t)e->n_held;
    const char *from = memory;
    memcpy(&own->places[k], from, sizeof(place));
    from += sizeof(place);
    if (own->solvers) memcpy(&own->solvers[k]->o.dt, from, sizeof(mech_real));
    from += sizeof(mech_real);
    memcpy(own->u_before + (size_t)k * n, from, n * sizeof(mech_real));
    if (own->solvers) e->kernel->load(own->solvers[k], from + n * sizeof(mech_real));
}

int mech_environments_report(const mech_environments *e, long k, mech_report *report)
{
    if (e->lanes) return 0;
    *report = of(e)->solvers[k]->run->report;
    return 1;
}
