"""What each operator and built-in function of the language means in nodes: one row a function.

The two sides of a relation may be equal over a whole region, as in `max(0, x) > 0` where x is negative. No sign changes where
such a region is entered, so that an event there would be passed over. What bounds the region becomes a part of the relation,
which says the same with it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction

from mechc.lang.builtins import BUILTINS

from ...graph import Graph, Node, matrices
from ...graph import operations as ops
from ...graph import vector as v3
from ...graph.node import DivisionByZero
from ...graph.operations import DIV, EQUAL, MODULO, NOT, OPERATIONS
from ...graph.rewrite import substitute
from ..kinematics.frames import Frame, FrameKinematics, Point
from ..kinematics.planar import Planar
from ..kinematics.pose import Rotate, Translate, Turn
from . import elliptic
from .values import Placement, Value, each, elements, filled, multiply, node, vector

_MOST, _LONGEST = 8, 100
"""Bends of a relation that are looked at, each of which takes substitutions, and formulas on the way to them."""
_BENDS = (ops.MAXIMUM, ops.MINIMUM, ops.SELECT)
_THROUGH = frozenset({ops.NEG, ops.ADD, ops.SUB, ops.MUL, ops.DIV, ops.POW, ops.ABS, ops.SQRT})


def less(graph: Graph, a: Node, b: Node) -> Node:
    """Return a < b."""
    result = graph.less(a, b)
    for inside in _regions(graph, a, b):
        result = graph.logical_and(graph.logical_not(inside), result)
    return result


def less_equal(graph: Graph, a: Node, b: Node) -> Node:
    """Return a <= b."""
    result = graph.less_equal(a, b)
    for inside in _regions(graph, a, b):
        result = graph.logical_or(inside, result)
    return result


def _regions(graph: Graph, a: Node, b: Node) -> Iterator[Node]:
    """Yield conditions under which a and b are the same formula: with a piece in the place of what bends."""
    for n in _bends(graph, a, b):
        for piece, inside in _pieces(graph, n):
            try:
                first, second = substitute(graph, [a, b], {n: piece})
                same = first == second or graph.is_zero(graph.sub(second, first))
            except DivisionByZero:
                continue
            if same:
                yield inside


def _pieces(graph: Graph, n: Node, deeper: bool = True) -> Iterator[tuple[Node, Node]]:
    """Yield the formulas that a maximum, a minimum or an `if` may be, and when; also those of one in it."""
    *conditions, p, q = graph.args(n)
    for piece, other in ((p, q), (q, p)):
        if conditions:
            inside = conditions[0] if piece == p else graph.logical_not(conditions[0])
        else:
            low, high = (other, piece) if graph.op(n) == ops.MAXIMUM else (piece, other)
            inside = graph.less_equal(low, high)
        yield piece, inside
        if deeper and graph.op(piece) in _BENDS:
            for inner, within in _pieces(graph, piece, deeper=False):
                yield inner, graph.logical_and(inside, within)


def _bends(graph: Graph, a: Node, b: Node) -> Iterator[Node]:
    """Yield what bends, from which both sides follow by sums, products, powers and sizes."""
    pending, seen, found = [a, b], {a, b}, 0
    while pending and found < _MOST:
        n = pending.pop()
        code = graph.op(n)
        if code in _BENDS:
            found += 1
            yield n
        elif code in _THROUGH and len(seen) < _LONGEST:
            further = [k for k in graph.args(n) if k not in seen]
            seen.update(further)
            pending += further


Rule = Callable[[FrameKinematics, Callable[[Node], Node], tuple[Value, ...]], Value]
"""(kinematics, total time derivative, arguments) -> value"""


def _formula(made: Callable[..., Node]) -> Rule:
    return lambda k, rate, a: made(k.graph, *map(node, a))


def _operation(code: int) -> Rule:
    return lambda k, rate, a: k.graph.apply(code, *map(node, a))


def _each_binary(name: str) -> Rule:
    return lambda k, rate, a: each(getattr(k.graph, name), _numbers(k, a[0]), _numbers(k, a[1]))


def _numbers(kinematics: FrameKinematics, value: Value) -> Value:
    """Return a point as its world components, anything else as it is."""
    return kinematics.position(value) if isinstance(value, Point) else value


def _point(kinematics: FrameKinematics, value: Value) -> Point:
    """Return a frame as its origin, world components as a point of the world."""
    if isinstance(value, Point):
        return value
    zero = kinematics.graph.constant(0)
    if isinstance(value, Frame):
        return Point(value, (zero,) * kinematics.size)
    return Point(kinematics.world, vector(value))


def _fold(name: str) -> Rule:
    def rule(k: FrameKinematics, rate: Callable[[Node], Node], a: tuple[Value, ...]) -> Value:
        items = [n for x in a for n in elements(x)]
        result = items[0]
        for item in items[1:]:
            result = getattr(k.graph, name)(result, item)
        return result

    return rule


def _solid(name: str) -> Rule:
    def rule(k: FrameKinematics, rate: Callable[[Node], Node], a: tuple[Value, ...]) -> Value:
        from .meshes import Sums

        result: Value = getattr(Sums(k.graph, a[0], a[1]), name)()
        return result

    return rule


def _norm(graph: Graph, a: Value) -> Node:
    return v3.norm(graph, tuple(elements(a)))


def _cross(graph: Graph, a: Value, b: Value) -> Value:
    x, y = vector(a), vector(b)
    return v3.cross_planar(graph, x, y) if len(x) == 2 else v3.cross(graph, x, y)


def _power(k: FrameKinematics, rate: Callable[[Node], Node], a: tuple[Value, ...]) -> Value:
    base, exponent = node(a[0]), node(a[1])
    if k.graph.is_constant(exponent):
        return k.graph.power(base, k.graph.value(exponent))
    return k.graph.pow(base, exponent)


def _clamp(graph: Graph, x: Node, low: Node, high: Node) -> Node:
    return graph.minimum(graph.maximum(x, low), high)


def _deadzone(graph: Graph, x: Node, width: Node) -> Node:
    return graph.sub(x, _clamp(graph, x, graph.neg(width), width))


def _quotient(k: FrameKinematics, rate: Callable[[Node], Node], a: tuple[Value, ...]) -> Value:
    """Quotient of whole numbers, rounded towards zero."""
    graph, x = k.graph, k.graph.div(node(a[0]), node(a[1]))
    return graph.mul(graph.sign(x), graph.floor(graph.abs(x)))


def _diag(k: FrameKinematics, rate: Callable[[Node], Node], a: tuple[Value, ...]) -> Value:
    items = list(elements(a[0]))
    zero = k.graph.constant(0)
    return filled((len(items), len(items)), lambda i: items[i[0]] if i[0] == i[1] else zero)


def _identity(k: FrameKinematics, rate: Callable[[Node], Node], a: tuple[Value, ...]) -> Value:
    return v3.identity(k.graph, int(k.graph.value(node(a[0]))))


def _linspace(k: FrameKinematics, rate: Callable[[Node], Node], a: tuple[Value, ...]) -> Value:
    graph, first, last = k.graph, node(a[0]), node(a[1])
    n = int(graph.value(node(a[2])))
    span = graph.sub(last, first)
    return tuple(
        graph.add(first, graph.mul(graph.constant(Fraction(i, n - 1)), span)) if n > 1 else first
        for i in range(n)
    )


def _outer(graph: Graph, a: Value, b: Value) -> Value:
    return tuple(tuple(graph.mul(x, y) for y in vector(b)) for x in vector(a))


def _rows(value: Value) -> tuple[tuple[Node, ...], ...]:
    assert isinstance(value, tuple)
    return tuple(vector(row) for row in value)


def _solve(k: FrameKinematics, rate: Callable[[Node], Node], a: tuple[Value, ...]) -> Value:
    right = a[1]
    assert isinstance(right, tuple)
    if isinstance(right[0], int):
        return matrices.solve(k.graph, _rows(a[0]), (vector(right),))[0]
    return v3.transpose(tuple(matrices.solve(k.graph, _rows(a[0]), v3.transpose(_rows(right)))))


def _transpose(value: Value) -> Value:
    assert isinstance(value, tuple)
    return tuple(zip(*value, strict=True))


# ---------------------------------------------------------------- poses


def _trans(k: FrameKinematics, rate: Callable[[Node], Node], a: tuple[Value, ...]) -> Value:
    return Placement((Translate(vector(_numbers(k, a[0]))),))


def _rotation(axis: int) -> Rule:
    return lambda k, rate, a: Placement((Rotate(axis, node(a[0])),))


def _axis_angle(k: FrameKinematics, rate: Callable[[Node], Node], a: tuple[Value, ...]) -> Value:
    """Rotation about a unit vector: elementary where the axis is a coordinate axis, else by Rodrigues' formula."""
    graph, axis, angle = k.graph, vector(a[0]), node(a[1])
    values = [graph.value(x) if graph.is_constant(x) else None for x in axis]
    for i, value in enumerate(values):
        if value in (1, -1) and all(values[j] == 0 for j in range(3) if j != i):
            return Placement((Rotate(i, angle if value == 1 else graph.neg(angle)),))
    size = _norm(graph, axis)
    unit = tuple(graph.div(x, size) for x in axis)
    matrix = v3.rotation_about(graph, unit, angle)
    half = graph.mul(graph.half, angle)
    q = (graph.cos(half), *(graph.mul(x, graph.sin(half)) for x in unit))
    if any(not graph.is_zero(rate(x)) for x in unit):
        return Placement((Turn(matrix, _matrix_rate(graph, matrix, rate), q),))
    spin = rate(angle)
    return Placement((Turn(matrix, tuple(graph.mul(x, spin) for x in unit), q),))


