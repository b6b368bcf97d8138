/* Forces of contacts that are a crowd (crowd.h), for models that are added later: rhs and outputs with all of them. */
#include "crowd.h"
#include "web_plan.h"

void EXPORT(rhs_of_all)(mech_real t, const mech_real *y, const mech_real *u, const mech_real *z, const mech_real *p, mech_real *out)
{
    mech_crowd_rates(web_slot->model, t, y, u, z, p, out);
}

void EXPORT(outputs_of_all)(mech_real t, const mech_real *y, const mech_real *u, const mech_real *z, const mech_real *p,
                            mech_real *out)
{
    mech_crowd_outputs(web_slot->model, t, y, u, z, p, out);
}
