"""Extremes made out of any model: its parameters, its start, its length, tolerances and methods driven far out."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from msgspec import Struct, field

from ..lang.units import BASE, parse_unit
from ..presentation.numbers import number

if TYPE_CHECKING:
    from ..runtime.interface import Quantity
    from ..runtime.studies.runs.simulate import Plan

QUICK_PARAMETERS = 8
"""Parameters that a quick run scales; the others are named as left out."""
QUICK_SCALES = (1e3, 1e-3, 0.0)
FULL_SCALES = (1e3, 1e-3, 1e6, 1e-6, 1e9, 1e-9, 0.0)
SIZES = {"m": 1e5, "kg": 1e-7, "s": 1e2}
"""Factors of lengths, masses and times for the motion in other sizes."""


SIZES_GROUP = "sizes"
TARGET = "target"
"""The group of what targets answer; the text of such an extreme begins with the name of the target."""


class Extreme(Struct, frozen=True):
    """A run unlike the one that the model states. ``values`` in SI; ``options`` of the run."""

    group: str
    text: str
    values: dict[str, float] = field(default_factory=dict)
    options: dict[str, Any] = field(default_factory=dict)


class Extremes(Struct, frozen=True):
    """``left_out`` says in words what was not made."""

    runs: tuple[Extreme, ...]
    left_out: tuple[str, ...]


def extremes(plan: Plan, methods: Sequence[str], *, full: bool, targets: Sequence[str] = ()) -> Extremes:
    """Make the runs. ``plan`` is the one that the model states, ``methods`` those that choose their steps; each of the ``targets`` is
    asked for the motion as stated, and in other sizes."""
    left_out: list[str] = []
    runs = [Extreme("as stated", "nothing changed")]
    for target in targets:
        runs.append(Extreme(TARGET, f"{target}: as stated"))
        runs += [Extreme(TARGET, f"{target}: other sizes", e.values) for e in _sizes(plan)]
    runs += _parameters(plan, full, left_out)
    runs += _starts(plan)
    runs += _sizes(plan)
    stop = plan.case.stop
    lengths = (0.0, 1e-9, 10.0, *((100.0, 1000.0) if full else ()))
    runs += [
        Extreme("length", f"{factor:g} times as long", options={"stop": factor * stop}) for factor in lengths
    ]
    tolerances = (1e-2, 1e-5, 1e-11, 1e-14)
    runs += [
        Extreme("tolerance", f"{tolerance:g}", options={"tolerance": tolerance}) for tolerance in tolerances
    ]
    for method in methods:
        for tolerance in (1e-4, 1e-7, 1e-10) if full else (1e-6,):
            options = {"method": method, "tolerance": tolerance}
            runs.append(Extreme("method", f"{method} at {tolerance:g}", options=options))
    runs.append(Extreme("output", "three points", options={"every": stop / 2}))
    return Extremes(tuple(runs), tuple(left_out))


def _parameters(plan: Plan, full: bool, left_out: list[str]) -> Iterator[Extreme]:
    """Each parameter far up, far down, and zero."""
    parameters = list(zip(plan.case.problem.parameters, plan.case.p, strict=False))
    known = [(q, float(v)) for q, v in parameters if v != 0]
    if not full and len(known) > QUICK_PARAMETERS:
        step = len(known) / QUICK_PARAMETERS
        chosen = [known[int(k * step)] for k in range(QUICK_PARAMETERS)]
        names = ", ".join(q.name for q, _ in known if all(q is not c for c, _ in chosen))
        left_out.append(f"the parameters {names}: --full scales them, too")
        known = chosen
    for quantity, value in known:
        for scale in FULL_SCALES if full else QUICK_SCALES:
            yield Extreme("parameter", _setting_text(quantity, scale * value), {quantity.name: scale * value})
    if full:
        for quantity in (q for q, v in parameters if v == 0):
            yield Extreme("parameter", _setting_text(quantity, 1.0), {quantity.name: 1.0})


def _setting_text(quantity: Quantity, value: float) -> str:
    return f"{quantity.name} = {number(value)} {quantity.unit}".rstrip()


def _starts(plan: Plan) -> Iterator[Extreme]:
    """Fast, slow, far away, nearly upside down, and still: as far as the model gives the values itself."""
    problem, case = plan.case.problem, plan.case
    rotations = {first + k for first in problem.rotations for k in range(4)}
    given = {
        q.name: float(case.wanted[i])
        for i, q in enumerate(problem.states)
        if case.known[i] and i not in rotations and q.kind != "account"
    }
    kinds = {q.name: q for q in problem.states}
    rates = {n: v for n, v in given.items() if kinds[n].kind == "rate"}
    angles = {n: v for n, v in given.items() if kinds[n].kind == "coordinate" and kinds[n].unit == "rad"}
    places = {n: v for n, v in given.items() if kinds[n].kind == "coordinate" and n not in angles}
    moving = {n: v for n, v in rates.items() if v != 0}
    if moving:
        yield Extreme("start", "rates 1000 times faster", {n: 1e3 * v for n, v in moving.items()})
        yield Extreme("start", "rates 1e6 times slower", {n: 1e-6 * v for n, v in moving.items()})
    elif rates:
        index = {q.name: i for i, q in enumerate(problem.states)}
        fast = {n: 100 * float(plan.nominal[index[n]]) for n in rates}
        yield Extreme("start", "rates 100 times their usual size", fast)
    if angles:
        yield Extreme("start", "angles 1000 turns on", {n: v + 2000 * math.pi for n, v in angles.items()})
        yield Extreme("start", "angles 1e-8 short of half a turn", dict.fromkeys(angles, math.pi - 1e-8))
    if any(places.values()):
        yield Extreme("start", "places 1000 times farther", {n: 1e3 * v for n, v in places.items()})
        yield Extreme("start", "places 1e6 times nearer", {n: 1e-6 * v for n, v in places.items()})
    if given:
        yield Extreme("start", "everything zero", dict.fromkeys(given, 0.0))


def _sizes(plan: Plan) -> Iterator[Extreme]:
    """Everything longer, lighter and slower: the same motion, if the model holds no numbers with units beside."""
    problem, case = plan.case.problem, plan.case
    if not problem.time.unit:
        return
    values: dict[str, float] = {}
    for quantity, value in zip(problem.parameters, case.p, strict=False):
        values[quantity.name] = factor_of(quantity.unit) * float(value)
    for i, quantity in enumerate(problem.states):
        if quantity.kind != "account" and case.known[i]:
            values[quantity.name] = factor_of(quantity.unit) * float(case.wanted[i])
    changed = {n: v for n, v in values.items() if v != 0}
    words = ", ".join(f"{unit} x {factor:.0e}" for unit, factor in SIZES.items()) + ", everywhere"
    options = {"stop": SIZES["s"] * case.stop}
    yield Extreme(SIZES_GROUP, words, changed, options)


def factor_of(unit: str) -> float:
    """Return how a quantity grows if lengths, masses and times do."""
    factor = 1.0
    for base, exponent in zip(BASE, parse_unit(unit or "1").dimension.exponents, strict=True):
        factor *= SIZES.get(base, 1.0) ** float(exponent)
    return factor
