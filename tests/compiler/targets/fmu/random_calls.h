/* What random sequences of calls share: numbers, and a logger that wants reasons. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { RUNS = 300, CALLS = 60, WIDE = 400, REFERENCES = 90 };

static uint64_t random_state = 88172645463325252u;

static unsigned draw(unsigned n)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return (unsigned)(random_state >> 33) % n;
}

static int told, complaints;

/* 0 is OK, 2 Discard: a message is not a warning. */
static void hear(int status, const char *category, const char *message)
{
    if (status == 1 || !category || !message || !*message) exit(3);
    told++;
    complaints += status > 1;
}
