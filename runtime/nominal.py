"""Nominal values: the size that each state has in this run, against which its error is measured.

A tolerance of 1e-8 bounds the local error of a state by 1e-8 (nominal + |value|). Every rule multiplies and
compares quantities of one unit only, so that a change of units changes no step: the same model in kilometres and
in metres runs alike. The rules, in this order:

1. a nominal that the model declares; 1 for the entries of a rotation;
2. the initial value, else the size of the declared range;
3. for a rate also sqrt(|acceleration| nominal of the coordinate), both at the start;
4. where this is zero, the smallest one of the states of the same kind and unit;
5. the geometric mean of the parameters of the same unit; 1 for an angle and for a pure number;
6. what the state reaches in a pilot run at a tolerance of 1e-6 (pilot.py), which measures it against what the
   rate at the start would lead to in the duration of the run;
7. for a rate the nominal of its coordinate times the fastest other rate over its nominal; else 1.

Values at the start, and rates, below 1e-12 of the largest one of their kind and unit count as zero, and so do rates below
1e-12 of the fastest one, each over the nominal of its coordinate: they are what rounding leaves of a zero that assembly
has computed, or of forces that cancel.
No nominal is below 1e-6 times the largest one of its kind and unit, as smaller ones would be below rounding where
the states are coupled; but not above what the state reaches in the pilot run, as then it is of its own size.
An account of energy has the size of the energies at the start; where these are zero, that which it reaches in the
pilot run, which does not control its error.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence

import numpy as np

from .problem import Array, Problem, Quantity

PURE = ("", "1", "rad")
FLOOR = 1e-6
ROUNDING = 1e-12


def nominal_values(
    problem: Problem,
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
    nominal, unsized = _by_rules(problem, y0, rates, p, energies, duration, None)
    if not unsized:
        return nominal
    if pilot is None:
        unbounded = np.full(problem.ny, np.inf)
        nominal, _ = _by_rules(problem, y0, rates, p, energies, duration, None, unbounded)
        return np.where(np.isfinite(nominal), nominal, 1.0)
    return _by_rules(problem, y0, rates, p, energies, duration, pilot(nominal))[0]


def _by_rules(
    problem: Problem,
    y0: Array,
    rates: Array,
    p: Array,
    energies: Sequence[float],
    duration: float,
    reached: Array | None,
    sizes: Array | None = None,
) -> tuple[Array, list[int]]:
    """Give nominal values, and the states that a pilot run is needed for. ``sizes``: what bounds the floor, by default
    what is ``reached``."""
    sizes = reached if sizes is None else sizes
    y0 = _without_rounding(problem, y0)
    rates = _without_rounding(problem, np.where(np.isfinite(rates), rates, 0.0))
    coordinates = range(problem.nq)
    velocities = range(problem.nq, problem.nq + problem.nv)
    nominal = np.zeros(problem.ny)
    entries = {first + k for first in problem.rotations for k in range(4)}
    positions = [i for i in (*coordinates, *range(problem.nq + problem.nv, problem.ny)) if i not in entries]
    accounts = [i for i in positions if problem.states[i].kind == "account"]
    positions = [i for i in positions if i not in accounts]

    nominal[sorted(entries)] = 1.0
    for i in positions:
        nominal[i] = _own_size(problem.states[i], y0[i])
    unsized = _share(problem, nominal, positions, sizes)
    for i in positions:
        if nominal[i] == 0:
            nominal[i] = _parameter_size(problem, p, problem.states[i].unit)
        if nominal[i] == 0:
            unsized.append(i)
            far = _reach(problem, i, rates, duration)
            nominal[i] = (far if reached is None or reached[i] == 0 else float(reached[i])) or 1.0

    partner = _coordinate_of_velocity(problem)
    first, second = ([abs(x[i]) / nominal[partner[i]] for i in velocities] for x in (y0, rates))
    noise = ROUNDING * max(max(first, default=0.0), math.sqrt(max(second, default=0.0)))
    for i, speed, acceleration in zip(velocities, first, second, strict=True):
        own = _own_size(problem.states[i], y0[i] if speed > noise else 0.0)
        if problem.states[i].nominal is None and acceleration > noise**2 / ROUNDING:
            own = max(own, math.sqrt(abs(rates[i]) * nominal[partner[i]]))
        nominal[i] = own
    unsized += _share(problem, nominal, velocities, sizes)
    speeds = [nominal[i] / nominal[partner[i]] for i in velocities]
    fastest = max(speeds, default=0.0)
    for i in velocities:
        if nominal[i] == 0:
            nominal[i] = nominal[partner[i]] * (fastest or (1 / duration if duration > 0 else 1.0))

    energy = max((abs(e) for e in energies if math.isfinite(e)), default=0.0)
    for i in accounts:
        nominal[i] = problem.states[i].nominal or energy or abs(rates[i]) * duration
        if nominal[i] == 0:
            unsized.append(i)
            nominal[i] = math.inf if reached is None else float(reached[i]) or 1.0
    largest = max((nominal[i] for i in accounts if math.isfinite(nominal[i])), default=0.0)
    for i in accounts:  # what cancels up to rounding has no size of its own
        if problem.states[i].nominal is None:
            nominal[i] = max(nominal[i], FLOOR * largest)
    return nominal, unsized


def _without_rounding(problem: Problem, values: Array) -> Array:
    """Give ``values`` [ny] of the states, or of their rates, with zero for what is rounding beside others of its unit."""
    result = np.array(values)
    for begin, end in itertools.pairwise((0, problem.nq, problem.nq + problem.nv, problem.ny)):
        units = np.array([quantity.unit for quantity in problem.states[begin:end]])
        for unit in dict.fromkeys(units.tolist()):
            group = begin + np.flatnonzero(units == unit)
            size = np.abs(result[group])
            result[group[size < ROUNDING * size.max()]] = 0.0
    return result


def _own_size(quantity: Quantity, initial: float) -> float:
    if quantity.nominal is not None:
        return abs(quantity.nominal)
    if initial != 0:
        return abs(float(initial))
    ends = [abs(e) for e in (quantity.minimum, quantity.maximum) if e is not None and math.isfinite(e)]
    return max(ends, default=0.0)


def _share(problem: Problem, nominal: Array, indices: Sequence[int], sizes: Array | None) -> list[int]:
    """Give states without a size that of the smallest one of their unit; keep those below the floor
    at what they reach, but not above it. Give these."""
    groups: dict[str, list[int]] = {}
    low: list[int] = []
    for i in indices:
        groups.setdefault(problem.states[i].unit, []).append(i)
    for group in groups.values():
        floor = FLOOR * max(nominal[i] for i in group)
        free = [i for i in group if problem.states[i].nominal is None]
        for i in free:
            if not 0 < nominal[i] < floor:
                continue
            low.append(i)
            if sizes is not None:
                nominal[i] = max(nominal[i], min(floor, float(sizes[i])))
        smallest = min((nominal[i] for i in group if nominal[i] > 0), default=0.0)
        for i in free:
            if nominal[i] == 0:
                nominal[i] = smallest
    return low


def _parameter_size(problem: Problem, p: Array, unit: str) -> float:
    if unit in PURE:
        return 1.0
    logarithms = [
        math.log(abs(value))
        for quantity, value in zip(problem.parameters, p, strict=False)
        if quantity.unit == unit and value != 0
    ]
    return math.exp(sum(logarithms) / len(logarithms)) if logarithms else 0.0


def _reach(problem: Problem, index: int, rates: Array, duration: float) -> float:
    """How far a state gets in ``duration`` by its rate, and a coordinate by its acceleration, at the start."""
    reach = abs(float(rates[index])) * duration
    if index < problem.nq:
        for velocity, coordinate in _coordinate_of_velocity(problem).items():
            if coordinate == index:
                reach = max(reach, abs(float(rates[velocity])) * duration**2)
    return reach


def _coordinate_of_velocity(problem: Problem) -> dict[int, int]:
    """Index in y of the coordinate of each velocity; the three of a rotation belong to its first entry."""
    partner: dict[int, int] = {}
    coordinate, velocity = 0, problem.nq
    while coordinate < problem.nq:
        width, count = (4, 3) if coordinate in problem.rotations else (1, 1)
        for _ in range(count):
            partner[velocity] = coordinate
            velocity += 1
        coordinate += width
    return partner
