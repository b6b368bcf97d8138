/* Which contacts press, which frictions stick: an active set on the level of accelerations. */
#include "contact_modes.h"

#include <string.h>

#include "contact_cones.h"
#include "contact_projection.h"
#include "contact_rests.h"
#include "energy.h"
#include "journal.h"
#include "near_rows.h"
#include "contact_lcp.h"
#include "surface_friction.h"

enum { ROUNDS_PER_ROW = 8, MOST_COMBINED = 8, MOST_COMBINATIONS = 1000, MOST_LOOKED = 40, NEARLY_NONE = 10 };

static int is_partner(const mech_solver *s, int i) { return i > 0 && mech_row_partner(s, i - 1) == i; }

static void set(mech_solver *s, int i, int flag, mech_real sign)
{
    const mech_row *row = mech_row_of(s, i);
    s->events->z[row->flag] = flag;
    if (row->sign >= 0) s->events->z[row->sign] = sign;
}

static int side(mech_real x) { return x > 0 ? 1 : -1; }

/* Lets a friction slide along a, or on a surface along (a, b). */
static void slide(mech_solver *s, int i, mech_real a, mech_real b)
{
    const int j = mech_row_partner(s, i);
    const mech_real share = j < 0 ? 0 : mech_surface_friction_none(s, i) / mech_sqrt(a * a + b * b);
    set(s, i, 0, j < 0 ? side(a) : share * a);
    if (j >= 0) set(s, j, 0, share * b);
}

/* Whether row i is independent of the n rows already held, and moved by its own force: not so at a dead centre. */
static int independent(mech_solver *s, mech_near_rows_basis *held, int n, int i)
{
    mech_real target[MECH_MOST_ROWS], x[MECH_MOST_ROWS];
    if (!mech_row_moves_itself(s, i)) return 0;
    if (s->model->hybrid->crowd) return mech_near_rows_add(s, held, i);
    held->row[n] = i;
    memset(target, 0, (size_t)(n + 1) * sizeof(mech_real));
    return mech_rows_solve(s, n + 1, held->row, target, x) == n + 1;
}


/* Sets the flags of all rows that are not excluded: held if at rest and independent of those held before. */
static void propose(mech_solver *s)
{
    const mech_real *open = s->events->open, *slides = s->events->slides;
    mech_near_rows_basis held;
    int n = 0;
    held.n = 0;
    for (int kind = MECH_BILATERAL; kind >= MECH_CONTACT; kind -= 2) /* bilateral, then contacts */
        for (int i = 0; i < s->events->n_rows; i++) {
            if (s->events->rows[i].kind != kind) continue;
            if (kind == MECH_BILATERAL) {
                if (mech_row_holds(s, i) && independent(s, &held, n, i)) n++;
                continue;
            }
            const int rests = mech_row_may_rest(s, i) && !(open[i] > 0);
            const int holds = rests && independent(s, &held, n, i);
            n += holds;
            set(s, i, holds, 0);
        }
    for (int i = 0; i < s->events->n_rows; i++) {
        const mech_row *row = mech_row_of(s, i);
        if (row->kind != MECH_FRICTION || is_partner(s, i)) continue;
        const int j = mech_row_partner(s, i), open_normal = row->normal >= 0 && !mech_row_holds(s, row->normal);
        const mech_real other = j < 0 ? 0 : slides[j];
        if (!open_normal && !mech_surface_friction_is_slow(s, i)) {
            slide(s, i, mech_row_value(s, i, MECH_RATE), j < 0 ? 0 : mech_row_value(s, j, MECH_RATE));
        } else if (!open_normal && (slides[i] != 0 || other != 0)) {
            slide(s, i, slides[i], other);
        } else {
            for (int k = i; k <= (j < 0 ? i : j); k++) {
                const int holds = !open_normal && independent(s, &held, n, k);
                n += holds;
                set(s, k, holds, 0);
            }
        }
    }
}

static int sticks(const mech_solver *s, int i)
{
    const int j = mech_row_partner(s, i);
    return mech_row_holds(s, i) || (j >= 0 && mech_row_holds(s, j));
}

