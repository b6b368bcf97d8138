/* Impulses at one instant. Internal to the kernel. */
#ifndef MECH_IMPACTS_H
#define MECH_IMPACTS_H

#include "run.h"

/* Impacts until nothing approaches; adds their number to *count. */
int mech_impacts_resolve(mech_solver *s, int *count);
/* A switch across which an energy jumps: an impulse along its gradient keeps the total energy; where that is too
   little to pass, the motion is thrown back. */
int mech_impacts_pass_step(mech_solver *s, int hit, int *passed);

#endif
