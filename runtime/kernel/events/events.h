/* What the solver needs of events, so that models without them do without. Internal to the kernel. */
#ifndef MECH_EVENTS_H
#define MECH_EVENTS_H

#include "event_state.h"

typedef struct mech_event_support {
    size_t (*numbers)(const mech_model *model);
    void (*attach)(mech_event_state *e, const mech_model *model, mech_real *memory);
    int (*advance)(mech_solver *s, mech_real t_end, long max_steps);
} mech_event_support;

/* NULL where models with events are left out. */
extern const mech_event_support *const mech_events;

#endif
