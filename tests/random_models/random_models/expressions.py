"""Typed random expressions: of a dimension, a shape, and what they may depend on."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np

from random_models.numerals import Numbers
from random_models.operators import (
    add,
    call,
    choose,
    divide,
    element,
    levels,
    multiply,
    negate,
    power,
    relation,
    subtract,
    two,
    vector,
    whole,
)
from random_models.questions import question
from random_models.scope import TYPES, Scope
from random_models.tree import (
    AND,
    ATOM,
    FORCE,
    IF,
    LENGTH,
    NOT,
    NUMBER,
    OR,
    PRODUCT,
    SIGNED,
    TIME,
    Dim,
    E,
    Slot,
    evaluate,
    node,
    over,
    reference,
    statement,
    to_power,
)


class Writer(Numbers):
    """Writes expressions of a dimension and a shape."""

    # ------------------------------------------------------------ scalars of a dimension

    def scalar(self, d: Dim, depth: int = 3) -> E:
        """Return a scalar of a dimension."""
        s = self.s
        if s.chance(0.04):
            inner = self.scalar(d, depth - 1)
            return node("parentheses", "(", inner, ")", dim=d, value=lambda x: x)
        if depth <= 0:
            return self._leaf(d)
        makers: tuple[tuple[float, Callable[[Dim], E]], ...] = (
            (3, self._leaf),
            (5, self._shaped),
            (2, self._scaled),
            (2, lambda d: add(self.scalar(d, depth - 1), self.scalar(d, depth - 1))),
            (1.5, lambda d: subtract(self.scalar(d, depth - 1), self.scalar(d, depth - 1))),
            (0.6, lambda d: negate(self.scalar(d, depth - 1))),
            (1.5 if self.kinks else 0, lambda d: self._kink(d, depth)),
            ((4 if self.questions else 1.2) if self.jumps else 0, lambda d: self._if(d, depth)),
            (2 if self.questions else 0, self._asked),
            (0.7, lambda d: self._smooth_of_two(d, depth)),
            (0.6, lambda d: self._gathered(d, depth)),
            (0.6, lambda d: self._let(d, depth)),
            (0.6, lambda d: self._function(d, depth)),
            (0.5, lambda d: self._indexed(d, depth)),
            (0.5, lambda d: self._product(d, depth)),
        )
        return s.weighted(makers)(d)

    def _leaf(self, d: Dim) -> E:
        s = self.s
        there = self.signals(d)
        if there and s.chance(0.6):
            return s.pick(there)
        return s.parameter(d) if s.chance(0.4) else s.literal(d, s.number(-2, 2) or Fraction(1))

    def _shaped(self, d: Dim) -> E:
        s = self.s
        f = self.unitless(1)
        c = s.value(d)
        return multiply(c, f) if s.chance(0.7) else multiply(f, c)

    def _scaled(self, d: Dim) -> E:
        e = self.signal()
        if e is None or e.dim == d:
            return e if e is not None else self._leaf(d)
        c = self.s.value(over(d, e.dim), self.s.number(0.05, 0.8))
        return multiply(c, e) if self.s.chance(0.7) else multiply(negate(c), e)

    def _asked(self, d: Dim) -> E:
        """Return a share of an answer about the motion."""
        e = question(self.s)
        if e is None or not self.fits(e):
            return self._leaf(d)
        return multiply(self.s.value(over(d, e.dim), self.s.number(0.05, 0.4)), e)

    def _kink(self, d: Dim, depth: int) -> E:
        s = self.s
        a = self.scalar(d, depth - 1)
        name = s.pick(("abs", "min", "max", "clamp", "deadzone", "root"))
        if name == "root":
            squared = power(a, two(), Fraction(2)) if s.chance(0.5) else multiply(a, a)
            return call("sqrt", squared, dim=d, value=math.sqrt)
        if name == "abs":
            return call("abs", a, dim=d, value=abs)
        if name == "clamp":
            low, high = s.literal(d, -s.size()), s.literal(d, s.size())
            return call("clamp", a, low, high, dim=d, value=lambda x, l, h: min(max(x, l), h))
        if name == "deadzone":
            return call("deadzone", a, s.literal(d, s.size() / 4), dim=d,
                        value=lambda x, w: 0.0 if abs(x) < w else x - math.copysign(w, x))  # fmt: skip
        more = [self.scalar(d, depth - 2) for _ in range(s.random.choice((1, 1, 1, 2)))]
        return call(name, a, *more, dim=d, value=min if name == "min" else max)

    def _if(self, d: Dim, depth: int) -> E:
        s = self.s
        a, b = self.scalar(d, depth - 1), self.scalar(d, depth - 1)
        if s.chance(0.15):
            c = self.scalar(d, depth - 2)
            return node("if.elseif", "if ", self.condition(depth - 1), " then ", a, " elseif ", self.condition(depth - 2),
                        " then ", b, " else ", c, dim=d, binding=IF,
                        value=lambda p, x, q, y, z: x if p else y if q else z)  # fmt: skip
        return choose(self.condition(depth - 1), a, b)

    def condition(self, depth: int = 1) -> E:
        """Return a truth value."""
        s = self.s
        truths = [c for c in s.conditions if self.fits(c)]
        r = s.random.random()
        if truths and r < 0.25:
            return s.pick(truths)
        if depth > 0 and r < 0.4:
            word, strong, value = s.pick(
                (("and", AND, lambda x, y: x and y), ("or", OR, lambda x, y: x or y))
            )
            left, right = self.condition(depth - 1), self.condition(depth - 1)
            return node(
                word,
                (left, strong),
                f" {word} ",
                (right, strong + 1),
                binding=strong,
                type="boolean",
                value=value,
            )
        if depth > 0 and r < 0.46:
            return node(
                "not",
                "not ",
                (self.condition(depth - 1), NOT),
                binding=NOT,
                type="boolean",
                value=lambda x: not x,
            )
        e = self.signal()
        sign = s.pick(("<", "<=", ">", ">="))
        if e is None:
            p = s.parameter(NUMBER)
            return relation(sign, p, s.literal(NUMBER))
        edge = s.value(e.dim) if s.chance(0.7) else self._leaf(e.dim)
        return relation(sign, e, edge) if s.chance(0.8) else relation(sign, edge, e)

    def _smooth_of_two(self, d: Dim, depth: int) -> E:
        s = self.s
        a, b = self.scalar(d, depth - 1), self.scalar(d, depth - 2)
        squares = add(
            add(power(a, two(), Fraction(2)), power(b, two(), Fraction(2))),
            s.literal(to_power(d, 2), Fraction("0.04")),
        )
        if s.chance(0.6):
            return call("sqrt", squares, dim=d, value=math.sqrt)
        if s.chance(0.5):
            half = node("half", "(1/2)", value=lambda: 0.5)
            return power(squares, half, Fraction(1, 2))
        c = s.literal(d, Fraction(1))
        return call("norm", vector(a, b, c), dim=d, value=lambda v: float(np.linalg.norm(v)))

    def _gathered(self, d: Dim, depth: int) -> E:
        s = self.s
        n = s.random.randint(2, 3)
        r = s.random.random()
        if r < 0.5:
            name = s.fresh("i")
            variable = reference(name, "index", NUMBER)
            term = (
                divide(self.scalar(d, depth - 2), variable)
                if s.chance(0.5)
                else multiply(variable, self.scalar(d, 0))
            )
            gather, f = s.pick(
                (("sum", sum), ("sum", sum), ("max", max), ("min", min)) if self.kinks else (("sum", sum),)
            )
            return node("comprehension", f"{gather}(", term, f" for {name} in 1:{n})", dim=d,
                        data=(name, tuple(range(1, n + 1)), f))  # fmt: skip
        items = [self.scalar(d, depth - 2) for _ in range(n)]
        if r < 0.8:
            return call("sum", vector(*items), dim=d, value=lambda v: sum(v))
        weights = [s.literal(NUMBER, s.number(-1, 1)) for _ in items]
        return call("dot", vector(*weights), vector(*items), dim=d, value=lambda v, w: float(np.dot(v, w)))

    def _let(self, d: Dim, depth: int) -> E:
        s = self.s

        e = self.scalar(d, depth - 1)
        if any(x.kind in ("ref:bound", "ref:index") for x in e.walk()):
            return e
        name = s.fresh("w")
        s.add("let", f"let {name} = ", Slot("let.value", e), ";", name=name)
        r = reference(name, "let", d, level="".join(e.level))
        if d and s.chance(0.5) and not e.level & levels("ae"):
            s.signals.append(r)
        return r

    def _function(self, d: Dim, depth: int) -> E:
        s = self.s
        fitting = [f for f in s.file.functions if f[2] == d]
        if not fitting or s.chance(0.3):
            fitting = [new_function(s, d)]
        name, dims, _, body, formals = s.pick(fitting)
        arguments = [self.scalar(x, depth - 2) for x in dims]

        def value(*xs: Any) -> Any:

            return evaluate(body, dict(zip(formals, xs, strict=True)).__getitem__)

        e = call(name, *arguments, dim=d, value=value)
        return E("function", e.parts, e.dim, (), e.level, ATOM, value)

    def _indexed(self, d: Dim, depth: int) -> E:
        s = self.s
        there = [v for v in s.vectors if v.dim == d and len(v.shape) == 1 and self.fits(v)]
        if there and s.chance(0.7):
            v = s.pick(there)
            return element(v, s.random.randint(1, v.shape[0]))
        items = [self.scalar(d, depth - 2) for _ in range(2)]
        return element(vector(*items), s.random.randint(1, 2))

    def _product(self, d: Dim, depth: int) -> E:
        s = self.s
        other = s.pick((NUMBER, LENGTH, TIME, FORCE))
        a, b = self.scalar(over(d, other), depth - 2), self.scalar(other, depth - 2)
        if s.chance(0.2):
            return multiply(
                self.scalar(d, 0),
                call(
                    "product",
                    vector(self.unitless(0), divide(b, s.literal(other, Fraction(1)))),
                    value=lambda v: float(np.prod(v)),
                ),
            )
        if s.chance(0.3):
            return divide(multiply(a, b), whole(s, 2, 3))
        return multiply(a, b)

    # ------------------------------------------------------------ vectors

    def vector(self, n: int, d: Dim, depth: int = 2) -> E:
        """Return a vector of n components."""
        s = self.s
        there = [v for v in s.vectors if v.dim == d and v.shape == (n,) and self.fits(v)]
        r = s.random.random()
        if there and r < 0.3:
            return s.pick(there)
        if depth > 0 and r < 0.45:
            return multiply(self.unitless(0), self.vector(n, d, depth - 1))
        if depth > 0 and r < 0.55:
            f = add if s.chance(0.5) else subtract
            return f(self.vector(n, d, depth - 1), self.vector(n, d, depth - 1))
        if depth > 0 and r < 0.6:
            return negate(self.vector(n, d, depth - 1))
        if depth > 0 and r < 0.66:
            rows = [vector(*(s.literal(NUMBER, s.number(-1, 1)) for _ in range(n))) for _ in range(n)]
            m = vector(*rows, kind="matrix")
            if s.chance(0.3):
                m = call("transpose", m, shape=(n, n), value=lambda a: a.T)
            v = self.vector(n, d, depth - 1)
            return node(
                "matrix*",
                (m, PRODUCT),
                "*",
                (v, SIGNED),
                dim=d,
                shape=(n,),
                binding=PRODUCT,
                value=lambda a, b: a @ b,
            )
        if depth > 0 and n == 3 and r < 0.7:
            a, b = self.vector(3, NUMBER, 0), self.vector(3, d, depth - 1)
            return call("cross", a, b, dim=d, shape=(3,), value=np.cross)
        if r < 0.76:
            name = s.fresh("i")
            term = divide(self.scalar(d, 0), reference(name, "index", NUMBER))
            return node("comprehension", "{", term, f" for {name} in 1:{n}", "}", dim=d, shape=(n,),
                        data=(name, tuple(range(1, n + 1)), np.array))  # fmt: skip
        if depth > 0 and r < 0.8 and self.jumps:
            return choose(self.condition(0), self.vector(n, d, depth - 1), self.vector(n, d, depth - 1))
        return vector(*(self.scalar(d, depth - 1) for _ in range(n)))


def new_function(s: Scope, d: Dim) -> tuple[str, tuple[Dim, ...], Dim, E, tuple[str, ...]]:
    """Write a function of the file that gives a dimension."""
    from random_models.tree import Slot

    name = s.fresh("f")
    first = s.pick((LENGTH, NUMBER, TIME, d))
    a, b = reference("a", "formal", first), reference("b", "formal", NUMBER)
    c = s.literal(over(d, first), s.number(0.2, 1))
    body = (
        multiply(multiply(c, a), call("cos", b, value=math.cos))
        if s.chance(0.6)
        else add(multiply(c, a), multiply(s.literal(d, s.number(-1, 1)), call("tanh", b, value=math.tanh)))
    )
    kind = TYPES.get(first)
    formal = f"{kind[0]} a" if kind and s.chance(0.7) else "a"
    result = f" -> {TYPES[d][0]}" if d in TYPES and s.chance(0.4) else ""
    s.file.items.append(
        statement(
            "function",
            f"function {name}({formal}, Real b){result} = ",
            Slot("function.body", body),
            ";",
            name=name,
        )
    )
    f = (name, (first, NUMBER), d, body, ("a", "b"))
    s.file.functions.append(f)
    return f
