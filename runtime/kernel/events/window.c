#include "window.h"

#include <string.h>

#include "crowd.h"
#include "method.h"
#include "neighbours.h"
#include "step.h"

enum { MOST_PARTS = 30 };

static const mech_crowd *crowd(const mech_solver *s) { return s->model->hybrid->crowd; }

static int contact_of(const mech_solver *s, int i) { return (int)s->events->window[i] / 2; }

static int is_slip(const mech_solver *s, int i) { return (int)s->events->window[i] % 2; }

static mech_crowd_at now(mech_solver *s, mech_real t, const mech_real *y)
{
    mech_event_state *e = s->events;
    mech_surroundings(s, t);
    if (s->model->nu) memcpy(e->given, s->u, (size_t)s->model->nu * sizeof(mech_real));
    return (mech_crowd_at){s->model, t, y, s->u, e->z, s->o.p, e->given};
}

/* ---------------------------------------------------------------- which rows are at hand */

/* Writes what row i has in arrays of rows to its place, or, `back` 0, the other way. */
static void move(mech_solver *s, int i, int back)
{
    mech_event_state *e = s->events;
    const int k = s->model->hybrid->n_switches + i;
    mech_real *kept = e->kept + (int)e->window[i] * MECH_KEPT;
    mech_real *at[] = {e->gap_scale + i, e->speed + i, e->force + i, e->mobility + i, e->last_hit + i, e->delay + i,
                       e->flags + i,     e->signs + i, e->fresh + k, e->rate_scale + k};
    for (int f = 0; f < MECH_KEPT_MODE; f++) *(back ? kept + f : at[f]) = *(back ? at[f] : kept + f);
}

static int mode_of(const mech_solver *s, int i)
{
    const mech_event_state *e = s->events;
    const mech_row *row = e->rows + i;
    if (!(e->z[row->flag] > MECH_C(0.5))) return MECH_CROWD_OPEN;
    if (!mech_crowd_kind_of(crowd(s), contact_of(s, i))->friction) return MECH_CROWD_CLOSED;
    if (e->z[row[1].flag] > MECH_C(0.5)) return MECH_CROWD_STICKS;
    const mech_real sign = e->z[row[1].sign];
    return sign > 0 ? MECH_CROWD_FORWARD : sign < 0 ? MECH_CROWD_BACKWARD : MECH_CROWD_CLOSED;
}

/* Lists in z what is closed: what was, but for the rows at hand, then these. */
static void list_closed(mech_solver *s)
{
    const mech_crowd *c = crowd(s);
    mech_event_state *e = s->events;
    mech_real *list = e->z + c->first;
    int n = 0, unlisted = 0;
    for (int i = 0; i < e->n_rows; i++)
        if (!is_slip(s, i)) e->kept[2 * contact_of(s, i) * MECH_KEPT + MECH_KEPT_MODE] = -1 - mode_of(s, i);
    for (int k = 0; k < c->capacity && list[k] > 0; k++)
        if (!(e->kept[2 * ((int)list[k] / 8 - 1) * MECH_KEPT + MECH_KEPT_MODE] < 0)) list[n++] = list[k];
    for (int i = 0; i < e->n_rows; i++) {
        if (is_slip(s, i)) continue;
        mech_real *mode = e->kept + 2 * contact_of(s, i) * MECH_KEPT + MECH_KEPT_MODE;
        *mode = -1 - *mode;
        if (*mode > 0 && n == c->capacity) unlisted++;
        if (*mode > 0 && n < c->capacity) list[n++] = 8 * (contact_of(s, i) + 1) + *mode;
    }
    e->counters[MECH_UNLISTED] = unlisted;
    for (int k = n; k < c->capacity && list[k] > 0; k++) list[k] = 0;
}

static void put_back(mech_solver *s)
{
    if (s->events->n_rows) list_closed(s);
    for (int i = 0; i < s->events->n_rows; i++) move(s, i, 1);
}

static void set_count(mech_solver *s, int n)
{
    s->events->n_rows = n;
    s->events->n = s->model->hybrid->n_switches + n;
    s->events->counters[MECH_AT_HAND] = n;
}

void mech_window_again(mech_solver *s) { set_count(s, (int)s->events->counters[MECH_AT_HAND]); }

