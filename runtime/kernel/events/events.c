/* Whether models with events can be run: the only reference to the files that this takes. */
#include "hybrid.h"

const mech_event_support mech_events_of_models = {mech_modes_numbers, mech_modes_attach, mech_advance_hybrid};
const mech_event_support *const mech_events = &mech_events_of_models;
