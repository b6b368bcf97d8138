"""Nominal values: the size that each state has in this run, against which its error is measured.

A tolerance of 1e-8 bounds the local error of a state by 1e-8 (nominal + |value|). Every rule multiplies and
compares quantities of one unit only, so that a change of units changes no step: the same model in kilometres and
in metres runs alike. The rules, in this order:

1. a nominal that the model declares; 1 for the entries of a rotation;
2. the initial value, else the size of the declared range;
3. for a rate also sqrt(|acceleration| nominal of the coordinate), both at the start;
4. where this is zero, the smallest one of the states of the same kind and unit, among those that it feels if there is one;
5. the geometric mean of the parameters of the same unit that something uses; 1 for an angle and for a pure number;
6. what the state reaches in a pilot run at a tolerance of 1e-6 (pilot.py), which measures it against what the
   rate at the start would lead to in the duration of the run;
7. for a rate the nominal of its coordinate times the fastest other rate over its nominal; else 1.

Values at the start, and rates, below 1e-12 of the largest one of their kind and unit that they feel count as zero, and so do rates below
1e-12 of the fastest one, each over the nominal of its coordinate: they are what rounding leaves of a zero that assembly
has computed, or of forces that cancel. So do rates and accelerations at the start by which no coordinate gets further than 1e-12 of
its nominal in the duration of the run.
No nominal is below 1e-6 times the largest one of its kind and unit that it feels, as smaller ones would be below rounding where
the states are coupled; but not above what the state reaches in the pilot run, as then it is of its own size.
An account of energy has the size of the energies at the start; where these are zero, that which it reaches in the
pilot run, which does not control its error.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from msgspec.structs import replace

from .interface import PURE, ModelInterface, Quantity
from .memo import once
from .problem import Array, Problem

# ---- copied from here

FLOOR = 1e-6
NOISE = 1e-12
HEAT = 1e-25  # J, far below that of one freedom: what an account reaches beside energies of zero is rounding below it


class Sizes(NamedTuple):
    """What the rules know of a model (``mech_sizes`` of kernel/start/start.h). What stands between the
    markers stands in modules of the Python target, too, which have NumPy alone: hence a named tuple.

    By state: ``units``, the same number for the same unit; ``kinds``: "", account or rotation (an entry of one); ``pure``:
    an angle or a pure number; ``nominal``: declared, 0 without; ``ranges``: the size of the declared range, 0 without.
    ``partner`` [nv]: index of the coordinate of each velocity; ``parameter_units``: -1 where no state has it, and
    where nothing uses the parameter;
    ``energies``: indices of outputs. ``groups``: the same number for states that feel each other, empty where all do.
    """

    nq: int
    nv: int
    units: Sequence[int]
    kinds: Sequence[str]
    pure: Sequence[bool]
    nominal: Sequence[float]
    ranges: Sequence[float]
    partner: Sequence[int]
    parameter_units: Sequence[int]
    energies: Sequence[int]
    groups: Sequence[int] = ()


def nominal_values(
    sizes: Sizes,
    y0: Array,
    rates: Array,
    p: Array,
    energies: Sequence[float],
    duration: float,
    pilot: Callable[[Array], Array] | None = None,
) -> Array:
    """Give the nominal value [ny] of each state; ``rates``: dy/dt at the start, [ny].

    ``pilot`` gives the largest sizes of all states from provisional nominal values; it is called only where rule 6
    is needed.
    """
    nominal, unsized = _by_rules(sizes, y0, rates, p, energies, duration, None)
    if not unsized:
        return np.array(nominal)
    if pilot is None:
        unbounded = np.full(len(y0), np.inf)
        nominal, _ = _by_rules(sizes, y0, rates, p, energies, duration, None, unbounded)
        return np.where(np.isfinite(nominal), nominal, 1.0)
    return np.array(_by_rules(sizes, y0, rates, p, energies, duration, pilot(np.array(nominal)))[0])


def _by_rules(
    sizes: Sizes,
    y0: Array,
    rates: Array,
    p: Array,
    energies: Sequence[float],
    duration: float,
    reached: Array | None,
    bounds: Array | None = None,
) -> tuple[list[float], list[int]]:
    """Give nominal values, and the states that a pilot run is needed for. ``bounds`` of the floor: by default what is
    ``reached``."""
    bounds = reached if bounds is None else bounds
    start = _without_rounding(sizes, y0)
    slopes = _without_rounding(sizes, np.where(np.isfinite(rates), rates, 0.0))
    velocities = range(sizes.nq, sizes.nq + sizes.nv)
    others = [i for i in range(len(start)) if i not in velocities]
    positions = [i for i in others if not sizes.kinds[i]]
    accounts = [i for i in others if sizes.kinds[i] == "account"]

    nominal = [float(kind == "rotation") for kind in sizes.kinds]
    for i in positions:
        nominal[i] = _own_size(sizes, i, start[i])
    unsized = _share(sizes, nominal, positions, bounds)
    for i in positions:
        if nominal[i] == 0:
            nominal[i] = _parameter_size(sizes, p, i)
        if nominal[i] == 0:
            unsized.append(i)
            far = _reach(sizes, i, slopes, duration)
            nominal[i] = (far if reached is None or reached[i] == 0 else float(reached[i])) or 1.0

    partner = dict(zip(velocities, sizes.partner, strict=True))
    first, second = ([abs(x[i]) / nominal[partner[i]] for i in velocities] for x in (start, slopes))
    slowest = 1 / duration if duration > 0 else 0.0
    noise = NOISE * max(max(first, default=0.0), math.sqrt(max(second, default=0.0)), slowest)
    for i, speed, acceleration in zip(velocities, first, second, strict=True):
        own = _own_size(sizes, i, start[i] if speed > noise else 0.0)
        if not sizes.nominal[i] and acceleration > noise**2 / NOISE:
            own = max(own, math.sqrt(abs(slopes[i]) * nominal[partner[i]]))
        nominal[i] = own
    unsized += _share(sizes, nominal, velocities, bounds)
    speeds = [nominal[i] / nominal[partner[i]] for i in velocities]
    fastest = max(speeds, default=0.0)
    for i in velocities:
        if nominal[i] == 0:
            nominal[i] = nominal[partner[i]] * (fastest or (1 / duration if duration > 0 else 1.0))

    energy = max((abs(e) for e in energies if math.isfinite(e)), default=0.0)
    for i in accounts:
        nominal[i] = sizes.nominal[i] or energy or abs(slopes[i]) * duration
        if nominal[i] == 0:
            unsized.append(i)
            far = math.inf if reached is None else float(reached[i])
            nominal[i] = far if far > HEAT else 1.0
    largest = max((nominal[i] for i in accounts if math.isfinite(nominal[i])), default=0.0)
    for i in accounts:  # what cancels up to rounding has no size of its own
        if not sizes.nominal[i]:
            nominal[i] = max(nominal[i], FLOOR * largest)
    return nominal, unsized


def _without_rounding(sizes: Sizes, values: Array) -> list[float]:
    """Give ``values`` [ny] of the states, or of their rates, with zero for what is rounding beside others of its unit."""
    result: list[float] = values.tolist()
    for begin, end in itertools.pairwise((0, sizes.nq, sizes.nq + sizes.nv, len(result))):
        for alike in _alike(sizes, range(begin, end)):
            least = NOISE * max([abs(result[i]) for i in alike])
            for i in alike:
                if abs(result[i]) < least:
                    result[i] = 0.0
    return result


def _alike(sizes: Sizes, indices: Sequence[int]) -> list[list[int]]:
    """Put together states of one unit that feel each other."""
    found: dict[tuple[int, int], list[int]] = {}
    for i in indices:
        found.setdefault((sizes.units[i], sizes.groups[i] if sizes.groups else 0), []).append(i)
    return list(found.values())


def _own_size(sizes: Sizes, i: int, initial: float) -> float:
    if sizes.nominal[i]:
        return sizes.nominal[i]
    return abs(float(initial)) if initial != 0 else sizes.ranges[i]


def _share(sizes: Sizes, nominal: list[float], indices: Sequence[int], bounds: Array | None) -> list[int]:
    """Give states without a size that of the smallest one of their unit, one that they feel if there is one; keep those below
    the floor at what they reach, but not above it. Give these."""
    low: list[int] = []
    for group in _alike(sizes, indices):
        floor = FLOOR * max(nominal[i] for i in group)
        free = [i for i in group if not sizes.nominal[i]]
        for i in free:
            if not 0 < nominal[i] < floor:
                continue
            low.append(i)
            if bounds is not None:
                nominal[i] = max(nominal[i], min(floor, float(bounds[i])))
        smallest = min((nominal[i] for i in group if nominal[i] > 0), default=0.0)
        for i in free:
            if nominal[i] == 0:
                nominal[i] = smallest
    for i in indices:  # of which nothing that it feels has a size
        if nominal[i] == 0 and not sizes.nominal[i]:
            others = [nominal[k] for k in indices if sizes.units[k] == sizes.units[i] and nominal[k] > 0]
            nominal[i] = min(others, default=0.0)
    return low


def _parameter_size(sizes: Sizes, p: Array, i: int) -> float:
    if sizes.pure[i]:
        return 1.0
    logarithms = [
        math.log(abs(value))
        for unit, value in zip(sizes.parameter_units, p, strict=False)
        if unit == sizes.units[i] and value != 0
    ]
    return math.exp(sum(logarithms) / len(logarithms)) if logarithms else 0.0


def _reach(sizes: Sizes, index: int, rates: Sequence[float], duration: float) -> float:
    """How far a state gets by its rate, and a coordinate by its acceleration, at the start."""
    reach = abs(float(rates[index])) * duration
    for velocity, coordinate in enumerate(sizes.partner, sizes.nq):
        if coordinate == index:
            reach = max(reach, abs(float(rates[velocity])) * duration**2)
    return reach


# ---- to here


@once
def sizes_of(problem: ModelInterface) -> Sizes:
    """Return what the rules know of a model."""
    numbers: dict[str, int] = {}
    units = [numbers.setdefault(q.measure, len(numbers)) for q in problem.states]
    entries = {first + k for first in problem.rotations for k in range(4)}
    return Sizes(
        problem.nq,
        problem.nv,
        units,
        [
            "rotation" if i in entries else "account" if q.kind == "account" else ""
            for i, q in enumerate(problem.states)
        ],
        [q.unit in PURE for q in problem.states],
        [abs(q.nominal) if q.nominal is not None else 0.0 for q in problem.states],
        [_range(q) for q in problem.states],
        problem.partner,
        [-1 if q.kind == "idle" else numbers.get(q.measure, -1) for q in problem.parameters],
        [k for k, q in enumerate(problem.outputs) if q.kind == "energy"],
        problem.groups,
    )


def with_nominal(problem: Problem, sizes: Mapping[str, float]) -> Problem:
    """Return a problem whose states declare nominal values, by name."""
    if not sizes:
        return problem
    states = tuple(replace(q, nominal=sizes.get(q.name, q.nominal)) for q in problem.states)
    return replace(problem, states=states)


def _range(quantity: Quantity) -> float:
    ends = [abs(e) for e in (quantity.minimum, quantity.maximum) if e is not None and math.isfinite(e)]
    return max(ends, default=0.0)
