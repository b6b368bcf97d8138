"""The search for a curve: a coarse mesh first, then smaller elements where the polynomials do not end, then a check."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ..problem import Array
from . import obstacles
from .afar import newton_by_steps, newton_from_afar
from .bent import bent, spans
from .discrete import Discrete
from .mesh import Mesh, mesh_of
from .newton import Factors, Solved, newton, projected, with_multipliers
from .posed import Posed
from .starts import (
    Source,
    beginning,
    gauge,
    steep_ends,
    transferred,
    undefined,
    with_numbers,
    without_repeats,
)
from .unknowns import Unknowns

DEGREE = 10
FINER = 2
"""Degree that the check adds."""
ELEMENTS = 6
MOST_CYCLES = 40
MOST_ELEMENTS = 1500
ROUNDING = 2e-15
"""Relative to the sum of the sizes of all terms: what sums of some hundred terms lose."""


class Answer(Struct, eq=False):
    """A curve on its mesh: ``value`` of what is stationary, ``outputs`` at z (those that vary are NaN), how far both are from
    those of the mesh of lower degree, ``negative`` directions, Newton ``steps`` and ``unknowns`` in all, the ``size`` of the
    terms of the value, with the guess or the curve."""

    discrete: Discrete
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


class Failed(Exception):
    """No stationary curve was found: ``tried`` says what was done."""

    def __init__(self, why: str, tried: Sequence[str]) -> None:
        super().__init__(why)
        self.why = why
        self.tried = tuple(tried)


def search(
    posed: Posed, *, deflated: Sequence[Answer] = (), start: Source | None = None, degree: int = DEGREE, adapt: bool = True, once: bool = False,
    elements: int = ELEMENTS,
) -> Answer:  # fmt: skip
    """Find a stationary curve from the guess, or from ``start``. Raises Failed."""
    tried: list[str] = []
    remarks: list[str] = []
    source = start or posed.guess
    weights = gauge(posed, source)
    alone = once or bool(deflated)
    meshes = [(elements, degree), (elements, 6), (3 * elements, 6), (2, 6)]
    found, steps = _first(
        posed, source, meshes[1:2] if alone else meshes, weights, deflated, tried, remarks, once=once
    )
    if found is None and not alone:
        found, more = _from_bent(posed, source, meshes[:1], weights, tried, remarks)
        steps += more
    if found is None:
        raise Failed(tried[0], tried)
    discrete, solved = found
    guessed = _value(discrete, beginning(discrete, posed, source)[0])[1]
    if not adapt:
        return _answer(posed, discrete, solved.unknowns, None, steps, 1, remarks)
    cycles = 0
    for _ in range(MOST_CYCLES):
        cycles += 1
        discrete, solved, more = _again(
            posed, discrete, solved.unknowns, discrete.mesh.of_degree(degree), weights
        )
        steps += more
        marked = _marked(discrete, solved.unknowns, posed.tolerance)
        if obstacles.has_bounds(discrete):
            marked = obstacles.borders(discrete) | (marked & ~_narrow(discrete))
        if not marked.any():
            break
        if discrete.mesh.count + marked.sum() > MOST_ELEMENTS:
            remarks.append(f"{MOST_ELEMENTS} elements do not reach the tolerance")
            break
        discrete, solved, more = _again(
            posed, discrete, solved.unknowns, discrete.mesh.refined(marked), weights
        )
        steps += more
    coarse_answer = _answer(posed, discrete, solved.unknowns, None, steps, cycles, remarks)
    discrete, solved, more = _again(
        posed, discrete, solved.unknowns, discrete.mesh.of_degree(degree + FINER), weights
    )
    steps += more
    answer = _answer(posed, discrete, solved.unknowns, coarse_answer, steps, cycles, remarks)
    answer.size = max(answer.size, guessed)
    return answer


def _first(
    posed: Posed, source: Source, meshes: Sequence[tuple[int, int]], weights: Array, deflated: Sequence[Answer],
    tried: list[str], remarks: list[str], *, once: bool,
) -> tuple[tuple[Discrete, Solved] | None, int]:  # fmt: skip
    """Return the first curve that a start leads to, on whatever mesh and in whatever way, and the steps of all ways."""
    steps = 0
    steep = steep_ends(posed, source)
    for count, coarse in meshes:
        mesh = mesh_of(posed.borders(), count, max(coarse, 2 * posed.curve.order + 2), steep)
        discrete = Discrete(posed.problem, mesh, posed.p, weights)
        first, off = beginning(discrete, posed, source)
        without_repeats(discrete, first)
        if why := undefined(discrete, first):
            tried.append(f"{count} elements: {why}")
            continue
        known = [_moved(a, discrete) for a in deflated]
        if obstacles.has_bounds(discrete):
            obstacles.begin(discrete, first)
        results: dict[str, list[str]] = {}
        for words, way in _ways(discrete, first, known, once=once):
            solved = _bounded(discrete, way())
            steps += solved.steps
            if solved.converged:
                if off and not deflated:
                    remarks.append(f"the guess does not meet {' and '.join(off)}: it was bent to do so")
                return (discrete, solved), steps
            outcome = f"{solved.why}, {plural_steps(solved.steps)}"
            results.setdefault(outcome, []).append(words)
        tried += [
            f"{count} elements of degree {mesh.degree}: {outcome}"
            + (f", {', '.join(ways)}" if len(results) > 1 else " in every way")
            for outcome, ways in results.items()
        ]
    return None, steps


def _from_bent(
    posed: Posed, source: Source, meshes: Sequence[tuple[int, int]], weights: Array, tried: list[str], remarks: list[str]
) -> tuple[tuple[Discrete, Solved] | None, int]:  # fmt: skip
    """Return the curve of the fewest directions down, and lowest value, of those that two opposite waves lead to."""
    at = source(np.linspace(0, 1, 201))
    size, steps, count = spans(posed, at), 0, 0
    found: list[tuple[int, float, str, tuple[Discrete, Solved]]] = []
    for words, start in bent(source, size, (0.5, -0.5)):
        one, more = _first(posed, start, meshes, weights, (), [], [], once=False)
        steps += more
        count += 1
        if one is not None:
            answer = _answer(posed, one[0], one[1].unknowns, None, 0, 0, [])
            found.append((answer.negative, answer.value, words, one))
        if found and count % 2 == 0:
            break
    if not found:
        tried.append(f"from the guess with half waves added: none of {count} starts leads to a curve")
        return None, steps
    best = min(found, key=lambda row: row[:2])
    said = f"the guess itself leads to no curve: this one was found from {best[2]}, s = 0 .. 1 over the range"
    others = [row for row in found if abs(row[1] - best[1]) > 1e-6 * max(abs(row[1]), abs(best[1]))]
    if others:
        said += f"; {others[0][2]} leads to another one, with the value {others[0][1]:.7g}"
    remarks.append(said)
    return best[3], steps


def _ways(
    discrete: Discrete, first: Unknowns, known: list[Unknowns], *, once: bool
) -> Iterator[tuple[str, Callable[[], Solved]]]:
    """Yield the ways in which a curve is looked for from a start, the fastest first, with words for each."""
    yield "Newton's method", partial(newton, discrete, first, deflated=known)
    if known or once:
        return
    better = with_multipliers(discrete, first)
    yield "with estimated multipliers", partial(newton, discrete, better)
    yield "with a stiffness that fades", partial(newton_from_afar, discrete, better)
    yield "with a stiffness that fades, multipliers zero", partial(newton_from_afar, discrete, first)
    nearer = with_multipliers(discrete, with_numbers(discrete, projected(discrete, first, every=True)))
    yield "with conditions brought in step by step", partial(newton_by_steps, discrete, better)
    yield "from a guess bent to all conditions", partial(newton, discrete, nearer)
    yield "with bounded steps", partial(newton, discrete, better, tested=False)


def plural_steps(count: int) -> str:
    return f"{count} step{'' if count == 1 else 's'}"


def _bounded(discrete: Discrete, solved: Solved) -> Solved:
    if not obstacles.has_bounds(discrete):
        return solved
    return obstacles.solved_with_bounds(discrete, solved, lambda u: newton(discrete, u))


def _narrow(discrete: Discrete) -> NDArray[np.bool_]:
    narrow: NDArray[np.bool_] = np.diff(discrete.mesh.nodes) <= obstacles.NARROWEST
    return narrow


def _again(
    posed: Posed, discrete: Discrete, unknowns: Unknowns, mesh: Mesh, weights: Array
) -> tuple[Discrete, Solved, int]:
    """Solve on another mesh, from the curve on this one. Raises Failed."""
    if mesh.degree == discrete.mesh.degree and np.array_equal(mesh.nodes, discrete.mesh.nodes):
        return discrete, Solved(unknowns, True, 0, 0.0), 0
    other = Discrete(posed.problem, mesh, posed.p, weights)
    first = transferred(discrete, unknowns, other)
    without_repeats(other, first)
    if obstacles.has_bounds(other):
        obstacles.begin(other, first)
    solved = _bounded(other, newton(other, first))
    if not solved.converged:
        raise Failed(
            f"the curve of {discrete.mesh.count} elements was lost on {mesh.count}: {solved.why}", ()
        )
    return other, solved, solved.steps


def _moved(answer: Answer, discrete: Discrete) -> Unknowns:
    return transferred(answer.discrete, answer.solved, discrete)


# ---------------------------------------------------------------- what is not yet good


def _marked(discrete: Discrete, unknowns: Unknowns, tolerance: float) -> NDArray[np.bool_]:
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


def _answer(
    posed: Posed, discrete: Discrete, unknowns: Unknowns, before: Answer | None, steps: int, cycles: int, remarks: list[str]
) -> Answer:  # fmt: skip
    value, size = _value(discrete, unknowns)
    z = reported_z(posed, discrete, unknowns)
    y = np.full((discrete._height(), 1), np.nan)
    outputs = discrete.call("outputs", np.full(1, np.nan), y, z)[:, 0]
    factors = Factors(discrete, discrete.blocks(unknowns))
    negative, smallest = factors.negative()
    layout = discrete.layout
    count = discrete.mesh.count * layout.inner + layout.width * (discrete.mesh.count + 1) + layout.whole
    nodes = discrete.active_nodes
    multipliers = layout.multipliers + nodes.size + discrete.active_rates.size - nodes[1:, 0].size
    conditions = layout.multipliers + _active(discrete)
    error, apart = np.inf, np.full(len(outputs), np.inf)
    if before is not None:
        error = abs(value - before.value) + ROUNDING * size
        apart = np.abs(outputs - before.outputs) + 10 * ROUNDING * np.abs(outputs)
    return Answer(
        discrete, unknowns, value, outputs, error, apart, negative - conditions, count - multipliers - conditions,
        smallest > 1e-13, steps, count, cycles, remarks, size,
    )  # fmt: skip


def _active(discrete: Discrete) -> int:
    """Count the conditions at nodes that hold; a shared node is one."""
    nodes = discrete.active_nodes
    shared = int(nodes[:-1, -1].sum()) if len(nodes) > 1 else 0
    return int(nodes.sum()) - shared + int(discrete.active_rates.sum())


def _value(discrete: Discrete, unknowns: Unknowns) -> tuple[float, float]:
    """Return what is stationary, and the size of the terms that it is made of."""
    y = np.zeros((discrete._height(), 1))
    value = float(discrete.call("wholes", np.zeros(1), y, discrete._z(unknowns))[0, 0])
    values = discrete.call(
        "integrands", discrete.inner.s, discrete.rows(unknowns, discrete.inner), discrete._z(unknowns)
    )
    layout = discrete.layout
    lam = unknowns.whole[layout.unknown + layout.numbers :]
    size = sum(abs(lam[k]) * float(np.sum(discrete.inner.weights * np.abs(f))) for k, f in enumerate(values))
    return value, max(size, abs(value))


def reported_z(posed: Posed, discrete: Discrete, unknowns: Unknowns) -> Array:
    """Return z with the further numbers, which decide nothing."""
    z = discrete._z(unknowns)
    curve = posed.curve
    start = len(z) - len(curve.further)
    integrals = [k for k, row in enumerate(curve.further) if row.kind == "integral"]
    if integrals:
        y = discrete.rows(unknowns, discrete.inner)
        values = discrete.call("further_integrands", discrete.inner.s, y, z)
        z[start : start + len(integrals)] = np.sum(discrete.inner.weights * values, axis=(1, 2))
    deciding = sum(row.kind != "integral" for row in curve.numbers)
    table = discrete.coordinates(unknowns)
    for k in range(len(curve.further) - len(integrals)):
        element, functions = discrete.number_functions[deciding + k]
        y = np.zeros((discrete._height(), 1))
        values = functions @ table[element]
        y[: values.size, 0] = values.ravel()
        s = discrete.number_s[deciding + k : deciding + k + 1]
        z[start + len(integrals) + k] = discrete.call("further_values", s, y, z)[k, 0]
    return z
