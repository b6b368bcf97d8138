"""The equations of a curve in elements: residuals and matrices of the unknowns, from the functions of the model."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ..interface import CurveInterface
from ..problem import Array, Problem
from .mesh import Mesh, gauss, lobatto
from .unknowns import Layout, Unknowns, layout_of, local

EXTRA = 4
"""Places of Gauss in an element beyond its degree."""


class Blocks(Struct, eq=False):
    """Residual and matrix: of each element (its borders and its inside), between elements and the whole, of the whole."""

    local_residual: Array
    whole_residual: Array
    local: Array
    across: Array
    whole: Array


class MeshPlaces(Struct, frozen=True, eq=False):
    """Places in every element at which something is evaluated: s, functions of the elements, weights."""

    s: Array
    functions: Array
    weights: Array


class DiscreteCurve:
    """A problem on a mesh with values of its parameters. ``weights`` are those of the gauge; ``held``: residuals that the
    conditions on the whole keep, on the way to those that are asked for. ``leaps``: the slope leaps to its bound; ``seen``:
    the elements that held it so far."""

    def __init__(self, problem: Problem, mesh: Mesh, p: Array, weights: Array) -> None:
        assert problem.curve is not None
        self.problem = problem
        self.curve: CurveInterface = problem.curve
        self.mesh = mesh
        self.p = p
        self.gauge = weights
        self.held: Array | None = None
        self.leaps = False
        self.seen: set[bytes] = set()
        self.layout: Layout = layout_of(self.curve, mesh.degree)
        self.functions: Mapping[str, Callable[..., Array]] = problem.functions
        depth = self.curve.depth
        count = mesh.degree + EXTRA
        self.inner = MeshPlaces(*mesh.quadrature(self.curve.order, *gauss(count), depth))
        intervals = mesh.degree + 1 - self.curve.order
        self.nodes = self._places(*lobatto(intervals), self.curve.order)
        self.rate_nodes = self._places(*gauss(intervals), self.curve.order)
        self.number_s, self.number_functions = self._number_places()
        self.active_nodes: NDArray[np.bool_] = np.ones(
            (mesh.count, intervals + 1, len(self.layout.positions)), bool
        )
        self.active_rates: NDArray[np.bool_] = np.ones((mesh.count, intervals, len(self.layout.rates)), bool)

    def _places(self, xi: Array, weights: Array, depth: int) -> MeshPlaces:
        half = np.diff(self.mesh.nodes)[:, None] / 2
        return MeshPlaces(
            self.mesh.places(xi), self.mesh.derivatives(self.curve.order, xi, depth), weights * half
        )

    def _number_places(self) -> tuple[Array, list[tuple[int, Array]]]:
        """Return where values are asked for, and the functions of the element there."""
        shares = self.functions["places"](
            np.zeros(1), np.zeros((self._height(), 1)), _NONE, self._z(None), self.p
        )[:, 0]
        found = []
        for s in shares:
            element, xi = self.mesh.find(np.array([s]))
            functions = self._at(int(element[0]), float(xi[0]))
            found.append((int(element[0]), functions))
        return shares, found

    def _at(self, element: int, xi: float) -> Array:
        one = Mesh(
            self.mesh.nodes[element : element + 2], self.mesh.steep[element : element + 1], self.mesh.degree
        )
        functions = one.derivatives(self.curve.order, np.array([xi]), self.curve.depth)
        return functions[:, 0, 0]

    def _height(self) -> int:
        return self.curve.coordinates * (self.curve.depth + 1) + len(self.curve.points)

    # ------------------------------------------------------------ arguments of the functions of the model

    def _z(self, unknowns: Unknowns | None) -> Array:
        size = self.layout.whole + len(self.gauge) + len(self.curve.further)
        z = np.zeros(size)
        if unknowns is not None:
            z[: self.layout.whole] = unknowns.whole
        z[self.layout.whole : self.layout.whole + len(self.gauge)] = self.gauge
        return z

    def coordinates(self, unknowns: Unknowns) -> Array:
        """Return the coefficients of the coordinates: (elements, functions, n)."""
        return local(unknowns)[:, self.layout.place]

    def rows(self, unknowns: Unknowns, places: MeshPlaces, table: Array | None = None) -> Array:
        """Return y at places: (height, elements, places)."""
        n, depth = self.layout.n, len(places.functions) - 1
        table = self.coordinates(unknowns) if table is None else table
        y = np.zeros((self._height(), *places.s.shape))
        for k in range(depth + 1):
            y[k * n : (k + 1) * n] = np.moveaxis(places.functions[k] @ table, 2, 0)
        return y

    def call(self, name: str, s: Array, y: Array, z: Array) -> Array:
        """Return what a function of the model gives at places of any shape."""
        found = self.functions[name](s.ravel(), y.reshape(len(y), -1), _NONE, z, self.p)
        return found.reshape(len(found), *s.shape)

    def sizes(self, unknowns: Unknowns) -> Array:
        """Return the size of each coordinate: its largest value, or how far it ranges."""
        values = np.moveaxis(self.inner.functions[0] @ self.coordinates(unknowns), 2, 0).reshape(
            self.layout.n, -1
        )
        size = np.maximum(np.max(np.abs(values), axis=1), np.ptp(values, axis=1))
        return np.where(size > 0, size, max(float(size.max()), 1e-3))

    # ------------------------------------------------------------ residual and matrix

    def stiffness(self, sizes: Array) -> Array:
        """Return the matrix of sum over coordinates of the integral of (d^r q/ds^r / size)^2 + (q / size)^2, with the order r of
        each, for each element."""
        layout, places = self.layout, self.inner
        size = 2 * layout.width + layout.inner
        made = np.zeros((self.mesh.count, size, size))
        for k in sorted({0, *layout.orders}):
            functions = places.functions[k]
            block = np.swapaxes(functions * places.weights[:, :, None], 1, 2) @ functions
            for i in range(layout.n):
                if k in (0, layout.orders[i]):
                    where = layout.place[:, i]
                    made[:, where[:, None], where[None, :]] += block / sizes[i] ** 2
        return made

    def blocks(self, unknowns: Unknowns, *, matrix: bool = True) -> Blocks:
        """Return the residual, and with ``matrix`` its derivative."""
        count, layout = self.mesh.count, self.layout
        size = 2 * layout.width + layout.inner
        made = Blocks(
            np.zeros((count, size)),
            np.zeros(layout.whole),
            np.zeros((count, size, size) if matrix else (0, 0, 0)),
            np.zeros((count, size, layout.whole) if matrix else (0, 0, 0)),
            np.zeros((layout.whole, layout.whole)),
        )
        table = self.coordinates(unknowns)
        z = self._z(unknowns)
        self._integrals(unknowns, table, z, made, matrix)
        self._values(unknowns, table, z, made, matrix)
        self._conditions(unknowns, z, made)
        for places, which, active, where in (
            (self.nodes, layout.positions, self.active_nodes, layout.node_place),
            (self.rate_nodes, layout.rates, self.active_rates, layout.rate_place),
        ):
            if which is layout.rates and which:  # the place at the last border is that of no element
                spare = layout.width - len(which) + np.arange(len(which))
                made.local_residual[-1, layout.width + spare] += unknowns.border[-1, spare]
                if matrix:
                    made.local[-1, layout.width + spare, layout.width + spare] += 1
            if which:
                self._points(unknowns, table, z, made, matrix, places, which, active, where)
        return made

    def _column(self, c: int) -> tuple[int, int, int]:
        """Return (derivative, coordinate, -1) or (-1, -1, index in the whole) of a column of a pattern."""
        n, order = self.layout.n, self.curve.order
        if c < n * (order + 1):
            return c // n, c % n, -1
        return -1, -1, self.curve.shared[c - n * (order + 1)]

    def _integrals(self, unknowns: Unknowns, table: Array, z: Array, made: Blocks, matrix: bool) -> None:
        layout, curve, places = self.layout, self.curve, self.inner
        y = self.rows(unknowns, places, table)
        w = places.weights
        integrals = [k for k, row in enumerate(curve.numbers) if row.kind == "integral"]
        first = layout.unknown
        lam0 = first + layout.numbers
        f = self.call("integrands", places.s, y, z)
        gradients = self.call("integrand_gradients", places.s, y, z)
        for k in integrals:
            made.whole_residual[lam0 + k] += float(np.sum(w * f[k]))
        for (k, c), g in zip(curve.gradient, gradients, strict=True):
            order, i, shared = self._column(c)
            lam = unknowns.whole[lam0 + k]
            if shared >= 0:
                total = float(np.sum(w * g))
                made.whole_residual[shared] += lam * total
                made.whole[shared, lam0 + k] += total
                made.whole[lam0 + k, shared] += total
                continue
            column = np.einsum("eq,eqj->ej", w * g, places.functions[order])
            where = layout.place[:, i]
            made.local_residual[:, where] += lam * column
            if matrix:
                made.across[:, where, lam0 + k] += column
        if matrix:
            self._curvature(
                self.call("curvature", places.s, y, z), curve.curvature, w, places.functions, made
            )

    def _curvature(
        self, entries: Array, pattern: Sequence[tuple[int, int]], w: Array, functions: Array, made: Blocks
    ) -> None:
        layout = self.layout
        for (a, b), entry in zip(pattern, entries, strict=True):
            (ka, ia, sa), (kb, ib, sb) = self._column(a), self._column(b)
            weighted = w * entry
            if sa >= 0 and sb >= 0:
                total = float(np.sum(weighted))
                made.whole[sa, sb] += total
                if sa != sb:
                    made.whole[sb, sa] += total
            elif sb >= 0:
                column = np.einsum("eq,eqj->ej", weighted, functions[ka])
                made.across[:, layout.place[:, ia], sb] += column
            else:
                block = np.swapaxes(functions[ka] * weighted[:, :, None], 1, 2) @ functions[kb]
                rows, columns = layout.place[:, ia], layout.place[:, ib]
                made.local[:, rows[:, None], columns[None, :]] += block
                if a != b:
                    made.local[:, columns[:, None], rows[None, :]] += np.swapaxes(block, 1, 2)

    def _values(self, unknowns: Unknowns, table: Array, z: Array, made: Blocks, matrix: bool) -> None:
        """Add the values at places: residual value - number, with a multiplier."""
        layout, curve = self.layout, self.curve
        integrals = sum(row.kind == "integral" for row in curve.numbers)
        lam0 = layout.unknown + layout.numbers
        for k in range(layout.numbers - integrals):
            element, functions = self.number_functions[k]
            index = lam0 + integrals + k
            y = np.zeros((self._height(), 1))
            values = functions @ table[element]
            y[: values.size, 0] = values.ravel()
            s = self.number_s[k : k + 1]
            lam = unknowns.whole[index]
            made.whole_residual[index] += float(self.call("at_places", s, y, z)[k, 0])
            gradients = self.call("place_gradients", s, y, z)[:, 0]
            for (row, c), g in zip(curve.place_gradient, gradients, strict=True):
                if row != k:
                    continue
                order, i, shared = self._column(c)
                if shared >= 0:
                    made.whole_residual[shared] += lam * g
                    made.whole[shared, index] += g
                    made.whole[index, shared] += g
                    continue
                where = layout.place[:, i]
                made.local_residual[element, where] += lam * g * functions[order]
                if matrix:
                    made.across[element, where, index] += g * functions[order]
            if matrix and curve.place_curvature:
                alone = z.copy()
                alone[lam0 : lam0 + layout.numbers] = 0.0
                alone[index] = lam
                entries = self.call("place_curvature", s, y, alone)[:, 0]
                self._curvature_at(entries, element, functions, made)

    def _curvature_at(self, entries: Array, element: int, functions: Array, made: Blocks) -> None:
        layout = self.layout
        for (a, b), entry in zip(self.curve.place_curvature, entries, strict=True):
            (ka, ia, sa), (kb, ib, sb) = self._column(a), self._column(b)
            if sa >= 0 and sb >= 0:
                made.whole[sa, sb] += entry
                if sa != sb:
                    made.whole[sb, sa] += entry
            elif sb >= 0:
                made.across[element, layout.place[:, ia], sb] += entry * functions[ka]
            else:
                block = entry * np.outer(functions[ka], functions[kb])
                rows, columns = layout.place[:, ia], layout.place[:, ib]
                made.local[element][np.ix_(rows, columns)] += block
                if a != b:
                    made.local[element][np.ix_(columns, rows)] += block.T

    def _conditions(self, unknowns: Unknowns, z: Array, made: Blocks) -> None:
        """Add what is stationary and the conditions on numbers; and that numbers are what they are called."""
        layout, curve = self.layout, self.curve
        zero, y = np.zeros(1), np.zeros((self._height(), 1))
        first, lam0 = layout.unknown, layout.unknown + layout.numbers
        mu0 = lam0 + layout.numbers
        values = self.call("wholes", zero, y, z)[:, 0]
        made.whole_residual[mu0:] += values[1:]
        if self.held is not None:
            made.whole_residual[mu0:] -= self.held
        for (row, c), g in zip(
            curve.whole_gradient, self.call("whole_gradients", zero, y, z)[:, 0], strict=True
        ):
            if row == 0:
                made.whole_residual[c] += g
                continue
            made.whole_residual[c] += unknowns.whole[mu0 + row - 1] * g
            made.whole[c, mu0 + row - 1] += g
            made.whole[mu0 + row - 1, c] += g
        for (a, b), entry in zip(
            curve.whole_curvature, self.call("whole_curvature", zero, y, z)[:, 0], strict=True
        ):
            made.whole[a, b] += entry
            if a != b:
                made.whole[b, a] += entry
        for k in range(layout.numbers):
            made.whole_residual[lam0 + k] -= unknowns.whole[first + k]
            made.whole_residual[first + k] -= unknowns.whole[lam0 + k]
            made.whole[lam0 + k, first + k] -= 1.0
            made.whole[first + k, lam0 + k] -= 1.0

    def _points(
        self,
        unknowns: Unknowns,
        table: Array,
        z: Array,
        made: Blocks,
        matrix: bool,
        places: MeshPlaces,
        which: Sequence[int],
        active: NDArray[np.bool_],
        where: NDArray[np.int64],
    ) -> None:
        """Add conditions at every place: density * residual at nodes, which their weights make an integral."""
        layout, curve = self.layout, self.curve
        y = self.rows(unknowns, places, table)
        densities = local(unknowns)[:, where]
        height = layout.n * (curve.depth + 1)
        on = active.astype(float)
        for m, k in enumerate(which):
            y[height + k] = densities[:, :, m] * on[:, :, m]
        w = places.weights
        residuals = self.call("points", places.s, y, z)
        gradients = self.call("point_gradients", places.s, y, z)
        for m, k in enumerate(which):
            kept = on[:, :, m]
            rows = where[:, m]
            # each node has a place of its own, so that nothing is added twice
            made.local_residual[:, rows] += w * kept * residuals[k] + (1 - kept) * densities[:, :, m]
            if matrix:
                made.local[:, rows, rows] += 1 - kept
        for (k, c), g in zip(curve.point_gradient, gradients, strict=True):
            if k not in which:
                continue
            m = which.index(k)
            weighted = w * on[:, :, m] * g
            order, i, shared = self._column(c)
            rows = where[:, m]
            if shared >= 0:
                made.whole_residual[shared] += float(np.sum(weighted * densities[:, :, m]))
                if matrix:
                    made.across[:, rows, shared] += weighted
                continue
            columns = layout.place[:, i]
            made.local_residual[:, columns] += np.einsum(
                "eq,eqj->ej", weighted * densities[:, :, m], places.functions[order]
            )
            if matrix:
                block = weighted[:, :, None] * places.functions[order]
                made.local[:, rows[:, None], columns[None, :]] += block
                made.local[:, columns[:, None], rows[None, :]] += np.swapaxes(block, 1, 2)
        if matrix and curve.point_curvature:
            other = [k for k in range(len(curve.points)) if k not in which]
            for k in other:
                y[height + k] = 0.0
            self._curvature(
                self.call("point_curvature", places.s, y, z), curve.point_curvature, w, places.functions, made
            )


_NONE = np.zeros(0)
