/* Which contacts press and which frictions stick, as one contact problem of accelerations and forces. */
#include "contact_cones.h"

#include <stdlib.h>
#include <string.h>

#include "cones.h"
#include "surface_friction.h"

/* Shares of the largest acceleration without forces: what is left of a solution, and what counts as none of it; but of a motion that only
 * just begins, the share of the largest acceleration; the share of an approach that impacts may leave. */
static const mech_real LEFT = MECH_C(1e-11), NONE = MECH_C(1e-8), SLOWER = MECH_C(1e-3), APPROACH_LEFT = MECH_C(1e-3);

typedef struct problem {
    mech_cones c;
    int *row;       /* [n] the row of events of each row of the problem                          */
    mech_cone *cones;
    int *contact;   /* [n_cones] the contact, or -1                                              */
    mech_real scale; /* the largest acceleration without forces                                  */
    mech_real *memory, *room;
} problem;

static void end_problem(problem *p) { free(p->memory); }

/* Modes of rows while they are set aside. */
typedef struct aside {
    int goes_on; /* what slides in them slides on, however slowly: no event has come             */
    mech_real flag[MECH_MOST_ROWS], sign[MECH_MOST_ROWS];
} aside;

static int is_chosen(const mech_row *row) { return row->kind == MECH_CONTACT || row->kind == MECH_FRICTION || row->kind == MECH_BILATERAL; }

/* Reads the rows without any of their forces, but those of frictions of joints that slide; those that rest, or are about to slide,
 * are rows of the problem. The rates were read last. */
static void read_free(mech_solver *s, aside *a)
{
    mech_event_state *e = s->events;
    for (int i = 0; i < e->n_rows; i++) {
        const mech_row *row = &e->rows[i];
        if (!is_chosen(row)) continue;
        a->flag[i] = e->z[row->flag];
        a->sign[i] = row->sign < 0 ? 0 : e->z[row->sign];
        e->z[row->flag] = 0;
        if (row->kind == MECH_FRICTION && row->normal < 0 && !a->goes_on && mech_surface_friction_is_slow(s, i)) e->z[row->sign] = 0;
    }
    mech_rows_read(s);
}

static void come_back(mech_solver *s, const aside *a)
{
    mech_event_state *e = s->events;
    for (int i = 0; i < e->n_rows; i++) {
        const mech_row *row = &e->rows[i];
        if (!is_chosen(row)) continue;
        e->z[row->flag] = a->flag[i];
        if (row->sign >= 0) e->z[row->sign] = a->sign[i];
    }
    mech_rows_read(s);
}

static int is_partner(const mech_solver *s, int i) { return i > 0 && mech_row_partner(s, i - 1) == i; }

/* The first friction of a contact, or -1. */
static int friction_of(const mech_solver *s, int contact)
{
    for (int i = 0; i < s->events->n_rows; i++)
        if (mech_row_of(s, i)->kind == MECH_FRICTION && mech_row_of(s, i)->normal == contact) return i;
    return -1;
}

/* Whether friction i slides in the modes that were set aside, on a surface in whichever direction. */
static int slides(const mech_solver *s, const aside *a, int i)
{
    const int j = mech_row_partner(s, i);
    return a->sign[i] != 0 || (j >= 0 && a->sign[j] != 0);
}

/* Whether nothing slips along friction i. What rests in the modes that were set aside does: between events a slip is rounding, of
 * which single rows may not know the size. */
static int is_slow(const mech_solver *s, const aside *a, int i)
{
    const int j = mech_row_partner(s, i);
    if (a && a->goes_on && slides(s, a, i)) return 0;
    if (a && (a->flag[i] > MECH_C(0.5) || (j >= 0 && a->flag[j] > MECH_C(0.5)))) return 1;
    if (a && mech_row_of(s, i)->normal < 0 && a->sign[i] == 0) return 1;
    return mech_surface_friction_is_slow(s, i);
}

static void add(problem *p, int kind, int contact, int slips, mech_real coefficient)
{
    p->cones[p->c.n_cones] = (mech_cone){kind, p->c.n, slips, coefficient, 0};
    p->contact[p->c.n_cones++] = contact;
}

