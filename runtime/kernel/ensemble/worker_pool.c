/* The threads of an ensemble, which take the next member each, or several side by side. */
#include <stdlib.h>

#include "member.h"
#include "threads.h"

void mech_ensemble_layout(size_t sizes[7])
{
    sizes[0] = sizeof(mech_place);
    sizes[1] = sizeof(mech_kept);
    sizes[2] = sizeof(mech_member);
    sizes[3] = sizeof(mech_companion);
    sizes[4] = sizeof(mech_ensemble);
    sizes[5] = sizeof(mech_sizes);
    sizes[6] = sizeof(mech_quantity);
}

static void make_all(void *shared)
{
    mech_crew *crew = shared;
    const mech_ensemble *e = crew->e;
    mech_room r;
    char *block = calloc(1, mech_room_bytes(e));
    if (!block) {
        mech_count(&crew->troubles);
        return;
    }
    mech_room_in(&r, e, block);
    while (!*e->stopped) {
        const long k = mech_count(&crew->next);
        if (k >= e->n) break;
        if (e->members[k].stage != MECH_MEMBER_WAITS) continue;
        mech_member told;
        mech_member_waits(e, k, &told);
        told.stage = mech_member_make(&r, k, &told);
        e->members[k] = told;
        if (told.stage != MECH_MEMBER_WAITS) mech_count(e->done);
    }
    free(block);
}

int mech_ensemble_run(const mech_ensemble *e)
{
    mech_crew crew = {.e = e, .next = 0, .troubles = 0};
    mech_together(e->lanes && e->stop > e->options->t0 ? mech_members_in_lanes : make_all, &crew, e->threads);
    return crew.troubles > 0;
}
