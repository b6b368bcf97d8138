"""The search for a curve: a coarse mesh first, then smaller elements where the polynomials do not end, then a check."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ..problem import Array
from . import obstacles
from .discrete import DiscreteCurve
from .first_solution import Begun, Tried, bounded, first_from, said_of, value_of
from .mesh import Mesh
from .newton import Factors, Solved, newton
from .posed import Posed
from .starts import (
    Source,
    evaluate,
    parameters_of,
    passed,
    spans,
    transferred,
    turns_back,
    with_waves,
    without_repeats,
)
from .unknowns import Unknowns

DEGREE = 10
FINER = 2
"""Degree that the check adds."""
ELEMENTS = 6
MOST_CYCLES = 40
MOST_ELEMENTS = 1500
TOO_MANY = f"{MOST_ELEMENTS} elements do not reach the tolerance"
ROUNDING = 2e-15
"""Relative to the sum of the sizes of all terms: what sums of some hundred terms lose."""


class FoundCurve(Struct, eq=False):
    """A curve on its mesh: ``value`` of what is stationary, ``outputs`` at z (those that vary are NaN), how far both are from
    those of the mesh of lower degree, ``negative`` directions, Newton ``steps`` and ``unknowns`` in all, the ``size`` of the
    terms of the value, with the guess or the curve; ``reached``: the elements are small enough for the tolerance."""

    discrete: DiscreteCurve
    solved: Unknowns
    value: float
    outputs: Array
    value_error: float
    output_errors: Array
    negative: int
    free: int
    definite: bool
    steps: int
    count: int
    cycles: int
    remarks: list[str]
    size: float
    reached: bool = True


class Failed(Exception):
    """No stationary curve was found: ``tried`` says what was done; ``last``: the curve on the elements that were too coarse."""

    def __init__(
        self, why: str, tried: Sequence[str], last: tuple[DiscreteCurve, Unknowns] | None = None
    ) -> None:
        super().__init__(why)
        self.why = why
        self.tried = tuple(tried)
        self.last = last


def search(
    posed: Posed, *, deflated: Sequence[FoundCurve] = (), start: Source | None = None, degree: int = DEGREE, adapt: bool = True, once: bool = False,
    elements: int = ELEMENTS, weights: Array | None = None,
) -> FoundCurve:  # fmt: skip
    """Find a stationary curve from the guess, or from ``start``; ``weights`` of coordinates in a speed that is kept constant.

    Raises Failed.
    """
    tried: list[Tried] = []
    remarks: list[str] = []
    before = ""
    source = start or posed.guess
    alone = once or bool(deflated)
    meshes = [(elements, degree), (elements, 6), (3 * elements, 6), (2, 6)][
        1 if alone else 0 : 2 if alone else None
    ]
    known = [(a.discrete, a.solved) for a in deflated]
    found, steps = first_from(posed, source, meshes, known, tried, remarks, once=once, weights=weights)
    if found is not None:
        if not adapt:
            return answer_of(posed, found.discrete, found.unknowns, None, steps, 1, remarks)
        try:
            return _adapted(posed, found, degree, steps, remarks)
        except Failed as lost:
            if posed.curve.exchangeable:  # a slope may be infinite, which other starts do not change
                raise
            before = lost.why
    if not alone:
        found, more = _from_waves(posed, source, meshes[:1], remarks)
        if found is not None:
            return _adapted(posed, found, degree, steps + more, remarks)
    undefined = next((t.outcome for t in tried if not t.way), "")
    raise Failed(before or undefined or "Newton's method leads to none", said_of(tried))


def _adapted(posed: Posed, begun: Begun, degree: int, steps: int, remarks: list[str]) -> FoundCurve:
    """Take a curve on until its polynomials come to an end; check it by a higher degree. Raises Failed."""
    discrete, solved = begun.discrete, Solved(begun.unknowns, 0.0, 0)
    cycles = 0
    for _ in range(MOST_CYCLES):
        cycles += 1
        discrete, solved, more = _again(posed, discrete, solved.at, discrete.mesh.of_degree(degree))
        steps += more
        marked = marked_elements(discrete, solved.at, posed.tolerance)
        if obstacles.has_bounds(discrete):
            marked = obstacles.borders(discrete) | (marked & ~_narrow(discrete))
        if not marked.any():
            break
        if discrete.mesh.count + marked.sum() > MOST_ELEMENTS:
            remarks.append(TOO_MANY)
            break
        discrete, solved, more = _again(posed, discrete, solved.at, discrete.mesh.refined(marked))
        steps += more
    coarse_answer = answer_of(posed, discrete, solved.at, None, steps, cycles, remarks)
    discrete, solved, more = _again(posed, discrete, solved.at, discrete.mesh.of_degree(degree + FINER))
    steps += more
    answer = answer_of(posed, discrete, solved.at, coarse_answer, steps, cycles, remarks)
    answer.size = max(answer.size, begun.guessed)
    answer.reached = not marked.any()
    if not answer.definite:  # small elements have small eigenvalues: larger ones tell the directions, too
        first = answer_of(posed, begun.discrete, begun.unknowns, None, 0, 0, [])
        if first.definite:
            answer.negative, answer.free, answer.definite = first.negative, first.free, True
    return answer


def _from_waves(
    posed: Posed, source: Source, meshes: Sequence[tuple[int, int]], remarks: list[str]
) -> tuple[Begun | None, int]:
    """Return the curve of the fewest directions down, and lowest value, of those that two opposite waves lead to."""
    at = source(np.linspace(0, 1, 201))
    size, steps = spans(posed, at), 0
    found: list[tuple[int, float, str, Begun]] = []
    for count, (words, start) in enumerate(with_waves(source, size, (0.5, -0.5)), start=1):
        one, more = first_from(posed, start, meshes, (), [], [], once=False)
        steps += more
        if one is not None:
            try:
                answer = _adapted(posed, one, DEGREE, 0, [])
                found.append((answer.negative, answer.value, words, one))
            except Failed:
                pass
        if found and count % 2 == 0:
            break
    if not found:
        return None, steps
    best = min(found, key=lambda row: row[:2])
    said = f"the guess itself leads to no curve: this one was found from {best[2]}, s = 0 .. 1 over the range"
    others = [row for row in found if abs(row[1] - best[1]) > 1e-6 * max(abs(row[1]), abs(best[1]))]
    if others:
        said += f"; {others[0][2]} leads to another one, with the value {others[0][1]:.7g}"
    remarks.append(said)
    return best[3], steps


def _narrow(discrete: DiscreteCurve) -> NDArray[np.bool_]:
    narrow: NDArray[np.bool_] = np.diff(discrete.mesh.nodes) <= obstacles.NARROWEST
    return narrow


def _again(
    posed: Posed, discrete: DiscreteCurve, unknowns: Unknowns, mesh: Mesh
) -> tuple[DiscreteCurve, Solved, int]:
    """Solve on another mesh, from the curve on this one. Raises Failed."""
    if mesh.degree == discrete.mesh.degree and np.array_equal(mesh.nodes, discrete.mesh.nodes):
        return discrete, Solved(unknowns, 0.0, 0), 0
    other = DiscreteCurve(posed.problem, mesh, posed.p, discrete.gauge)
    first = transferred(discrete, unknowns, other)
    without_repeats(other, first)
    if obstacles.has_bounds(other):
        first = obstacles.begin(other, first)
    solved = bounded(other, newton(other, first))
    if not solved.converged:
        raise Failed(
            "no elements are small enough for it",
            (f"it was lost between {discrete.mesh.count} and {mesh.count} elements",),
            (discrete, unknowns),
        )
    return other, solved, solved.steps


# ---------------------------------------------------------------- what is not yet good


def marked_elements(discrete: DiscreteCurve, unknowns: Unknowns, tolerance: float) -> NDArray[np.bool_]:
    """Return the elements whose polynomials have not come to an end."""
    layout = discrete.layout
    n, b = layout.n, layout.bubbles
    bubbles = np.abs(unknowns.inside[:, : b * n]).reshape(-1, b, n)
    values = np.moveaxis(discrete.inner.functions[0] @ discrete.coordinates(unknowns), 2, 0).reshape(n, -1)
    size = np.maximum(np.ptp(values, axis=1), 1e-3 * np.max(np.abs(values), axis=1))
    size = np.where(size > 1e-9, size, 1.0)
    tail = np.max(bubbles[:, -2:], axis=1) / size
    tops = np.sqrt(2 * discrete.mesh.degree)
    marked: NDArray[np.bool_] = np.max(tail, axis=1) * tops > tolerance
    widths = np.diff(discrete.mesh.nodes)
    return marked & (widths > 1e-12)


# ---------------------------------------------------------------- what is reported


def answer_of(
    posed: Posed, discrete: DiscreteCurve, unknowns: Unknowns, before: FoundCurve | None, steps: int, cycles: int, remarks: list[str]
) -> FoundCurve:  # fmt: skip
    value, size = value_of(discrete, unknowns)
    z = reported_z(posed, discrete, unknowns)
    y = np.full((discrete._height(), 1), np.nan)
    outputs = discrete.call("outputs", np.full(1, np.nan), y, z)[:, 0]
    factors = Factors(discrete, discrete.blocks(unknowns))
    negative, smallest = factors.negative()
    layout = discrete.layout
    count = discrete.mesh.count * layout.inner + layout.width * (discrete.mesh.count + 1) + layout.whole
    count -= len(layout.rates)  # the spare places of the last border
    nodes = discrete.active_nodes
    multipliers = layout.multipliers + nodes.size + discrete.active_rates.size - nodes[1:, 0].size
    conditions = layout.multipliers + _active(discrete)
    error, apart = np.inf, np.full(len(outputs), np.inf)
    if before is not None:
        error = abs(value - before.value) + ROUNDING * size
        apart = np.abs(outputs - before.outputs) + 10 * ROUNDING * np.abs(outputs)
    return FoundCurve(
        discrete, unknowns, value, outputs, error, apart, negative - conditions, count - multipliers - conditions,
        smallest > 1e-13, steps, count, cycles, remarks, size,
    )  # fmt: skip


def _active(discrete: DiscreteCurve) -> int:
    """Count the conditions at nodes that hold; a shared node is one."""
    nodes = discrete.active_nodes
    shared = int(nodes[:-1, -1].sum()) if len(nodes) > 1 else 0
    return int(nodes.sum()) - shared + int(discrete.active_rates.sum())


def reported_z(posed: Posed, discrete: DiscreteCurve, unknowns: Unknowns) -> Array:
    """Return z with the further numbers, which decide nothing, but may read each other."""
    z = discrete._z(unknowns)
    for _ in discrete.curve.further:
        before = z.copy()
        _read_further(discrete, unknowns, z)
        if np.array_equal(z, before, equal_nan=True):
            break
    return z


def _read_further(discrete: DiscreteCurve, unknowns: Unknowns, z: Array) -> None:
    curve = discrete.curve
    start = len(z) - len(curve.further)
    integrals = [k for k, row in enumerate(curve.further) if row.kind == "integral"]
    if integrals:
        y = discrete.rows(unknowns, discrete.inner)
        values = discrete.call("further_integrands", discrete.inner.s, y, z)
        z[start : start + len(integrals)] = np.sum(discrete.inner.weights * values, axis=(1, 2))
    deciding = sum(row.kind != "integral" for row in curve.numbers)
    if len(curve.further) == len(integrals):
        return
    s = discrete.number_s[deciding:]
    if curve.exchanged:  # places of the independent variable, as shares of its range
        if turns_back(discrete, unknowns):
            z[start + len(integrals) :] = np.nan  # several values, or none
            return
        low, high = passed(discrete, unknowns, np.array([0.0, 1.0]))[0]
        s = parameters_of(discrete, unknowns, low + (high - low) * s)
    y = evaluate(discrete, unknowns, s, curve.depth)
    values = discrete.call("further_values", s, y, z)
    z[start + len(integrals) :] = np.diagonal(values)
