/* A model as an FMU hands it out for Model Exchange, in the forms that CVODE and SciPy want: built with the sources of the FMU. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "instance.h"

#define PEER __attribute__((visibility("default")))

typedef struct peer_unit {
    fmu *f;
    double *(*entries)(void *vector);  /* N_VGetArrayPointer */
    double *(*columns)(void *matrix);  /* SUNDenseMatrix_Data */
    double *values;
    long evaluations, steps;
    double next;                       /* time of the next event that is known before, or infinity */
    int ended;
    char said[400];
} peer_unit;

static void heard(fmu *f, int status, const char *category, const char *message)
{
    peer_unit *u = f->environment;
    (void)category;
    if (u && status > FMU_WARNING) snprintf(u->said, sizeof u->said, "%s", message);
}

/* Event mode, until nothing happens any more. */
static int settle(peer_unit *u)
{
    fmu_news news;
    u->f->st->mode = FMU_EVENT;
    do {
        const int status = fmu_update(u->f, &news);
        if (status > FMU_WARNING) return status;
    } while (news.again && !news.ends);
    u->next = news.next;
    u->ended = news.ends;
    u->f->st->mode = FMU_CONTINUOUS;
    return 0;
}

PEER void peer_unit_free(peer_unit *u)
{
    if (!u) return;
    if (u->f) fmu_destroy(u->f);
    free(u->values);
    free(u);
}

/* NULL: no memory; else `said` tells why it cannot begin, if it cannot. */
PEER peer_unit *peer_unit_new(double begin, double stop, double tolerance)
{
    peer_unit *u = calloc(1, sizeof *u);
    if (!u) return NULL;
    u->f = fmu_create("peer", mech_fmu_description.token, 0, heard, u, NULL, 0);
    if (u->f) u->values = calloc((size_t)u->f->m->n_jacobian + 1, sizeof *u->values);
    if (!u->values) {
        peer_unit_free(u);
        return NULL;
    }
    int status = fmu_plan_experiment(u->f, 1, tolerance, begin, 1, stop);
    if (!status) status = fmu_enter_initialisation(u->f);
    if (!status) status = fmu_exit_initialisation(u->f);
    if (!status) status = settle(u);
    if (status && !*u->said) snprintf(u->said, sizeof u->said, "the unit cannot begin");
    return u;
}

PEER const char *peer_unit_said(const peer_unit *u) { return u->said; }
PEER double peer_unit_next(const peer_unit *u) { return u->next; }
PEER int peer_unit_ended(const peer_unit *u) { return u->ended; }
PEER long peer_unit_evaluations(const peer_unit *u) { return u->evaluations; }
PEER long peer_unit_steps(const peer_unit *u) { return u->steps; }
PEER int peer_unit_indicator_count(const peer_unit *u) { return u->f->d->n_indicators; }
PEER const int *peer_unit_indicator_places(const peer_unit *u) { return u->f->d->indicators; }
PEER void peer_unit_read(peer_unit *u, double *y) { fmu_get_states(u->f, y, (size_t)u->f->ny); }

PEER void peer_unit_serve(peer_unit *u, double *(*entries)(void *), double *(*columns)(void *))
{
    u->entries = entries;
    u->columns = columns;
}

static int stand(peer_unit *u, double t, const double *y)
{
    const int status = fmu_set_time(u->f, t);
    return status ? status : fmu_set_states(u->f, y, (size_t)u->f->ny);
}

/* What is due at a time and a state happens; y becomes the state after it. */
PEER int peer_unit_happen(peer_unit *u, double t, double *y)
{
    int status = stand(u, t, y);
    if (!status) status = settle(u);
    if (!status) status = fmu_get_states(u->f, y, (size_t)u->f->ny);
    return status;
}

PEER int peer_unit_rates(double t, const double *y, double *dy, peer_unit *u)
{
    u->evaluations++;
    const int status = stand(u, t, y);
    return status ? status : fmu_get_rates(u->f, dy, (size_t)u->f->ny);
}

PEER int peer_unit_indicators(double t, const double *y, double *w, peer_unit *u)
{
    const int status = stand(u, t, y);
    return status ? status : fmu_get_indicators(u->f, w, (size_t)u->f->d->n_indicators);
}

/* 1: the state should be moved onto what holds, by event mode. */
PEER int peer_unit_completed(double t, const double *y, peer_unit *u)
{
    int wanted = 0;
    const int status = stand(u, t, y);
    return !status && fmu_completed_step(u->f, &wanted) <= FMU_WARNING && wanted;
}

