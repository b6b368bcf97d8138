/* Calls of model functions from Python in the least time: arrays are taken and made here, not by ctypes.
 *
 * A call is the record below; Python keeps it in a bytes object, the first entry of the tuple that a built-in function has
 * for its self. Of Python and NumPy nothing is included or linked: the few functions of their stable interfaces that are
 * used arrive as pointers. What is not a plain call (lists, other kinds of numbers, strided arrays, wrong sizes) is left
 * to the second entry of the tuple, a function of Python that does the same slowly. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef struct object object; /* PyObject */
typedef ptrdiff_t size;       /* Py_ssize_t, npy_intp */

typedef struct { /* Py_buffer, stable since Python 3.11 */
    void *buf;
    object *obj;
    size len, itemsize;
    int readonly, ndim;
    char *format;
    size *shape, *strides, *suboffsets;
    void *internal;
} view;

enum { FORMAT_CONTIGUOUS = 0x0004 | 0x0008 | 0x0010 | 0x0020 /* PyBUF_FORMAT | PyBUF_C_CONTIGUOUS */ };
enum { NPY_DOUBLE = 12, MOST_DIMENSIONS = 3, MOST_PARTS = 2, SMALL = 64 };

typedef struct {
    int (*get_buffer)(object *, view *, int);
    void (*release_buffer)(view *);
    void (*clear_error)(void);
    double (*as_double)(object *);
    object *(*error)(void);
    object *(*from_double)(double);
    object *(*call)(object *, object *const *, size_t, object *);
    object *(*item)(object *, size);
    char *(*bytes)(object *);
    void *(*save_thread)(void);
    void (*restore_thread)(void *);
    object *(*new_array)(void *, int, const size *, int, const size *, void *, int, int, object *);
    void *array_type;
} interface;

static interface py;

typedef struct {
    void *definition[4]; /* PyMethodDef */
    mech_function *parts[MOST_PARTS];
    size begins[MOST_PARTS]; /* where each part writes its results */
    size n_out, ny, na, nu, nz;
    size dimensions, shape[MOST_DIMENSIONS];
    const double *z, *p;
    double begin;
    mech_function *inputs;         /* values of u where none are given; NULL: nu = 0                */
    mech_function *indicators;     /* of relations, which are settled at the state; NULL: there are none */
    const int *switches;
    size n_switches, n_indicators;
} call_record;

EXPORT void mech_calls_begin(const interface *given);
EXPORT object *mech_call_any(object *self, object *const *arguments, size count);
EXPORT object *mech_call_bound(object *self, object *const *arguments, size count);
EXPORT object *mech_call_task(object *self, object *const *arguments, size count);

void mech_calls_begin(const interface *given)
{
    py = *given;
}

static const call_record *record_of(object *self)
{
    return (const call_record *)(const void *)py.bytes(py.item(self, 0));
}

static object *slowly(object *self, object *const *arguments, size count)
{
    return py.call(py.item(self, 1), arguments, (size_t)count, NULL);
}

/* Numbers of type double in one piece, or nothing. */
static int numbers(object *from, view *taken)
{
    if (py.get_buffer(from, taken, FORMAT_CONTIGUOUS) != 0) {
        py.clear_error();
        return 0;
    }
    if (taken->itemsize == (size)sizeof(double) && taken->format && taken->format[0] == 'd' && !taken->format[1])
        return 1;
    py.release_buffer(taken);
    return 0;
}

static object *array(size dimensions, const size *shape, double **values)
{
    object *made = py.new_array(py.array_type, (int)dimensions, shape, NPY_DOUBLE, NULL, NULL, 0, 0, NULL);
    view taken;
    if (!made)
        return NULL;
    if (py.get_buffer(made, &taken, FORMAT_CONTIGUOUS) != 0)
        return NULL;
    *values = taken.buf;
    py.release_buffer(&taken); /* the array keeps its place as long as it lives */
    return made;
}

/* (t, y, u, z, p) -> out */
object *mech_call_any(object *self, object *const *arguments, size count)
{
    const call_record *call = record_of(self);
    view taken[4];
    double t, *out;
    object *made;
    int n = 0;
    if (count != 5)
        return slowly(self, arguments, count);
    t = py.as_double(arguments[0]);
    if (t == -1.0 && py.error()) {
        py.clear_error();
        return slowly(self, arguments, count);
    }
    while (n < 4 && numbers(arguments[1 + n], &taken[n]))
        n++;
    if (n < 4) {
        while (n > 0)
            py.release_buffer(&taken[--n]);
        return slowly(self, arguments, count);
    }
    made = array(1, &call->n_out, &out);
    if (made)
        call->parts[0](t, taken[0].buf, taken[1].buf, taken[2].buf, taken[3].buf, out);
    while (n > 0)
        py.release_buffer(&taken[--n]);
    return made;
}

/* ---- functions of a model with its values: (y[, a][, t[, u]]) */

typedef struct {
    const double *y, *a, *t, *u; /* t, u: NULL where they are not given */
    size dy, da, dt, du;         /* from one state to the next          */
} states;

/* Discrete variables with the relations as they are at a state; they may stand in each other's formulas. */
static void settle(const call_record *call, double t, const double *y, const double *u, double *z, double *g)
{
    for (size round = 0; round <= call->n_switches; round++) {
        int changed = 0;
        call->indicators(t, y, u, z, call->p, g);
        for (size k = 0; k < call->n_switches; k++) {
            double holds = g[k] < 0.0;
            if (z[call->switches[k]] != holds) {
                z[call->switches[k]] = holds;
                changed = 1;
            }
        }
        if (!changed)
            return;
    }
}

