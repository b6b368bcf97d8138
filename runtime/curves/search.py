"""The search for a curve: a coarse mesh first, then smaller elements where the polynomials do not end, then a check."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ..problem import Array
from . import basis, obstacles
from .afar import newton_from_afar
from .discrete import Discrete
from .mesh import Mesh, mesh_of
from .newton import Factors, Solved, newton, projected, with_multipliers
from .posed import Posed
from .unknowns import Unknowns, chebyshev, fitted

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
    those of the mesh of lower degree, ``negative`` directions, Newton ``steps`` and ``unknowns`` in all."""

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


class Failed(Exception):
    """No stationary curve was found: ``tried`` says what was done."""

    def __init__(self, why: str, tried: Sequence[str]) -> None:
        super().__init__(why)
        self.why = why
        self.tried = tuple(tried)


Source = Callable[[Array], Array]
"""Coordinates at places s: (n, places)."""


def search(
    posed: Posed, *, deflated: Sequence[Answer] = (), start: Source | None = None, degree: int = DEGREE, adapt: bool = True, once: bool = False,
    elements: int = ELEMENTS,
) -> Answer:  # fmt: skip
    """Find a stationary curve from the guess, or from ``start``. Raises Failed."""
    tried: list[str] = []
    remarks: list[str] = []
    source = start or posed.guess
    steep = _steep(posed, source)
    weights = _gauge(posed, source)
    steps = 0
    found: tuple[Discrete, Solved] | None = None
    meshes = ((elements, degree), (elements, 6), (3 * elements, 6), (2, 6))
    for count, coarse in meshes[1:2] if once or deflated else meshes:
        mesh = mesh_of(posed.borders(), count, max(coarse, 2 * posed.curve.order + 2), steep)
        discrete = Discrete(posed.problem, mesh, posed.p, weights)
        first = beginning(discrete, posed, source)
        without_repeats(discrete, first)
        if why := _undefined(discrete, first):
            tried.append(why)
            continue
        known = [_moved(a, discrete) for a in deflated]
        if obstacles.has_bounds(discrete):
            obstacles.begin(discrete, first)
        for words, way in _ways(discrete, first, known, once=once):
            solved = _bounded(discrete, way())
            steps += solved.steps
            tried.append(
                f"{words} on {count} elements of degree {mesh.degree}: {solved.why or 'converged'}, "
                f"{plural_steps(solved.steps)}"
            )
            if solved.converged:
                break
        if solved.converged:
            found = discrete, solved
            break
    if found is None:
        raise Failed(tried[-1], tried)
    discrete, solved = found
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
    return _answer(posed, discrete, solved.unknowns, coarse_answer, steps, cycles, remarks)


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


# ---------------------------------------------------------------- starts


def beginning(discrete: Discrete, posed: Posed, source: Source) -> Unknowns:
    """Return unknowns from a guess of the coordinates: numbers of the whole are those of the guess."""
    layout, mesh = discrete.layout, discrete.mesh
    xi = chebyshev(mesh.degree + 1)
    s = mesh.places(xi)
    at = source(s.ravel()).reshape(layout.n, *s.shape)
    border, inside = fitted(layout, mesh, at, xi)
    whole = np.zeros(layout.whole)
    whole[: layout.unknown] = posed.ends
    return with_numbers(discrete, projected(discrete, Unknowns(border, inside, whole)))


def with_numbers(discrete: Discrete, made: Unknowns) -> Unknowns:
    """Return unknowns whose numbers are those of the curve, with the multipliers that these then have."""
    layout = discrete.layout
    lam0 = layout.unknown + layout.numbers
    for _ in range(2):  # integrands may read numbers
        made.whole[lam0 : lam0 + layout.numbers] = 0.0
        residual = discrete.blocks(made, matrix=False).whole_residual
        made.whole[layout.unknown : lam0] += residual[lam0 : lam0 + layout.numbers]
    residual = discrete.blocks(made, matrix=False).whole_residual
    made.whole[lam0 : lam0 + layout.numbers] = residual[layout.unknown : lam0]
    return made


