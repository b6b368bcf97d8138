/* The time stepping of Moreau and Jean with the midpoint: contacts that are closed in the middle of a step get impulses that fulfil
 * Signorini's and Coulomb's laws at its end. Impacts neither end nor reject steps, and simultaneous ones are one problem (cones.h).
 *
 * q_m = q + h/2 v; v' = v + h a(q_m, v + h/2 a) without contacts; impulses r along the rows at q_m, so that v+ = v' + W r; q' = q_m + h/2 v+.
 * Where forces are others at the mean of v and v+, as of dampers that contacts hold, v' = v + h a(q_m, (v + v+)/2), again.
 * A contact with restitution e rebounds once its gap is closed, u+ >= -e u-, if it approaches faster than the speed of rest and than the
 * forces of one step would drive it. Others may reach the surface at the end of the step: u+ >= -2 g/h. The work of the impulses
 * is that at the mean of both velocities; where the mass is constant this is the energy that is lost, to rounding.
 *
 * Where forces are stiff, they are those at the mean of both ends, linearised (the implicit midpoint rule): with B the
 * derivative of a(q + h/2 v, v) by v, v' = v + h S a(q_m, v) and W takes S M^-1 in the place of M^-1, S = (1 - h/2 B)^-1.
 *
 * J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988; M. Jean, The non-smooth contact dynamics
 * method, 1999.
 */
#include <string.h>

#include "cones.h"
#include "linear.h"
#include "method.h"
#include "moreau_crowd.h"

enum { RHS = 5, MOST_SWEEPS = 24, MOST_LOOKS = 4, MOST_STIFF = 256, FIRST_LOOKS = 8, MOST_PASSES = 12 };

/* A residual that counts as none, in the largest rate so far; what an approach has to exceed, beside what the step adds to it. */
static const mech_real NONE = MECH_C(1e-10), DRIVEN = 2;

/* What forces may miss, in the largest rate so far: each pass leaves a quarter of it at most. */
static const mech_real MISSED = MECH_C(1e-9);

/* The largest h/2 |B| that is not stiff: explicit steps are stable up to 1. */
static const mech_real STIFF = MECH_C(0.25);

/* The displacement by which derivatives of forces are found, in the size of a coordinate, whose rounding is 1e-8 of that. */
static const mech_real SEEN = MECH_C(1e-8);

static int lacks(const mech_model *model)
{
    const mech_hybrid *h = model->hybrid;
    return h && (h->crowd ? h->crowd->n_told : h->n_rows) ? MECH_RUNNING : MECH_NEEDS_ROWS;
}

/* The memory of a step. */
typedef struct room {
    mech_real *z, *y, *values, *before, *after, *response, *w, *q, *r, *u, *impulse, *rates, *fastest, *solver, *steepest, *outputs, *modes, *middle;
    mech_cone *cones;
    int *row, *contact;
    mech_moreau_crowd crowd; /* where contacts are one */
    mech_moreau_stiff stiff;
} room;

static size_t arrange(const mech_model *m, mech_real *memory, room *o)
{
    const size_t n = m->hybrid ? (size_t)m->hybrid->n_rows : 0, nv = (size_t)m->nv;
    const size_t ny = (size_t)(m->nq + m->nv + m->nx), nz = (size_t)m->nz, few = nv <= MOST_STIFF;
    const size_t sizes[] = {n, n, 1, nz, ny, n * MECH_ROW_VALUES, n * MECH_ROW_VALUES, n * MECH_ROW_VALUES, n * (nv + n),
                            n * n, n, n, n, mech_cones_room((int)n), mech_room_for(n * sizeof(mech_cone)), 2 * mech_integers((int)n),
                            nv, few * nv * nv, few * 2 * mech_integers((int)nv), m->hybrid && m->hybrid->carried ? (size_t)m->n_outputs : 0,
                            nz, n};
    const int crowd = m->hybrid && m->hybrid->crowd;
    mech_real *places[sizeof sizes / sizeof sizes[0]];
    size_t total = 0;
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++) {
        places[k] = memory ? memory + total : NULL;
        total += sizes[k];
    }
    if (o)
        *o = (room){.impulse = places[0], .rates = places[1], .fastest = places[2], .z = places[3], .y = places[4], .values = places[5],
                    .before = places[6], .after = places[7], .response = places[8], .w = places[9], .q = places[10], .r = places[11],
                    .u = places[12], .solver = places[13], .cones = (mech_cone *)places[14], .row = (int *)places[15],
                    .contact = (int *)(places[15] + mech_integers((int)n)), .steepest = places[16],
                    .stiff = {0, (int)nv, places[17], (int *)places[18], (int *)(places[18] + mech_integers((int)nv))},
                    .outputs = places[19], .modes = places[20], .middle = places[21]};
    if (o && crowd) mech_moreau_crowd_attach(&o->crowd, m, memory + total);
    return total + (crowd ? mech_moreau_crowd_numbers(m) : 0);
}

