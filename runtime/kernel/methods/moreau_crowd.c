#include "moreau_crowd.h"

#include <stdlib.h>
#include <string.h>

#include "blocks.h"
#include "crowd_response.h"

/* Sweeps; those before few rows are solved with their matrix, and how many these may be. */
enum { MOST_SWEEPS = 1000, SOME_SWEEPS = 200, MOST_JOINED = 96, LONGER = 2, FIRST = 64 };

/* What an approach has to exceed to rebound: what the step adds to any of them, and what may be left unsolved, times this. Among many
 * bodies one that nothing drives is moved by what is left of others. */
static const mech_real DRIVEN = 2, UNSOLVED = 10;

size_t mech_moreau_crowd_numbers(const mech_model *model) { return 4 * (size_t)model->hybrid->crowd->n + 3 * (size_t)model->nv + 2; }

void mech_moreau_crowd_attach(mech_moreau_crowd *o, const mech_model *model, mech_real *memory)
{
    const size_t n = (size_t)model->hybrid->crowd->n;
    *o = (mech_moreau_crowd){.impulse = memory, .wake = memory + 3 * n, .moved = memory + 4 * n, .step = memory + 4 * n + 1,
                             .moves = memory + 4 * n + 2, .pull = memory + 4 * n + 2 + model->nv,
                             .effort = memory + 4 * n + 2 + 2 * model->nv};
}

void mech_moreau_crowd_begin(const mech_moreau_crowd *o, const mech_model *model, int fresh)
{
    const mech_crowd *c = model->hybrid->crowd;
    memset(o->moves, 0, (size_t)model->nv * sizeof(mech_real));
    for (int i = 0; i < c->n; i++) {
        const mech_crowd_who who = mech_crowd_who_of(c, i);
        for (int k = 0; k < who.kind->n_normal; k++) o->moves[mech_crowd_velocity(c, &who, k)] = 1;
        o->wake[i] = -1;
    }
    *o->moved = 0;
    if (fresh) memset(o->impulse, 0, 3 * (size_t)c->n * sizeof(mech_real));
}

/* The contacts that the step has to know, by number, with their values. */
typedef struct near {
    int n, room;
    int *contact;
    mech_real *values; /* [n][crowd's widest] */
} near;

/* Makes room for one more; 0 without memory. */
static int widen(near *found, int width)
{
    if (found->n < found->room) return 1;
    const int room = found->room ? 2 * found->room : FIRST;
    int *contact = (int *)realloc(found->contact, (size_t)room * sizeof(int));
    if (contact) found->contact = contact;
    mech_real *values = (mech_real *)realloc(found->values, (size_t)room * (size_t)width * sizeof(mech_real));
    if (values) found->values = values;
    if (!contact || !values) return 0;
    found->room = room;
    return 1;
}

static void forget(near *found)
{
    free(found->contact);
    free(found->values);
}

/* Lists those that velocities of at most `speed` may close until the end of the step. `here`: how far coordinates have moved. */
static int look(const mech_crowd_at *at, const mech_moreau_crowd *o, mech_real h, mech_real here, mech_real speed, near *found)
{
    const mech_crowd *c = at->m->hybrid->crowd;
    const mech_real until = here + h / 2 * speed;
    found->n = 0;
    for (int i = 0, line = 0; i < c->n; i++) {
        if (o->wake[i] > until) continue;
        if (!widen(found, c->n_values)) return 0;
        while (line + 1 < c->n_lines && c->lines[line + 1].first <= i) line++;
        const mech_crowd_who who = mech_crowd_who_on(c, &c->lines[line], i);
        const mech_crowd_kind *kind = who.kind;
        mech_real *values = found->values + (size_t)found->n * (size_t)c->n_values;
        mech_crowd_values_of(at, &who, values);
        const mech_real *k = values + mech_crowd_entries(kind, 0), *bound = k + kind->n_normal;
        mech_real most = mech_abs(values[1]), reach = 0;
        for (int l = 0; l < kind->n_normal; l++) {
            most += mech_abs(k[l]) * speed;
            reach = reach < 0 || bound[l] < 0 ? -1 : reach + bound[l];
        }
        o->wake[i] = reach > 0 ? here + MECH_C(0.999) * mech_max(0, values[0]) / reach : -1;
        if (!(values[0] > h / 2 * most)) found->contact[found->n++] = i;
    }
    return 1;
}

