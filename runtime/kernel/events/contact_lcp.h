/* What presses in a crowd without friction at hand. Internal to the kernel. */
#ifndef MECH_CONTACT_LCP_H
#define MECH_CONTACT_LCP_H

#include "event_state.h"

/* Sets the flags of contacts that press, of rows and responses that have been read; `ends`: one that was located where its
 * force ends, or -1. Contacts that rise slower than they rest and would fall back are laid down. MECH_NO_MODE where it fails. */
int mech_contact_lcp_choose(mech_solver *s, int ends);

#endif
