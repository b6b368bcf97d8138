"""Functions by their identities: roots and exponentials by halves, sines by half angles, squares as products."""

from __future__ import annotations

from fractions import Fraction
from random import Random

from ..flat import types
from ..flat.model import Apply, Expression, FlatModel, Kind, Literal
from .rewriting import apply, half, number, product, rewritten, squared, total, undrawn
from .twin import NotApplicable, Seen, Twin


def functions_otherwise(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Write elementary functions by identities that hold everywhere, to rounding."""
    found: dict[str, None] = {}

    def change(e: Expression) -> Expression:
        other = _otherwise(e) if isinstance(e, Apply) else None
        if other is None:
            return e
        found[e.function] = None  # type: ignore[union-attr]
        return other

    made = rewritten(undrawn(model), change)
    if not found:
        raise NotApplicable("nothing is written by a root, an exponential, a sine, a cosine or a square")
    return Twin("functions otherwise", ", ".join(found) + " by identities", made)


def _otherwise(e: Apply) -> Expression | None:
    if e.type.kind is not Kind.REAL or e.type.shape:
        return None
    match e.function, e.arguments:
        case "sqrt", (a,):  # of four times as much, which is not a square of anything that stands there
            four = number(4, types.NUMBER, e.span)
            return half(apply("sqrt", types.numeric(e.type), product(four, a)))
        case "exp", (a,):
            return squared(apply("exp", types.NUMBER, half(a)))
        case "sin", (a,):
            both = product(apply("sin", types.NUMBER, half(a)), apply("cos", types.NUMBER, half(a)))
            return product(number(2, types.NUMBER, e.span), both)
        case "cos", (a,):
            s, c = (squared(apply(f, types.NUMBER, half(a))) for f in ("sin", "cos"))
            return total(c, s, "subtract")
        case "power", (a, Literal(value=Fraction(numerator=2, denominator=1))) if not a.type.shape:
            return product(a, a)
        case _:
            return None