/* The groups of velocities within which impulses act, and the inverse masses of each. */
typedef struct groups {
    int n, largest;
    int *start, *member, *place, *group; /* [n + 1] first member; [nv] members; [nv] of each velocity among those of its group, and that */
    size_t *at;                  /* [n] where the inverse mass of each begins                     */
    mech_real *inverse;
} groups;

/* Numbers the groups: those of the masses, joined where stiff forces connect them. */
static void number_groups(const mech_crowd *c, const mech_moreau_stiff *stiff, int nv, groups *g)
{
    for (int i = 0; i < nv; i++) g->group[i] = c->group[i];
    if (stiff->is) {
        int *first = g->member; /* of each group of masses, one of its velocities */
        for (int i = nv - 1; i >= 0; i--) first[c->group[i]] = i;
        for (int i = 0; i < nv; i++) mech_moreau_join(stiff, i, first[c->group[i]]);
        for (int i = 0; i < nv; i++) first[i] = -1;
        for (int i = 0, n = 0; i < nv; i++) {
            const int root = mech_moreau_group(stiff, i);
            if (first[root] < 0) first[root] = n++;
            g->group[i] = first[root];
        }
    }
    for (int i = 0; i < nv; i++) g->n = g->group[i] >= g->n ? g->group[i] + 1 : g->n;
}

static int find_groups(const mech_crowd_at *at, const mech_moreau_stiff *stiff, groups *g)
{
    const mech_model *m = at->m;
    const mech_crowd *c = m->hybrid->crowd;
    const int nv = m->nv;
    size_t entries = 0;
    memset(g, 0, sizeof *g);
    g->member = (int *)malloc((size_t)(4 * nv + 1) * sizeof(int));
    if (!g->member) return 0;
    g->place = g->member + nv;
    g->group = g->place + nv;
    g->start = g->group + nv;
    number_groups(c, stiff, nv, g);
    memset(g->start, 0, (size_t)(g->n + 1) * sizeof(int));
    g->at = (size_t *)malloc((size_t)g->n * sizeof(size_t));
    if (!g->at) return 0;
    for (int i = 0; i < nv; i++) g->place[i] = g->start[g->group[i] + 1]++;
    for (int k = 0; k < g->n; k++) {
        const int size = g->start[k + 1];
        g->largest = size > g->largest ? size : g->largest;
        g->at[k] = entries;
        entries += (size_t)size * (size_t)size;
        g->start[k + 1] += g->start[k];
    }
    for (int i = 0; i < nv; i++) g->member[g->start[g->group[i]] + g->place[i]] = i;
    g->inverse = (mech_real *)malloc((entries + (size_t)nv) * sizeof(mech_real));
    if (!g->inverse) return 0;
    mech_real *jump = g->inverse + entries;
    for (int column = 0; column < g->largest; column++) { /* one of each group at once */
        for (int i = 0; i < nv; i++) at->g[m->nu + i] = g->place[i] == column;
        c->push(at->t, at->y, at->g, at->z, at->p, jump);
        if (stiff->is) mech_moreau_soften(stiff, jump);
        for (int i = 0; i < nv; i++) {
            const int k = g->group[i], size = g->start[k + 1] - g->start[k];
            if (column < size) g->inverse[g->at[k] + (size_t)(g->place[i] * size + column)] = jump[i];
        }
    }
    return 1;
}

static void forget_groups(groups *g)
{
    free(g->member);
    free(g->at);
    free(g->inverse);
}

/* The groups that a contact moves: how many, each once, and how many velocities they have. Of two bodies these are few. */
static int groups_of(const mech_crowd *c, const groups *g, int contact, int *list, int *width)
{
    const mech_crowd_who who = mech_crowd_who_of(c, contact);
    int n = 0;
    *width = 0;
    for (int i = 0; i < who.kind->n_normal + who.kind->n_slip; i++) {
        const int group = g->group[mech_crowd_velocity(c, &who, i)];
        int k = 0;
        while (k < n && list[k] != group) k++;
        if (k < n) continue;
        list[n++] = group;
        *width += g->start[list[k] + 1] - g->start[list[k]];
    }
    return n;
}

