"""Fields of a place and their derivatives: gradients, divergences, curls and Laplacians as forces, coefficients and answers.

Each derivative knows its formula, found by hand, which a twin writes in its place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from math import cos, sin

from random_models.coordinates import half
from random_models.driven import ask
from random_models.operators import add, call, der, divide, element, multiply, negate, subtract, two, vector
from random_models.quantities import quantity
from random_models.scope import Scope, rare
from random_models.tree import (
    ENERGY,
    FORCE,
    LENGTH,
    MASS,
    NUMBER,
    SPEED,
    Dim,
    E,
    Slot,
    dim,
    over,
    reference,
    statement,
    times,
)

SHARE = 0.06
"""Of the models."""
STIFFNESS = dim(1, 0, -2)
F = Fraction
Written = Callable[..., E]
Answer = Callable[[E], E]


@rare(SHARE)
def fields(s: Scope) -> None:
    """Write a point that moves in fields."""
    n, name = s.pick((2, 3)), s.fresh("q")
    places = (s.literal(LENGTH, s.number(-0.6, 0.6)) for _ in range(n))
    start = Slot("coordinate.value", vector(*places))
    s.add("coordinate", f"coordinate Length {name}[{n}] = ", start, ";", name=name, data={"guess": False})
    rates = Slot("initial.rate", vector(*(s.literal(SPEED, s.number(-0.6, 0.6)) for _ in range(n))))
    s.add("initial", f"initial der({name}) = ", rates, ";", name=f"der({name})", data={"guess": False})
    r = reference(name, "coordinate", LENGTH, (n,), level="q")
    square = call("dot", der(r), der(r), dim=times(SPEED, SPEED))
    energy = half(s, s.value(MASS, s.number(0.5, 2)), square)
    s.add("energy", "kinetic ", Slot("kinetic", energy), ";", data={"what": "kinetic"})
    scalar, flow, line = _scalar(s, n), _flow(s, n), _line(s)
    _push(s, r, negate(scalar["grad"](r)), n)
    if n == 3 and s.chance(0.6):
        _push(s, r, multiply(s.literal(LENGTH, s.number(0.1, 0.5)), flow["curl"](r)), n)
    if s.chance(0.5):
        size = multiply(s.literal(dim(0, 0, 1), s.number(0.1, 0.4)), flow["div"](r))
        value = multiply(negate(size), der(element(r, 1)))
        at = Slot("force.on", element(r, 1))
        s.add("force", "force ", Slot("force.value", value), " on ", at, ";", data={"on": "scalar"})
    if s.chance(0.5):
        value = negate(line(element(r, n)))
        at = Slot("force.on", element(r, n))
        s.add("force", "force ", Slot("force.value", value), " on ", at, ";", data={"on": "scalar"})
    told = [*scalar.values(), *flow.values()]
    for make in s.random.sample(told, min(len(told), 4)):
        ask(s, make(r))


def _push(s: Scope, r: E, value: E, n: int) -> None:
    """A force on each of the coordinates."""
    name = s.fresh("w")
    s.add("let", f"let {name} = ", Slot("let.value", value), ";", name=name)
    whole = reference(name, "let", FORCE, (n,), level="q")
    for i in range(1, n + 1):
        at = Slot("force.on", element(r, i))
        s.add(
            "force", "force ", Slot("force.value", element(whole, i)), " on ", at, ";", data={"on": "scalar"}
        )


def _function(s: Scope, formals: str, body: E) -> str:
    """Write a function of the file."""
    name = s.fresh("f")
    item = statement(
        "function", f"function {name}({formals}) = ", Slot("function.body", body), ";", name=name
    )
    s.file.items.append(item)
    return name


def _derivative(
    what: str, f: str, d: Dim, shape: tuple[int, ...], arguments: tuple[E, ...], written: Written
) -> Answer:
    """Return what makes a derivative of a field at a place; its data is the formula that a twin writes."""
    return lambda r: replace(
        call(f"{what}", reference(f, "function"), r, *arguments, dim=d, shape=shape), data=written
    )


def _exactly(s: Scope, value: Fraction) -> E:
    """Write a number by which two formulas mean the same: not in a unit that holds an angle, which would round it."""
    e = s.literal(NUMBER, value)
    return e if e.data == value else quantity(value, NUMBER)


def _formal(name: str, d: Dim) -> E:
    return reference(name, "formal", d)


def _scalar(s: Scope, n: int) -> dict[str, Answer]:
    """An energy of a place: c (x^2/2 + k x y) + F l sin(y/l), in space c z^2/4 more."""
    c, k = s.value(STIFFNESS, s.number(1, 4)), s.literal(NUMBER, s.number(-0.6, 0.6))
    force, size = s.literal(FORCE, s.number(0.3, 1)), s.literal(LENGTH, s.number(0.3, 0.9))
    r, a, b = _formal("r", LENGTH), _formal("a", STIFFNESS), _formal("b", NUMBER)
    r = replace(r, shape=(n,))
    x, y = element(r, 1), element(r, 2)
    bent = multiply(multiply(force, size), call("sin", divide(y, size), value=sin))
    body = add(multiply(a, add(half(s, multiply(x, x)), multiply(b, multiply(x, y)))), bent)
    if n == 3:
        body = add(
            body, multiply(multiply(_exactly(s, F("0.25")), a), multiply(element(r, 3), element(r, 3)))
        )
    f = _function(s, f"Length r[{n}], Stiffness a, Real b", body)

    def parts(p: E) -> tuple[E, ...]:
        return tuple(element(p, i) for i in range(1, n + 1))

    def gradient(p: E, c: E, k: E) -> E:
        x, y, *z = parts(p)
        slope = multiply(force, call("cos", divide(y, size), value=cos))
        up = [multiply(multiply(_exactly(s, F("0.5")), c), v) for v in z]
        return vector(multiply(c, add(x, multiply(k, y))), add(multiply(c, multiply(k, x)), slope), *up)

    def laplacian(p: E, c: E, k: E) -> E:
        bend = multiply(divide(force, size), call("sin", divide(element(p, 2), size), value=sin))
        whole = multiply(c, _exactly(s, F("1.5"))) if n == 3 else c
        return subtract(whole, bend)

    def rise(p: E, c: E, k: E) -> E:
        square = multiply(size, size)
        bend = multiply(divide(force, square), call("cos", divide(element(p, 2), size), value=cos))
        zero = s.literal(over(FORCE, multiply(size, size).dim), F(0))
        return vector(zero, negate(bend), *([zero] if n == 3 else []))

    name = reference(f, "function")
    of = call("laplacian", name, r, a, b, dim=STIFFNESS)
    g = _function(s, f"Length r[{n}], Stiffness a, Real b", of)
    return {
        "grad": _derivative("grad", f, FORCE, (n,), (c, k), gradient),
        "laplacian": _derivative("laplacian", f, STIFFNESS, (), (c, k), laplacian),
        "rise": _derivative("grad", g, over(STIFFNESS, LENGTH), (n,), (c, k), rise),
    }


def _flow(s: Scope, n: int) -> dict[str, Answer]:
    """A force of a place: c {x y/l, k y, x z/l}."""
    c, k = s.value(STIFFNESS, s.number(0.5, 2)), s.literal(NUMBER, s.number(-0.6, 0.6))
    size = s.literal(LENGTH, s.number(0.5, 1.5))
    r, a, b = replace(_formal("r", LENGTH), shape=(n,)), _formal("a", STIFFNESS), _formal("b", NUMBER)
    x, y = element(r, 1), element(r, 2)
    rows = [divide(multiply(multiply(a, x), y), size), multiply(multiply(a, b), y)]
    if n == 3:
        rows.append(divide(multiply(multiply(a, x), element(r, 3)), size))
    f = _function(s, f"Length r[{n}], Stiffness a, Real b", vector(*rows))
    zero = s.literal(STIFFNESS, F(0))

    def steep(c: E, v: E) -> E:
        return divide(multiply(c, v), size)

    def matrix(p: E, c: E, k: E) -> E:
        x, y = element(p, 1), element(p, 2)
        if n == 2:
            return vector(vector(steep(c, y), steep(c, x)), vector(zero, multiply(c, k)), kind="matrix")
        top, middle = vector(steep(c, y), steep(c, x), zero), vector(zero, multiply(c, k), zero)
        return vector(top, middle, vector(steep(c, element(p, 3)), zero, steep(c, x)), kind="matrix")

    def divergence(p: E, c: E, k: E) -> E:
        total = add(steep(c, element(p, 2)), multiply(c, k))
        return add(total, steep(c, element(p, 1))) if n == 3 else total

    def curl(p: E, c: E, k: E) -> E:
        last = negate(steep(c, element(p, 1)))
        return vector(zero, negate(steep(c, element(p, 3))), last) if n == 3 else last

    return {
        "grad": _derivative("grad", f, STIFFNESS, (n, n), (c, k), matrix),
        "div": _derivative("div", f, STIFFNESS, (), (c, k), divergence),
        "curl": _derivative("curl", f, STIFFNESS, (3,) if n == 3 else (), (c, k), curl),
    }


def _line(s: Scope) -> Answer:
    """The slope of an energy of one length, E sin(x/l)^2."""
    size, energy = s.literal(LENGTH, s.number(0.5, 1.5)), s.value(ENERGY, s.number(0.3, 1))
    x, e = _formal("x", LENGTH), _formal("e", ENERGY)
    wave = call("sin", divide(x, size), value=sin)
    f = _function(s, "Length x, Energy e", multiply(e, multiply(wave, wave)))

    def slope(p: E, e: E) -> E:
        twice = call("sin", divide(multiply(two(), p), size), value=sin)
        return multiply(divide(e, size), twice)

    return _derivative("grad", f, FORCE, (), (energy,), slope)
