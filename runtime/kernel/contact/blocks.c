/* Block Gauss-Seidel over the velocities (M. Jean 1999; V. Acary, B. Brogliato 2008). */
#include "blocks.h"

#include <string.h>

#include "linear.h"

enum { CHECKED = 8, LONG = 30 }; /* sweeps between two looks at the residuals; of momentum before it may be full */

/* Changes of a sweep, as squares, have grown where they are more than so many times the least; by what the rest of the share to one grows
 * then, and the least limit; squared cosine above which changes go straight on. */
static const mech_real GROWN = 2, LESS = 2, LEAST_LIMIT = MECH_C(0.9), STRAIGHT = MECH_C(0.9);

static mech_real rate(const mech_block *block, const mech_real *k, const mech_real *v)
{
    mech_real sum = 0;
    for (int i = 0; i < block->width; i++) sum += k[i] * v[block->v[i]];
    return sum;
}

static void push(const mech_block *block, int row, mech_real impulse, mech_real *v)
{
    const mech_real *response = block->response + row * block->width;
    for (int i = 0; i < block->width; i++) v[block->v[i]] += impulse * response[i];
}

void mech_block_join(mech_block *block)
{
    const int n = mech_cone_rows(&block->cone);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            mech_real sum = 0;
            for (int l = 0; l < block->width; l++) sum += block->k[i * block->width + l] * block->response[j * block->width + l];
            block->w[3 * i + j] = sum;
        }
}

static mech_real mobility(const mech_block *block)
{
    const int n = mech_cone_rows(&block->cone);
    mech_real sum = 0;
    for (int i = 0; i < n; i++) sum += block->w[4 * i];
    return sum > 0 ? sum / n : 1;
}

int mech_blocks_check(mech_blocks *c)
{
    int solved = 1;
    memcpy(c->v, c->free_, (size_t)c->nv * sizeof(mech_real));
    for (int a = 0; a < c->n; a++)
        for (int i = 0; i < mech_cone_rows(&c->blocks[a].cone); i++) push(&c->blocks[a], i, c->blocks[a].r[i], c->v);
    c->residual = 0;
    c->worst = -1;
    for (int a = 0; a < c->n; a++) {
        mech_block *block = &c->blocks[a];
        for (int i = 0; i < mech_cone_rows(&block->cone); i++) block->u[i] = block->b[i] + rate(block, block->k + i * block->width, c->v);
        const mech_real residual = mech_cone_residual(&block->cone, mobility(block), block->r, block->u);
        if (!(residual <= block->cone.slack)) solved = 0;
        if (!(residual <= c->residual)) {
            c->residual = residual;
            c->worst = a;
        }
        if (!mech_finite(residual)) return 0;
    }
    return solved;
}

/* q = b + K v, in one pass over the velocities. */
static void rates_of(const mech_block *block, const mech_real *v, mech_real *q)
{
    const int n = mech_cone_rows(&block->cone), width = block->width;
    const mech_real *k0 = block->k, *k1 = k0 + width, *k2 = k1 + width;
    mech_real even[3] = {0, 0, 0}, odd[3] = {0, 0, 0}; /* sums that do not wait for each other */
    for (int i = 0; i < n; i++) q[i] = block->b[i];
    if (n < 3) {
        for (int i = 0; i < n; i++) q[i] += rate(block, k0 + i * width, v);
        return;
    }
    for (int i = 0; i + 1 < width; i += 2) {
        const mech_real one = v[block->v[i]], other = v[block->v[i + 1]];
        even[0] += k0[i] * one;
        even[1] += k1[i] * one;
        even[2] += k2[i] * one;
        odd[0] += k0[i + 1] * other;
        odd[1] += k1[i + 1] * other;
        odd[2] += k2[i + 1] * other;
    }
    if (width % 2) {
        const mech_real last = v[block->v[width - 1]];
        even[0] += k0[width - 1] * last;
        even[1] += k1[width - 1] * last;
        even[2] += k2[width - 1] * last;
    }
    for (int i = 0; i < 3; i++) q[i] += even[i] + odd[i];
}