/* K and R of the rows of a block. */
static void fill_block(const mech_crowd *c, const groups *g, int contact, const mech_real *values, const int *list, int n, mech_block *block,
                       int *v, mech_real *numbers)
{
    const mech_crowd_who who = mech_crowd_who_of(c, contact);
    const mech_crowd_kind *kind = who.kind;
    const int rows = mech_cone_rows(&block->cone), width = block->width;
    mech_real *k = numbers, *response = numbers + rows * width;
    memset(numbers, 0, 2 * (size_t)(rows * width) * sizeof(mech_real));
    for (int i = 0, at = 0; i < n; at += g->start[list[i] + 1] - g->start[list[i]], i++)
        memcpy(v + at, g->member + g->start[list[i]], (size_t)(g->start[list[i] + 1] - g->start[list[i]]) * sizeof(int));
    for (int row = 0; row < rows; row++) {
        const mech_real *entries = values + mech_crowd_entries(kind, row);
        for (int l = 0; l < (row ? kind->n_slip : kind->n_normal); l++) {
            const int own = mech_crowd_velocity(c, &who, (row ? kind->n_normal : 0) + l);
            int at = 0;
            for (int i = 0; list[i] != g->group[own]; i++) at += g->start[list[i] + 1] - g->start[list[i]];
            k[row * width + at + g->place[own]] += entries[l];
        }
        for (int i = 0, at = 0; i < n; i++) {
            const int size = g->start[list[i] + 1] - g->start[list[i]];
            const mech_real *inverse = g->inverse + g->at[list[i]], *part = k + row * width + at;
            for (int a = 0; a < size; a++)
                for (int b = 0; b < size; b++) response[row * width + at + a] += inverse[a * size + b] * part[b];
            at += size;
        }
    }
    block->v = v;
    block->k = k;
    block->response = response;
    mech_block_join(block);
}

/* Rates of a contact: that of its gap, then of its slips. */
static void rates(const mech_crowd *c, int contact, const mech_real *values, const mech_real *v, mech_real *u)
{
    const mech_crowd_kind *kind = mech_crowd_kind_of(c, contact);
    for (int i = 0; i <= kind->friction; i++)
        u[i] = mech_crowd_along(c, contact, i, values, v) + values[mech_crowd_drift(kind, i)];
}

static mech_real slip_size(int n, const mech_real *u) { return n == 0 ? 0 : n == 1 ? mech_abs(u[1]) : mech_sqrt(u[1] * u[1] + u[2] * u[2]); }

/* The cone of a contact, and what its rates are to be more than those of the velocities; 0 where it only rebounds later. */
static int set_cone(const mech_crowd_kind *kind, const mech_real *values, mech_real h, mech_real fastest, mech_real slow,
                    const mech_real *before, mech_block *block)
{
    const mech_real e = values[3], gap = values[0];
    const int strikes = e > 0 && before[0] < -mech_max(slow, values[4]);
    if (strikes && gap > 0) return 0;
    block->cone = (mech_cone){.kind = MECH_CONE, .slips = kind->friction};
    if (kind->friction) {
        const mech_real *slip = values + mech_crowd_slip(kind);
        const int slides = slip_size(kind->friction, before) > MECH_C(1e-9) * fastest;
        block->cone.coefficient = mech_max(0, slip[slides ? 3 : 2]);
        if (block->cone.coefficient == 0) block->cone.slips = 0;
    }
    block->b[0] = values[1] + (strikes ? e * before[0] : 2 * mech_max(0, gap) / h);
    for (int i = 1; i <= block->cone.slips; i++) block->b[i] = values[mech_crowd_drift(kind, i)];
    return 1;
}

