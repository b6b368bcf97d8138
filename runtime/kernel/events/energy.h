/* The accounts of energy at an instant. Internal to the kernel. */
#ifndef MECH_ENERGY_H
#define MECH_ENERGY_H

#include "run.h"

/* The energy whose balance is kept; 0 where there is none. */
mech_real mech_energy_total(mech_solver *s);
/* Books a change of the total energy. */
void mech_energy_book(mech_solver *s, mech_real gain);
/* Whether the model has accounts. */
int mech_energy_booked(const mech_solver *s);
/* Books what the total energy changed by since it was `before`, unless that is rounding. */
void mech_energy_book_beyond_rounding(mech_solver *s, mech_real before);
/* Books what a law brings in that changes at this instant, and with it the energy of a state that stays. */
void mech_energy_supply(mech_solver *s, mech_real before);

#endif
