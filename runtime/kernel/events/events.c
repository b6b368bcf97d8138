/* Whether models with events can be run: the only reference to the files that this takes. */
#include "events.h"

#include "history.h"
#include "hybrid.h"

const mech_event_support mech_events_of_models = {mech_event_state_numbers, mech_event_state_attach,
                                                  mech_hybrid_advance,     mech_history_new,
                                                  mech_history_free,       mech_history_look,
                                                  mech_history_size,       mech_history_save,
                                                  mech_history_load};
const mech_event_support *const mech_events = &mech_events_of_models;
