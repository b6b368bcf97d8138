"""The same mechanics said otherwise: each twin of a model must move as the model does."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from random import Random

from random_models.operators import (
    call,
    choose,
    der,
    divide,
    element,
    multiply,
    negate,
    power,
    relation,
    subtract,
    two,
    vector,
)
from random_models.quantities import quantity
from random_models.tree import (
    FORCE,
    LENGTH,
    NUMBER,
    SPEED,
    E,
    Model,
    S,
    Slot,
    map_expression,
    node,
    reference,
    statement,
)

_ENERGIES = {"energy", "kinetic_energy", "potential_energy", "power"}
_BODIES = {"mass_centre", "inertia_tensor"}


@dataclass(frozen=True)
class Twin:
    """A model that must do the same; ``ignored``: outputs that may differ (what energies are called)."""

    name: str
    model: Model
    ignored: tuple[str, ...] = ()
    names: Mapping[str, str] = field(default_factory=dict)
    """What is called otherwise there: heads of names."""
    base: Model | None = None
    """The model that it is a twin of, where that is not the one that was given."""


_HEAD = re.compile(r"^(d )?(der\()?(\w+)")


def renamed_name(twin: Twin, name: str) -> str:
    """Return what a state, an output or a parameter is called in the twin."""
    return _HEAD.sub(lambda m: f"{m[1] or ''}{m[2] or ''}{twin.names.get(m[3], m[3])}", name)


def _kinds(model: Model) -> set[str]:
    return {kind for kind, _ in model.pairs()}


def _energy_outputs() -> tuple[str, ...]:
    names = tuple(f"energy.{n}" for n in ("kinetic", "potential", "total", "supplied", "dissipated"))
    return names + tuple(f"d {n}" for n in names)


def shuffled(model: Model, random: Random) -> Twin | None:
    """Put the statements into another order."""
    items = list(model.top.seq().items)
    random.shuffle(items)
    return Twin("shuffled", model.with_top(tuple(items)))


def plain_units(model: Model, random: Random) -> Twin | None:
    """Write every quantity in SI."""

    def change(e: E) -> E:
        if e.kind != "quantity" or e.data is None:
            return e
        digits = f"{float(e.data):.17g}"
        plain = str(quantity(1, e.dim)).partition(" ")[2] if e.dim != NUMBER else "rad"
        return node("quantity", f"{digits} {plain}", dim=e.dim, binding=e.binding, value=e.value, data=e.data)

    return Twin("plain units", model.rebuilt(lambda e, _: map_expression(e, change)))


def without_kinks(model: Model, random: Random) -> Twin | None:
    """Write abs, min, max, clamp and deadzone by if."""
    if not _kinds(model) & {"abs", "min", "max", "clamp", "deadzone"}:
        return None

    def change(e: E) -> E:
        o = e.operands
        zero = node("number", "0")
        match e.kind:
            case "abs":
                new = choose(relation(">=", o[0], zero), o[0], negate(o[0]))
            case "min" | "max":
                sign = "<" if e.kind == "min" else ">"
                new = o[0]
                for other in o[1:]:
                    new = choose(relation(sign, new, other), new, other)
            case "clamp":
                new = choose(relation("<", o[0], o[1]), o[1], choose(relation(">", o[0], o[2]), o[2], o[0]))
            case "deadzone":
                inner = choose(
                    relation("<", o[0], negate(o[1])),
                    node("+", (o[0], 5), " + ", (o[1], 6), dim=o[0].dim, binding=5),
                    quantity(0, o[0].dim),
                )
                new = choose(relation(">", o[0], o[1]), subtract(o[0], o[1]), inner)
            case _:
                return e
        return E(new.kind, new.parts, e.dim, e.shape, e.level, new.binding, None)

    return Twin("without kinks", model.rebuilt(lambda e, _: map_expression(e, change)))


def energies_as_forces(model: Model, random: Random) -> Twin | None:
    """Write potentials of positions as the force -1 along the energy itself."""
    if _kinds(model) & _ENERGIES:
        return None
    changed = False

    def change(s: S) -> S | None:
        nonlocal changed
        if s.kind != "energy" or not str(s.parts[0]).startswith("potential"):
            return s
        e = s.slots[0].expression
        if not e.level <= frozenset("pqt") or "q" not in e.level or s.slots[0].place != "potential":
            return s
        changed = True
        minus = node("negate", "-", node("number", "1"), binding=7)
        return statement("force", "force ", Slot("force.value", minus), " on ", Slot("force.on", e), ";")

    other = model.rebuilt(lambda e, _: e, change)
    return Twin("energies as forces", other, _energy_outputs()) if changed else None


def dampings_as_functions(model: Model, random: Random) -> Twin | None:
    """Write dampings as Rayleigh functions, or as forces where their coefficient knows no velocity."""
    changed = False
    energies = bool(_kinds(model) & _ENERGIES)

    def change(s: S) -> S | None:
        nonlocal changed
        if s.kind != "damping" or s.name:
            return s
        c, q = s.slot("damping.value"), s.slot("damping.on")
        changed = True
        if random.random() < 0.5 and not c.level & frozenset("v") and not energies:
            value = multiply(negate(c), der(q))
            return statement("force", "force ", Slot("force.value", value), " on ", Slot("force.on", q), ";")
        e = multiply(divide(c, two()), power(der(q), two(), Fraction(2)))
        return statement("energy", "dissipation ", Slot("dissipation", e), ";")

    other = model.rebuilt(lambda e, _: e, change)
    return Twin("dampings as functions", other, _energy_outputs()) if changed else None


def masses_as_energies(model: Model, random: Random) -> Twin | None:
    """Write point masses and plane inertias as kinetic and potential energies."""
    if _kinds(model) & (_BODIES | _ENERGIES):
        return None
    gravity = next((s.slots[0].expression for s in model.top.seq().items if s.kind == "gravity"), None)
    plane = not any("mech.spatial" in str(s.parts[0]) for s in model.items)
    if not plane:
        return None
    changed = False
    new: list[S] = []
    for s in model.top.seq().items:
        if s.kind == "mass":
            m, at = s.slot("mass.value"), s.slot("mass.at")
            v = call("vel", at, dim=SPEED, shape=(2,))
            kinetic = multiply(divide(m, two()), call("dot", v, v))
            new.append(statement("energy", "kinetic ", Slot("kinetic", kinetic), ";"))
            if gravity is not None:
                weight = multiply(negate(m), call("dot", gravity, call("pos", at, dim=LENGTH, shape=(2,))))
                new.append(statement("energy", "potential ", Slot("potential", weight), ";"))
            changed = True
        elif s.kind == "inertia":
            w = call("angvel", s.slot("inertia.on"))
            spin = multiply(divide(s.slot("inertia.value"), two()), power(w, two(), Fraction(2)))
            new.append(statement("energy", "kinetic ", Slot("kinetic", spin), ";"))
        else:
            new.append(s)
    return Twin("masses as energies", model.with_top(tuple(new)), _energy_outputs()) if changed else None


def forces_by_components(model: Model, random: Random) -> Twin | None:
    """Write a force at a point as forces on the components of its position, a plane torque on the angle."""
    changed = False
    n = 3 if any("mech.spatial" in str(s.parts[0]) for s in model.items) else 2
    new: list[S] = []
    for s in model.top.seq().items:
        places = {x.place for x in s.slots}
        if s.kind == "force" and places == {"force.vector", "force.point"} and not s.name:
            f, p = s.slot("force.vector"), s.slot("force.point")
            name = f"component{len(new)}"
            new.append(statement("let", f"let {name} = ", Slot("let.value", f), ";", name=name))
            whole = E("ref:let", (), FORCE, (n,), f.level, 9, None, name)
            position = call("pos", p, dim=LENGTH, shape=(n,))
            new += [
                statement(
                    "force",
                    "force ",
                    Slot("force.value", element(whole, i)),
                    " on ",
                    Slot("force.on", element(position, i)),
                    ";",
                )
                for i in range(1, n + 1)
            ]
            changed = True
        elif s.kind == "torque" and n == 2 and places == {"torque.value", "torque.on"} and not s.name:
            angle = call("heading", s.slot("torque.on"))
            new.append(
                statement(
                    "force",
                    "force ",
                    Slot("force.value", s.slot("torque.value")),
                    " on ",
                    Slot("force.on", angle),
                    ";",
                )
            )
            changed = True
        else:
            new.append(s)
    return Twin("forces by components", model.with_top(tuple(new))) if changed else None


TWINS: tuple[Callable[[Model, Random], Twin | None], ...] = (
    shuffled, plain_units, without_kinks, energies_as_forces, dampings_as_functions, masses_as_energies,
    forces_by_components,
)  # fmt: skip


# ---------------------------------------------------------------- the world elsewhere


_SHIFT = (Fraction("0.7"), Fraction("-0.4"), Fraction("0.5"))


def turned_world(model: Model, random: Random) -> Twin | None:
    """Put everything onto a frame that is turned and moved against the world; vectors follow it.

    What is said in world components is said in those of the new frame: gravity, forces, positions, velocities.
    """
    space = _space(model)
    if (
        not space
        or _kinds(model) & _ENERGIES
        or any(
            s.kind == "component" and (s.data or {}).get("class") == "UniformMagneticField"
            for s in model.top.seq().items
        )
    ):
        return None
    angle = quantity(f"{random.uniform(0.3, 2.5):.2f}", NUMBER, None)
    axis = "" if space == 2 else random.choice(("x", "y", "z"))
    shift = vector(*(quantity(x, LENGTH) for x in _SHIFT[:space]))
    base = reference("base", "frame", LENGTH, level="q", type="frame")
    turn = call(f"rot{axis}", angle, type="pose")
    pose = node(
        "frame*", "world * ", call("trans", shift, type="pose"), " * ", turn, dim=LENGTH, type="frame"
    )
    new: list[S] = [statement("frame", "frame base = ", Slot("frame.value", pose), ";", name="base")]

    def change(e: E) -> E:
        o = e.operands
        if e.kind == "ref:world":
            return base
        if e.kind == "pos":
            return _as(e, call("local", base, o[0]))
        if e.kind == "ref:point":
            return e
        if e.kind == "heading":
            return (
                _as(e, call("heading", o[0]))
                if space == 3
                else _as(e, node("parentheses", "(", subtract(e, angle), ")"))
            )
        if e.kind == "angvel" and len(o) == 1 and space == 2:
            return e
        if (
            (e.kind in ("vel", "angvel") and len(o) == 1)
            or (e.kind in ("vel_at", "reaction") and e.shape)
            or (e.kind == "moment" and space == 3)
        ):
            return _as(e, call("components", base, e))
        if e.kind == "mass_centre":
            return _as(e, call("components", base, _minus(e, shift)))
        if e.kind == "direction":
            return _as(e, call("components", base, e))
        if e.kind == "components":
            return _as(
                e, call("components", o[0], call("direction", base, o[1], dim=o[1].dim, shape=o[1].shape))
            )
        return e

    for s in model.top.seq().items:
        if _points_as_values(s):
            return None
        s = s.rebuilt(lambda e, place: map_expression(e, change))
        places = {x.place for x in s.slots}
        if s.kind == "gravity":
            g = s.slots[0].expression
            s = statement(
                "gravity",
                "gravity ",
                Slot("gravity", call("direction", base, g, dim=g.dim, shape=g.shape)),
                ";",
            )
        elif (s.kind == "force" and "force.vector" in places and "force.in" not in places) or (
            s.kind == "torque" and space == 3 and "torque.in" not in places
        ):
            s = replace(s, parts=(*s.parts[:-1], " in ", Slot(f"{s.kind}.in", base), s.parts[-1]))
        elif s.kind in ("impulse", "when") and "impulse" in s.text():
            return None
        new.append(s)
    weight = ("energy.potential", "energy.total")  # its zero moves with the world
    axes = tuple(f"{m}.{a}" for m in ("momentum", "angular_momentum") for a in "xyz")
    return Twin("turned world", model.with_top(tuple(new)), weight + axes)


def _space(model: Model) -> int:
    texts = [str(s.parts[0]) for s in model.items]
    return (
        3 if any("mech.spatial" in t for t in texts) else 2 if any("mech.planar" in t for t in texts) else 0
    )


def _as(old: E, new: E) -> E:
    return E(new.kind, new.parts, old.dim, old.shape, old.level, new.binding)


def _minus(e: E, shift: E) -> E:
    return subtract(e, shift)


def _points_as_values(s: S) -> bool:
    """Whether a point stands for its position in world components somewhere."""

    def inside(e: E) -> bool:
        if e.kind in ("ref:point",):
            return True
        if e.kind in ("pos", "vel", "local", "vel_at", "frame*point", "frame*"):
            return False
        return any(inside(o) for o in e.operands)

    allowed = {
        "force.point",
        "force.from",
        "force.at",
        "mass.at",
        "impulse.on",
        "component.from",
        "component.to",
        "modification.frame",
        "point.value",
        "frame.value",
    }
    return any(
        inside(slot.expression) for inner in s.walk() for slot in inner.slots if slot.place not in allowed
    )


TWINS = (*TWINS, turned_world)