/* Solves for the listed contacts; `number` [n]: of each block its place in the list. 0 without memory. */
static int solve(mech_solver *s, const mech_crowd_at *at, const mech_moreau_crowd *o, const mech_moreau_stiff *stiff, mech_real h, const near *found, const mech_real *v0,
                 mech_real fastest, mech_blocks *problem, int *number)
{
    const mech_crowd *c = at->m->hybrid->crowd;
    groups g;
    const mech_real slack = mech_max(s->o.rtol, MECH_C(1e-10)) * fastest;
    mech_real slow = UNSOLVED * slack;
    int done = find_groups(at, stiff, &g), most = 1;
    size_t indices = 0, numbers = 0;
    for (int k = 0; k < c->n_values; k++) most = most > k ? most : k;
    int *list = (int *)malloc((size_t)(most + 1) * sizeof(int));
    done = done && list;
    problem->n = 0;
    for (int k = 0; k < found->n; k++) {
        const mech_real *values = found->values + (size_t)k * (size_t)c->n_values;
        slow = mech_max(slow, DRIVEN * mech_abs(mech_crowd_along(c, found->contact[k], 0, values, problem->free_) -
                                                mech_crowd_along(c, found->contact[k], 0, values, v0)));
    }
    for (int k = 0; done && k < found->n; k++) {
        const mech_real *values = found->values + (size_t)k * (size_t)c->n_values;
        const int contact = found->contact[k];
        mech_block *block = problem->blocks + problem->n;
        mech_real before[3];
        rates(c, contact, values, v0, before);
        if (!set_cone(mech_crowd_kind_of(c, contact), values, h, fastest, slow, before, block)) continue;
        block->cone.slack = slack;
        groups_of(c, &g, contact, list, &block->width);
        for (int i = 0; i < mech_cone_rows(&block->cone); i++) block->r[i] = o->impulse[3 * contact + i];
        number[problem->n++] = k;
        indices += (size_t)block->width;
        numbers += 2 * (size_t)block->width * (size_t)mech_cone_rows(&block->cone);
    }
    int *v = (int *)malloc((indices + 1) * sizeof(int));
    mech_real *entries = (mech_real *)malloc((numbers + 1) * sizeof(mech_real));
    done = done && v && entries;
    indices = numbers = 0;
    for (int k = 0; done && k < problem->n; k++) {
        mech_block *block = problem->blocks + k;
        const int contact = found->contact[number[k]], n = groups_of(c, &g, contact, list, &block->width);
        fill_block(c, &g, contact, found->values + (size_t)number[k] * (size_t)c->n_values, list, n, block, v + indices, entries + numbers);
        indices += (size_t)block->width;
        numbers += 2 * (size_t)block->width * (size_t)mech_cone_rows(&block->cone);
    }
    const int few = done && mech_blocks_rows(problem) <= MOST_JOINED;
    const size_t swept = 6 * (size_t)problem->n + 2 * (size_t)problem->nv + 1, joined = few ? mech_blocks_joined_room(problem) : 0;
    problem->room = (mech_real *)malloc((swept > joined ? swept : joined) * sizeof(mech_real));
    done = done && problem->room;
    int solved = done && mech_blocks_sweep(problem, few ? SOME_SWEEPS : MOST_SWEEPS);
    if (done && few && !solved)
        solved = mech_blocks_solve_joined(problem, problem->room) || mech_blocks_sweep(problem, MOST_SWEEPS - SOME_SWEEPS);
    free(problem->room);
    free(v);
    free(entries);
    free(list);
    forget_groups(&g);
    return done ? 1 + solved : 0;
}

/* The largest of the velocities that move gaps. */
static mech_real fastest_of(const mech_moreau_crowd *o, int nv, const mech_real *v)
{
    mech_real most = 0;
    for (int i = 0; i < nv; i++) most = mech_max(most, o->moves[i] * mech_abs(v[i]));
    return most;
}