static size_t n_extra(const mech_model *model) { return arrange(model, NULL, NULL); }

static const mech_real *impulses(const mech_solver *s, const mech_real **rates)
{
    *rates = mech_extra(s) + s->model->hybrid->n_rows;
    return mech_extra(s);
}

static void tell(const mech_solver *s, mech_real *z)
{
    room o;
    arrange(s->model, mech_extra(s), &o);
    mech_moreau_crowd_tell(&o.crowd, s->model, z);
}

static void begin(mech_solver *s, int fresh)
{
    room o;
    arrange(s->model, mech_extra(s), &o);
    if (s->model->hybrid->crowd) mech_moreau_crowd_begin(&o.crowd, s->model, fresh);
    if (!fresh) return;
    memset(o.impulse, 0, (size_t)s->model->hybrid->n_rows * sizeof(mech_real));
    *o.fastest = 0;
    memset(o.steepest, 0, (size_t)s->model->nv * sizeof(mech_real));
}

static mech_real value(const mech_real *values, int i, int which) { return values[i * MECH_ROW_VALUES + which]; }

static mech_real length(const mech_real *values, int i, int count, int which)
{
    const mech_real a = value(values, i, which), b = count > 1 ? value(values, i + 1, which) : 0;
    return count > 1 ? mech_sqrt(a * a + b * b) : mech_abs(a);
}

static int is_on(const mech_solver *s, int place) { return place < 0 || s->o.z[place] > MECH_C(0.5); }

/* The first friction of a contact, or -1, and how many rows it has. */
static int friction_of(const mech_hybrid *h, int contact, int *count)
{
    for (int i = 0; i < h->n_rows; i++)
        if (h->rows[i].kind == MECH_FRICTION && h->rows[i].normal == contact) {
            *count = i + 1 < h->n_rows && h->rows[i + 1].kind == MECH_FRICTION && h->rows[i + 1].normal == contact ? 2 : 1;
            return i;
        }
    return -1;
}

static void read_rows(mech_solver *s, mech_real t, const room *o, mech_real *values)
{
    s->model->hybrid->row_values(t, o->y, s->u, o->z, s->o.p, values);
}

/* The limits of friction: they may come from the forces that hold now. What has its own sticks or slides as it does when the step begins,
 * at the velocities in o->y. */
static void read_limits(mech_solver *s, mech_real t, const room *o)
{
    const mech_hybrid *hybrid = s->model->hybrid;
    memcpy(o->modes, s->o.z, (size_t)s->model->nz * sizeof(mech_real));
    for (int i = 0; i < hybrid->n_rows; i++) {
        const mech_row *row = &hybrid->rows[i];
        if (row->kind != MECH_FRICTION || row->normal >= 0) continue;
        const mech_real rate = value(o->before, i, MECH_RATE);
        const int slips = mech_abs(rate) > MECH_C(1e-9) * *o->fastest;
        o->modes[row->flag] = !slips;
        o->modes[row->sign] = slips ? (rate > 0 ? 1 : -1) : 0;
    }
    hybrid->row_values(t, o->y, s->u, o->modes, s->o.p, o->values);
}

