"""Bends where something is held, and ties: friction on what bends, guides with corners, ends that hit at one instant."""

from __future__ import annotations

import math
from fractions import Fraction

from random_models.coordinates import half, square
from random_models.expressions import Writer
from random_models.operators import add, call, der, multiply, subtract
from random_models.scope import Scope, rare
from random_models.tree import (
    ACCELERATION,
    FORCE,
    INERTIA,
    LENGTH,
    MASS,
    NUMBER,
    SPEED,
    TIME,
    Dim,
    E,
    Slot,
    node,
    over,
    reference,
)

SHARE = 0.08
"""Of the models."""
F = Fraction


@rare(SHARE)
def bends(s: Scope) -> None:
    """Write a body that rubs on a belt, a bead on a bent wire, or a bar that falls flat."""
    s.weighted(((2, _belt), (2, _wire), (1, _flat), (1, _floor)))(s)


def _belt(s: Scope) -> None:
    """A body on a belt that starts, or whose way doubles at a place."""
    x = body(s, s.number(-0.2, -0.05), s.pick((F(0), s.number(0.5, 1.2))))
    limit = s.value(FORCE, s.number(0.5, 3))
    on: E
    if s.chance(0.6):
        late = subtract(reference("time", "time", TIME, level="t"), s.literal(TIME, s.number(0.05, 0.25)))
        zero = node("number", "0", value=lambda: 0)
        moved = multiply(s.literal(SPEED, s.number(0.3, 2)), call("max", zero, late, dim=TIME))
        on = subtract(x, moved)
    else:
        name = s.pick(("abs", "clamp", "deadzone"))
        width = s.literal(LENGTH, s.number(0.01, 0.04))
        more = {"abs": (), "clamp": (s.literal(LENGTH, F("-0.03")), width), "deadzone": (width,)}[name]
        on = add(x, multiply(s.literal(NUMBER, s.number(0.2, 0.6)), call(name, x, *more, dim=LENGTH)))
    name = s.fresh("R")
    s.add(
        "friction",
        f"friction {name}: ",
        Slot("friction.value", limit),
        " on ",
        Slot("friction.on", on),
        ";",
        name=name,
    )
    s.powers.append(name)
    out = s.fresh("o")
    asked = call("power", reference(name, "load"), level="qva")
    s.add("output", f"output {out} = ", Slot("output.value", asked), ";", name=out)


def _floor(s: Scope) -> None:
    """A body that stands on a floor that moves, and bends in time or place."""
    x, y = coordinate(s, s.number(-0.2, -0.05), s.pick((F(0), s.number(0.5, 1.2)))), coordinate(s, F(0), F(0))
    mass = s.value(MASS, s.number(0.5, 2))
    for q in (x, y):
        energy = half(s, mass, square(der(q)))
        s.add("energy", "kinetic ", Slot("kinetic", energy), ";", data={"what": "kinetic"})
    weight = multiply(multiply(mass, s.literal(ACCELERATION, F("9.81"))), y)
    s.add("energy", "potential ", Slot("potential", weight), ";", data={"what": "potential"})
    late = subtract(reference("time", "time", TIME, level="t"), s.literal(TIME, s.number(0.05, 0.25)))
    zero = node("number", "0", value=lambda: 0)
    moved = s.pick(
        (
            multiply(s.literal(SPEED, s.number(0.3, 2)), call("max", zero, late, dim=TIME)),
            multiply(s.literal(SPEED, s.number(0.3, 2)), call("abs", late, dim=TIME)),
            multiply(s.literal(NUMBER, s.number(0.2, 0.6)), call("abs", x, dim=LENGTH)),
        )
    )
    name, rough = s.fresh("C"), s.literal(NUMBER, s.number(0.05, 0.4))
    s.add(
        "contact",
        f"contact {name}: ",
        Slot("contact.gap", y),
        " friction ",
        Slot("contact.friction", rough),
        " along ",
        Slot("contact.along", der(subtract(x, moved))),
        ";",
        name=name,
    )


