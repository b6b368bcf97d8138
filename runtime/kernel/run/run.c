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
