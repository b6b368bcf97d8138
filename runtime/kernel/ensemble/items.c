/* Members that a device takes on: their runs made ready, and what these gave read. */
#include "items.h"

#include <stdlib.h>
#include <string.h>

#include "course.h"
#include "item_layout.h"
#include "threads.h"

struct mech_items {
    mech_crew crew;
    const mech_item_arrays *arrays;
    long count;
    mech_course *courses;   /* [n]                                                   */
    unsigned char *due;     /* [n] a run of it is to be made                         */
};

static size_t room_bytes(const mech_ensemble *e) { return (mech_room_bytes(e) + 63) / 64 * 64; }

size_t mech_items_bytes(const mech_ensemble *e) { return room_bytes(e) + sizeof(mech_course) + 1; }

static size_t state_size(const mech_ensemble *e) { return (size_t)(e->model->nq + e->model->nv + e->model->nx); }

static void make_ready(void *shared)
{
    mech_items *it = shared;
    const mech_ensemble *e = it->crew.e;
    while (!*e->stopped) {
        const long k = mech_count(&it->crew.next);
        if (k >= e->n) return;
        if (e->members[k].stage != MECH_MEMBER_WAITS) continue;
        it->due[k] = (unsigned char)mech_course_begin(e, &it->courses[k], k);
        if (!it->due[k]) mech_course_keep(e, &it->courses[k]);
    }
}

mech_items *mech_items_open(const mech_ensemble *e)
{
    const size_t n = (size_t)e->n, head = (sizeof(mech_items) + 63) / 64 * 64;
    const size_t courses = (n * sizeof(mech_course) + 63) / 64 * 64;
    char *memory = calloc(1, head + courses + n * room_bytes(e) + n);
    if (!memory) return NULL;
    mech_items *it = (mech_items *)memory;
    it->crew.e = e;
    it->courses = (mech_course *)(memory + head);
    char *rooms = memory + head + courses;
    it->due = (unsigned char *)(rooms + n * room_bytes(e));
    for (size_t k = 0; k < n; k++) mech_room_in(&it->courses[k].room, e, rooms + k * room_bytes(e));
    mech_together(make_ready, it, e->threads);
    return it;
}

static void put(mech_real *to, size_t first, const mech_real *from, size_t count, size_t n, size_t k)
{
    for (size_t i = 0; i < count; i++) to[(first + i) * n + k] = from[i];
}

static void take(mech_real *to, const mech_real *from, size_t first, size_t count, size_t n, size_t k)
{
    for (size_t i = 0; i < count; i++) to[i] = from[(first + i) * n + k];
}

long mech_items_next(mech_items *it, const mech_item_arrays *a)
{
    const mech_ensemble *e = it->crew.e;
    const mech_model *m = e->model;
    const size_t n = (size_t)e->n, ny = state_size(e), np = (size_t)(m->np + m->nh), nz = (size_t)m->nz;
    const size_t n_sums = mech_keeps_steps(e) ? (size_t)e->n_kept : 0;
    long count = 0;
    for (size_t k = 0; k < n; k++) {
        if (!it->due[k]) continue;
        const mech_course *c = &it->courses[k];
        const mech_room *r = &c->room;
        const mech_real one[MECH_ITEM_SINGLES] = {
            [MECH_ITEM_T] = e->options->t0,
            [MECH_ITEM_RTOL] = c->rtol,
            [MECH_ITEM_LONGEST] = c->dt_max,
            [MECH_ITEM_MOST] = c->bound ? (mech_real)c->bound : (mech_real)INFINITY,
            [MECH_ITEM_SINCE] = (mech_real)NAN,
        };
        put(a->numbers, 0, one, MECH_ITEM_SINGLES, n, k);
        put(a->numbers, MECH_ITEM_SINGLES, r->y, ny, n, k);
        put(a->numbers, MECH_ITEM_SINGLES + ny, r->atol, ny, n, k);
        put(a->numbers, MECH_ITEM_SINGLES + 2 * ny, mech_watch_sums(r), n_sums, n, k);
        put(a->fixed, 0, r->p, np, n, k);
        put(a->fixed, np, r->z, nz, n, k);
        for (int j = 0; j < e->options->n_tables; j++)
            a->fixed[(np + nz + (size_t)r->tables[j].input) * n + k] = r->tables[j].value[0];
        for (int j = 0; j < MECH_ITEM_MARKS; j++) a->marks[(size_t)j * n + k] = j == MECH_ITEM_ROWS ? (int)c->n_grid : 0;
        a->which[count++] = (unsigned)k;
    }
    it->count = count;
    return count;
}

static void read_one(mech_items *it, size_t k)
{
    const mech_ensemble *e = it->crew.e;
    const mech_item_arrays *a = it->arrays;
    mech_course *c = &it->courses[k];
    const size_t n = (size_t)e->n, ny = state_size(e);
    const int *mark = a->marks + k, status = mark[MECH_ITEM_STATUS * n];
    it->due[k] = 0;
    if (status == MECH_ITEM_TROUBLED) {
        mech_course_by_scalar(e, c);
    } else if (status == MECH_ITEM_REACHED || status == MECH_ITEM_FULL) {
        mech_real one[MECH_ITEM_SINGLES], *rows = mech_course_rows(c);
        take(one, a->numbers, 0, MECH_ITEM_SINGLES, n, k);
        take(mech_course_end(c), a->numbers, MECH_ITEM_SINGLES, ny, n, k);
        if (mech_keeps_steps(e))
            take(mech_watch_sums(&c->room), a->numbers, MECH_ITEM_SINGLES + 2 * ny, (size_t)e->n_kept, n, k);
        const long written = mark[MECH_ITEM_ROWS * n];
        for (long i = c->n_grid; i < written; i++) take(rows + (size_t)i * ny, a->rows, (size_t)i * ny, ny, n, k);
        it->due[k] = (unsigned char)mech_course_ended(e, c, status == MECH_ITEM_REACHED ? MECH_REACHED : MECH_RUNNING,
                                                      one[MECH_ITEM_T], one[MECH_ITEM_STEPS], written, one[MECH_ITEM_SINCE]);
        if (it->due[k]) return;
    } else {
        mech_member_waits(e, c->k, &c->told);
    }
    mech_course_keep(e, c);
}

static void read_all(void *shared)
{
    mech_items *it = shared;
    for (long i = mech_count(&it->crew.next); i < it->count; i = mech_count(&it->crew.next))
        read_one(it, it->arrays->which[i]);
}

void mech_items_take(mech_items *it, const mech_item_arrays *arrays, long count)
{
    it->arrays = arrays;
    it->count = count;
    it->crew.next = 0;
    mech_together(read_all, it, it->crew.e->threads);
}

void mech_items_close(mech_items *it) { free(it); }