static int is_among(int i, int n, const int *among)
{
    int found = !among;
    for (int k = 0; k < n; k++) found |= among[k] == i;
    return found;
}

/* Rates are known to rounding of the fastest so far. */
static mech_real rounding(const mech_solver *s, const problem *p, int k)
{
    mech_real most = 0;
    for (int i = 0; i < p->cones[k].slips + 1; i++) most = mech_max(most, MECH_EPSILON * s->events->speed[p->row[p->cones[k].at + i]]);
    return most;
}

/* The problem of accelerations of what touches and rests, or, without `a`, of rates of what touches, of the n contacts `among` that
 * where not NULL; 0 where memory is lacking. `a`: modes, which are set aside. */
static int begin_problem(mech_solver *s, problem *p, aside *a, int n_among, const int *among)
{
    mech_event_state *e = s->events;
    const int most = e->n_rows;
    const size_t numbers = (size_t)most * (size_t)(most + 3) + mech_cones_room(most) + (size_t)most * (sizeof(mech_cone) / sizeof(mech_real) + 2);
    memset(p, 0, sizeof *p);
    p->memory = calloc(numbers, sizeof(mech_real));
    if (!p->memory) return 0;
    mech_real *w = p->memory, *q = w + (size_t)most * (size_t)most, *rest = q + 3 * most;
    p->room = rest + (size_t)most * (sizeof(mech_cone) / sizeof(mech_real) + 2);
    p->cones = (mech_cone *)rest;
    p->row = (int *)(p->cones + most);
    p->contact = p->row + most;
    p->c.w = w;
    p->c.q = q;
    p->c.r = q + most;
    p->c.u = q + 2 * most;
    p->c.cones = p->cones;
    if (a) read_free(s, a);
    mech_real slide[MECH_MOST_ROWS][2];
    for (int i = 0; i < most; i++) {
        const mech_row *row = mech_row_of(s, i);
        slide[i][0] = slide[i][1] = 0;
        if (row->kind == MECH_BILATERAL && (a ? a->flag[i] > MECH_C(0.5) : mech_row_holds(s, i)) && mech_row_moves_itself(s, i)) {
            add(p, MECH_CONE_HELD, -1, 0, 0);
            p->row[p->c.n++] = i;
        } else if (row->kind == MECH_CONTACT && (a ? a->flag[i] > MECH_C(0.5) || mech_row_may_rest(s, i) : mech_row_touches(s, i)) && mech_row_moves_itself(s, i) &&
                   is_among(i, n_among, among)) {
            const int f = friction_of(s, i);
            int slips = 0;
            mech_real coefficient = 0;
            const int sticks = f >= 0 && is_slow(s, a, f), slow = sticks || !a;
            if (f >= 0 && mech_row_value(s, f, sticks ? MECH_COEFFICIENT : MECH_EXTRA) > 0) {
                coefficient = mech_row_value(s, f, sticks ? MECH_COEFFICIENT : MECH_EXTRA);
                const int count = mech_row_partner(s, f) < 0 ? 1 : 2;
                const mech_real size = mech_row_size(s, f, MECH_RATE);
                const mech_real way = size > 0 || !a ? 0 : a->sign[f] > 0 ? 1 : -1;
                for (int k = 0; k < count; k++) {
                    if (slow && mech_row_moves_itself(s, f + k)) slips++;
                    if (!slow) slide[i][k] = -coefficient * (size > 0 ? mech_row_value(s, f + k, MECH_RATE) / size : way);
                }
            }
            add(p, MECH_CONE, i, slips, slips ? coefficient : 0);
            p->row[p->c.n++] = i;
            for (int k = 0; slips && k < (mech_row_partner(s, f) < 0 ? 1 : 2); k++)
                if (mech_row_moves_itself(s, f + k)) p->row[p->c.n++] = f + k;
        } else if (a && row->kind == MECH_FRICTION && row->normal < 0 && !is_partner(s, i) && is_slow(s, a, i) &&
                   mech_row_moves_itself(s, i)) {
            add(p, MECH_CONE_DISC, i, 1, mech_max(0, mech_row_value(s, i, MECH_LIMIT)));
            p->row[p->c.n++] = i;
        }
    }
    const int n = p->c.n;
    for (int i = 0; i < n; i++) {
        q[i] = mech_row_value(s, p->row[i], a ? MECH_SECOND : MECH_RATE);
        p->scale = mech_max(p->scale, mech_abs(q[i]));
        for (int j = 0; j < n; j++) {
            const int row = p->row[j], f = mech_row_of(s, row)->kind == MECH_CONTACT ? friction_of(s, row) : -1;
            w[(size_t)i * n + j] = mech_row_response(s, p->row[i], row);
            for (int k = 0; f >= 0 && k < 2; k++)
                if (slide[row][k] != 0) w[(size_t)i * n + j] += slide[row][k] * mech_row_response(s, p->row[i], f + k);
        }
    }
    for (int k = 0; k < p->c.n_cones; k++) p->cones[k].slack = mech_max(LEFT * p->scale, a ? 0 : rounding(s, p, k));
    return 1;
}

