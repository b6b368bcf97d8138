"""Nonlinear laws of forces that depend on other forces, such as F = -c N^(1/3) with a multiplier N: solved by Newton's method in the graph.

Laws are replaced by symbols w. The remaining equations are affine, and their solution gives each force
s = A + B w, with A and B functions of the state. The laws w = g(s) remain: H(s) = s - A - B g(s) = 0, one equation for each
force that enters a law. Where this has several solutions, the one is taken that continues s = A as c grows from 0 to 1 in
s - A - c B g(s) = 0 (a homotopy).
The iteration begins at s = A and tries c = 1 at once; where that fails, c grows in smaller steps. With c = 1,
steps are shortened instead (with the derivative of the graph). The determinant of dH/ds begins at one and must stay positive,
as two solutions meet where it vanishes: no step begins or ends where it is not positive, and none changes the angle of a sine
so far that it might have vanished in between. Each step is a branch that is skipped once H is small. One more step makes
the result exact to rounding in any precision, and its derivatives too. Where the iteration does not converge, the result
is not a number, and the run says so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from msgspec import Struct

from ...graph import DivisionByZero, Graph, Node
from ...graph import operations as ops
from ...graph.differentiate import jacobian
from ...graph.elimination.eliminate import solve_dense
from ...graph.rewrite import rebuild, substitute

STEPS = 32
"""Most steps of the iteration; some six are usual, and up to thirty where two solutions nearly meet."""

TOLERANCE = 1e-11
"""Residual at which the iteration ends, as a share of the terms it is made of; the last step squares it."""

WAVES = frozenset({ops.SIN, ops.COS, ops.TAN})
TURN = 1.0
"""Most that one step turns the argument of a wave, in rad."""


class Jumps(Exception):
    """A law is not continuous in a force: ``symbol``."""

    def __init__(self, symbol: Node) -> None:
        self.symbol = symbol


class Laws(Struct, frozen=True):
    """``formulas`` g by the symbol w of each law; ``forces`` are the symbols s that they contain."""

    formulas: Mapping[Node, Node]
    forces: tuple[Node, ...]

    def waves(self, graph: Graph) -> tuple[Node, ...]:
        """Return the sines, cosines and tangents of forces in the laws."""
        reached = graph.reach(list(self.formulas.values()))
        return tuple(n for n in reached if graph.op(n) in WAVES and set(graph.support(n)) & set(self.forces))


def take_laws_out(
    graph: Graph, nodes: Sequence[Node], forces: Sequence[Node], unknowns: Sequence[Node]
) -> tuple[list[Node], Laws]:
    """Return formulas that are affine in ``forces``, and the laws that stood in them.

    ``unknowns`` are accelerations and multipliers, which laws do not contain. Raises Jumps.
    """
    others = set(unknowns)
    dependent: set[Node] = set(forces)
    symbols: dict[Node, Node] = {}
    images: dict[Node, Node] = {}
    for n in graph.reach(nodes):
        arguments = graph.args(n)
        if not dependent.intersection(arguments):
            continue
        dependent.add(n)
        if _is_linear(graph, n, dependent):
            new = tuple(images.get(a, a) for a in arguments)
            if new != arguments:
                images[n] = rebuild(graph, n, graph, new)
        else:
            images[n] = symbols[n] = graph.symbol(f"#law {len(symbols)}")
    result = [images.get(n, n) for n in nodes]
    kept = set(graph.support(*result))
    formulas = {w: n for n, w in symbols.items() if w in kept}
    entering = set(graph.support(*formulas.values())) if formulas else set()
    assert not entering & others, "a law of forces contains an acceleration or a multiplier"
    for n in graph.reach(list(formulas.values())):
        if graph.op(n) in ops.JUMPING and (jumping := [s for s in forces if s in graph.support(n)]):
            raise Jumps(jumping[0])
    return result, Laws(formulas, tuple(s for s in forces if s in entering))


def _is_linear(graph: Graph, n: Node, dependent: set[Node]) -> bool:
    """Tell whether an operation leaves what depends on forces affine in it."""
    arguments = graph.args(n)
    match graph.op(n):
        case ops.ADD | ops.SUB | ops.NEG:
            return True
        case ops.MUL:
            return not (arguments[0] in dependent and arguments[1] in dependent)
        case ops.DIV:
            return arguments[1] not in dependent
        case ops.SELECT:
            return arguments[0] not in dependent
        case _:
            return False


def solve_laws(graph: Graph, laws: Laws, affine: Mapping[Node, Node]) -> dict[Node, Node]:
    """Return what replaces each symbol w; ``affine`` gives each force in terms of these. Raises ZeroPivot."""
    known = {s: affine[s] for s in laws.forces if not laws.formulas.keys() & set(graph.support(affine[s]))}
    if known:  # forces on which no law acts, such as those that are always zero
        formulas = substitute(graph, list(laws.formulas.values()), known)
        rest = tuple(s for s in laws.forces if s not in known)
        laws = Laws(dict(zip(laws.formulas, formulas, strict=True)), rest)
        if not rest:
            return dict(laws.formulas)
    equations = _Equations(graph, laws, affine)
    point = equations.begin()
    share, fraction = graph.zero, graph.one
    beyond = graph.add(graph.two, graph.dot(point.away, point.away))
    nowhere = graph.acos(beyond)  # a root would be squared away
    found: list[tuple[Node, tuple[Node, ...]]] = []
    for _ in range(STEPS):
        whole = equations.newton(point, graph.one)
        exact = _merit(graph, whole.residual, point.sizes)
        done = graph.less_equal(exact, graph.zero)  # the slope may be infinite there
        ends = tuple(
            graph.select(whole.forward, graph.select(done, s, graph.add(s, d)), nowhere)
            for s, d in zip(point.forces, whole.step, strict=True)
        )
        found.append((point.small, ends))
        grown = graph.minimum(graph.one, graph.add(share, fraction))
        here = equations.newton(point, grown)
        merit = _merit(graph, here.residual, point.sizes)
        growing = graph.less(share, graph.one)
        length = graph.select(growing, graph.one, fraction)
        moved = tuple(
            graph.add(s, graph.mul(length, d)) for s, d in zip(point.forces, here.step, strict=True)
        )
        tried = equations.at(moved)
        there = equations.newton(tried, grown)
        better = graph.less(_merit(graph, there.residual, point.sizes), merit)
        better = graph.logical_and(better, graph.logical_and(here.forward, there.forward))
        for a, b in zip(tried.turned, point.turned, strict=True):
            near = graph.less_equal(graph.abs(graph.sub(a, b)), graph.constant(TURN))
            better = graph.logical_and(better, near)
        longer = graph.minimum(graph.one, graph.mul(graph.two, fraction))
        fraction = graph.select(better, longer, graph.mul(graph.mul(graph.half, graph.half), fraction))
        share = graph.select(better, grown, share)
        point = _chosen(graph, better, tried, point)
    result: tuple[Node, ...] = (nowhere,) * len(laws.forces)
    for small, polished in reversed(found):
        result = tuple(graph.select(small, a, b) for a, b in zip(polished, result, strict=True))
    values = dict(zip(laws.forces, result, strict=True))
    return dict(zip(laws.formulas, substitute(graph, list(laws.formulas.values()), values), strict=True))


class _Point(Struct, frozen=True):
    """At ``forces``: how far they are ``away`` from those without the laws, what the laws ``add``, and its ``slopes``, row by
    row; ``small`` says that both are the same; ``turned``: the angles of waves.

    ``sizes`` of the terms in H. A step is judged by the sizes where it begins: where all forces go to zero together, H
    is as large as its terms from step to step.
    """

    forces: tuple[Node, ...]
    away: tuple[Node, ...]
    add: tuple[Node, ...]
    slopes: tuple[Node, ...]
    sizes: tuple[Node, ...]
    small: Node
    turned: tuple[Node, ...]


class _Newton(Struct, frozen=True):
    """Of the equations with a share of the laws: ``residual`` H, the ``step``, whether dH/ds has a positive determinant."""

    residual: tuple[Node, ...]
    step: tuple[Node, ...]
    forward: Node


def _chosen(graph: Graph, condition: Node, a: _Point, b: _Point) -> _Point:
    def choose(x: tuple[Node, ...], y: tuple[Node, ...]) -> tuple[Node, ...]:
        return tuple(graph.select(condition, m, n) for m, n in zip(x, y, strict=True))

    return _Point(
        choose(a.forces, b.forces),
        choose(a.away, b.away),
        choose(a.add, b.add),
        choose(a.slopes, b.slopes),
        choose(a.sizes, b.sizes),
        graph.select(condition, a.small, b.small),
        choose(a.turned, b.turned),
    )


def _merit(graph: Graph, residual: Sequence[Node], sizes: Sequence[Node]) -> Node:
    """Return the sum of squares of H, row by row as a share of the given sizes."""
    total = graph.zero
    for h, size in zip(residual, sizes, strict=True):
        share = graph.select(graph.less(graph.zero, size), graph.div(h, size), graph.zero)
        total = graph.add(total, graph.mul(share, share))
    return total


class _Equations:
    """H(s) = s - A - B g(s), row by row relative to the size of its terms without and with the laws."""

    def __init__(self, graph: Graph, laws: Laws, affine: Mapping[Node, Node]) -> None:
        self.graph = graph
        self.symbols = laws.forces
        self.laws = list(laws.formulas.values())
        rows = [affine[s] for s in laws.forces]
        without = dict.fromkeys(laws.formulas, graph.zero)
        self.base = tuple(substitute(graph, rows, without))
        self.factors = jacobian(graph, rows, list(laws.formulas))
        self.gradients = jacobian(graph, self.laws, list(laws.forces))
        self.sizes = [graph.abs(a) for a in self.base]
        self.angles = [graph.args(n)[0] for n in laws.waves(graph)]

    def at(self, forces: tuple[Node, ...]) -> _Point:
        graph, count = self.graph, len(forces)
        places = dict(zip(self.symbols, forces, strict=True))
        values = substitute(graph, self.laws, places)
        slopes = [
            dict(zip(row, substitute(graph, list(row.values()), places), strict=True))
            for row in self.gradients
        ]
        away = tuple(graph.sub(s, base) for s, base in zip(forces, self.base, strict=True))
        added, sizes, matrix = [], [], []
        small = graph.one
        for i, s in enumerate(forces):
            total, size = graph.zero, graph.add(graph.abs(s), self.sizes[i])
            derivatives = [graph.zero] * count
            for k, factor in self.factors[i].items():
                term = graph.mul(factor, values[k])
                total, size = graph.add(total, term), graph.add(size, graph.abs(term))
                for j, slope in slopes[k].items():
                    derivatives[j] = graph.add(derivatives[j], graph.mul(factor, slope))
            added.append(total)
            sizes.append(size)
            matrix += derivatives
            off = graph.abs(graph.sub(away[i], total))
            small = graph.logical_and(
                small, graph.less_equal(off, graph.mul(graph.constant(TOLERANCE), size))
            )
        turned = tuple(substitute(graph, self.angles, places))
        return _Point(forces, away, tuple(added), tuple(matrix), tuple(sizes), small, turned)

    def newton(self, point: _Point, share: Node) -> _Newton:
        """Return the step where only a ``share`` of the laws holds."""
        graph, count = self.graph, len(point.forces)
        residual = [graph.sub(a, graph.mul(share, b)) for a, b in zip(point.away, point.add, strict=True)]
        matrix = [
            graph.sub(graph.one if k % (count + 1) == 0 else graph.zero, graph.mul(share, slope))
            for k, slope in enumerate(point.slopes)
        ]
        step, determinant = self._step(residual, matrix)
        return _Newton(tuple(residual), step, graph.less(graph.zero, determinant))

    def begin(self) -> _Point:
        """Return the forces without the laws, or where these have no value there, as 1/N at zero, one unit beside."""
        graph = self.graph
        try:
            first = self.at(self.base)
            merit = _merit(graph, self.newton(first, graph.one).residual, first.sizes)
        except DivisionByZero:
            return self.at(tuple(graph.one if graph.is_zero(s) else s for s in self.base))
        beside = self.at(tuple(graph.add(s, graph.one) for s in self.base))
        largest = graph.constant(len(self.base) + 1)  # a share of the terms that it is made of is at most one
        return _chosen(graph, graph.less(merit, largest), first, beside)

    def _step(self, residual: Sequence[Node], matrix: Sequence[Node]) -> tuple[tuple[Node, ...], Node]:
        """Return the step of Newton's method, and the determinant of the matrix."""
        graph, count = self.graph, len(residual)
        if count == 1:
            return (graph.neg(graph.div(residual[0], matrix[0])),), matrix[0]
        steps = [graph.symbol(f"#step {i}") for i in range(count)]
        rows = [
            graph.add(residual[i], graph.dot(matrix[i * count : (i + 1) * count], steps))
            for i in range(count)
        ]
        # each unknown by its own row: the pivots are those of the matrix
        found = solve_dense(graph, rows, steps)
        determinant = graph.one
        for pivot in found.pivots:
            determinant = graph.mul(determinant, pivot)
        return found.solutions, determinant