/* Reads the rows in modes that are tried. */
static void read_modes(mech_solver *s)
{
    mech_rows_read(s);
    for (int i = 0; i < s->events->n_rows; i++) {
        const int j = mech_row_partner(s, i);
        if (j >= 0 && mech_row_holds(s, i) != mech_row_holds(s, j)) mech_row_share_across(s, i);
    }
}

/* A friction gives way: it slides against its force. */
static void let_slide(mech_solver *s, int i)
{
    const int j = mech_row_partner(s, i);
    const mech_real size = mech_row_size(s, i, MECH_FORCE);
    s->events->slides[i] = j < 0 ? -side(mech_row_value(s, i, MECH_FORCE)) : -mech_row_value(s, i, MECH_FORCE) / size;
    if (j >= 0) s->events->slides[j] = -mech_row_value(s, j, MECH_FORCE) / size;
}

/* Whether a friction that is neither held nor slides moves all the same: nothing could hold it, as at a dead centre,
 * where no force moves what slides. Others that are not held rest because those on which they depend do. */
static int moves_off(const mech_solver *s, int i)
{
    const mech_row *row = mech_row_of(s, i);
    const mech_event_state *e = s->events;
    const int j = mech_row_partner(s, i);
    if (row->kind != MECH_FRICTION || is_partner(s, i) || sticks(s, i) || e->z[row->sign] != 0) return 0;
    if (row->normal >= 0 && !mech_row_holds(s, row->normal)) return 0;
    if (j >= 0 && e->z[mech_row_of(s, j)->sign] != 0) return 0;
    mech_real scale = e->rate_scale[e->n - e->n_rows + i];
    for (int k = 0; k < e->n_rows; k++)
        scale += mech_abs(mech_row_value(s, k, MECH_FORCE) * mech_row_response(s, i, k));
    return mech_row_size(s, i, MECH_SECOND) > MECH_C(1e-9) * scale;
}

/* The row that pulls, or that sticks beyond its limit, by the most; -1 where there is none. */
static int most_overdone(const mech_solver *s, int hit)
{
    const mech_event_state *e = s->events;
    int worst = -1;
    mech_real excess = 0;
    for (int i = 0; i < s->events->n_rows; i++) {
        const mech_row *row = mech_row_of(s, i);
        const mech_real force = mech_row_value(s, i, MECH_FORCE), slack = MECH_C(1e-10) * e->force[i];
        mech_real over = 0;
        if (row->kind == MECH_CONTACT && mech_row_holds(s, i))
            over = i == hit ? e->force[i] : -force - slack;
        else if (row->kind == MECH_FRICTION && !is_partner(s, i) && sticks(s, i))
            over = i == hit ? e->force[i] : mech_row_size(s, i, MECH_FORCE) - mech_row_value(s, i, MECH_LIMIT) - slack;
        if (over > excess) {
            excess = over;
            worst = i;
        }
    }
    return worst;
}

/* Lets it go; -1 where there is none. */
static int let_go(mech_solver *s, int hit)
{
    const int worst = most_overdone(s, hit);
    if (worst < 0) return worst;
    if (mech_row_of(s, worst)->kind == MECH_CONTACT)
        s->events->open[worst] = 1;
    else
        let_slide(s, worst);
    return worst;
}

/* Marks contact i if it rises but would fall back from no height; gives whether it does. */
static int lay_down(mech_solver *s, int i)
{
    const mech_real rate = mech_row_value(s, i, MECH_RATE);
    const int lies = s->events->rows[i].kind == MECH_CONTACT && !mech_row_holds(s, i) && s->events->open[i] == 0 && rate > 0 &&
                     mech_row_touches(s, i) && mech_row_falls_back(s, i, rate) && !(s->events->counters[MECH_FLIES] > 0);
    if (lies) s->events->open[i] = -1;
    return lies;
}

/* Takes back the first row that was let go but comes back, or that slides another way than its friction assumes; -1
 * where there is none. `aims`: slides on surfaces find their way. */
