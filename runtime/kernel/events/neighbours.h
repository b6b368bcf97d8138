/* Contacts of a crowd in an order in which those that move each other stand close together. Internal to the kernel. */
#ifndef MECH_NEIGHBOURS_H
#define MECH_NEIGHBOURS_H

#include "event_state.h"

/* Orders the n contacts; without memory they stay as they are. */
void mech_neighbours_order(const mech_solver *s, int n, int *contacts);
/* Keeps those that impulses along them may reach where something `begins`, by others of them; gives how many. */
int mech_neighbours_reached(const mech_solver *s, int n, int *contacts, const int *begins);

#endif
