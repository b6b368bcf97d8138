"""Kinks written by ``if``: abs, min, max, clamp, deadzone."""

from __future__ import annotations

from random import Random

from ..flat import types
from ..flat.model import Apply, Element, Expression, FlatModel
from ..flat.subscripts import subscripts
from .asked import KINKS
from .rewriting import choice, compared, negative, number, rewritten, total, undrawn
from .twin import NotApplicable, Seen, Twin


def kinks_by_choice(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Write what bends by ``if``."""
    found: dict[str, None] = {}

    def change(e: Expression) -> Expression:
        if isinstance(e, Apply) and e.function in KINKS:
            found[e.function] = None
            return _chosen(e)
        return e

    changed = rewritten(undrawn(model), change)
    if not found:
        raise NotApplicable("nothing is written by " + ", ".join(KINKS))
    return Twin("kinks by if", ", ".join(found) + " written by if", changed)


def _chosen(e: Apply) -> Expression:
    a = _entries(e.arguments)
    match e.function:
        case "abs":
            zero = number(0, a[0].type, e.span)
            return choice(compared("greater_equal", a[0], zero), a[0], negative(a[0]))
        case "min" | "max":
            sign = "less" if e.function == "min" else "greater"
            found = a[0]
            for other in a[1:]:
                found = choice(compared(sign, found, other), found, other)
            return found
        case "clamp":
            x, low, high = a
            below, above = compared("less", x, low), compared("greater", x, high)
            return choice(below, low, choice(above, high, x))
        case _:
            x, width = a
            low = compared("less", x, negative(width))
            inner = choice(low, total(x, width), number(0, x.type, e.span))
            return choice(compared("greater", x, width), total(x, width, "subtract"), inner)


def _entries(arguments: tuple[Expression, ...]) -> tuple[Expression, ...]:
    """Return the numbers that are given, those of an array one by one."""
    found: list[Expression] = []
    for given in arguments:
        shape = given.type.shape
        found += [given] if not shape else []
        for index in subscripts(shape) if shape else ():
            one = types.element_of(given.type, len(index))
            found.append(Element(type=one, span=given.span, base=given, indices=index))
    return tuple(found)
