"""A start moved by tiny amounts of several sizes: does what becomes of it shrink with them?

Of a motion that its start determines the difference shrinks in proportion to the shake, or like its root where something is
grazed, however fast it grows: a chaotic motion is one of these. Where it stays as large, whatever the size, the equations have several
solutions there, or an edge parts them, and the one that a run takes is decided by its method.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ..compiler.metamorphic.perturbed_start import LIFT, SHAKE
from ..compiler.metamorphic.twin import Twin
from ..runtime.outcome import SimulationError
from ..runtime.problem import Array
from ..runtime.results.solution import Solution
from ..runtime.studies.runs.simulate import run_from
from ..session import plan
from .metamorphic import NEAR, Base, posed

SIZES = (1e-8, 1e-6, 1e-4)
"""Of the shakes, as shares of what errors are measured against: above 1e-9, within which a contact touches."""
SERIES: Mapping[str, tuple[float, ...]] = {SHAKE: (1.0, -1.0), LIFT: (1.0,)}
"""Signs of the shakes by parameter: what is closed cannot be closed further."""
TIGHT = 1e-10
"""Tolerance of these runs, well below the smallest shake."""
LATER = 100.0
"""Share of what a difference comes to, below which it is compared with those of larger shakes: these have not reached it
either then, however fast they grow."""
ALIKE = 3.0
"""How many times a difference may grow where the shake does a hundred times, and the start determines nothing: the root of a
hundred is ten."""
SEEN = 1e-3
"""Share of what a coordinate does below which a difference does not matter."""
GROWN = 1e3
"""Smallest shakes below which a difference is one of the runs themselves."""
POINTS, HALVINGS = 2000, 50
COSTLY, AT_LEAST = 20, 2000
"""A shaken run that takes more steps than so many times those of the model, and so many more, is looked at up to there."""


class Parting(Struct, frozen=True):
    """How far the coordinate ``name`` comes to be ``apart`` for the smallest shake, over its size, and the ``growth`` of that where the
    shake grows a hundred times, ``at`` the time when it has become a hundredth of that; ``tied``: an event parts it, after the start."""

    name: str
    apart: float
    growth: float
    at: float
    tied: bool

    @property
    def determined(self) -> bool:
        """Whether it shrinks with the shake."""
        return self.growth > ALIKE

    def words(self) -> str:
        """Say what was seen."""
        if self.determined:
            return f"{self.name} comes to be {self.apart:.1e} apart if the start is moved by {SIZES[0]:g}: it is unstable"
        much = (
            f"{self.name} comes to be {self.apart:.1e} apart, a hundredth of it by t = {self.at:.6g}, whether the start is moved "
            f"by {SIZES[0]:g} or {SIZES[1]:g}"
        )
        if self.tied:
            return f"{much}: what happens at once there decides"
        return f"{much}: the motion is not determined by its start"


class Shaken(Struct, frozen=True):
    """``series`` of shaken starts that ran, and what has come apart there."""

    series: int
    partings: tuple[Parting, ...]

    @property
    def worst(self) -> Parting | None:
        """What tells most: what is not determined, by the start itself before events, and what comes farthest apart."""
        return max(self.partings, key=lambda p: (not p.determined, not p.tied, p.apart), default=None)


def shaken(twin: Twin, base: Base, begin: Callable[[], None]) -> Shaken:
    """Run a twin from starts moved by tiny amounts, and compare; ``begin`` is called before each run. Raises SimulationError where
    the start itself cannot run."""
    begin()
    still = _run(twin, base, {})
    count, found = 0, []
    for name in twin.shakes:
        for sign in SERIES[name]:
            runs = []
            try:
                for size in SIZES:
                    begin()
                    runs.append(_run(twin, base, {name: sign * size}))
            except SimulationError:  # what is closed is hit, or cannot be opened
                continue
            count += 1
            found += _partings(base, still, runs)
    return Shaken(count, tuple(found))


def _run(twin: Twin, base: Base, shakes: Mapping[str, float]) -> Solution:
    """Run a twin as the model was run, but tightly; up to where it fails, or gets too costly."""
    model, request = posed(twin, base, shakes)
    done = base.solution.statistics
    changes: dict[str, object] = {}
    if not base.plan.method.fixed_step:
        changes["tolerance"] = min(base.plan.case.tolerance, TIGHT)
    if done.jacobians:
        changes["method"] = done.method
    made = plan(model, request.changed(estimate_error=False, **changes))
    options = replace(made.options, max_steps=COSTLY * done.steps + AT_LEAST)
    solution = run_from(replace(made, options=options), made.case.y0, made.case.z)
    if solution.time.size < 2:
        raise SimulationError(solution.message)
    return solution


def _partings(base: Base, still: Solution, runs: Sequence[Solution]) -> list[Parting]:
    """Compare shaken motions with the one that is not, coordinate by coordinate, up to where the first of them ends."""
    begin, end = base.plan.case.begin, min(float(s.time[-1]) for s in (still, *runs))
    times = np.linspace(begin, end, POINTS)
    problem = still.problem
    columns = [k for k, q in enumerate(problem.states) if q.kind in ("coordinate", "state")]
    estimate = base.solution.accuracy.error
    assert estimate is not None

    def states(t: Array) -> list[Array]:
        found = []
        for solution in (still, *runs):
            assert solution.motion.states_at is not None
            found.append(solution.motion.states_at(t)[0][:, columns])
        return found

    def apart_at(t: float) -> Array:
        first, *others = states(np.array([t]))
        return np.array([np.abs(other - first)[0] for other in others])

    first, *others = states(times)
    apart = np.array([np.maximum.accumulate(np.abs(other - first), axis=0) for other in others])
    near = NEAR * (end - begin)
    happened = min((float(e.time) for e in still.events if e.time > begin + near), default=np.inf)
    before = max(int(np.searchsorted(times, happened)) - 1, 0)
    found = []
    for k, column in enumerate(columns):
        name = problem.states[column].name
        if any(_jumps(solution, column) for solution in (still, *runs)):
            continue
        does = max(float(np.ptp(x[:, k])) for x in (first, others[0]))
        reached = float(np.abs(first[:, k]).max())
        # without mass, other coordinates may be states than in the model
        size = estimate.nominal.get(name, reached)
        most = float(apart[0, -1, k])
        if most <= max(SEEN * does, GROWN * SIZES[0] * size):
            continue
        level = most / LATER
        after = int(np.argmax(apart[0, :, k] >= level))
        earlier = max(after - 1, 0)
        low, high = times[earlier], times[after]
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            low, high = (low, middle) if apart_at(middle)[0, k] >= level else (middle, high)
        now = np.maximum(apart_at(high)[:, k], apart[:, earlier, k])
        early = apart[:, before, k]
        tied = happened <= high + near and not LATER * SIZES[0] * size < early[0] > early[1] / ALIKE
        found.append(Parting(name, most / size, float(now[1] / now[0]), float(high), bool(tied)))
    return found


def _jumps(solution: Solution, column: int) -> bool:
    """Whether a state is set again at an instant: it then differs as much, but only shortly."""
    t, y = solution.time, solution[solution.problem.states[column].name]
    twice = np.flatnonzero(t[1:] == t[:-1])
    return bool(np.any(np.abs(y[twice + 1] - y[twice]) > SEEN * (np.ptp(y) if y.size else 0.0)))