def _matrix_rate(
    graph: Graph, matrix: tuple[tuple[Node, ...], ...], rate: Callable[[Node], Node]
) -> tuple[Node, ...]:
    """Return the angular velocity in new components of a matrix that depends on time: w = vee(R^T R')."""
    rates = tuple(tuple(rate(x) for x in row) for row in matrix)

    def entry(i: int, j: int) -> Node:
        return graph.sum(graph.mul(matrix[k][i], rates[k][j]) for k in range(3))

    return (entry(2, 1), entry(0, 2), entry(1, 0))


def _quat(k: FrameKinematics, rate: Callable[[Node], Node], a: tuple[Value, ...]) -> Value:
    graph = k.graph
    q = tuple(elements(a[0])) if len(a) == 1 else tuple(node(x) for x in a)
    size = _norm(graph, q)
    unit = tuple(graph.div(x, size) for x in q)
    matrix = v3.quaternion_rotation(graph, unit)
    moving = any(not graph.is_zero(rate(x)) for x in q)
    return Placement((Turn(matrix, _matrix_rate(graph, matrix, rate) if moving else None, unit),))


# ---------------------------------------------------------------- kinematics, in world components


def _velocity(k: FrameKinematics, rate: Callable[[Node], Node], a: tuple[Value, ...]) -> Value:
    point = _point(k, a[0])
    if len(a) == 1:
        return k.from_natural(point.frame, k.velocity(point))
    return tuple(rate(x) for x in vector(_local(k, rate, (a[1], a[0]))))


