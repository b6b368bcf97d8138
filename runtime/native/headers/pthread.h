/* What the kernel and the code of models take of <pthread.h>, for the compiler that comes with mechc: no header of the system is needed. */
typedef unsigned long pthread_t;
int pthread_create(pthread_t *, const void *, void *(*)(void *), void *);
int pthread_join(pthread_t, void **);
