"""A rotation of its own that starts anywhere: energies as formulas of its rate, frames turned by quarters and by much."""

from __future__ import annotations

import math
from fractions import Fraction

from random_models.operators import add, call, der, element, multiply, vector
from random_models.quantities import quantity
from random_models.scope import Scope
from random_models.tree import (
    ENERGY,
    INERTIA,
    LENGTH,
    MASS,
    NUMBER,
    PRODUCT,
    RATE,
    SIGNED,
    SPEED,
    E,
    Slot,
    node,
    reference,
)

SHARE = 0.25
"""Of the models in space."""
F = Fraction


def turns(s: Scope, seed: int) -> None:
    """Write what turns. Its random numbers are its own: models keep all else."""
    if s.space != 3:
        return
    with s.apart(f"turns of {seed}"):
        if s.chance(SHARE):
            _turns(s)


def _turns(s: Scope) -> None:
    name = s.fresh("r")
    s.add("rotation", f"coordinate Rotation {name} = ", Slot("coordinate.value", _pose(s)), ";", name=name)
    rates = vector(*(s.literal(RATE, s.number(-1.5, 1.5)) for _ in range(3)))
    s.add("rotation", f"initial der({name}) = ", Slot("initial.rate", rates), ";", name=f"der({name})")
    r = reference(name, "rotation", NUMBER, (4,), level="q", type="pose")
    w = der(r)
    w = E(w.kind, w.parts, RATE, (3,), w.level)
    f = _frame(s, node("frame*", (reference("world", "world", LENGTH, type="frame"), PRODUCT), " * ", (r, SIGNED),
                       dim=LENGTH, type="frame"))  # fmt: skip
    g = _frame(s, node("frame*", (f, PRODUCT), " * ", (_pose(s), SIGNED), dim=LENGTH, type="frame"))
    size = call(
        "diag",
        vector(*(s.literal(INERTIA, s.number(0.2, 0.35)) for _ in range(3))),
        dim=INERTIA,
        shape=(3, 3),
    )
    if s.chance(0.6):
        spun = node(
            "matrix*",
            (size, PRODUCT),
            "*",
            (w, SIGNED),
            dim=(F(1), F(2), F(-1), F(0)),
            shape=(3,),
            binding=PRODUCT,
        )
        half = node("number", "0.5", value=lambda: 0.5)
        energy = multiply(half, call("dot", w, spun, dim=ENERGY))
        s.add("energy", "kinetic ", Slot("kinetic", energy), ";", data={"what": "kinetic"})
    else:
        s.add("inertia", "inertia ", Slot("inertia.value", size), " on ", Slot("inertia.on", f), ";")
    if s.chance(0.6):
        offset = vector(*(s.literal(LENGTH, s.number(-0.4, 0.4)) for _ in range(3)))
        at = node("frame*point", (g, PRODUCT), " * ", (offset, SIGNED), dim=LENGTH, type="point")
        s.add(
            "mass",
            "mass ",
            Slot("mass.value", s.value(MASS, s.number(0.3, 1))),
            " at ",
            Slot("mass.at", at),
            ";",
        )
    way = vector(*(s.literal(NUMBER, s.number(-1, 1)) for _ in range(3)))
    seen = call("direction", g, way, shape=(3,), level="q")
    fall = multiply(s.value(ENERGY, s.number(0.2, 1)), element(_named(s, seen), s.random.randint(1, 3)))
    if s.chance(0.4):
        entry = element(reference(name, "rotation", NUMBER, (4,), level="q"), s.random.randint(1, 4))
        fall = add(fall, multiply(s.value(ENERGY, s.number(0.2, 1)), multiply(entry, entry)))
    s.add("energy", "potential ", Slot("potential", fall), ";", data={"what": "potential"})
    other = s.pick([x for x in s.frames if x.type == "frame"])
    for e in (
        call("angvel", g, f, dim=RATE, shape=(3,), level="qv"),
        call("angvel", f, other, dim=RATE, shape=(3,), level="qv"),
        call("vel", other, g, dim=SPEED, shape=(3,), level="qv"),
        call("local", g, other, dim=LENGTH, shape=(3,), level="q"),
    ):
        _output(s, e)


def _frame(s: Scope, value: E) -> E:
    name = s.fresh("f")
    s.add("frame", f"frame {name} = ", Slot("frame.value", value), ";", name=name)
    return reference(name, "frame", LENGTH, level="q", type="frame")


def _named(s: Scope, e: E) -> E:
    name = s.fresh("l")
    s.add("let", f"let {name} = ", Slot("let.value", e), ";", name=name)
    return reference(name, "let", e.dim, e.shape, "".join(e.level))


def _output(s: Scope, e: E) -> None:
    name = s.fresh("o")
    s.add("output", f"output {name} = ", Slot("output.value", e), ";", name=name)


def _angle(s: Scope) -> E:
    """Return an angle of any size, or one whose sine is known exactly."""
    if s.chance(0.5):
        k = s.pick((-5, -4, -3, -2, 2, 3, 4, 5, 7, 8))
        return node("quantity", f"{30 * k} deg", binding=SIGNED if k < 0 else 9, value=lambda: k * math.pi / 6,
                    data=F(math.pi) * k / 6)  # fmt: skip
    return quantity(s.number(-3.1, 3.1), NUMBER, s.random, angle=True)


def _pose(s: Scope) -> E:
    kind = s.pick(("about", "about", "turns", "quat"))
    if kind == "about":
        axis = vector(*(s.literal(NUMBER, s.number(-1, 1) or F(1)) for _ in range(3)))
        return call("axis_angle", axis, _angle(s), type="pose")
    if kind == "quat":
        parts = (
            s.literal(NUMBER, s.number(-0.6, 0.6)),
            *(s.literal(NUMBER, s.number(-1, 1) or F(1)) for _ in range(3)),
        )
        return call("quat", *parts, type="pose")
    first, second = s.random.sample(("rotx", "roty", "rotz"), 2)
    return node("pose*", (call(first, _angle(s), type="pose"), PRODUCT), " * ", (call(second, _angle(s), type="pose"), SIGNED),
                binding=PRODUCT, type="pose")  # fmt: skip