/* The problem's rows and cones: all that is held and rubs, and contacts in `takes`. */
static int find_cones(mech_solver *s, const room *o, const int *takes, mech_real h, mech_cones *c)
{
    const mech_hybrid *hybrid = s->model->hybrid;
    mech_real *q = o->q;
    c->n = c->n_cones = 0;
    for (int i = 0; i < hybrid->n_rows; i++) {
        const mech_row *row = &hybrid->rows[i];
        const int at = c->n;
        mech_cone cone = {MECH_CONE_HELD, at, 0, 0, 0};
        o->middle[at] = 0;
        if (row->kind == MECH_BILATERAL && is_on(s, row->flag)) {
            o->row[c->n++] = i;
            q[at] = value(o->after, i, MECH_RATE);
        } else if (row->kind == MECH_FRICTION && row->normal < 0 && is_on(s, row->enabled)) {
            cone.kind = MECH_CONE_DISC;
            cone.slips = 1;
            const mech_real forwards = mech_max(0, value(o->values, i, MECH_COEFFICIENT));
            const mech_real backwards = mech_max(0, value(o->values, i, MECH_EXTRA));
            cone.coefficient = h * (forwards + backwards) / 2;
            o->middle[at] = h * (backwards - forwards) / 2;
            o->row[c->n++] = i;
            q[at] = value(o->after, i, MECH_RATE);
        } else if (row->kind == MECH_CONTACT && takes[i]) {
            const mech_real gap = value(o->before, i, MECH_GAP), u = value(o->before, i, MECH_RATE), next = value(o->after, i, MECH_RATE);
            const mech_real e = value(o->before, i, MECH_COEFFICIENT), rest = mech_max(0, value(o->before, i, MECH_EXTRA));
            int count = 0;
            const int f = friction_of(hybrid, i, &count);
            cone.kind = MECH_CONE;
            o->row[c->n++] = i;
            const int strikes = e > 0 && u < -mech_max(rest, DRIVEN * mech_abs(next - u));
            if (strikes && gap > 0) {
                c->n = at;
                continue;
            }
            q[at] = next + (strikes ? e * u : 2 * mech_max(0, gap) / h);
            if (f >= 0) {
                const int slips = length(o->before, f, count, MECH_RATE) > MECH_C(1e-9) * *o->fastest;
                cone.coefficient = mech_max(0, value(o->before, f, slips ? MECH_EXTRA : MECH_COEFFICIENT));
                cone.slips = cone.coefficient > 0 ? count : 0;
                for (int k = 0; k < cone.slips; k++) {
                    o->middle[c->n] = 0;
                    o->row[c->n] = f + k;
                    q[c->n++] = value(o->after, f + k, MECH_RATE);
                }
            }
        } else {
            continue;
        }
        o->cones[c->n_cones++] = cone;
    }
    for (int k = 0; k < c->n_cones; k++) o->cones[k].slack = NONE * *o->fastest;
    return c->n;
}

/* What unit impulses along the rows of the problem do; those in the middle of limits act as if they were applied. */
static void respond(mech_solver *s, mech_real t, const room *o, const mech_real *free_, const mech_cones *c)
{
    const mech_model *m = s->model;
    const int width = m->nv + m->hybrid->n_rows;
    for (int k = 0; k < c->n; k++) {
        const int place = m->hybrid->rows[o->row[k]].impulse;
        mech_real *jump = o->response + (size_t)k * width;
        o->z[place] = 1;
        m->hybrid->respond(t, o->y, s->u, o->z, s->o.p, jump);
        o->z[place] = 0;
        if (!o->stiff.is) continue;
        mech_moreau_soften(&o->stiff, jump);
        for (int i = 0; i < m->nv; i++) o->y[m->nq + i] = free_[i] + jump[i];
        read_rows(s, t, o, o->values);
        for (int i = 0; i < m->hybrid->n_rows; i++) jump[m->nv + i] = value(o->values, i, MECH_RATE) - value(o->after, i, MECH_RATE);
    }
    for (int i = 0; i < c->n; i++)
        for (int k = 0; k < c->n; k++) {
            o->w[(size_t)i * c->n + k] = o->response[(size_t)k * width + m->nv + o->row[i]];
            o->q[i] += o->w[(size_t)i * c->n + k] * o->middle[k];
        }
}

