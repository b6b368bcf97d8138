#include "history.h"

#include <stdlib.h>
#include <string.h>

#include "event_state.h"
#include "method.h"

/* Breaks follow from breaks until the derivative that jumps is beyond the order of the method, or they are as many as this:
 * of n delays there are n (n + 1) ... (n + k - 1) / k! of level k. What then still jumps is left to the control of errors. */
enum { MOST_BREAKS = 300, FIRST_RECORDS = 64, FIRST_BREAKS = 64 };

/* In front of a record: its time, its length, 1 where something jumps at its beginning. Then the polynomials of the sources in
 * y (coefficients of all, one after the other), values of those in u where the caller holds them (else not-a-number: they
 * follow a table or the model) and of those in z. */
enum { AT = 0, LENGTH, JUMPS, HEAD };

typedef struct breaking {
    mech_real t;
    int level;          /* 1: values or slopes of what looks back may jump; 2: its second derivatives; ... */
} breaking;

/* What mech_save copies. */
typedef struct part {
    long first, count, n_breaks; /* records kept; breaks to come                                        */
    mech_real shortest, longest;
    int frozen, jumps;           /* the start has happened; the next record begins with a jump           */
} part;

typedef struct mech_history {
    part at;
    const mech_delays *d;
    int n_y, n_u, n_z, nu, n_dense, width, deepest;
    long capacity, break_capacity;
    mech_real *records;          /* [capacity][width]                                                   */
    mech_real *start, *delay, *u; /* [n_sources] values of the start; [n_delays]; [2 nu]                */
    mech_real *slope;            /* [ny] derivatives before the present instant                          */
    breaking *breaks;            /* [n_breaks], by their times                                          */
} mech_history;

static int deepest_level(int n_delays, int order)
{
    int level = 1;
    for (double count = n_delays, of_level = count; level <= order; level++) {
        of_level *= (double)(n_delays + level) / (level + 1);
        if ((count += of_level) > MOST_BREAKS) break;
    }
    return level;
}

mech_history *mech_history_new(const mech_model *model, int n_dense, int order)
{
    const mech_delays *d = model->hybrid->delays;
    const int ny = model->nq + model->nv + model->nx;
    mech_history *h = calloc(1, sizeof *h);
    if (!h) return NULL;
    h->d = d;
    h->n_dense = n_dense;
    h->nu = model->nu;
    h->deepest = deepest_level(d->n_delays, order);
    for (int i = 0; i < d->n_sources; i++) {
        const int kind = d->sources[2 * i];
        if (kind == MECH_SOURCE_Y) h->n_y++;
        if (kind == MECH_SOURCE_U) h->n_u++;
        if (kind == MECH_SOURCE_Z) h->n_z++;
    }
    h->width = HEAD + h->n_y * n_dense + h->n_u + h->n_z;
    h->capacity = FIRST_RECORDS;
    h->break_capacity = FIRST_BREAKS;
    h->records = malloc((size_t)h->capacity * (size_t)h->width * sizeof(mech_real));
    h->start = calloc((size_t)(d->n_sources + d->n_delays + 2 * model->nu + ny), sizeof(mech_real));
    h->breaks = malloc((size_t)h->break_capacity * sizeof(breaking));
    if (!h->records || !h->start || !h->breaks) {
        mech_history_free(h);
        return NULL;
    }
    h->delay = h->start + d->n_sources;
    h->u = h->delay + d->n_delays;
    h->slope = h->u + 2 * model->nu;
    return h;
}

void mech_history_free(mech_history *h)
{
    if (!h) return;
    free(h->records);
    free(h->start);
    free(h->breaks);
    free(h);
}

static mech_real *record(const mech_history *h, long i) { return h->records + (h->at.first + i) * h->width; }

/* ---------------------------------------------------------------- room */

/* Drops what is longer ago than the longest delay, and finds room for one record more. */
static int make_room(mech_history *h, mech_real t)
{
    while (h->at.count > 1 && record(h, 1)[AT] < t - h->at.longest * (1 + 8 * MECH_EPSILON) - 8 * MECH_EPSILON * mech_abs(t)) {
        h->at.first++;
        h->at.count--;
    }
    if (h->at.first + h->at.count < h->capacity) return 1;
    const size_t bytes = (size_t)h->width * sizeof(mech_real);
    if (h->at.count > h->capacity / 2) {
        mech_real *larger = realloc(h->records, 2 * (size_t)h->capacity * bytes);
        if (!larger) return 0;
        h->records = larger;
        h->capacity *= 2;
        if (h->at.first + h->at.count < h->capacity) return 1;
    }
    memmove(h->records, record(h, 0), (size_t)h->at.count * bytes);
    h->at.first = 0;
    return 1;
}

