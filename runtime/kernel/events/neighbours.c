/* E. Cuthill, J. McKee 1969, backwards: by distance from one that is far from others. */
#include "neighbours.h"

#include <stdlib.h>
#include <string.h>

#include "crowd.h"

/* Contacts and the groups of velocities that they act on: lists by group of the contacts there, as chains of links. */
typedef struct net {
    const mech_crowd *c;
    const int *contacts;
    int *head, *next, *who; /* [nv] the first link of a group; of links the next one, its contact */
    int *queue, *seen;      /* [n] */
} net;

static mech_crowd_who velocities(const net *g, int k, int *count)
{
    const mech_crowd_who who = mech_crowd_who_of(g->c, g->contacts[k]);
    *count = who.kind->n_normal + who.kind->n_slip;
    return who;
}

/* Appends all that `start` reaches to the queue from `n` on, by distance; gives its new length. */
static int spread(net *g, int n, int start, int mark)
{
    g->queue[n] = start;
    g->seen[start] = mark;
    for (int read = n++; read < n; read++) {
        int count;
        const mech_crowd_who who = velocities(g, g->queue[read], &count);
        for (int i = 0; i < count; i++)
            for (int link = g->head[g->c->group[mech_crowd_velocity(g->c, &who, i)]]; link >= 0; link = g->next[link]) {
                const int k = g->who[link];
                if (g->seen[k] == mark) continue;
                g->seen[k] = mark;
                g->queue[n++] = k;
            }
    }
    return n;
}

/* Forms the net of n contacts, in memory that its owner frees at `head`; 0 where there is none. */
static int form(const mech_solver *s, int n, const int *contacts, net *g)
{
    const size_t nv = (size_t)s->model->nv, size = (size_t)n;
    *g = (net){.c = s->model->hybrid->crowd, .contacts = contacts};
    int links = 0, count;
    for (int k = 0; k < n; k++) {
        velocities(g, k, &count);
        links += count;
    }
    g->head = (int *)malloc((nv + 2 * (size_t)links + 3 * size) * sizeof(int));
    if (!g->head) return 0;
    g->next = g->head + nv;
    g->who = g->next + links;
    g->queue = g->who + links;
    g->seen = g->queue + n;
    for (size_t i = 0; i < nv; i++) g->head[i] = -1;
    links = 0;
    for (int k = 0; k < n; k++) {
        const mech_crowd_who who = velocities(g, k, &count);
        g->seen[k] = 0;
        for (int i = 0; i < count; i++) {
            const int group = g->c->group[mech_crowd_velocity(g->c, &who, i)];
            if (g->head[group] >= 0 && g->who[g->head[group]] == k) continue;
            g->who[links] = k;
            g->next[links] = g->head[group];
            g->head[group] = links++;
        }
    }
    return 1;
}

void mech_neighbours_order(const mech_solver *s, int n, int *contacts)
{
    net g;
    if (!form(s, n, contacts, &g)) return;
    for (int k = 0, done = 0; k < n; k++) {
        if (g.seen[k]) continue;
        const int last = g.queue[spread(&g, done, k, 1) - 1]; /* far from where it began */
        done = spread(&g, done, last, 2);
    }
    int *ordered = g.seen + n;
    for (int k = 0; k < n; k++) ordered[n - 1 - k] = contacts[g.queue[k]];
    memcpy(contacts, ordered, (size_t)n * sizeof(int));
    free(g.head);
}

int mech_neighbours_reached(const mech_solver *s, int n, int *contacts, const int *begins)
{
    net g;
    int reached = 0;
    if (!form(s, n, contacts, &g)) return n;
    for (int k = 0; k < n; k++)
        if (begins[k] && !g.seen[k]) spread(&g, 0, k, 1);
    for (int k = 0; k < n; k++)
        if (g.seen[k]) contacts[reached++] = contacts[k];
    free(g.head);
    return reached;
}
