/* Unit length of the rotations in a state (model.h, point 12). */
#include "solver.h"

void mech_normalise(const mech_model *model, mech_real *y)
{
    for (int k = 0; k < model->n_rotations; k++) {
        mech_real *e = y + model->rotations[k];
        mech_real factor = 1 / mech_sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3]);
        for (int i = 0; i < 4; i++) e[i] *= factor;
    }
}