static int make_room_for_break(mech_history *h)
{
    if (h->at.n_breaks < h->break_capacity) return 1;
    breaking *larger = realloc(h->breaks, 2 * (size_t)h->break_capacity * sizeof *larger);
    if (!larger) return 0;
    h->breaks = larger;
    h->break_capacity *= 2;
    return 1;
}

/* ---------------------------------------------------------------- breaks */

/* What rounding leaves between sums of delays, and events, that are the same time. */
static mech_real rounding(mech_real t) { return 16 * MECH_EPSILON * mech_abs(t); }

/* Notes a break after each delay from t on. */
static int follow(mech_solver *s, mech_real t, int level)
{
    mech_history *h = s->history;
    if (level > h->deepest) return MECH_RUNNING;
    for (int k = 0; k < h->d->n_delays; k++) {
        const mech_real then = t + h->delay[k];
        long place = h->at.n_breaks;
        while (place && h->breaks[place - 1].t > then + rounding(then)) place--;
        if (place && h->breaks[place - 1].t >= then - rounding(then)) {
            if (level < h->breaks[place - 1].level) h->breaks[place - 1].level = level;
            continue;
        }
        if (!make_room_for_break(h)) return mech_fail(s, MECH_NO_MEMORY, -1);
        memmove(h->breaks + place + 1, h->breaks + place, (size_t)(h->at.n_breaks - place) * sizeof(breaking));
        h->breaks[place] = (breaking){then, level};
        h->at.n_breaks++;
    }
    return MECH_RUNNING;
}

int mech_history_stop(mech_solver *s)
{
    if (s->history->n_u) s->history->at.jumps = 1;
    return follow(s, s->run->report.t, 1);
}

/* Whether an instant has changed what z holds beside ticks and what is delayed. */
static int changes_modes(const mech_solver *s)
{
    const mech_hybrid *hybrid = s->model->hybrid;
    const mech_event_state *e = s->events;
    int changed = 0;
    for (int i = 0; i < s->model->nz; i++) changed += e->z[i] != e->z_before[i];
    for (int k = 0; k < 2 * hybrid->n_clocks; k++) changed -= e->z[hybrid->clocks[k]] != e->z_before[hybrid->clocks[k]];
    for (int k = 0; k < s->history->d->n_delayed; k++) {
        const int at = s->history->d->delayed[3 * k];
        changed -= e->z[at] != e->z_before[at];
    }
    return changed;
}

int mech_history_instant(mech_solver *s)
{
    const mech_real rounding_of_slopes = MECH_C(1e-12);
    mech_history *h = s->history;
    const mech_event_state *e = s->events;
    int slopes = 0;
    for (int i = 0; i < s->ny; i++)
        slopes |= mech_abs(s->dy[i] - h->slope[i]) > rounding_of_slopes * mech_max(mech_abs(s->dy[i]), mech_abs(h->slope[i]));
    for (int i = 0; i < h->n_y + h->n_u + h->n_z; i++) {
        const int at = h->d->sources[2 * i + 1];
        if (i < h->n_y ? s->y[at] != e->y_before[at] : i >= h->n_y + h->n_u && e->z[at] != e->z_before[at]) h->at.jumps = 1;
    }
    if (!h->at.jumps && !slopes && !changes_modes(s)) return MECH_RUNNING;
    return follow(s, s->run->report.t, h->at.jumps || slopes ? 1 : 2);
}

mech_real mech_history_next(const mech_solver *s)
{
    const mech_history *h = s->history;
    const mech_real last = s->run->report.t + h->at.shortest;
    return h->at.n_breaks ? mech_min(h->breaks[0].t, last) : last;
}

int mech_history_at_break(mech_solver *s)
{
    mech_history *h = s->history;
    const mech_real t = s->run->report.t;
    int found = 0;
    while (h->at.n_breaks && h->breaks[0].t <= t + rounding(t)) {
        const breaking here = h->breaks[0];
        h->at.n_breaks--;
        memmove(h->breaks, h->breaks + 1, (size_t)h->at.n_breaks * sizeof(breaking));
        const int status = follow(s, here.t, here.level + 1);
        if (status) return status;
        found = 1;
    }
    return found;
}

/* ---------------------------------------------------------------- the start */

