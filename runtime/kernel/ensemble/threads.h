/* Threads that do one work together, on POSIX and on Windows. Internal to the ensemble. */
#ifndef MECH_THREADS_H
#define MECH_THREADS_H

struct mech_ensemble;

/* What the threads of a call share. */
typedef struct mech_crew {
    const struct mech_ensemble *e;
    volatile long next, troubles;
} mech_crew;

/* Gives a number and counts it up, one thread at a time. */
long mech_count(volatile long *number);

/* Calls work(shared) from n threads, this one among them; fewer where no more can be begun. Returns when all have ended. */
void mech_together(void (*work)(void *), void *shared, int n);

#endif
