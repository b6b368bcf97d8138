"""What is drawn, as numbers: places, axes and sizes of shapes, as functions of the state.

Nothing else reads them: they are made for those who show a motion, and left out for all others.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from fractions import Fraction
from itertools import product

from msgspec import Struct

from mechc.lang.diagnostics import Reporter
from mechc.runtime.interface import Scene, ShapeEntry

from ...flat.model import Definition, DefinitionRole, Draw, Expression, Kind, Origin
from ...flat.statements.shapes import SHAPES, TURNS
from ...flat.types import LENGTH
from ...flat.values.evaluate import constant
from ...graph import Graph, Node
from ...mechanics.kinematics.frames import Frame, Point
from ...mechanics.meaning.lower import Lowering
from ...mechanics.system import MechanicalSystem
from ..model import Function
from ..solve.solved import Solved
from .entries import Layout

PIECES = {1: 96, 2: 24}
"""Pieces of a curve, and of each side of a surface."""

FEW = 6
"""Of more masses no paths are drawn by rule."""

GAUGES = 24
"""At most so many numbers are shown as beads and dials."""

BY_AXIS = {
    "cylinder": (1, 0, 0),
    "cone": (1, 0, 0),
    "torus": (0, 0, 1),
    "disk": (0, 0, 1),
    "plane": (0, 0, 1),
}
"""The axis of a shape that does not say one."""


def scene_of(
    system: MechanicalSystem, solved: Solved, layout: Layout, reporter: Reporter
) -> tuple[Scene, tuple[Function, ...]]:
    """Return what is drawn, and the functions of its numbers: ``scene_still`` of the parameters, ``scene`` of all."""
    maker = _Maker(system)
    drawn: list[tuple[ShapeEntry, list[Node]]] = []
    for draw in system.model.draws:
        shape, nodes = maker.shape(draw)
        nodes = list(solved.resolve(nodes))
        _check(system, layout, draw, nodes, reporter)
        drawn.append((shape, nodes))
    instances = {draw.origin.instance for draw in system.model.draws}
    by_rule = "" not in instances and "" not in system.model.quiet
    if by_rule:
        ruled = list(maker.by_rule(instances))
        if not drawn and not ruled:
            ruled = list(maker.without_places())
        drawn += [(shape, list(solved.resolve(nodes))) for shape, nodes in ruled]
    in_picture = all(shape.kind in ("bead", "dial") for shape, _ in drawn)
    return _numbered(system.graph, layout, drawn, by_rule, 2 if in_picture else maker.size)


def _numbered(
    graph: Graph, layout: Layout, drawn: Sequence[tuple[ShapeEntry, list[Node]]], by_rule: bool, size: int
) -> tuple[Scene, tuple[Function, ...]]:
    """Give every number its place: those of parameters alone first; equal ones have one."""
    everything = dict.fromkeys(n for _, nodes in drawn for n in nodes)
    moving: set[Node] = {n for n, slot in layout.slots.items() if slot.array != "p"}
    for n in graph.reach(everything):
        if not moving.isdisjoint(graph.args(n)):
            moving.add(n)
    still = [n for n in everything if n not in moving]
    changing = [n for n in everything if n in moving]
    place = {n: k for k, n in enumerate((*still, *changing))}
    shapes = tuple(
        ShapeEntry(
            shape.kind,
            tuple(place[n] for n in nodes),
            shape.name,
            shape.colour,
            shape.text,
            shape.relative,
            shape.grid,
        )
        for shape, nodes in drawn
    )
    functions = [Function("scene_still", "numbers of the picture that do not move", tuple(still))]
    functions.append(Function("scene", "numbers of the picture that move", tuple(changing)))
    return Scene(size, shapes, len(still), len(changing), by_rule), tuple(f for f in functions if f.outputs)


def _check(
    system: MechanicalSystem, layout: Layout, draw: Draw, nodes: Sequence[Node], reporter: Reporter
) -> None:
    """Report what nothing determines: the rate of an input, of an acceleration or of a force."""
    lost = [n for n in system.graph.support(*nodes) if n not in layout.slots]
    if lost:
        raise reporter.fail(
            "E1007",
            f"'{draw.shape}' needs {system.graph.name(lost[0]).removeprefix('#')}, which nothing determines",
            draw.origin.shown,
            help="draw what depends on the state and the time",
        )


class _Maker(Struct):
    """Turns shapes into nodes. ``size`` is 3 as soon as something leaves the plane."""

    system: MechanicalSystem
    size: int = 2

    def __post_init__(self) -> None:
        self.size = 3 if self.system.model.space == 3 else 2

    @property
    def graph(self) -> Graph:
        return self.system.graph

    @property
    def lowering(self) -> Lowering:
        return self.system.lowering

    # ------------------------------------------------------------ places

    def solid(self, vector: Sequence[Node]) -> list[Node]:
        """Return a vector of the plane or of space in space."""
        if len(vector) == 3:
            self.size = 3
            return list(vector)
        return [*vector, self.graph.zero]

    def vector(self, expression: Expression) -> list[Node]:
        return list(self.lowering.reported(expression))

    def position(self, expression: Expression) -> list[Node]:
        if expression.type.kind in (Kind.FRAME, Kind.POINT):
            return self.at(self.lowering.point(expression))
        return self.solid(self.vector(expression))

    def at(self, point: Point) -> list[Node]:
        return self.solid(self.system.kinematics.position(point))

    def origin(self, frame: Frame) -> list[Node]:
        return self.at(Point(frame, (self.graph.zero,) * self.system.kinematics.size))

    def pose(self, place: Expression | None) -> list[Node]:
        """Return the origin and the three axes, one after another, in the world."""
        one, zero = self.graph.one, self.graph.zero
        upright = [one, zero, zero, zero, one, zero, zero, zero, one]
        if place is None:
            return [zero, zero, zero, *upright]
        if place.type.kind is not Kind.FRAME:
            return [*self.position(place), *upright]
        frame = self.lowering.frame(place)
        return [*self.position(place), *self.axes(frame)]

    def axes(self, frame: Frame) -> list[Node]:
        one, zero = self.graph.one, self.graph.zero
        kinematics = self.system.kinematics
        if kinematics.size == 2:
            x, y = kinematics.to_world(frame, (one, zero)), kinematics.to_world(frame, (zero, one))
            return [*x, zero, *y, zero, zero, zero, one]
        axes = ((one, zero, zero), (zero, one, zero), (zero, zero, one))
        return [n for axis in axes for n in kinematics.to_world(frame, axis)]

    # ------------------------------------------------------------ statements

    def shape(self, draw: Draw) -> tuple[ShapeEntry, list[Node]]:
        """Return a shape and its numbers, in the order that ``ShapeEntry`` states."""
        grid: tuple[int, ...] = ()
        if draw.samples:
            nodes, grid = self.sampled(draw)
        else:
            nodes = [n for point in draw.points for n in self.position(point)]
            if draw.shape == "frame":
                nodes = self.pose(draw.points[0])
            if draw.shape in ("arrow", "text"):
                assert draw.place is not None
                nodes += self.position(draw.place)
            elif SHAPES[draw.shape].place == "always":
                nodes += self.pose(draw.place)
            nodes += self.values(draw)
        lengths = [a.name for a in SHAPES[draw.shape].arguments if a.relative]
        relative = bool(lengths) and lengths[0] not in draw.values
        text = draw.texts.get("text") or draw.texts.get("file", "")
        name = draw.origin.instance
        return ShapeEntry(draw.shape, (), name, draw.texts.get("colour", ""), text, relative, grid), nodes

    def values(self, draw: Draw) -> list[Node]:
        found: list[Node] = []
        for argument in SHAPES[draw.shape].arguments:
            value = draw.values.get(argument.name)
            match argument.kind:
                case "length":
                    found += [self.graph.one] if value is None else self.vector(value)
                case "lengths" if value is not None:
                    edges = self.vector(value)
                    found += edges if len(edges) == 3 else [*edges, self.graph.zero]
                    self.size = max(self.size, len(edges))
                case "scale" if value is not None:
                    each = self.vector(value)
                    found += each * (3 // len(each))
                case "vector" if value is not None:
                    found += self.solid(self.vector(value))
                case "axis":
                    found += self.axis(draw.shape, value)
                case "count":
                    turns = Fraction(TURNS) if value is None else constant(value)
                    assert isinstance(turns, Fraction)
                    found.append(self.graph.constant(turns))
                case "corners" if value is not None:
                    width = value.type.shape[1]
                    flat = self.vector(value)
                    for k in range(0, len(flat), width):
                        found += self.solid(flat[k : k + width])
                case _:
                    pass
        return found

    def axis(self, shape: str, value: Expression | None) -> list[Node]:
        if value is None:
            return [self.graph.constant(x) for x in BY_AXIS[shape]]
        return self.solid(self.vector(value))

    def sampled(self, draw: Draw) -> tuple[list[Node], tuple[int, ...]]:
        """Return pose and points of a curve or a surface."""
        graph, lowering = self.graph, self.lowering
        pieces = PIECES[len(draw.samples)]
        (body,) = draw.values.values()
        ranges = [(lowering.scalar(s.lower), lowering.scalar(s.upper)) for s in draw.samples]
        nodes = self.pose(draw.place)
        for steps in product(range(pieces + 1), repeat=len(ranges)):
            places = [
                graph.add(a, graph.mul(graph.constant(Fraction(k, pieces)), graph.sub(b, a)))
                for k, (a, b) in zip(steps, ranges, strict=True)
            ]
            with lowering.trial():
                for sample, place in zip(draw.samples, places, strict=True):
                    lowering.assign(sample.variable, place)
                point = self.vector(body)
            nodes += self.solid([*places, *point] if len(point) == 1 else point)
        return nodes, (pieces + 1,) * len(ranges)

    # ------------------------------------------------------------ by rule

    def by_rule(self, instances: Collection[str]) -> Iterator[tuple[ShapeEntry, list[Node]]]:
        """Yield what is drawn of a model that says nothing itself: paths of outputs that are points, or of few masses, masses of parts
        that do not draw themselves (``instances`` do, and who says ``draw none`` wants nothing), and, where no part does, what its joints carry."""
        system = self.system
        for ends, name in self._links().items() if not instances else ():
            yield ShapeEntry("line", (), name), list(ends)
        masses = [
            mass
            for mass in system.masses
            if mass.origin.instance not in instances and not self._silent(mass.origin)
        ]
        for mass in masses:
            yield ShapeEntry("mass", (), mass.origin.instance), [*self.at(mass.point), mass.mass]
        place = [] if instances or masses else self._cartesian()
        if place:
            yield ShapeEntry("trail", ()), place
            yield ShapeEntry("sphere", (), relative=True), [*place, *self.pose(None)[3:], self.graph.one]
        points = [
            d for d in system.model.definitions if d.value is not None and _is_point(d, system.model.space)
        ]
        for definition in points:
            assert definition.value is not None
            nodes = self.position(definition.value)
            yield ShapeEntry("trail", (), definition.name), nodes
            if not masses and not instances:
                ball = ShapeEntry("sphere", (), definition.name, relative=True)
                yield ball, [*nodes, *self.pose(None)[3:], self.graph.one]
        if not points and not instances and len(masses) <= FEW:
            for mass in masses:
                yield ShapeEntry("trail", (), mass.origin.instance), self.at(mass.point)

    def _cartesian(self) -> list[Node]:
        """Return the coordinates, or states, called x and y, and z, of one unit: in a model without frames they are a place."""
        of = self.system.q or self.system.symbols.states
        named = {s.name: s for s in of if s.name in ("x", "y", "z")}
        found = [named[name] for name in ("x", "y", "z") if name in named]
        units = {s.variable.type.dimension for s in found}
        lengths = units <= {LENGTH} or self.system.model.dimensionless
        return (
            self.solid([s.node for s in found])
            if len(found) >= 2 and "x" in named and "y" in named and lengths
            else []
        )

    def without_places(self) -> Iterator[tuple[ShapeEntry, list[Node]]]:
        """Yield what stands for a model whose places nothing tells: the rows of matrices of coordinates as points, else the
        axes of frames, else each coordinate, state or output as a bead on a line of its own, or a hand on a dial."""
        yield from self._rows() or self._turning() or self._gauges()

    def _rows(self) -> list[tuple[ShapeEntry, list[Node]]]:
        found: list[tuple[ShapeEntry, list[Node]]] = []
        for coordinate in self.system.symbols.coordinates:
            type, name = coordinate.variable.type, coordinate.variable.name
            if len(type.shape) != 2 or type.shape[1] not in (2, 3):
                continue
            if type.dimension != LENGTH and not self.system.model.dimensionless:
                continue
            width = type.shape[1]
            for k in range(0, len(coordinate.q), width):
                place = self.solid([s.node for s in coordinate.q[k : k + width]])
                row = f"{name}[{k // width + 1}]"
                found.append((ShapeEntry("trail", (), row), place))
                ball = ShapeEntry("sphere", (), row, relative=True)
                found.append((ball, [*place, *self.pose(None)[3:], self.graph.one]))
        return found

    def _turning(self) -> list[tuple[ShapeEntry, list[Node]]]:
        """Return the axes of the frames of the model that move."""
        found: list[tuple[ShapeEntry, list[Node]]] = []
        for definition in self.system.model.definitions:
            value = definition.value
            if definition.role is DefinitionRole.FRAME and value is not None and "." not in definition.name:
                frame = self.lowering.frame(value)
                pose = [*self.origin(frame), *self.axes(frame)]
                if not all(self.graph.is_constant(n) for n in pose):
                    moves = not all(self.graph.is_constant(n) for n in pose[:3])
                    axes = ShapeEntry("frame", (), definition.name, relative=moves)
                    found.append((axes, [*pose, self.graph.one]))
        return found

    def _gauges(self) -> list[tuple[ShapeEntry, list[Node]]]:
        free = [s for c in self.system.symbols.coordinates if not c.is_rotation for s in c.q]
        scalars = (free or self.system.symbols.states)[:GAUGES]
        found = [
            (ShapeEntry("dial" if s.variable.type.angle else "bead", (), s.name, text=s.name), [s.node])
            for s in scalars
        ]
        for definition in self.system.model.definitions if not scalars else ():
            type = definition.type
            if definition.role is DefinitionRole.OUTPUT and type.kind is Kind.REAL and definition.value:
                nodes, name = self.vector(definition.value), definition.name
                for k, node in enumerate(nodes if len(found) < GAUGES else (), start=1):
                    text = name if len(nodes) == 1 else f"{name}[{k}]"
                    found.append((ShapeEntry("dial" if type.angle else "bead", (), text, text=text), [node]))
        return found

    def _links(self) -> dict[tuple[Node, ...], str]:
        """Return lines from the joint that carries a mass or a joint to it, with the name of the joint."""
        system = self.system
        roots = {id(self.lowering.named(edge.root)): edge.joint.name for edge in system.topology.tree}
        lines: dict[tuple[Node, ...], str] = {}
        for edge in system.topology.tree:
            if self._silent(edge.joint.origin):
                continue
            start = self.lowering.named(edge.joint.source) if edge.joint.source else None
            if isinstance(start, Frame):
                self._link(start, self.origin(start), roots, lines)
        for mass in system.masses:
            if not self._silent(mass.origin):
                self._link(mass.point.frame, self.at(mass.point), roots, lines)
        return lines

    def _silent(self, origin: Origin) -> bool:
        """Tell what is stated by a component that says ``draw none``, or by one inside it."""
        return f"{origin.instance}.".startswith(tuple(f"{path}." for path in self.system.model.quiet))

    def _link(
        self, frame: Frame, end: list[Node], roots: dict[int, str], lines: dict[tuple[Node, ...], str]
    ) -> None:
        """Note the line from the joint that carries a frame to a point of it."""
        at: Frame | None = frame
        while at is not None and id(at) not in roots:
            at = at.parent
        if at is not None:
            begin = self.origin(at)
            if begin != end:
                lines.setdefault((*begin, *end), roots[id(at)])


def _is_point(definition: Definition, space: int) -> bool:
    """Tell whether an output is a place: a frame, a point or a vector of lengths, in the plane of two."""
    type = definition.type
    if definition.role is not DefinitionRole.OUTPUT:
        return False
    return type.kind is Kind.POINT or (
        type.shape in (((2,),) if space == 2 else ((2,), (3,)))
        and type.dimension == LENGTH
        and type.kind is Kind.REAL
    )