/* v+ from v' in `free`, and all row rates there. */
static void move(mech_solver *s, mech_real t, const room *o, const mech_cones *c, const mech_real *free_, mech_real *v)
{
    const mech_model *m = s->model;
    const int width = m->nv + m->hybrid->n_rows;
    for (int i = 0; i < m->nv; i++) {
        v[i] = free_[i];
        for (int k = 0; k < c->n; k++) v[i] += c->r[k] * o->response[(size_t)k * width + i];
    }
    memcpy(o->y + m->nq, v, (size_t)m->nv * sizeof(mech_real));
    read_rows(s, t, o, o->values);
}

/* The same for a crowd. */
static void solve_crowd(mech_solver *s, const room *o, mech_real h, const mech_real *v0, const mech_real *free_, mech_real *v,
                        mech_real *lost, mech_real *supplied)
{
    mech_report *report = &s->run->report;
    mech_moreau_found found;
    if (!mech_moreau_crowd_solve(s, &o->crowd, &o->stiff, h, o->y, v0, free_, v, o->fastest, &found)) {
        *o->fastest = (mech_real)NAN; /* without memory: as an undefined value */
        return;
    }
    report->residual = mech_max(report->residual, found.residual);
    report->overlap = mech_max(report->overlap, found.overlap);
    report->iterations += found.sweeps;
    if (!found.solved) report->unsolved++;
    *lost = found.lost;
    *supplied = found.supplied;
}

/* The contacts and frictions of a step of h whose middle is o->y: v from v0 and, without them, free_. `supplied` by what moves. */
static void solve_rows(mech_solver *s, const room *o, mech_real h, const mech_real *v0, const mech_real *free_, mech_real *v, mech_real *lost,
                       mech_real *supplied)
{
    const mech_model *m = s->model;
    const mech_hybrid *hybrid = m->hybrid;
    const int nq = m->nq, nv = m->nv, rows = hybrid->n_rows;
    const mech_real middle = s->run->report.t + h / 2;
    mech_report *report = &s->run->report;
    int *takes = o->contact;
    memcpy(o->y + nq, v0, (size_t)nv * sizeof(mech_real));
    read_rows(s, middle, o, o->before);
    memcpy(o->y + nq, free_, (size_t)nv * sizeof(mech_real));
    read_rows(s, middle, o, o->after);
    for (int i = 0; i < rows; i++)
        *o->fastest = mech_max(*o->fastest, mech_max(mech_abs(value(o->before, i, MECH_RATE)), mech_abs(value(o->after, i, MECH_RATE))));
    if (!mech_finite(*o->fastest)) return;
    for (int i = 0; i < rows; i++) /* those that might touch at the end of the step */
        takes[i] = hybrid->rows[i].kind == MECH_CONTACT && is_on(s, hybrid->rows[i].enabled) &&
                   value(o->before, i, MECH_GAP) + h / 2 * mech_min(0, value(o->after, i, MECH_RATE)) <= 0;
    mech_cones c = {.cones = o->cones, .w = o->w, .q = o->q, .r = o->r, .u = o->u};
    int solved = 1;
    for (int look = 0;; look++) {
        memcpy(o->y + nq, v0, (size_t)nv * sizeof(mech_real));
        read_limits(s, middle, o);
        find_cones(s, o, takes, h, &c);
        respond(s, middle, o, free_, &c);
        for (int k = 0; k < c.n; k++) c.r[k] = o->impulse[o->row[k]] - o->middle[k];
        solved = mech_cones_sweep(&c, MOST_SWEEPS, o->solver) || mech_cones_refine(&c, o->solver) || mech_cones_solve(&c, o->solver);
        for (int k = 0; k < c.n; k++) c.r[k] += o->middle[k];
        move(s, middle, o, &c, free_, v);
        int more = 0; /* what the impulses drive onto others */
        for (int i = 0; i < rows; i++) {
            if (hybrid->rows[i].kind != MECH_CONTACT || takes[i] || !is_on(s, hybrid->rows[i].enabled)) continue;
            takes[i] = value(o->before, i, MECH_GAP) + h / 2 * value(o->values, i, MECH_RATE) < 0;
            more |= takes[i];
        }
        if (!more || look == MOST_LOOKS) break;
    }
    report->residual = mech_max(report->residual, c.residual);
    if (!solved) report->unsolved++;
    for (int i = 0; i < rows; i++) {
        o->impulse[i] = 0;
        o->rates[i] = value(o->values, i, MECH_RATE);
        const int open = hybrid->rows[i].kind != MECH_CONTACT || !is_on(s, hybrid->rows[i].enabled);
        if (!open && value(o->before, i, MECH_GAP) < -report->overlap) report->overlap = -value(o->before, i, MECH_GAP);
    }
    for (int k = 0; k < c.n; k++) {
        const int i = o->row[k];
        o->impulse[i] = c.r[k];
        *lost -= c.r[k] * (value(o->before, i, MECH_RATE) + o->rates[i]) / 2;
        *supplied -= c.r[k] * value(o->before, i, MECH_DRIFT);
    }
}

