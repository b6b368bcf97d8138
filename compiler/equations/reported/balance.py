"""Newton's and Euler's laws of each body, from its motion, the loads on it and the reactions as they are reported.

A check of the equations and of the reactions that shares nothing with how either is found: accelerations are the second
derivatives of places by the chain rule, loads act where the text says, forces of potentials, dampings and constraints are
derivatives by the places of bodies that nothing joins (``mechanics/apart.py``). What is looked at is every free frame, with
mass or without. A model that asks for no reaction has none that could be balanced.

That joints place what the text says that they place is checked wherever joints close loops, too.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING

from msgspec import Struct

from mechc.runtime.interface import Quantity

from ...flat.model import Expression, Joint, Kind, Load
from ...graph import Node
from ...graph.vector import Vector, cross, cross_planar, matvec, negate, scale, subtract, transpose_matvec
from ...mechanics.contacts import switched_names
from ...mechanics.kinematics.frames import Frame, Point
from ...mechanics.kinematics.reactions import whole_reaction
from ...mechanics.system import MechanicalSystem
from ..model import BALANCE, Function, quantity
from ..solve.solved import Solved

if TYPE_CHECKING:
    from .derived_forces import DerivedForces

NOISE = Fraction(1, 10**6)
"""m/s^2: an acceleration whose force has a size, where all others vanish."""
SHARE = Fraction(1, 10**3)
"""Of the reactions of all joints, in the size of the forces on each body: what carries nothing feels the rounding of others."""


class Wrench(Struct, frozen=True):
    """A force through a place of the world, and a moment."""

    force: Vector
    place: Vector
    moment: Vector


class Ends(Struct, frozen=True):
    """Where a joint ends and where the text says that it does, and the axes there."""

    joint: str
    place: Vector
    other: Vector
    axes: tuple[Vector, ...]
    others: tuple[Vector, ...]


class BalanceCheck(Struct, frozen=True):
    """What is checked, what it is off by, and the square of its size."""

    entry: Quantity
    off: tuple[Node, ...]
    size: Node


class Balance(Struct, frozen=True):
    """``entries``: what is checked, kinds force, moment, place, direction; of each the function gives the squares of what it
    is off by, and of the size of its terms."""

    entries: tuple[Quantity, ...] = ()
    functions: tuple[Function, ...] = ()


def balance_of(system: MechanicalSystem, solved: Solved) -> Balance:
    """Return the laws of the bodies of a model whose joints close loops, or whose reactions are asked for.

    What vanishes whatever the state is left out.
    """
    model = system.model
    if not (system.virtual or system.topology.closures) or model.unknowns or model.implicit:
        return Balance()
    graph = system.graph
    checks = list(_Laws(system, solved).checks())
    offs = iter(solved.resolve([n for check in checks for n in check.off]))
    remaining = [(check, [next(offs) for _ in check.off]) for check in checks]
    left = [(check, off) for check, off in remaining if not all(graph.is_zero(x) for x in off)]
    sizes = solved.resolve([check.size for check, _ in left])
    nodes = [n for (_, off), size in zip(left, sizes, strict=True) for n in (graph.dot(off, off), size)]
    doc = "what forces, moments and places are off by, and their sizes, squared"
    return Balance(
        tuple(check.entry for check, _ in left), (Function(BALANCE, doc, tuple(nodes)),) if nodes else ()
    )


class _Laws:
    """The wrenches on each body. ``unknown``: the world, and bodies on which something acts that is not formed here."""

    def __init__(self, system: MechanicalSystem, solved: Solved) -> None:
        from ...mechanics.apart import WORLD, Apart

        self.system, self.graph, self.kinematics = system, system.graph, system.kinematics
        self.lowering = system.lowering
        self.apart = Apart(system)
        self.wrenches: dict[str, list[Wrench]] = {name: [] for name in (WORLD, *self.apart.bodies)}
        self.unknown: set[str] = {WORLD}
        self.masses: dict[str, Node] = {}
        self._turning: dict[str, list[tuple[Node, Node]]] = {}
        """Squares of forces and moments that cancel each other where a body turns by itself: m w^2 r, and w L."""
        self.ends: list[Ends] = []
        self._reactions: list[Node] = []
        self._reaction_moments: list[Node] = []
        """Their squares."""
        self._none: Vector = (self.graph.zero,) * self.kinematics.size
        self._no_moment: Vector = self._none if self.kinematics.size == 3 else (self.graph.zero,)
        self._holders: dict[int, str] = {}
        """The body that carries what an expression of the model stands for, by its identity."""
        self._joined: dict[str, tuple[str, str]] = {}
        """The bodies after and before each joint."""
        self.apart.see([*self._seen()])
        if system.virtual:
            from .derived_forces import DerivedForces

            with self.apart.lowered():
                self._hold()
            self._matter()
            self._loads()
            self._derived(DerivedForces(system, solved, self.apart))
        self._joints()

    # ------------------------------------------------------------ what is checked

    def checks(self) -> Iterator[BalanceCheck]:
        """Yield Newton's and Euler's law of each body, then what joints hold."""
        graph = self.graph
        lengths = graph.sum(graph.dot(p, p) for p in (e.place for e in self.ends))
        pure = self.system.model.dimensionless
        for name, wrenches in self.wrenches.items():
            if wrenches and name not in self.unknown:
                yield from self._laws(name, wrenches, lengths, pure=pure)
        switched = switched_names(self.system.model)
        for end in self.ends:
            if end.joint in switched:
                continue
            gap = subtract(graph, end.place, end.other)
            yield BalanceCheck(quantity(end.joint, "place", "" if pure else "m"), gap, lengths)
            turned = [x for a, b in zip(end.axes, end.others, strict=True) for x in subtract(graph, a, b)]
            yield BalanceCheck(quantity(end.joint, "direction", ""), tuple(turned), graph.one)

    def _laws(
        self, name: str, wrenches: Sequence[Wrench], lengths: Node, *, pure: bool
    ) -> Iterator[BalanceCheck]:
        graph = self.graph
        title = self._title(name)
        centre = self.apart.origin(self.apart.bodies[name])
        noise = graph.mul(graph.constant(NOISE), self.masses.get(name, graph.zero))
        share = graph.constant(SHARE**2)
        floor = graph.add(graph.mul(noise, noise), graph.mul(share, graph.sum(self._reactions)))
        forces = [w.force for w in wrenches]
        total = tuple(graph.sum(f[k] for f in forces) for k in range(len(self._none)))
        turning = self._turning.get(name, [])
        size = graph.sum([*(graph.dot(f, f) for f in forces), *(f for f, _ in turning), floor])
        yield BalanceCheck(quantity(title, "force", "" if pure else "N"), total, size)
        arms = [subtract(graph, w.place, centre) for w in wrenches]
        moments = [w.moment for w in wrenches]
        moments += [self._moment(arm, force) for arm, force in zip(arms, forces, strict=True)]
        total = tuple(graph.sum(m[k] for m in moments) for k in range(len(self._no_moment)))
        # a force along its arm has no moment but that of its rounding
        levers = [
            graph.mul(graph.dot(arm, arm), graph.dot(force, force))
            for arm, force in zip(arms, forces, strict=True)
        ]
        terms = [*levers, *(graph.dot(w.moment, w.moment) for w in wrenches), *(m for _, m in turning)]
        floors = [graph.mul(floor, lengths), graph.mul(share, graph.sum(self._reaction_moments))]
        size = graph.sum([*terms, *floors])
        yield BalanceCheck(quantity(title, "moment", "" if pure else "N.m"), total, size)

    def _title(self, name: str) -> str:
        definition = next(d for d in self.system.model.definitions if d.name == name)
        return definition.origin.instance or name

    def _moment(self, arm: Vector, force: Vector) -> Vector:
        graph = self.graph
        return (cross_planar(graph, arm, force),) if len(arm) == 2 else cross(graph, arm, force)

    def _act(self, body: str, force: Vector, place: Vector, moment: Vector | None = None) -> None:
        wrench = Wrench(force, place, self._no_moment if moment is None else moment)
        if not all(self.graph.is_zero(x) for x in (*wrench.force, *wrench.moment)):
            self.wrenches[body].append(wrench)

    # ------------------------------------------------------------ motion

    def _matter(self) -> None:
        """Take off the rates of momentum: m a of each mass, and that of the spin of each inertia."""
        from ...mechanics.apart import WORLD

        graph, apart, model = self.graph, self.apart, self.system.model
        for mass in model.masses:
            body = self._holders[id(mass.at)]
            if body == WORLD:
                continue
            (value,) = apart.still(self.lowering.numbers(mass.value))
            place = apart.position(self.lowering.point(mass.at))
            acceleration = apart.rates(apart.rates(place))
            if mass.gravity is not None:
                field = apart.still(self.lowering.numbers(mass.gravity))
                self._act(body, scale(graph, value, field), place)
            self._act(body, negate(graph, scale(graph, value, acceleration)), place)
            self.masses[body] = graph.add(self.masses.get(body, graph.zero), value)
            held = apart.bodies[body]
            spin = apart.spin(apart.axes(held.joined))
            arm = subtract(graph, place, apart.origin(held))
            pull = graph.mul(value, graph.dot(spin, spin))
            square = graph.mul(graph.mul(pull, pull), graph.dot(arm, arm))
            self._turning.setdefault(body, []).append((square, graph.mul(square, graph.dot(arm, arm))))
        for inertia in model.inertias:
            body = self._holders[id(inertia.on)]
            if body == WORLD:
                continue
            values = apart.still(self.lowering.numbers(inertia.value))
            if not all(graph.is_zero(x) for x in apart.rates(values)):
                self.unknown.add(body)  # what joins or leaves takes spin along
                continue
            axes = apart.axes(self.lowering.frame(inertia.on))
            spin = apart.spin(axes)
            if len(axes) == 2:
                momentum: Vector = scale(graph, values[0], spin)
            else:
                rows = (values[:3], values[3:6], values[6:])
                momentum = matvec(graph, axes, matvec(graph, rows, transpose_matvec(graph, axes, spin)))
            self._act(body, self._none, self._none, negate(graph, apart.rates(momentum)))
            square = graph.mul(graph.dot(spin, spin), graph.dot(momentum, momentum))
            self._turning.setdefault(body, []).append((graph.zero, square))

    # ------------------------------------------------------------ loads on bodies

    def _loads(self) -> None:
        for load in self.system.model.loads:
            if load.on.type.kind in (Kind.FRAME, Kind.POINT):
                value = self.lowering.numbers(load.value)
                if load.frame is not None and len(value) > 1:
                    value = self.kinematics.to_world(self.lowering.frame(load.frame), value)
                value = self.apart.still(value)
                self._load(load, load.on, value)
                if load.source is not None:
                    self._load(load, load.source, negate(self.graph, value))

    def _load(self, load: Load, end: Expression, value: Vector) -> None:
        body = self._holders[id(end)]
        if load.kind == "torque":
            self._act(body, self._none, self._none, value)
        else:
            at = self.lowering.point(end if load.at is None else load.at)
            self._act(body, value, self.apart.position(at))

    def _derived(self, forces: DerivedForces) -> None:
        self.unknown |= forces.unclear
        for body, force, moment in forces.wrenches():
            self._act(body, force, self.apart.origin(self.apart.bodies[body]), moment)

    # ------------------------------------------------------------ where joints are

    def _hold(self) -> None:
        model = self.system.model
        expressions = [m.at for m in model.masses] + [i.on for i in model.inertias]
        for load in model.loads:
            if load.on.type.kind in (Kind.FRAME, Kind.POINT):
                expressions += [load.on] if load.source is None else [load.on, load.source]
        for expression in expressions:
            self._holders[id(expression)] = self.apart.holder(self.lowering.point(expression).frame)
        for joint in model.joints:
            source = self._frame(joint.source) if joint.source else self.lowering.frame(joint.value)
            self._joined[joint.name] = (
                self.apart.holder(self._frame(joint.target)),
                self.apart.holder(source),
            )

    def _seen(self) -> Iterator[Point]:
        """Yield the points at which the laws are formed, where joints place them."""
        model, lowering = self.system.model, self.lowering
        for body in self.apart.bodies.values():
            yield Point(body.joined, self._none)
        for joint in model.joints:
            yield Point(self._frame(joint.target), self._none)
            if self._clear(joint):
                yield Point(lowering.frame(joint.value), self._none)
        if self.system.virtual:
            yield from (lowering.point(mass.at) for mass in model.masses)
            yield from (lowering.point(inertia.on) for inertia in model.inertias)

    def _clear(self, joint: Joint) -> bool:
        """Whether the coordinates of a joint have values: of one that closes a loop they need not."""
        return all(name in self.lowering.known for name in joint.coordinates)

    def _frame(self, name: str) -> Frame:
        frame = self.lowering.named(name)
        assert isinstance(frame, Frame)
        return frame

    # ------------------------------------------------------------ joints

    def _joints(self) -> None:
        graph, apart, lowering = self.graph, self.apart, self.lowering
        for joint in self.system.model.joints:
            here = self._frame(joint.target)
            place = apart.position(Point(here, self._none))
            if self._clear(joint):
                there = lowering.frame(joint.value)
                other = apart.position(Point(there, self._none))
                self.ends.append(Ends(joint.name, place, other, apart.axes(here), apart.axes(there)))
            if not self.system.virtual:
                continue
            to, source = self._joined[joint.name]
            force, moment = (lowering.reported(q) for q in whole_reaction(joint, self.kinematics.size))
            self._reactions.append(graph.dot(force, force))
            self._reaction_moments.append(graph.dot(moment, moment))
            self._act(to, force, place, moment)
            self._act(source, negate(graph, force), place, negate(graph, moment))
