/* States taken to the constraints on the way. */
#include "instance.h"
#include "projection.h"

mech_real fmu_off_unit(const fmu *f)
{
    mech_real largest = 0;
    for (int k = 0; k < f->m->n_rotations; k++) {
        const mech_real *e = f->y + f->m->rotations[k];
        const mech_real off = e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3] - 1;
        largest = mech_max(largest, mech_abs(off));
    }
    return largest;
}

int fmu_project(fmu *f)
{
    mech_normalise(f->m, f->y);
    return f->m->n_velocity ? mech_project(f->s, f->st->t, f->y) : MECH_RUNNING;
}