def _wire(s: Scope) -> None:
    """A bead on a wire with a corner, beyond which it goes on."""
    slope, way = s.number(0.2, 0.8), s.number(0.05, 0.15)
    name = s.pick(("abs", "max", "min"))
    zero = node("number", "0", value=lambda: 0)
    start = {"abs": slope * way, "max": F(0), "min": -slope * way}[name]
    rise = {"abs": -slope, "max": F(0), "min": slope}[name]
    rate = s.number(0.6, 1.2)
    x, y = body(s, -way, rate), body(s, start, rise * rate)
    bent = call("abs", x, dim=LENGTH) if name == "abs" else call(name, zero, x, dim=LENGTH)
    wire = s.fresh("h")
    s.add(
        "constraint",
        f"constraint {wire}: ",
        Slot("constraint.left", y),
        " = ",
        Slot("constraint.right", multiply(s.literal(NUMBER, slope), bent)),
        ";",
        name=wire,
    )
    out = s.fresh("o")
    force = call("multiplier", reference(wire, "constraint"), dim=FORCE, level="qva")
    s.add("output", f"output {out} = ", Slot("output.value", force), ";", name=out)


def _flat(s: Scope) -> None:
    """A bar that falls flat: both of its ends hit at one instant."""
    y, turned = coordinate(s, s.number(0.01, 0.05, 3), F(0), LENGTH), coordinate(s, F(0), F(0), NUMBER)
    mass, inertia = s.value(MASS, s.number(0.5, 2)), s.value(INERTIA, s.number(0.05, 0.4))
    for energy in (half(s, mass, square(der(y))), half(s, inertia, square(der(turned)))):
        s.add("energy", "kinetic ", Slot("kinetic", energy), ";", data={"what": "kinetic"})
    weight = multiply(multiply(mass, s.literal(ACCELERATION, F("9.81"))), y)
    s.add("energy", "potential ", Slot("potential", weight), ";", data={"what": "potential"})
    arm = multiply(s.value(LENGTH, s.number(0.2, 0.6)), call("sin", turned, value=math.sin))
    rebound = s.literal(NUMBER, s.number(0.02, 0.15)) if s.chance(0.6) else None
    for gap in (subtract(y, arm), add(y, arm)):
        parts: list[str | Slot] = [f"contact {s.fresh('C')}: ", Slot("contact.gap", gap)]
        parts += [" restitution ", Slot("contact.restitution", rebound)] if rebound is not None else []
        s.add("contact", *parts, ";")


def coordinate(s: Scope, place: Fraction, rate: Fraction, d: Dim = LENGTH) -> E:
    """Write a coordinate with what is known of its start, and return it."""
    name = s.fresh("q")
    kind = "Length" if d == LENGTH else "Angle"
    value = Slot("coordinate.value", s.literal(d, place, angle=d == NUMBER))
    s.add("coordinate", f"coordinate {kind} {name} = ", value, ";", name=name, data={"guess": False})
    value = Slot("initial.rate", s.literal(over(d, TIME), rate))
    s.add("initial", f"initial der({name}) = ", value, ";", name=f"der({name})", data={"guess": False})
    return reference(name, "coordinate", d, level="q")


def body(s: Scope, place: Fraction, rate: Fraction) -> E:
    """Write a body with a mass, a push, and what is known of its start."""
    q = coordinate(s, place, rate)
    mass = s.value(MASS, s.number(0.5, 2))
    s.add("energy", "kinetic ", Slot("kinetic", half(s, mass, square(der(q)))), ";", data={"what": "kinetic"})
    push = Writer(s, "tqxv", kinks=False).scalar(FORCE, 1)
    s.add(
        "force", "force ", Slot("force.value", push), " on ", Slot("force.on", q), ";", data={"on": "scalar"}
    )
    return q
