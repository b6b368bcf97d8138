"""Bodies taken apart: every free frame at a place of its own, as if no joint held it.

Statements that are lowered there depend on the places of the bodies themselves, whatever joints connect them. So the
force of a potential, a damping or a constraint on each body is a derivative by the place of that body.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from msgspec import Struct

from ..flat.model import DefinitionRole
from ..graph import Graph, Node
from ..graph.rewrite import substitute
from ..graph.vector import Vector, transpose, unit_vector
from .kinematics.frames import Frame, FrameKinematics, Point, displaced
from .kinematics.planar import Planar
from .kinematics.pose import Pose, Rotate, Translate, Turn
from .kinematics.rates import TotalDerivative
from .system import MechanicalSystem

WORLD = "world"


class FreeFrame(Struct, frozen=True):
    """A free frame: ``joined`` where joints place it, ``apart`` at the place ``x`` and turned by small angles ``e`` about the
    axes of the world (in the plane, by its whole angle); ``v`` and ``w`` are their rates. ``axes``: of a general orientation."""

    name: str
    joined: Frame
    apart: Frame
    x: Vector
    e: Vector
    v: Vector
    w: Vector
    axes: Vector

    @property
    def place(self) -> tuple[Node, ...]:
        return (*self.x, *self.e)

    @property
    def motion(self) -> tuple[Node, ...]:
        return (*self.v, *self.w)


class Apart:
    """The bodies of a system taken apart."""

    def __init__(self, system: MechanicalSystem) -> None:
        self._system = system
        self._graph: Graph = system.graph
        self._kinematics: FrameKinematics = system.kinematics
        self._chain = TotalDerivative(self._graph, {})
        self._still: dict[Node, Node] = {}
        known = system.lowering.known
        self.bodies: dict[str, FreeFrame] = {}
        for d in system.model.definitions:
            frame = known.get(d.name)
            if d.role is DefinitionRole.FRAME and d.value is None and isinstance(frame, Frame):
                self.bodies[d.name] = self._body(d.name, frame)
        self._names = {id(frame): name for name, body in self.bodies.items() for frame in _steps(body.apart)}
        self.motions = frozenset(n for body in self.bodies.values() for n in body.motion)

    def _body(self, name: str, joined: Frame) -> FreeFrame:
        graph, size = self._graph, self._kinematics.size
        turns = 1 if size == 2 else 3

        def symbols(what: str, count: int) -> Vector:
            return tuple(graph.symbol(f"#{what} of {name} {k}") for k in range(count))

        x, e, v, w = symbols("x", size), symbols("e", turns), symbols("v", size), symbols("w", turns)
        for place, motion in zip((*x, *e), (*v, *w), strict=True):
            self._system.rate.define(place, motion)
        axes = symbols("axes", 9) if size == 3 else ()
        pose: Pose = (Translate(x), *(Rotate(2 if size == 2 else k, angle) for k, angle in enumerate(e)))
        if axes:
            pose = (*pose, Turn((axes[:3], axes[3:6], axes[6:]), None))
        return FreeFrame(name, joined, displaced(graph, self._kinematics.world, pose), x, e, v, w, axes)

    @contextmanager
    def lowered(self) -> Iterator[None]:
        """Lower all that is lowered inside with the bodies apart."""
        system = self._system
        with system.lowering.anew():
            for name, body in self.bodies.items():
                system.lowering.assign(name, body.apart)
            for d in system.model.definitions:  # in order, as long chains need no deep recursion then
                if d.value is not None and d.role in (DefinitionRole.FRAME, DefinitionRole.POINT):
                    system.lowering.named(d.name)
            yield

    def holder(self, frame: Frame) -> str:
        """Return the body that carries a frame that was lowered apart."""
        at: Frame | None = frame
        while at is not None and id(at) not in self._names:
            at = at.parent
        return WORLD if at is None else self._names[id(at)]

    # ------------------------------------------------------------ the motion, from the places alone

    def rates(self, nodes: Sequence[Node]) -> tuple[Node, ...]:
        """Differentiate formulas by time, by the chain rule and nothing else."""
        for symbol in self._graph.support(*nodes):
            self._chain.define(symbol, self._system.rate(symbol))
        return tuple(self._chain(n) for n in nodes)

    def still(self, nodes: Sequence[Node]) -> tuple[Node, ...]:
        """Return formulas without virtual displacements, of which no motion has any."""
        new = [n for n in nodes if n not in self._still]
        if new:
            zero = self._graph.zero
            none = {n: zero for moved in self._system.virtual.values() for n in moved.values}
            self._still |= zip(new, substitute(self._graph, new, none), strict=True)
        return tuple([self._still[n] for n in nodes])

    def see(self, points: Sequence[Point]) -> None:
        """Find all places and axes that will be asked for at once, as they share most of their formulas."""
        nodes = [x for point in points for x in self._kinematics.position(point)]
        frames = {id(point.frame): point.frame for point in points}
        self.still(
            [*nodes, *(x for frame in frames.values() for column in self._columns(frame) for x in column)]
        )

    def position(self, point: Point) -> Vector:
        return self.still(self._kinematics.position(point))

    def axes(self, frame: Frame) -> tuple[Vector, ...]:
        """Return the matrix that turns components in a frame into those in the world."""
        return transpose(tuple(self.still(column) for column in self._columns(frame)))

    def _columns(self, frame: Frame) -> list[Vector]:
        size = self._kinematics.size
        return [self._kinematics.to_world(frame, unit_vector(self._graph, k, size)) for k in range(size)]

    def spin(self, axes: Sequence[Vector]) -> Vector:
        """Return the angular velocity in the world of what has these axes: that of R' R^T."""
        graph = self._graph
        changes = [self.rates(row) for row in axes]
        pairs = [(1, 0)] if len(axes) == 2 else [(2, 1), (0, 2), (1, 0)]
        return tuple(graph.dot(changes[i], axes[j]) for i, j in pairs)

    def joined(self, nodes: Sequence[Node]) -> tuple[Node, ...]:
        """Put in where the joints place the bodies, and how these move."""
        graph, values = self._graph, dict[Node, Node]()
        met = set(graph.support(*nodes))
        for body in self.bodies.values():
            if met.isdisjoint((*body.place, *body.motion, *body.axes)):
                continue
            origin = self.origin(body)
            axes = self.axes(body.joined)
            values |= zip(body.x, origin, strict=True)
            values |= zip(body.v, self.rates(origin), strict=True)
            values |= zip(body.w, self.spin(axes), strict=True)
            if isinstance(self._kinematics, Planar):
                values |= zip(body.e, self.still((self._kinematics.angle(body.joined),)), strict=True)
            else:
                values |= dict.fromkeys(body.e, graph.zero)
                values |= zip(body.axes, (x for row in axes for x in row), strict=True)
        return tuple(substitute(graph, nodes, values))

    def origin(self, body: FreeFrame) -> Vector:
        return self.position(Point(body.joined, (self._graph.zero,) * self._kinematics.size))


def _steps(frame: Frame) -> Iterator[Frame]:
    """Yield the frames from one back to the world, which is left out: a turn merges with the last of them."""
    at = frame
    while at.parent is not None:
        yield at
        at = at.parent
