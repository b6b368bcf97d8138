"""The world turned and moved: everything stands on a frame that is elsewhere, and vectors follow it."""

from __future__ import annotations

from fractions import Fraction
from random import Random

from msgspec.structs import replace

from ..flat import types
from ..flat.model import (
    Apply,
    Array,
    Definition,
    DefinitionRole,
    Element,
    Event,
    Expression,
    FlatModel,
    Impulse,
    Kind,
    Load,
    Mass,
    Name,
    Query,
)
from ..flat.operands import children, with_operands
from .asked import ModelFacts, defined_by, felt
from .rewriting import apply, everywhere, measured, number, total, undrawn
from .twin import ACCOUNTS, NotApplicable, Seen, Twin

SHIFT = (Fraction(7, 10), Fraction(-2, 5), Fraction(1, 2))
"""How far the world is moved, as shares of how far a motion reaches at its start; without one, metres."""
WEIGHED = frozenset({"energy", "potential_energy"})
"""Questions whose answers have another zero elsewhere."""
APART = frozenset({"energy.potential", "energy.total", "momentum", "angular_momentum"})
BASE = "the turned world"


def turned_world(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Put everything onto a frame that is turned and moved against the world.

    What is said in world components is said in those of this frame: gravity, forces, positions, velocities.
    """
    if not model.space:
        raise NotApplicable("it has no frames or points")
    if felt(model, WEIGHED):
        raise NotApplicable("its motion feels its potential energy, whose zero is moved")
    turned = _Turned(model, seen, random)
    apart = APART | defined_by(model, WEIGHED) | _brought_by_weights(model)
    return Twin("turned world", "the world turned and moved", turned.model(), apart)


def _brought_by_weights(model: FlatModel) -> frozenset[str]:
    """Return the accounts of energy where a weight changes: what that brings depends on the height above the world."""
    facts = ModelFacts(model)
    weights = ((m.value, m.gravity) for m in model.masses if m.gravity is not None)
    changes = any(not facts.constant(e) for weight in weights for e in weight)
    return ACCOUNTS if changes else frozenset()


def _reach(model: FlatModel, seen: Seen | None) -> float:
    """Return how far the masses are from the world at the start: a shift by more would cost digits."""
    if seen is None:
        return 1.0
    places = [apply("pos", measured(model, "length", (model.space,)), m.at) for m in model.masses]
    return max((abs(x) for place in seen.evaluated(places) for x in place), default=0.0) or 1.0


class _Turned:
    def __init__(self, model: FlatModel, seen: Seen | None, random: Random) -> None:
        self.old = model
        self.size = model.space
        self.span = model.origin.span
        self.angle = number(Fraction(random.randint(3, 25), 10), types.ANGLE, self.span)
        self.axis = "" if self.size == 2 else random.choice("xyz")
        self.base = Name(type=types.FRAME, span=self.span, name=BASE)
        self.length = measured(model, "length", (self.size,))
        far = Fraction(_reach(model, seen))
        entries = tuple(number(far * x, self.length, self.span) for x in SHIFT[: self.size])
        self.shift = Array(type=self.length, span=self.span, elements=entries)
        self.done: dict[int, tuple[Expression, Expression]] = {}
        self.points = {
            d.name for d in model.definitions if d.role is DefinitionRole.OUTPUT and d.type.kind is Kind.POINT
        }

    def model(self) -> FlatModel:
        old = undrawn(self.old)
        made = everywhere(replace(old, definitions=(), masses=(), loads=(), events=()), self.value)
        poses = [apply("trans", types.POSE, self.shift), apply("rot" + self.axis, types.POSE, self.angle)]
        world: Expression = Name(type=types.FRAME, span=self.span, name="world")
        for pose in poses:
            world = apply("multiply", types.FRAME, world, pose)
        base = Definition(BASE, DefinitionRole.FRAME, types.FRAME, world, old.origin)
        definitions = [base]
        for d in old.definitions:
            definitions += self.definition(d)
        joints = tuple(
            replace(j, source=self.renamed(j.source), target=self.renamed(j.target)) for j in made.joints
        )
        return replace(
            made,
            definitions=tuple(definitions),
            joints=joints,
            masses=tuple(self.mass(m) for m in old.masses),
            loads=tuple(self.load(x) for x in old.loads),
            events=tuple(self.acting(e) for e in old.events),
        )

    def renamed(self, frame: str) -> str:
        return BASE if frame == "world" else frame

    def definition(self, d: Definition) -> list[Definition]:
        """Return a definition; that of an output that is a point stands for its value, and a hidden one for the point."""
        if d.value is None:
            return [d]
        if d.name not in self.points:
            return [replace(d, value=self.placed(d.value))]
        if len(d.type.shape) != 1:
            raise NotApplicable(f"the output '{d.name}' holds several points")
        hidden = replace(d, name=self.hidden(d.name), role=DefinitionRole.POINT, value=self.placed(d.value))
        at = Name(type=d.type, span=self.span, name=hidden.name)
        world = Name(type=types.FRAME, span=self.span, name="world")
        return [hidden, replace(d, value=apply("multiply", d.type, world, self.local(at)))]

    def hidden(self, name: str) -> str:
        return f"{name} in {BASE}"

    def mass(self, m: Mass) -> Mass:
        g = None if m.gravity is None else self.direction(self.value(m.gravity))
        return Mass(self.value(m.value), self.placed(m.at), g, m.origin)

    def load(self, x: Load) -> Load:
        made: Load = everywhere(x, self.placed)
        made = replace(made, value=self.value(x.value))
        if not x.value.type.shape or x.frame is not None:
            return made
        return replace(made, frame=self.base)

    def acting(self, e: Event) -> Event:
        found = everywhere(e, self.value)
        branches = []
        for old, new in zip(e.branches, found.branches, strict=True):
            actions = [
                replace(new_one, load=self.load(one.load)) if isinstance(one, Impulse) else new_one
                for one, new_one in zip(old.actions, new.actions, strict=True)
            ]
            branches.append(replace(new, actions=tuple(actions)))
        return replace(found, branches=tuple(branches))

    # ------------------------------------------------------------ expressions

    def value(self, e: Expression) -> Expression:
        """Return an expression whose value is used: a point stands for its components."""
        made = self.placed(e)
        return self.local(made) if made.type.kind is Kind.POINT and len(made.type.shape) == 1 else made

    def placed(self, e: Expression) -> Expression:
        """Return an expression that may be a frame or a point."""
        found = self.done.get(id(e))
        if found is None:
            found = self.done[id(e)] = e, self.turned(e)
        return found[1]

    def turned(self, e: Expression) -> Expression:
        match e:
            case Name(name="world"):
                return self.base
            case Name(name=name) if name in self.points:
                return replace(e, name=self.hidden(name))
            case Query():
                return self.query(e)
            case Apply():
                return self.applied(e)
            case Element(base=base) if base.type.kind is Kind.POINT and len(base.type.shape) > 1:
                return with_operands(e, (self.placed(base),))
            case _:
                return with_operands(e, tuple(self.value(x) for x in children(e)))

    def query(self, e: Query) -> Expression:
        made = with_operands(e, tuple(self.placed(x) for x in e.arguments))
        if e.function == "mass_centre":
            moved = total(made, self.shift, "subtract")
            return self.components(moved)
        of_joint = e.function in ("reaction", "moment") and any(j.name == e.target for j in self.old.joints)
        # those of drives are along coordinates
        return self.components(made) if of_joint and e.type.shape else made

    def applied(self, e: Apply) -> Expression:
        given = e.arguments
        match e.function:
            case "pos" | "origin":
                return self.local(self.position(given[0]))
            case "local":
                return with_operands(e, (self.placed(given[0]), self.position(given[1])))
            case "vel_at":
                return self.components(with_operands(e, (self.placed(given[0]), self.position(given[1]))))
            case "vel" | "angvel":
                made = with_operands(e, tuple(self.placed(x) for x in given))
                return self.components(made) if len(given) == 1 and e.type.shape else made
            case "heading":
                made = with_operands(e, (self.placed(given[0]),))
                return total(made, self.angle, "subtract")
            case "components":
                return with_operands(e, (self.placed(given[0]), self.direction(self.value(given[1]))))
            case "direction":
                return self.components(with_operands(e, (self.placed(given[0]), self.value(given[1]))))
            case "multiply" if given[0].type.kind in (Kind.FRAME, Kind.POSE, Kind.ROTATION):
                return with_operands(e, (self.placed(given[0]), self.value(given[1])))
            case _:
                return with_operands(e, tuple(self.value(x) for x in given))

    def position(self, e: Expression) -> Expression:
        """Return a place; components of the world as a point of the frame."""
        if e.type.kind in (Kind.FRAME, Kind.POINT):
            return self.placed(e)
        point = types.make(Kind.POINT, (self.size,), self.length.dimension)
        return apply("multiply", point, self.base, self.value(e))

    def local(self, e: Expression) -> Expression:
        return apply("local", self.length, self.base, e)

    def components(self, e: Expression) -> Expression:
        return apply("components", types.real(e.type.dimension, e.type.shape), self.base, e)

    def direction(self, e: Expression) -> Expression:
        return apply("direction", types.real(e.type.dimension, e.type.shape), self.base, e)
