/* Taking a run on, up to a given time. */
#include "clock.h"
#include "events.h"
#include "solver.h"
#include "step.h"

static int advance(mech_solver *s, mech_real t_end, long max_steps)
{
    mech_run *run = s->run;
    if (run->report.status < 0) return run->report.status;
    if (!run->started) {
        int status = mech_step_start(s);
        if (status) return status;
    }
    for (long taken = 0; run->report.t < t_end; taken++) {
        if (taken == max_steps) return MECH_RUNNING;
        if (s->call_end > 0 && taken % 64 == 63 && mech_clock() > s->call_end) return MECH_RUNNING;
        if (s->o.record_capacity && run->report.n_record == s->o.record_capacity) return MECH_RECORD_FULL;
        const int stop = run->next_stop < s->o.n_stops && s->o.stops[run->next_stop] < t_end;
        mech_real t_new, h;
        int status = mech_step_try(s, stop ? s->o.stops[run->next_stop] : t_end, &t_new, &h);
        if (!status) status = mech_step_accept(s, t_new, h);
        if (status) return status;
    }
    return MECH_REACHED;
}

int mech_advance(mech_solver *s, mech_real t_end, long max_steps)
{
    const double begun = mech_clock();
    s->call_end = s->o.longest_call > 0 ? begun + s->o.longest_call : 0;
    const int status = s->events ? mech_events->advance(s, t_end, max_steps) : advance(s, t_end, max_steps);
    s->run->report.seconds += mech_clock() - begun;
    return s->run->report.status = status;
}
