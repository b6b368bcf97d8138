"""Do the checks that every run makes agree with its estimated errors? Energy balance, momenta, constraints, closed
solutions.

A check is a function B(t, y) that a motion keeps: what it changes by is an error of the run, known without any estimate.
It contradicts the estimate where it is more than ``FACTOR`` times one of two bounds:

- what the errors that are stated for the states do to B, to first order: sum_i |dB/dy_i| e_i;
- the estimate for B itself, made like that of a state from the companion run: c |B(main) - B(companion)|, plus what
  rounding and the tolerance of the companion do to B. An error of the integration shrinks with the tolerance; a fault of
  the equations or of an account is the same in both runs, so that their difference does not hold it.

A balance of energy with accounts that is off by a share of the energies contradicts a run at a tight tolerance, or one by steps that solve
for contacts, whatever errors are stated.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ..case import Case
from ..delays import Y, delays_of
from ..memo import once
from ..methods import SOLVING_CONTACTS
from ..problem import Array, Problem
from ..rows import slices, taken
from .accuracy import EPSILON, ConstraintDrift, ErrorEstimate
from .doubts import Contradiction
from .evaluate import evaluate_rows

FACTOR = 10.0
"""What an estimate may be off by. With the second bound that is an error of which a run that is 100 times tighter
leaves more than nine tenths."""

HELD = 0.5
"""Share of what a check is off by that a tighter run keeps if that is not an error of the integration."""

MOST_POINTS, MOST_ROWS = 64, 40_000
"""Times at which derivatives of the checks are taken, and states that are evaluated for them."""
MOST_NUMBERS = 1_000_000
"""Numbers of such states that are there at once."""
FEWEST = 100
"""Steps whose rounding is allowed for where there are fewer: each of these holds many operations."""
SHARE = 1e-6
"""Of the size of a state: the step of a derivative; it is longer where the error is."""
CONDITION = 1e5
"""Of the equations of a projection: what magnifies rounding in a state that was projected (kernel, ``projection.c``)."""
TOUCH = 1e-9
"""Share of its sizes within which a contact counts as touching or at rest (kernel, ``rows.c`` and ``impulses.c``), whatever
the tolerance: as far it moves a state without a force."""
UNBALANCED, LOOSE = 0.01, 1e-5
"""Share of what the energies and their accounts reach by which a balance is not off in an honest run whose companion has no larger
tolerance than this, whatever errors are stated for the accounts: one of both runs has missed work that the other has seen."""


class Check(Struct, frozen=True):
    """What ought to stay: the sum of ``outputs`` by weight, less the state or output that it ought to equal.

    ``anchored``: it is zero all along; otherwise it stays what it is at the start.
    """

    kind: str
    name: str
    unit: str
    outputs: Mapping[int, float]
    states: Mapping[int, float]
    anchored: bool


class Pair(Struct, frozen=True, eq=False):
    """Both runs at the ``count`` times that they share, of which the last ones may differ: the rows of the main run (times,
    states, discrete variables, None without events), and the checks [count, k] of the companion."""

    t: Array
    y: Array
    z: Array | None
    count: int
    theirs: Array
    steps: int
    """Of the longer one of both runs."""
    factor: float
    """From their difference to the error of the main run."""
    tolerance: float
    """Of the companion, relative to the sizes of the states: what its single steps may be off by, and share with those of
    the main run. Zero for methods of fixed step, of which no step is the same in both."""

    def ours(self, rows: slice | NDArray[np.intp]) -> tuple[Array, Array, Array | None]:
        """Give rows of the main run; the last one is its end."""
        if isinstance(rows, slice) and rows.stop == self.count < self.t.size:
            rows = np.arange(rows.start, rows.stop)
        if isinstance(rows, slice):
            return self.t[rows], self.y[rows], None if self.z is None else self.z[rows]
        t, y, z = taken(np.where(rows == self.count - 1, self.t.size - 1, rows), self.t, self.y, self.z)
        assert t is not None and y is not None
        return t, y, z


def checks(problem: Problem, *, as_stated: bool) -> tuple[Check, ...]:
    """List what the motions of a problem keep; closed solutions hold for runs ``as_stated`` only."""
    return _always(problem) + (_as_stated(problem) if as_stated else ())


@once
def _always(problem: Problem) -> tuple[Check, ...]:
    found = []
    if problem.energy_balance:
        weights = zip(problem.energy_balance, (1.0, 1.0, -1.0), strict=True)
        unit = problem.outputs[problem.energy_balance[0]].unit
        balance = {i: w for i, w in weights if i >= 0}
        found.append(Check("energy", "energy balance", unit, balance, {}, anchored=False))
    for i in problem.conserved:
        q = problem.outputs[i]
        found.append(Check("momentum", q.name, q.unit, {i: 1.0}, {}, anchored=False))
    return tuple(found)


@once
def _as_stated(problem: Problem) -> tuple[Check, ...]:
    found = []
    states = {q.name: i for i, q in enumerate(problem.states)}
    outputs = {q.name: i for i, q in enumerate(problem.outputs) if q.kind != "exact"}
    for i, q in enumerate(problem.outputs):
        if q.kind != "exact":
            continue
        name = q.name.removeprefix("exact(")[:-1]
        same_state = {states[name]: -1.0} if name in states else {}
        same_output = {} if name in states else {outputs[name]: -1.0}
        found.append(
            Check("closed solution", name, q.unit, {i: 1.0} | same_output, same_state, anchored=True)
        )
    return tuple(found)


def contradictions(
    case: Case,
    pair: Pair,
    estimate: ErrorEstimate,
    drifts: tuple[ConstraintDrift, ...],
    *,
    as_stated: bool,
) -> tuple[Contradiction, ...]:
    """Return the checks of a run that contradict its estimated errors."""
    made = compared(case, pair, estimate, drifts, as_stated=as_stated)
    return tuple(one for one, ratio in made if ratio > FACTOR)


def compared(
    case: Case,
    pair: Pair,
    estimate: ErrorEstimate,
    drifts: tuple[ConstraintDrift, ...],
    *,
    as_stated: bool,
) -> list[tuple[Contradiction, float]]:
    """Compare every check with the estimated errors: what would be said of it, and the largest ratio of both."""
    listed = checks(case.problem, as_stated=as_stated)
    found = [_constraint(drift, estimate) for drift in drifts]
    if listed and pair.count > 1:
        allowed = scales(case, listed, pair, estimate)
        most = _most(case, listed, pair, estimate)
        looks = [
            Look(check, pair.factor, *scale, least, steps=case.method in SOLVING_CONTACTS)
            for check, scale, least in zip(listed, allowed, most, strict=True)
        ]
        for rows in slices(pair.count, pair.t, pair.y, pair.z, pair.theirs):
            at = pair.ours(rows)
            ours = values_of(case, listed, *at)
            for k, look in enumerate(looks):
                look.read(at[0], ours[:, k], pair.theirs[rows, k])
        found += [look.told() for look in looks]
    return found


def _most(case: Case, listed: tuple[Check, ...], pair: Pair, estimate: ErrorEstimate) -> list[float]:
    """Give what each check may be off by over ``FACTOR``: of a balance with accounts a share of what it is made of."""
    accounts = [i for i, q in enumerate(case.problem.states) if q.kind == "account"]
    steps = case.method in SOLVING_CONTACTS
    if not accounts or not (steps or 0 < pair.tolerance <= LOOSE):
        return [math.inf] * len(listed)
    reached = [
        float(np.abs(pair.y[:, i]).max()) + estimate.nominal[case.problem.states[i].name] for i in accounts
    ]
    if steps:  # these book the work of contacts with what they do, so that it is that of all that moves
        reached += _kinetic(case.problem, *pair.ours(_some(pair, MOST_POINTS)), case)
    if not all(math.isfinite(size) for size in reached):
        return [math.inf] * len(listed)
    return [UNBALANCED * max(reached) / FACTOR if check.kind == "energy" else math.inf for check in listed]


def _some(pair: Pair, count: int) -> NDArray[np.intp]:
    """Return so many rows at most, with both ends."""
    return np.linspace(0, pair.count - 1, min(count, pair.count)).astype(int)  # at least 1 apart


def _kinetic(problem: Problem, t: Array, y: Array, z: Array | None, case: Case) -> list[float]:
    """Return the largest kinetic energy at some states, where it is told."""
    found = [i for i, q in enumerate(problem.outputs) if q.name == "energy.kinetic"]
    return [_largest(np.abs(evaluate_rows(case, "outputs", t, y, z)[:, i])) for i in found]


def _constraint(drift: ConstraintDrift, estimate: ErrorEstimate) -> tuple[Contradiction, float]:
    """Compare what a further projection would change with the largest error: both are relative to the same sizes."""
    expected = estimate.largest + max(drift.rounding, CONDITION * EPSILON)
    made = Contradiction("constraints", drift.level, "1", drift.after, FACTOR * expected, None, None)
    return made, drift.after / expected


class Look:
    """Compares one check of both runs, a slice after the other, with what the ``stated`` errors do to it, what both
    runs ``shared``, and the ``most`` that it may be off by whatever the errors."""

    def __init__(
        self, check: Check, factor: float, stated: float, shared: float, most: float, *, steps: bool
    ) -> None:
        self._check, self._factor, self._stated, self._shared = check, factor, stated, shared
        self._most, self._steps = most, steps
        self._anchors: tuple[Array, Array] | None = None
        self._own = 0.0
        self._ratio = 0.0
        self._since: float | None = None
        self._worst = (0.0, 0.0, 0.0)

    def read(self, t: Array, ours: Array, theirs: Array) -> None:
        defined = np.isfinite(ours) & np.isfinite(theirs)
        t, ours, theirs = t[defined], ours[defined], theirs[defined]
        if not t.size:
            return
        if not self._check.anchored:
            self._anchors = self._anchors or (ours[:1].copy(), theirs[:1].copy())
            ours, theirs = ours - self._anchors[0], theirs - self._anchors[1]
        off = np.abs(ours)
        own = np.maximum(np.maximum.accumulate(self._factor * np.abs(ours - theirs)), self._own)
        self._own = float(own[-1])
        expected = np.minimum(min(self._stated, self._most), own + self._shared)
        ratio = np.divide(off, expected, out=np.where(off > 0, np.inf, 0.0), where=expected > 0)
        self._ratio = max(self._ratio, _largest(ratio))
        beyond = np.flatnonzero(ratio > FACTOR)
        if not beyond.size:
            return
        if self._since is None:
            self._since = float(t[beyond[0]])
        at = int(beyond[np.argmax(off[beyond])])
        if off[at] > self._worst[0]:
            self._worst = float(off[at]), float(expected[at]), float(np.abs(theirs[at]))

    def told(self) -> tuple[Contradiction, float]:
        check = self._check
        if self._since is None:
            return Contradiction(check.kind, check.name, check.unit, 0.0, 0.0, None, None), self._ratio
        off, expected, theirs = self._worst
        kind, persists = check.kind, theirs > HELD * off
        if expected == self._most:
            steps = True if self._steps else None
            return Contradiction(
                "work", check.name, check.unit, off, FACTOR * expected, self._since, steps
            ), self._ratio
        return Contradiction(
            kind, check.name, check.unit, off, FACTOR * expected, self._since, persists
        ), self._ratio


def values_of(case: Case, listed: tuple[Check, ...], t: Array, y: Array, z: Array | None) -> Array:
    """Give the checks [n, k] at times [n] and states [n, ny]."""
    outputs = evaluate_rows(case, "outputs", t, y, z)
    columns = []
    for check in listed:
        parts = [w * outputs[:, i] for i, w in check.outputs.items()]
        parts += [w * y[:, i] for i, w in check.states.items()]
        columns.append(sum(parts[1:], start=parts[0]))
    return np.array(columns).T


def scales(
    case: Case, listed: tuple[Check, ...], pair: Pair, estimate: ErrorEstimate
) -> list[tuple[float, float]]:
    """Give for each check the largest sum_i |dB/dy_i| e_i, for the stated errors, and for those that both
    runs share."""
    problem = case.problem
    ny = problem.ny
    count = int(np.clip(MOST_ROWS // (2 * (ny + 1)), 4, MOST_POINTS))
    t, y, z = pair.ours(_some(pair, count))
    names = [q.name for q in problem.states]
    floor = EPSILON * np.sqrt(max(pair.steps, FEWEST))  # rounding adds up like a random walk
    size = np.array([estimate.nominal[n] for n in names]) + np.abs(y)
    error = np.array([estimate.by_state[n] for n in names]) * size
    # a check of what depends on time feels the rounding of time
    error, size = (np.column_stack([e, s]) for e, s in ((error, np.abs(t)), (size, np.abs(t))))
    error[:, ny] = floor * np.abs(t)
    step = np.maximum(error, SHARE * size)
    slopes = _slopes(case, listed, (t, y, z), step)
    stated = (slopes * error[:, :, None]).sum(axis=1)
    shared = (slopes[:, :ny] * ((pair.tolerance + floor) * size[:, :ny, None])).sum(axis=1)
    shared += slopes[:, ny] * error[:, ny:]
    outputs = np.abs(evaluate_rows(case, "outputs", t, y, z))
    terms = [outputs[:, [*check.outputs]].sum(axis=1) for check in listed]
    own = floor * np.array([_largest(term) for term in terms])
    if problem.hybrid is not None and problem.hybrid.rows:
        moved = slice(problem.nq + problem.nv)
        own += TOUCH * (slopes[:, moved] * size[:, moved, None]).sum(axis=1).max(axis=0)
    return [(_largest(stated[:, k]) + own[k], _largest(shared[:, k]) + own[k]) for k in range(len(listed))]


def spread(case: Case, rows: tuple[Array, Array, Array | None], estimate: ErrorEstimate, steps: int) -> Array:
    """Give [n_outputs] what the errors that are stated for the states do to each output, at most, at times [n], states
    [n, ny] and discrete variables."""
    t, y, z = rows
    listed = tuple(
        Check("output", q.name, q.unit, {i: 1.0}, {}, anchored=True)
        for i, q in enumerate(case.problem.outputs)
    )
    pair = Pair(t, y, z, t.size, np.empty((t.size, 0)), steps, 1.0, 0.0)
    return np.array([stated for stated, _ in scales(case, listed, pair, estimate)])


def _slopes(
    case: Case, listed: tuple[Check, ...], at: tuple[Array, Array, Array | None], step: Array
) -> Array:
    """Give |dB/dy_i| [n, ny + 1, k] by differences to both sides, the larger one; the last is the derivative by time."""
    t, y, z = at
    n, many = step.shape
    delays = delays_of(case.functions, case.p)
    here = values_of(case, listed, t, y, z)
    slopes = np.zeros((n, many, here.shape[1]))
    at_once = max(1, MOST_NUMBERS // (2 * n * many))
    for begin in range(0, many, at_once):
        part = slice(begin, min(begin + at_once, many))
        which = range(part.start, part.stop)
        moved = np.zeros((n, 2, len(which), many))
        for k in which:
            moved[:, 0, k - begin, k], moved[:, 1, k - begin, k] = step[:, k], -step[:, k]
        states = (y[:, None, None, :] + moved[..., :-1]).reshape(-1, many - 1)
        times = (t[:, None, None] + moved[..., -1]).ravel()
        held = None if z is None else np.repeat(z, 2 * len(which), axis=0)
        if held is not None and delays is not None:  # what was is off by as much as what is
            shifts = moved.reshape(-1, many)
            for place, source, _ in delays.delayed:
                array, index = delays.sources[source]
                if array == Y:
                    held[:, place] += shifts[:, index]
        there = values_of(case, listed, times, states, held)
        change = np.abs(there.reshape(n, 2, len(which), -1) - here[:, None, None, :]).max(axis=1)
        width = step[:, part, None]
        slopes[:, part] = np.divide(change, width, out=np.zeros(change.shape), where=width > 0)
    return slopes


def _largest(values: Array) -> float:
    """Largest value; infinite where a check is undefined beside the motion, so that nothing contradicts it."""
    found = float(values.max(initial=0.0))
    return math.inf if math.isnan(found) else min(found, sys.float_info.max)
