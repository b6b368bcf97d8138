"""How expressions are put together: operators, calls, vectors, choices."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np

from random_models.scope import Scope
from random_models.tree import (
    ATOM,
    IF,
    NUMBER,
    POWER_OF,
    PRODUCT,
    RELATION,
    SIGNED,
    SUM,
    TIME,
    Dim,
    E,
    node,
    over,
    times,
    to_power,
)

Levels = frozenset[str]


def levels(text: str) -> Levels:
    """Return the set of letters."""
    return frozenset(text)


def add(a: E, b: E) -> E:
    """Return a + b."""
    return node(
        "+", (a, SUM), " + ", (b, PRODUCT), dim=a.dim, shape=a.shape, binding=SUM, value=lambda x, y: x + y
    )


def subtract(a: E, b: E) -> E:
    """Return a - b."""
    return node(
        "-", (a, SUM), " - ", (b, PRODUCT), dim=a.dim, shape=a.shape, binding=SUM, value=lambda x, y: x - y
    )


def multiply(a: E, b: E) -> E:
    """Return a*b; one of both may be a vector."""
    return node(
        "*", (a, PRODUCT), "*", (b, SIGNED),
        dim=times(a.dim, b.dim), shape=a.shape or b.shape, binding=PRODUCT, value=lambda x, y: x * y,
    )  # fmt: skip


def divide(a: E, b: E) -> E:
    """Return a/b; a quantity below the bar is put in parentheses, as the language asks for behind a number."""
    quantity_below = next(iter(_leftmost(b))).kind == "quantity"
    return node(
        "/", (a, PRODUCT), "/", (b, ATOM if quantity_below else SIGNED),
        dim=over(a.dim, b.dim), shape=a.shape, binding=PRODUCT, value=lambda x, y: x / y,
    )  # fmt: skip


def _leftmost(e: E) -> tuple[E, ...]:
    while e.operands and not isinstance(e.parts[0], str):
        e = e.operands[0]
    return (e,)


def negate(a: E) -> E:
    """Return -a."""
    return node("negate", "-", (a, SIGNED), dim=a.dim, shape=a.shape, binding=SIGNED, value=lambda x: -x)


def power(a: E, n: E, exponent: Fraction) -> E:
    """Return a^n."""
    return node(
        "^",
        (a, ATOM),
        "^",
        (n, SIGNED),
        dim=to_power(a.dim, exponent),
        binding=POWER_OF,
        value=lambda x, y: x**y,
    )


def call(name: str, *arguments: E, dim: Dim = NUMBER, shape: tuple[int, ...] = (), type: str = "real",
         value: Callable[..., Any] | None = None, level: str = "") -> E:  # fmt: skip
    """Call a function."""
    parts: list[str | E | tuple[E, int]] = [f"{name}("]
    for i, a in enumerate(arguments):
        parts += [", " if i else "", a]
    return node(name, *parts, ")", dim=dim, shape=shape, value=value, level=level, type=type)


def der(e: E, order: int = 1) -> E:
    """Return the derivative by time."""
    d = over(e.dim, to_power(TIME, order))
    level = "v" if order == 1 else "a"
    tail = ")" if order == 1 else f", {order})"
    return node("der" if order == 1 else "der2", "der(", e, tail, dim=d, shape=e.shape, level=level)


def vector(*elements: E, kind: str = "vector") -> E:
    """Return {a, b, ..}."""
    parts: list[str | E | tuple[E, int]] = ["{"]
    for i, e in enumerate(elements):
        parts += [", " if i else "", e]
    return node(kind, *parts, "}", dim=elements[0].dim, shape=(len(elements), *elements[0].shape),
                value=lambda *xs: np.array(xs))  # fmt: skip


def element(e: E, i: int) -> E:
    """Return e[i] (i from 1) of a reference, or of what may be indexed."""
    return node("index", (e, ATOM), f"[{i}]", dim=e.dim, shape=e.shape[1:], value=lambda x: x[i - 1])


def choose(condition: E, a: E, b: E) -> E:
    """Return if condition then a else b."""
    return node("if", "if ", condition, " then ", a, " else ", b, dim=a.dim, shape=a.shape, binding=IF,
                value=lambda c, x, y: x if c else y, type=a.type)  # fmt: skip


def relation(sign: str, a: E, b: E) -> E:
    """Compare two expressions of one dimension."""
    table: dict[str, Callable[[Any, Any], bool]] = {
        "<": lambda x, y: x < y, "<=": lambda x, y: x <= y, ">": lambda x, y: x > y, ">=": lambda x, y: x >= y,
        "==": lambda x, y: x == y, "<>": lambda x, y: x != y,
    }  # fmt: skip
    return node(sign, (a, SUM), f" {sign} ", (b, SUM), binding=RELATION, type="boolean", value=table[sign])


def two() -> E:
    """Return the number 2."""
    return node("number", "2", value=lambda: 2, data=Fraction(2))


def whole(s: Scope, low: int, high: int) -> E:
    n = s.random.randint(low, high)
    return node("number", str(n), value=lambda: n, data=Fraction(n))