static int evaluate(const call_record *call, const states *given, size n, double *out)
{
    size needed = call->nu + call->nz + call->na + call->n_indicators;
    double small[SMALL], *room = small;
    if (needed > SMALL && !(room = malloc((size_t)needed * sizeof(double))))
        return 0;
    double *defaults = room, *z = room + call->nu, *g = z + call->nz + call->na;
    const double *zs = call->z;
    if (call->na || call->n_switches) {
        if (call->nz)
            memcpy(z, call->z, (size_t)call->nz * sizeof(double));
        zs = z;
    }
    for (size i = 0; i < n; i++) {
        const double *y = given->y + i * given->dy, *u = defaults;
        double t = given->t ? given->t[i * given->dt] : call->begin;
        if (given->u)
            u = given->u + i * given->du;
        else if (call->nu)
            call->inputs(t, y, NULL, call->z, call->p, defaults);
        if (call->n_switches)
            settle(call, t, y, u, z, g);
        if (call->na)
            memcpy(z + call->nz, given->a + i * given->da, (size_t)call->na * sizeof(double));
        for (int k = 0; k < MOST_PARTS && call->parts[k]; k++)
            call->parts[k](t, y, u, zs, call->p, out + i * call->n_out + call->begins[k]);
    }
    if (room != small)
        free(room);
    return 1;
}

/* Whether a block holds what belongs to n states (or, where it may, to all of them alike), and the way between two. */
static int fits(const view *block, size n, int many, size width, int alike, size *way)
{
    size last = block->ndim ? block->shape[block->ndim - 1] : 0;
    if (many && block->ndim == 2 && block->shape[0] == n && last == width) {
        *way = width;
        return 1;
    }
    *way = 0;
    return block->ndim == 1 && last == width && (!many || alike);
}

object *mech_call_bound(object *self, object *const *arguments, size count)
{
    const call_record *call = record_of(self);
    size first = call->na ? 2 : 1, n = 1, shape[MOST_DIMENSIONS + 1];
    states given = {NULL, NULL, NULL, NULL, 0, 0, 0, 0};
    view taken[4];
    double at = 0.0, single[1], *out;
    object *made = NULL;
    int many = 0, ok, held = 0, failed = 0;
    if (count < first || count > first + 2)
        return slowly(self, arguments, count);
    if (!numbers(arguments[0], &taken[held]))
        return slowly(self, arguments, count);
    many = taken[0].ndim == 2;
    n = many ? taken[0].shape[0] : 1;
    given.y = taken[0].buf;
    held++;
    ok = fits(&taken[0], n, many, call->ny, 0, &given.dy);
    if (ok && call->na) {
        ok = numbers(arguments[1], &taken[held]);
        if (ok) {
            given.a = taken[held].buf;
            ok = fits(&taken[held++], n, many, call->na, 0, &given.da);
        }
    }
    if (ok && count > first) {
        at = py.as_double(arguments[first]);
        if (at == -1.0 && py.error()) { /* an array of times: rare */
            py.clear_error();
            ok = 0;
        }
        given.t = &at;
    }
    if (ok && count > first + 1) {
        ok = numbers(arguments[first + 1], &taken[held]);
        if (ok) {
            given.u = taken[held].buf;
            ok = fits(&taken[held++], n, many, call->nu, 1, &given.du);
        }
    }
    if (ok && !many && !call->dimensions) {
        ok = evaluate(call, &given, 1, single);
        made = ok ? py.from_double(single[0]) : NULL;
    } else if (ok) {
        shape[0] = n;
        for (size k = 0; k < call->dimensions; k++)
            shape[1 + k] = call->shape[k];
        made = array(call->dimensions + many, shape + !many, &out);
        failed = !made;
        if (made && many) {
            void *thread = py.save_thread();
            ok = evaluate(call, &given, n, out);
            py.restore_thread(thread);
        } else if (made)
            ok = evaluate(call, &given, 1, out);
    }
    while (held > 0)
        py.release_buffer(&taken[--held]);
    return failed || (made && ok) ? made : slowly(self, arguments, count);
}

/* The same for arrays that are known to fit, for whoever has no built-in function: times [n] with a way of dt. */
EXPORT int mech_call_rows(const void *record, size n, const double *y, size dy, const double *a, size da,
                          const double *t, size dt, const double *u, size du, double *out);

int mech_call_rows(const void *record, size n, const double *y, size dy, const double *a, size da, const double *t,
                   size dt, const double *u, size du, double *out)
{
    const states given = {y, a, t, u, dy, da, dt, du};
    return evaluate(record, &given, n, out);
}

typedef struct {
    void *definition[4]; /* PyMethodDef */
    long (*task)(void *);
    void *of;
} task_record;

/* () -> number, while other threads of Python go on */
object *mech_call_task(object *self, object *const *arguments, size count)
{
    const task_record *call = (const task_record *)(const void *)py.bytes(py.item(self, 0));
    void *thread;
    long found;
    if (count)
        return slowly(self, arguments, count);
    thread = py.save_thread();
    found = call->task(call->of);
    py.restore_thread(thread);
    return py.from_double((double)found);
}
