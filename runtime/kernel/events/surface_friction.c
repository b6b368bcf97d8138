/* Friction on surfaces: where a slip of two components ends, and in which direction one begins.
 *
 * Near s = 0 the law s/|s| turns as fast as one likes: its direction follows the slip within |s| over an acceleration.
 * Below a size that the tolerance sets, nothing of that can be seen; there the slip counts as none (mech_surface_friction_none),
 * the law keeps the direction of z, of that size, and a slip that begins gets it at once, in the direction in which it
 * goes on: that in which it accelerates.
 */
#include "surface_friction.h"

#include <string.h>

#include "contact_projection.h"
#include "method.h"

enum { TOLERANCES = 3 }; /* of the largest slip: what counts as none */

static mech_real *sign(const mech_solver *s, int i) { return &s->events->z[s->events->rows[i].sign]; }

mech_real mech_surface_friction_none(const mech_solver *s, int i)
{
    /* One size for all that can be compared: a slip that begins moves others by as much. */
    const mech_share_row *shares = s->model->hybrid->shares;
    const mech_real *speed = s->events->speed, share = mech_max(MECH_C(1e-11), TOLERANCES * s->o.rtol);
    mech_real fastest = mech_max(speed[i], speed[mech_row_partner(s, i)]);
    for (int k = 0; shares && k < s->events->n_rows; k++)
        if (shares[k].sort == shares[i].sort && s->events->rows[k].kind == MECH_FRICTION) fastest = mech_max(fastest, speed[k]);
    return share * fastest;
}

int mech_surface_friction_is_slow(const mech_solver *s, int i)
{
    const mech_real share = mech_max(1, s->events->counters[MECH_NEARLY]);
    const mech_real most = mech_row_partner(s, i) < 0 ? 10 * mech_row_still(s, i) : 2 * share * mech_surface_friction_none(s, i);
    return mech_row_size(s, i, MECH_RATE) <= most;
}

static int independent(mech_solver *s, int n, const int *rows)
{
    mech_real nothing[MECH_MOST_ROWS], x[MECH_MOST_ROWS];
    memset(nothing, 0, (size_t)n * sizeof(mech_real));
    return mech_rows_solve(s, n, rows, nothing, x) == n;
}

/* Whether both directions of slip i are independent of these rows: not so along a wall. */
static int is_free(mech_solver *s, int n, const int *rows, int i)
{
    int with[MECH_MOST_ROWS];
    for (int k = 0; k < n; k++) {
        if (rows[k] == i || rows[k] == i + 1) return 0;
        with[k] = rows[k];
    }
    with[n] = i;
    with[n + 1] = i + 1;
    return independent(s, n + 2, with);
}

/* Gives slips on surfaces their size: where `begins`, those that begin, else none to the slow ones. All other rows that
 * hold, and contacts that touch, keep their rates. */
static void set_slips(mech_solver *s, int begins)
{
    mech_real aim[MECH_MOST_ROWS];
    int rows[MECH_MOST_ROWS], n = mech_contact_projection_rows(s, rows), changes = 0;
    for (int i = 0; i < s->events->n_rows; i++) {
        if (s->events->rows[i].kind != MECH_CONTACT || mech_row_holds(s, i) || !mech_row_touches(s, i)) continue;
        rows[n] = i;
        n += independent(s, n + 1, rows); /* else others keep it */
    }
    const int others = n;
    for (int k = 0; k < n; k++) aim[k] = mech_row_value(s, rows[k], MECH_RATE);
    for (int i = 0; i < s->events->n_rows; i++) {
        const int j = mech_row_partner(s, i);
        if (j < 0 || !mech_row_holds(s, s->events->rows[i].normal) || !mech_surface_friction_is_slow(s, i)) continue;
        const mech_real a = begins ? *sign(s, i) : 0, b = begins ? *sign(s, j) : 0;
        if (begins && a == 0 && b == 0) continue;
        const int before = n;
        for (int part = 0; part < 2; part++) {
            int k = 0;
            while (k < before && rows[k] != i + part) k++;
            rows[k < before ? k : n] = i + part;
            aim[k < before ? k : n] = part ? b : a;
            if (k == before) n += independent(s, n + 1, rows); /* else others hold it, or another slip of its body sets it */
        }
        if (begins && n < before + 2 && !is_free(s, others, rows, i)) n = before;
        changes |= mech_row_value(s, i, MECH_RATE) != a || mech_row_value(s, j, MECH_RATE) != b;
    }
    if (!changes) return;
    mech_contact_projection_set_rates(s, n, rows, aim);
    mech_rows_read(s);
}

