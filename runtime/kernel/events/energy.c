#include "energy.h"

#include <string.h>

#include "event_state.h"

mech_real mech_energy_total(mech_solver *s)
{
    const mech_hybrid *h = s->model->hybrid;
    if (h->total < 0) return 0;
    mech_surroundings(s, s->run->report.t);
    s->model->outputs(s->run->report.t, s->y, s->u, s->o.z, s->o.p, s->events->outputs);
    mech_real total = s->events->outputs[h->total];
    return total;
}

void mech_energy_book(mech_solver *s, mech_real gain)
{
    const mech_hybrid *h = s->model->hybrid;
    if (h->supplied >= 0 && (gain > 0 || h->dissipated < 0))
        s->y[h->supplied] += gain;
    else if (h->dissipated >= 0)
        s->y[h->dissipated] -= gain;
}

int mech_energy_booked(const mech_solver *s)
{
    return s->model->hybrid->supplied >= 0 || s->model->hybrid->dissipated >= 0;
}

/* What the energy changed by since it was `before`, or zero where that is rounding. */
static mech_real change(mech_solver *s, mech_real before)
{
    const mech_real after = mech_energy_total(s), gain = after - before;
    return mech_abs(gain) > MECH_C(1e-12) * (mech_abs(before) + mech_abs(after)) ? gain : 0;
}

void mech_energy_book_beyond_rounding(mech_solver *s, mech_real before)
{
    mech_energy_book(s, change(s, before));
}

void mech_energy_supply(mech_solver *s, mech_real before)
{
    const int account = s->model->hybrid->supplied;
    if (account >= 0) s->y[account] += change(s, before);
}
