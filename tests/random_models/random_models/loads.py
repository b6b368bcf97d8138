"""Random forces, energies and elements of the library, put onto a skeleton."""

from __future__ import annotations

import math
from fractions import Fraction

from random_models.bodies import WORLD, given, mod
from random_models.coordinates import half, square
from random_models.expressions import Writer
from random_models.operators import (
    add,
    call,
    der,
    multiply,
    negate,
    subtract,
    vector,
)
from random_models.scope import Scope
from random_models.tree import (
    ENERGY,
    FORCE,
    LENGTH,
    NUMBER,
    PRODUCT,
    RATE,
    SIGNED,
    TIME,
    E,
    S,
    Seq,
    Slot,
    dim,
    node,
    over,
    reference,
    statement,
    times,
    to_power,
)

F = Fraction
EVERYTHING = "tuzxqv"


def generalised(s: Scope) -> E:
    """Return a length or an angle of the coordinates: a coordinate, or an expression of them."""
    r = s.random.random()
    if s.coordinates and r < 0.55:
        return s.pick(s.coordinates)
    look = Writer(s, "q", kinks=False)
    there = [e for e in look.signals() if e.level and e.dim in (LENGTH, NUMBER)]
    if there and r < 0.8:
        return s.pick(there)
    e = look.scalar(s.pick((LENGTH, NUMBER)), 1)
    return e if "q" in e.level or not s.coordinates else s.pick(s.coordinates)


def label_of(s: Scope, prefix: str) -> tuple[str, str]:
    if s.chance(0.5):
        name = s.fresh(prefix)
        s.powers.append(name)
        return f"{name}: ", name
    return "", ""


def writer(s: Scope, allowed: str = EVERYTHING, **options: bool) -> Writer:
    asks = s.chance(0.3) and not s.in_class
    return Writer(s, allowed + ("a" if asks else ""), questions=asks, **options)


def force(s: Scope) -> None:
    """Write a generalised force."""
    q = generalised(s)
    label, name = label_of(s, "F")
    value = writer(s).scalar(over(ENERGY, q.dim), 2)
    tail: list[str | Slot] = []
    if s.chance(0.15) and s.coordinates:
        other = [o for o in s.coordinates if o.dim == q.dim and o != q]
        if other:
            tail = [" from ", Slot("force.from", s.pick(other))]
    s.add(
        "force",
        f"force {label}",
        Slot("force.value", value),
        " on ",
        Slot("force.on", q),
        *tail,
        ";",
        name=name,
        data={"on": "scalar"},
    )


def damping(s: Scope) -> None:
    """Write a damper."""
    q = generalised(s)
    label, name = label_of(s, "D")
    c = s.value(over(times(ENERGY, TIME), to_power(q.dim, 2)), s.number(0.05, 0.5))
    if s.chance(0.35):
        w = writer(s, kinks=False)
        c = multiply(c, add(s.literal(NUMBER, F("1.3")), call("sin", w.number(0), value=math.sin)))
    s.add(
        "damping", f"damping {label}", Slot("damping.value", c), " on ", Slot("damping.on", q), ";", name=name
    )


def potential(s: Scope) -> None:
    """Write a potential energy."""
    r = s.random.random()
    w = writer(s, "tuzxq" + ("v" if s.chance(0.1) else ""))
    w.questions = w.questions and s.chance(0.5)
    w.jumps = s.chance(0.2)
    if r < 0.45:
        q = generalised(s)
        stretch = q if s.chance(0.5) else subtract(q, s.literal(q.dim))
        if s.chance(0.35):
            stretch = one_sided(s, stretch)
        e = half(s, s.value(over(ENERGY, to_power(q.dim, 2))), square(stretch))
    else:
        e = w.scalar(ENERGY, 3)
    s.add("energy", "potential ", Slot("potential", e), ";", data={"what": "potential"})


def one_sided(s: Scope, e: E) -> E:
    """Return a quantity where it is on one side of zero, and zero elsewhere."""
    zero = node("number", "0", value=lambda: 0)
    e = e if s.chance(0.5) else negate(e)
    pair = (zero, e) if s.chance(0.6) else (e, zero)
    return (
        call("max", *pair, dim=e.dim, value=max)
        if s.chance(0.7)
        else call("min", *pair, dim=e.dim, value=min)
    )


def kinetic(s: Scope) -> None:
    """Add a positive kinetic energy."""
    q = generalised(s)
    m = s.value(over(ENERGY, to_power(over(q.dim, TIME), 2)), s.number(0.1, 0.6))
    w = writer(s, "tpq", kinks=s.chance(0.1))
    w.questions = False
    grow = add(s.literal(NUMBER, F("1.4")), call("sin", w.number(0), value=math.sin))
    e = half(s, m, square(der(q)))
    s.add(
        "energy",
        "kinetic ",
        Slot("kinetic", multiply(e, grow) if s.chance(0.6) else e),
        ";",
        data={"what": "kinetic"},
    )


