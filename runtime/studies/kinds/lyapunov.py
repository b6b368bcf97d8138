"""Lyapunov exponents: the mean rates at which neighbouring motions part (Benettin and others 1980).

Changes of the start are carried along and made orthogonal again every so often; the logarithms of what they have grown
meanwhile are the data, whose mean over batches gives an interval of confidence.
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any

import numpy as np
from msgspec.structs import replace

from ...case import Case, SimulationOptions, find_experiment, inputs_at
from ...ensembles.kept import EXPONENT, FACTOR, Kept
from ...ensembles.result import ENDINGS, Column, Ensemble
from ...integrate.interruption import NotedInterruptions
from ...integrate.kernel_failure import kernel_failure
from ...integrate.kernel_run import run_kernel
from ...integrate.solver import Solver, SolverOptions
from ...interface import ModelInterface
from ...native import contract
from ...native import kernel as native
from ...native.status import Status
from ...numerics.growth_rates import (
    BATCHES,
    CHAOTIC,
    CONFIDENCE,
    LONG_BATCHES,
    SETTLING,
    estimated,
    megno,
    parted,
)
from ...outcome import Outcome, SimulationError, time_text
from ...problem import Array, Problem
from ...settings import settable
from ...tangent.coordinates import basis, minimal
from ...tangent.flow import GENERAL, Tangents
from ...tangent.saltation import StartsOnSurface
from ..findings import Curve, Findings, Panel, Value
from ..flow.linearised import Linearised, LinearMap, of_pieces
from ..flow.pieces import with_horizon
from ..flow.time_dependence import after_initial_events, depends_on_time
from ..runs.simulate import Plan, plan_run, run
from ..study import Members, Study
from .ensemble import EnsembleOf, Varying

TOLERANCE = 1e-8
HORIZON = 100.0
STEPS = 12
"""Steps of the motion between two times at which the changes are made orthogonal, to begin with."""
DIGITS_SPENT = 0.5
"""Share of the digits of the tolerance by which the largest and the smallest growth may differ from one such time to the
next: so many the smallest one loses."""
WATCHED = 64
"""Intervals after which their length is set again, from the largest growth among them."""
LONGEST = 32.0
"""Times the first interval, at most."""
SHARES = (1 / 64, 1 / 16, 1 / 4)
"""Of a run, from which on changes are followed where the start lies on a surface at which something changes."""
KEEP = "lyapunov(time), megno(time)"
ONE_EXPONENT = "over parameters and starts the largest exponent is told, and no others: leave 'count' out"
WANTED = 0.012
"""Half of the interval over the largest exponent, at which a study without a time ends."""
BELOW = 20.0
"""Times half of the interval of an exponent that is zero, from which on all others below it are told from it."""
STABLE = 0.05
"""The same where the largest exponent is negative."""
SECONDS = 45.0
"""Of processor time, after which it ends at any rate: what it finds is the same on a machine that is busy."""
FEWEST = 40 * BATCHES
"""First intervals, at least, before a study without a time may end."""
LATER = 1.2
"""Times the length at which it was looked at whether enough is known, when that is looked at again. It has to be known both times:
an interval that happens to be narrow once tells nothing."""
NOTHING = 1e-3
"""Growth from one time of orthogonality to the next, below which an exponent that may be zero is looked at no longer."""
MOST_SHARE = 16
"""Intervals in a batch, at least."""


PIECES = 16
"""Of a first run, in which it is looked which discrete variables carry memory."""
SHORTER = 32.0
"""Times the first interval is longer than the shortest one, where discrete variables forget within a few samples."""
LOST = 1e-14
"""Share of the largest growth below which a change is rounding: a sample has set again what it was a change of."""

KEPT = 1e-6
"""Of the largest exponent, below which a sum of exponents is rounding: volumes are kept."""

RESTING = 1e-12
"""Of the nominal value of a state, by which it changes over the time of a run where it counts as resting."""


class Lyapunov(Study, frozen=True, kw_only=True):
    """The ``count`` largest exponents, all without it, over a motion of the length ``time``; without it, until the
    largest one is known to a percent or so."""

    needs = frozenset({"jacobian"})
    of_own_states = True

    time: Annotated[float | None, settable("How long to follow the motion.", "time")] = None
    count: Annotated[int | None, settable("Number of exponents (default: all).", "count")] = None
    over: Annotated[
        tuple[Varying, ...],
        settable('The largest one over parameters and starts: "a = 0 .. 1, 50, b = {1, 2}".', "varying"),
    ] = ()

    @classmethod
    def about_members(
        cls, problem: ModelInterface, asked: Mapping[str, Any], experiment: str | None
    ) -> Members | None:
        """Let motions that are smooth go side by side, each with one change."""
        if not asked.get("over") or problem.hybrid is not None or problem.constraints:
            return None
        if asked.get("count") not in (None, 1, "1"):
            raise SimulationError(ONE_EXPONENT)
        given = {
            name: what
            for name, what in asked.items()
            if name not in ("time", "count", "over", "estimate_error")
        }
        if "time" in asked:
            given["stop"] = asked["time"]
        said = find_experiment(problem, experiment)
        if "stop" not in given and (said is None or "stop" not in said.options):
            given["stop"] = HORIZON
        if (asked.get("method") or (said.words.get("method") if said else None) or "auto") not in GENERAL:
            given = {name: what for name, what in given.items() if name != "step"} | {"method": "dop853"}
        return EnsembleOf, {**given, "vary": asked["over"], "keep": KEEP, "errors": "none"}

    def solve(self, problem: Problem) -> Findings | Ensemble:
        """Follow the motion and its changes. Raises SimulationError where it has no derivatives."""
        if self.over:
            return _one_by_one(problem, self)
        options = with_horizon(problem, self, HORIZON, TOLERANCE)
        plan = after_initial_events(plan_run(problem, options))
        with NotedInterruptions() as interrupted:
            return _findings(problem, self, plan, *_followed(problem, self, plan, interrupted))


def _one_by_one(problem: Problem, study: Lyapunov) -> Ensemble:
    """Follow motions that are not smooth one after the other, with one change each."""
    if study.count not in (None, 1):
        raise SimulationError(ONE_EXPONENT)
    begun_at, options = clock.perf_counter(), with_horizon(problem, study, HORIZON, TOLERANCE)
    common = {name: getattr(options, name) for name in SimulationOptions.__struct_fields__}
    members = EnsembleOf(**common, vary=study.over).members(problem)
    n = members.count
    numbers, errors, ends = np.full((n, 2), np.nan), np.full((n, 2), np.nan), np.full(n, np.nan)
    outcomes, reasons, texts = np.zeros(n, dtype=np.int8), np.full(n, -1, dtype=np.int32), list[str]()
    method, tolerance = "", options.tolerance or TOLERANCE
    with NotedInterruptions() as interrupted:
        for k in range(n):
            values = dict(zip(members.names, members.values(k, k + 1)[0].tolist(), strict=True))
            try:
                plan = after_initial_events(
                    plan_run(problem, replace(options, values={**options.values, **values}))
                )
                method, tolerance = plan.method.name, plan.case.tolerance
                span = study.time or plan.case.stop - plan.case.begin
                one = replace(options, count=1, time=span, progress=None)
                times, growth, outcome, message, _ = _followed(problem, one, plan, interrupted)
            except SimulationError as failure:
                times, outcome, message = np.full(1, np.nan), Outcome.FAILED, failure.message
            if outcome is Outcome.INTERRUPTED:
                break
            ends[k], outcomes[k] = (
                times[-1],
                ENDINGS.index("completed" if outcome is Outcome.COMPLETED else "failed"),
            )
            if outcome is Outcome.COMPLETED:
                (numbers[k, 0],), (errors[k, 0],) = _exponents(times, growth)
                if np.isfinite(numbers[k, 0]):
                    (numbers[k, 1],) = megno(times, growth)
            else:
                texts += [message] if message not in texts else []
                reasons[k] = texts.index(message)
            if study.progress is not None:
                study.progress((k + 1) / n)
    time = problem.time.unit
    kinds = (Kept("lyapunov(time)", EXPONENT), Kept("megno(time)", FACTOR))
    return Ensemble(
        model=problem.name, experiment=study.experiment or "", members=members, time=Column("time", time),
        scalars=tuple(Column(one.label, one.unit(problem)) for one in kinds), series=(), times=np.empty(0), numbers=numbers,
        number_errors=errors, rows=np.empty((n, 0, 0)), outcomes=outcomes, reasons=reasons, texts=tuple(texts), ends=ends,
        errors=np.full(n, np.nan), steps=np.zeros(n, dtype=np.int64), method=method, tolerance=tolerance,
        seconds=clock.perf_counter() - begun_at, threads=1, build="compiled C",
        remarks=(*parted(numbers[:, 1]), "one after the other, across events and on constraints"),
    )  # fmt: skip


def _followed(
    problem: Problem, study: Lyapunov, plan: Plan, interrupted: Callable[[], bool]
) -> tuple[Array, Array, Outcome, str, bool]:
    """Give times [n] and the logarithms of growth up to them [n, k], without the settling, how it ended, and whether at rest."""
    linear = Linearised(plan)
    plan = _off_surfaces(plan, linear)
    case = plan.case
    first_memory = _remember(linear, case)
    allowed = linear.allowed(case.y0, first_memory)
    count = min(study.count or allowed.shape[1], allowed.shape[1])
    interval = shortest = _interval(problem, plan)
    longest, most = LONGEST * interval, -DIGITS_SPENT * math.log(plan.case.tolerance)
    if study.time is not None:
        if study.time < BATCHES * interval / STEPS:
            message = f"the motion is too short to tell an exponent: say a longer --time than {study.time:g}"
            return np.zeros(1), np.zeros((1, count)), Outcome.FAILED, message, False
        longest = min(longest, study.time / (MOST_SHARE * BATCHES))
        interval = min(interval, longest)
    carrier = _Carrier(plan, linear, count)
    random = np.random.default_rng(0)
    first, _ = np.linalg.qr(allowed @ random.standard_normal((allowed.shape[1], count)))
    carrier.begin(*linear.changes(case.y0, first))
    times, growth, losses = [case.begin], [np.zeros(count)], [np.zeros(count, dtype=bool)]
    begun, stop = clock.process_time(), math.inf if study.time is None else case.begin + study.time
    looked, spread, before = case.begin + FEWEST * interval, 0.0, False
    outcome, message = Outcome.COMPLETED, ""
    goes_on = study.time is None and count > 1 and not _at_rest(plan) and not depends_on_time(plan)
    try:
        while times[-1] < stop * (1 - 1e-12) - 1e-300:
            if interrupted():
                outcome, message = Outcome.INTERRUPTED, f"interrupted at {time_text(problem, times[-1])}"
                break
            until = min(stop, times[-1] + interval)
            grown = carrier.advance(until)
            growth.append(growth[-1] + grown)
            losses.append(carrier.lost)
            times.append(until)
            spread = max(spread, float(np.append(grown, 0.0).max() - np.append(grown, 0.0).min()))
            if len(times) % WATCHED == 0:
                wanted = interval * min(max(most / max(spread, 1e-300), 0.5), 2.0)
                least = shortest / SHORTER if linear.memory else shortest
                interval, spread = min(max(wanted, min(least, longest)), longest), 0.0
                if study.progress is not None:
                    done = (until - case.begin) / study.time if study.time else 0.0
                    study.progress(max(done, 0.0 if study.time else (clock.process_time() - begun) / SECONDS))
            late = clock.process_time() - begun > SECONDS and len(times) > 8 * BATCHES
            if study.time is None and (until > looked or late):
                told = _of_what_is_left(times, growth, losses)
                if np.isneginf(told[-1]).all() or (
                    goes_on and _still(plan, carrier.time, carrier.y, carrier.z)
                ):
                    break
                means, halves = estimated(np.array(times), told[:, np.isfinite(told[-1])])
                wanted = (STABLE if means[0] < 0 else WANTED) * abs(means[0])
                known, before = before, bool(halves[0] < wanted)
                known = known and before
                far = until - case.begin > 4 * FEWEST * shortest
                none = means[0] < 2 * halves[0] < 2 * NOTHING / shortest and far
                # where only that along the motion is not negative, it is zero
                below = -means[1:] > np.maximum(BELOW * halves[0], 2 * halves[1:])
                cycle = bool(
                    goes_on and len(times) > 4 * BATCHES and abs(means[0]) < 2 * halves[0] and below.all()
                )
                if known or none or cycle or late:
                    break
                looked = case.begin + LATER * (until - case.begin)
    except _Ended as ended:
        outcome, message = Outcome.FAILED, str(ended)
    finally:
        carrier.close()
    still = not depends_on_time(plan) and _still(plan, carrier.time, carrier.y, carrier.z)
    return np.array(times), _of_what_is_left(times, growth, losses), outcome, message, still


def _of_what_is_left(times: Sequence[float], growth: Sequence[Array], losses: Sequence[Array]) -> Array:
    """Give growths [n, k], minus infinity from where nothing is left of a change; but for the time in which the motion settles."""
    found, lost = np.array(growth), np.array(losses)
    lost[np.array(times) <= times[0] + SETTLING * (times[-1] - times[0])] = False
    found[np.logical_or.accumulate(lost, axis=0)] = -np.inf
    return found


def _off_surfaces(plan: Plan, linear: Linearised) -> Plan:
    """Give a plan that begins a little later where the start lies on a surface at which something changes, as where friction
    sticks: exponents do not depend on the start. Raises SimulationError where something sticks at the later times, too."""
    case, refused = plan.case, None
    for share in (0.0, *SHARES) if case.problem.hybrid is not None else ():
        moved = case if share == 0 else _later(plan, case.begin + share * (case.stop - case.begin))
        w, dz = linear.changes(moved.y0, np.eye(linear.size))
        try:
            linear.tangents.flow(moved.begin, moved.y0, w, np.array([moved.begin]), z=moved.z, dz=dz)
        except StartsOnSurface as failure:
            refused = refused or failure
            continue
        except SimulationError:  # told where it is followed
            pass
        return replace(plan, case=moved)
    if refused is not None:
        raise refused
    return plan


def _later(plan: Plan, begin: float) -> Case:
    """Give the case that goes on from a later time. Raises SimulationError where the motion ends before."""
    case = plan.case
    step = case.step if plan.method.fixed_step else None
    options = SolverOptions(plan.method.name, case.tolerance, plan.nominal, step)
    run = run_kernel(replace(case, grid=np.array([begin]), stop=begin), options)
    if run.ending(case.problem) or run.happened is None:
        raise SimulationError(
            f"the motion of '{case.problem.name}' ends at its start: {run.ending(case.problem)}"
        )
    y = run.y[-1]
    return replace(case, begin=begin, y0=y, wanted=y, z=run.happened.grid_z[-1], assembled=None)


def _remember(linear: Linearised, case: Case) -> tuple[int, ...]:
    """Find the discrete variables that the motion keeps and reads again, in pieces of a first run; give those that it reads
    from its start on. Raises SimulationError where it has no derivatives."""
    if not linear.reals:
        return ()
    start = linear.joined(case.y0, case.z)
    maps, changing = _in_pieces(linear, case, start)
    if changing:  # what is set once, as by the first sample, is set at the start of all later motion
        maps, _ = _in_pieces(linear, case, linear.joined(case.y0, maps[-1].z))
    linear.memory = of_pieces(maps)
    whole = maps[0]
    for one in maps[1:]:
        matrix = one.matrix @ whole.matrix
        whole = replace(whole, matrix=matrix / (np.abs(matrix).max() or 1.0))
    return whole.of(linear.memory).remembered().memory


def _in_pieces(linear: Linearised, case: Case, start: Array) -> tuple[list[LinearMap], bool]:
    """Give the maps of pieces of a first run, and whether discrete variables change otherwise than by small changes."""
    maps, changing = list[LinearMap](), False
    span = (case.stop - case.begin) / PIECES
    for k in range(PIECES):
        try:
            maps.append(linear.map(case.begin + k * span, start, span, checked=False, closed=False))
        except SimulationError:
            if not maps:
                raise
            break
        changing |= bool(linear.changed(start, maps[-1].remembered()))
        start = linear.joined(maps[-1].end, maps[-1].z)
    return maps, changing


class _Ended(Exception):
    """The motion failed on its way."""


def _interval(problem: Problem, plan: Plan) -> float:
    """Give the time of a dozen steps of the motion."""
    options = replace(plan.options, start=None, estimate_error=False, progress=None, points=2, dense=False)
    if hasattr(options, "time"):
        options = replace(options, time=None)
    solution = run(problem, options)
    span = float(solution.time[-1]) - plan.case.begin
    if not span > 0:
        raise SimulationError(f"the motion of '{problem.name}' ends at its start: {solution.message}")
    return STEPS * span / max(solution.statistics.steps, 1)


class _Carrier:
    """A motion with changes of it, taken on in time; after each time they are made orthogonal, in nominal sizes."""

    def __init__(self, plan: Plan, linear: Linearised, count: int) -> None:
        self.plan, self.linear, self.count = plan, linear, count
        self.problem = plan.case.problem
        self.tangents = Tangents(plan.case, plan.method, plan.nominal, (), count)
        self.time, self.y, self.z = plan.case.begin, plan.case.y0, plan.case.z
        self.solver: Solver | None = None
        self.lost = np.zeros(count, dtype=bool)
        """Changes of which nothing is left, as after friction stuck, in the last interval."""
        self.random = np.random.default_rng(1)
        self.fixed = None if self.problem.rotations else basis(self.problem, self.y)

    def begin(self, w: Array, dz: Array) -> None:
        self.w, self.dz = w, dz
        if self.problem.hybrid is not None:
            return
        augmented, case = self.tangents.augmented, self.plan.case
        row = augmented.joined(self.y, w)
        size = np.abs(w / self.plan.nominal[:, None]).max(axis=0)
        nominal = augmented.joined(self.plan.nominal, np.outer(self.plan.nominal, size))
        made = replace(
            case, problem=augmented.problem, functions=augmented.functions, p=augmented.p,
            z=augmented.discretes(case.z), y0=row, known=np.ones(row.size, dtype=bool), wanted=row, assembled=None,
            grid=np.empty(0),
        )  # fmt: skip
        struct, method = augmented.functions.struct, self.tangents.method.name
        kernel = native.kernel_for(struct, self.plan.options.reproducible, method)
        tolerance = case.tolerance
        self.solver = Solver(kernel, made, method, tolerance, tolerance * nominal, case.step or 0.0)

    def close(self) -> None:
        if self.solver is not None:
            self.solver.__exit__(None, None, None)

    def advance(self, until: float) -> Array:
        """Go on to a time; give the logarithms of growth [k]."""
        problem, linear, augmented = self.problem, self.linear, self.tangents.augmented
        if self.solver is None:
            flow = self.tangents.flow(
                self.time, self.y, self.w, np.array([until]), z=self.z, dz=self.dz, scheduled=False
            )
            if flow.short:
                raise _Ended(flow.short)
            assert flow.z is not None and flow.dz is not None
            self.y, self.z = flow.states[-1], flow.z[-1]
            self.w, self.dz = flow.tangents[-1], flow.dz[-1]
        else:
            status = Status.RUNNING
            while status == Status.RUNNING:
                status = self.solver.advance(until, 100_000)
            report, row = self.solver.report()
            if status != Status.REACHED:
                failure = kernel_failure(augmented.problem, status, report, row)
                raise _Ended(failure.message if failure is not None else f"the motion ended at {report.t:g}")
            self.y, w = augmented.split(row, problem.ny)
            self.w = linear.onto(self.tangents, until, self.y, w) if problem.constraints else w
        reduced = minimal(problem, self.y, self.w) if self.fixed is None else self.fixed.T @ self.w
        reduced = np.concatenate([reduced, self.dz])
        own = np.zeros_like(reduced)
        own[linear.kept] = (reduced / linear.scale[:, None])[linear.kept]
        alive = self.w.any(axis=0) | self.dz.any(axis=0)
        q = np.zeros_like(own)
        q[:, alive], r = np.linalg.qr(own[:, alive])
        sizes = np.zeros(self.count)
        sizes[alive] = np.abs(np.diag(r))
        if not np.isfinite(sizes).all():
            raise _Ended(f"changes of the motion are not numbers at {time_text(problem, until)}")
        if problem.hybrid is not None:
            sizes[sizes < LOST * sizes.max()] = 0.0
        self.lost = sizes == 0
        q[:, self.lost] = 0.0
        if self.lost.any() and not self._holds():
            q = self._renewed(q)
        turned = basis(problem, self.y) if self.fixed is None else self.fixed
        q = q * linear.scale[:, None]
        self.w, self.dz = turned @ q[: linear.states], q[linear.states :]
        self.time = until
        if self.solver is not None:
            self.solver.write(augmented.joined(self.y, self.w))
        found: Array = np.log(np.where(self.lost, 1.0, sizes))
        return found

    def _holds(self) -> bool:
        """Whether friction sticks or a contact rests, so that changes cannot be chosen freely."""
        address = self.plan.case.functions.struct.hybrid
        if not address:
            return False
        hybrid = contract.HybridStruct.from_address(address)
        flags = [hybrid.rows[i].flag for i in range(hybrid.n_rows)]
        return any(flag >= 0 and self.z[flag] > 0.5 for flag in flags)

    def _renewed(self, q: Array) -> Array:
        """Give directions with new ones, orthogonal to the others, where nothing is left."""
        linear, lost = self.linear, self.lost
        allowed = linear.allowed(linear.joined(self.y, self.z), linear.memory)
        other = allowed @ self.random.standard_normal((allowed.shape[1], int(lost.sum())))
        other -= q[:, ~lost] @ (q[:, ~lost].T @ other)
        q = q.copy()
        q[:, lost] = np.linalg.qr(other)[0]
        return q


def kaplan_yorke(exponents: Array, errors: Array) -> tuple[float, float] | None:
    """Give the dimension j + (l1 + ... + lj)/abs(l(j+1)) of Kaplan and Yorke (1979) with its error, j as large as the sum is not negative.

    ``exponents`` [k] fall, ``errors`` [k] are half of their intervals. None where volumes of all k dimensions do not shrink.
    """
    sums = np.cumsum(exponents)
    below = np.flatnonzero(sums < -KEPT * np.abs(exponents).max())
    if not below.size or below[0] == 0:
        return None
    j = int(below[0])
    share = float(sums[j - 1] / -exponents[j])
    return j + share, float((errors[:j].sum() + share * errors[j]) / -exponents[j])


def _exponents(times: Array, growth: Array) -> tuple[Array, Array]:
    """Give exponents [k] with half of their intervals; minus infinity for changes of which nothing is left."""
    left = np.isfinite(growth[-1])
    means, halves = np.full(left.size, -np.inf), np.zeros(left.size)
    if left.any():
        means[left], halves[left] = estimated(times, growth[:, left])
    return means, halves


def _dimension(means: Array, halves: Array) -> tuple[float, float] | None:
    """Give the dimension of Kaplan and Yorke, where some exponents may be minus infinity."""
    left = np.isfinite(means)
    found = kaplan_yorke(means[left], halves[left])
    return (float(left.sum()), 0.0) if found is None and not left.all() else found


def _in_a_plane(problem: Problem, plan: Plan) -> bool:
    """Whether the states lie in a plane, in which no motion without jumps and without time in its rates is chaotic."""
    return (
        problem.hybrid is None and Linearised(plan).allowed(plan.case.y0).shape[1] <= 2 and not depends_on_time(plan)
    )  # fmt: skip


def _at_rest(plan: Plan) -> bool:
    """Whether nothing changes at the start, but for rounding, so that what is followed is not a motion."""
    case = plan.case
    if case.problem.hybrid is not None or depends_on_time(plan):
        return False
    return _still(plan, case.begin, case.y0, case.z)


def _still(plan: Plan, t: float, y: Array, z: Array) -> bool:
    """Whether nothing changes in a state, but for rounding."""
    case = plan.case
    slope = case.functions.rhs(t, y, inputs_at(case, t), z, case.p)
    moves = list(case.problem.own)
    span = case.stop - case.begin
    return bool((np.abs(slope[moves]) * span <= RESTING * plan.nominal[moves]).all())


def _near_zero(plan: Plan, means: Array, halves: Array, factor: float, *, still: bool) -> str:
    """Say what exponents [k] tell of which the largest one may be zero; ``factor``: mean exponential growth of its neighbours;
    ``still``: the motion ends at rest."""
    if still:
        return "stable: the motion comes to rest, and changes of its start neither grow nor vanish: beside it are further places of rest"
    if len(means) > 1 and means[1] < -2 * halves[1] and not depends_on_time(plan):
        others = (
            f"negative, of which the largest is {means[1]:.5g}" if np.isfinite(means[1]) else "minus infinity"
        )
        return f"stable: one exponent is zero, as along any motion that goes on, and all others are {others}"
    if factor < CHAOTIC:
        return (
            f"regular: neighbouring motions part by a power of the time at most (megno {factor:.2g}), "
            f"and the largest exponent is {max(means[0], 0) + halves[0]:.2g} at most"
        )
    return "the largest exponent cannot be told from zero: it takes a longer --time"


def _findings(
    problem: Problem,
    study: Lyapunov,
    plan: Plan,
    times: Array,
    growth: Array,
    outcome: Outcome,
    message: str,
    still: bool,
) -> Findings:
    lost = np.isneginf(growth[-1])
    # fewer only where the motion failed or was interrupted, or where nothing is left of any change
    enough = len(times) > 4 * BATCHES or (lost.all() and outcome is Outcome.COMPLETED)
    means, halves = _exponents(times, growth) if enough else (np.zeros(0), np.zeros(0))
    per = f"1/{problem.time.unit}" if problem.time.unit else ""
    order = np.argsort(-means, kind="stable")
    means, halves = means[order], halves[order]
    values = [
        Value(f"exponent {k + 1}", per, float(m), float(h))
        for k, (m, h) in enumerate(zip(means, halves, strict=True))
    ]
    remarks, words = [], ""
    if len(means):
        first, half = means[0], halves[0]
        rests = _at_rest(plan)
        growing = "unstable, though not chaotic" if rests or _in_a_plane(problem, plan) else "chaotic"
        if rests:
            remarks.append(
                "the start is an equilibrium, where nothing moves: its exponents are the real parts of its eigenvalues, "
                "which 'equilibria' gives to rounding"
            )
        factor = float(megno(times, growth[:, order[:1]])[0]) if np.isfinite(first) else 0.0
        told = first > 2 * half or (first > half and factor > CHAOTIC)
        words = (
            f"{growing}: the largest exponent is {first:.5g}" if told and first > 0
            else "stable: all exponents are minus infinity" if np.isneginf(first)
            else f"stable: the largest exponent is {first:.5g}" if first < -2 * half
            else _near_zero(plan, means, halves, factor, still=still)
        )  # fmt: skip
        if told and first > 0 and not rests and (dimension := _dimension(means, halves)) is not None:
            values.append(Value("dimension", "", *dimension))
            of_what = (
                "of the strobed motion"
                if depends_on_time(plan)
                else "of the attractor, time along the motion included"
            )
            remarks.append(f"dimension: that of Kaplan and Yorke, {of_what}")
        if lost.any():
            when = times[int(np.isneginf(growth).any(axis=1).argmax())]
            remarks.append(
                f"{lost.sum()} of {len(means)} exponents {'is' if lost.sum() == 1 else 'are'} minus infinity: before "
                f"{time_text(problem, float(when))} neighbouring motions become one, as where friction sticks or a sample "
                "sets a variable again"
            )
        elif study.count is None and len(means) > 1:
            remarks.append(f"the sum of all exponents, the rate at which volumes grow, is {means.sum():.6g}")
            pairs = np.abs(means + means[::-1])
            if (pairs <= halves + halves[::-1] + 1e-9).all() and abs(means.sum()) < 1e-6 * max(np.abs(means).max(), 1e-9) + halves.max():  # fmt: skip
                remarks.append(
                    f"they come in pairs of opposite sign, as of a conservative motion, within {pairs.max():.1e}"
                )
    span = float(times[-1] - times[0])
    grown = np.where(np.isfinite(growth), growth, np.nan)[1:] / (times[1:] - times[0])[:, None]
    step = max(1, len(grown) // 2000)
    curves = tuple(
        Curve(f"exponent {k + 1}", times[1::step], grown[::step, i]) for k, i in enumerate(order[:6])
    )
    curves = curves if len(grown) > 1 else ()
    panel = Panel(
        "exponents up to then",
        "time",
        problem.time.unit,
        "exponent",
        per,
        curves,
        logarithmic="x" if curves and times[1] > 0 else "",
        tall=True,
    )
    return Findings(
        study="lyapunov",
        model=problem.name,
        outcome=outcome,
        message=message or f"{words}, over a time of {span:.6g}",
        values=tuple(values),
        errors_from=f"half of the intervals of {CONFIDENCE:.0%} confidence, by means over {BATCHES} and over {LONG_BATCHES} parts of the motion",
        remarks=tuple(remarks),
        tables=(),
        panels=(panel,) if curves else (),
        details={
            "exponents": [float(m) if np.isfinite(m) else None for m in means],
            "confidence": halves.tolist(),
            "time": span,
        },
        arrays={"time": times, "growth": growth[:, order] if len(order) else growth},
    )
