"""Random coordinates with initial values and energies of their own."""

from __future__ import annotations

import math
from fractions import Fraction

from random_models.expressions import Writer
from random_models.operators import (
    add,
    call,
    der,
    divide,
    multiply,
    power,
    two,
    vector,
)
from random_models.scope import Scope
from random_models.tree import (
    ENERGY,
    LENGTH,
    NUMBER,
    Dim,
    E,
    Seq,
    Slot,
    dim,
    node,
    over,
    reference,
    statement,
    to_power,
)

F = Fraction


def half(s: Scope, *factors: E) -> E:
    """Return 1/2 of a product, or that written otherwise."""
    product = factors[0]
    for f in factors[1:]:
        product = multiply(product, f)
    if s.chance(0.3):
        return divide(product, two())
    first = divide(node("number", "1", value=lambda: 1, data=F(1)), two())
    for f in factors:
        first = multiply(first, f)
    return first


def square(e: E) -> E:
    """Return e^2."""
    return power(e, two(), F(2))


def start_sign(s: Scope) -> str:
    """Choose known or guessed; where constraints decide some values, few are known."""
    return " ~ " if s.chance(0.8 if s.locked else 0.15) else " = "


def begins(s: Scope, name: str, sign: str, value: E) -> None:
    """Remember what is known of the start."""
    if "=" in sign:
        s.notes.add("known:" + name)
    if value.kind == "quantity" and isinstance(value.data, Fraction):
        s.starts[name] = value.data
    if value.kind == "vector":
        stem, tail = (name[:-1], ")") if name.startswith("der(") else (name, "")
        for i, e in enumerate(value.operands, 1):
            begins(s, f"{stem}[{i}]{tail}", sign, e)


def initial_value(s: Scope, d: Dim, low: float = -0.8, high: float = 0.8, *, angle: bool = False) -> E:
    """Return an expression for an initial value."""
    r = s.random.random()
    if r < 0.75:
        return s.literal(d, s.number(low, high), angle=angle)
    if r < 0.9:
        return multiply(s.literal(NUMBER, s.number(low, high)), s.parameter(d, F(1)))
    return multiply(s.literal(d, s.number(low, high)), call("cos", s.parameter(NUMBER), value=math.cos))


def coordinate(s: Scope, d: Dim, *, angle: bool = False, low: float = -0.8, high: float = 0.8) -> E:
    """Declare a scalar coordinate with initial values."""
    name = s.fresh("q")
    kind = "Angle" if angle else "Length" if d == LENGTH else "Real"
    sign = start_sign(s)
    typed = s.chance(0.8)
    later = s.chance(0.25)
    value = initial_value(s, d, low, high, angle=angle)
    attributes = ""
    if s.chance(0.2 if s.locked else 0.05):
        attributes = "(nominal = 0.5 m)" if d == LENGTH else '(display = "deg")' if angle else ""
    if later:
        s.add("coordinate", f"coordinate {kind} {name}{attributes};", name=name)
        s.add(
            "initial",
            f"initial {name}{sign}",
            Slot("initial.value", value),
            ";",
            name=name,
            data={"guess": "~" in sign},
        )
    else:
        head = f"coordinate {kind + ' ' if typed else ''}{name}{attributes}{sign}"
        s.add(
            "coordinate", head, Slot("coordinate.value", value), ";", name=name, data={"guess": "~" in sign}
        )
    begins(s, name, sign, value)
    q = reference(name, "coordinate", d, level="q")
    if s.chance(0.8):
        sign = " ~ " if s.locked and "~" in sign else start_sign(s)
        rate = initial_value(s, over(d, dim(0, 0, 1)))
        begins(s, f"der({name})", sign, rate)
        s.add("initial", f"initial der({name}){sign}", Slot("initial.rate", rate), ";",
              name=f"der({name})", data={"guess": "~" in sign})  # fmt: skip
    know(s, q)
    return q


def know(s: Scope, q: E) -> None:
    """Let expressions look at a coordinate, and at its rate."""
    s.coordinates.append(q)
    s.signals.append(q)
    s.signals.append(der(q))


def mass_for(s: Scope, d: Dim) -> E:
    """Return the coefficient that makes a square of a rate an energy."""
    return s.value(over(ENERGY, to_power(over(d, dim(0, 0, 1)), 2)), s.number(0.5, 2.5))


def scalar_system(s: Scope) -> None:
    """Write a few coordinates with energies."""
    for _ in range(s.random.choice((1, 1, 2, 2, 3))):
        r = s.random.random()
        if r < 0.2:
            _array_of_coordinates(s)
            continue
        angle = r < 0.5
        d = NUMBER if angle or r < 0.55 else LENGTH
        q = coordinate(s, d, angle=angle)
        kinetic = half(s, mass_for(s, d), square(der(q)))
        if s.chance(0.25):  # a mass that depends on where it is
            look = Writer(s, "q", kinks=False)
            grow = add(
                s.literal(NUMBER, F(1)),
                multiply(s.literal(NUMBER, s.number(0.1, 0.4)), square(call("sin", look.number(0)))),
            )
            kinetic = multiply(kinetic, grow)
        if s.chance(0.1):
            s.add("energy", "lagrangian ", Slot("lagrangian", kinetic), ";", data={"what": "lagrangian"})
        else:
            s.add("energy", "kinetic ", Slot("kinetic", kinetic), ";", data={"what": "kinetic"})
        s.notes.add("own inertia")
    if len(s.coordinates) > 1 and s.chance(0.4):
        a, b = s.random.sample(s.coordinates, 2)
        rates = multiply(der(a), der(b))
        c = s.literal(over(ENERGY, rates.dim), s.number(-0.2, 0.2) or F(1, 10))
        s.add(
            "energy",
            "kinetic ",
            Slot("kinetic", multiply(multiply(c, rates), call("cos", Writer(s, "q").number(0)))),
            ";",
            data={"what": "kinetic"},
        )


def _array_of_coordinates(s: Scope) -> None:
    n = s.random.randint(2, 3)
    name = s.fresh("q")
    d, kind = s.pick(((LENGTH, "Length"), (NUMBER, "Angle")))
    sign = start_sign(s)
    if s.chance(0.6):
        value = vector(*(s.literal(d, s.number(-0.8, 0.8)) for _ in range(n)))
    else:
        value = s.literal(d, s.number(-0.8, 0.8))
    s.add(
        "coordinate",
        f"coordinate {kind} {name}[{n}]{sign}",
        Slot("coordinate.value", value),
        ";",
        name=name,
        data={"guess": "~" in sign, "n": n},
    )
    begins(s, name, sign, value)
    q = reference(name, "coordinate", d, (n,), level="q")
    s.vectors.append(q)
    for i in range(1, n + 1):
        know(s, reference(f"{name}[{i}]", "coordinate", d, level="q"))
    m = mass_for(s, d)
    index = s.fresh("i")
    entry = reference(f"{name}[{index}]", "coordinate", d, level="q")
    term = half(s, m, square(der(entry)))
    if s.chance(0.6):
        total = node(
            "comprehension",
            "sum(",
            term,
            f" for {index} in 1:{n})",
            dim=ENERGY,
            data=(index, tuple(range(1, n + 1)), sum),
        )
        s.add("energy", "kinetic ", Slot("kinetic", total), ";", data={"what": "kinetic"})
    else:
        inner = statement("energy", "kinetic ", Slot("kinetic", term), ";", data={"what": "kinetic"})
        s.add("for", f"for {index} in 1:{n} loop", Seq((inner,)), "end for;", data={"index": index, "n": n})
