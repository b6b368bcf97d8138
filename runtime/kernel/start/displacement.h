/* States moved in the space of velocities, and how far they are from a guess. Internal to the kernel. */
#ifndef MECH_DISPLACEMENT_H
#define MECH_DISPLACEMENT_H

#include "real.h"

/* Moves the coordinates of y along d[nv], rotations about their body axes. */
void mech_displace(const mech_model *model, mech_real *y, const mech_real *d);

/* out[nv]: how far each coordinate is from its guess; for a rotation the rotation vector from it. */
void mech_deviation(const mech_model *model, const mech_real *y, const mech_real *guess, mech_real *out);

/* The geometric mean of the parameters that are lengths, else 1. */
mech_real mech_characteristic_length(const mech_model *model, const mech_real *p);

#endif
