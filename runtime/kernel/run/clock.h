/* Seconds of a steady clock. Internal to the kernel. */
#ifndef MECH_CLOCK_H
#define MECH_CLOCK_H

double mech_clock(void);

#endif