/* Adds the rows of a contact; 0 where there is no room. */
static int add(mech_solver *s, int contact)
{
    mech_event_state *e = s->events;
    const int n = e->n_rows, friction = mech_crowd_kind_of(crowd(s), contact)->friction, nz = s->model->nz;
    const mech_real mode = e->kept[2 * contact * MECH_KEPT + MECH_KEPT_MODE];
    if (n + 1 + friction > MECH_MOST_ROWS) return 0;
    for (int k = 0; k <= friction; k++) {
        const int i = n + k;
        e->window[i] = 2 * contact + k;
        e->places[i] = (mech_row){k ? MECH_FRICTION : MECH_CONTACT, k ? n : -1, nz + i, k ? nz + MECH_MOST_ROWS + i : -1,
                                  nz + 2 * MECH_MOST_ROWS + i, -1};
        e->z[nz + i] = k ? mode == MECH_CROWD_STICKS : mode > 0;
        e->z[nz + MECH_MOST_ROWS + i] = !k ? 0 : mode == MECH_CROWD_FORWARD ? 1 : mode == MECH_CROWD_BACKWARD ? -1 : 0;
        e->z[nz + 2 * MECH_MOST_ROWS + i] = 0;
        e->impulse[i] = e->open[i] = e->slides[i] = 0;
        move(s, i, 0);
    }
    set_count(s, n + 1 + friction);
    return 1;
}

/* From how far a contact may be reached: its gap over the largest sum of speeds; negative where that is not known. */
static mech_real distance(const mech_solver *s, int contact, const mech_real *values)
{
    const mech_crowd_kind *k = mech_crowd_kind_of(crowd(s), contact);
    mech_real reach = 0;
    for (int i = 0; i < k->n_normal; i++) {
        if (values[5 + k->n_normal + i] < 0) return -1;
        reach += values[5 + k->n_normal + i];
    }
    const mech_real gap = values[0] - MECH_C(1e-6) * s->events->kept[2 * contact * MECH_KEPT + MECH_KEPT_GAP];
    return reach > 0 ? MECH_C(0.999) * gap / reach : -1;
}

/* ---------------------------------------------------------------- steps and instants */

/* More than any coordinate moves within the attempted step. */
static mech_real farthest(const mech_solver *s, mech_real h)
{
    const mech_model *m = s->model;
    mech_real most = 0;
    for (int i = 0; i < m->nv; i++) {
        const int k = m->nq + i;
        const mech_real speed = mech_max(mech_abs(s->y[k]), mech_abs(s->y_new[k]));
        most = mech_max(most, speed + h / 2 * mech_max(mech_abs(s->dy[k]), mech_abs(s->dy_new[k])));
    }
    return h * most;
}

/* Takes the contacts that may be reached, those that are closed first; 0 where they are too many. */
static int take_near(mech_solver *s, mech_real reach)
{
    mech_event_state *e = s->events;
    int closed[MECH_MOST_ROWS], open[MECH_MOST_ROWS], n_closed = 0, n_open = 0;
    const mech_crowd_at at = now(s, s->run->report.t, s->y);
    const mech_real moved = e->counters[MECH_MOVED];
    set_count(s, 0);
    for (int k = 0; k < crowd(s)->n; k++) {
        if (e->wake[k] > moved + reach) continue;
        if (!(e->kept[2 * k * MECH_KEPT + MECH_KEPT_MODE] > 0)) {
            mech_crowd_values(&at, k, e->values);
            mech_widen(e->kept + 2 * k * MECH_KEPT + MECH_KEPT_GAP, e->values[0]);
            const mech_real far = distance(s, k, e->values);
            e->wake[k] = moved + mech_max(far, 0);
            if (far > reach) continue;
            if (n_open == MECH_MOST_ROWS) return 0;
            open[n_open++] = k;
        } else {
            closed[n_closed++] = k;
        }
    }
    if (n_closed > 1) mech_neighbours_order(s, n_closed, closed);
    for (int k = 0; k < n_closed; k++)
        if (!add(s, closed[k])) return 0;
    for (int k = 0; k < n_open; k++)
        if (!add(s, open[k])) return 0;
    return 1;
}