def _spin(k: FrameKinematics, rate: Callable[[Node], Node], a: tuple[Value, ...]) -> Value:
    frame = a[0]
    assert isinstance(frame, Frame)
    natural = k.angular_velocity(frame)
    if k.size == 2:
        return natural[0]
    world = k.spin_from_natural(frame, natural)
    if len(a) == 1:
        return world
    assert isinstance(a[1], Frame)
    return natural if a[1] is frame else k.to_frame(a[1], world)


def _velocity_at(k: FrameKinematics, rate: Callable[[Node], Node], a: tuple[Value, ...]) -> Value:
    assert isinstance(a[0], Frame)
    return k.velocity_at(a[0], _point(k, a[1]))


def _heading(k: FrameKinematics, rate: Callable[[Node], Node], a: tuple[Value, ...]) -> Value:
    assert isinstance(a[0], Frame) and isinstance(k, Planar)
    return k.angle(a[0])


def _local(k: FrameKinematics, rate: Callable[[Node], Node], a: tuple[Value, ...]) -> Value:
    frame = a[0]
    assert isinstance(frame, Frame)
    origin = k.position(_point(k, frame))
    return k.to_frame(frame, v3.subtract(k.graph, k.position(_point(k, a[1])), origin))


def _components(k: FrameKinematics, rate: Callable[[Node], Node], a: tuple[Value, ...]) -> Value:
    assert isinstance(a[0], Frame)
    return k.to_frame(a[0], vector(_numbers(k, a[1])))