/* v + R times the changes of the impulses, in one pass. */
static void push_all(const mech_block *block, const mech_real *change, mech_real *v)
{
    const int n = mech_cone_rows(&block->cone), width = block->width;
    const mech_real *r0 = block->response, *r1 = r0 + width, *r2 = r1 + width;
    if (n < 3) {
        for (int i = 0; i < n; i++) push(block, i, change[i], v);
        return;
    }
    for (int i = 0; i < width; i++) v[block->v[i]] += change[0] * r0[i] + change[1] * r1[i] + change[2] * r2[i];
}

/* Whether a contact has no impulse and gets none: the rate of its gap alone says so. */
static int stays_open(const mech_block *block, const mech_real *v)
{
    const mech_real *r = block->r;
    return block->cone.kind == MECH_CONE && r[0] == 0 && r[1] == 0 && r[2] == 0 && block->b[0] + rate(block, block->k, v) >= 0;
}

/* One sweep from the last to the first. Gives whether nothing changed by more than its slack. */
static int sweep_once(mech_blocks *c)
{
    int rests = 1;
    for (int a = c->n - 1; a >= 0; a--) {
        mech_block *block = &c->blocks[a];
        const int n = mech_cone_rows(&block->cone);
        mech_real q[3], r[3], change[3];
        if (stays_open(block, c->v)) continue;
        rates_of(block, c->v, q);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++) q[i] -= block->w[3 * i + j] * block->r[j];
        mech_cone_solve(&block->cone, block->w, q, r);
        for (int i = 0; i < n; i++) {
            change[i] = r[i] - block->r[i];
            block->r[i] = r[i];
            rests &= mech_abs(change[i]) * block->w[4 * i] <= block->cone.slack;
        }
        push_all(block, change, c->v);
    }
    c->sweeps++;
    return rests;
}

/* Sweeps since momentum began, its share, the most that this may be, and the least that a sweep has changed since. */
typedef struct momentum {
    int since;
    mech_real share, limit, least;
} momentum;

/* Goes on by a share of all that has changed since the sweep before ended: it grows with each sweep, and is full where one changes impulses
 * straight on. Momentum begins again where a sweep turns against it, and with less from then on where changes grow by it: friction has no
 * energy that sweeps lower. Impulses may leave their cones: the next sweep solves each of them again. */
static void go_on(mech_blocks *c, momentum *o)
{
    mech_real *start = c->room, *last = start + 3 * c->n, *v_last = last + 3 * c->n, size = 0, along = 0, way = 0;
    for (int a = 0; a < c->n; a++)
        for (int i = 0; i < mech_cone_rows(&c->blocks[a].cone); i++) {
            const mech_real w = c->blocks[a].w[4 * i], r = c->blocks[a].r[i], change = r - start[3 * a + i], all = r - last[3 * a + i];
            size += w * change * change;
            along += w * change * all;
            way += w * all * all;
        }
    const int grown = o->since && size > GROWN * o->least, straight = o->since > LONG && along > 0 && along * along > STRAIGHT * size * way;
    if (grown) o->limit = mech_max(LEAST_LIMIT, 1 - LESS * (1 - o->share));
    if (grown || along < 0) o->since = 0;
    o->least = o->since ? mech_min(o->least, size) : size;
    o->share = straight && !grown ? o->limit : mech_min(o->limit, (mech_real)o->since / (o->since + 3));
    o->since++;
    for (int a = 0; a < c->n; a++)
        for (int i = 0; i < mech_cone_rows(&c->blocks[a].cone); i++) {
            const mech_real r = c->blocks[a].r[i];
            start[3 * a + i] = c->blocks[a].r[i] = r + o->share * (r - last[3 * a + i]);
            last[3 * a + i] = r;
        }
    for (int i = 0; i < c->nv; i++) {
        const mech_real v = c->v[i];
        c->v[i] = v + o->share * (v - v_last[i]);
        v_last[i] = v;
    }
}