int mech_window_for_step(mech_solver *s, mech_real *t_new, mech_real *h)
{
    mech_event_state *e = s->events;
    put_back(s);
    for (int part = 0; !take_near(s, farthest(s, *h)); part++) {
        set_count(s, 0);
        if (part == MOST_PARTS) return mech_fail(s, MECH_NO_MODE, -1);
        const int status = mech_step_try(s, s->run->report.t + *h / 4, t_new, h);
        if (status) return status;
    }
    e->counters[MECH_MOVED] += farthest(s, *h);
    return MECH_RUNNING;
}

/* Whether a contact takes part in an instant: -1 where it does not touch, 1 where something begins there: it is the one that was
 * located, or it approaches, or its gap is to be closed again; 0 where it does so only with those that it touches. */
static int takes_part(const mech_solver *s, const mech_crowd_at *at, int contact, int located)
{
    const mech_real *kept = s->events->kept + 2 * contact * MECH_KEPT, *values = s->events->values;
    mech_crowd_values(at, contact, s->events->values);
    const mech_real gap = values[0], size = MECH_C(2e-9) * kept[MECH_KEPT_GAP];
    const int closed = kept[MECH_KEPT_MODE] > 0;
    if (!located && !closed && gap > size) return -1;
    const mech_real rate = mech_crowd_along(crowd(s), contact, 0, values, s->y + s->model->nq) + values[1];
    return located || (closed ? mech_abs(gap) > size : rate < -MECH_C(1e-11) * kept[MECH_KEPT_SPEED]);
}

int mech_window_for_instant(mech_solver *s, int hit)
{
    mech_event_state *e = s->events;
    const int n = e->n_rows, switches = s->model->hybrid->n_switches;
    const int number = hit >= switches ? (int)e->window[hit - switches] : -1;
    const mech_crowd_at at = now(s, s->run->report.t, s->y);
    int touch[MECH_MOST_ROWS], begins[MECH_MOST_ROWS + 1], count = 0;
    put_back(s);
    set_count(s, 0);
    for (int i = 0; i < n; i++) {
        const int contact = (int)e->window[i] / 2;
        if ((int)e->window[i] % 2) continue;
        begins[count] = takes_part(s, &at, contact, contact == number / 2);
        if (begins[count] >= 0) touch[count++] = contact;
    }
    if (number >= 0) count = mech_neighbours_reached(s, count, touch, begins);
    if (count > 1) mech_neighbours_order(s, count, touch);
    for (int k = 0; k < count; k++) {
        if (number >= 0 && touch[k] == number / 2) hit = switches + e->n_rows + number % 2;
        add(s, touch[k]);
    }
    return hit;
}

int mech_window_begin(mech_solver *s, mech_real length, mech_real speed)
{
    const mech_model *m = s->model;
    const mech_crowd *c = crowd(s);
    mech_event_state *e = s->events;
    const mech_crowd_at at = now(s, s->run->report.t, s->y);
    const size_t nv = (size_t)m->nv;
    memset(e->kept, 0, (size_t)(2 * c->n * MECH_KEPT) * sizeof(mech_real));
    set_count(s, 0);
    for (int i = 0; i < c->n; i++) {
        const mech_crowd_kind *kind = mech_crowd_kind_of(c, i);
        mech_real *kept = e->kept + 2 * i * MECH_KEPT, along[2] = {0, 0};
        mech_crowd_values(&at, i, e->values);
        kept[MECH_KEPT_GAP] = MECH_C(1e-3) * length;
        for (int k = 0; k <= kind->friction && !s->method->impulses; k++) {
            memset(e->given + m->nu, 0, nv * sizeof(mech_real));
            mech_crowd_add(c, i, k, e->values, 1, e->given + m->nu);
            c->push(at.t, at.y, at.g, at.z, at.p, e->response);
            along[k] = mech_crowd_along(c, i, k, e->values, e->response);
            kept[k * MECH_KEPT + MECH_KEPT_GAP] = MECH_C(1e-3) * length;
            kept[k * MECH_KEPT + MECH_KEPT_SPEED] = MECH_C(1e-3) * speed;
            if (along[k] > 0 && length > 0)
                kept[k * MECH_KEPT + MECH_KEPT_FORCE] = MECH_C(1e-4) * speed * speed / (along[k] * length);
        }
        const mech_real gap = e->values[0], noise = MECH_C(1e-9) * kept[MECH_KEPT_GAP];
        const mech_real *limits = e->values + mech_crowd_slip(kind) + 2; /* at rest, while sliding */
        const int bounces = !(e->values[3] >= 0 && e->values[3] <= 1);
        const int grips = kind->friction && !(limits[0] >= 0 && limits[1] >= 0), wrong = bounces || grips;
        e->wake[i] = e->counters[MECH_MOVED] + mech_max(distance(s, i, e->values), 0);
        if (gap < -noise || wrong) {
            set_count(s, 0);
            add(s, i);
            s->run->report.failed_value = bounces ? e->values[3] : !grips ? gap : limits[0] >= 0 ? limits[1] : limits[0];
            return mech_fail(s, wrong ? MECH_OUT_OF_RANGE : MECH_PENETRATION, !bounces && grips);
        }
        mech_widen(kept + MECH_KEPT_GAP, gap);
        if (mech_abs(gap) <= noise && !s->method->impulses && !add(s, i)) return mech_fail(s, MECH_NO_MODE, -1);
    }
    return MECH_RUNNING;
}