static int take_back(mech_solver *s, int aims)
{
    mech_real *open = s->events->open, *slides = s->events->slides;
    const mech_event_state *e = s->events;
    for (int i = 0; i < s->events->n_rows; i++) {
        const mech_real second = mech_row_value(s, i, MECH_SECOND);
        const mech_real slack = MECH_C(1e-7) * e->force[i] * mech_row_response(s, i, i);
        if (open[i] > 0 && second < -slack) {
            open[i] = 0;
            return i;
        }
        const int j = mech_row_partner(s, i);
        if (moves_off(s, i)) {
            const mech_real size = mech_row_size(s, i, MECH_SECOND);
            slides[i] = second / size;
            if (j >= 0) slides[j] = mech_row_value(s, j, MECH_SECOND) / size;
            return i;
        }
        if (j >= 0 && aims && mech_surface_friction_aim(s, i)) return i;
        const mech_real along = slides[i] * second + (j < 0 ? 0 : slides[j] * mech_row_value(s, j, MECH_SECOND));
        if (!is_partner(s, i) && along < -slack) {
            slides[i] = 0;
            if (j >= 0) slides[j] = 0;
            return i;
        }
        if (lay_down(s, i)) {
            memset(slides, 0, (size_t)e->n_rows * sizeof(mech_real)); /* with it, all may stick */
            return i;
        }
    }
    return -1;
}

static int is_chosen(const mech_solver *s, int i)
{
    return mech_row_of(s, i)->kind == MECH_CONTACT || mech_row_of(s, i)->kind == MECH_FRICTION;
}

/* The modes of all rows as they are, to come back to. */
typedef struct modes {
    mech_real flag[MECH_MOST_ROWS], sign[MECH_MOST_ROWS], open[MECH_MOST_ROWS], slides[MECH_MOST_ROWS];
} modes;

static void remember(const mech_solver *s, modes *m)
{
    const mech_event_state *e = s->events;
    for (int i = 0; i < e->n_rows; i++) {
        m->open[i] = e->open[i];
        m->slides[i] = e->slides[i];
        if (!is_chosen(s, i)) continue;
        m->flag[i] = e->z[mech_row_of(s, i)->flag];
        m->sign[i] = mech_row_of(s, i)->sign < 0 ? 0 : e->z[mech_row_of(s, i)->sign];
    }
}

static void come_back(mech_solver *s, const modes *m)
{
    for (int i = 0; i < s->events->n_rows; i++) {
        if (is_chosen(s, i)) set(s, i, m->flag[i] > MECH_C(0.5), m->sign[i]);
        s->events->open[i] = m->open[i];
        s->events->slides[i] = m->slides[i];
    }
    mech_rows_read(s);
}

static int has_friction(const mech_solver *s, int contact)
{
    for (int k = 0; k < s->events->n_rows; k++)
        if (mech_row_of(s, k)->kind == MECH_FRICTION && mech_row_of(s, k)->normal == contact) return 1;
    return 0;
}

/* What fits, but for the contacts of friction that press: 1 where one of them may as well be open, since the others
 * stay as they are and it rises. Coulomb's law has a second solution there, and nothing says which one comes. */
static int fits_open(mech_solver *s, int *contact)
{
    mech_event_state *e = s->events;
    modes chosen;
    int found = 0;
    for (int i = 0; i < s->events->n_rows && !found; i++) {
        if (s->events->rows[i].kind != MECH_CONTACT || !mech_row_holds(s, i)) continue;
        const mech_real slack = MECH_C(1e-7) * e->force[i] * mech_row_response(s, i, i);
        if (!(mech_row_value(s, i, MECH_FORCE) > MECH_C(1e-7) * e->force[i]) || !has_friction(s, i)) continue;
        remember(s, &chosen);
        e->open[i] = 1; /* what depended on its friction is held by others then */
        propose(s);
        read_modes(s);
        found = mech_row_value(s, i, MECH_SECOND) > slack && most_overdone(s, -1) < 0;
        come_back(s, &chosen);
        *contact = i;
    }
    return found;
}

