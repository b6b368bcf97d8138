"""The unknowns of a discrete curve: values at borders, bubbles inside elements, numbers of the whole, multipliers."""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ..problem import Array, Curve
from . import basis
from .mesh import Mesh


class Unknowns(Struct, eq=False):
    """``border``: (elements + 1, r n + points), coordinates and their derivatives, then multipliers of conditions on
    positions; ``inside``: (elements, ..), bubbles, then multipliers; ``whole``: ends of the range, numbers, multipliers of
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
    """Where each unknown of an element stands in its block: left border, right border, inside."""

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

    @property
    def whole(self) -> int:
        return self.unknown + 2 * self.numbers + self.wholes

    @property
    def multipliers(self) -> int:
        """How many conditions there are on numbers of the whole."""
        return self.numbers + self.wholes


def layout_of(curve: Curve, degree: int) -> Layout:
    """Return the places of the unknowns for elements of one degree."""
    n, r = curve.coordinates, curve.order
    positions = tuple(k for k, row in enumerate(curve.points) if row.kind == "position")
    rates = tuple(k for k, row in enumerate(curve.points) if row.kind != "position")
    width = r * n + len(positions)
    bubbles = degree + 1 - 2 * r
    intervals = degree + 1 - r
    inner_nodes, rate_nodes = intervals - 1, intervals
    inner = bubbles * n + inner_nodes * len(positions) + rate_nodes * len(rates)
    place = np.empty((degree + 1, n), dtype=np.int64)
    for j in range(degree + 1):
        for i in range(n):
            if j < r:
                place[j, i] = j * n + i
            elif j < 2 * r:
                place[j, i] = width + (j - r) * n + i
            else:
                place[j, i] = 2 * width + (j - 2 * r) * n + i
    start = 2 * width + bubbles * n
    m = len(positions)
    node_place = np.empty((intervals + 1, m), dtype=np.int64)
    for k in range(m):
        node_place[0, k] = r * n + k
        node_place[-1, k] = width + r * n + k
        node_place[1:-1, k] = start + np.arange(inner_nodes) * m + k
    start += inner_nodes * m
    rate_place = start + np.arange(rate_nodes * len(rates)).reshape(rate_nodes, len(rates))
    return Layout(
        n, r, degree, positions, rates, width, bubbles, inner_nodes, rate_nodes, inner, place, node_place,
        rate_place, len(curve.numbers), curve.unknown, len(curve.wholes),
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
    raw = np.linalg.lstsq(functions[0], np.eye(len(xi)), rcond=None)[0] if _alike(functions) else None
    count = mesh.count
    fits = np.array(
        [raw] if raw is not None else [np.linalg.lstsq(f, np.eye(len(xi)), rcond=None)[0] for f in functions]
    )
    table = fits @ np.swapaxes(at, 0, 1).swapaxes(1, 2)
    border = np.zeros((count + 1, layout.width))
    share = np.zeros(count + 1)
    border[:-1, : r * n] += table[:, :r].reshape(count, -1)
    border[1:, : r * n] += table[:, r : 2 * r].reshape(count, -1)
    share[:-1] += 1
    share[1:] += 1
    border /= share[:, None]
    inside = np.zeros((count, layout.inner))
    inside[:, : layout.bubbles * n] = table[:, 2 * r :].reshape(count, -1)
    return border, inside


def _alike(functions: Array) -> bool:
    return bool(np.all(functions == functions[:1]))


def chebyshev(count: int) -> Array:
    """Return places that are dense at both ends, the ends among them."""
    places: Array = basis.lobatto(count - 1)[0]
    return places