def lagrangian(s: Scope) -> None:
    """Add a Lagrangian with a part that is linear in a velocity."""
    q = generalised(s)
    w = writer(s, "tpqxzu", kinks=False)
    a = w.scalar(over(times(ENERGY, TIME), q.dim), 1)
    e = multiply(a, der(q))
    if s.chance(0.5):
        e = subtract(e, w.scalar(ENERGY, 1))
    what = "potential" if s.chance(0.3) else "lagrangian"
    s.add("energy", f"{what} ", Slot(f"{what}.linear", e), ";", data={"what": what})


def dissipation(s: Scope) -> None:
    """Write a Rayleigh function."""
    q = generalised(s)
    c = s.value(over(times(ENERGY, TIME), to_power(q.dim, 2)), s.number(0.05, 0.4))
    e = half(s, c, square(der(q)))
    r = s.random.random()
    if s.chance(0.2):
        e = half(s, c, square(one_sided(s, der(q))))
    if r < 0.4:
        w = writer(s, kinks=False)
        e = multiply(e, add(s.literal(NUMBER, F("1.3")), call("cos", w.number(0), value=math.cos)))
    elif r < 0.55:
        e = multiply(
            s.value(over(ENERGY, q.dim), s.number(0.05, 0.3)), call("abs", der(q), dim=over(q.dim, TIME))
        )
    s.add("energy", "dissipation ", Slot("dissipation", e), ";", data={"what": "dissipation"})


def point_force(s: Scope) -> None:
    """Write a force vector at a point."""
    n = s.space
    on = s.pick([f for f in s.frames if f.ref != "world"])
    label, name = label_of(s, "F")
    parts: list[str | Slot] = [
        f"force {label}",
        Slot("force.vector", writer(s).vector(n, FORCE, 2)),
        " on ",
        Slot("force.point", on),
    ]
    frames = [f for f in s.frames if f.type == "frame"]
    if on.type == "frame" and s.chance(0.2):
        offset = _arm(s, vector(*(s.literal(LENGTH, s.number(-0.5, 0.5)) for _ in range(n))))
        at = node("frame*point", (on, PRODUCT), " * ", (offset, SIGNED), dim=LENGTH, type="point")
        parts += [" at ", Slot("force.at", at)]
    if s.chance(0.5):
        apart = [f for f in s.frames if f.ref != "world" and f.ref.split(".")[0] != on.ref.split(".")[0]]
        other = s.pick(apart) if apart and s.chance(0.7) else s.pick(s.frames)
        if other.ref != on.ref:
            parts += [" from ", Slot("force.from", other)]
    if s.chance(0.35):
        parts += [" in ", Slot("force.in", s.pick(frames))]
    s.add("force", *parts, ";", name=name, data={"on": "point"})


def _arm(s: Scope, offset: E) -> E:
    """Let a place follow what moves, now and then. Its random numbers are its own: models keep all else."""
    with s.apart(f"arm {offset}"):
        if s.chance(0.4):
            return offset
        moved = multiply(s.value(LENGTH, s.number(0.1, 0.4)), call("tanh", writer(s).scalar(NUMBER, 2)))
        first, *rest = offset.operands
        return vector(add(first, moved), *rest)


def torque(s: Scope) -> None:
    """Write a torque on a frame."""
    n = s.space
    frames = [f for f in s.frames if f.type == "frame"]
    on = s.pick([f for f in frames if f.ref != "world"])
    label, name = label_of(s, "T")
    value = writer(s).scalar(ENERGY, 2) if n == 2 else writer(s).vector(3, ENERGY, 1)
    parts: list[str | Slot] = [f"torque {label}", Slot("torque.value", value), " on ", Slot("torque.on", on)]
    if s.chance(0.3):
        other = s.pick(frames)
        if other.ref != on.ref:
            parts += [" from ", Slot("torque.from", other)]
    if n == 3 and s.chance(0.4):
        parts += [" in ", Slot("torque.in", s.pick(frames))]
    s.add("torque", *parts, ";", name=name)