/* What counts as no acceleration of the solution. */
static mech_real none_of(const problem *p)
{
    mech_real most = 0;
    for (int i = 0; i < p->c.n; i++) most = mech_max(most, mech_abs(p->c.u[i]));
    return mech_min(NONE * p->scale, mech_max(10 * LEFT * p->scale, SLOWER * most));
}

/* Writes what cone k does to the choices. */
static void take(mech_solver *s, const problem *p, int k, int ends)
{
    mech_event_state *e = s->events;
    const mech_cone *cone = &p->cones[k];
    const mech_real *r = p->c.r + cone->at, *u = p->c.u + cone->at, none = none_of(p);
    if (cone->kind == MECH_CONE_HELD) return;
    const int first = cone->kind == MECH_CONE, contact = p->contact[k];
    const mech_real *rt = r + first, *ut = u + first;
    const mech_real size = cone->slips == 2 ? mech_sqrt(rt[0] * rt[0] + rt[1] * rt[1]) : cone->slips ? mech_abs(rt[0]) : 0;
    const mech_real rises = cone->slips == 2 ? mech_sqrt(ut[0] * ut[0] + ut[1] * ut[1]) : cone->slips ? mech_abs(ut[0]) : 0;
    if (first && (u[0] > none || (contact == ends && !(r[0] * mech_row_response(s, contact, contact) > none)))) {
        e->open[contact] = 1;
        return;
    }
    if (!cone->slips) return;
    const mech_real limit = first ? cone->coefficient * r[0] : cone->coefficient;
    const int ended = p->row[cone->at + first] == ends && size >= limit * (1 - MECH_C(1e-7));
    if (rises <= none && !ended) return;
    for (int j = 0; j < cone->slips; j++)
        e->slides[p->row[cone->at + first + j]] = rises > none ? ut[j] / rises : -rt[j] / size;
}

int mech_contact_cones_choose(mech_solver *s, int ends)
{
    mech_event_state *e = s->events;
    problem p;
    aside a = {.goes_on = 0};
    if (!begin_problem(s, &p, &a, 0, NULL)) return 0;
    const int solved = mech_cones_solve(&p.c, p.room);
    for (int i = 0; solved && i < e->n_rows; i++) {
        if (e->open[i] > 0) e->open[i] = 0;
        e->slides[i] = 0;
    }
    for (int k = 0; solved && k < p.c.n_cones; k++) take(s, &p, k, ends);
    come_back(s, &a);
    end_problem(&p);
    return solved;
}

/* Solves the problem beside the modes whose rows were read last. Whether what holds in them rests in its solution; with `all`, other
 * rows have its accelerations, too, and what slides is pressed as it is there. */
static int compare(mech_solver *s, int all)
{
    problem p;
    aside a = {.goes_on = !all};
    mech_real force[MECH_MOST_ROWS], second[MECH_MOST_ROWS];
    for (int i = 0; i < s->events->n_rows; i++) {
        force[i] = mech_row_value(s, i, MECH_FORCE);
        second[i] = mech_row_value(s, i, MECH_SECOND);
    }
    if (!begin_problem(s, &p, &a, 0, NULL)) return 0;
    int alike = mech_cones_solve(&p.c, p.room);
    const mech_real none = NONE * p.scale;
    for (int k = 0; alike && k < p.c.n; k++) {
        const int i = p.row[k], f = mech_row_of(s, i)->kind == MECH_CONTACT ? friction_of(s, i) : -1;
        if (a.flag[i] > MECH_C(0.5)) alike = mech_abs(p.c.u[k]) <= none;
        if (all) alike &= mech_abs(p.c.u[k] - second[i]) <= 10 * none;
        if (all && f >= 0 && slides(s, &a, f)) alike &= mech_abs(p.c.r[k] - force[i]) * mech_row_response(s, i, i) <= 10 * none;
    }
    come_back(s, &a);
    end_problem(&p);
    return alike;
}

