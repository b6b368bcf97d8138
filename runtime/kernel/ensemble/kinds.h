/* What is kept of a member, by kind. */
#ifndef MECH_KINDS_H
#define MECH_KINDS_H

enum mech_kept_kind { MECH_FINAL = 0, MECH_LARGEST, MECH_LEAST, MECH_MEAN, MECH_FIRST, MECH_EVENT_COUNT };

#endif