/* Mends the row that fits least, and gives it; -1 where all fit. `hit` was located where its mode ends. */
static int mend_misfit(mech_solver *s, int hit, int aims)
{
    const int worst = let_go(s, hit);
    return worst >= 0 ? worst : take_back(s, aims);
}

/* Rows that may be in several modes: contacts are held or open, frictions on a line that do not slide yet stick, or begin to
 * slide to either side. Gives how many there are, -1 where there are too many, or frictions on a surface, which find their
 * way by turns. */
static int find_choices(mech_solver *s, int *row, int *ways, int most)
{
    int n = 0, all = 1;
    for (int i = 0; i < s->events->n_rows; i++) {
        const int kind = mech_row_of(s, i)->kind, contact = kind == MECH_CONTACT && s->events->open[i] >= 0;
        if (contact ? !mech_row_may_rest(s, i) : kind != MECH_FRICTION || is_partner(s, i)) continue;
        const int normal = mech_row_of(s, i)->normal;
        if (!contact && normal >= 0 && !mech_row_may_rest(s, normal)) continue;
        if (!contact && mech_row_partner(s, i) >= 0) return -1;
        if (!contact && !mech_surface_friction_is_slow(s, i)) continue;
        if (n == MOST_COMBINED || (all *= contact ? 2 : 3) > most) return -1;
        row[n] = i;
        ways[n++] = contact ? 2 : 3;
    }
    return n;
}

/* Sets one combination of these; 0 where it is none, or not one that fits. `ends` has come to the end of its mode. */
static int combination_fits(mech_solver *s, int n, const int *row, const int *ways, int combination, int ends)
{
    mech_event_state *e = s->events;
    for (int k = 0; k < n; k++) {
        const int way = combination % ways[k];
        combination /= ways[k];
        if (ways[k] == 2)
            e->open[row[k]] = way;
        else
            e->slides[row[k]] = way == 2 ? -1 : way;
    }
    propose(s);
    if (ends >= 0 && sticks(s, ends)) return 0;
    mech_rows_read(s);
    return most_overdone(s, -1) < 0 && take_back(s, 0) < 0;
}

/* Few rows in all combinations: the first that fits, -1 where none does, -2 where others that fit move otherwise, than `second`
 * if something has been found; the shares of forces that depend on each other are not told. */
static int fitting_combination(mech_solver *s, int most, int ends, mech_real *second, int found)
{
    int row[MOST_COMBINED], ways[MOST_COMBINED], all = 1;
    const int n = find_choices(s, row, ways, most);
    for (int k = 0; k < n; k++) all *= ways[k];
    for (int c = 0; n > 0 && c < all; c++) {
        if (!combination_fits(s, n, row, ways, c, ends)) continue;
        for (int i = 0; i < s->events->n_rows; i++) {
            mech_real slack = 0; /* a row that never pressed is moved by the forces of others */
            for (int k = 0; k < s->events->n_rows; k++)
                slack = mech_max(slack, MECH_C(1e-6) * s->events->force[k] * mech_abs(mech_row_response(s, i, k)));
            if (found < 0)
                second[i] = mech_row_value(s, i, MECH_SECOND);
            else if (mech_abs(second[i] - mech_row_value(s, i, MECH_SECOND)) > slack)
                return -2;
        }
        if (found < 0) found = c;
    }
    return found;
}

/* Where the search from one combination to the next goes round. */
static int fits_once(mech_solver *s, int ends)
{
    int row[MOST_COMBINED], ways[MOST_COMBINED];
    mech_real second[MECH_MOST_ROWS];
    const int found = fitting_combination(s, MOST_COMBINATIONS, ends, second, -1);
    if (found < 0) return 0;
    const int n = find_choices(s, row, ways, MOST_COMBINATIONS);
    return combination_fits(s, n, row, ways, found, ends);
}

/* Whether few contacts of friction are at hand, but several: those that may be open or not at the same time. */
static int are_several(mech_solver *s)
{
    int row[MOST_COMBINED], ways[MOST_COMBINED], several = 0;
    for (int i = 0; i < s->events->n_rows; i++)
        several += mech_row_of(s, i)->kind == MECH_CONTACT && mech_row_may_rest(s, i) && has_friction(s, i);
    return several > 1 && !s->model->hybrid->crowd && find_choices(s, row, ways, MOST_LOOKED) > 0;
}