/* The jumps of the velocities that the impulses of the step make by themselves; the middle is o->y. */
static void jump(mech_solver *s, const room *o, mech_real t, mech_real h, mech_real *out)
{
    const mech_model *m = s->model;
    const mech_hybrid *hybrid = m->hybrid;
    if (hybrid->crowd) {
        if (!mech_moreau_crowd_push(s, &o->crowd, t, h, o->y, out)) *o->fastest = (mech_real)NAN; /* without memory */
        return;
    }
    for (int i = 0; i < hybrid->n_rows; i++)
        if (hybrid->rows[i].impulse >= 0) o->z[hybrid->rows[i].impulse] = o->impulse[i];
    hybrid->respond(t, o->y, s->u, o->z, s->o.p, o->response);
    for (int i = 0; i < hybrid->n_rows; i++)
        if (hybrid->rows[i].impulse >= 0) o->z[hybrid->rows[i].impulse] = 0;
    memcpy(out, o->response, (size_t)m->nv * sizeof(mech_real));
}

/* What constraints and drives that move bring in while impulses make these `jumps`: the change of the energy that
 * these alone make, about the mean of v0 and v, and what they take out of it. o->y: the middle. */
static mech_real carried(mech_solver *s, const room *o, mech_real t, const mech_real *v0, const mech_real *v, const mech_real *jumps, mech_real lost)
{
    const mech_model *m = s->model;
    mech_real sides[2];
    for (int side = 0; side < 2; side++) {
        const mech_real share = side ? MECH_C(-0.5) : MECH_C(0.5);
        for (int i = 0; i < m->nv; i++) o->y[m->nq + i] = (v0[i] + v[i]) / 2 + share * jumps[i];
        m->outputs(t, o->y, s->u, s->o.z, s->o.p, o->outputs);
        sides[side] = o->outputs[m->hybrid->total];
    }
    return sides[0] - sides[1] + lost;
}

/* B x for |x| = size, from a(q_m, v0) in f1. o->y: the middle, and v0; work: two derivatives. What x displaces within h/2 is made
 * larger where rounding of a coordinate would be seen in it: forces may be differences of coordinates. */
static void steepen(mech_solver *s, const room *o, mech_real h, const mech_real *f1, const mech_real *x, mech_real *work, mech_real *out)
{
    const mech_model *m = s->model;
    const int nq = m->nq, nv = m->nv;
    const mech_real middle = s->run->report.t + h / 2, *v0 = s->y + nq;
    mech_real *q = work + s->ny, longer = (mech_real)INFINITY;
    for (int i = 0; i < nv; i++) o->y[nq + i] = v0[i] + x[i];
    mech_rhs(s, middle, o->y, work);
    memcpy(o->y + nq, v0, (size_t)nv * sizeof(mech_real));
    memcpy(q, o->y, (size_t)nq * sizeof(mech_real));
    for (int i = 0; i < nv; i++) out[i] = work[nq + i] - f1[nq + i];
    for (int i = 0; i < nq; i++) {
        const mech_real moved = mech_abs(h / 2 * (work[i] - f1[i])), seen = SEEN * mech_max(mech_abs(q[i]), mech_nominal(s, i));
        if (moved > 0) longer = mech_min(longer, seen / moved);
    }
    longer = mech_finite(longer) ? mech_max(1, longer) : 1;
    for (int i = 0; i < nq; i++) o->y[i] += longer * h / 2 * (work[i] - f1[i]);
    mech_rhs(s, middle, o->y, work);
    memcpy(o->y, q, (size_t)nq * sizeof(mech_real));
    for (int i = 0; i < nv; i++) out[i] += (work[nq + i] - f1[nq + i]) / longer;
}

