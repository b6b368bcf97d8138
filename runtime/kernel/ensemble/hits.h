/* Looks at the stiffness of steps, counted as stepping/step.c does: what is stiff again and again. */
#ifndef MECH_HITS_H
#define MECH_HITS_H

enum { STIFF_HITS = 15, CALM_HITS = 6 };

typedef struct mech_hits {
    int stiff, calm;
    mech_real since;    /* where it was first told to be stiff, else not-a-number */
} mech_hits;

#define MECH_NO_HITS ((mech_hits){0, 0, (mech_real)NAN})

/* Counts a look at the step that began at t; gives the number of steps at which the next one is due. */
static inline mech_real mech_hit(mech_hits *h, int stiff, mech_real t, mech_real steps, mech_real every)
{
    if (stiff) {
        h->calm = 0;
        if (++h->stiff == STIFF_HITS && !(h->since == h->since)) h->since = t;
    } else if (h->stiff && ++h->calm == CALM_HITS) {
        h->stiff = h->calm = 0;
    }
    return h->stiff ? steps + 1 : (mech_floor(steps / every) + 1) * every;
}

#endif
