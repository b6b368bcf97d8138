"""What a model says of its definite integrals: of each something, and of those that no rule can miss that they are exact. These are
integrals of curves through points times powers of the place, which are split at the points."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from random_models.compiled import Compiled, NoMotion
from random_models.tree import E, Model

ROUNDING = 1e-12
"""Error of such an integral, relative to that of the size of its integrand. Between two points it is a polynomial, of which a rule
of Gauss of half as many places leaves nothing: rounding is left, of a few hundred places a few units in the last place each, and
ten times that where the place itself is rounded."""
DEGREE, POINTS = 9, 6
"""The highest degree of the integrand, and the most points at which an integral is split."""


def badly_known(model: Model, base: Compiled, seed: int) -> list[str]:
    """List the integrals of which a model says that they are known worse than rounding makes them, though they are split."""
    texts = {f"error({e}" for e in _integrals(model)}
    names = [
        q.name for q in base.problem.outputs if q.kind == "quadrature" and q.name.startswith(tuple(texts))
    ]
    found = []
    for state in base.random_states(np.random.default_rng(seed), 2) if names else ():
        try:
            state = base.settle(state)
        except NoMotion:
            continue
        told = base.outputs(state)
        found += [f"{name} is {told[name]:.2g}\nat {state}" for name in names if told[name] > ROUNDING]
    return found


def untold(model: Model, base: Compiled) -> list[str]:
    """List the integrals of which a model does not say how well they are known, but for those in branches never taken."""
    told = [q.name for q in base.problem.outputs if q.kind == "quadrature"]
    stated = {
        str(e)
        for s in model.top.walk()
        for slot in s.slots
        for e in _asked(slot.expression)
        if e.kind == "integral.over"
    }
    return sorted(text for text in stated if not any(name.startswith(f"error({text}") for name in told))


def _asked(e: E) -> Iterator[E]:
    """Yield it and all below, but for what stands behind conditions that are known before a run, or among elements that are not
    chosen."""
    yield e
    if e.kind == "index" and e.operands[0].kind == "vector":
        return
    known = e.kind in ("if", "if.elseif") and any(
        _settled(x) for c in e.operands if c.type == "boolean" for x in c.walk()
    )
    for operand in e.operands:
        if not known or operand.type == "boolean":
            yield from _asked(operand)


def _settled(condition: E) -> bool:
    """Whether it compares numbers, or something with itself."""
    sides = {str(x) for x in condition.operands}
    return condition.type == "boolean" and (not condition.level or len(condition.operands) == 2 > len(sides))


def exact(model: Model) -> bool:
    """Whether a model has such integrals."""
    return any(True for _ in _integrals(model))


def _integrals(model: Model) -> Iterator[E]:
    for e in (e for s in model.statements() for slot in s.slots for e in slot.expression.walk()):
        if e.kind == "integral.over":
            body, name = e.operands[0], str(e.parts[2]).split()[1]
            degree, points = _shape(body, name)
            if points and degree <= DEGREE and points <= POINTS:
                yield e


def _shape(e: E, name: str) -> tuple[float, int]:
    """Return the degree of an expression in a variable between the points of the tables in it, and the number of these;
    of what is anything else, a degree without end."""
    if not any(x.ref == name for x in e.walk()):
        return 0, 0
    if e.ref:
        return 1, 0
    below = [_shape(x, name) for x in e.operands]
    degrees, points = [d for d, _ in below], sum(n for _, n in below)
    match e.kind:
        case "+" | "-" | "negate":
            return max(degrees), points
        case "*":
            return sum(degrees), points
        case "/" if degrees[1] == 0:
            return degrees[0], points
        case "^" if e.operands[1].kind == "number":
            n = float(e.operands[1].value()) if e.operands[1].value else -1.0
            return (n * degrees[0], points) if n > 0 and n.is_integer() else (np.inf, 0)
        case "table" if degrees[0] <= 1 and not points and not any(degrees[1:]):
            return 3, e.operands[1].shape[0]
    return np.inf, 0