static mech_real largest(int n, const mech_real *x)
{
    mech_real most = 0;
    for (int i = 0; i < n; i++) most = mech_max(most, mech_abs(x[i]));
    return most;
}

/* Whether forces are stiff, by powers of B from step to step; S then. */
static int find_stiff(mech_solver *s, room *o, mech_real h, const mech_real *f1, mech_real *work)
{
    const mech_model *m = s->model;
    const int nq = m->nq, nv = m->nv, fresh = largest(nv, o->steepest) == 0;
    mech_real *x = work + 2 * s->ny, *column = x + nv, size = MECH_C(1e-7) * mech_max(largest(nv, s->y + nq), h * largest(nv, f1 + nq)), rate = 0;
    if (nv > MOST_STIFF) return 0;
    if (!(size > 0)) size = MECH_C(1e-7);
    for (int i = 0; fresh && i < nv; i++) { /* no motion that springs do not feel, as one of all alike */
        const mech_real part = MECH_C(0.6180339887) * (i + 1);
        o->steepest[i] = part - mech_floor(part) - MECH_C(0.45);
    }
    for (int look = 0; look < (fresh ? FIRST_LOOKS : 1); look++) {
        for (int i = 0; i < nv; i++) x[i] = size * o->steepest[i];
        steepen(s, o, h, f1, x, work, column);
        const mech_real most = largest(nv, column);
        if (!mech_finite(most) || most == 0) return 0;
        rate = most / size;
        for (int i = 0; i < nv; i++) o->steepest[i] = column[i] / most + (column[i] == 0 ? MECH_C(1e-3) : 0);
    }
    if (!(h / 2 * rate > STIFF)) return 0;
    for (int i = 0; i < nv; i++) o->stiff.group[i] = i;
    for (int j = 0; j < nv; j++) {
        memset(x, 0, (size_t)nv * sizeof(mech_real));
        x[j] = size;
        steepen(s, o, h, f1, x, work, column);
        for (int i = 0; i < nv; i++) {
            o->stiff.lu[i * nv + j] = (i == j) - h / 2 * column[i] / size;
            if (column[i] != 0) mech_moreau_join(&o->stiff, i, j);
        }
    }
    return !mech_factorise(nv, o->stiff.lu, o->stiff.pivot);
}

