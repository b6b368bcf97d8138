"""Random numbers without a dimension: functions of what may be looked at."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

from random_models.operators import (
    add,
    call,
    choose,
    der,
    divide,
    levels,
    multiply,
    power,
    relation,
    subtract,
    two,
    vector,
    whole,
)
from random_models.questions import question
from random_models.scope import Scope
from random_models.tree import (
    NUMBER,
    SUM,
    TIME,
    Dim,
    E,
    node,
    reference,
    to_power,
)

# one argument: name, how the argument is made safe, value
_ONE: tuple[tuple[str, str, Callable[[float], float]], ...] = (
    ("sin", "any", math.sin), ("cos", "any", math.cos), ("tan", "unit", math.tan), ("asin", "unit", math.asin),
    ("acos", "unit", math.acos), ("atan", "any", math.atan), ("sinh", "unit", math.sinh),
    ("cosh", "unit", math.cosh), ("tanh", "any", math.tanh), ("asinh", "any", math.asinh),
    ("acosh", "above", math.acosh), ("atanh", "unit", math.atanh), ("exp", "unit", math.exp),
    ("log", "above", math.log), ("log10", "above", math.log10), ("sqrt", "above", math.sqrt),
)  # fmt: skip


_KINKS: tuple[tuple[str, Callable[[float], float]], ...] = (("abs", abs),)


_JUMPS: tuple[tuple[str, Callable[[float], float]], ...] = (
    ("sign", lambda x: float((x > 0) - (x < 0))),
    ("floor", math.floor),
    ("ceil", math.ceil),
)


class Numbers:
    """Writes expressions for one place of a scope.

    ``allowed``: letters of what may stand here. ``kinks``, ``jumps``: whether the value may bend, or jump.
    ``questions``: whether questions about the motion may stand here.
    """

    def __init__(self, scope: Scope, allowed: str, *, kinks: bool = True, jumps: bool = True, questions: bool = False,
                 only_affine: bool = False) -> None:  # fmt: skip
        self.s = scope
        self.allowed = levels(allowed) | {"p"}
        self.kinks = kinks
        self.jumps = jumps and kinks
        self.questions = questions
        self.bound = 0

    # ------------------------------------------------------------ leaves

    def fits(self, e: E) -> bool:
        """Whether an expression may stand here."""
        return e.level <= self.allowed

    def signals(self, d: Dim | None = None) -> list[E]:
        """Return what may be looked at here."""
        return [e for e in self.s.signals if self.fits(e) and (d is None or e.dim == d)]

    def signal(self) -> E | None:
        """Choose something to look at: time, a question, a rate of something, or a signal."""
        s = self.s
        if "t" in self.allowed and s.chance(0.12):
            return reference("time", "time", TIME, level="t")
        if self.questions and s.chance(0.35):
            asked = question(s)
            if asked is not None and self.fits(asked):
                return asked
        there = self.signals()
        if not there:
            return None
        e = s.pick(there)
        if "v" in self.allowed and e.level <= levels("pq") and "q" in e.level and s.chance(0.15):
            return der(e)
        return e

    def number(self, depth: int) -> E:
        """Return a number of moderate size that looks at something."""
        s = self.s
        e = self.signal()
        if e is None or s.chance(0.1):
            return s.literal(NUMBER) if s.chance(0.5) else s.parameter(NUMBER)
        if e.dim == NUMBER:
            if s.chance(0.4):
                return e
            return (
                multiply(s.literal(NUMBER), e)
                if s.chance(0.5)
                else add(e, s.literal(NUMBER, s.number(-1, 1)))
            )
        unit = s.value(e.dim)
        return divide(e, unit) if s.chance(0.7) else multiply(s.literal(to_power(e.dim, -1)), e)

    # ------------------------------------------------------------ numbers without a dimension

    def unitless(self, depth: int) -> E:
        """Return a function of a number, bounded where the number is moderate."""
        s = self.s
        x = self.unitless(depth - 1) if depth > 0 and s.chance(0.25) else self.number(depth)
        r = s.random.random()
        if r < 0.45:
            name, need, value = s.pick(_ONE)
            return call(name, self._safe(x, need), value=value)
        if r < 0.55 and self.kinks:
            name, value = s.pick(_KINKS)
            return call(name, self._safe(x, "unit") if s.chance(0.5) else x, value=value)
        if r < 0.62 and self.jumps:
            name, value = s.pick(_JUMPS)
            return call(name, x, value=value)
        if r < 0.67 and self.jumps:
            m = s.literal(NUMBER, s.size())
            if s.chance(0.4):
                m = multiply(m if s.chance(0.4) else whole(s, 1, 4), node("pi", "pi", value=lambda: math.pi))
            return call("mod", x, m, value=lambda a, b: a - math.floor(a / b) * b)
        if r < 0.72:
            y = self.number(depth)
            return call(
                "atan2",
                x,
                add(s.literal(NUMBER, Fraction("1.5")), power(y, two(), Fraction(2))),
                value=math.atan2,
            )
        if r < 0.80:
            return divide(x, add(s.literal(NUMBER, Fraction(1)), power(x, two(), Fraction(2))))
        if r < 0.88 and self.kinks:
            return self.table(x)
        if r < 0.91:
            return call("div", whole(s, 3, 9),
                        whole(s, 2, 4)) if s.chance(0.3) else x  # fmt: skip
        if r < 0.94:
            return (
                node("pi", "pi", value=lambda: math.pi)
                if s.chance(0.3)
                else multiply(call("sin", x, value=math.sin), node("pi", "pi", value=lambda: math.pi))
            )
        if s.chance(0.5):
            return self.quadrature(x)
        return call("sin", x, value=math.sin)

    def _safe(self, x: E, need: str) -> E:
        s = self.s
        if need == "unit":
            inner = call(s.pick(("sin", "cos", "tanh")), x, value=None)
            inner = call("sin", x, value=math.sin) if s.chance(0.6) else call("tanh", x, value=math.tanh)
            return multiply(s.literal(NUMBER, s.number(0.3, 0.9)), inner)
        if need == "above":
            return add(s.literal(NUMBER, s.number(1.2, 2)), power(x, two(), Fraction(2)))
        return x

    def table(self, x: E) -> E:
        """Look a number up in a table."""
        s = self.s
        n = s.random.randint(2, 5)
        xs = sorted({s.number(-2, 2, 1) for _ in range(n + 2)})[:n]
        if len(xs) < 2:
            xs = [Fraction(-1), Fraction(1)]
        ys = [s.number(-1, 1) for _ in xs]
        return call(
            "table",
            x,
            vector(*(s.literal(NUMBER, v) for v in xs)),
            vector(*(s.literal(NUMBER, v) for v in ys)),
        )

    def _integrand(self, variable: E, inner: E) -> E:
        """Return a function of the variable that waves, bends, jumps or begins steeply, and is shifted by something."""
        s = self.s
        edge = s.literal(NUMBER, s.number(0.1, 0.6))
        x = subtract(variable, edge) if s.chance(0.5) or not self.kinks else subtract(variable, inner)
        kind = s.pick(("wave", "bend", "root", "table", "choice", "abs of a wave", "step"))
        if kind == "wave":
            return call("cos", multiply(s.literal(NUMBER, s.number(3, 60)), x), value=math.cos)
        if kind == "abs of a wave":
            return call("abs", call("sin", multiply(s.literal(NUMBER, s.number(2, 9)), x), value=math.sin))
        if kind == "root":
            return multiply(call("sqrt", variable, value=math.sqrt), add(two(), inner))
        if kind == "table":
            return multiply(self.table(x), add(two(), inner))
        if kind == "bend":
            bent = call("abs", x) if s.chance(0.5) else call("max", node("number", "0"), x)
            return multiply(bent, add(two(), inner))
        if kind == "step":
            return multiply(call("sign", x), variable)
        condition = relation(s.pick(("<", ">")), variable, edge)
        return choose(condition, multiply(inner, variable), call("cos", variable, value=math.cos))

    def quadrature(self, x: E) -> E:
        """Integrate over a variable of its own; the argument enters the integrand or a bound."""
        s = self.s
        name = s.fresh("s")
        variable = reference(name, "bound", NUMBER)
        inner = self._safe(x, "unit")
        if s.chance(0.6):
            body = self._integrand(variable, inner)
            upper = s.literal(NUMBER, s.number(0.6, 1.5)) if s.chance(0.6) else add(inner, two())
        elif s.chance(0.5):
            body = (
                call("cos", multiply(inner, variable))
                if s.chance(0.5)
                else divide(
                    s.literal(NUMBER, Fraction(1)),
                    add(s.literal(NUMBER, s.number(1.5, 2)), multiply(inner, variable)),
                )
            )
            upper = s.literal(NUMBER, Fraction(1))
        else:
            body = (
                power(call("sin", variable), two(), Fraction(2))
                if s.chance(0.5)
                else multiply(s.literal(NUMBER), variable)
            )
            upper = inner
        return node(
            "integral.over",
            "integral(",
            body,
            f" for {name} in ",
            s.literal(NUMBER, Fraction(0)),
            ":",
            (upper, SUM),
            ")",
        )