PEER int peer_unit_project(double t, double *y, peer_unit *u)
{
    int status = stand(u, t, y);
    if (!status) status = fmu_project(u->f);
    if (!status) memcpy(y, u->f->y, (size_t)u->f->ny * sizeof *y);
    return status;
}

/* For those who write the formulas themselves: the discrete variables, and of each indicator the sign and what is added to it. */
PEER void peer_unit_modes(peer_unit *u, int nz, double *z, double *sign, double *added)
{
    fmu *f = u->f;
    const mech_hybrid *h = f->m->hybrid;
    memcpy(z, f->z, (size_t)nz * sizeof *z); /* seeds of derivatives stand behind them */
    if (!h || fmu_get_indicators(f, added, (size_t)f->d->n_indicators)) return;
    mech_real *raw = calloc((size_t)f->n_w + 1, sizeof *raw);
    if (!raw) return;
    h->indicators(f->st->t, f->y, f->u, f->z, f->p, raw);
    for (int i = 0; i < f->d->n_indicators; i++) {
        const int k = f->d->indicators[i];
        sign[i] = k < h->n_switches && f->z[h->switches[k]] > MECH_C(0.5) ? -1 : 1;
        added[i] -= sign[i] * raw[k];
    }
    free(raw);
}

PEER int peer_unit_cvode_rates(double t, void *y, void *dy, void *user)
{
    peer_unit *u = user;
    return peer_unit_rates(t, u->entries(y), u->entries(dy), u) ? 1 : 0;
}

PEER int peer_unit_cvode_indicators(double t, void *y, double *w, void *user)
{
    peer_unit *u = user;
    return peer_unit_indicators(t, u->entries(y), w, u);
}

PEER int peer_unit_cvode_jacobian(double t, void *y, void *dy, void *matrix, void *user, void *a, void *b, void *c)
{
    peer_unit *u = user;
    const mech_model *m = u->f->m;
    double *out = u->columns(matrix);
    (void)dy, (void)a, (void)b, (void)c;
    if (stand(u, t, u->entries(y)) || fmu_refresh_inputs(u->f)) return 1;
    m->jacobian(t, u->f->y, u->f->u, u->f->z, u->f->p, u->values);
    for (int k = 0; k < m->n_jacobian; k++) /* the others are zero from before */
        out[(long)m->jac_col[k] * u->f->ny + m->jac_row[k]] = u->values[k];
    return fmu_finite(u->values, m->n_jacobian) ? 0 : 1;
}

PEER int peer_unit_has_jacobian(const peer_unit *u) { return u->f->m->jacobian != NULL; }

PEER int peer_unit_cvode_projection(double t, void *y, void *correction, double least, void *error, void *user)
{
    peer_unit *u = user;
    const double *from = u->entries(y);
    double *moved = u->entries(correction);
    (void)least, (void)error;
    memcpy(moved, from, (size_t)u->f->ny * sizeof *moved);
    if (peer_unit_project(t, moved, u)) return 1;
    for (int i = 0; i < u->f->ny; i++) moved[i] -= from[i];
    return 0;
}

typedef struct peer_cvode {
    void *memory, *state, *row; /* vectors; row: for values between the ends of steps */
    int (*step)(void *memory, double end, void *state, double *t, int task);
    int (*between)(void *memory, double t, int order, void *row);
} peer_cvode;

enum { ONE_STEP = 2, ROOT = 2, REACHED = 0, HAPPENS = 1, RUNNING = 3 };

/* Takes CVODE on to `end`, to an event, or for so many steps; writes rows at the times on the way. < 0: what CVODE returned. */
PEER int peer_unit_advance(peer_unit *u, const peer_cvode *c, double end, double *t, long steps, const double *times,
                           long n_times, long *written, double *rows)
{
    const size_t ny = (size_t)u->f->ny;
    for (; *t < end; steps--) {
        if (!steps) return RUNNING;
        const int status = c->step(c->memory, end, c->state, t, ONE_STEP);
        if (status < 0) return status;
        u->steps++;
        for (; *written < n_times && times[*written] <= *t; (*written)++) {
            if (times[*written] < *t) {
                if (c->between(c->memory, times[*written], 0, c->row)) return -1;
            }
            void *from = times[*written] < *t ? c->row : c->state;
            memcpy(rows + (size_t)*written * ny, u->entries(from), ny * sizeof *rows);
        }
        if (status == ROOT || peer_unit_completed(*t, u->entries(c->state), u)) return HAPPENS;
    }
    return REACHED;
}