def _direction(k: FrameKinematics, rate: Callable[[Node], Node], a: tuple[Value, ...]) -> Value:
    assert isinstance(a[0], Frame)
    return k.to_world(a[0], vector(_numbers(k, a[1])))


def _position(k: FrameKinematics, rate: Callable[[Node], Node], a: tuple[Value, ...]) -> Value:
    return k.position(_point(k, a[0]))


FUNCTIONS: dict[str, Rule] = {
    # operators
    "add": _each_binary("add"),
    "subtract": _each_binary("sub"),
    "multiply": lambda k, rate, a: multiply(k, _numbers(k, a[0]), _numbers(k, a[1])),
    "divide": lambda k, rate, a: each(k.graph.div, _numbers(k, a[0]), a[1]),
    "negate": lambda k, rate, a: each(k.graph.neg, _numbers(k, a[0])),
    "power": _power,
    "less": _formula(less),
    "less_equal": _formula(less_equal),
    "greater": lambda k, rate, a: less(k.graph, node(a[1]), node(a[0])),
    "greater_equal": lambda k, rate, a: less_equal(k.graph, node(a[1]), node(a[0])),
    "equal": _operation(EQUAL),
    "not_equal": lambda k, rate, a: k.graph.logical_not(k.graph.equal(node(a[0]), node(a[1]))),
    "and": _fold("logical_and"),
    "or": _fold("logical_or"),
    "not": _operation(NOT),
    # elementary
    **{row.name: _operation(row.code) for row in OPERATIONS if row.name in BUILTINS and row.code != DIV},
    **{name: _formula(made) for name, made in elliptic.FORMULAS.items()},
    "log10": lambda k, rate, a: k.graph.div(k.graph.log(node(a[0])), k.graph.log(k.graph.constant(10))),
    "ceil": lambda k, rate, a: k.graph.neg(k.graph.floor(k.graph.neg(node(a[0])))),
    "min": _fold("minimum"),
    "max": _fold("maximum"),
    "mod": _operation(MODULO),
    "div": _quotient,
    "clamp": lambda k, rate, a: _clamp(k.graph, node(a[0]), node(a[1]), node(a[2])),
    "deadzone": lambda k, rate, a: _deadzone(k.graph, node(a[0]), node(a[1])),
    # vectors
    "dot": lambda k, rate, a: k.graph.dot(vector(_numbers(k, a[0])), vector(_numbers(k, a[1]))),
    "cross": lambda k, rate, a: _cross(k.graph, _numbers(k, a[0]), _numbers(k, a[1])),
    "norm": lambda k, rate, a: _norm(k.graph, _numbers(k, a[0])),
    "diag": _diag,
    "identity": _identity,
    "linspace": _linspace,
    "outer": lambda k, rate, a: _outer(k.graph, a[0], a[1]),
    "transpose": lambda k, rate, a: _transpose(a[0]),
    "det": lambda k, rate, a: matrices.determinant(k.graph, _rows(a[0])),
    "inverse": lambda k, rate, a: matrices.inverse(k.graph, _rows(a[0])),
    "solve": _solve,
    "eigenvalues": lambda k, rate, a: matrices.eigenvalues(k.graph, _rows(a[0])),
    # solids
    **{name: _solid(name) for name in ("mesh_volume", "mesh_centre", "mesh_inertia")},
    # poses
    "trans": _trans,
    "rot": _rotation(2),
    "rotx": _rotation(0),
    "roty": _rotation(1),
    "rotz": _rotation(2),
    "axis_angle": _axis_angle,
    "quat": _quat,
    # kinematics
    "pos": _position,
    "vel": _velocity,
    "vel_at": _velocity_at,
    "angvel": _spin,
    "heading": _heading,
    "local": _local,
    "components": _components,
    "direction": _direction,
}