int mech_contact_cones_hold(mech_solver *s) { return compare(s, 0); }

int mech_contact_cones_know_limits(mech_solver *s)
{
    mech_real limit[MECH_MOST_ROWS];
    aside a = {.goes_on = 0};
    int same = 1;
    mech_rows_read(s);
    for (int i = 0; i < s->events->n_rows; i++) limit[i] = mech_row_value(s, i, MECH_LIMIT);
    read_free(s, &a);
    for (int i = 0; i < s->events->n_rows; i++) {
        const mech_row *row = mech_row_of(s, i);
        const mech_real free = mech_row_value(s, i, MECH_LIMIT);
        if (row->kind == MECH_FRICTION && row->normal < 0) same &= mech_abs(limit[i] - free) <= NONE * mech_abs(free);
    }
    come_back(s, &a);
    mech_rows_read(s);
    return same;
}

int mech_contact_cones_move_alike(mech_solver *s) { return compare(s, 1); }

/* Writes the impulses r; with `restitution`, by contact, each of them times one more than that, or than `most`: Poisson's law. */
static void take_impulses(mech_solver *s, const problem *p, const mech_real *restitution, mech_real most)
{
    memset(s->events->impulse, 0, (size_t)s->events->n_rows * sizeof(mech_real));
    for (int k = 0; k < p->c.n_cones; k++) {
        const mech_cone *cone = &p->cones[k];
        const mech_real share = p->contact[k] < 0 || !restitution ? 1 : 1 + mech_min(most, restitution[p->contact[k]]);
        for (int i = cone->at; i < cone->at + cone->slips + 1; i++) s->events->impulse[p->row[i]] = share * p->c.r[i];
    }
}

static int is_nothing(const problem *p)
{
    for (int i = 0; i < p->c.n; i++)
        if (p->c.r[i] != 0) return 0;
    return 1;
}

int mech_contact_cones_strike(mech_solver *s, const mech_real *restitution, int n, const int *among)
{
    problem p;
    if (!begin_problem(s, &p, NULL, n, among)) return 0;
    mech_real *q = (mech_real *)p.c.q, size, least = 1, approach = 0;
    for (int k = 0; k < p.c.n_cones; k++) {
        const int i = p.contact[k] < 0 ? -1 : p.cones[k].at;
        if (i >= 0) approach = mech_max(approach, -q[i]);
        if (i >= 0 && q[i] < 0) q[i] += restitution[p.contact[k]] * q[i];
    }
    int solved = mech_cones_solve(&p.c, p.room);
    if (solved && approach > 0 && is_nothing(&p)) { /* a slow approach beside fast slips */
        for (int k = 0; k < p.c.n_cones; k++) p.cones[k].slack = mech_max(APPROACH_LEFT * approach, rounding(s, &p, k));
        solved = mech_cones_solve(&p.c, p.room);
    }
    if (solved) take_impulses(s, &p, NULL, 0);
    if (!solved || mech_rows_impulse_loss(s, &size) < -MECH_C(1e-9) * size) {
        for (int i = 0; i < p.c.n; i++) q[i] = mech_row_value(s, p.row[i], MECH_RATE);
        solved = mech_cones_solve(&p.c, p.room);
        for (int k = 0; k < p.c.n_cones; k++)
            if (p.contact[k] >= 0 && p.c.r[p.cones[k].at] > 0) least = mech_min(least, restitution[p.contact[k]]);
        take_impulses(s, &p, restitution, 1);
        if (mech_rows_impulse_loss(s, &size) < -MECH_C(1e-9) * size) take_impulses(s, &p, restitution, least);
        s->run->report.poisson += solved;
    }
    end_problem(&p);
    return solved;
}

