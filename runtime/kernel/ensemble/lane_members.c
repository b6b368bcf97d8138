/* Members side by side: a thread fills its lanes from the queue, and a lane whose member has ended takes the next one.
 *
 * The companion of a member runs in its lane. A member that is in trouble there runs once more by the scalar kernel. */
#include <stdlib.h>
#include <string.h>

#include "lanes.h"
#include "member.h"
#include "threads.h"

enum { ALIGNED = 64, MOST_WIDTH = 16, STIFF_HITS = 15, CALM_HITS = 6 };

enum phase { MAIN = 0, TIGHT, LOOSE };

/* What runs in one lane. */
typedef struct lane {
    mech_room room;
    mech_member told;
    mech_outcome main, other;
    long k;              /* the member                                                          */
    int phase;
    int next_stop, stiff_hits, calm_hits;
    long n_grid;         /* rows written                                                        */
    long bound;          /* steps of this run, 0: without a bound                               */
    mech_real stiff_time;
} lane;

typedef struct team {
    const mech_ensemble *e;
    mech_crew *crew;
    const mech_lanes *of;
    mech_lane_room x;
    lane *lanes;
} team;

/* ---- the room of a thread */

static mech_real *take(char **next, int count, int width)
{
    mech_real *taken = (mech_real *)*next;
    *next += ((size_t)(count > 0 ? count : 1) * (size_t)width * sizeof(mech_real) + ALIGNED - 1) / ALIGNED * ALIGNED;
    return taken;
}

static size_t lay_out(team *c, char *block)
{
    const mech_lanes *of = c->of;
    mech_lane_room *x = &c->x;
    char *next = block;
    mech_real **const single[] = {&x->t,         &x->rtol,      &x->longest,   &x->limit, &x->next_row, &x->most,     &x->dt,
                                  &x->error_old, &x->steps,     &x->next_look, &x->from,  &x->h,        &x->stiffness};
    for (size_t i = 0; i < sizeof single / sizeof *single; i++) *single[i] = take(&next, 1, of->width);
    x->y = take(&next, of->ny, of->width);
    x->dy = take(&next, of->ny, of->width);
    x->atol = take(&next, of->ny, of->width);
    x->p = take(&next, of->n_all, of->width);
    x->z = take(&next, of->nz, of->width);
    x->u = take(&next, of->nu, of->width);
    x->dense = take(&next, of->n_dense * of->ny, of->width);
    x->samples = take(&next, MECH_LANE_SAMPLES * of->n_kept, of->width);
    x->extra = take(&next, of->n_extra, of->width);
    return (size_t)(next - block);
}

/* ---- a member into a lane, and out of it */

static void put(team *c, int l, const mech_real *from, int n, mech_real *to)
{
    for (int i = 0; i < n; i++) to[i * c->of->width + l] = from[i];
}

static void read_state(const team *c, int l, mech_real *y)
{
    for (int i = 0; i < c->of->ny; i++) y[i] = c->x.y[i * c->of->width + l];
}

static void next_limit(team *c, int l)
{
    const mech_ensemble *e = c->e;
    const mech_options *o = e->options;
    lane *it = &c->lanes[l];
    while (it->next_stop < o->n_stops && o->stops[it->next_stop] <= c->x.t[l]) it->next_stop++;
    const int stop = it->next_stop < o->n_stops && o->stops[it->next_stop] < e->stop;
    c->x.limit[l] = stop ? o->stops[it->next_stop] : e->stop;
}

static mech_real *rows_of(const lane *it) { return it->phase == MAIN ? it->room.grid_y : it->room.other_y; }

static void next_row(team *c, int l)
{
    const mech_options *o = c->e->options;
    const lane *it = &c->lanes[l];
    c->x.next_row[l] = it->n_grid < o->n_grid ? o->grid[it->n_grid] : (mech_real)INFINITY;
}

