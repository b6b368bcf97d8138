/* How a run fails. */
#include "run.h"

int mech_fail(mech_solver *s, int status, int index)
{
    s->run->report.failed_index = index;
    return s->run->report.status = status;
}

int mech_fail_not_finite(mech_solver *s, const mech_real *first, int n_first)
{
    for (int i = 0; i < n_first; i++)
        if (!mech_finite(first[i])) {
            s->run->report.failed_value = first[i];
            return mech_fail(s, MECH_NOT_FINITE, i % s->ny);
        }
    return MECH_RUNNING;
}

int mech_fail_to_settle(mech_solver *s, int status, int index)
{
    mech_real largest = 1;
    for (int i = 0; i < s->ny - s->model->n_accounts; i++) {
        const mech_real way = mech_abs(s->dy[i]) * 1000 * MECH_EPSILON * mech_abs(s->run->report.t);
        const mech_real sizes = way / (mech_nominal(s, i) + mech_abs(s->y[i]));
        if (!(sizes > largest)) continue;
        largest = sizes;
        status = MECH_STEP_TOO_SMALL;
        index = i;
    }
    if (status == MECH_STEP_TOO_SMALL) s->run->report.failed_value = s->dy[index];
    return mech_fail(s, status, index);
}