static mech_real attempt(mech_solver *s, mech_real h)
{
    const mech_model *m = s->model;
    const mech_hybrid *hybrid = m->hybrid;
    const int nq = m->nq, nv = m->nv, ny = s->ny;
    const mech_real t = s->run->report.t, middle = t + h / 2, *v0 = s->y + nq, *z = s->o.z;
    mech_real *f1 = s->work, *f2 = f1 + ny, *f3 = f2 + ny, *v = s->y_new + nq, check = 0, lost = 0, supplied = 0;
    room o;
    arrange(m, mech_extra(s), &o);
    memcpy(o.z, s->o.z, (size_t)m->nz * sizeof(mech_real));
    for (int i = 0; i < hybrid->n_rows; i++) {
        if (hybrid->rows[i].kind == MECH_STEP_ROW) continue;
        if (hybrid->rows[i].flag >= 0) o.z[hybrid->rows[i].flag] = 0;
        if (hybrid->rows[i].sign >= 0) o.z[hybrid->rows[i].sign] = 0;
    }
    if (hybrid->n_told) { /* before the place that tells so is set */
        mech_surroundings(s, t);
        hybrid->told(t, s->y, s->u, z, s->o.p, o.z + hybrid->first_told + 1);
        o.z[hybrid->first_told] = 1;
    }
    /* the middle, and the velocities there without contacts */
    for (int i = 0; i < ny; i++) o.y[i] = s->y[i] + (i < nq || i >= nq + nv ? h / 2 * s->dy[i] : 0);
    mech_normalise(m, o.y);
    s->o.z = o.z;
    mech_rhs(s, middle, o.y, f1);
    mech_real *free_ = s->dy_new; /* room */
    o.stiff.is = find_stiff(s, &o, h, f1, f2);
    if (o.stiff.is) {
        for (int i = 0; i < nv; i++) free_[i] = h * f1[nq + i];
        mech_moreau_soften(&o.stiff, free_);
        for (int i = 0; i < nv; i++) free_[i] += v0[i];
    } else {
        for (int i = 0; i < nv; i++) o.y[nq + i] = v0[i] + h / 2 * f1[nq + i];
        mech_rhs(s, middle, o.y, f2);
        for (int i = 0; i < nv; i++) free_[i] = v0[i] + h * f2[nq + i];
    }
    const long long unsolved = s->run->report.unsolved;
    for (int pass = 0;; pass++) {
        s->o.z = z;
        s->run->report.unsolved = unsolved;
        lost = supplied = 0;
        if (hybrid->crowd)
            solve_crowd(s, &o, h, v0, free_, v, &lost, &supplied);
        else
            solve_rows(s, &o, h, v0, free_, v, &lost, &supplied);
        if (!mech_finite(*o.fastest)) return *o.fastest;
        if (hybrid->carried && hybrid->supplied >= 0 && hybrid->total >= 0) {
            mech_real *jumps = f2;
            for (int i = 0; i < nv; i++) jumps[i] = v[i] - free_[i];
            if (o.stiff.is) jump(s, &o, middle, h, jumps);
            supplied = carried(s, &o, middle, v0, v, jumps, lost);
        }
        for (int i = 0; i < nv; i++) o.y[nq + i] = (v0[i] + v[i]) / 2;
        s->o.z = o.z;
        mech_rhs(s, middle, o.y, f3);
        if (o.stiff.is || pass == MOST_PASSES) break;
        mech_real missed = 0;
        for (int i = 0; i < nv; i++) {
            const mech_real next = v0[i] + h * f3[nq + i];
            missed = mech_max(missed, mech_abs(next - free_[i]));
            free_[i] = next;
        }
        if (!(missed > MISSED * *o.fastest)) break;
    }
    s->o.z = z;
    /* q' is an affine function of v: that of v+ from those of v and of the mean */
    for (int i = 0; i < nq; i++) s->y_new[i] = o.y[i] + h / 2 * (2 * f3[i] - f1[i]);
    if (o.stiff.is) { /* what forces do is that at the mean of both ends, too */
        for (int i = 0; i < nq; i++) o.y[i] = (s->y[i] + s->y_new[i]) / 2;
        mech_normalise(m, o.y);
        s->o.z = o.z;
        mech_rhs(s, middle, o.y, f3);
        s->o.z = z;
    }
    for (int i = nq + nv; i < ny; i++) s->y_new[i] = s->y[i] + h * f3[i];
    if (hybrid->dissipated >= 0) s->y_new[hybrid->dissipated] += lost;
    if (hybrid->supplied >= 0) s->y_new[hybrid->supplied] += supplied;
    for (int i = 0; i < ny; i++) check += s->y_new[i];
    return mech_finite(check) ? 0 : check;
}

static void dense(mech_solver *s, mech_real h)
{
    (void)h;
    const int n = s->ny;
    memset(s->dense, 0, (size_t)n * (size_t)s->n_dense * sizeof(mech_real));
    for (int i = 0; i < n; i++) {
        s->dense[i] = s->y[i];
        s->dense[n + i] = s->y_new[i] - s->y[i];
    }
}

const mech_method mech_moreau = {
    .name = "moreau",
    .doc = "steps of Moreau and Jean, fixed step: contacts and friction as one problem in each step, without events",
    .order = 1,
    .n_stages = 2,
    .n_work = RHS,
    .n_dense = 4,
    .lacks = lacks,
    .n_extra = n_extra,
    .begin = begin,
    .impulses = impulses,
    .tell = tell,
    .attempt = attempt,
    .dense = dense,
};