def element_of_library(s: Scope) -> None:
    """Put in a spring, damper, motor or field of the library."""
    n = s.space
    on = s.pick([f for f in s.frames if f.ref != "world" and f.type == "frame"])
    others = [f for f in s.frames if f.ref.split(".")[0] != on.ref.split(".")[0]]
    frm = s.pick(others) if others else WORLD
    frames = [f for f in s.frames if f.type == "frame"]
    kinds = ["Spring", "Damper", "CentralField", "InverseSquare", "Gravitation", "Coulomb", "LinearDrag", "QuadraticDrag",
             "TorsionSpring", "TorsionDamper", "Motor", "SpeedMotor", "UniformMagneticField"]  # fmt: skip
    kind = s.pick(kinds)
    name = s.fresh("c")
    mods: list[S] = []
    two_ends = kind in ("Spring", "Damper", "CentralField", "InverseSquare", "Gravitation", "Coulomb")
    if two_ends:
        # an end of its own keeps the ends apart at every state
        offset = vector(*(s.literal(LENGTH, x) for x in ((F("1.7"), F("-2.9"), F("3.1"))[:n])))
        anchor = s.fresh("f")
        if frm.type == "point":
            frm = WORLD
        pose = node(
            "frame*",
            (frm, PRODUCT),
            " * ",
            (call("trans", offset, type="pose"), SIGNED),
            dim=LENGTH,
            type="frame",
        )
        s.add("frame", f"frame {anchor} = ", Slot("frame.value", pose), ";", name=anchor)
        end = reference(anchor, "frame", LENGTH, level="q", type="frame")
        on = (
            on
            if on.type == "frame"
            else s.pick([f for f in s.frames if f.type == "frame" and f.ref != "world"])
        )
        mods.append(
            statement("bind", Slot("component.from", end), " -> ", Slot("component.to", on), name="->")
        )
    match kind:
        case "Spring":
            mods += [given(s, "k", dim(1, 0, -2)), given(s, "rest", LENGTH)]
        case "Damper":
            mods += [given(s, "c", dim(1, 0, -1), s.number(0.1, 0.6))]
        case "CentralField":
            mods += [
                given(s, "V0", ENERGY),
                given(s, "r0", LENGTH),
                mod(
                    "n",
                    "=",
                    "modification.parameter",
                    s.literal(NUMBER, s.pick((F(2), F(-1), F(3), F("1.5")))),
                ),
            ]
        case "InverseSquare":
            mods += [given(s, "k", times(ENERGY, LENGTH))]
        case "Gravitation":
            mods += [
                given(s, "m1", dim(1)),
                given(s, "m2", dim(1)),
                mod("G", "=", "modification.parameter", s.literal(dim(-1, 3, -2), s.size())),
            ]
        case "Coulomb":
            q = dim(0, 0, 1, 1)
            mods += [
                mod("q1", "=", "modification.parameter", s.literal(q, s.number(-2, 2) / 100000)),
                mod("q2", "=", "modification.parameter", s.literal(q, s.size() / 100000)),
            ]
        case "LinearDrag":
            mods += [
                mod("to", "=", "modification.frame", on),
                given(s, "c", dim(1, 0, -1), s.number(0.05, 0.5)),
            ]
        case "QuadraticDrag":
            mods += [
                mod("to", "=", "modification.frame", on),
                given(s, "k", dim(1, -1, 0), s.number(0.05, 0.5)),
            ]
        case "UniformMagneticField":
            b = dim(1, 0, -2, -1)
            field = s.literal(b) if n == 2 else vector(*(s.literal(b, s.number(-1, 1)) for _ in range(3)))
            mods += [
                mod("to", "=", "modification.frame", on),
                given(s, "q", dim(0, 0, 1, 1), s.number(0.1, 1)),
                mod("B", "=", "modification.parameter", field),
            ]
        case _ if n == 3 and kind.startswith("Torsion"):
            angles = [q for q in s.coordinates if q.dim == NUMBER]
            if not angles:
                return
            mods += [mod("angle", "=", "modification.input", s.pick(angles))]
            mods += (
                [given(s, "k", ENERGY)]
                if kind == "TorsionSpring"
                else [given(s, "c", times(ENERGY, TIME), s.number(0.05, 0.4))]
            )
        case _:
            on = s.pick([f for f in frames if f.ref != "world"])
            others = [f for f in frames if f.ref != on.ref]
            mods.append(
                statement(
                    "bind",
                    Slot("component.from", s.pick(others)),
                    " -> ",
                    Slot("component.to", on),
                    name="->",
                )
            )
            if kind == "TorsionSpring":
                mods += [
                    given(s, "k", ENERGY),
                    mod(
                        "rest", "=", "modification.parameter", s.literal(NUMBER, s.number(-1, 1), angle=True)
                    ),
                ]
            elif kind == "TorsionDamper":
                mods += [given(s, "c", times(ENERGY, TIME), s.number(0.05, 0.4))]
            else:
                what, d = ("drive_torque", ENERGY) if kind == "Motor" else ("speed", RATE)
                mods.append(mod(what, "=", "modification.input", writer(s).scalar(d, 2)))
                if kind == "SpeedMotor":
                    mods.append(given(s, "gain", times(ENERGY, TIME), s.number(0.1, 0.8)))
                if n == 3 and s.chance(0.5):
                    mods.append(
                        mod(
                            "axis",
                            "=",
                            "modification.structural",
                            vector(*(s.literal(NUMBER, s.number(-1, 1) or F(1)) for _ in range(3))),
                        )
                    )
    condition: list[str | Slot] = (
        [" if ", Slot("component.if", s.pick((node("true", "true", type="boolean", value=lambda: True),)))]
        if s.chance(0.05)
        else []
    )
    s.add(
        "component",
        f"{kind} {name}",
        Seq(tuple(mods), "list"),
        *condition,
        ";",
        name=name,
        data={"class": kind},
    )
