"""Moments of a solid inside triangles whose corners are formulas (divergence theorem), from the first corner."""

from __future__ import annotations

from ...graph import Graph, Node
from ...graph import vector as v3
from .values import Value, elements, node, vector

Triple = tuple[Node, ...]


class Sums:
    """Sums over the tetrahedra that faces make with the first corner: six volumes, 24 first moments, 120 second ones."""

    def __init__(self, graph: Graph, corners: Value, faces: Value) -> None:
        assert isinstance(corners, tuple) and isinstance(faces, tuple)
        self.graph, self.origin = graph, vector(corners[0])
        self.volume = graph.zero
        self.first = [graph.zero] * 3
        self.second = [[graph.zero] * 3 for _ in range(3)]
        sides = [tuple(map(graph.sub, vector(corner), self.origin)) for corner in corners]
        for face in faces:
            places = [int(graph.value(n)) - 1 for n in elements(face)]
            if 0 not in places:
                self._add(*(sides[k] for k in places))

    def _add(self, a: Triple, b: Triple, c: Triple) -> None:
        graph = self.graph
        d = graph.dot(a, v3.cross(graph, b, c))
        s = [graph.add(graph.add(x, y), z) for x, y, z in zip(a, b, c, strict=True)]
        self.volume = graph.add(self.volume, d)
        for m in range(3):
            self.first[m] = graph.add(self.first[m], graph.mul(d, s[m]))
            for n in range(m, 3):
                pairs = graph.dot((s[m], a[m], b[m], c[m]), (s[n], a[n], b[n], c[n]))
                self.second[m][n] = graph.add(self.second[m][n], graph.mul(d, pairs))

    def mesh_volume(self) -> Value:
        return self._over(self.volume, 6)

    def _over(self, value: Node, count: int) -> Node:
        return self.graph.div(value, self.graph.constant(count))

    def _centre(self) -> list[Node]:
        four = self.graph.mul(self.graph.constant(4), self.volume)
        return [self.graph.div(x, four) for x in self.first]

    def mesh_centre(self) -> Value:
        return tuple(map(self.graph.add, self.origin, self._centre()))

    def mesh_inertia(self) -> Value:
        """Return the tensor of unit density about the centre: trace of the second moments less these."""
        graph, centre = self.graph, self._centre()
        volume = node(self.mesh_volume())

        def about(m: int, n: int) -> Node:
            m, n = min(m, n), max(m, n)
            moved = graph.mul(volume, graph.mul(centre[m], centre[n]))
            return graph.sub(self._over(self.second[m][n], 120), moved)

        def entry(m: int, n: int) -> Node:
            if m != n:
                return graph.neg(about(m, n))
            j, k = (m + 1) % 3, (m + 2) % 3
            return graph.add(about(j, j), about(k, k))

        return tuple(tuple(entry(m, n) for n in range(3)) for m in range(3))
