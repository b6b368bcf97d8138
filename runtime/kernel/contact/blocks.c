/* Block Gauss-Seidel over the velocities (M. Jean 1999; V. Acary, B. Brogliato 2008). */
#include "blocks.h"

#include <string.h>

#include "linear.h"

enum { CHECKED = 8 };           /* sweeps between two looks at the residuals                                */
enum { GROWN = 2, GROWTHS = 3 }; /* changes grow where they are more than so many times as large; how often they may */

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

/* q = b + K v, and with the rates of all three rows in one pass over the velocities. */
static void rates_of(const mech_block *block, const mech_real *v, mech_real *q)
{
    const int n = mech_cone_rows(&block->cone), width = block->width;
    const mech_real *k0 = block->k, *k1 = k0 + width, *k2 = k1 + width;
    for (int i = 0; i < n; i++) q[i] = block->b[i];
    if (n < 3) {
        for (int i = 0; i < n; i++) q[i] += rate(block, k0 + i * width, v);
        return;
    }
    for (int i = 0; i < width; i++) {
        const mech_real own = v[block->v[i]];
        q[0] += k0[i] * own;
        q[1] += k1[i] * own;
        q[2] += k2[i] * own;
    }
}

/* Whether a contact has no impulse and gets none: the rate of its gap alone says so. */
static int stays_open(const mech_block *block, const mech_real *v)
{
    const mech_real *r = block->r;
    return block->cone.kind == MECH_CONE && r[0] == 0 && r[1] == 0 && r[2] == 0 && block->b[0] + rate(block, block->k, v) >= 0;
}

/* One sweep from the first to the last, or back. Gives whether nothing changed by more than its slack. */
static int sweep_once(mech_blocks *c, int back)
{
    int rests = 1;
    for (int a = 0; a < c->n; a++) {
        mech_block *block = &c->blocks[back ? c->n - 1 - a : a];
        const int n = mech_cone_rows(&block->cone);
        mech_real q[3], r[3];
        if (stays_open(block, c->v)) continue;
        rates_of(block, c->v, q);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++) q[i] -= block->w[3 * i + j] * block->r[j];
        mech_cone_solve(&block->cone, block->w, q, r);
        for (int i = 0; i < n; i++) {
            const mech_real change = r[i] - block->r[i];
            block->r[i] = r[i];
            if (change == 0) continue;
            rests &= mech_abs(change) * block->w[4 * i] <= block->cone.slack;
            push(block, i, change, c->v);
        }
    }
    c->sweeps++;
    return rests;
}

/* Goes on along the last direction: what the sweep changed, and of that before the share by which the changes shrink; of sweeps one way
 * at most all of it. Begins again where they turn against it, or grow: gives whether they do. Impulses may leave their cones by it: the
 * next sweep solves each of them again. */
static int go_on(mech_blocks *c, mech_real *before, int fresh, int one_way)
{
    mech_real *step = c->room, *start = step + 3 * c->n, *v_step = start + 3 * c->n, *v_start = v_step + c->nv, size = 0, along = 0;
    for (int a = 0; a < c->n; a++)
        for (int i = 0; i < mech_cone_rows(&c->blocks[a].cone); i++) {
            const mech_real change = c->blocks[a].r[i] - start[3 * a + i];
            size += c->blocks[a].w[4 * i] * change * change;
            along += c->blocks[a].w[4 * i] * change * step[3 * a + i];
        }
    const int grown = !fresh && size > GROWN * *before;
    const mech_real share = fresh || along < 0 || grown || !(*before > 0) ? 0 : one_way && size > *before ? 1 : size / *before;
    *before = size;
    for (int a = 0; a < c->n; a++)
        for (int i = 0; i < mech_cone_rows(&c->blocks[a].cone); i++) {
            mech_real *r = &c->blocks[a].r[i], *last = &step[3 * a + i];
            const mech_real change = *r - start[3 * a + i], further = share * *last;
            *r += further;
            *last = further + change;
        }
    for (int i = 0; i < c->nv; i++) {
        const mech_real change = c->v[i] - v_start[i], further = share * v_step[i];
        c->v[i] += further;
        v_step[i] = further + change;
    }
    return grown;
}

/* Notes where the next sweep begins. */
static void note(mech_blocks *c)
{
    mech_real *start = c->room + 3 * c->n, *v_start = start + 3 * c->n + c->nv;
    for (int a = 0; a < c->n; a++) memcpy(start + 3 * a, c->blocks[a].r, 3 * sizeof(mech_real));
    memcpy(v_start, c->v, (size_t)c->nv * sizeof(mech_real));
}

int mech_blocks_sweep(mech_blocks *c, int most)
{
    mech_real before = 0;
    int growths = 0;
    memset(c->room, 0, (6 * (size_t)c->n + 2 * (size_t)c->nv) * sizeof(mech_real));
    if (mech_blocks_check(c) && c->residual == 0) return 1; /* else a guess that would do gets better from step to step */
    for (int sweep = 0; sweep < most; sweep++) {
        const int one_way = growths < GROWTHS; /* heaps take half the sweeps then; in long chains that grows and grows */
        note(c);
        const int rests = sweep_once(c, one_way || sweep % 2);
        if ((rests || sweep % CHECKED == CHECKED - 1 || sweep + 1 == most) && mech_blocks_check(c)) return 1;
        growths += go_on(c, &before, sweep == 0, one_way);
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
