/* What the kernel and the code of models take of <time.h>, for the compiler that comes with mechc: no header of the system is needed. */
struct timespec {
    long tv_sec, tv_nsec;
};
int clock_gettime(int, struct timespec *);
#define CLOCK_MONOTONIC 1
