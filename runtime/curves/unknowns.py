"""The unknowns of a discrete curve: values at borders, bubbles inside elements, numbers of the whole, multipliers."""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ..interface import CurveInterface
from ..numerics.rank import inverse
from ..problem import Array
from .mesh import Mesh, lobatto


class Unknowns(Struct, eq=False):
    """``border``: (elements + 1, r n + points), coordinates and their derivatives, then multipliers of conditions on
    positions, then of those on slopes at the first place of the element on the right (none at the last border); ``inside``: (elements, ..), bubbles, then multipliers; ``whole``: ends of the range, numbers, multipliers of
    numbers and of conditions."""

    border: Array
    inside: Array
    whole: Array

    def moved(self, step: Unknowns, share: float = 1.0) -> Unknowns:
        return Unknowns(
            self.border + share * step.border,
            self.inside + share * step.inside,
            self.whole + share * step.whole,
        )


class Layout(Struct, frozen=True, eq=False):
    """Where each unknown of an element stands in its block: left border, right border, inside.

    ``orders``: how many values of each coordinate (itself, its slope, ..) go on across borders; ``shared``: how many unknowns
    of coordinates a border has, ``own`` how many the inside: bubbles, then slopes that leap.
    """

    n: int
    r: int
    degree: int
    positions: tuple[int, ...]
    rates: tuple[int, ...]
    width: int
    bubbles: int
    inner_nodes: int
    rate_nodes: int
    inner: int
    place: NDArray[np.int64]
    node_place: NDArray[np.int64]
    rate_place: NDArray[np.int64]
    numbers: int
    unknown: int
    wholes: int
    orders: tuple[int, ...]
    shared: int
    own: int

    @property
    def whole(self) -> int:
        return self.unknown + 2 * self.numbers + self.wholes

    @property
    def multipliers(self) -> int:
        """How many conditions there are on numbers of the whole."""
        return self.numbers + self.wholes


def orders_of(curve: CurveInterface) -> tuple[int, ...]:
    """Return how many values of each coordinate go on across borders: as many as derivatives of it decide.

    So the slope of a coordinate that does not bend leaps at loads and choices by place also beside one that bends. One whose
    slope is asked for at a place, or that stands in a condition at every place, goes on as smoothly as the smoothest.
    """
    n, r = curve.coordinates, curve.order
    orders = [1] * n
    for _, c in curve.gradient:
        if c < n * (r + 1):
            orders[c % n] = max(orders[c % n], c // n)
    smooth = [c for _, c in curve.point_gradient] + [c for _, c in curve.place_gradient if c >= n]
    for c in smooth:
        if c < n * (r + 1):
            orders[c % n] = r
    return tuple(orders)


def layout_of(curve: CurveInterface, degree: int) -> Layout:
    """Return the places of the unknowns for elements of one degree."""
    n, r = curve.coordinates, curve.order
    positions = tuple(k for k, row in enumerate(curve.points) if row.kind == "position")
    rates = tuple(k for k, row in enumerate(curve.points) if row.kind != "position")
    orders = orders_of(curve)
    shared = sum(orders)
    width = shared + len(positions) + len(rates)
    bubbles = degree + 1 - 2 * r
    own = bubbles * n + 2 * (r * n - shared)
    intervals = degree + 1 - r
    inner_nodes, rate_nodes = intervals - 1, intervals
    inner = own + inner_nodes * len(positions) + (rate_nodes - 1) * len(rates)
    place = np.empty((degree + 1, n), dtype=np.int64)
    place[2 * r :] = 2 * width + np.arange(bubbles * n).reshape(bubbles, n)
    on_border, leaping = 0, 2 * width + bubbles * n
    for j in range(r):
        for i in range(n):
            if j < orders[i]:
                place[[j, r + j], i] = on_border, width + on_border
                on_border += 1
            else:
                place[[j, r + j], i] = leaping, leaping + 1
                leaping += 2
    start = 2 * width + own
    m = len(positions)
    node_place = np.empty((intervals + 1, m), dtype=np.int64)
    for k in range(m):
        node_place[0, k] = shared + k
        node_place[-1, k] = width + shared + k
        node_place[1:-1, k] = start + np.arange(inner_nodes) * m + k
    start += inner_nodes * m
    # bubbles of one coordinate give its slope at all places but one: the multiplier of that one stands on the border
    rate_place = start + np.arange(-len(rates), (rate_nodes - 1) * len(rates)).reshape(rate_nodes, len(rates))
    rate_place[0] = shared + m + np.arange(len(rates))
    return Layout(
        n, r, degree, positions, rates, width, bubbles, inner_nodes, rate_nodes, inner, place, node_place,
        rate_place, len(curve.numbers), curve.unknown, len(curve.wholes), orders, shared, own,
    )  # fmt: skip


def local(unknowns: Unknowns) -> Array:
    """Return the unknowns of each element in the order of its block."""
    return np.concatenate([unknowns.border[:-1], unknowns.border[1:], unknowns.inside], axis=1)


def fitted(layout: Layout, mesh: Mesh, at: Array, xi: Array) -> tuple[Array, Array]:
    """Return border and inside of the coordinates that fit values ``at`` places ``xi`` of every element: (n, elements, places).

    Borders are shared, so that they get the mean of the two sides.
    """
    n, r = layout.n, layout.r
    functions = mesh.derivatives(r, xi, 0)[0]
    count = mesh.count
    fits = np.array([inverse(f) for f in (functions[:1] if _alike(functions) else functions)])
    table = fits @ np.swapaxes(at, 0, 1).swapaxes(1, 2)
    border = np.zeros((count + 1, layout.width))
    inside = np.zeros((count, layout.inner))
    share = np.zeros(count + 1)
    share[:-1] += 1
    share[1:] += 1
    for j in range(layout.degree + 1):
        for i in range(n):
            place = layout.place[j, i]
            if place >= 2 * layout.width:
                inside[:, place - 2 * layout.width] = table[:, j, i]
            elif place >= layout.width:
                border[1:, place - layout.width] += table[:, j, i]
            else:
                border[:-1, place] += table[:, j, i]
    border /= share[:, None]
    return border, inside


def _alike(functions: Array) -> bool:
    return bool(np.all(functions == functions[:1]))


def chebyshev(count: int) -> Array:
    """Return places that are dense at both ends, the ends among them."""
    places: Array = lobatto(count - 1)[0]
    return places
