/* Where within a step an event is. Internal to the kernel. */
#ifndef MECH_LOCATE_H
#define MECH_LOCATE_H

#include "run.h"

/* Seeks the first one on the attempted step: *hit its indicator or -1, *part where in 0..1, and whether it was *hidden between
 * the samples of the step, whose stages then may not have seen what leads there either. Fails with MECH_CHATTER where an
 * indicator changes sign too often to be followed. */
int mech_locate(mech_solver *s, mech_real h, int *hit, mech_real *part, int *hidden);

#endif
