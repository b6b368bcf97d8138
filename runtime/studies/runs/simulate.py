"""One run: the motion from the start to the stop, with an estimate of its error."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Annotated, Any, ClassVar

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ...case import Case, Progress, SimulationOptions, find_experiment, part_of, prepare, start_remarks
from ...functions import load_functions
from ...integrate.choose_method import choose_method
from ...integrate.interruption import NotedInterruptions
from ...integrate.nominal_run import nominal_of
from ...integrate.trajectory import Trajectory, with_unit_rotations
from ...memo import once
from ...outcome import ENDED, Outcome, time_text
from ...problem import Array, Problem
from ...results.accuracy import (
    Accuracy,
    Judged,
    Verdict,
    drifts_of,
    with_balance,
)
from ...results.branches import branches_of
from ...results.consistency import checks
from ...results.doubts import Contradiction
from ...results.evaluate import Table, evaluate_rows, scene_rows, solution_columns
from ...results.solution import Motion, Solution
from ...rows import FEW_NUMBERS
from ...settings import settable
from ..study import Study
from .companion import Estimated, closer, doubts, estimate, trajectory_of
from .companion import Plan as Plan  # part of what runs are asked through
from .missed_feature_scan import estimated_as_closely, seen_between
from .own_size import by_own_size, own_sizes
from .wakeup_scan import begins_unseen

MAIN_SHARE = 0.36
"""Part of the work that is the main run: its companion, 100 times tighter, takes 100^(1/8) = 1.8 times as long."""

FIRST_SHARE = 0.6
"""Part of the work that is the first of two runs, with its own companion, where the second is tighter."""

RUN_SHARE = 0.3
"""Part of the work that is the run, where its motion is differentiated as well."""


class Run(Study, frozen=True, kw_only=True):
    """What runs have beside what every study has."""

    of_past = True
    sensitivity: Annotated[
        tuple[str, ...],
        settable(
            "Parameters, initial values and inputs with respect to which the motion is differentiated.",
            "directions",
        ),
    ] = ()
    condition: Annotated[
        bool,
        settable(
            "Report how small changes of the start grow, and until when the results can be trusted.", "flag"
        ),
    ] = False
    constants: Annotated[
        bool,
        settable("Find constants of the motion, and check them along the run like the energy.", "flag"),
    ] = False
    asked_needs: ClassVar[Mapping[str, frozenset[str]]] = MappingProxyType(
        {"constants": frozenset({"phase"})}
    )


def run(
    problem: Problem,
    options: SimulationOptions,
    *,
    as_stated: bool = False,
    sensitivity: Sequence[str] = (),
    condition: bool = False,
) -> Solution:
    """Run a problem once. ``as_stated``: nothing of what its default experiment says was changed. ``sensitivity``: names
    of what the motion is differentiated in. ``condition``: look at how errors grow."""
    plan = plan_run(problem, options)
    found = _run(plan, options, as_stated, sensitivity)
    if not condition:
        return found
    from .sensitivity import with_condition

    return with_condition(found, plan)


def _run(plan: Plan, options: SimulationOptions, as_stated: bool, sensitivity: Sequence[str]) -> Solution:
    if not sensitivity:
        return _solve(plan, as_stated)
    from ...tangent.flow import Tangents
    from .sensitivity import with_sensitivities

    # what it cannot is told before the run
    differentiable = Tangents(plan.case, plan.method, plan.nominal, sensitivity)
    start = differentiable.start()
    progress = part_of(options.progress, 0.0, RUN_SHARE)
    solution = _solve(replace(plan, options=replace(options, progress=progress)), as_stated)
    if solution.outcome not in ENDED:
        solution.add_remark("the motion was not differentiated, as the run did not reach its end")
        return solution
    return with_sensitivities(solution, differentiable, start, estimate_error=options.estimate_error)


def run_from(plan: Plan, y: Array, z: Array) -> Solution:
    """Run a plan from another state ``y`` [ny], with other discrete variables ``z``."""
    return _solve(replace(plan, case=replace(plan.case, y0=y, z=z, assembled=None)), False)


def as_keywords(options: SimulationOptions) -> dict[str, Any]:
    """Give the fields of options, which every study has."""
    return {name: getattr(options, name) for name in SimulationOptions.__struct_fields__}


def is_as_stated(problem: Problem, options: SimulationOptions) -> bool:
    """Whether this is the default experiment, with no value and no input changed."""
    if options.values or options.inputs:
        return False
    first, chosen = find_experiment(problem, None), find_experiment(problem, options.experiment)
    return first is None or first is chosen


def run_at_two_tolerances(problem: Problem, study: Study) -> tuple[Solution, Solution]:
    """Run a model as a study asks, and again at a tighter tolerance; return the tighter motion, then the first.

    Raises SimulationError, and KeyboardInterrupt where the first run was interrupted.
    """
    first = run(
        problem,
        replace(study, progress=part_of(study.progress, 0.0, FIRST_SHARE)),
        as_stated=is_as_stated(problem, study),
    )
    if first.outcome is Outcome.INTERRUPTED:
        raise KeyboardInterrupt
    once = replace(study, estimate_error=False, progress=part_of(study.progress, FIRST_SHARE, 1.0))
    return run(problem, replace(once, **closer(plan_run(problem, once))[0])), first


def plan_run(problem: Problem, options: SimulationOptions) -> Plan:
    """Make a run ready: its case, method and nominal values. Raises ``SimulationError``."""
    functions = load_functions(problem)
    case = prepare(problem, functions, options)
    method = choose_method(case, options.reproducible)
    nominal = nominal_of(case)
    return Plan(options, case, method, nominal)


def _looked_at(
    plan: Plan, main: Trajectory, progress: Progress | None
) -> tuple[Plan, Trajectory, tuple[str, ...]]:
    """Repeat a run in shorter steps where something begins between its steps while nothing moves; say so."""
    case = plan.case
    if main.failure is not None or main.interrupted:
        return plan, main, ()
    unseen = begins_unseen(case, main, plan.nominal)
    if unseen is None:
        return plan, main, ()
    at = time_text(case.problem, unseen.time)
    step = time_text(case.problem, unseen.step).removeprefix("t = ")
    seen = f"something begins at {at}, between steps in which nothing moves: "
    if plan.method.fixed_step:
        return plan, main, (f"{seen}take steps of {step} to see it",)
    finer = replace(plan, case=replace(case, max_step=unseen.step))
    again = trajectory_of(finer, plan.options.dense, progress)
    return finer, again, (f"{seen}the run was repeated with steps of at most {step}",)


@once
def _names(problem: Problem) -> list[str]:
    """Give the names of the parameters."""
    return [q.name for q in problem.parameters]


class _Done(Struct, frozen=True, eq=False):
    """A run and its companion, ready to be judged."""

    plan: Plan
    main: Trajectory
    table: Table
    estimated: Estimated
    remarks: tuple[str, ...]
    as_stated: bool


def _waits(plan: Plan, main: Trajectory) -> bool:
    """Whether a run may be judged later: where its rows are few, nobody writes them down, and nothing has to run again."""
    few = main.y.size <= FEW_NUMBERS and plan.options.follower is None
    return few and not plan.method.fixed_step


def _solve(plan: Plan, as_stated: bool) -> Solution:
    with NotedInterruptions() as interrupted:
        return _solved(replace(plan, interrupted=interrupted), as_stated)


def _solved(plan: Plan, as_stated: bool) -> Solution:
    case, options = plan.case, plan.options
    problem = case.problem
    share = MAIN_SHARE if options.estimate_error else 1.0
    progress = part_of(options.progress, 0.0, share)
    main = trajectory_of(plan, options.dense, progress)
    plan, main, looked = _looked_at(plan, main, progress)
    seen = seen_between(plan, main, progress)
    plan, main, sized = by_own_size(seen.plan, seen.main, progress)
    sizes = own_sizes(seen.plan, plan) if main is not seen.main else {}
    case = plan.case
    if main.failure is not None:
        from ...results.diagnosis import with_cause

        main = replace(main, failure=with_cause(case, main.failure))
    times, states, happened = main.t, main.y, main.happened
    modes: Array | None = None
    if happened is not None:
        times, states, modes = happened.merged(main.t, main.y, options.storage)
        for begin in (*main.t[:1], *times[-1:])[
            :1
        ]:  # rows begin with the output, or are the end of a run that does not reach it
            first = int(np.searchsorted(times, begin))
            times, states, modes = times[first:], states[first:], modes[first:]
    table = Table(case, times, states, modes, options.storage)
    if options.follower is not None:
        options.follower.finish(table, main.y)
    estimated = Estimated("no companion run was asked for")
    if options.estimate_error and main.failure is None and not main.interrupted:
        listed = checks(problem, as_stated=as_stated)
        rest = part_of(options.progress, share, 1.0)
        estimated = estimate(plan, main, rest, listed)
        estimated = estimated_as_closely(seen._replace(plan=plan, main=main), estimated, rest, listed)
    elif options.estimate_error:
        estimated = Estimated("no companion run was made, as the run did not complete")
    waits = _waits(plan, main)
    told = replace(plan, interrupted=None) if waits else plan
    done = _Done(told, main, table, estimated, (*looked, *seen.remarks, *sized), as_stated)
    judged = Judged(lambda: _verdict(done))
    if not waits:
        judged()
    interpolated = main.dense or _hermite(plan, times, states, modes)

    def state_at(t: Array) -> tuple[Array, Array | None]:
        y = with_unit_rotations(problem.rotations, interpolated(t))
        if happened is None:
            return y, None
        if len(happened) and happened.times[-1] == main.t[-1]:  # no piece of the motion begins there
            y = np.where((t < main.t[-1])[:, None], y, happened.after[-1, : problem.ny])
        return y, happened.discretes(t, problem.ny)

    def at(t: Array) -> Array:
        return solution_columns(case, t, *state_at(t))

    def pictured(t: Array) -> Array:
        return scene_rows(case, t, *state_at(t))

    motion = Motion(
        problem,
        times,
        table,
        at,
        interpolation="dense output" if main.dense else "cubic Hermite between output points",
        experiment=case.experiment,
        parameters=dict(zip(_names(problem), case.p.tolist(), strict=False)),
        statistics=main.statistics,
        judged=judged,
        stopped=main.failure,
        companion_stopped=estimated.failure,
        events=happened.events if happened is not None else (),
        as_stated=as_stated,
        pictured=pictured if problem.scene is not None else None,
        states_at=state_at,
        own_sizes=sizes,
        nominal=seen.plan.nominal,
        sought=branches_of(
            case, (times, states, modes), main.dense, state_at, failed=main.failure is not None
        ),
    )
    return Solution(motion)


def _verdict(done: _Done) -> Verdict:
    """Judge a run by its rows: how it ended, what its errors are, what it keeps, and whether these agree."""
    from ...results.constraint_drift import constraint_drifts
    from ...results.diagnosis import undefined_energy, undefined_outputs
    from ...results.shared_loads import shared_loads

    plan, main, table, estimated = done.plan, done.main, done.table, done.estimated
    case, problem = plan.case, plan.case.problem
    outcome, message = _outcome(problem, main)
    if estimated.interrupted:
        outcome, message = Outcome.INTERRUPTED, f"{message}, interrupted during the error estimate"
    failure = main.failure
    if outcome is Outcome.COMPLETED:
        failure = undefined_energy(problem, table)
        if failure is not None:
            outcome, message = Outcome.FAILED, failure.message
    drifts = constraint_drifts(case, plan.nominal, main)
    doubtful: tuple[Contradiction, ...] = ()
    error = estimated.error
    if outcome in ENDED:
        from ...results.force_balance import broken_laws

        doubtful, error = doubts(plan, main, estimated, drifts, as_stated=done.as_stated)
        doubtful += broken_laws(case, table)
    if doubtful:
        outcome, message = Outcome.DOUBTFUL, f"{message}, but {doubtful[0].text()}"
    energy, conserved = drifts_of(problem, (outputs for _, outputs in table.parts()))
    if outcome in ENDED:
        error = with_balance(problem, error, energy, main.reached)
    remarks = (
        *start_remarks(case),
        *done.remarks,
        *_remarks(problem, case, main),
        *undefined_outputs(problem, table),
        *shared_loads(case, table),
    )
    accuracy = Accuracy(error, energy, conserved, estimated.remark, drifts, estimated.failure, doubtful)
    return Verdict(outcome, message, failure, accuracy, remarks)


def _outcome(problem: Problem, main: Trajectory) -> tuple[Outcome, str]:
    at = time_text(problem, float(main.t[-1])) if main.t.size else "the start"
    if main.failure is not None:
        return Outcome.FAILED, main.failure.message
    if main.interrupted:
        return Outcome.INTERRUPTED, f"interrupted at {at}"
    if main.terminated is not None:
        return Outcome.TERMINATED, f"{main.terminated} at {at}"
    return Outcome.COMPLETED, f"completed at {at}"


def _remarks(problem: Problem, case: Case, main: Trajectory) -> tuple[str, ...]:
    s = main.statistics
    remarks: list[str] = []
    if case.begin > 0:
        remarks.append(
            f"the motion begins at {time_text(problem, case.begin)}, with a table that has no earlier rows"
        )
    for k, table in case.tables.items():
        first, last = float(table.times[0]), float(table.times[-1])
        remarks += table.remarks
        if first == last or (first <= case.begin and case.stop <= last):
            continue
        span = f"{time_text(problem, first)} to {last:g}"
        name = problem.inputs[k].name
        remarks.append(
            f"the table of '{name}' goes from {span}: beyond its ends its first and last value hold"
        )
    if s.switch_time is not None:
        at = time_text(problem, s.switch_time)
        often = f"{s.switches} times, the last time" if s.switches > 1 else "once,"
        remarks.append(f"the method was changed {often} to {s.method} at {at}")
    elif s.stiff_time is not None:
        at = time_text(problem, s.stiff_time)
        remarks.append(f"the problem is stiff since {at}: an implicit method would be faster")
    if s.laid:
        often = "once" if s.laid == 1 else f"{s.laid} times"
        took = "" if s.laid_energy is None else f", which took {s.laid_energy:.3g} J"
        remarks.append(
            f"{often} a contact that would have fallen back slower than its 'rest' was brought to rest{took}"
        )
    if s.contact is not None:
        c = s.contact
        unsolved = f"; {c.unsolved} of {s.steps} steps were not solved" if c.unsolved else ""
        remarks.append(
            f"contacts: residual up to {c.residual:.1e}, as a rate, overlap up to {c.overlap:.1e}, in the units of gaps{unsolved}"
        )
    if s.several:
        often = "at one instant" if s.several == 1 else f"at {s.several} instants"
        remarks.append(
            f"{often} Coulomb's law had a second solution, in which a contact opens: what pressed went on pressing"
        )
    if s.poisson:
        often = "one impact" if s.poisson == 1 else f"{s.poisson} impacts"
        remarks.append(
            f"at {often} Newton's restitution and Coulomb's friction would have raised the energy: restitution there "
            "is Poisson's, a part of the impulse that ends the approach"
        )
    return tuple(remarks)


def _hermite(plan: Plan, t: Array, y: Array, z: Array | None) -> Callable[[Array], Array]:
    """Cubic interpolation between output points, from states and their derivatives.

    ``t`` [n], ``y`` [n, ny] and ``z`` [n, nz]: with both sides of each event, so that nothing is interpolated across it.
    """

    def states(at: Array) -> Array:
        if t.size < 2:
            return np.repeat(y, at.size, axis=0)
        dy = evaluate_rows(plan.case, "rhs", t, y, z)
        i = np.clip(np.searchsorted(t, at, side="right") - 1, 0, t.size - 1)
        j = np.minimum(i + 1, t.size - 1)
        h = (t[j] - t[i])[:, None]
        s = (at - t[i])[:, None] / np.where(h > 0, h, 1.0)  # at the last point, itself
        r, d = 1 - s, y[j] - y[i]
        b = h * dy[i] - d
        value: Array = y[i] + s * (d + r * (b + s * (d - h * dy[j] - b)))
        return value

    return states