/* Lets the member of a lane begin a run at a tolerance. */
static void set_out(team *c, int l, int phase, mech_real rtol, mech_real dt_max, long bound)
{
    const mech_ensemble *e = c->e;
    mech_lane_room *x = &c->x;
    lane *it = &c->lanes[l];
    mech_room *r = &it->room;
    const size_t ny = (size_t)c->of->ny;
    it->phase = phase;
    it->bound = bound;
    it->next_stop = it->stiff_hits = it->calm_hits = 0;
    it->n_grid = 0;
    it->stiff_time = (mech_real)NAN;
    for (size_t i = 0; i < ny; i++) r->atol[i] = rtol * r->nominal[i];
    put(c, l, r->y, c->of->ny, x->y);
    put(c, l, r->atol, c->of->ny, x->atol);
    put(c, l, r->p, c->of->n_all, x->p);
    put(c, l, r->z, c->of->nz, x->z);
    for (int k = 0; k < e->options->n_tables; k++)
        x->u[r->tables[k].input * c->of->width + l] = r->tables[k].value[0];
    x->t[l] = e->options->t0;
    x->rtol[l] = rtol;
    x->longest[l] = dt_max;
    x->most[l] = bound ? (mech_real)bound : (mech_real)INFINITY;
    x->next_look[l] = c->of->look_every ? (mech_real)c->of->look_every : (mech_real)INFINITY;
    next_limit(c, l);
    for (; it->n_grid < e->options->n_grid && e->options->grid[it->n_grid] <= x->t[l]; it->n_grid++)
        memcpy(rows_of(it) + (size_t)it->n_grid * ny, r->y, ny * sizeof(mech_real));
    next_row(c, l);
    mech_watch_begin(r);
    if (x->watched) mech_watch_jump(r, x->t[l], r->y, r->z);
    x->fresh |= 1u << l;
    x->alive |= 1u << l;
}

static void keep(team *c, int l)
{
    lane *it = &c->lanes[l];
    c->e->members[it->k] = it->told;
    mech_count(c->e->done);
}

/* Gives a lane the next member of the queue that can begin; none: the lane stays open. */
static void enter(team *c, int l)
{
    const mech_ensemble *e = c->e;
    lane *it = &c->lanes[l];
    const size_t ny = (size_t)c->of->ny;
    c->x.alive &= ~(1u << l);
    while (!*e->stopped) {
        it->k = mech_count(&c->crew->next);
        if (it->k >= e->n) return;
        if (e->members[it->k].stage != MECH_MEMBER_WAITS) continue;
        mech_member_waits(e, it->k, &it->told);
        it->room.values = e->values + (size_t)it->k * (size_t)e->n_varied;
        it->told.stage = mech_member_start(&it->room, &it->told);
        memcpy(e->ends + (size_t)it->k * ny, it->room.y, ny * sizeof(mech_real));
        it->told.t = e->options->t0;
        if (it->told.stage == MECH_MEMBER_RAN) {
            set_out(c, l, MAIN, e->options->rtol, e->options->dt_max, e->max_steps);
            return;
        }
        keep(c, l);
    }
}

/* Runs the member of a lane by the scalar kernel. */
static void by_scalar(team *c, int l)
{
    lane *it = &c->lanes[l];
    mech_member_waits(c->e, it->k, &it->told);
    it->told.stage = mech_member_make(&it->room, it->k, &it->told);
    if (it->told.stage != MECH_MEMBER_WAITS) keep(c, l);
    enter(c, l);
}

static long companion_bound(const mech_companion *c, long long steps)
{
    return !c->most ? 0 : steps > c->most / 10 ? (long)(10 * steps) : c->most;
}

static void leave(team *c, int l, int status)
{
    const mech_ensemble *e = c->e;
    const mech_companion *second = &e->companion;
    lane *it = &c->lanes[l];
    mech_room *r = &it->room;
    mech_outcome *told = it->phase == MAIN ? &it->main : &it->other;
    mech_real *end = it->phase == MAIN ? r->end : r->before;
    *told = (mech_outcome){.status = status};
    told->report.t = c->x.t[l];
    told->report.steps = (long long)c->x.steps[l];
    told->report.n_grid = it->n_grid;
    told->report.stiff_time = it->stiff_time;
    told->report.failed_index = -1;
    read_state(c, l, end);
    mech_watch_end(r, told->report.t, end, r->z, it->phase == MAIN ? r->kept : r->other_kept);
    if (it->phase == MAIN) {
        mech_member_ran(r, it->k, &it->main, &it->told);
        if (status == MECH_REACHED && e->estimated[it->k]) {
            set_out(c, l, TIGHT, second->rtol, second->dt_max, companion_bound(second, told->report.steps));
            return;
        }
    } else if (it->phase == TIGHT && status == MECH_RUNNING) {
        set_out(c, l, LOOSE, second->loose_rtol, second->dt_max, 0);
        return;
    } else {
        const mech_real factor = it->phase == TIGHT ? second->factor : second->loose_factor;
        mech_member_compare(r, &it->main, &it->other, factor, &it->told, e->kept_errors + (size_t)it->k * (size_t)e->n_kept);
    }
    keep(c, l);
    enter(c, l);
}

/* ---- steps */

static void write_rows(team *c, int l)
{
    const mech_options *o = c->e->options;
    const mech_lane_room *x = &c->x;
    lane *it = &c->lanes[l];
    mech_room *r = &it->room;
    const size_t ny = (size_t)c->of->ny;
    const mech_real end = x->t[l];
    for (; it->n_grid < o->n_grid && o->grid[it->n_grid] <= end; it->n_grid++) {
        mech_real *row = rows_of(it) + (size_t)it->n_grid * ny;
        if (o->grid[it->n_grid] == end) {
            read_state(c, l, row);
            continue;
        }
        const mech_real s = (o->grid[it->n_grid] - x->from[l]) / x->h[l];
        mech_dense_beside(x->dense + l, c->of->n_dense, c->of->ny, c->of->width, s, row);
        mech_normalise(r->e->model, row);
    }
    next_row(c, l);
}

