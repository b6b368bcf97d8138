#if !defined(_WIN32)
#define _POSIX_C_SOURCE 200809L
#endif

#include "threads.h"

enum { MOST_THREADS = 1024 };

long mech_count(volatile long *number) { return __atomic_fetch_add(number, 1, __ATOMIC_RELAXED); }

typedef struct task {
    void (*work)(void *);
    void *shared;
} task;

#if defined(_WIN32)
#include <windows.h>

static DWORD WINAPI begin(void *given)
{
    const task *t = given;
    t->work(t->shared);
    return 0;
}

void mech_together(void (*work)(void *), void *shared, int n)
{
    HANDLE threads[MOST_THREADS];
    task t = {work, shared};
    int begun = 0;
    for (; begun + 1 < n && begun < MOST_THREADS; begun++)
        if (!(threads[begun] = CreateThread(NULL, 0, begin, &t, 0, NULL))) break;
    work(shared);
    for (int i = 0; i < begun; i++) {
        WaitForSingleObject(threads[i], INFINITE);
        CloseHandle(threads[i]);
    }
}
#else
#include <pthread.h>

static void *begin(void *given)
{
    const task *t = given;
    t->work(t->shared);
    return 0;
}

void mech_together(void (*work)(void *), void *shared, int n)
{
    pthread_t threads[MOST_THREADS];
    task t = {work, shared};
    int begun = 0;
    for (; begun + 1 < n && begun < MOST_THREADS; begun++)
        if (pthread_create(&threads[begun], 0, begin, &t)) break;
    work(shared);
    for (int i = 0; i < begun; i++) pthread_join(threads[i], 0);
}
#endif