/* The sources at the present time. */
static void read_sources(mech_solver *s, mech_real *out)
{
    const mech_history *h = s->history;
    const mech_real t = s->run->report.t;
    if (h->n_u) mech_inputs(s->model, s->o.tables, s->o.n_tables, s->segments, t, s->o.p, h->u);
    for (int i = 0; i < h->d->n_sources; i++) {
        const int at = h->d->sources[2 * i + 1];
        switch (h->d->sources[2 * i]) {
        case MECH_SOURCE_Y: out[i] = s->y[at]; break;
        case MECH_SOURCE_U: out[i] = h->u[at]; break;
        case MECH_SOURCE_Z: out[i] = s->o.z[at]; break;
        default: out[i] = t;
        }
    }
}

int mech_history_begin(mech_solver *s)
{
    mech_history *h = s->history;
    memset(&h->at, 0, sizeof h->at);
    h->d->times(s->run->report.t, s->y, s->u, s->o.z, s->o.p, h->delay);
    h->at.shortest = h->at.longest = h->delay[0];
    for (int k = 0; k < h->d->n_delays; k++) {
        if (!(h->delay[k] > 0) || !mech_finite(h->delay[k])) {
            s->run->report.failed_value = h->delay[k];
            return mech_fail(s, MECH_NO_DELAY, k);
        }
        h->at.shortest = mech_min(h->at.shortest, h->delay[k]);
        h->at.longest = mech_max(h->at.longest, h->delay[k]);
    }
    return MECH_RUNNING;
}

int mech_history_freeze(mech_solver *s)
{
    mech_history *h = s->history;
    if (!h->at.frozen) read_sources(s, h->start);
    h->at.frozen = h->at.jumps = 1; /* or taken up again with what the caller has changed */
    return follow(s, s->run->report.t, 1);
}

/* The value of an input that the caller holds by a table of one row; else it follows a table or the model. */
static mech_real held(const mech_solver *s, int input)
{
    for (int k = 0; k < s->o.n_tables; k++)
        if (s->o.tables[k].input == input && s->o.tables[k].n == 1) return s->o.tables[k].value[0];
    return (mech_real)NAN;
}

/* ---------------------------------------------------------------- looking back */

/* Where one looks at: a record, or -1 for the start, and the time there. */
typedef struct place {
    long record;
    mech_real t;
    int before; /* what comes before t, where something jumps there */
} place;

static place place_of(const mech_history *h, mech_real t, mech_real delay, int behind)
{
    mech_real then = t - delay;
    const mech_real near = rounding(mech_max(mech_abs(t), delay));
    long low = -1, high = h->at.count; /* the record before high begins at then or before */
    while (high - low > 1) {
        const long middle = low + (high - low) / 2;
        if (record(h, middle)[AT] <= then + near)
            low = middle;
        else
            high = middle;
    }
    if (low < 0) return (place){-1, then, 0};
    const mech_real *r = record(h, low);
    if (then > r[AT] + near) return (place){low, mech_min(then, r[AT] + r[LENGTH]), 0};
    /* at its beginning */
    if (behind || r[JUMPS] == 0) return (place){low, r[AT], 0};
    return (place){low - 1, r[AT], 1};
}

/* Source i, the k-th of those in y. */
static mech_real polynomial_at(const mech_history *h, const mech_real *r, int k, mech_real t)
{
    const mech_real s = r[LENGTH] > 0 ? (t - r[AT]) / r[LENGTH] : 0, rest = 1 - s;
    const mech_real *c = r + HEAD + k;
    mech_real sum = c[(h->n_dense - 1) * h->n_y];
    for (int j = h->n_dense - 2; j >= 0; j--) sum = c[j * h->n_y] + (j % 2 ? rest : s) * sum;
    return sum;
}

/* An input at the place of read_inputs. One that the caller holds now, and did not then, followed the model. */
static mech_real input_at(const mech_solver *s, int input)
{
    const mech_history *h = s->history;
    const mech_real now = held(s, input);
    return now == now ? h->u[h->nu + input] : h->u[input];
}

static mech_real source_at(mech_solver *s, const place *at, int i)
{
    mech_history *h = s->history;
    const int kind = h->d->sources[2 * i];
    if (at->record < 0) return h->start[i];
    const mech_real *r = record(h, at->record), *values = r + HEAD + h->n_y * h->n_dense - h->n_y;
    switch (kind) {
    case MECH_SOURCE_Y: return polynomial_at(h, r, i, at->t);
    case MECH_SOURCE_U: return values[i] == values[i] ? values[i] : input_at(s, h->d->sources[2 * i + 1]);
    case MECH_SOURCE_Z: return values[i];
    default: return at->t;
    }
}