/* Whether they have another solution beside what fits, in which they move otherwise. */
static int moves_otherwise(mech_solver *s, int ends)
{
    mech_event_state *e = s->events;
    mech_real second[MECH_MOST_ROWS];
    modes chosen;
    for (int i = 0; i < e->n_rows; i++) second[i] = mech_row_value(s, i, MECH_SECOND);
    remember(s, &chosen);
    const int found = fitting_combination(s, MOST_LOOKED, ends, second, 0);
    come_back(s, &chosen);
    return found == -2;
}

/* What is chosen fits: the state moves onto it. */
static int take_choice(mech_solver *s, int ends)
{
    if (s->events->counters[MECH_UNLISTED] > 0) return mech_fail(s, MECH_NO_MODE, -1);
    for (int i = 0; i < s->events->n_rows; i++)
        if (!mech_finite(mech_row_value(s, i, MECH_FORCE))) {
            s->run->report.failed_value = mech_row_value(s, i, MECH_FORCE);
            return mech_fail(s, MECH_NO_MODE, i);
        }
    int contact = ends < 0 ? 0 : ends;
    const int shared = s->events->counters[MECH_CARRIED] > 0; /* how they share is no other solution */
    if (shared ? 0 : are_several(s) ? moves_otherwise(s, ends) : fits_open(s, &contact)) {
        /* Nothing says which one a run begins with; what came to press in it goes on pressing. */
        if (!(s->run->report.t > s->o.t0) && !s->run->report.steps) return mech_fail(s, MECH_NO_MODE, contact);
        s->run->report.several++;
    }
    /* Gaps that are closed by what counts as touching lower what lies on them. */
    const int booked = mech_energy_booked(s);
    const mech_real before = booked ? mech_energy_total(s) : 0;
    mech_contact_projection_state(s);
    if (booked) mech_energy_book_beyond_rounding(s, before);
    for (int i = 0; s->model->hybrid->crowd && i < s->events->n_rows; i++) { /* what is left is kept by others */
        const mech_real approach = -mech_row_value(s, i, MECH_RATE);
        if (mech_row_touches(s, i) && approach > 0 && approach <= mech_row_rest(s, i) / 100) s->events->open[i] = -1;
    }
    mech_surface_friction_begin(s);
    mech_contact_rests_mark(s);
    return mech_rows_check(s, 1);
}

/* Forces of a crowd have the sizes of those that end what accelerates without them. */
static void weigh_forces(mech_solver *s)
{
    mech_event_state *e = s->events;
    mech_real flags[MECH_MOST_ROWS];
    for (int i = 0; i < e->n_rows; i++) {
        flags[i] = e->z[e->rows[i].flag];
        e->z[e->rows[i].flag] = 0;
    }
    mech_rows_read(s);
    mech_rows_weigh(s);
    for (int i = 0; i < e->n_rows; i++) e->z[e->rows[i].flag] = flags[i];
}

/* Whether frictions on several surfaces rest, of which some depend on others: of what these carry, modes know one share only, and
 * the cones of two directions that another share would keep may be left by it. Those of one surface are shared by share_across. */
static int share_cones(const mech_solver *s)
{
    int surfaces = 0, depends = 0;
    for (int i = 0; i < s->events->n_rows; i++) {
        const mech_row *row = mech_row_of(s, i);
        if (row->kind != MECH_FRICTION || row->normal < 0 || !mech_row_may_rest(s, row->normal)) continue;
        if (!(mech_row_partner(s, i) >= 0 || is_partner(s, i)) || !(mech_row_value(s, i, MECH_COEFFICIENT) > 0)) continue;
        if (s->events->z[row->sign] != 0) continue;
        surfaces += !is_partner(s, i);
        depends |= !mech_row_holds(s, i);
    }
    return depends && surfaces > 1;
}

