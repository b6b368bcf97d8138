#include "lane_environments.h"

#include <stdlib.h>
#include <string.h>

enum { ALIGNED = 64 };

long mech_lane_team_size(const mech_environments *e) { return (long)e->lanes->width * e->lanes->groups; }

static mech_real *take(char **next, int n, int width)
{
    mech_real *array = (mech_real *)*next;
    *next += ((size_t)n * (size_t)width * sizeof(mech_real) + ALIGNED - 1) / ALIGNED * ALIGNED;
    return array;
}

int mech_lane_team_open(mech_lane_team *c, mech_environments *e)
{
    const mech_lanes *l = e->lanes;
    const int w = l->width;
    const size_t numbers = (size_t)(w * (3 + l->ny + l->n_all + l->nz + l->nu));
    const size_t bytes = (size_t)l->groups * (numbers * sizeof(mech_real) + 8 * ALIGNED) + ALIGNED;
    memset(c, 0, sizeof *c);
    c->e = e;
    c->block = calloc(1, bytes + (size_t)l->nu);
    if (!c->block) return 1;
    char *next = (char *)c->block + ALIGNED - (size_t)c->block % ALIGNED;
    unsigned char *given = (unsigned char *)c->block + bytes;
    for (int i = 0; i < e->n_held; i++) given[e->held[i]] = 1;
    for (int g = 0; g < l->groups; g++) {
        mech_lane_room *r = &c->rooms[g];
        r->t = take(&next, 1, w);
        r->limit = take(&next, 1, w);
        r->dt = take(&next, 1, w);
        r->y = take(&next, l->ny, w);
        r->p = take(&next, l->n_all, w);
        r->z = take(&next, l->nz, w);
        r->u = take(&next, l->nu, w);
        r->given = given;
        for (int i = 0; i < l->n_all; i++)
            for (int k = 0; k < w; k++) r->p[i * w + k] = e->options->p[i];
        for (int i = 0; i < l->nz; i++)
            for (int k = 0; k < w; k++) r->z[i * w + k] = e->options->z[i];
    }
    return 0;
}

void mech_lane_team_close(mech_lane_team *c) { free(c->block); }

/* A lane without an environment holds the last one once more, and nobody looks at it. */
static void enter(mech_lane_team *c, int g, long first, long n, const mech_real *begin)
{
    mech_environments *e = c->e;
    mech_lane_room *r = &c->rooms[g];
    const int w = e->lanes->width, ny = e->lanes->ny;
    r->alive = 0;
    for (int l = 0; l < w; l++) {
        const long at = (long)g * w + l, k = first + (at < n ? at : n - 1);
        const mech_real *y = e->y + k * ny, *u = e->u + k * e->n_held;
        for (int i = 0; i < ny; i++) r->y[i * w + l] = y[i];
        for (int i = 0; i < e->n_held; i++) r->u[e->held[i] * w + l] = u[i];
        r->t[l] = begin[at < n ? at : n - 1];
        if (at < n && e->status[k] >= 0) r->alive |= 1u << l;
    }
    r->fresh = r->alive;
    r->troubled = 0;
}

static void leave(mech_lane_team *c, int g, long first, long n, unsigned whole)
{
    mech_environments *e = c->e;
    const mech_lane_room *r = &c->rooms[g];
    const int w = e->lanes->width, ny = e->lanes->ny;
    for (int l = 0; l < w && (long)g * w + l < n; l++) {
        const long k = first + (long)g * w + l;
        if (e->status[k] < 0) continue;
        mech_real *y = e->y + k * ny;
        for (int i = 0; i < ny; i++) y[i] = r->y[i * w + l];
        e->t[k] = r->t[l];
        if (whole >> l & 1) e->status[k] = MECH_REACHED;
    }
}

/* Tells what ended the lanes that are in trouble, which go on no further. */
static void end_troubled(mech_lane_team *c, int g, long first)
{
    mech_lane_room *r = &c->rooms[g];
    const int w = c->e->lanes->width;
    const unsigned bits = r->troubled & r->alive;
    for (int l = 0; bits >> l; l++)
        if (bits >> l & 1) {
            const long k = first + (long)g * w + l;
            mech_real *y = c->e->y + k * c->e->lanes->ny;
            for (int i = 0; i < c->e->lanes->ny; i++) y[i] = r->y[i * w + l];
            c->e->t[k] = r->t[l];
            c->e->status[k] = r->took >> l & 1 ? MECH_ASSERTION : MECH_NOT_FINITE;
        }
    r->alive &= ~bits;
}

void mech_lane_team_step(mech_lane_team *c, long first, long n, const mech_real *begin)
{
    mech_environments *e = c->e;
    const mech_lanes *of = e->lanes;
    const int w = of->width;
    const mech_real h = e->period / e->substeps;
    for (int g = 0; g < of->groups; g++) enter(c, g, first, n, begin);
    if (e->model->n_assertions)
        for (int g = 0; g < of->groups; g++) {
            c->rooms[g].took = ~0u;
            of->begin(&c->rooms[g]);
            end_troubled(c, g, first);
        }
    for (int j = 1; j <= e->substeps; j++) {
        for (int g = 0; g < of->groups; g++)
            for (int l = 0; l < w; l++) {
                const long at = (long)g * w + l < n ? (long)g * w + l : n - 1;
                c->rooms[g].dt[l] = h;
                c->rooms[g].limit[l] = begin[at] + j * h;
            }
        of->attempt(c->rooms);
        for (int g = 0; g < of->groups; g++) end_troubled(c, g, first);
    }
    for (int g = 0; g < of->groups; g++) leave(c, g, first, n, c->rooms[g].alive);
}
