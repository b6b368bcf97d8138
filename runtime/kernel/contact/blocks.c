/* Block Gauss-Seidel over the velocities (M. Jean 1999; V. Acary, B. Brogliato 2008). */
#include "blocks.h"

#include <string.h>

enum { CHECKED = 8 }; /* sweeps between two looks at the residuals */

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

int mech_blocks_sweep(mech_blocks *c, int most)
{
    if (mech_blocks_check(c) && c->residual == 0) return 1; /* else a guess that would do gets better from step to step */
    for (int sweep = 0; sweep < most; sweep++) {
        int rests = 1;
        for (int a = 0; a < c->n; a++) {
            mech_block *block = &c->blocks[sweep % 2 ? c->n - 1 - a : a]; /* to and fro: no side comes first */
            const int n = mech_cone_rows(&block->cone);
            mech_real q[3], r[3];
            for (int i = 0; i < n; i++) {
                q[i] = block->b[i] + rate(block, block->k + i * block->width, c->v);
                for (int j = 0; j < n; j++) q[i] -= block->w[3 * i + j] * block->r[j];
            }
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
        if ((rests || sweep % CHECKED == CHECKED - 1 || sweep + 1 == most) && mech_blocks_check(c)) return 1;
    }
    return 0;
}