/* Whether all that touches rests and sticks, as the choices are. */
static int all_rest(const mech_solver *s)
{
    for (int i = 0; i < s->events->n_rows; i++) {
        const mech_row *row = mech_row_of(s, i);
        if (s->events->slides[i] != 0 || (s->events->open[i] > 0 && mech_row_may_rest(s, i))) return 0;
        if (row->kind == MECH_FRICTION && row->sign >= 0 && s->events->z[row->sign] != 0) return 0;
    }
    return 1;
}

/* The modes of the contact problem; 0, and all as it was, where they do not fit. Where they move all as its solution does, and
 * others than the rows that hold carry parts of the load, the cones of single ones say nothing: what ends that is that the
 * problem has no such solution any more. */
static int choose_by_cones(mech_solver *s, int ends)
{
    modes before;
    int lies = 1;
    remember(s, &before);
    while (lies) {
        if (!mech_contact_cones_choose(s, ends)) return 0;
        propose(s);
        read_modes(s);
        lies = 0;
        for (int i = 0; i < s->events->n_rows; i++) lies |= lay_down(s, i);
    }
    const int fits = most_overdone(s, -1) < 0 && take_back(s, 0) < 0;
    if (!fits) {
        mech_rows_read(s);
        s->events->counters[MECH_CARRIED] = mech_contact_cones_move_alike(s);
    }
    if (fits || s->events->counters[MECH_CARRIED] > 0) return 1;
    come_back(s, &before);
    return 0;
}

/* From one combination to the next, then all of them; 0 where none fits. */
static int search(mech_solver *s, int ends)
{
    for (int round = 0; round <= ROUNDS_PER_ROW * s->events->n_rows; round++) {
        read_modes(s);
        if (!round && !s->model->hybrid->crowd && share_cones(s) && most_overdone(s, ends) >= 0 && choose_by_cones(s, ends)) return 1;
        if (mend_misfit(s, round == 0 ? ends : -1, round < ROUNDS_PER_ROW / 2 * s->events->n_rows) < 0) return 1;
        propose(s);
    }
    if (fits_once(s, ends) || (!s->model->hybrid->crowd && choose_by_cones(s, ends))) return 1;
    int laid = 0; /* what has been laid down may be what no force holds: then it flies, and falls back */
    for (int i = 0; i < s->events->n_rows; i++) laid += s->events->open[i] < 0;
    if (!laid || s->events->counters[MECH_FLIES] > 0) return 0;
    memset(s->events->open, 0, (size_t)s->events->n_rows * sizeof(mech_real));
    memset(s->events->slides, 0, (size_t)s->events->n_rows * sizeof(mech_real));
    s->events->counters[MECH_FLIES] = 1;
    propose(s);
    const int found = search(s, ends);
    s->events->counters[MECH_FLIES] = 0;
    return found;
}

/* An impact without an approach, where there is one. */
static int shock(mech_solver *s)
{
    if (!mech_contact_cones_shock(s)) return 0;
    for (int i = 0; i < s->events->n_rows; i++)
        if (mech_row_of(s, i)->kind == MECH_CONTACT && s->events->impulse[i] > 0) mech_journal_note(s, MECH_IMPACT, i, 0);
    mech_rows_apply_impulses(s);
    s->events->counters[MECH_CROWD] = s->events->counters[MECH_STANDING] = s->events->counters[MECH_RATTLES] = 0;
    return 1;
}

int mech_contact_modes_end_rattle(mech_solver *s)
{
    mech_real *jams = s->events->counters + MECH_JAMS;
    if (!(s->events->counters[MECH_RATTLES] > 0) && !(*jams > 0)) return 0;
    mech_rows_read(s);
    mech_rows_find_response(s);
    if (*jams > 0) *jams = -1;
    if (shock(s)) return 1;
    if (!(s->events->counters[MECH_RATTLES] > 0)) return 0;
    s->events->counters[MECH_NEARLY] = s->events->counters[MECH_RATTLES]; /* else slips that are ever less slow end */
    mech_surface_friction_end(s);
    s->events->counters[MECH_NEARLY] = 0;
    return 0;
}

