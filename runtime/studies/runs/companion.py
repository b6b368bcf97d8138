"""The companion of a run: the same motion more exactly, from which the errors of the run are estimated, and its checks
judged."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property, reduce

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ...case import Case, Progress, SimulationOptions, part_of
from ...integrate.choose_method import Method
from ...integrate.kernel_run import run_kernel, slice_of
from ...integrate.solver import SolverOptions
from ...integrate.trajectory import Reader, Statistics, Trajectory
from ...methods import SOLVING_CONTACTS
from ...outcome import Failure
from ...problem import Array
from ...results.accuracy import (
    APART,
    EPSILON,
    FARTHER,
    HALVES,
    ConstraintDrift,
    ErrorEstimate,
    companion_step,
    companion_tolerance,
    compare,
    looser_companion,
    worse,
)
from ...results.consistency import Check, Pair, checks, contradictions, values_of
from ...results.doubts import Contradiction
from ...rows import FEW_NUMBERS, Storage, passed

COMPANION_STEPS, FEW_STEPS = 10, 100_000
"""A companion that takes more steps than so many times those of the main run fights with rounding, and is given up;
before the second number it may meet a singular position, which is worth knowing."""


DENSE_KEPT = 4_000_000
"""Bytes of polynomials that are kept for whoever may ask for times between steps; where checks or pictures go through them, all are."""


class Plan(Struct, frozen=True):
    """A run that can begin."""

    options: SimulationOptions
    case: Case
    method: Method
    nominal: Array
    interrupted: Callable[[], bool] | None = None
    """What listens for Ctrl-C while it runs, if somebody does."""


class Beside:
    """A companion that came as far as the main run: compared with that when somebody asks."""

    def __init__(self, plan: Plan, compared: Comparison, companion: Statistics, tightened: float) -> None:
        self._plan, self._compared, self._companion, self._tightened = plan, compared, companion, tightened

    @cached_property
    def pair(self) -> Pair:
        tolerance = 0.0 if self._plan.method.fixed_step else self._tightened
        return self._compared.pair(self._companion, tolerance)

    @cached_property
    def error(self) -> ErrorEstimate:
        assert self.pair.count
        compared, plan = self._compared, self._plan
        return compare(plan.case.problem, compared.largest, compared.last, plan.nominal, self._tightened)


class Estimated(Struct, frozen=True, eq=False):
    """What companion runs told, each ``beside`` the main run; or a ``remark`` why there are none, and the ``failure`` of the
    companion."""

    remark: str = ""
    beside: tuple[Beside, ...] = ()
    failure: Failure | None = None
    interrupted: bool = False

    @property
    def error(self) -> ErrorEstimate | None:
        """The largest of the estimates."""
        return reduce(worse, (one.error for one in self.beside)) if self.beside else None


def closer(plan: Plan) -> tuple[dict[str, float], float]:
    """Give the settings of a companion for runs that a study makes, and the factor from their difference to the error."""
    if plan.method.fixed_step:
        assert plan.case.step is not None
        parts = APART if _bends(plan) else HALVES
        step, factor = companion_step(plan.case.step, plan.method.order, parts)
        return {"step": step}, factor
    tolerance, factor = companion_tolerance(plan.case.tolerance)
    return {"tolerance": tolerance}, factor


def _bends(plan: Plan) -> bool:
    """Tell whether fixed steps pass over kinks: of derivatives, or impacts of steps that solve for contacts."""
    return plan.case.problem.bent or plan.method.name in SOLVING_CONTACTS


def trajectory_of(
    plan: Plan,
    dense: bool,
    progress: Progress | None,
    reader: Reader | None = None,
    before: Trajectory | None = None,
) -> Trajectory:
    """Run a plan; ``before``: a run of the same case and method, but for the longest step."""
    problem = plan.case.problem
    wanted = problem.narrow or problem.constraints or problem.scene is not None
    options = SolverOptions(
        plan.method.name,
        plan.case.tolerance,
        plan.nominal,
        plan.case.step,
        dense,
        plan.options.max_steps,
        plan.options.stiff_after,
        dense_kept=math.inf if wanted else DENSE_KEPT,
        reproducible=plan.options.reproducible,
        progress=progress,
        follower=plan.options.follower if reader is None else None,
        first_slice=None if before is None else slice_of(before.statistics),
        interrupted=plan.interrupted,
        like=None if before is None else before.solver,
        halves=reader is not None,
    )
    return run_kernel(plan.case, options, reader)


def estimate(
    plan: Plan, main: Trajectory, progress: Progress | None, listed: tuple[Check, ...] = ()
) -> Estimated:
    """Make the companion run, and compare.

    A kink near the end of a fixed step is near that of a step of half the size as well: both runs make the same error, and
    their difference shows nothing of it. Where derivatives have kinks, or steps solve for impacts within them, two companions end their steps elsewhere, and the
    larger estimate stands. ``listed``: checks that are looked at in them.
    """
    if not (plan.method.fixed_step and _bends(plan)):
        return _beside(plan, main, progress, HALVES, listed)
    first = _beside(plan, main, part_of(progress, 0.0, 0.5), APART, listed)
    if not first.beside:
        return first
    second = _beside(plan, main, part_of(progress, 0.5, 1.0), FARTHER, listed)
    if not second.beside:
        return second
    return Estimated(beside=first.beside + second.beside)


def _beside(
    plan: Plan, main: Trajectory, progress: Progress | None, parts: float, listed: tuple[Check, ...]
) -> Estimated:
    """Make one companion run, and compare. ``parts``: into how many its fixed steps divide those of the main run."""
    most: int | None = None
    if plan.method.fixed_step:
        assert plan.case.step is not None
        step, factor = companion_step(plan.case.step, plan.method.order, parts)
        tightened, steps = step, {"step": step}
    else:
        tightened, factor = companion_tolerance(plan.case.tolerance)
        steps = {"tolerance": tightened}
        most = max(FEW_STEPS, COMPANION_STEPS * main.statistics.steps)
    case = replace(plan.case, max_step=plan.case.max_step / 2, **steps)
    bounded = replace(plan, options=replace(plan.options, max_steps=most, stiff_after=None), case=case)

    def beside() -> Comparison:
        return Comparison(plan.case, main, plan.nominal, factor, listed, plan.options.storage)

    compared = beside()
    companion = trajectory_of(bounded, False, progress, compared, main)
    if most is not None and companion.failure is not None and companion.statistics.steps >= most:
        tightened, factor = looser_companion(plan.case.tolerance)
        options = replace(bounded.options, max_steps=None)
        unbounded = replace(bounded, options=options, case=replace(case, tolerance=tightened))
        compared = beside()
        companion = trajectory_of(unbounded, False, progress, compared)
    if companion.interrupted:
        return Estimated("the companion run was interrupted", interrupted=True)
    if companion.failure is not None:
        return Estimated(f"the companion run failed: {companion.failure.message}", failure=companion.failure)
    if (companion.terminated is None) is not (main.terminated is None):
        return Estimated(f"the companion run {_ending(companion)}, the main run {_ending(main)}")
    return Estimated(beside=(Beside(plan, compared, companion.statistics, tightened),))


def _ending(run: Trajectory) -> str:
    return "was followed to the stop" if run.terminated is None else f"was ended by '{run.terminated}'"


def doubts(
    plan: Plan,
    main: Trajectory,
    estimated: Estimated,
    drifts: tuple[ConstraintDrift, ...],
    *,
    as_stated: bool,
) -> tuple[tuple[Contradiction, ...], ErrorEstimate | None]:
    """Give the checks that contradict the estimated errors beside each companion, and these errors.

    Where a kink or a jump lies within a fixed step, the error is a matter of where: that of half the step may be as large by
    chance. So what contradicts the estimate of such a run is looked at again beside a further one, whose steps end at other
    places, and the larger of the estimates stands.
    """
    error = estimated.error
    if error is None:
        return (), None
    found = _shared_contradictions(plan, estimated, error, drifts, as_stated=as_stated)
    if not found or not plan.method.fixed_step:
        return found, error
    listed = checks(plan.case.problem, as_stated=as_stated)
    again = _beside(plan, main, None, HALVES if _bends(plan) else APART, listed)
    if again.error is None:
        return found, error
    told = {
        (one.kind, one.name)
        for one in _shared_contradictions(plan, again, again.error, drifts, as_stated=as_stated)
    }
    return tuple(one for one in found if (one.kind, one.name) in told), worse(error, again.error)


def _shared_contradictions(
    plan: Plan,
    estimated: Estimated,
    error: ErrorEstimate,
    drifts: tuple[ConstraintDrift, ...],
    *,
    as_stated: bool,
) -> tuple[Contradiction, ...]:
    """Give the checks that contradict the estimate beside each companion, in the words of the first."""
    first, *others = (
        contradictions(plan.case, one.pair, error, drifts, as_stated=as_stated) for one in estimated.beside
    )
    for other in others:
        names = {(one.kind, one.name) for one in other}
        first = tuple(one for one in first if (one.kind, one.name) in names)
    return first


Rows = tuple[Array, Array, "Array | None"]


class Comparison:
    """Reads a companion: how far its states are from those of the main run at the times that both have, and what the
    ``listed`` checks are in it. A model may end one run just before an output time and the other just after it: their last
    rows belong together.

    ``factor``: from a difference to an error, which is never below the growth of rounding errors. Rows of a short run are kept
    as they come, and looked at when somebody asks for the ``pair``.
    """

    def __init__(
        self,
        case: Case,
        main: Trajectory,
        nominal: Array,
        factor: float,
        listed: tuple[Check, ...],
        storage: Storage,
    ) -> None:
        self._case, self._main, self._nominal, self._factor, self._listed = (
            case,
            main,
            nominal,
            factor,
            listed,
        )
        self._storage = storage
        self._kept: list[tuple[int, Array, Array, Array | None]] = []
        self._keeps = main.y.size <= FEW_NUMBERS
        self._count = 0
        self._held: Rows | None = None

    def read(self, first: int, t: Array, y: Array, z: Array | None) -> None:
        """Take further rows of the companion, of which the first has the number ``first``."""
        if not t.size:
            return
        if self._keeps:
            self._kept.append((first, t.copy(), y.copy(), None if z is None else z.copy()))
        else:
            self._read(first, t, y, z)

    @cached_property
    def _theirs(self) -> Array:
        return self._storage.empty(self._main.t.size, len(self._listed))

    @cached_property
    def _floor(self) -> float:
        return EPSILON * math.sqrt(max(self._main.statistics.steps, 1))

    def _read(self, first: int, t: Array, y: Array, z: Array | None) -> None:
        """Compare all rows but the last one, which may be the last of all."""
        if self._held is None:
            self.largest = np.full(self._case.problem.ny, -np.inf)
        if self._held is not None:
            self._compare(first - 1, *self._held)
        self._compare(first, t[:-1], y[:-1], None if z is None else z[:-1])
        self._held = t[-1:].copy(), y[-1:].copy(), None if z is None else z[-1:].copy()
        self._count = first + t.size

    def pair(self, companion: Statistics, tolerance: float) -> Pair:
        """Compare the ends of both runs; give what the checks are looked at by."""
        for rows in self._kept:
            self._read(*rows)
        self._kept.clear()
        assert self._held is not None
        main, count = self._main, min(self._count, self._main.t.size)
        self.last = self._errors(main.y[-1:], self._held[1])[0]
        self.largest = np.maximum(self.largest, self.last)
        self._theirs[count - 1 : count] = values_of(self._case, self._listed, *self._held)
        steps = max(main.statistics.steps, companion.steps)
        z = None if main.happened is None else main.happened.grid_z
        return Pair(main.t, main.y, z, count, self._theirs[:count], steps, self._factor, tolerance)

    def _compare(self, first: int, t: Array, y: Array, z: Array | None) -> None:
        count = min(t.size, self._main.t.size - 1 - first)
        if count <= 0:
            return
        rows = slice(first, first + count)
        t, y, z = t[:count], y[:count], None if z is None else z[:count]
        self.largest = np.maximum(self.largest, self._errors(self._main.y[rows], y).max(axis=0))
        if self._listed:
            self._theirs[rows] = values_of(self._case, self._listed, t, y, z)
        passed(self._main.t, self._main.y, self._theirs)

    def _errors(self, ours: Array, theirs: Array) -> Array:
        size = self._nominal + np.abs(theirs)
        return np.asarray(np.maximum(self._factor * np.abs(ours - theirs) / size, self._floor))
