"""A periodic orbit followed over a parameter: steps that the bend of the branch and the multipliers allow, and what lies between.

Multipliers that are 1 for every orbit (of a shift along it, and of an energy that it keeps) are taken away by their vectors. What is
left is judged by test functions (Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, ch. 10): the products of m + 1, of m - 1,
and of m m' - 1, each with its error. A change of sign that is larger than the errors is located as a root. Where an event joins or
leaves the orbit, the branch of fewer events is followed up to where it ends.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np
import scipy.optimize
from msgspec import Struct
from msgspec.structs import replace

from ...integrate.kernel_run import run_kernel
from ...integrate.solver import SolverOptions
from ...numerics.continuation import Reached, follow, located
from ...numerics.rank import MOTIONS, null_space
from ...outcome import SimulationError
from ...problem import Array
from ..runs.simulate import Plan
from .linearised import Linearised, LinearMap, multipliers
from .shooting import OrbitEnergy, Shooter, ShootingOrbit, close

BEND, CHANGE = 0.3, 0.3
"""Of a step: how far its end may lie from where the last one points to, and how far multipliers may move, relative to 1 and their
size."""
CLOSE = 1e-4
"""In nominal sizes: so far apart are two orbits at one value that still count as the same."""
SHORTEST, LOCATED = 1e-5, 1e-11
"""Steps in shares of the range, and how well what lies between is located."""
CLOSING = 1e-6
"""Relative error of multipliers, as orbits close within 1e-8: those of conservative models lie on the unit circle within that."""
FOLDING = 0.2
"""A branch that ends with a multiplier as near as that to 1 may end in a fold."""
CAREFUL = 1e-3
"""Of the range: in longer steps the test of a fork goes on as it did, so that they do not leave for another branch of it."""
MOST_STEPS = 4000
ARRIVED = "the value is reached"
IMPACTS = ("impact", "rest", "lift-off", "crossing", "reflection")

NEIGHBOURS = 1e-7
"""In shares of the range: two orbits must be farther apart to point to a third."""

Happened = tuple[tuple[str, str], ...]
"""Name and kind of each event of one round, sorted."""


class FollowedPlace(Struct, frozen=True, eq=False):
    """An orbit at a value of the parameter, its multipliers without trivial ones, their errors, and the events of one round."""

    value: float
    orbit: ShootingOrbit
    multipliers: Array
    errors: Array
    happened: Happened
    first: bool = False
    """Whether it does not go on from the one before."""


class OrbitBifurcation(Struct, frozen=True):
    """``kind``: period doubling, fold, fork, torus, grazing, change of events, or jump; ``between`` two values."""

    kind: str
    value: float
    between: tuple[float, float]
    note: str = ""


def special_words(one: OrbitBifurcation, name: str) -> str:
    """Say what happens to orbits over a parameter, and where."""
    low, high = one.between
    if one.kind == "jump":
        return f"jump to another orbit between {name} = {low:.6g} and {high:.6g}: no step stays on the branch"
    return f"{one.kind} at {name} = {one.value:.10g}{f': {one.note}' if one.note else ''}"


class Follower:
    """Follows orbits. ``planned``: the model at a value; ``length``: the period that is given there, None where it is free. ``kept``:
    the energy of all orbits, where they lie in families."""

    def __init__(
        self,
        linear: Linearised,
        planned: Callable[[float], Plan],
        length: Callable[[Plan], float | None],
        span: float,
        *,
        free: bool,
    ) -> None:
        self.linear, self.planned, self.length = linear, planned, length
        self.span, self.free = span, free
        self.kept: OrbitEnergy | None = None
        self.certain: dict[str, FollowedPlace] = {}
        self.specials: list[OrbitBifurcation] = []
        self.steps = 0

    # ------------------------------------------------------------ one orbit

    def at(self, value: float, start: Array, period: float) -> FollowedPlace:
        """Give the orbit at a value near a start. Raises SimulationError where none is found."""
        plan = self.planned(value)
        linear = self.linear.renewed(plan)
        given = self.length(plan)
        orbit = close(
            linear, start, period if self.free or given is None else given, free=self.free, energy=self.kept
        )
        return self.told(value, linear, orbit)

    def told(self, value: float, linear: Linearised, orbit: ShootingOrbit) -> FollowedPlace:
        found, errors = multipliers(self._reduced(linear, orbit))
        errors = np.maximum(errors, CLOSING * np.maximum(1.0, np.abs(found)))
        self.linear.memory = linear.memory
        return FollowedPlace(value, orbit, found, errors, _happened(linear, orbit.whole, orbit.period))

    def _reduced(self, linear: Linearised, orbit: ShootingOrbit) -> LinearMap:
        """Give the linear map without the directions in which it is 1 for every orbit."""
        found = orbit.map
        vectors = []
        if self.free:
            along = Shooter(linear, True, None).rate(linear.tangents.case.begin, orbit.whole, found.z)
            vectors.append(found.directions.T @ along)
        if self.kept is not None:
            space = found.directions[linear.kept]
            vectors.append(Shooter(linear, self.free, self.kept).energy_row(orbit.whole, space, self.kept)[0])
        vectors = [v / np.linalg.norm(v) for v in vectors if np.linalg.norm(v) > 0]
        if not vectors:
            return found
        left = null_space(np.array(vectors), MOTIONS)
        error = np.abs(left.T) @ found.error @ np.abs(left)
        return replace(found, matrix=left.T @ found.matrix @ left, error=error)

    # ------------------------------------------------------------ along the branch

    def reach(self, places: list[FollowedPlace], target: float) -> str:
        """Add the orbits up to a value, where the branch leads there, else the one that is found there; tell why there is none."""
        passed, failure = self.go(places[-2] if len(places) > 1 else None, places[-1], target)
        places += passed
        last = places[-1]
        if last.value == target:
            return ""
        other = None
        try:
            other = self.at(target, last.orbit.whole, last.orbit.period)
        except SimulationError as found:
            failure = found.message
        if other is not None and other.happened != last.happened:
            crossed = self._across(places[-2] if len(places) > 1 else None, last, other)
            if crossed is not None:
                places += crossed
                return ""
        grazed = self._grazes(places[-2] if len(places) > 1 else None, last, target)
        folded = self.fold(places) if grazed is None else None
        if grazed is not None and grazed is not last:
            places.append(grazed)
        if folded is not None:
            self.specials.append(OrbitBifurcation("fold", folded, _ordered(last.value, target)))
        if other is None:
            if grazed is not None:
                return "no orbit was found near that has the event"
            return failure if folded is None else "the branch turns back in the fold"
        self.specials.append(OrbitBifurcation("jump", target, _ordered(last.value, target)))
        self.certain = {}
        places.append(replace(other, first=True))
        return ""

    def go(
        self, before: FollowedPlace | None, last: FollowedPlace, target: float
    ) -> tuple[list[FollowedPlace], str]:
        """Follow the branch from an orbit to a value; give the orbits on the way, and why it does not get there."""
        failure = ""

        def advance(points: Sequence[FollowedPlace], length: float) -> Reached[FollowedPlace] | None:
            nonlocal failure
            self.steps += 1
            if self.steps > MOST_STEPS:
                return Reached([], end=f"more than {MOST_STEPS} steps")
            before, last = points[-2] if len(points) > 1 else None, points[-1]
            left = target - last.value
            value = target if length >= abs(left) * (1 - 1e-9) else last.value + math.copysign(length, left)
            y, period = _guess(before, last, value)
            try:
                here = self.at(value, y, period)
            except SimulationError as found:
                failure = found.message
                return None
            if here.happened != last.happened and self._apart(here, y) <= CLOSE + BEND * (
                self._apart(last, y) + self._apart(here, last.orbit.whole)
            ):
                crossed = self._across(before, last, here)
                if crossed is not None:
                    return Reached(crossed, math.inf, ARRIVED if crossed[-1].value == target else "")
            if here.happened != last.happened or not self._near(before, last, here, y):
                return None
            if abs(value - last.value) > CAREFUL * self.span and _turned_off(before, last, here):
                return None
            self._between(last, here)
            return Reached([here], 2.0, ARRIVED if value == target else "")

        begun = [last] if before is None else [before, last]
        whole = abs(target - last.value)
        if not whole:
            return [], ""
        points, why = follow(
            begun, advance, first=whole, shortest=SHORTEST * self.span, longest=whole, most=2 * MOST_STEPS
        )
        passed = points[len(begun) :]
        if why == ARRIVED or why.startswith("more"):
            return passed, "" if why == ARRIVED else why
        return passed, failure or "other orbits alone lie beyond"

    def _apart(self, place: FollowedPlace, start: Array) -> float:
        shooter = Shooter(self.linear, self.free, None)
        return float(np.linalg.norm(shooter.gap(start, place.orbit.whole)[self.linear.kept]))

    def _near(
        self, before: FollowedPlace | None, last: FollowedPlace, here: FollowedPlace, guess: Array
    ) -> bool:
        """Whether an orbit goes on from the one before: it lies where that pointed to, and multipliers have moved little."""
        moved = self._apart(here, last.orbit.whole)
        if before is not None and not last.first and self._apart(here, guess) > CLOSE + BEND * moved:
            return False
        if len(here.multipliers) != len(last.multipliers):
            return False
        apart = np.abs(here.multipliers[:, None] - last.multipliers)
        rows, columns = scipy.optimize.linear_sum_assignment(apart)
        allowed = CHANGE * np.maximum(1.0, np.abs(here.multipliers)) + here.errors + last.errors[columns]
        return bool((apart[rows, columns] <= allowed).all())

    # ------------------------------------------------------------ what lies between

    def _between(self, a: FollowedPlace, b: FollowedPlace) -> None:
        """Note where test functions change their sign between two orbits."""
        for kind, test in TESTS.items():
            first = self.certain.get(kind, a)
            (one, off), (two, beyond) = test(first), test(b)
            if not abs(two) > beyond:
                continue
            self.certain[kind] = b
            alike = kind != "torus" or _pairs(first) == _pairs(b)
            if one * two < 0 and abs(one) > off and alike:
                root = self._located(test, first, b)
                self.specials.append(OrbitBifurcation(kind, root, _ordered(first.value, b.value)))

    def _located(self, test: Test, a: FollowedPlace, b: FollowedPlace) -> float:
        """Give the value at which a test function vanishes between two orbits.

        Guesses go through the nearest orbits found: in a fork Newton's method leaves what a guess is off by towards the other branches.
        """
        known = [a, b]

        def at(value: float) -> FollowedPlace | None:
            near = sorted(known, key=lambda place: abs(place.value - value))
            try:
                known.append(self.at(value, *_guess(near[1], near[0], value)))
            except SimulationError:
                return None
            return known[-1]

        found = located(at, lambda place: test(place)[0], a.value, b.value, LOCATED * self.span)
        if found is not None:
            return found.value
        one, two = abs(test(a)[0]), abs(test(b)[0])
        return a.value + (b.value - a.value) * one / (one + two)

    def _across(
        self, before: FollowedPlace | None, last: FollowedPlace, here: FollowedPlace
    ) -> list[FollowedPlace] | None:
        """Cross a value at which events join or leave the orbit: give the orbits from the last one to the one after it."""
        # the orbit of fewer events is smooth up to its end
        forwards = len(last.happened) <= len(here.happened)
        simple, other = (last, here) if forwards else (here, last)
        simple, end = self._end(before if forwards else None, simple, other.value)
        specials, self.specials, self.certain = self.specials, [], {}
        start, aim = (here, end) if forwards else (last, simple.value)
        aim += math.copysign(SHORTEST * self.span, start.value - aim)
        route: list[FollowedPlace] = []
        if (
            abs(start.value - aim) > SHORTEST * self.span
            and (start.value - aim) * (start.value - simple.value) > 0
        ):
            route, _ = self.go(None if forwards else before, start, aim)
        reached = route[-1] if route else start
        found, self.specials, self.certain = self.specials, specials, {}
        gap = self._apart(reached, simple.orbit.whole)
        left = abs(reached.value - simple.value) / self.span
        # an impact that grazes begins with the root of the distance in the parameter
        if gap > JOINED * math.sqrt(max(left, SHORTEST)) * self._size(simple):
            return None
        self.specials += found
        self._event(simple.value, _ordered(last.value, here.value), last.happened, here.happened)
        if forwards:
            return [simple, *reversed(route), here]
        return [*route, simple, here]

    def _end(
        self, before: FollowedPlace | None, last: FollowedPlace, end: float
    ) -> tuple[FollowedPlace, float]:
        """Follow an orbit with its events towards a value as far as it goes; give the last one, and a value just beyond."""
        while abs(end - last.value) > LOCATED * self.span:
            middle = (last.value + end) / 2
            try:
                tried = self.at(middle, *_guess(before, last, middle))
                same = tried.happened == last.happened
            except SimulationError:
                same = False
            if not same:
                end = middle
                continue
            if abs(tried.value - last.value) > NEIGHBOURS * self.span:
                before = last
            last = tried
        return last, end

    def _event(self, value: float, between: tuple[float, float], one: Happened, other: Happened) -> None:
        """Note that events join or leave the orbit."""
        gone = Counter(one)
        gone.subtract(Counter(other))
        changed = [event for event, count in gone.items() if count]
        kind = "grazing" if any(event[1] in IMPACTS for event in changed) else "change of events"
        names = ", ".join(sorted({f"{event[1]} '{event[0]}'" for event in changed}))
        self.specials.append(OrbitBifurcation(kind, value, between, names))

    def _grazes(
        self, before: FollowedPlace | None, last: FollowedPlace, target: float
    ) -> FollowedPlace | None:
        """Give the last orbit of a branch that ends where the motion just beyond meets another event; None where it meets none."""
        value = last.value + math.copysign(2 * SHORTEST * self.span, target - last.value)
        y, period = _guess(before, last, value)
        plan = self.planned(value)
        try:
            there = _happened(self.linear.renewed(plan), y, period)
        except SimulationError:
            return None
        if there == last.happened:
            return None
        last, _ = self._end(before, last, value)
        self._event(last.value, _ordered(last.value, target), last.happened, there)
        return last

    def _size(self, place: FollowedPlace) -> float:
        return max(
            1.0, float(np.linalg.norm(place.orbit.start / np.maximum(self.linear.tangents.nominal, 1e-300)))
        )

    def fold(self, places: list[FollowedPlace]) -> float | None:
        """Give the value at which a branch that ended folds: there the square of m - 1 vanishes; None where it does not."""
        near = [(p.value, min(p.multipliers, key=lambda m: abs(m - 1), default=0.0)) for p in places[-3:]]
        if len(near) < 2 or abs(near[-1][1] - 1) > FOLDING or not abs(near[-1][1] - 1) < abs(near[-2][1] - 1):
            return None
        (p, m), (q, n) = near[-2:]
        one, two = float(abs(m - 1)) ** 2, float(abs(n - 1)) ** 2
        root = q + (q - p) * two / (one - two)
        return root if abs(root - q) <= 4 * SHORTEST * self.span else None


JOINED = 30.0
"""How far two orbits on both sides of a grazing impact may be apart, over the root of the distance in the parameter."""

Test = Callable[[FollowedPlace], tuple[float, float]]


def _guess(before: FollowedPlace | None, last: FollowedPlace, value: float) -> tuple[Array, float]:
    """Give state and period where the last two orbits point to."""
    if before is None or last.first or before.value == last.value:
        return last.orbit.whole, last.orbit.period
    share = (value - last.value) / (last.value - before.value)
    y = last.orbit.whole + share * (last.orbit.whole - before.orbit.whole)
    return y, last.orbit.period + share * (last.orbit.period - before.orbit.period)


def _turned_off(before: FollowedPlace | None, last: FollowedPlace, here: FollowedPlace) -> bool:
    """Whether the test of a fork has another sign than before it led to: near a fork the other branches are near, too."""
    if before is None or last.first or before.value == last.value:
        return False
    (one, _), (two, off), (found, _) = _one(before), _one(last), _one(here)
    share = (here.value - last.value) / (last.value - before.value)
    return abs(two) > off and (two + share * (two - one)) * found < 0


def _happened(linear: Linearised, start: Array, period: float) -> Happened:
    """Give name and kind of all events in one round, sorted."""
    tangents = linear.tangents
    case = tangents.case
    if case.problem.hybrid is None:
        return ()
    stop = case.begin + period
    y, z = linear.split(start)
    case = replace(case, y0=y, z=z, wanted=y, assembled=None, grid=np.array([stop]), stop=stop)
    step = case.step if tangents.recording.fixed_step else None
    record = run_kernel(
        case, SolverOptions(tangents.recording.name, tangents.tolerance, tangents.nominal, step)
    ).happened
    return () if record is None else tuple(sorted((event.name, event.kind) for event in record.events))


def _ordered(a: float, b: float) -> tuple[float, float]:
    return min(a, b), max(a, b)


def _product(factors: Array, errors: Array) -> tuple[float, float]:
    """Give the product of factors, and how far it may be off."""
    off = sum(
        (float(e) * float(np.abs(np.prod(np.delete(factors, k)))) for k, e in enumerate(errors)), start=0.0
    )
    return float(np.prod(factors).real), off


def _doubling(place: FollowedPlace) -> tuple[float, float]:
    return _product(place.multipliers + 1, place.errors)


def _one(place: FollowedPlace) -> tuple[float, float]:
    return _product(place.multipliers - 1, place.errors)


def _torus(place: FollowedPlace) -> tuple[float, float]:
    """Give the product of |m|^2 - 1 of complex pairs; a pair that is real cannot leave the unit circle together."""
    m, errors = place.multipliers, place.errors
    pairs = np.flatnonzero(m.imag > 0)
    return _product(np.abs(m[pairs]) ** 2 - 1, 2 * np.abs(m[pairs]) * errors[pairs])


def _pairs(place: FollowedPlace) -> int:
    return int((place.multipliers.imag > 0).sum())


TESTS: dict[str, Test] = {"period doubling": _doubling, "fork": _one, "torus": _torus}