/* A slip that has just begun goes on, if nothing has jolted it: its speed is still below what counts as rest, and its force is
 * what static friction holds, within rounding. */
static void keep_slips(mech_solver *s)
{
    mech_event_state *e = s->events;
    const int nq = s->model->nq;
    if (memcmp(s->y + nq, e->y_before + nq, (size_t)s->model->nv * sizeof(mech_real))) return;
    for (int i = 0; i < e->n_rows; i++) {
        const mech_row *row = mech_row_of(s, i);
        if (row->kind != MECH_FRICTION || mech_row_partner(s, i) >= 0 || is_partner(s, i) || mech_row_holds(s, i) || e->slides[i] != 0) continue;
        const mech_real slack = MECH_C(1e-7) * e->force[i] * mech_row_response(s, i, i);
        if (e->z[row->sign] * mech_row_value(s, i, MECH_SECOND) > slack) e->slides[i] = e->z[row->sign];
    }
}

/* Where nothing fits, slips on surfaces that are nearly none are over: within the tolerance, their directions are any, and so may be
 * those that no force holds. Gives whether there are any, and what fits then. */
static int search_without(mech_solver *s, int ends)
{
    mech_event_state *e = s->events;
    int slow = 0;
    for (int nearly = 1; nearly >= 0; nearly--) { /* which of them are nearly none, but not none */
        e->counters[MECH_NEARLY] = NEARLY_NONE * nearly;
        for (int i = 0; i < e->n_rows; i++) slow += (nearly ? 1 : -1) * (mech_row_partner(s, i) >= 0 && mech_surface_friction_is_slow(s, i));
    }
    if (!slow) return 0;
    for (int i = 0; i < e->n_rows; i++) {
        if (e->open[i] > 0) e->open[i] = 0;
        e->slides[i] = 0;
    }
    e->counters[MECH_NEARLY] = NEARLY_NONE;
    propose(s);
    mech_surface_friction_end(s);
    e->counters[MECH_NEARLY] = 0;
    return search(s, ends);
}

int mech_contact_modes_choose(mech_solver *s, int hit, int *struck)
{
    int any = 0, friction = 0;
    for (int i = 0; i < s->events->n_rows; i++) {
        any |= s->events->rows[i].kind != MECH_STEP_ROW;
        friction |= s->events->rows[i].kind == MECH_FRICTION;
    }
    if (!any) return MECH_RUNNING;
    s->events->counters[MECH_CARRIED] = 0;
    mech_rows_read(s);
    mech_rows_find_response(s);
    /* A stick that ends, ends: a reversal begins with the attempt to stick. */
    const int ends = hit >= 0 && s->events->rows[hit].kind != MECH_STEP_ROW && sticks(s, hit) ? hit : -1;
    if (s->model->hybrid->crowd && !friction) return mech_contact_lcp_choose(s, ends) < 0 ? mech_fail(s, MECH_NO_MODE, hit < 0 ? 0 : hit) : take_choice(s, ends);
    if (s->model->hybrid->crowd) weigh_forces(s);
    keep_slips(s);
    propose(s);
    mech_surface_friction_end(s);
    if (search(s, ends) || search_without(s, ends)) {
        if (!s->model->hybrid->crowd && !(s->events->counters[MECH_CARRIED] > 0) && mech_contact_rests_any_slide(s) &&
            mech_contact_cones_know_limits(s))
            choose_by_cones(s, -1); /* what cannot move only bears its limit of the load */
        mech_rows_read(s); /* forces of the modes, which single rows would have to carry */
        if (!s->model->hybrid->crowd && share_cones(s) && all_rest(s) && most_overdone(s, -1) >= 0)
            s->events->counters[MECH_CARRIED] = mech_contact_cones_hold(s);
        return take_choice(s, ends);
    }
    *struck = friction && shock(s);
    return *struck ? MECH_RUNNING : mech_fail(s, MECH_NO_MODE, hit < 0 ? 0 : hit);
}

