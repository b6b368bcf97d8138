"""What is let go and taken hold of again: constraints that events release and engage, and laws that ask whether they hold."""

from __future__ import annotations

from fractions import Fraction

from random_models.coordinates import half, square
from random_models.expressions import Writer
from random_models.operators import add, call, choose, der, multiply, relation, subtract
from random_models.quantities import quantity
from random_models.scope import Scope
from random_models.tree import (
    ENERGY,
    FORCE,
    LENGTH,
    MASS,
    NUMBER,
    SPEED,
    TIME,
    Dim,
    E,
    Seq,
    Slot,
    node,
    over,
    reference,
    statement,
)

F = Fraction
SHARE = 0.08
"""Of the models."""
AT_ONCE = 0.3
"""Of the pairs are apart at the start, and released then."""
OPENED = 0.15
"""Of the models with contacts: one of them is let go on the way, and what it held falls through."""
ASKED = 0.3
"""Of the models with contacts: a law asks whether one of them presses."""


def letting_go(s: Scope, seed: int) -> None:
    """Write a pair that is tied together for a while. Their random numbers are their own: models keep all else."""
    with s.apart(f"letting go of {seed}"):
        contacts = [name for name, _, pressed in s.constraints if pressed]
        if contacts and s.chance(ASKED):
            _ask(s, s.pick(contacts))
        if s.chance(SHARE):
            _ask(s, _pair(s))
    with s.apart(f"contact let go of {seed}"):
        if contacts and s.chance(OPENED):
            _event(s, "release", s.pick(contacts), s.number(0.05, 0.35))


def _ask(s: Scope, name: str) -> None:
    """Write a law that asks whether something holds, and tell it."""
    holds = call("closed", reference(name, "constraint"), type="boolean", level="e")
    for _ in range(s.pick((1, 1, 2))):
        s.weighted(((3, _force), (1, _state), (1, _output)))(s, holds)
    _output(s, holds)


def _choice(s: Scope, d: Dim, holds: E) -> E:
    zero = node("number", "0", value=lambda: 0)
    a, b = s.literal(d, s.number(0.1, 1)), zero if s.chance(0.5) else s.literal(d, s.number(-1, -0.1))
    return choose(holds, a, b) if s.chance(0.6) else choose(holds, b, a)


def _force(s: Scope, holds: E) -> None:
    free = [q for q in s.coordinates if q not in s.driven]
    if not free:
        return
    q = s.pick(free)
    value = _choice(s, over(ENERGY, q.dim), holds)
    s.add(
        "force", "force ", Slot("force.value", value), " on ", Slot("force.on", q), ";", data={"on": "scalar"}
    )


def _state(s: Scope, holds: E) -> None:
    name = s.fresh("x")
    s.add("state", f"state Real {name} = 0;", name=name)
    rate = _choice(s, over(NUMBER, TIME), holds)
    s.add("equation", f"equation der({name}) = ", Slot("equation", rate), ";", name=name)


def _output(s: Scope, holds: E) -> None:
    name = s.fresh("o")
    s.add("output", f"output {name} = ", Slot("output.value", _choice(s, NUMBER, holds)), ";", name=name)


def _pair(s: Scope) -> str:
    """Write two coordinates that are tied by their places or by their rates, and the events; return what ties them."""
    share, place, rate = s.number(0.4, 1.5), s.number(-0.3, 0.3), s.number(0.3, 1)
    at_once = s.chance(AT_ONCE)
    off = s.number(0.1, 0.4) if at_once else F(0)
    a = _coordinate(s, place * share + off, (rate + off) * share, guess=at_once)
    b = _coordinate(s, place, rate)
    for q in (a, b):
        mass = s.value(MASS, s.number(0.5, 2))
        s.add(
            "energy",
            "kinetic ",
            Slot("kinetic", half(s, mass, square(der(q)))),
            ";",
            data={"what": "kinetic"},
        )
        push = Writer(s, "tqxv", kinks=False).scalar(FORCE, 1)
        s.add(
            "force",
            "force ",
            Slot("force.value", push),
            " on ",
            Slot("force.on", q),
            ";",
            data={"on": "scalar"},
        )
    name, c = s.fresh("h"), quantity(share, NUMBER)
    by_rates = s.chance(0.6)
    left, right = (der(a), multiply(c, der(b))) if by_rates else (a, multiply(c, b))
    s.add(
        "constraint",
        f"constraint {name}: ",
        Slot("constraint.left", left),
        " = ",
        Slot("constraint.right", right),
        ";",
        name=name,
    )
    late = s.number(0.05, 0.2)
    deeds = [("release", F(0) if at_once else late)]
    if by_rates and s.chance(0.7):
        deeds.append(("engage", late + s.number(0.05, 0.15)))
    if s.chance(0.5):
        _kick(s, s.pick((a, b)), late)
    for word, time in deeds:
        _event(s, word, name, time)
    out = s.fresh("o")
    force = call("multiplier", reference(name, "constraint"), dim=FORCE, level="qva")
    s.add("output", f"output {out} = ", Slot("output.value", force), ";", name=out)
    apart = s.fresh("o")
    s.add(
        "output",
        f"output {apart} = ",
        Slot("output.value", subtract(a, multiply(c, add(b, b)))),
        ";",
        name=apart,
    )
    return name


def _event(s: Scope, word: str, name: str, time: Fraction) -> None:
    """Let something go, or take hold of it, at a time; at once where that is zero."""
    t = reference("time", "time", TIME, level="t")
    first = node("initial", "initial()", level="z", type="boolean")
    s.add(
        "when",
        "when ",
        Slot("when.condition", relation(">", t, s.literal(TIME, time)) if time else first),
        " then",
        Seq((statement(word, f"{word} {name};", name=name),)),
        "end when;",
    )


def _kick(s: Scope, q: E, late: Fraction) -> None:
    """Set a rate that is tied, or was, or will be again: what holds then has its say."""
    edge = s.literal(TIME, late + s.pick((F("-0.03"), F("-0.02"), F("0.02"), F("0.2"))))
    value = s.literal(SPEED, s.number(-1, 1))
    deed = statement(
        "reinit", "reinit(", Slot("reinit.target", der(q)), ", ", Slot("reinit.value", value), ");"
    )
    condition = Slot("when.condition", relation(">", reference("time", "time", TIME, level="t"), edge))
    s.add("when", "when ", condition, " then", Seq((deed,)), "end when;")


def _coordinate(s: Scope, place: Fraction, rate: Fraction, *, guess: bool = False) -> E:
    """Write one whose start is exact, as it has to agree with that of the other; or a guess, which nothing moves."""
    name, sign, data = s.fresh("q"), "~" if guess else "=", {"guess": guess}
    value = Slot("coordinate.value", quantity(place, LENGTH))
    s.add("coordinate", f"coordinate Length {name} {sign} ", value, ";", name=name, data={**data})
    value = Slot("initial.rate", quantity(rate, SPEED))
    s.add("initial", f"initial der({name}) {sign} ", value, ";", name=f"der({name})", data={**data})
    return reference(name, "coordinate", LENGTH, level="q")
