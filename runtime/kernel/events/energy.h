/* The accounts of energy at an instant. Internal to the kernel. */
#ifndef MECH_ENERGY_H
#define MECH_ENERGY_H

#include "run.h"

/* The energy whose balance is kept; 0 where there is none. */
mech_real mech_energy_total(mech_solver *s);
/* Books a change of the total energy. */
void mech_energy_book(mech_solver *s, mech_real gain);
/* Books what a law brings in that changes at this instant, and with it the energy of a state that stays. */
void mech_energy_supply(mech_solver *s, mech_real before);

#endif
