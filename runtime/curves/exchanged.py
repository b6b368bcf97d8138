"""Curves whose independent variable became a coordinate: where slopes are infinite, and what is told of it."""

from __future__ import annotations

import itertools

import numpy as np

from ..problem import Array
from .discrete import DiscreteCurve
from .posed import Posed
from .search import FoundCurve
from .starts import STEEP, Source, evaluate, parameters_of, passed, turns_back
from .unknowns import Unknowns

PIECES = 33
"""Places in an element at which a curve is drawn."""


def drawn(posed: Posed, discrete: DiscreteCurve, unknowns: Unknowns) -> Source:
    """Return coordinates and the independent variable of a curve over its length, all measured by how far they range."""
    nodes = discrete.mesh.nodes
    s = np.unique(np.concatenate([np.linspace(a, b, PIECES) for a, b in itertools.pairwise(nodes)]))
    a, b = posed.range(unknowns.whole[: posed.curve.unknown])
    at = np.vstack([evaluate(discrete, unknowns, s, 0)[: posed.curve.coordinates], a + (b - a) * s])
    ranges = np.ptp(at, axis=1, keepdims=True)
    steps = np.diff(at / np.where(ranges > 0, ranges, 1.0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(np.sqrt(np.sum(steps**2, axis=0)))])

    def source(share: Array) -> Array:
        return np.array([np.interp(share * length[-1], length, row) for row in at])

    return source


def rates(answer: FoundCurve, s: Array) -> tuple[Array, Array]:
    """Return the independent variable and its derivative by the parameter."""
    return passed(answer.discrete, answer.solved, s)


def exchange_told(posed: Posed, swapped: Posed, answer: FoundCurve, why: str) -> str:
    """Say that variables were exchanged, why, and where the curve is steep."""
    name, unit = posed.problem.time.name, posed.problem.time.unit
    names = [q.name for q in posed.problem.states[: posed.curve.coordinates]]
    s = np.linspace(0, 1, 2001)
    x, rate = rates(answer, s)
    mean = abs(float(x[-1] - x[0]))
    places = [mean * round(float(x[k]) / mean, 9) + 0.0 for k in (0, -1) if abs(rate[k]) < STEEP * mean]
    said = f"'{name}' and {_listed(names)} were taken as functions of a parameter, for over '{name}' {why}"
    if places:
        said += f"; the slope is infinite at {name} = {' and '.join(f'{p:.6g}' for p in places)}{' ' + unit if unit else ''}"
    if turns_back(answer.discrete, answer.solved):
        said += f"; the curve turns back: it is not a function of '{name}'"
    return said


def parameters_at(answer: FoundCurve, places: Array) -> Array:
    """Return the parameter s at values of the independent variable, which ascends."""
    return parameters_of(answer.discrete, answer.solved, places)


def _listed(names: list[str]) -> str:
    return ", ".join(f"'{n}'" for n in names)
