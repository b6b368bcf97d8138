"""Laws that were measured: forces known by points, with their energies and sums, and powers whose exponents were fitted."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import accumulate

from random_models.coordinates import half, square
from random_models.driven import ask
from random_models.operators import add, call, der, divide, multiply, negate, subtract, vector
from random_models.scope import Scope
from random_models.tree import (
    ATOM,
    ENERGY,
    FORCE,
    LENGTH,
    MASS,
    NUMBER,
    POWER_OF,
    SIGNED,
    SPEED,
    SUM,
    Dim,
    E,
    Slot,
    dim,
    node,
    over,
    reference,
    times,
)

SHARE = 0.06
"""Of the models."""
F = Fraction
_EXPONENTS = tuple(map(F, ("0.4", "0.75", "1.3", "1.4", "1.5", "1.8", "-0.6", "-1.4")))


def measured(s: Scope, seed: int) -> None:
    """Write a mass on a line with some of these laws. Its random numbers are its own: models keep all else."""
    with s.apart(f"measured of {seed}"):
        if s.chance(SHARE):
            q = _mass(s)
            for law in s.random.sample((_spring, _load, _gas, _drag), s.pick((1, 1, 2))):
                law(s, q)


def _mass(s: Scope) -> E:
    name = s.fresh("q")
    place, rate = Slot("coordinate.value", s.literal(LENGTH, s.number(-0.3, 0.3))), s.number(-0.6, 0.6)
    s.add("coordinate", f"coordinate Length {name} = ", place, ";", name=name, data={"guess": False})
    s.add(
        "initial",
        f"initial der({name}) = ",
        Slot("initial.rate", s.literal(SPEED, rate)),
        ";",
        name=f"der({name})",
        data={"guess": False},
    )
    q = reference(name, "coordinate", LENGTH, level="q")
    energy = half(s, s.value(MASS, s.number(0.5, 2)), square(der(q)))
    s.add("energy", "kinetic ", Slot("kinetic", energy), ";", data={"what": "kinetic"})
    energy = half(s, s.value(dim(1, 0, -2), s.number(1, 4)), square(q))
    s.add("energy", "potential ", Slot("potential", energy), ";", data={"what": "potential"})
    return q


def _curve(s: Scope, x: E, d: Dim) -> E:
    """Return a table of three to six points, at uneven distances, which are written where they stand or are parameters."""
    n = s.pick((3, 4, 5, 6))
    steps = (s.number(0.1, 0.6) for _ in range(n - 1))
    places = accumulate(steps, initial=s.number(-0.8, -0.1))
    columns = [(x.dim, list(places)), (d, [s.number(-1, 1) for _ in range(n)])]
    return call("table", x, *(_column(s, *column) for column in columns), dim=d)


def _column(s: Scope, d: Dim, numbers: list[Fraction]) -> E:
    written = vector(*(s.literal(d, x) for x in numbers))
    if s.chance(0.5):
        return written
    name = s.fresh("p")
    s.add(
        "parameter",
        f"structural parameter {name}[{len(numbers)}] = ",
        Slot("parameter.value", written),
        ";",
        name=name,
    )
    return reference(name, "parameter", d, (len(numbers),), level="p")


def _integral(body: E, variable: E, lower: E, upper: E) -> E:
    return node(
        "integral.over",
        "integral(",
        body,
        f" for {variable.ref} in ",
        (lower, SUM),
        ":",
        (upper, SUM),
        ")",
        dim=times(body.dim, variable.dim),
    )


def _bound(s: Scope, d: Dim) -> E:
    return reference(s.fresh("s"), "bound", d)


def _spring(s: Scope, q: E) -> None:
    """A force known by points, told as its energy or as it is; the energy is asked for, too."""
    x = _bound(s, LENGTH)
    curve = _curve(s, x, FORCE)
    energy = _integral(curve, x, s.literal(LENGTH, F(0)), q)
    if s.chance(0.6):
        s.add("energy", "potential ", Slot("potential", energy), ";", data={"what": "potential"})
    else:
        _push(s, q, negate(curve.with_operands((q, *curve.operands[1:]))))
    ask(s, energy)


def _load(s: Scope, q: E) -> None:
    """A load along a beam, weighed by the shape of its bending, which lies still or moves with the mass."""
    x, length = _bound(s, LENGTH), s.value(LENGTH, s.number(0.6, 1.5))
    at = subtract(x, multiply(s.literal(NUMBER, s.number(0.2, 0.8)), q)) if s.chance(0.6) else x
    shape = square(divide(x, length)) if s.chance(0.5) else divide(x, length)
    body = multiply(_curve(s, at, over(FORCE, LENGTH)), shape)
    whole = _integral(body, x, s.literal(LENGTH, F(0)), length)
    _push(s, q, whole)
    ask(s, whole)


def _fitted(s: Scope, base: E) -> E:
    """Return a power whose exponent is a number."""
    e = s.pick(_EXPONENTS)
    if s.chance(0.6):
        exponent = s.literal(NUMBER, e)
    else:
        exponent = divide(s.literal(NUMBER, F(e.numerator)), s.literal(NUMBER, F(e.denominator)))
    return node("^", (base, ATOM), "^", (exponent, SIGNED), binding=POWER_OF, value=lambda x, y: x**y)


def _gas(s: Scope, q: E) -> None:
    """A spring of gas, whose volume stays positive, by its force or by its energy."""
    # length of the column is far more than the mass moves
    ratio = add(s.literal(NUMBER, F(1)), divide(q, s.literal(LENGTH, s.number(4, 8))))
    pressed = _fitted(s, ratio)
    if s.chance(0.5):
        _push(s, q, multiply(s.literal(FORCE, s.number(-1, 1)), pressed))
    else:
        energy = multiply(s.value(ENERGY, s.number(0.2, 1)), pressed)
        s.add("energy", "potential ", Slot("potential", energy), ";", data={"what": "potential"})
    ask(s, pressed)


def _drag(s: Scope, q: E) -> None:
    """A drag that grows with a power of the speed, smooth where the mass rests."""
    rate = divide(der(q), s.literal(SPEED, s.number(0.2, 1)))
    size = add(s.literal(NUMBER, F(1)), square(rate))
    _push(s, q, multiply(s.literal(FORCE, s.number(-0.5, -0.1)), multiply(_fitted(s, size), rate)))
    ask(s, call("sqrt", size, value=math.sqrt))


def _push(s: Scope, q: E, value: E) -> None:
    s.add(
        "force", "force ", Slot("force.value", value), " on ", Slot("force.on", q), ";", data={"on": "scalar"}
    )
