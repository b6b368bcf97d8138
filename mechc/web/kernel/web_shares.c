/* Shares of loads that rigid bodies do not determine (shares.h), for functions of models that are added later. */
#include "shares.h"
#include "web_plan.h"

void EXPORT(with_shares)(mech_function *reads, int n_out, mech_real t, const mech_real *y, const mech_real *u, const mech_real *z,
                         const mech_real *p, mech_real *out)
{
    mech_shares_call(web_slot->model, reads, n_out, t, y, u, z, p, out);
}
