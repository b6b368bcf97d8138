/* The method of choice: explicit as long as that is not stiff, then implicit where the model has a Jacobian,
 * and back when that has been calm for long. The changes are made by stepping/step.c.
 *
 * L. Petzold, Automatic selection of methods for solving stiff and nonstiff systems of ordinary differential
 * equations, SIAM J. Sci. Stat. Comput. 4, 1983.
 */
#include "method.h"

const mech_method mech_auto = {
    .name = "auto",
    .doc = "dop853, and radau5 while the model is stiff",
    .order = 8,
    .adaptive = 1,
    .n_dense = 8,
    .explicit_part = &mech_dop853,
    .implicit_part = &mech_radau5,
};