/* ---- shocks -------------------------------------------------------------------------------------------------------- */

/* While impulses grow, friction stays against the slip of the moment, which turns and ends (G. Darboux 1880, J. B. Keller 1986). Of one contact
 * nothing else counts; several share as dampers of equal times would: du = W dr, dr_n = max(0, -u_n)/W_nn per unit of time. Where slips
 * drive contacts into the ground, any approach grows until they have turned or ended; all others fade. */

/* Approaches, in the largest speed, that tell whether there is a shock, and by how much one grows then. */
static const mech_real TOLD[] = {MECH_C(1e-8), MECH_C(1e-5), MECH_C(1e-2)}, GROWN = 100;
/* The angle by which a step may turn a slip, and the part by which it may change it; the part of a slip that may end in a step; a time
 * after which dampers give way at once. */
static const mech_real TURN = MECH_C(0.01), SHRINK = MECH_C(0.3), ENDS = MECH_C(1e-3), LONG = MECH_C(1e16);
enum { MOST_TURNS = 2000, MOST_SWEEPS = 30, FEW_ROWS = 48 };

/* A shock on its way: the problem, whose q are the rates of the moment; of each cone W_nn, and the slip that may end in a step; the impulses. */
typedef struct course {
    problem *p;
    mech_real *own, *least, *total;
} course;

static mech_real slip_of(const mech_cone *k, const mech_real *u)
{
    const mech_real *t = u + k->at + 1;
    return k->slips == 2 ? mech_sqrt(t[0] * t[0] + t[1] * t[1]) : k->slips ? mech_abs(t[0]) : 0;
}

static mech_real fastest_approach(const problem *p, const mech_real *u)
{
    mech_real most = 0;
    for (int k = 0; k < p->c.n_cones; k++)
        if (p->contact[k] >= 0) most = mech_max(most, -u[p->cones[k].at]);
    return most;
}

/* By how much slips turn and change in a step to the rates u, in the most that they may. */
static mech_real change_of_slips(const course *c, const mech_real *u, mech_real turn)
{
    mech_real most = 0;
    for (int k = 0; k < c->p->c.n_cones; k++) {
        const mech_cone *cone = &c->p->cones[k];
        const mech_real *before = c->p->c.q + cone->at + 1, *after = u + cone->at + 1;
        const mech_real size = mech_max(slip_of(cone, c->p->c.q), c->least[k]);
        mech_real along = 0, across = 0;
        if (!cone->slips || (slip_of(cone, c->p->c.q) <= c->least[k] && slip_of(cone, u) <= c->least[k])) continue;
        for (int i = 0; i < cone->slips; i++) along += before[i] * (after[i] - before[i]);
        if (cone->slips == 2) across = mech_abs(before[0] * after[1] - before[1] * after[0]);
        most = mech_max(most, mech_max(mech_abs(along) / SHRINK, across / turn) / (size * size));
    }
    return most;
}

/* Whether there is a slip that may end in a step. */
static int any_ends(const course *c)
{
    int ends = 0;
    for (int k = 0; k < c->p->c.n_cones; k++) ends |= c->p->cones[k].slips && slip_of(&c->p->cones[k], c->p->c.q) <= c->least[k];
    return ends;
}

/* The impulses of a step, in p->c.r, and the rates behind it, in p->c.u: by the rates in its middle (`share` 1/2), or by those behind it (1). */
static int yield_for(const course *c, mech_real time, mech_real share)
{
    problem *p = c->p;
    mech_real *w = p->memory;
    const int n = p->c.n;
    const mech_real ease = 1 / (share * time);
    for (int k = 0; k < p->c.n_cones; k++)
        if (p->contact[k] >= 0) w[(size_t)p->cones[k].at * (n + 1)] = c->own[k] * (1 + ease);
    const int swept = time < 1 && n > FEW_ROWS && mech_cones_sweep(&p->c, MOST_SWEEPS, p->room); /* of many rows, factors are dear */
    const int solved = swept || mech_cones_refine(&p->c, p->room) || mech_cones_solve(&p->c, p->room);
    for (int k = 0; k < p->c.n_cones; k++) {
        const int i = p->cones[k].at;
        if (p->contact[k] < 0) continue;
        w[(size_t)i * (n + 1)] = c->own[k];
        p->c.u[i] -= c->own[k] * ease * p->c.r[i];
    }
    for (int i = 0; i < n; i++) {
        p->c.u[i] = p->c.q[i] + (p->c.u[i] - p->c.q[i]) / share;
        p->c.r[i] /= share;
    }
    return solved;
}

