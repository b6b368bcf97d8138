"""Random networks of nodes without mass: springs and dampers between nodes, masses and the ground, forces on nodes, in parts or not.

Their definition is numeric. With K z and D z' of springs and dampers, D has a null space N and a range R. Along N no damper resists, so
that N^T (f - K z) = 0 decides the places at all times; along R the rates follow from R^T D R b' = R^T (f - K z + d v).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from random import Random

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

REGULAR = 0.05
"""Least singular value of the balances by the places that they decide at the start, over the largest by all, that suffices."""
CLASSES = """model Node
  dimensionless;
  coordinate z ~ 0;
end Node;
model Link
  dimensionless;
  input a = 0;
  input b = 0;
  parameter k = 0;
  parameter c = 0;
  potential 1/2*k*(a - b)^2;
  damping c on a - b;
end Link;"""


@dataclass(frozen=True)
class Edge:
    """A spring ``k`` and a damper ``c``, one of them zero, from a node to another one, to a mass (-2, -3, ..) or to the ground (-1)."""

    node: int
    other: int
    k: float
    c: float


@dataclass(frozen=True)
class Network:
    """``forces``: (node, factor, frequency). ``guessed``: nodes that begin where the balances say, the others at ``start``."""

    start: tuple[float, ...]
    edges: tuple[Edge, ...]
    forces: tuple[tuple[int, float, float], ...]
    guessed: frozenset[int]
    parts: bool

    # ------------------------------------------------------------ the text

    @property
    def names(self) -> list[str]:
        return [f"w{i}.z" if self.parts else f"w{i}" for i in range(len(self.start))]

    def lines(self) -> list[str]:
        """Return the statements of the model."""
        names, found = self.names, []
        for i, value in enumerate(self.start):
            begun = f"{'~' if i in self.guessed else '='} {value}"
            found.append(f"Node w{i}(z {begun});" if self.parts else f"coordinate w{i} {begun};")
        for n, e in enumerate(self.edges):
            a, b = names[e.node], self._other(e)
            if self.parts:
                found.append(f"Link link{n}(a = {a}, b = {b}, {f'k = {e.k}' if e.k else f'c = {e.c}'});")
            else:
                found.append(f"potential 1/2*{e.k}*({a} - {b})^2;" if e.k else f"damping {e.c} on {a} - {b};")
        return [*found, *(f"force {f}*cos({w}*time) on {names[i]};" for i, f, w in self.forces)]

    def _other(self, e: Edge) -> str:
        return self.names[e.other] if e.other >= 0 else f"x{-2 - e.other}" if e.other < -1 else "0"

    # ------------------------------------------------------------ the definition

    def matrices(self) -> tuple[Array, Array]:
        """Return K and D of the nodes."""
        m = len(self.start)
        k, d = np.zeros((m, m)), np.zeros((m, m))
        for e in self.edges:
            row = np.zeros(m)
            row[e.node] = 1.0
            if e.other >= 0:
                row[e.other] = -1.0
            k += e.k * np.outer(row, row)
            d += e.c * np.outer(row, row)
        return k, d

    def spaces(self) -> tuple[Array, Array]:
        """Return bases of the null space and of the range of D, in columns."""
        sizes, vectors = np.linalg.eigh(self.matrices()[1])
        held = sizes > 1e-9 * max(1.0, float(sizes.max()))
        return vectors[:, ~held], vectors[:, held]

    def pulls(self, t: float, x: Array, v: Array) -> tuple[Array, Array]:
        """Return what springs and forces, and what dampers of moving masses do to nodes at z = 0."""
        f, g = np.zeros(len(self.start)), np.zeros(len(self.start))
        for i, factor, w in self.forces:
            f[i] += factor * np.cos(w * t)
        for e in self.edges:
            if e.other < -1:
                f[e.node] += e.k * x[-2 - e.other]
                g[e.node] += e.c * v[-2 - e.other]
        return f, g

    def first(self, x: Array) -> Array:
        """Return b at the start: guessed nodes are where the balances want them."""
        k, _ = self.matrices()
        null, along = self.spaces()
        f, _ = self.pulls(0.0, x, np.zeros(len(x)))
        z, guessed = np.array(self.start), sorted(self.guessed)
        if guessed:
            z[guessed] = 0.0
            z[guessed] = np.linalg.solve(null.T @ k[:, guessed], null.T @ (f - k @ z))
        return np.asarray(along.T @ z)

    def places(self, t: float, x: Array, b: Array) -> Array:
        """Return z."""
        k, _ = self.matrices()
        null, along = self.spaces()
        f, _ = self.pulls(t, x, np.zeros(len(x)))
        z = along @ b
        return np.asarray(z + null @ np.linalg.solve(null.T @ k @ null, null.T @ (f - k @ z)))

    def motion(self, t: float, x: Array, v: Array, b: Array) -> tuple[Array, Array]:
        """Return b' and the forces on the masses."""
        k, d = self.matrices()
        along, z = self.spaces()[1], self.places(t, x, b)
        f, g = self.pulls(t, x, v)
        rate: Array = np.asarray(np.linalg.solve(along.T @ d @ along, along.T @ (f + g - k @ z)), float)
        moved = along @ rate
        forces: Array = np.zeros(len(x))
        for e in self.edges:
            if e.other < -1:
                j = -2 - e.other
                forces[j] += e.k * (z[e.node] - x[j]) + e.c * (moved[e.node] - v[j])
        return rate, forces


def network(r: Random, masses: int) -> Network:
    """Return a network in which each node hangs on an earlier one, on a mass or on the ground, with a few further edges."""

    def of(low: float, high: float) -> float:
        return round(r.uniform(low, high), 2)

    m, chain = r.randint(2, 5), r.random() < 0.4
    anchors = [-1, *(-2 - j for j in range(masses))]
    damped = r.choice([0.0, 0.3, 0.5, 0.8])
    edges = []

    def join(i: int, other: int) -> None:
        k, c = of(1, 6), of(0.2, 2)
        edges.append(Edge(i, other, 0.0, c) if r.random() < damped else Edge(i, other, k, 0.0))

    for i in range(m):
        join(i, i - 1 if chain and i else r.choice([*anchors, *range(i), *range(i)]))
    for _ in range(r.choice([0, 1, 1, 2])):
        i = r.randrange(m)
        join(i, r.choice([*anchors, *range(i), *range(i)]))
    forces = [(r.randrange(m), of(-1, 1), of(0.5, 4)) for _ in range(r.choice([0, 0, 1, 2]))]
    start = tuple(of(-0.5, 0.5) for _ in range(m))
    made = Network(start, tuple(edges), tuple(forces), frozenset(), r.random() < 0.5)
    null, k = made.spaces()[0], made.matrices()[0]
    ways = [*itertools.combinations(range(m), null.shape[1])]
    r.shuffle(ways)
    guessed = max(ways, key=lambda w: min(REGULAR, _regular(null.T @ k, w)))
    return Network(start, made.edges, made.forces, frozenset(guessed), made.parts)


def _regular(balances: Array, places: tuple[int, ...]) -> float:
    if not places:
        return 1.0
    every, some = (np.linalg.svd(rows, compute_uv=False) for rows in (balances, balances[:, places]))
    return float(some.min() / (every.max() or 1.0))