def without_repeats(discrete: Discrete, unknowns: Unknowns) -> None:
    """Let conditions at every place rest at an end where those of the end say the same."""
    layout, curve = discrete.layout, discrete.curve
    if not layout.positions:
        return
    n = layout.n
    zero, y = np.zeros(1), np.zeros((discrete._height(), 1))
    z = discrete._z(unknowns)
    by_numbers = np.zeros((len(curve.wholes) + 1, layout.unknown + layout.numbers))
    for (row, c), g in zip(
        curve.whole_gradient, discrete.call("whole_gradients", zero, y, z)[:, 0], strict=True
    ):
        by_numbers[row, c] = g
    integrals = sum(row.kind == "integral" for row in curve.numbers)
    for upper in (False, True):
        element, node = (-1, -1) if upper else (0, 0)
        s = np.array([1.0 if upper else 0.0])
        at = discrete.rows(unknowns, discrete.nodes)[:, element, node][:, None]
        values = np.zeros((layout.numbers, n))
        found = discrete.call("place_gradients", s, at, z)[:, 0]
        for (row, c), g in zip(curve.place_gradient, found, strict=True):
            if c < n and curve.numbers[integrals + row].kind == ("upper" if upper else "lower"):
                values[integrals + row, c] = g
        ends = by_numbers[1:, layout.unknown :] @ values
        rows = np.zeros((len(curve.points), n))
        for (k, c), g in zip(
            curve.point_gradient, discrete.call("point_gradients", s, at, z)[:, 0], strict=True
        ):
            if c < n:
                rows[k, c] = g
        for m, k in enumerate(layout.positions):
            if curve.points[k].bound:
                continue
            rank = np.linalg.matrix_rank(ends, tol=1e-9 * (np.abs(ends).max() + 1e-300)) if len(ends) else 0
            more = np.vstack([ends, rows[k : k + 1] / (np.abs(rows[k]).max() + 1e-300)])
            if np.linalg.matrix_rank(more, tol=1e-9 * np.abs(more).max()) == rank:
                discrete.active_nodes[element, node, m] = False


def transferred(discrete: Discrete, unknowns: Unknowns, other: Discrete) -> Unknowns:
    """Return a curve on another mesh."""
    xi = chebyshev(other.mesh.degree + 1)
    s = other.mesh.places(xi)
    at = evaluate(discrete, unknowns, s.ravel(), 0)[: discrete.layout.n].reshape(discrete.layout.n, *s.shape)
    border, inside = fitted(other.layout, other.mesh, at, xi)
    made = Unknowns(border, inside, unknowns.whole.copy())
    _transfer_densities(discrete, unknowns, other, made)
    return made


def _transfer_densities(discrete: Discrete, unknowns: Unknowns, other: Discrete, made: Unknowns) -> None:
    layout = other.layout
    if not discrete.curve.points:
        return
    for places, where in ((other.nodes, layout.node_place), (other.rate_nodes, layout.rate_place)):
        if not where.size:
            continue
        which = layout.positions if places is other.nodes else layout.rates
        table = densities(discrete, unknowns, places.s.ravel())
        for m, k in enumerate(which):
            values = table[k].reshape(places.s.shape)
            for node in range(places.s.shape[1]):
                place = where[node, m]
                if place < layout.width:
                    made.border[:-1, place] = values[:, node]
                elif place < 2 * layout.width:
                    made.border[1:, place - layout.width] = values[:, node]
                else:
                    made.inside[:, place - 2 * layout.width] = values[:, node]


def densities(discrete: Discrete, unknowns: Unknowns, s: Array) -> Array:
    """Return the densities of the multipliers of conditions at places, over s: (points, places)."""
    from .unknowns import local

    layout, curve = discrete.layout, discrete.curve
    element, xi = discrete.mesh.find(s)
    found = np.zeros((len(curve.points), len(s)))
    block = local(unknowns)
    intervals = discrete.mesh.degree + 1 - curve.order
    for which, where, nodes in (
        (layout.positions, layout.node_place, basis.lobatto(intervals)[0]),
        (layout.rates, layout.rate_place, basis.gauss(intervals)[0]),
    ):
        for m, k in enumerate(which):
            table = block[:, where[:, m]]
            found[k] = _interpolated(nodes, table, element, xi)
    return found


