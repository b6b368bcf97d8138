"""Parameters that are formulas of others, over several levels, numbers and arrays, with cases; and what depends on them."""

from __future__ import annotations

import math

import numpy as np

from random_models.expressions import Writer
from random_models.operators import add, call, choose, divide, multiply, relation, vector
from random_models.scope import TYPES, Scope, rare
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
    Slot,
    node,
    over,
    reference,
)

SHARE = 0.15
"""Of the models."""
_DIMENSIONS = (NUMBER, NUMBER, LENGTH, TIME, MASS, FORCE, SPEED)


@rare(SHARE)
def formulas(s: Scope) -> None:
    """Write a few."""
    chain(s)


def chain(s: Scope) -> None:
    """Let each parameter be a formula of those before it, in any order of the text, and look at some of them."""
    there = [s.parameter(s.pick(_DIMENSIONS), s.size()) for _ in range(s.pick((1, 2)))]
    first = len(s.statements)
    for _ in range(s.pick((1, 2, 3, 4))):
        there.append(_several(s, there) if s.chance(0.2) else _one(s, there))
    if s.chance(0.5):
        own = s.statements[first:]
        s.random.shuffle(own)
        s.statements[first:] = own
    for k in range(s.pick((1, 2, 2))):
        s.pick((_force, _potential, _output) if k else (_force, _force, _potential))(s, there[-1 - k])
    _output(s, there[-1])


def rule(s: Scope, d: Dim, there: list[E]) -> E:
    """Return a positive formula of a dimension."""
    x = s.pick(there)
    if x.shape:
        x = _element(s, x)
    ratio = divide(x, s.literal(x.dim, s.size()))
    size = s.literal(d, s.size())
    kind = s.pick(("product", "product", "wave", "sum", "choice", "largest", "root"))
    if kind == "wave":
        return multiply(size, add(s.literal(NUMBER, s.number(1.2, 2)), call("sin", ratio, value=math.sin)))
    if kind == "sum":
        return add(size, multiply(s.literal(d, s.size()), ratio))
    if kind == "choice":
        condition = relation(s.pick(("<", ">", ">=")), x, s.literal(x.dim, s.size()))
        return choose(condition, multiply(size, ratio), s.literal(d, s.size()))
    if kind == "largest":
        return call("max", size, multiply(s.literal(d, s.size()), ratio), dim=d, value=max)
    if kind == "root":
        return multiply(size, call("sqrt", ratio, value=math.sqrt))
    same = [p for p in there if p.dim == d and not p.shape]
    return (
        multiply(s.literal(NUMBER, s.size()), s.pick(same))
        if same and s.chance(0.6)
        else multiply(size, ratio)
    )


def _element(s: Scope, x: E) -> E:
    """Return one number of an array: an element, or what is made of all."""
    if s.chance(0.4):
        name = s.pick(("sum", "max", "min"))
        return call(name, x, dim=x.dim, value=getattr(np, name))
    i = s.random.randint(1, x.shape[0])
    return node("index", (x, 9), f"[{i}]", dim=x.dim, value=lambda v: v[i - 1])


def _one(s: Scope, there: list[E]) -> E:
    d = s.pick(_DIMENSIONS)
    return s.parameter(d, expression=rule(s, d, there))


def _several(s: Scope, there: list[E]) -> E:
    """Declare an array of formulas."""
    d, n, name = s.pick((NUMBER, LENGTH, FORCE)), s.pick((2, 3)), s.fresh("p")
    e = vector(*(rule(s, d, there) for _ in range(n)))
    kind = s.pick(TYPES[d]) + " " if s.chance(0.6) else ""
    s.add("parameter", f"parameter {kind}{name}[{n}] = ", Slot("parameter.value", e), ";", name=name)
    return reference(name, "parameter", d, (n,), level="p")


def _number(s: Scope, p: E) -> E:
    """Return a parameter without its dimension, times something that moves."""
    x = _element(s, p) if p.shape else p
    ratio = x if x.dim == NUMBER else divide(x, s.literal(x.dim, s.size()))
    w = Writer(s, "tzxqv", kinks=False)
    return multiply(ratio, call(s.pick(("sin", "cos", "tanh")), w.number(0)))


def _force(s: Scope, p: E) -> None:
    free = [q for q in s.coordinates if q not in s.driven]
    if not free:
        return _output(s, p)
    q = s.pick(free)
    value = multiply(s.literal(over(ENERGY, q.dim), s.number(0.1, 1)), _number(s, p))
    s.add(
        "force", "force ", Slot("force.value", value), " on ", Slot("force.on", q), ";", data={"on": "scalar"}
    )
    return None


def _potential(s: Scope, p: E) -> None:
    x = _element(s, p) if p.shape else p
    ratio = x if x.dim == NUMBER else divide(x, s.literal(x.dim, s.size()))
    w = Writer(s, "tq", kinks=False)
    e = multiply(
        multiply(s.literal(ENERGY, s.number(0.1, 1)), ratio), call("cos", w.number(0), value=math.cos)
    )
    s.add("energy", "potential ", Slot("potential", e), ";", data={"what": "potential"})


def _output(s: Scope, p: E) -> None:
    name = s.fresh("o")
    s.add("output", f"output {name} = ", Slot("output.value", _number(s, p)), ";", name=name)
