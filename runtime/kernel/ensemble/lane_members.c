/* Members side by side: a thread fills its lanes from the queue, and a lane whose member has ended takes the next one.
 *
 * The companion of a member runs in its lane. A member that is in trouble there runs once more by the scalar kernel. */
#include <stdlib.h>

#include "course.h"
#include "hits.h"
#include "lanes.h"
#include "threads.h"

enum { ALIGNED = 64, MOST_WIDTH = 16, MOST_GROUPS = 4 };

/* What runs in one lane. */
typedef struct lane {
    mech_course course;
    int next_stop;
    long n_grid;         /* rows written                                                        */
    mech_hits hits;
} lane;

typedef struct team {
    const mech_ensemble *e;
    mech_crew *crew;
    const mech_lanes *of;
    mech_lane_room x[MOST_GROUPS];
    lane *lanes;         /* of all rooms; lane l is `l % width` of room `l / width`             */
    int n;
} team;

/* ---- the room of a thread */

static mech_real *take(char **next, int count, int width)
{
    mech_real *taken = (mech_real *)*next;
    *next += ((size_t)(count > 0 ? count : 1) * (size_t)width * sizeof(mech_real) + ALIGNED - 1) / ALIGNED * ALIGNED;
    return taken;
}

static size_t lay_out(const mech_lanes *of, mech_lane_room *x, char *block)
{
    char *next = block;
    mech_real **const single[] = {&x->t,         &x->rtol,      &x->longest,   &x->limit, &x->next_row, &x->most,     &x->dt,
                                  &x->error_old, &x->steps,     &x->next_look, &x->order, &x->from,  &x->h,        &x->stiffness};
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

static mech_lane_room *room_of(team *c, int l) { return &c->x[l / c->of->width]; }

static void put(team *c, int l, const mech_real *from, int n, mech_real *to)
{
    const int width = c->of->width;
    for (int i = 0; i < n; i++) to[i * width + l % width] = from[i];
}

static void read_state(team *c, int l, mech_real *y)
{
    const int width = c->of->width;
    for (int i = 0; i < c->of->ny; i++) y[i] = room_of(c, l)->y[i * width + l % width];
}

static void next_limit(team *c, int l)
{
    mech_lane_room *x = room_of(c, l);
    const int s = l % c->of->width;
    const mech_ensemble *e = c->e;
    const mech_options *o = e->options;
    lane *it = &c->lanes[l];
    while (it->next_stop < o->n_stops && o->stops[it->next_stop] <= x->t[s]) it->next_stop++;
    const int stop = it->next_stop < o->n_stops && o->stops[it->next_stop] < e->stop;
    x->limit[s] = stop ? o->stops[it->next_stop] : e->stop;
}

static void next_row(team *c, int l)
{
    mech_lane_room *x = room_of(c, l);
    const int s = l % c->of->width;
    const mech_options *o = c->e->options;
    const lane *it = &c->lanes[l];
    x->next_row[s] = it->n_grid < o->n_grid ? o->grid[it->n_grid] : (mech_real)INFINITY;
}

/* Lets the member of a lane begin the run that its course has come to. */
static void set_out(team *c, int l)
{
    mech_lane_room *x = room_of(c, l);
    const int s = l % c->of->width;
    const mech_ensemble *e = c->e;
    lane *it = &c->lanes[l];
    mech_room *r = &it->course.room;
    it->next_stop = 0;
    it->n_grid = it->course.n_grid;
    it->hits = MECH_NO_HITS;
    put(c, l, r->y, c->of->ny, x->y);
    put(c, l, r->atol, c->of->ny, x->atol);
    put(c, l, r->p, c->of->n_all, x->p);
    put(c, l, r->z, c->of->nz, x->z);
    for (int k = 0; k < e->options->n_tables; k++)
        x->u[r->tables[k].input * c->of->width + s] = r->tables[k].value[0];
    x->t[s] = e->options->t0;
    x->rtol[s] = it->course.rtol;
    x->longest[s] = it->course.dt_max;
    x->most[s] = it->course.bound ? (mech_real)it->course.bound : (mech_real)INFINITY;
    x->next_look[s] = c->of->look_every ? (mech_real)c->of->look_every : (mech_real)INFINITY;
    next_limit(c, l);
    next_row(c, l);
    x->fresh |= 1u << s;
    x->alive |= 1u << s;
}

/* Gives a lane the next member of the queue that can begin; none: the lane stays open. */
static void enter(team *c, int l)
{
    mech_lane_room *x = room_of(c, l);
    const int s = l % c->of->width;
    const mech_ensemble *e = c->e;
    mech_course *course = &c->lanes[l].course;
    x->alive &= ~(1u << s);
    while (!*e->stopped) {
        const long k = mech_count(&c->crew->next);
        if (k >= e->n) return;
        if (e->members[k].stage != MECH_MEMBER_WAITS) continue;
        if (mech_course_begin(e, course, k)) {
            set_out(c, l);
            return;
        }
        mech_course_keep(e, course);
    }
}

/* Runs the member of a lane by the scalar kernel. */
static void by_scalar(team *c, int l)
{
    mech_course *course = &c->lanes[l].course;
    mech_course_by_scalar(c->e, course);
    if (course->told.stage != MECH_MEMBER_WAITS) mech_course_keep(c->e, course);
    enter(c, l);
}

static void leave(team *c, int l, int status)
{
    const mech_lane_room *x = room_of(c, l);
    const int s = l % c->of->width;
    lane *it = &c->lanes[l];
    read_state(c, l, mech_course_end(&it->course));
    if (mech_course_ended(c->e, &it->course, status, x->t[s], x->steps[s], it->n_grid, it->hits.since)) {
        set_out(c, l);
        return;
    }
    mech_course_keep(c->e, &it->course);
    enter(c, l);
}

/* ---- steps */

static void write_rows(team *c, int l)
{
    mech_lane_room *x = room_of(c, l);
    const int s = l % c->of->width;
    const mech_options *o = c->e->options;
    lane *it = &c->lanes[l];
    const size_t ny = (size_t)c->of->ny;
    const mech_real end = x->t[s];
    for (; it->n_grid < o->n_grid && o->grid[it->n_grid] <= end; it->n_grid++) {
        mech_real *row = mech_course_rows(&it->course) + (size_t)it->n_grid * ny;
        if (o->grid[it->n_grid] == end) {
            read_state(c, l, row);
            continue;
        }
        const mech_real place = (o->grid[it->n_grid] - x->from[s]) / x->h[s];
        mech_dense_beside(x->dense + s, x->terms, c->of->ny, c->of->width, c->of->plain, place, row);
        mech_normalise(c->e->model, row);
    }
    next_row(c, l);
}

static void look(team *c, int l)
{
    mech_lane_room *x = room_of(c, l);
    const int s = l % c->of->width;
    lane *it = &c->lanes[l];
    x->next_look[s] = mech_hit(&it->hits, x->stiffness[s] > c->of->stiffness_bound, x->from[s], x->steps[s],
                               (mech_real)c->of->look_every);
}

static void after_step(team *c, int l)
{
    mech_lane_room *x = room_of(c, l);
    const int s = l % c->of->width;
    const unsigned bit = 1u << s;
    lane *it = &c->lanes[l];
    if (x->troubled & bit) {
        by_scalar(c, l);
        return;
    }
    if (x->looked & x->took & bit) look(c, l);
    if (it->hits.stiff >= STIFF_HITS && c->e->turns) { /* a method of two parts goes on with the other one */
        by_scalar(c, l);
        return;
    }
    if (x->passed & bit) write_rows(c, l);
    if (x->watched && x->took & bit) {
        const mech_beside step = {x->from[s], x->h[s], x->dense + s, x->samples + s, x->terms, c->of->width, c->of->plain};
        mech_watch_beside(&it->course.room, &step);
    }
    if (x->landed & bit && x->limit[s] == c->e->stop) leave(c, l, MECH_REACHED);
    else if (x->full & bit) leave(c, l, MECH_RUNNING);
    else if (x->landed & bit) next_limit(c, l);
}

static void begin_fresh(team *c)
{
    const int width = c->of->width;
    for (int g = 0; g < c->of->groups; g++) {
        mech_lane_room *x = &c->x[g];
        while (x->fresh) {
            x->troubled = 0;
            c->of->begin(x);
            const unsigned troubled = x->troubled;
            x->fresh = 0;
            for (int s = 0; s < width; s++)
                if (troubled >> s & 1) by_scalar(c, g * width + s);
        }
    }
}

static unsigned alive(const team *c)
{
    unsigned some = 0;
    for (int g = 0; g < c->of->groups; g++) some |= c->x[g].alive;
    return some;
}

static void run_team(team *c)
{
    const int width = c->of->width;
    for (int l = 0; l < c->n; l++) {
        mech_lane_room *x = room_of(c, l);
        x->t[l % width] = x->limit[l % width] = c->e->stop; /* lanes that never get a member stand still */
        enter(c, l);
    }
    begin_fresh(c);
    while (alive(c) && !*c->e->stopped) {
        c->of->attempt(c->x);
        for (int g = 0; g < c->of->groups; g++) {
            const mech_lane_room *x = &c->x[g];
            const unsigned told = x->troubled | x->landed | x->full | (x->looked & x->took) | x->passed |
                                  (x->watched ? x->took : 0);
            for (int s = 0; told >> s; s++)
                if (told >> s & 1) after_step(c, g * width + s);
        }
        begin_fresh(c);
    }
    for (int l = 0; l < c->n; l++)
        if (room_of(c, l)->alive >> l % width & 1) mech_member_waits(c->e, c->lanes[l].course.k, &c->lanes[l].course.told);
}

void mech_members_in_lanes(void *shared)
{
    mech_crew *crew = shared;
    const mech_ensemble *e = crew->e;
    const mech_lanes *of = e->lanes;
    team c = {.e = e, .crew = crew, .of = of, .n = of->width * of->groups};
    const size_t each = (mech_room_bytes(e) + ALIGNED - 1) / ALIGNED * ALIGNED, own = lay_out(of, &c.x[0], NULL);
    const size_t given = ((size_t)of->nu + ALIGNED) / ALIGNED * ALIGNED, n = (size_t)c.n;
    char *memory = calloc(1, ALIGNED + (size_t)of->groups * own + given + n * (each + sizeof(lane)));
    if (!memory || of->width > MOST_WIDTH || of->groups > MOST_GROUPS) {
        mech_count(&crew->troubles);
        free(memory);
        return;
    }
    char *next = memory + (ALIGNED - (size_t)memory % ALIGNED) % ALIGNED;
    for (int g = 0; g < of->groups; g++, next += own) lay_out(of, &c.x[g], next);
    unsigned char *inputs = (unsigned char *)next;
    next += given;
    for (int k = 0; k < e->options->n_tables; k++) inputs[e->options->tables[k].input] = 1;
    for (int g = 0; g < of->groups; g++) {
        c.x[g].given = inputs;
        c.x[g].watched = of->n_kept > 0;
    }
    c.lanes = (lane *)(next + n * each);
    for (int l = 0; l < c.n; l++) mech_room_in(&c.lanes[l].course.room, e, next + (size_t)l * each);
    run_team(&c);
    free(memory);
}
