/* The table of methods. */
#include <string.h>

#include "method.h"

const mech_method *const mech_methods[] = {
    &mech_dop853, &mech_rk4,    &mech_radau5, &mech_gauss2,
    &mech_gauss4, &mech_gauss6, &mech_gauss8, &mech_verlet, &mech_auto,
    &mech_rattle, &mech_lobatto4, &mech_lobatto6, &mech_taylor, &mech_moreau,
};
const int mech_n_methods = sizeof mech_methods / sizeof mech_methods[0];

int mech_method_count(void) { return mech_n_methods; }

int mech_method_index(const char *name)
{
    for (int i = 0; i < mech_n_methods; i++)
        if (!strcmp(mech_methods[i]->name, name)) return i;
    return -1;
}

const char *mech_method_name(int method) { return mech_methods[method]->name; }
const char *mech_method_doc(int method) { return mech_methods[method]->doc; }
int mech_method_is_adaptive(int method) { return mech_methods[method]->adaptive; }
int mech_method_order(int method) { return mech_methods[method]->order; }
int mech_method_n_dense(int method) { return mech_methods[method]->n_dense; }

int mech_method_lacks(int method, const mech_model *model)
{
    const mech_method *m = mech_methods[method];
    if (!m->impulses && model->hybrid && model->hybrid->crowd && model->hybrid->crowd->stepped) return MECH_NEEDS_STEPS;
    return m->lacks ? m->lacks(model) : MECH_RUNNING;
}