/* All inputs that follow tables or the model, at a place. */
static void read_inputs(mech_solver *s, const place *at)
{
    mech_history *h = s->history;
    if (!h->n_u || at->record < 0) return;
    const mech_real t = at->before ? at->t - 2 * MECH_EPSILON * mech_abs(at->t) : at->t;
    mech_inputs(s->model, s->o.tables, s->o.n_tables, NULL, t, s->o.p, h->u);
    mech_inputs(s->model, NULL, 0, NULL, t, s->o.p, h->u + h->nu);
}

static void look(mech_solver *s, mech_real t, int behind)
{
    mech_history *h = s->history;
    const mech_delays *d = h->d;
    mech_real *z = (mech_real *)s->o.z;
    if (!h->at.frozen) read_sources(s, h->start);
    for (int k = 0, row = 0; k < d->n_delays; k++) {
        const place at = place_of(h, t, h->delay[k], behind);
        read_inputs(s, &at);
        for (; row < d->n_delayed && d->delayed[3 * row + 2] == k; row++)
            z[d->delayed[3 * row]] = source_at(s, &at, d->delayed[3 * row + 1]);
    }
}

void mech_history_look(mech_solver *s, mech_real t) { look(s, t, t <= s->run->from); }

void mech_history_look_before(mech_solver *s)
{
    memcpy(s->history->slope, s->dy, (size_t)s->ny * sizeof(mech_real));
    look(s, s->run->report.t, 0);
}

/* ---------------------------------------------------------------- steps */

int mech_history_keep(mech_solver *s, mech_real length)
{
    mech_history *h = s->history;
    const mech_real t = s->run->report.t;
    if (!make_room(h, t)) return mech_fail(s, MECH_NO_MEMORY, -1);
    mech_fill_dense(s, length);
    mech_real *r = record(h, h->at.count++), *next = r + HEAD;
    r[AT] = t;
    r[LENGTH] = length;
    r[JUMPS] = h->at.jumps;
    h->at.jumps = 0;
    for (int c = 0; c < h->n_dense; c++)
        for (int i = 0; i < h->n_y; i++) *next++ = s->dense[c * s->ny + h->d->sources[2 * i + 1]];
    for (int i = h->n_y; i < h->n_y + h->n_u; i++) *next++ = held(s, h->d->sources[2 * i + 1]);
    for (int i = h->n_y + h->n_u; i < h->n_y + h->n_u + h->n_z; i++) *next++ = s->o.z[h->d->sources[2 * i + 1]];
    return MECH_RUNNING;
}

/* ---------------------------------------------------------------- saved states */

static size_t numbers_of(const mech_history *h) { return (size_t)(h->d->n_sources + h->d->n_delays); }

size_t mech_history_size(const mech_solver *s)
{
    const mech_history *h = s->history;
    return sizeof(part) + (numbers_of(h) + (size_t)(h->at.count * h->width)) * sizeof(mech_real) +
           (size_t)h->at.n_breaks * sizeof(breaking);
}

void mech_history_save(const mech_solver *s, char *memory)
{
    const mech_history *h = s->history;
    const size_t numbers = numbers_of(h) * sizeof(mech_real);
    const size_t records = (size_t)(h->at.count * h->width) * sizeof(mech_real);
    part at = h->at;
    at.first = 0;
    memcpy(memory, &at, sizeof at);
    memcpy(memory + sizeof at, h->start, numbers);
    memcpy(memory + sizeof at + numbers, record(h, 0), records);
    memcpy(memory + sizeof at + numbers + records, h->breaks, (size_t)at.n_breaks * sizeof(breaking));
}

void mech_history_load(mech_solver *s, const char *memory)
{
    mech_history *h = s->history;
    part at;
    memcpy(&at, memory, sizeof at);
    if (at.count > h->capacity || at.n_breaks > h->break_capacity) { /* of another solver of this model */
        const long records = at.count > h->capacity ? at.count : h->capacity;
        const long breaks = at.n_breaks > h->break_capacity ? at.n_breaks : h->break_capacity;
        mech_real *larger = realloc(h->records, (size_t)(records * h->width) * sizeof(mech_real));
        if (larger) h->records = larger;
        breaking *more = realloc(h->breaks, (size_t)breaks * sizeof(breaking));
        if (more) h->breaks = more;
        if (!larger || !more) {
            s->run->report.status = MECH_NO_MEMORY;
            return;
        }
        h->capacity = records;
        h->break_capacity = breaks;
    }
    const size_t numbers = numbers_of(h) * sizeof(mech_real);
    const size_t records = (size_t)(at.count * h->width) * sizeof(mech_real);
    h->at = at;
    memcpy(h->start, memory + sizeof at, numbers);
    memcpy(h->records, memory + sizeof at + numbers, records);
    memcpy(h->breaks, memory + sizeof at + numbers + records, (size_t)at.n_breaks * sizeof(breaking));
}
