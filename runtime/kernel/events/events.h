/* What the solver needs of events, so that models without them do without. Internal to the kernel. */
#ifndef MECH_EVENTS_H
#define MECH_EVENTS_H

#include "event_state.h"

typedef struct mech_event_support {
    size_t (*numbers)(const mech_model *model);
    void (*attach)(mech_event_state *e, const mech_model *model, mech_real *memory);
    int (*advance)(mech_solver *s, mech_real t_end, long max_steps);

    /* Of models with delays (history.h). */
    struct mech_history *(*new_history)(const mech_model *model, int n_dense, int order);
    void (*free_history)(struct mech_history *h);
    void (*look_back)(mech_solver *s, mech_real t);
    size_t (*history_size)(const mech_solver *s);
    void (*save_history)(const mech_solver *s, char *memory);
    void (*load_history)(mech_solver *s, const char *memory);
} mech_event_support;

/* NULL where models with events are left out. */
extern const mech_event_support *const mech_events;

#endif
