"""Where a search begins: unknowns from a guess, and those of one mesh moved to another."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ..numerics.rank import POSITIONS, rank
from ..problem import Array
from .discrete import DiscreteCurve
from .mesh import gauss, lobatto
from .newton import projected
from .posed import Posed
from .unknowns import Unknowns, chebyshev, fitted

FAR = 0.1
"""Of the size of its terms by which a guess misses a condition, so that it is told."""
MISSED = 1e-6
"""Of the size of the curve by which a guess misses an end, beyond rounding and polynomials."""
GROWN = 1e8
"""Times that what is beside an end is larger there, so that it counts as infinite: rounding may leave a zero that is none."""
HALVINGS = 60
STEEP = 1e-4
"""Of its mean rate: a slower independent variable at an end stands still there."""
Source = Callable[[Array], Array]
"""Coordinates at places s: (n, places)."""


def beginning(discrete: DiscreteCurve, posed: Posed, source: Source) -> tuple[Unknowns, list[str]]:
    """Return unknowns from a guess of the coordinates, bent to the ends, and the ends that the guess does not meet."""
    layout, mesh = discrete.layout, discrete.mesh
    xi = chebyshev(mesh.degree + 1)
    s = mesh.places(xi)
    at = source(s.ravel()).reshape(layout.n, *s.shape)
    border, inside = fitted(layout, mesh, at, xi)
    whole = np.zeros(layout.whole)
    whole[: layout.unknown] = posed.ends
    raw = with_numbers(discrete, Unknowns(border, inside, whole))
    off = _missed(discrete, raw)
    return with_numbers(discrete, projected(discrete, raw)), off


def _missed(discrete: DiscreteCurve, unknowns: Unknowns) -> list[str]:
    """Return the conditions at ends that do not hold, as they are shown."""
    rows = discrete.curve.wholes
    y = np.zeros((discrete._height(), 1))
    residuals = discrete.call("wholes", np.zeros(1), y, discrete._z(unknowns))[1:, 0]
    size = float(np.max(discrete.sizes(unknowns)))
    return [
        f"'{row.name}'"
        for row, residual in zip(rows, residuals, strict=True)
        if row.kind in ("initial", "final") and abs(residual) > MISSED * size
    ]


def far_off(discrete: DiscreteCurve, unknowns: Unknowns) -> list[str]:
    """Return the conditions on the whole and at every place that a curve misses by far, as they are shown."""
    layout, curve = discrete.layout, discrete.curve
    y, z = np.zeros((discrete._height(), 1)), discrete._z(unknowns)
    numbers = unknowns.whole[layout.unknown : layout.unknown + layout.numbers]
    size = float(np.max(np.abs(numbers), initial=1e-300))
    residuals = discrete.call("wholes", np.zeros(1), y, z)[1:, 0]
    off = [
        row.name
        for row, residual in zip(curve.wholes, residuals, strict=True)
        if row.kind == "whole" and abs(residual) > FAR * size
    ]
    if curve.points:
        along = discrete.rows(unknowns, discrete.inner)
        values = discrete.call("points", discrete.inner.s, along, z)
        slopes = np.zeros(len(curve.points))
        for (k, _), g in zip(
            curve.point_gradient, discrete.call("point_gradients", discrete.inner.s, along, z), strict=True
        ):
            slopes[k] = max(slopes[k], float(np.max(np.abs(g))))
        reach = np.maximum(slopes, 1e-300) * float(np.max(discrete.sizes(unknowns)))
        for k, row in enumerate(curve.points):
            worst = -float(np.min(values[k])) if row.bound else float(np.max(np.abs(values[k])))
            off += [row.name] if row.kind == "position" and worst > FAR * reach[k] else []
    return [f"'{name}'" for name in off]


def with_numbers(discrete: DiscreteCurve, made: Unknowns) -> Unknowns:
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


def without_repeats(discrete: DiscreteCurve, unknowns: Unknowns) -> None:
    """Let conditions at every place rest at an end where those of the end say the same."""
    layout, curve = discrete.layout, discrete.curve
    if not layout.positions:
        return
    for upper in (False, True):
        element, node = (-1, -1) if upper else (0, 0)
        ends, rows, _ = ends_given(discrete, unknowns, upper)
        for m, k in enumerate(layout.positions):
            if curve.points[k].bound:
                continue
            more = np.vstack([ends, rows[k : k + 1] / (np.abs(rows[k]).max() + 1e-300)])
            if rank(more, POSITIONS) == rank(ends, POSITIONS):
                discrete.active_nodes[element, node, m] = False


def ends_given(discrete: DiscreteCurve, unknowns: Unknowns, upper: bool) -> tuple[Array, Array, Array]:
    """Return, by coordinates at one end: derivatives of all conditions on numbers, those of conditions at every place, and
    the residuals of these there."""
    layout, curve, n = discrete.layout, discrete.curve, discrete.layout.n
    zero, y = np.zeros(1), np.zeros((discrete._height(), 1))
    z = discrete._z(unknowns)
    by_numbers = np.zeros((len(curve.wholes) + 1, layout.unknown + layout.numbers))
    for (row, c), g in zip(
        curve.whole_gradient, discrete.call("whole_gradients", zero, y, z)[:, 0], strict=True
    ):
        by_numbers[row, c] = g
    integrals = sum(row.kind == "integral" for row in curve.numbers)
    element, node = (-1, -1) if upper else (0, 0)
    s = np.array([1.0 if upper else 0.0])
    at = discrete.rows(unknowns, discrete.nodes)[:, element, node][:, None]
    values = np.zeros((layout.numbers, n))
    found = discrete.call("place_gradients", s, at, z)[:, 0]
    for (row, c), g in zip(curve.place_gradient, found, strict=True):
        if c < n and curve.numbers[integrals + row].kind == ("upper" if upper else "lower"):
            values[integrals + row, c] = g
    rows = np.zeros((len(curve.points), n))
    for (k, c), g in zip(curve.point_gradient, discrete.call("point_gradients", s, at, z)[:, 0], strict=True):
        if c < n:
            rows[k, c] = g
    return by_numbers[1:, layout.unknown :] @ values, rows, discrete.call("points", s, at, z)[:, 0]


def transferred(discrete: DiscreteCurve, unknowns: Unknowns, other: DiscreteCurve) -> Unknowns:
    """Return a curve on another mesh."""
    xi = chebyshev(other.mesh.degree + 1)
    s = other.mesh.places(xi)
    at = evaluate(discrete, unknowns, s.ravel(), 0)[: discrete.layout.n].reshape(discrete.layout.n, *s.shape)
    border, inside = fitted(other.layout, other.mesh, at, xi)
    made = Unknowns(border, inside, unknowns.whole.copy())
    _transfer_densities(discrete, unknowns, other, made)
    return made


def _transfer_densities(
    discrete: DiscreteCurve, unknowns: Unknowns, other: DiscreteCurve, made: Unknowns
) -> None:
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


def densities(discrete: DiscreteCurve, unknowns: Unknowns, s: Array) -> Array:
    """Return the densities of the multipliers of conditions at places, over s: (points, places)."""
    from .unknowns import local

    layout, curve = discrete.layout, discrete.curve
    element, xi = discrete.mesh.find(s)
    found = np.zeros((len(curve.points), len(s)))
    block = local(unknowns)
    intervals = discrete.mesh.degree + 1 - curve.order
    for which, where, nodes in (
        (layout.positions, layout.node_place, lobatto(intervals)[0]),
        (layout.rates, layout.rate_place, gauss(intervals)[0]),
    ):
        for m, k in enumerate(which):
            table = block[:, where[:, m]]
            if which is layout.positions and not curve.points[k].bound:
                _continue_to_borders(nodes, table)
            found[k] = _interpolated(nodes, table, element, xi)
    return found


def _continue_to_borders(nodes: Array, table: Array) -> None:
    """Give borders the values that polynomials through the nodes inside have there.

    What a node on a border has beside it is a force at one place, as where a coordinate that follows from a condition has no
    end of its own, or a corner; it is not a part of the density. Where the condition rests it has no value at all.
    """
    inner = nodes[1:-1]
    apart = inner[:, None] - inner[None, :] + np.eye(len(inner))
    for node in (0, -1):
        ahead = nodes[node] - inner
        shares = np.prod(ahead) / ahead / np.prod(apart, axis=1)
        table[:, node] = table[:, 1:-1] @ shares


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


def evaluate(discrete: DiscreteCurve, unknowns: Unknowns, s: Array, depth: int) -> Array:
    """Return y at places: coordinates and ``depth`` derivatives by s, (height, places)."""
    element, xi = discrete.mesh.find(s)
    n = discrete.layout.n
    table = discrete.coordinates(unknowns)[element]
    y = np.zeros((discrete._height(), len(s)))
    functions = discrete.mesh.values_in(element, discrete.curve.order, xi, depth)
    for k in range(depth + 1):
        y[k * n : (k + 1) * n] = np.einsum("sj,sji->is", functions[k], table)
    return y


def passed(discrete: DiscreteCurve, unknowns: Unknowns, s: Array) -> tuple[Array, Array]:
    """Return the independent variable of a curve whose variables were exchanged, and its derivative by the parameter."""
    n = discrete.layout.n
    y = evaluate(discrete, unknowns, s, 1)
    return y[n - 1], y[2 * n - 1]


def turns_back(discrete: DiscreteCurve, unknowns: Unknowns) -> bool:
    """Tell whether the independent variable does not ascend all along a curve whose variables were exchanged."""
    x, rate = passed(discrete, unknowns, np.linspace(0, 1, 2001))
    return bool(np.any(rate < -STEEP * np.ptp(x)))


def parameters_of(discrete: DiscreteCurve, unknowns: Unknowns, places: Array) -> Array:
    """Return the parameter s at values of the independent variable, which ascends."""
    low, high = np.zeros_like(places), np.ones_like(places)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        below = passed(discrete, unknowns, middle)[0] < places
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    found: Array = (low + high) / 2
    return found


def undefined(discrete: DiscreteCurve, unknowns: Unknowns) -> str:
    """Say where the guess leaves the domain of an integrand; empty if it does not."""
    y = discrete.rows(unknowns, discrete.inner)
    values = discrete.call("integrands", discrete.inner.s, y, discrete._z(unknowns))
    bad = ~np.isfinite(values).all(axis=0)
    if not bad.any():
        return ""
    place = float(discrete.inner.s[bad][0])
    return f"with the guess the integrand is not defined at {place:.3g} of the range"


def steep_ends(posed: Posed, source: Source) -> tuple[bool, bool]:
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

    def grows(end: int, beside: int) -> bool:
        steep = ~(np.abs(table[:, end]) <= GROWN * np.max(np.abs(table[:, 1:4]), axis=1))
        return bool((inner & steep & (table[:, beside] != 0)).any())

    return grows(0, 1), grows(4, 3)


def gauge(posed: Posed, source: Source) -> Array:
    """Return the weights of the coordinates in the speed that is kept constant."""
    curve = posed.curve
    if not curve.gauge:
        return np.zeros(0)
    values = source(np.linspace(0, 1, 101))
    spans = np.ptp(values, axis=1)
    spans = np.where(spans > 0, spans, max(float(spans.max()), 1e-3))
    weights: Array = 1 / spans**2
    return weights


WAVES = (1, 2, 3)
SHAPES = (np.sin, np.cos)
SHARE = 0.6
"""Of the range that a coordinate of its unit is taken to move."""


def spans(posed: Posed, at: Array) -> Array:
    """Return how far each coordinate ranges over places, (n, places); and for one of the unit of the range at
    least a share of that;
    zero for the independent variable itself."""
    found = np.maximum(np.ptp(at, axis=1), 0.3 * np.max(np.abs(at), axis=1))
    a, b = posed.range(posed.ends)
    alike = [q.measure == posed.problem.time.measure for q in posed.problem.states[: len(found)]]
    least = np.where(alike, SHARE * (b - a), 0.0)
    size = np.where(found > 0, np.maximum(found, least), np.where(alike, b - a, float(found.max()) or 1.0))
    if posed.curve.exchanged:
        size[-1] = 0.0
    return size


def with_waves(source: Source, size: Array, shares: Sequence[float]) -> Iterator[tuple[str, Source]]:
    """Yield a source with half waves added, as ``shares`` of ``size``, with words for each."""
    for shape in SHAPES:
        for wave in WAVES:
            for share in shares:

                def made(s: Array, share: float = share, wave: int = wave, shape: np.ufunc = shape) -> Array:
                    added: Array = share * size[:, None] * shape(np.pi * wave * s)[None, :]
                    return source(s) + added

                sign = "+" if share > 0 else "-"
                number = "" if wave == 1 else f"{wave} "
                wave_text = f"{shape.__name__}({number}pi s)"
                yield f"the guess {sign} {abs(share):g} {wave_text} of its size", made
