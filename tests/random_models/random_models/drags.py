"""Forces on what moves whose factor has one sign, or either: drags, and what drives at times; dampers that give."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

from random_models.bends import body
from random_models.coordinates import half, square
from random_models.operators import add, call, der, divide, multiply, negate, power, subtract
from random_models.scope import Scope, rare
from random_models.tree import (
    ENERGY,
    LENGTH,
    NUMBER,
    SPEED,
    TIME,
    E,
    Slot,
    dim,
    node,
    over,
    reference,
    times,
    to_power,
)

SHARE = 0.1
"""Of the models."""
F = Fraction


@rare(SHARE)
def drags(s: Scope) -> None:
    """Write bodies with such forces."""
    x, y = body(s, s.number(-0.8, 0.8), s.number(-1, 1)), body(s, s.number(-0.8, 0.8), s.number(-1, 1))
    spring = half(s, s.value(dim(1, 0, -2), s.number(1, 6)), add(square(x), square(y)))
    s.add("energy", "potential ", Slot("potential", spring), ";", data={"what": "potential"})
    for _ in range(s.pick((1, 1, 2, 3))):
        on = x if s.chance(0.6) else subtract(x, multiply(s.literal(NUMBER, s.number(0.2, 1)), y))
        if s.chance(0.25):  # a belt that is given by time
            belt = multiply(s.literal(SPEED, s.number(-1, 1)), reference("time", "time", TIME, level="t"))
            on = subtract(on, belt)
        kind = s.weighted(((5, _force), (1.5, _damper), (1.5, _dissipation)))
        kind(s, on, x, y)


def _force(s: Scope, on: E, x: E, y: E) -> None:
    rate = der(on)
    size = s.value(over(times(ENERGY, TIME), to_power(on.dim, 2)), s.number(0.05, 0.4))
    speed = divide(rate, s.literal(SPEED, s.number(0.5, 2)))
    along = s.weighted(((4, speed), (1, multiply(call("abs", speed, value=abs), speed)), (1, _cubed(speed)),
                        (1, call("tanh", speed, value=math.tanh))))  # fmt: skip
    force = multiply(size, multiply(s.literal(SPEED, F(1)), multiply(_factor(s, x, y), along)))
    force = force if s.chance(0.2) else negate(force)
    name = s.fresh("F")
    s.add(
        "force",
        f"force {name}: ",
        Slot("force.value", force),
        " on ",
        Slot("force.on", on),
        ";",
        name=name,
        data={"on": "scalar"},
    )
    s.powers.append(name)
    out = s.fresh("o")
    s.add(
        "output",
        f"output {out} = ",
        Slot("output.value", call("power", reference(name, "load"), level="qv")),
        ";",
        name=out,
    )


def _damper(s: Scope, on: E, x: E, y: E) -> None:
    c = multiply(
        s.value(over(times(ENERGY, TIME), to_power(on.dim, 2)), s.number(0.05, 0.4)), _factor(s, x, y)
    )
    s.add("damping", "damping ", Slot("damping.value", c), " on ", Slot("damping.on", on), ";")


def _dissipation(s: Scope, on: E, x: E, y: E) -> None:
    c = multiply(
        s.value(over(times(ENERGY, TIME), to_power(on.dim, 2)), s.number(0.05, 0.4)), _factor(s, x, y)
    )
    s.add(
        "energy",
        "dissipation ",
        Slot("dissipation", half(s, c, square(der(on)))),
        ";",
        data={"what": "dissipation"},
    )


def _cubed(e: E) -> E:
    three = node("number", "3", value=lambda: 3)
    return power(e, three, F(3))


def _positive(s: Scope, x: E, y: E) -> E:
    """Return a number that is positive wherever the bodies are and however they move."""
    q = s.pick((x, y))
    place, speed = (
        divide(q, s.literal(LENGTH, s.number(0.4, 1.2))),
        divide(der(q), s.literal(SPEED, s.number(0.5, 2))),
    )
    e = s.pick((place, place, speed))
    kind = s.pick(("square", "square", "abs", "exp", "cosh", "number", "energy"))
    if kind == "square":
        return square(e)
    if kind == "number":
        return s.literal(NUMBER, s.number(0.2, 1.2))
    if kind == "energy":
        return divide(call("kinetic_energy", dim=ENERGY, level="qv"), s.literal(ENERGY, s.number(0.5, 2)))
    functions: dict[str, Callable[[float], float]] = {"abs": abs, "exp": math.exp, "cosh": math.cosh}
    function = functions[kind]
    return call(kind, call("tanh", e, value=math.tanh) if kind == "exp" else e, value=function)


def _factor(s: Scope, x: E, y: E) -> E:
    """Return a factor of one sign, or the difference of two, which may have either."""
    a, b = _positive(s, x, y), _positive(s, x, y)
    kind = s.pick(("one", "sum", "difference", "difference", "less", "max", "product"))
    match kind:
        case "sum":
            return add(a, b)
        case "difference":
            return subtract(a, b)
        case "less":
            return add(a, negate(b))
        case "max":
            return call(s.pick(("max", "min")), a, b, value=max)
        case "product":
            return multiply(a, b)
    return a
