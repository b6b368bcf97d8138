"""Inputs whose defaults go on with time, and what asks for them: motion, energies, dampings, outputs."""

from __future__ import annotations

import math
import re

from random_models.expressions import Writer
from random_models.operators import add, call, choose, divide, multiply, relation, subtract, vector
from random_models.scope import Scope
from random_models.tree import ENERGY, FORCE, LENGTH, NUMBER, RATE, TIME, Dim, E, Slot, over, reference, times

SHARE, QUIET = 0.1, 0.5
"""Of the models, and of those that do not switch so far, which stay so: only these become Python modules."""
_SWITCHES = re.compile(
    r"\b(if|abs|sign|contact|when|friction|max|min|clamp|deadzone|floor|ceil|mod|div|table|discrete)\b"
)
_TYPES = {FORCE: "Force", LENGTH: "Length", NUMBER: "Real", ENERGY: "Energy"}


def signals(s: Scope, seed: int) -> None:
    """Write some. Their random numbers are their own: models keep all else."""
    with s.apart(f"signals of {seed}"):
        quiet = not any(_SWITCHES.search(one.text()) for one in s.statements)
        if s.chance(QUIET if quiet else SHARE):
            for _ in range(s.pick((1, 2, 2))):
                signal(s, quiet=quiet)


def signal(s: Scope, *, quiet: bool) -> None:
    """Declare an input and use it, by itself or through another input's place, once or twice."""
    d, name = s.pick((FORCE, NUMBER, NUMBER, LENGTH, ENERGY)), s.fresh("u")
    option = s.pick(("", "", '(interpolation = "step")', '(interpolation = "spline")'))
    s.add(
        "input",
        f"input {_TYPES[d]} {name}{option} = ",
        Slot("input.value", wave(s, d, quiet)),
        ";",
        name=name,
    )
    u = reference(name, "input", d, level="u")
    number = u if d == NUMBER else divide(u, s.value(d))
    for use in s.random.sample((_force, _damping, _output, _state), s.pick((1, 2, 2))):
        use(s, number)
    if s.chance(0.6):
        _output(s, number)


def wave(s: Scope, d: Dim, quiet: bool) -> E:
    """Return a function of time that goes on changing; ``quiet``: smoothly."""
    t = reference("time", "time", TIME, level="t")
    size = s.value(d, s.number(0.2, 1.5))
    kind = s.pick(("wave", "wave", "ramp", "pulse", "swing", "wave" if quiet else "table"))
    if kind == "wave":
        return multiply(size, call("sin", multiply(s.value(RATE, s.number(1, 6)), t), value=math.sin))
    if kind == "swing":
        inner = call("cos", multiply(s.literal(RATE, s.number(1, 6)), t), value=math.cos)
        return add(size, multiply(s.literal(d, s.number(-1, 1)), inner))
    if kind == "pulse":
        x = divide(subtract(t, s.literal(TIME, s.number(0.2, 0.8))), s.value(TIME, s.number(0.1, 0.4)))
        return multiply(size, divide(s.literal(NUMBER, s.number(1, 2)), call("cosh", x, value=math.cosh)))
    if kind == "table":
        points = vector(
            *(s.literal(TIME, x) for x in (s.number(0, 0.2), s.number(0.3, 0.6), s.number(0.7, 1)))
        )
        heights = vector(*(s.literal(d, s.number(-1, 1)) for _ in range(3)))
        return call("table", t, points, heights, dim=d)
    if s.chance(0.4) and not quiet:
        bend = s.literal(TIME, s.number(0.2, 0.8))
        later = multiply(size, divide(subtract(t, bend), s.literal(TIME, s.size())))
        return choose(relation("<", t, bend), multiply(s.literal(NUMBER, s.number(-1, 1)), later), later)
    return multiply(s.literal(over(d, TIME), s.number(-1.5, 1.5)), t)


def _force(s: Scope, u: E) -> None:
    free = [q for q in s.coordinates if q not in s.driven]
    if not free:
        return _output(s, u)
    q = s.pick(free)
    value = multiply(s.literal(over(ENERGY, q.dim), s.number(0.2, 1.2)), u)
    if s.chance(0.3):
        value = multiply(value, call("cos", Writer(s, "qv", kinks=False).number(0), value=math.cos))
    s.add(
        "force", "force ", Slot("force.value", value), " on ", Slot("force.on", q), ";", data={"on": "scalar"}
    )
    return None


def _damping(s: Scope, u: E) -> None:
    free = [q for q in s.coordinates if q not in s.driven]
    if not free:
        return _output(s, u)
    q = s.pick(free)
    rate = over(q.dim, TIME)
    size = s.literal(over(over(ENERGY, TIME), times(rate, rate)), s.number(0.1, 0.6))
    c = multiply(size, multiply(u, u))
    s.add("damping", "damping ", Slot("damping.value", c), " on ", Slot("damping.on", q), ";")
    return None


def _output(s: Scope, u: E) -> None:
    name = s.fresh("o")
    e = u if s.chance(0.4) else multiply(u, Writer(s, "tqvx", kinks=False).number(0))
    s.add("output", f"output {name} = ", Slot("output.value", e), ";", name=name)


def _state(s: Scope, u: E) -> None:
    """Let a state follow the input."""
    name = s.fresh("x")
    s.add("state", f"state Real {name} = ", Slot("state.value", s.literal(NUMBER, s.number(-1, 1))), ";", name=name,
          data={"guess": False})  # fmt: skip
    x = reference(name, "state", NUMBER, level="x")
    right = divide(subtract(u, x), s.value(TIME, s.number(0.2, 1)))
    s.add("equation", f"equation der({name}) = ", Slot("equation", right), ";", name=name)
    _output(s, x)