/* Whether the impulses of friction i lie within its cone, and it has no slip beyond rounding of the problem. */
static int lies_within(const mech_solver *s, int i, const mech_real *impulse, const mech_real *rate)
{
    const mech_row *row = mech_row_of(s, i);
    const int j = mech_row_partner(s, i);
    const mech_real slip = j < 0 ? mech_abs(rate[i]) : mech_sqrt(rate[i] * rate[i] + rate[j] * rate[j]);
    return (row->normal < 0 || impulse[row->normal] > 0) && slip <= MECH_C(1e-8) * s->events->speed[i];
}

/* Whether row i holds, or rests on others that do. */
static int holds_or_rests(const mech_solver *s, int i)
{
    const mech_share_row *shares = s->model->hybrid->shares;
    return mech_row_holds(s, i) || (shares[i].rest >= 0 && s->events->z[shares[i].rest] > MECH_C(0.5));
}

/* Whether what presses and sticks is what did before: then so is what depends on others, but for slides that turn. */
static int goes_on(mech_solver *s, const mech_real *impulse, const mech_real *rate)
{
    mech_event_state *e = s->events;
    if (!s->model->hybrid->shares) return 0;
    for (int i = 0; i < e->n_rows; i++) {
        const mech_row *row = mech_row_of(s, i);
        if (row->kind == MECH_CONTACT && (impulse[i] > 0) != holds_or_rests(s, i)) return 0;
        if (row->kind != MECH_FRICTION || is_partner(s, i)) continue;
        const int j = mech_row_partner(s, i);
        if (lies_within(s, i, impulse, rate) != (holds_or_rests(s, i) || (j >= 0 && holds_or_rests(s, j)))) return 0;
    }
    for (int i = 0; i < e->n_rows; i++) {
        const mech_row *row = mech_row_of(s, i);
        const int j = mech_row_partner(s, i);
        if (row->kind != MECH_FRICTION || is_partner(s, i) || lies_within(s, i, impulse, rate)) continue;
        if (row->normal < 0 || impulse[row->normal] > 0) slide(s, i, rate[i], j < 0 ? 0 : rate[j]);
    }
    return 1;
}

void mech_contact_modes_tell(mech_solver *s, const mech_real *impulse, const mech_real *rate)
{
    mech_event_state *e = s->events;
    long long *beside = &s->run->report.indeterminate;
    for (int i = 0; i < e->n_rows; i++) mech_widen(e->speed + i, rate[i]);
    if (goes_on(s, impulse, rate)) return;
    *beside = 0;
    const mech_share_row *shares = s->model->hybrid->shares;
    mech_near_rows_basis held;
    int n = 0;
    held.n = 0;
    mech_rows_read(s);
    mech_rows_find_response(s);
    for (int i = 0; i < e->n_rows; i++)
        if (e->rows[i].kind == MECH_BILATERAL && mech_row_holds(s, i) && independent(s, &held, n, i)) n++;
    for (int i = 0; i < e->n_rows; i++) {
        if (e->rows[i].kind != MECH_CONTACT) continue;
        const int presses = impulse[i] > 0, holds = presses && independent(s, &held, n, i);
        n += holds;
        set(s, i, holds, 0);
        *beside += presses && !holds;
        if (shares && shares[i].rest >= 0) e->z[shares[i].rest] = presses && !holds;
    }
    for (int i = 0; i < e->n_rows; i++) {
        const mech_row *row = mech_row_of(s, i);
        if (row->kind != MECH_FRICTION || is_partner(s, i)) continue;
        const int j = mech_row_partner(s, i), sticks_ = lies_within(s, i, impulse, rate);
        const int pressed = row->normal < 0 || impulse[row->normal] > 0;
        for (int k = i; k <= (j < 0 ? i : j); k++) {
            const int holds = sticks_ && independent(s, &held, n, k);
            n += holds;
            set(s, k, holds, 0);
            *beside += sticks_ && !holds;
            if (shares && shares[k].rest >= 0) e->z[shares[k].rest] = sticks_ && !holds;
        }
        if (pressed && !sticks_) slide(s, i, rate[i], j < 0 ? 0 : rate[j]);
    }
}