/* Of stiffness as stepping/step.c tells it. */
static void look(team *c, int l)
{
    mech_lane_room *x = &c->x;
    lane *it = &c->lanes[l];
    if (x->stiffness[l] > c->of->stiffness_bound) {
        it->calm_hits = 0;
        if (++it->stiff_hits == STIFF_HITS && !(it->stiff_time == it->stiff_time)) it->stiff_time = x->from[l];
    } else if (it->stiff_hits && ++it->calm_hits == CALM_HITS) {
        it->stiff_hits = it->calm_hits = 0;
    }
    const mech_real every = (mech_real)c->of->look_every;
    x->next_look[l] = it->stiff_hits ? x->steps[l] + 1 : (mech_floor(x->steps[l] / every) + 1) * every;
}

static void after_step(team *c, int l)
{
    const mech_lane_room *x = &c->x;
    const unsigned bit = 1u << l;
    lane *it = &c->lanes[l];
    if (x->troubled & bit) {
        by_scalar(c, l);
        return;
    }
    if (x->looked & x->took & bit) look(c, l);
    if (it->stiff_hits >= STIFF_HITS && c->e->turns) { /* a method of two parts goes on with the other one */
        by_scalar(c, l);
        return;
    }
    if (x->passed & bit) write_rows(c, l);
    if (x->watched && x->took & bit) {
        const mech_beside step = {x->from[l], x->h[l], x->dense + l, x->samples + l, c->of->n_dense, c->of->width};
        mech_watch_beside(&it->room, &step);
    }
    if (x->landed & bit && x->limit[l] == c->e->stop) leave(c, l, MECH_REACHED);
    else if (x->full & bit) leave(c, l, MECH_RUNNING);
    else if (x->landed & bit) next_limit(c, l);
}

static void begin_fresh(team *c)
{
    mech_lane_room *x = &c->x;
    while (x->fresh) {
        x->troubled = 0;
        c->of->begin(x);
        const unsigned troubled = x->troubled;
        x->fresh = 0;
        for (int l = 0; l < c->of->width; l++)
            if (troubled >> l & 1) by_scalar(c, l);
    }
}

static void run_team(team *c)
{
    mech_lane_room *x = &c->x;
    for (int l = 0; l < c->of->width; l++) {
        x->t[l] = x->limit[l] = c->e->stop; /* lanes that never get a member stand still */
        enter(c, l);
    }
    begin_fresh(c);
    while (x->alive && !*c->e->stopped) {
        c->of->attempt(x);
        const unsigned told = x->troubled | x->landed | x->full | (x->looked & x->took) | x->passed |
                              (x->watched ? x->took : 0);
        for (int l = 0; told >> l; l++)
            if (told >> l & 1) after_step(c, l);
        begin_fresh(c);
    }
    for (int l = 0; l < c->of->width; l++)
        if (x->alive >> l & 1) mech_member_waits(c->e, c->lanes[l].k, &c->lanes[l].told);
}

void mech_members_in_lanes(void *shared)
{
    mech_crew *crew = shared;
    const mech_ensemble *e = crew->e;
    team c = {.e = e, .crew = crew, .of = e->lanes};
    const int width = c.of->width;
    const size_t each = (mech_room_bytes(e) + ALIGNED - 1) / ALIGNED * ALIGNED, own = lay_out(&c, NULL);
    const size_t given = ((size_t)c.of->nu + ALIGNED) / ALIGNED * ALIGNED, lanes = (size_t)width * sizeof(lane);
    char *memory = calloc(1, ALIGNED + own + given + (size_t)width * each + lanes);
    if (!memory || width > MOST_WIDTH) {
        mech_count(&crew->troubles);
        free(memory);
        return;
    }
    char *block = memory + (ALIGNED - (size_t)memory % ALIGNED) % ALIGNED;
    lay_out(&c, block);
    unsigned char *inputs = (unsigned char *)(block + own);
    for (int k = 0; k < e->options->n_tables; k++) inputs[e->options->tables[k].input] = 1;
    c.x.given = inputs;
    c.x.watched = c.of->n_kept > 0;
    c.lanes = (lane *)(block + own + given + (size_t)width * each);
    for (int l = 0; l < width; l++) mech_room_in(&c.lanes[l].room, e, block + own + given + (size_t)l * each);
    run_team(&c);
    free(memory);
}
