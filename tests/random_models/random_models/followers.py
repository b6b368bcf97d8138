"""Inputs that drive, and states on which the motion does not depend: integrals that are told, filters, filters of filters."""

from __future__ import annotations

import math
from fractions import Fraction

from random_models.bodies import mod
from random_models.coordinates import half, square
from random_models.driven import ask, drive
from random_models.expressions import Writer
from random_models.operators import add, call, der, divide, multiply, subtract
from random_models.scope import Scope
from random_models.tree import (
    ENERGY,
    LENGTH,
    MASS,
    NUMBER,
    SPEED,
    TIME,
    E,
    Seq,
    Slot,
    dim,
    node,
    over,
    reference,
    statement,
)

DRIVEN, FOLLOWED = 0.08, 0.12
"""Of the models."""
F = Fraction


def followers(s: Scope, seed: int) -> None:
    """Write some. Their random numbers are their own: models keep all else."""
    with s.apart(f"followers of {seed}"):
        if s.chance(DRIVEN):
            _driven(s)
        if s.chance(FOLLOWED):
            for _ in range(s.pick((1, 2))):
                s.pick((_integral, _filter, _part, _acting))(s)


def _driven(s: Scope) -> None:
    """A place, or a rate, that follows an input, with what hangs on it by a spring; all the inertias act."""
    by_rate = s.chance(0.3)
    d = SPEED if by_rate else LENGTH
    u, q, x = s.fresh("u"), s.fresh("q"), s.fresh("q")
    s.add(
        "input",
        f'input {"Velocity" if by_rate else "Length"} {u}(interpolation = "spline") = ',
        Slot("input.value", s.literal(d, s.number(-0.5, 0.5))),
        ";",
        name=u,
    )
    start = () if not by_rate else (" = ", Slot("coordinate.value", s.literal(LENGTH, s.number(-0.5, 0.5))))
    s.add("coordinate", f"coordinate Length {q}", *start, ";", name=q, data={"guess": False})
    value = Slot("coordinate.value", s.literal(LENGTH, s.number(-0.5, 0.5)))
    s.add("coordinate", f"coordinate Length {x} = ", value, ";", name=x, data={"guess": False})
    driven, free = (reference(name, "coordinate", LENGTH, level="q") for name in (q, x))
    given: E = reference(u, "input", d, level="u")
    if s.chance(0.5):
        bent = call("sin", divide(given, s.value(d, s.number(0.5, 1))), value=math.sin)
        given = add(given, multiply(s.value(d, s.number(0.1, 0.3)), bent))
    drive(s, der(driven) if by_rate else driven, given)
    for rate in (der(free), add(der(driven), multiply(s.literal(NUMBER, s.number(0.3, 0.8)), der(free)))):
        energy = half(s, s.value(MASS, s.number(0.5, 2)), square(rate))
        s.add("energy", "kinetic ", Slot("kinetic", energy), ";", data={"what": "kinetic"})
    spring = half(s, s.value(dim(1, 0, -2), s.number(1, 5)), square(subtract(free, driven)))
    s.add("energy", "potential ", Slot("potential", spring), ";", data={"what": "potential"})
    if not by_rate:
        ask(s, call("reaction", driven, dim=dim(1, 1, -2), level="qva"))


def _signal(s: Scope) -> E:
    return Writer(s, "qvx", kinks=False).number(1)


def _integral(s: Scope) -> None:
    """Tell integrals over time that nothing else reads."""
    for _ in range(s.pick((1, 2))):
        ask(s, node("integral.time", "integral(", _signal(s), ")", dim=TIME, level="x"))


def _filter(s: Scope) -> None:
    """Let a state follow the motion, and perhaps another one follow that; at times one is told."""
    signal = _signal(s)
    for _ in range(s.pick((1, 2))):
        signal = _lag(s, signal)
    if s.chance(0.4):
        ask(s, signal)


def _lag(s: Scope, signal: E) -> E:
    """Return a state that follows a number."""
    name = s.fresh("x")
    start = Slot("state.value", s.literal(NUMBER, s.number(-1, 1)))
    s.add("state", f"state Real {name} = ", start, ";", name=name, data={"guess": False})
    x = reference(name, "state", NUMBER, level="x")
    right = divide(subtract(signal, x), s.value(TIME, s.number(0.2, 1)))
    s.add("equation", f"equation der({name}) = ", Slot("equation", right), ";", name=name)
    return x


def _acting(s: Scope) -> None:
    """Two states, one behind the other, the last of which acts on the motion: neither only follows it."""
    free = [q for q in s.coordinates if q not in s.driven]
    if not free:
        return
    signal = _signal(s)
    for _ in range(2):
        signal = _lag(s, signal)
    q = s.pick(free)
    force = multiply(s.literal(over(ENERGY, q.dim), s.number(0.2, 1)), signal)
    on = Slot("force.on", q)
    s.add("force", "force ", Slot("force.value", force), " on ", on, ";", data={"on": "scalar"})


def _part(s: Scope) -> None:
    """A part with an integral and a filter of its own, twice in the model."""
    part, name = s.fresh("Meter"), s.fresh("m")
    text = "input Real signal; state Real mean = 0.2; equation der(mean) = (signal - mean)/(0.4 s); output sum = integral(signal - mean);"
    s.file.items.append(statement("class", f"model {part} {text} end {part};", name=part))
    signals = [_signal(s) for _ in range(2)]
    for k, e in enumerate(signals):
        given = Seq((mod("signal", "=", "modification.input", e),), "list")
        told: dict[str, object] = {"class": part}
        s.add("component", f"{part} {name}_{k}", given, ";", name=f"{name}_{k}", data=told)
    for k in range(2):
        ask(s, reference(f"{name}_{k}.sum", "output", TIME, level="x"))