int mech_window_number(const mech_solver *s, int i) { return crowd(s) ? (int)s->events->window[i] : i; }

void mech_window_name(mech_solver *s, int status)
{
    const int row = status == MECH_PENETRATION || status == MECH_NO_MODE || status == MECH_NO_IMPACT ||
                    status == MECH_ENERGY_RAISED || status == MECH_OUT_OF_RANGE || status == MECH_APART;
    int *index = &s->run->report.failed_index;
    if (row && *index >= 0 && *index < s->events->n_rows) *index = mech_window_number(s, *index);
}

/* ---------------------------------------------------------------- what rows at hand measure */

void mech_window_read(mech_solver *s, mech_real t, const mech_real *y, int wholly, mech_real *row)
{
    const mech_model *m = s->model;
    const mech_crowd *c = crowd(s);
    mech_event_state *e = s->events;
    const mech_real *v = y + m->nq;
    const int width = c->n_values;
    int contacts[MECH_MOST_ROWS], modes[MECH_MOST_ROWS], n = 0, closed = 0;
    if (wholly) list_closed(s);
    const mech_crowd_at at = now(s, t, y);
    for (int i = 0; i < e->n_rows; i++) {
        if (is_slip(s, i)) continue;
        contacts[n] = contact_of(s, i);
        modes[n] = mode_of(s, i);
        closed |= modes[n] > 0;
        mech_crowd_values(&at, contacts[n], e->values + n * width);
        n++;
    }
    memset(e->forces, 0, MECH_CROWD_FORCES * (size_t)n * sizeof(mech_real));
    if (closed || wholly) {
        c->rhs(t, y, s->u, e->z, s->o.p, e->rates);
        mech_crowd_solve(&at, n, contacts, modes, e->values, width, e->rates + m->nq, e->forces);
    }
    const mech_real *a = e->rates + m->nq;
    for (int k = 0; k < n; k++) {
        const mech_crowd_kind *kind = mech_crowd_kind_of(c, contacts[k]);
        const mech_real *own = e->values + k * width, *slip = own + mech_crowd_slip(kind);
        for (int part = 0; part <= kind->friction; part++, row += MECH_ROW_VALUES) {
            row[MECH_GAP] = part ? 0 : own[0];
            row[MECH_DRIFT] = part ? slip[0] : own[1];
            row[MECH_RATE] = mech_crowd_along(c, contacts[k], part, own, v) + row[MECH_DRIFT];
            row[MECH_SECOND] =
                closed || wholly ? mech_crowd_along(c, contacts[k], part, own, a) + (part ? slip[1] : own[2]) : 0;
            row[MECH_FORCE] = e->forces[MECH_CROWD_FORCES * k + part];
            row[MECH_LIMIT] = part ? slip[2] * e->forces[MECH_CROWD_FORCES * k] : 0;
            row[MECH_COEFFICIENT] = part ? slip[2] : own[3];
            row[MECH_EXTRA] = part ? slip[3] : own[4];
        }
    }
}

