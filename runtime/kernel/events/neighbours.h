/* Contacts of a crowd in an order in which those that move each other stand close together. Internal to the kernel. */
#ifndef MECH_NEIGHBOURS_H
#define MECH_NEIGHBOURS_H

#include "event_state.h"

/* Orders the n contacts; without memory they stay as they are. */
void mech_neighbours_order(const mech_solver *s, int n, int *contacts);

#endif
