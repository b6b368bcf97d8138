"""A twin in which every short form is spelled out: chains of cases, limits, sums over indices, the other side of relations.

What flattening makes of a form is what both the compiler and the definition read; only another text can tell that it is wrong.
"""

from __future__ import annotations

from random import Random

from random_models.operators import add, call, choose, negate, relation, subtract
from random_models.overruling import overruling
from random_models.tree import NOT, E, Model, map_expression, node
from random_models.twins import Twin

_OTHER = {"<": ">", "<=": ">=", ">": "<", ">=": "<="}
_STRUCTURAL = ("component.", "if.condition", "modification.structural", "sample.", "experiment.")
SHARE = 0.8
"""Of the forms, so that those that stay stand beside those that do not."""


def spelled_out(model: Model, random: Random) -> Twin | None:
    """Write what short forms mean."""
    changed = False

    def change(e: E) -> E:
        nonlocal changed
        other = _long(e) if random.random() < SHARE else None
        changed |= other is not None
        return e if other is None else other

    def at(e: E, place: str) -> E:
        return e if place.startswith(_STRUCTURAL) else map_expression(e, change)

    other = model.rebuilt(at)
    return Twin("spelled out", other) if changed else None


def said_plainly(model: Model, random: Random) -> Twin | None:
    """Spell a model out, or let texts of heirs overrule each other, or both."""
    twin = overruling(model, random) if random.random() < 0.6 else None
    whole = model if twin is None else twin.model
    return spelled_out(whole, random) or twin


def _long(e: E) -> E | None:
    """Return what a form means, None where it is as plain as it can be."""
    match e.kind:
        case "grad" | "div" | "curl" | "laplacian" if callable(e.data):
            written: E = e.data(*e.operands[1:])
            return written
        case "if.elseif":
            p, a, q, b, c = e.operands
            return choose(p, a, choose(q, b, c))
        case "<" | "<=" | ">" | ">=":
            return relation(_OTHER[e.kind], *reversed(e.operands))
        case "and" | "or":
            return _opposite(e)
        case "clamp":
            x, low, high = e.operands
            return call("min", call("max", x, low, dim=e.dim, value=max), high, dim=e.dim, value=min)
        case "deadzone":
            x, width = e.operands
            inner = call("max", x, negate(width), dim=e.dim, value=max)
            return subtract(x, call("min", inner, width, dim=e.dim, value=min))
        case "comprehension" if not e.shape and str(e).startswith("sum("):
            return _written_out(e)
        case "-" if not e.shape and e.operands[0].type == "real":
            a, b = e.operands
            return add(a, negate(b))
    return None


def _opposite(e: E) -> E:
    """Return ``not (not a or not b)`` for ``a and b``, and the other way round."""
    a, b = (
        node("not", "not ", (x, NOT), binding=NOT, type="boolean", value=lambda x: not x) for x in e.operands
    )
    word = "or" if e.kind == "and" else "and"
    strong = 2 if word == "and" else 1
    value = (lambda x, y: x or y) if word == "or" else (lambda x, y: x and y)
    inner = node(word, (a, strong), f" {word} ", (b, strong + 1), binding=strong, type="boolean", value=value)
    return node("not", "not ", (inner, NOT), binding=NOT, type="boolean", value=lambda x: not x)


def _written_out(e: E) -> E | None:
    """Return the terms of a sum over an index; None where something is called by the index."""
    name, indices, _ = e.data
    body = e.operands[0]
    if any(f"[{name}]" in str(x) or x.kind == "comprehension" for x in body.walk()):
        return None

    def term(i: int) -> E:
        number = node("number", str(i), value=lambda: i)
        return map_expression(body, lambda x: number if x.ref == name else x)

    total = term(indices[0])
    for i in indices[1:]:
        total = add(total, term(i))
    return total