def _interpolated(nodes: Array, table: Array, element: NDArray[np.int64], xi: Array) -> Array:
    """Return values between nodes of each element by Lagrange's polynomials in barycentric form."""
    apart = nodes[:, None] - nodes[None, :] + np.eye(len(nodes))
    weights = 1 / np.prod(apart * 2, axis=1)
    distance = xi[:, None] - nodes[None, :]
    hit = np.abs(distance) < 1e-14
    distance = np.where(hit, 1.0, distance)
    terms = weights[None, :] / distance
    values = np.sum(terms * table[element], axis=1) / np.sum(terms, axis=1)
    exact = hit.any(axis=1)
    values[exact] = table[element][exact][hit[exact]]
    result: Array = values
    return result


def evaluate(discrete: Discrete, unknowns: Unknowns, s: Array, depth: int) -> Array:
    """Return y at places: coordinates and ``depth`` derivatives by s, (height, places)."""
    element, xi = discrete.mesh.find(s)
    n = discrete.layout.n
    table = discrete.coordinates(unknowns)
    y = np.zeros((discrete._height(), len(s)))
    for e in np.unique(element):
        here = element == e
        one = Mesh(discrete.mesh.nodes[e : e + 2], discrete.mesh.steep[e : e + 1], discrete.mesh.degree)
        functions = one.derivatives(discrete.curve.order, xi[here], depth)[:, 0]
        for k in range(depth + 1):
            y[k * n : (k + 1) * n, here] = (functions[k] @ table[e]).T
    return y


def _undefined(discrete: Discrete, unknowns: Unknowns) -> str:
    """Say where the guess leaves the domain of an integrand; empty if it does not."""
    y = discrete.rows(unknowns, discrete.inner)
    values = discrete.call("integrands", discrete.inner.s, y, discrete._z(unknowns))
    bad = ~np.isfinite(values).all(axis=0)
    if not bad.any():
        return ""
    place = float(discrete.inner.s[bad][0])
    return f"with the guess the integrand is not defined at {place:.3g} of the range"


def _steep(posed: Posed, source: Source) -> tuple[bool, bool]:
    """Tell at which ends the integrand is singular with the guess."""
    curve = posed.curve
    if curve.order > 1:
        return False, False
    n = curve.coordinates
    s = np.array([0.0, 1e-4, 0.5, 1 - 1e-4, 1.0])
    y = np.zeros((n * (curve.depth + 1) + len(curve.points), len(s)))
    y[:n] = source(s)
    ahead, behind = source(np.clip(s + 1e-6, 0, 1)), source(np.clip(s - 1e-6, 0, 1))
    y[n : 2 * n] = (ahead - behind) / (np.clip(s + 1e-6, 0, 1) - np.clip(s - 1e-6, 0, 1))
    found = posed.functions["integrands"](s, y, np.zeros(0), posed.z(posed.ends), posed.p)
    further = posed.functions["integrand_gradients"](s, y, np.zeros(0), posed.z(posed.ends), posed.p)
    table = np.concatenate([found, further])
    inner = np.isfinite(table[:, 1:4]).all(axis=1)
    return bool((inner & ~np.isfinite(table[:, 0])).any()), bool((inner & ~np.isfinite(table[:, 4])).any())


def _gauge(posed: Posed, source: Source) -> Array:
    """Return the weights of the coordinates in the speed that is kept constant."""
    curve = posed.curve
    if not curve.gauge:
        return np.zeros(0)
    values = source(np.linspace(0, 1, 101))
    spans = np.ptp(values, axis=1)
    spans = np.where(spans > 0, spans, max(float(spans.max()), 1e-3))
    weights: Array = 1 / spans**2
    return weights


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
        smallest > 1e-13, steps, count, cycles, remarks,
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