/* From approaches of this size, which are taken back once they have grown, until nothing approaches. Gives whether they have grown. */
static int follow_shock(const course *c, mech_real approach)
{
    problem *p = c->p;
    const int n = p->c.n;
    mech_real *q = (mech_real *)p->c.q, time = TURN, slack = 0;
    int grown = 0, last = 0;
    for (int k = 0; k < p->c.n_cones; k++) {
        if (p->contact[k] < 0) continue;
        q[p->cones[k].at] -= approach;
        slack = mech_max(slack, p->cones[k].slack);
    }
    memset(p->c.r, 0, (size_t)n * sizeof(mech_real));
    for (int turn = 0; turn < MOST_TURNS && time > MECH_C(1e-9); turn++) {
        const mech_real before = fastest_approach(p, q), share = time < 1 && !any_ends(c) ? MECH_C(0.5) : 1;
        mech_real change = 10;
        if (yield_for(c, time, share))
            change = mech_max(fastest_approach(p, p->c.u) / before - 1, change_of_slips(c, p->c.u, share < 1 ? TURN : TURN / 10));
        if (change > 1) {
            time *= mech_max(MECH_C(0.1), MECH_C(0.8) / change);
            memset(p->c.r, 0, (size_t)n * sizeof(mech_real));
            continue;
        }
        for (int i = 0; i < n; i++) c->total[i] += p->c.r[i];
        memcpy(q, p->c.u, (size_t)n * sizeof(mech_real));
        if (!grown && fastest_approach(p, q) > GROWN * approach) {
            grown = 1;
            for (int k = 0; k < p->c.n_cones; k++)
                if (p->contact[k] >= 0) q[p->cones[k].at] += approach;
        }
        last += time >= LONG;
        const mech_real left = fastest_approach(p, q);
        if (left <= (last > 2 ? slack : MECH_EPSILON * p->scale)) return grown;
        time = mech_min(LONG, time * mech_min(2, MECH_C(0.8) / mech_max(change, MECH_C(1e-3))));
    }
    return 0;
}

int mech_contact_cones_shock(mech_solver *s)
{
    problem p;
    int struck = 0;
    if (!begin_problem(s, &p, NULL, 0, NULL)) return 0;
    const int n = p.c.n;
    mech_real *q = (mech_real *)p.c.q, *memory = calloc((size_t)(4 * n + 1), sizeof(mech_real)), *first = memory + 3 * n, size;
    const course c = {&p, memory, memory + n, memory + 2 * n};
    if (memory)
        for (int k = 0; k < p.c.n_cones; k++) { /* what is laid down neither rises nor falls */
            const int i = p.cones[k].at;
            if (p.contact[k] >= 0 && mech_row_may_rest(s, p.contact[k])) q[i] = 0;
            c.own[k] = p.c.w[(size_t)i * (n + 1)];
            const int slips = p.cones[k].slips && !mech_surface_friction_is_slow(s, friction_of(s, p.contact[k]));
            c.least[k] = ENDS * (slips ? slip_of(&p.cones[k], q) : p.scale);
        }
    if (memory) memcpy(first, q, (size_t)n * sizeof(mech_real));
    for (int l = 0; memory && p.scale > 0 && l < 3 && !struck; l++) {
        memcpy(q, first, (size_t)n * sizeof(mech_real));
        memset(c.total, 0, (size_t)n * sizeof(mech_real));
        if (!follow_shock(&c, TOLD[l] * p.scale)) continue;
        memcpy(p.c.r, c.total, (size_t)n * sizeof(mech_real));
        take_impulses(s, &p, NULL, 0);
        struck = mech_rows_impulse_loss(s, &size) >= -MECH_C(1e-9) * size;
    }
    if (!struck) memset(s->events->impulse, 0, (size_t)s->events->n_rows * sizeof(mech_real));
    free(memory);
    end_problem(&p);
    return struck;
}