void mech_surface_friction_end(mech_solver *s)
{
    int any = 0;
    for (int i = 0; i < s->events->n_rows; i++) any |= mech_row_partner(s, i) >= 0;
    if (any) set_slips(s, 0);
}

/* The largest acceleration of slip i by its friction. */
static mech_real reply(const mech_solver *s, int i)
{
    const int nv = s->model->nv, width = nv + s->events->n_rows;
    const mech_real *response = s->events->response + i * width + nv + i;
    return mech_row_value(s, i, MECH_LIMIT) * mech_max(response[0], response[width + 1]);
}

/* A slip that begins turns within its size: the first step sees that, the next ones may be larger. */
static void begin_small(mech_solver *s, int i)
{
    mech_report *r = &s->run->report;
    const mech_real most = reply(s, i);
    if (s->method->adaptive && most > 0) r->dt = mech_min(r->dt, 10 * mech_surface_friction_none(s, i) / most);
}

void mech_surface_friction_begin(mech_solver *s)
{
    int begins = 0;
    s->run->turning = 0;
    for (int i = 0; i < s->events->n_rows; i++) {
        if (mech_row_partner(s, i) < 0 || (*sign(s, i) == 0 && *sign(s, i + 1) == 0)) continue;
        s->run->turning = 1;
        if (!mech_surface_friction_is_slow(s, i)) continue;
        begins = 1;
        begin_small(s, i);
    }
    if (!begins) return;
    mech_rows_read(s);
    mech_rows_find_response(s);
    set_slips(s, 1);
}

int mech_surface_friction_at(const mech_solver *s, int hit)
{
    const int i = hit - s->model->hybrid->n_switches;
    return i >= 0 && mech_row_partner(s, i) >= 0 && (*sign(s, i) != 0 || *sign(s, i + 1) != 0);
}

/* Reads the rows with slide i along (a, b); gives the part of its acceleration across it, and along it. */
static mech_real across(mech_solver *s, int i, mech_real a, mech_real b, mech_real *along)
{
    const mech_real size = mech_sqrt(a * a + b * b), slip = mech_surface_friction_none(s, i);
    mech_real *slides = s->events->slides + i;
    slides[0] = a / size;
    slides[1] = b / size;
    *sign(s, i) = slip * slides[0];
    *sign(s, i + 1) = slip * slides[1];
    mech_rows_read(s);
    const mech_real first = mech_row_value(s, i, MECH_SECOND), second = mech_row_value(s, i + 1, MECH_SECOND);
    *along = slides[0] * first + slides[1] * second;
    return slides[0] * second - slides[1] * first;
}

enum { EIGHTHS = 4, MOST_LOOKS = 40 };

int mech_surface_friction_aim(mech_solver *s, int i)
{
    mech_real x[2] = {s->events->slides[i], s->events->slides[i + 1]}, y[2], along;
    const int pressed = mech_row_holds(s, s->events->rows[i].normal); /* slides that were tried are kept where their contact is let go */
    if (!pressed || (x[0] == 0 && x[1] == 0)) return 0;
    const mech_real near = MECH_C(1e-7) * reply(s, i); /* friction that only just gives way accelerates nothing */
    mech_real g = across(s, i, x[0], x[1], &along), h = g;
    if (mech_abs(g) <= mech_max(near, MECH_C(1e-6) * mech_abs(along))) return 0;
    /* The slip turns towards its acceleration. Where that changes from one side of it to the other, it stays. */
    const mech_real turn = g > 0 ? 1 : -1;
    y[0] = x[0];
    y[1] = x[1];
    for (int k = 0; k < EIGHTHS && h * turn > 0; k++) {
        x[0] = y[0];
        x[1] = y[1];
        g = h;
        h = across(s, i, x[0] - turn * x[1], x[1] + turn * x[0], &along);
        y[0] = s->events->slides[i];
        y[1] = s->events->slides[i + 1];
    }
    for (int k = 0; k < MOST_LOOKS && h * turn <= 0 && mech_abs(h) > near; k++) {
        const mech_real share = k % 3 == 2 ? MECH_C(0.5) : g / (g - h);
        const mech_real found = across(s, i, x[0] + share * (y[0] - x[0]), x[1] + share * (y[1] - x[1]), &along);
        mech_real *end = found * turn > 0 ? x : y;
        end[0] = s->events->slides[i];
        end[1] = s->events->slides[i + 1];
        *(end == x ? &g : &h) = found;
        if (mech_abs(found) <= near) break;
    }
    return 1;
}