void mech_window_indicate(mech_solver *s, mech_real t, const mech_real *y, mech_real *w, mech_real *rate)
{
    mech_event_state *e = s->events;
    const mech_real *row = e->row;
    mech_window_read(s, t, y, 0, e->row);
    for (int i = 0; i < e->n_rows; i++, row += MECH_ROW_VALUES) {
        const int holds = e->z[e->rows[i].flag] > MECH_C(0.5), slip = is_slip(s, i);
        const mech_real sign = slip ? e->z[e->rows[i].sign] : 0;
        if (slip)
            w[i] = holds ? row[MECH_LIMIT] - mech_abs(row[MECH_FORCE]) : sign * row[MECH_RATE];
        else
            w[i] = holds ? row[MECH_FORCE] : row[MECH_GAP];
        if (rate) rate[i] = holds ? 0 : slip ? sign * row[MECH_SECOND] : row[MECH_RATE];
    }
}

void mech_window_place(mech_solver *s, int i, mech_real part, mech_real *y)
{
    const mech_model *m = s->model;
    const mech_crowd *c = crowd(s);
    const int contact = contact_of(s, i), ny = s->ny;
    const mech_crowd_who who = mech_crowd_who_of(c, contact);
    if (m->n_rotations || is_slip(s, i) || s->events->z[s->events->rows[i].flag] > MECH_C(0.5)) {
        mech_dense_at(s->dense, s->n_dense, ny, part, y);
        mech_normalise(m, y);
        return;
    }
    for (int k = 0; k < who.kind->n_leaves; k++) {
        const int leaf = mech_crowd_leaf(&who, k);
        if (leaf >= ny) continue;
        const mech_real *d = s->dense + leaf;
        mech_real sum = d[(s->n_dense - 1) * ny];
        for (int j = s->n_dense - 2; j >= 0; j--) sum = d[j * ny] + (j % 2 ? 1 - part : part) * sum;
        y[leaf] = sum;
    }
}

int mech_window_indicate_one(mech_solver *s, int i, mech_real t, const mech_real *y, mech_real *w, mech_real *rate)
{
    const int contact = contact_of(s, i);
    if (is_slip(s, i) || s->events->z[s->events->rows[i].flag] > MECH_C(0.5)) return 0;
    const mech_crowd_at at = now(s, t, y);
    mech_crowd_values(&at, contact, s->events->values);
    *w = s->events->values[0];
    if (rate)
        *rate = mech_crowd_along(crowd(s), contact, 0, s->events->values, y + s->model->nq) + s->events->values[1];
    return 1;
}

void mech_window_respond(mech_solver *s)
{
    const mech_model *m = s->model;
    const mech_crowd *c = crowd(s);
    mech_event_state *e = s->events;
    const int nv = m->nv, width = nv + e->n_rows;
    const mech_crowd_at at = now(s, s->run->report.t, s->y);
    mech_crowd_force force[MECH_MOST_ROWS];
    mech_crowd_response found;
    int row[MECH_MOST_ROWS], first[MECH_MOST_ROWS], n = 0, own = 0;
    memset(e->response, 0, (size_t)e->n_rows * (size_t)width * sizeof(mech_real));
    for (int i = 0; i < e->n_rows; i++) {
        const mech_real *values = e->values + own * c->n_values;
        const int slip = is_slip(s, i), contact = contact_of(s, i), friction = mech_crowd_kind_of(c, contact)->friction;
        if (!slip) mech_crowd_values(&at, contact, e->values + own * c->n_values);
        e->first[i] = i;
        if (mode_of(s, i - slip) > 0 || values[0] <= MECH_C(2e-9) * e->gap_scale[i - slip]) {
            row[n] = i;
            force[n++] = (mech_crowd_force){contact, slip, 0, values};
        }
        if (slip || !friction) own++;
    }
    if (!n) return;
    if (!mech_crowd_respond(&at, n, force, &found)) {
        for (int i = 0; i < n; i++) e->response[row[i] * width + nv + row[i]] = (mech_real)NAN; /* no memory */
        return;
    }
    mech_crowd_first(c, nv, &found, n, force, first);
    for (int i = 0; i < n; i++) e->first[row[i]] = row[first[i]];
    for (int k = 0; k < found.colours * nv; k++) {
        const int v = k % nv, j = found.owner[k - v + c->group[v]];
        if (j >= 0) e->response[row[j] * width + v] = found.push[k];
    }
    for (int i = 0; i < n; i++) {
        mech_real part;
        for (int place = 0, j; mech_crowd_next(c, nv, &found, &force[i], &place, &j, &part);)
            e->response[row[j] * width + nv + row[i]] += part;
    }
    free(found.push);
}