int mech_moreau_crowd_solve(mech_solver *s, const mech_moreau_crowd *o, const mech_moreau_stiff *stiff, mech_real h, mech_real *y, const mech_real *v0,
                            const mech_real *free_, mech_real *v, mech_real *fastest, mech_moreau_found *found)
{
    const mech_model *m = s->model;
    const mech_crowd *c = m->hybrid->crowd;
    near list = {0};
    mech_real *g = (mech_real *)calloc((size_t)(m->nu + c->n_given), sizeof(mech_real));
    if (!g) return 0;
    if (m->nu) memcpy(g, s->u, (size_t)m->nu * sizeof(mech_real));
    const mech_crowd_at at = {m, s->run->report.t + h / 2, y, s->u, s->o.z, s->o.p, g};
    const mech_real begin = fastest_of(o, m->nv, v0), here = *o->moved + h / 2 * begin;
    mech_real speed = LONGER * mech_max(begin, fastest_of(o, m->nv, free_)), after[3];
    int done = 0, *number = NULL;
    mech_blocks problem = {.nv = m->nv, .free_ = free_, .v = v};
    for (;;) {
        if (!look(&at, o, h, here, speed, &list)) break;
        for (int k = 0; k < list.n; k++) {
            const mech_real *values = list.values + (size_t)k * (size_t)c->n_values;
            for (int end = 0; end < 2; end++) {
                rates(c, list.contact[k], values, end ? free_ : v0, after);
                *fastest = mech_max(*fastest, mech_max(mech_abs(after[0]), slip_size(mech_crowd_kind_of(c, list.contact[k])->friction, after)));
            }
        }
        free(number);
        free(problem.blocks);
        number = (int *)malloc((size_t)(list.n + 1) * sizeof(int));
        problem.blocks = (mech_block *)calloc((size_t)(list.n + 1), sizeof(mech_block));
        if (!number || !problem.blocks) break;
        done = solve(s, &at, o, stiff, h, &list, v0, *fastest, &problem, number);
        const mech_real reached = fastest_of(o, m->nv, v);
        if (!done || !(reached > speed)) break; /* else impulses drive more onto others than was thought */
        speed = LONGER * reached;
    }
    *found = (mech_moreau_found){.residual = problem.residual, .sweeps = problem.sweeps, .solved = done == 2};
    *o->moved += h * speed;
    *o->step = h;
    for (int i = 0; done && i < m->nv; i++) o->pull[i] = (v[i] - free_[i]) / h;
    memset(o->effort, 0, (size_t)m->nv * sizeof(mech_real));
    for (int k = 0; done && k < list.n; k++) found->overlap = mech_max(found->overlap, -list.values[(size_t)k * (size_t)c->n_values]);
    memset(o->impulse, 0, 3 * (size_t)c->n * sizeof(mech_real));
    for (int k = 0; done && k < problem.n; k++) {
        const mech_block *block = problem.blocks + k;
        const int contact = list.contact[number[k]];
        const mech_real *values = list.values + (size_t)number[k] * (size_t)c->n_values;
        mech_real before[3], force[3] = {0};
        rates(c, contact, values, v0, before);
        rates(c, contact, values, v, after);
        for (int i = 0; i < mech_cone_rows(&block->cone); i++) {
            o->impulse[3 * contact + i] = block->r[i];
            force[i] = block->r[i] / h;
            found->lost -= block->r[i] * (before[i] + after[i]) / 2;
            found->supplied -= block->r[i] * values[mech_crowd_drift(mech_crowd_kind_of(c, contact), i)];
        }
        mech_crowd_press(c, contact, values, force, o->effort);
    }
    free(number);
    free(problem.blocks);
    forget(&list);
    free(g);
    return done > 0;
}

int mech_moreau_crowd_push(mech_solver *s, const mech_moreau_crowd *o, mech_real t, mech_real h, const mech_real *y, mech_real *jumps)
{
    const mech_model *m = s->model;
    const mech_crowd *c = m->hybrid->crowd;
    mech_real *g = (mech_real *)calloc((size_t)(m->nu + c->n_given), sizeof(mech_real));
    if (!g) return 0;
    if (m->nu) memcpy(g, s->u, (size_t)m->nu * sizeof(mech_real));
    for (int i = 0; i < m->nv; i++) g[m->nu + i] = h * o->effort[i];
    c->push(t, y, g, s->o.z, s->o.p, jumps);
    free(g);
    return 1;
}

void mech_moreau_crowd_tell(const mech_moreau_crowd *o, const mech_model *model, mech_real *z)
{
    enum { CLOSED = 3 };
    const mech_crowd *c = model->hybrid->crowd;
    mech_real *told = z + c->first + c->capacity, *asked = told + 1 + model->nv + c->n_efforts;
    *told = 1;
    memcpy(told + 1, o->pull, (size_t)model->nv * sizeof(mech_real));
    memcpy(told + 1 + model->nv, o->effort, (size_t)c->n_efforts * sizeof(mech_real));
    for (int i = 0; i < c->n_asked; i++) {
        const mech_real *impulse = o->impulse + 3 * c->asked[2 * i];
        const int what = c->asked[2 * i + 1];
        asked[i] = what == CLOSED ? impulse[0] > 0 : impulse[what] / *o->step;
    }
}
