/* Where a piece begins: the rows of the tables, the derivative, the assertions. */
#include "pieces.h"

#include "method.h"

int mech_piece_check(mech_solver *s)
{
    const int n = s->model->n_assertions;
    const mech_real t = s->run->report.t;
    if (!n) return MECH_RUNNING;
    mech_surroundings(s, t);
    s->model->assertions(t, s->y, s->u, s->o.z, s->o.p, s->checks);
    for (int i = 0; i < n; i++)
        if (!(s->checks[i] > MECH_C(0.5))) return mech_fail(s, MECH_ASSERTION, i);
    return MECH_RUNNING;
}

/* Puts the tables on the pieces that begin at the present time; the derivative may jump there. */
int mech_piece_enter(mech_solver *s)
{
    const mech_real t = s->run->from = s->run->report.t;
    for (int k = 0; k < s->o.n_tables; k++) s->segments[k] = mech_segment(&s->o.tables[k], t);
    while (s->run->next_stop < s->o.n_stops && s->o.stops[s->run->next_stop] <= t) s->run->next_stop++;
    mech_rhs(s, t, s->y, s->dy);
    if (s->method->begin) s->method->begin(s, !s->run->started);
    return mech_fail_not_finite(s, s->dy, s->ny);
}
