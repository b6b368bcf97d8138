/* Runs the kernel in the precision of the build, with double numbers outside: every number is a pair hi + lo. */
#include <stdlib.h>
#include <string.h>

#include "solver.h"

enum { MOST_TABLES = 4, MOST_TIMES = 32 };

/* numbers: t0, t_end, dt, dt_max, rtol. y: [ny] hi, then [ny] lo, in and out. grid_y: [n_grid][ny] hi, then lo.
   report: the fields of mech_report that the tests read. Gives the status of the kernel, -100 where it makes no solver,
   -101 for more tables than there is room for, -200 where a run that was saved and loaded goes on with other bits. */
MECH_API int drive(const mech_model *model, const char *method, const double *numbers, const double *atol,
                   const double *p, double *y, long n_grid, const double *grid, double *grid_y, long slice,
                   int n_tables, const int *table_kinds, const int *table_sizes, const double *table_data,
                   int n_stops, const double *stops, double *report, double *drift)
{
    if (n_tables > MOST_TABLES) return -101;
    for (int k = 0; k < n_tables; k++)
        if (table_sizes[k] > MOST_TIMES) return -101;
    const int ny = model->nq + model->nv + model->nx, np = model->np + model->nh;
    const int n_drift = model->n_position + model->n_velocity;
    const size_t size = sizeof(mech_real);
    mech_real *a = malloc(size * (size_t)(3 * ny + np + n_grid * (ny + 1) + n_stops + n_drift + 1));
    mech_real *y0 = a + ny, *out = y0 + ny, *q = out + ny, *times = q + np, *rows = times + n_grid;
    mech_real *stop_times = rows + n_grid * ny, *drifts = stop_times + n_stops;
    unsigned char *set = malloc((size_t)np + 1);
    mech_table tables[MOST_TABLES];
    mech_real data[MOST_TABLES][2 * MOST_TIMES];
    const double *next = table_data;
    for (int k = 0; k < n_tables; k++) {
        const int n = table_sizes[k];
        for (int i = 0; i < 2 * n; i++) data[k][i] = *next++;
        tables[k] = (mech_table){.input = k, .interpolation = table_kinds[k], .n = n, .t = data[k],
                                 .value = data[k] + n};
    }
    for (int i = 0; i < ny; i++) {
        a[i] = atol[i];
        y0[i] = (mech_real)y[i] + (mech_real)y[ny + i];
    }
    for (int i = 0; i < model->np; i++) q[i] = p[i];
    memset(set, 1, (size_t)np + 1);
    if (model->parameters) model->parameters(q, set);
    for (long i = 0; i < n_grid; i++) times[i] = grid[i];
    for (int i = 0; i < n_stops; i++) stop_times[i] = stops[i];
    mech_options o = {.method = mech_method_index(method), .n_tables = n_tables, .n_stops = n_stops,
                      .n_grid = n_grid, .t0 = numbers[0], .dt = numbers[2], .dt_max = numbers[3],
                      .rtol = numbers[4], .atol = a, .y0 = y0, .p = q, .tables = tables, .stops = stop_times,
                      .grid = times, .grid_y = rows};
    mech_solver *s = mech_create(model, &o);
    if (!s) {
        free(a);
        free(set);
        return -100;
    }
    int status;
    mech_report r;
    void *saved = malloc(mech_save_size(s));
    mech_real *first = malloc(size * (size_t)ny);
    /* The second round begins where the first was saved, after one slice, and ends where the first one did. */
    for (int round = 0; round < 2; round++) {
        if (round) mech_load(s, saved);
        do {
            status = mech_advance(s, (mech_real)numbers[1], slice);
            mech_read(s, &r, out);
            if (!round && r.steps <= slice) mech_save(s, saved);
        } while (status == MECH_RUNNING);
        if (round && memcmp(first, out, size * (size_t)ny)) status = -200;
        memcpy(first, out, size * (size_t)ny);
    }
    free(saved);
    free(first);
    mech_drift(s, drifts);
    for (int i = 0; i < n_drift; i++) drift[i] = (double)drifts[i];
    for (int i = 0; i < ny; i++) {
        y[i] = (double)out[i];
        y[ny + i] = (double)(out[i] - y[i]);
    }
    for (long i = 0; i < r.n_grid * ny; i++) {
        grid_y[i] = (double)rows[i];
        grid_y[n_grid * ny + i] = (double)(rows[i] - grid_y[i]);
    }
    const double fields[] = {(double)r.t, (double)r.dt_min, (double)r.dt_max, (double)r.stiff_time,
                             (double)r.switch_time, (double)r.drift_position, (double)r.drift_velocity, r.seconds,
                             (double)r.steps, (double)r.rejected, (double)r.evaluations, (double)r.jacobians,
                             (double)r.factorisations, (double)r.iterations, (double)r.switches, (double)r.n_grid,
                             (double)r.failed_index};
    memcpy(report, fields, sizeof fields);
    mech_free(s);
    free(a);
    free(set);
    return status;
}
