"""Parameters at random, and what must hold of them: equal values, ratios, zeros."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np
from msgspec import Struct

from ...case import Case
from ...problem import Array

RATIOS = (1.0, 2.0, 3.0, 4.0, 0.5)
"""Of two parameters of one unit that a symmetry may need."""

SPREAD = 0.35
"""Logarithm of the largest factor by which a parameter is changed."""


class Relation(Struct, frozen=True):
    """``follower`` = ``ratio`` * ``leader`` (indices in p); with ``leader`` None it has the value ``ratio``."""

    text: str
    follower: int
    leader: int | None
    ratio: float


class Chance:
    """Values of the parameters of a case at random, as far as these follow from no others.

    Parameters are changed by at most ``SPREAD``, within their bounds, and keep their signs; those that are zero get a
    size like others of their unit.
    """

    def __init__(self, case: Case, seed: int = 3) -> None:
        self.case = case
        self.random = np.random.default_rng(seed)
        count = len(case.problem.parameters)
        default = np.full(count + case.problem.nh, np.nan)
        case.functions.parameters(default, np.zeros(count, dtype=np.uint8))
        # a value that is not the default was given, or follows from one that was
        self._given = {k for k in range(count) if default[k] != case.p[k]}
        for k in sorted(self._given):
            if self._with({}, self._given - {k})[k] == case.p[k]:
                self._given.discard(k)
        settled: set[int] = set()
        for k in range(count):
            value = float(case.p[k])
            changed = self._with({k: value * 1.37 if value else 0.11}, self._given)
            settled |= {j for j in range(count) if j != k and changed[j] != case.p[j]}
        self.free = tuple(k for k in range(count) if k not in settled)

    def seed(self) -> int:
        """Return a seed for what else is random."""
        return int(self.random.integers(1 << 30))

    def values(self, changed: Collection[int], held: Sequence[Relation] = ()) -> Array:
        """Return p with some of the free parameters at random and relations held."""
        parameters = self.case.problem.parameters
        new: dict[int, float] = {}
        for k in self.free:
            if k not in changed:
                continue
            value, quantity = float(self.case.p[k]), parameters[k]
            alike = [
                abs(float(self.case.p[j])) for j in self.free if parameters[j].measure == quantity.measure
            ]
            factor = float(np.exp(self.random.uniform(-SPREAD, SPREAD)))
            other = value * factor if value else 0.3 * (max(alike) or 1.0) * factor
            low = -np.inf if quantity.minimum is None else quantity.minimum
            high = np.inf if quantity.maximum is None else quantity.maximum
            new[k] = other if low <= other <= high else value
        for relation in held:
            if relation.leader is None:
                new[relation.follower] = relation.ratio
            elif relation.leader in new:
                new[relation.follower] = relation.ratio * new[relation.leader]
        return self._with(new, self._given)

    def _with(self, new: dict[int, float], given: Collection[int]) -> Array:
        problem = self.case.problem
        count = len(problem.parameters)
        p, fixed = np.full(count + problem.nh, np.nan), np.zeros(count, dtype=np.uint8)
        for k, value in {**{k: float(self.case.p[k]) for k in given}, **new}.items():
            p[k], fixed[k] = value, 1
        self.case.functions.parameters(p, fixed)
        return p

    def at(self, new: Mapping[int, float]) -> Array:
        """Return p with some parameters at given values."""
        return self._with(dict(new), self._given)

    def relations(self) -> list[Relation]:
        """Return what holds of the values that the parameters have: zeros, ratios, and whole pure numbers."""
        p, parameters = self.case.p, self.case.problem.parameters
        found: list[Relation] = []
        led: set[int] = set()
        for place, k in enumerate(self.free):
            value, quantity = float(p[k]), parameters[k]
            if value == 0:
                found.append(Relation(f"{quantity.name} = 0", k, None, 0.0))
                continue
            for j in self.free[:place]:
                if parameters[j].measure != quantity.measure or j in led or p[j] == 0:
                    continue
                ratio = value / float(p[j])
                near = next((r for r in RATIOS if abs(ratio - r) <= 1e-12 * r), None)
                if near is not None:
                    factor = "" if near == 1 else f"{near:g}*"
                    found.append(Relation(f"{quantity.name} = {factor}{parameters[j].name}", k, j, near))
                    led.add(k)
                    break
            else:
                if not quantity.unit and value == round(value):
                    found.append(Relation(f"{quantity.name} = {value:g}", k, None, value))
        return found


def needed(
    relations: Sequence[Relation], holds: Callable[[Sequence[Relation]], bool]
) -> list[Relation] | None:
    """Return relations of which none may be left out; None if all together are not enough."""
    kept = list(relations)
    if not holds(kept):
        return None
    for relation in relations:
        fewer = [r for r in kept if r is not relation]
        if holds(fewer):
            kept = fewer
    return kept
