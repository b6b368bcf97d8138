"""Bodies in space that are fixed to each other, taken together as one mass and one inertia: sums of parameters, which are computed
before the run. A robot whose base carries ten cameras costs what its base costs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from msgspec import Struct

from ...graph import Graph, Node
from ...graph import operations as ops
from ...graph.evaluate import evaluate
from ...graph.vector import Matrix, Vector, add, dot, matmul, matvec, scale, subtract, transpose
from ...mechanics.defaults import default_values
from ...mechanics.kinematics.frames import Frame, Point
from ...mechanics.kinematics.pose import Rotate, Step, Translate, Turn, numbers_of, rotation_of
from ...mechanics.system import MechanicalSystem, PointMass, RotaryInertia

Matter = tuple[tuple[PointMass, ...], tuple[RotaryInertia, ...]]
IsConstant = Callable[[Iterable[Node]], bool]


class _Group(Struct):
    """Masses with their places and inertias about their centres, in the axes of the frame in which they are fixed."""

    masses: list[tuple[PointMass, Vector]]
    inertias: list[tuple[RotaryInertia, Matrix]]


def taken_together(system: MechanicalSystem) -> Matter:
    """Return masses and inertias of which no two in space are fixed to each other, unless they change, differ in gravity, or have no
    mass by default: then derivatives by masses need each by itself."""
    if system.kinematics.size == 2:
        return system.masses, system.inertias
    graph, parameters = system.graph, {s.node for s in system.symbols.parameters}
    groups: dict[Frame, _Group] = {}
    masses: list[PointMass] = []
    inertias: list[RotaryInertia] = []

    def is_constant(nodes: Iterable[Node]) -> bool:
        return parameters.issuperset(graph.support(*nodes))

    def group(frame: Frame) -> _Group:
        return groups.setdefault(frame, _Group([], []))

    for mass in system.masses:
        root, steps = _fixed_in(graph, mass.point.frame, is_constant)
        if is_constant((mass.mass, *mass.point.offset)):
            group(root).masses.append((mass, _placed(graph, steps, mass.point.offset)))
        else:
            masses.append(mass)
    for body in system.inertias:
        root, steps = _fixed_in(graph, body.frame, is_constant)
        if is_constant(x for row in body.inertia for x in row):
            group(root).inertias.append((body, _turned(graph, steps, body.inertia)))
        else:
            inertias.append(body)
    several = {root for root, one in groups.items() if max(len(one.masses), len(one.inertias)) > 1}
    weights = [mass.mass for root in several for mass, _ in groups[root].masses]
    known = (
        dict(zip(weights, evaluate(graph, weights, default_values(system)), strict=True)) if weights else {}
    )
    for root, one in groups.items():
        fields = {mass.field for mass, _ in one.masses}
        if root in several and len(fields) == 1 and sum(known[mass.mass] for mass, _ in one.masses) > 0:
            mass, body = _together(graph, root, one)
            masses.append(mass)
            inertias.append(body)
        else:
            masses += [mass for mass, _ in one.masses]
            inertias += [body for body, _ in one.inertias]
    return tuple(masses), tuple(inertias)


def _fixed_in(graph: Graph, frame: Frame, is_constant: IsConstant) -> tuple[Frame, list[Step]]:
    """Return the frame nearest to the world in which a frame is fixed, and the steps from there."""
    steps: list[Step] = []
    while frame.step is not None and frame.parent is not None:
        step, parent = frame.step, frame.parent
        if is_constant(numbers_of(step)) and not (isinstance(step, Turn) and step.rate is not None):
            steps.insert(0, step)
            frame = parent
            continue
        if isinstance(
            step, Rotate
        ):  # turned further about the axis of a joint, it hangs beside what the joint moves
            moving, rest = _varying_part(graph, step.angle, is_constant)
            beside = parent.children.get(Rotate(step.axis, moving))
            if beside is not None and beside is not frame:
                return beside, [Rotate(step.axis, rest), *steps]
        break
    return frame, steps


def _varying_part(graph: Graph, angle: Node, is_constant: IsConstant) -> tuple[Node, Node]:
    """Return what changes of an angle, and the rest."""
    rest = graph.zero
    while graph.op(angle) in (ops.ADD, ops.SUB):
        a, b = graph.args(angle)
        if is_constant([b]):
            angle, rest = a, (graph.add if graph.op(angle) == ops.ADD else graph.sub)(rest, b)
        elif is_constant([a]) and graph.op(angle) == ops.ADD:
            angle, rest = b, graph.add(rest, a)
        else:
            break
    return angle, rest


def _placed(graph: Graph, steps: Sequence[Step], offset: Vector) -> Vector:
    for step in reversed(steps):
        if isinstance(step, Translate):
            offset = add(graph, step.offset, offset)
        else:
            offset = matvec(graph, rotation_of(graph, step), offset)
    return offset


def _turned(graph: Graph, steps: Sequence[Step], inertia: Matrix) -> Matrix:
    for step in reversed(steps):
        if not isinstance(step, Translate):
            matrix = rotation_of(graph, step)
            inertia = matmul(graph, matmul(graph, matrix, inertia), transpose(matrix))
    return inertia


def _together(graph: Graph, root: Frame, group: _Group) -> tuple[PointMass, RotaryInertia]:
    """Return the mass in the mass centre, and the inertia about it: J + sum m (r.r 1 - r r^T)."""
    (first, at), *others = group.masses
    total = graph.sum(mass.mass for mass, _ in group.masses)
    moment: Vector = (graph.zero,) * 3
    for mass, place in others:
        moment = add(graph, moment, scale(graph, mass.mass, subtract(graph, place, at)))
    divisor = graph.select(graph.equal(total, graph.zero), graph.one, total)  # without mass any place will do
    centre = add(graph, at, [graph.div(x, divisor) for x in moment])
    inertia = [[graph.zero] * 3 for _ in range(3)]
    for mass, place in group.masses:
        arm = subtract(graph, place, centre)
        square = dot(graph, arm, arm)
        for i in range(3):
            for k in range(3):
                term = graph.sub(square if i == k else graph.zero, graph.mul(arm[i], arm[k]))
                inertia[i][k] = graph.add(inertia[i][k], graph.mul(mass.mass, term))
    for _, turned in group.inertias:
        inertia = [list(add(graph, *rows)) for rows in zip(inertia, turned, strict=True)]
    tensor = tuple(tuple(row) for row in inertia)
    return PointMass(total, Point(root, centre), first.field, first.origin), RotaryInertia(
        tensor, root, first.origin
    )