/* Whether it is solved; if not, v stays what sweeps have made it: momentum would multiply what rounding put between it and r. */
static int looks_solved(mech_blocks *c)
{
    mech_real *kept = c->room + 6 * c->n + c->nv;
    memcpy(kept, c->v, (size_t)c->nv * sizeof(mech_real));
    if (mech_blocks_check(c)) return 1;
    memcpy(c->v, kept, (size_t)c->nv * sizeof(mech_real));
    return 0;
}

int mech_blocks_sweep(mech_blocks *c, int most)
{
    mech_real *start = c->room, *last = start + 3 * c->n, *v_last = last + 3 * c->n;
    momentum o = {.limit = 1, .least = (mech_real)INFINITY};
    if (mech_blocks_check(c) && c->residual == 0) return 1; /* else a guess that would do gets better from step to step */
    for (int a = 0; a < c->n; a++) memcpy(start + 3 * a, c->blocks[a].r, 3 * sizeof(mech_real));
    memcpy(last, start, 3 * (size_t)c->n * sizeof(mech_real));
    memcpy(v_last, c->v, (size_t)c->nv * sizeof(mech_real));
    for (int sweep = 0; sweep < most; sweep++) {
        const int rests = sweep_once(c);
        if ((rests || sweep % CHECKED == CHECKED - 1 || sweep + 1 == most) && looks_solved(c)) return 1;
        go_on(c, &o);
    }
    return mech_blocks_check(c);
}

/* ---- as one problem ------------------------------------------------------------------------------------------------ */

int mech_blocks_rows(const mech_blocks *c)
{
    int n = 0;
    for (int a = 0; a < c->n; a++) n += mech_cone_rows(&c->blocks[a].cone);
    return n;
}

size_t mech_blocks_joined_room(const mech_blocks *c)
{
    const size_t n = (size_t)mech_blocks_rows(c);
    return n * n + 4 * n + (size_t)c->nv + mech_room_for((size_t)c->n * sizeof(mech_cone)) + mech_cones_room((int)n);
}

int mech_blocks_solve_joined(mech_blocks *c, mech_real *room)
{
    const int n = mech_blocks_rows(c);
    mech_real *w = room, *q = w + (size_t)n * (size_t)n, *r = q + n, *u = r + n, *before = u + n, *moved = before + n;
    mech_cone *cones = (mech_cone *)(moved + c->nv);
    mech_real *work = moved + c->nv + mech_room_for((size_t)c->n * sizeof(mech_cone));
    for (int a = 0, at = 0; a < c->n; at += mech_cone_rows(&c->blocks[a].cone), a++) {
        mech_block *block = &c->blocks[a];
        cones[a] = block->cone;
        cones[a].at = at;
        for (int i = 0; i < mech_cone_rows(&block->cone); i++) {
            q[at + i] = block->b[i] + rate(block, block->k + i * block->width, c->free_);
            before[at + i] = r[at + i] = block->r[i];
            memset(moved, 0, (size_t)c->nv * sizeof(mech_real));
            push(block, i, 1, moved);
            for (int b = 0, row = 0; b < c->n; row += mech_cone_rows(&c->blocks[b].cone), b++)
                for (int j = 0; j < mech_cone_rows(&c->blocks[b].cone); j++)
                    w[(size_t)(row + j) * (size_t)n + (size_t)(at + i)] = rate(&c->blocks[b], c->blocks[b].k + j * c->blocks[b].width, moved);
        }
    }
    mech_cones one = {.n = n, .n_cones = c->n, .cones = cones, .w = w, .q = q, .r = r, .u = u};
    mech_cones_check(&one);
    const mech_real residual = one.residual;
    const int solved = mech_cones_refine(&one, work);
    if (!solved && !(one.residual < residual)) memcpy(r, before, (size_t)n * sizeof(mech_real));
    for (int a = 0; a < c->n; a++)
        for (int i = 0; i < mech_cone_rows(&c->blocks[a].cone); i++) c->blocks[a].r[i] = r[cones[a].at + i];
    return mech_blocks_check(c);
}
