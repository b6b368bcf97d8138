"""Units of another size: every quantity with a dimension is multiplied by powers of two."""

from __future__ import annotations

from fractions import Fraction
from random import Random

from msgspec.structs import replace

from ..flat.model import Expression, FlatModel, Kind, Literal, Variable
from .rewriting import rewritten, undrawn
from .twin import NotApplicable, Seen, Twin, size

POWERS = (-3, -2, 2, 3)


def other_units(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Multiply all quantities, so that every result is larger by its own power of two."""
    if model.dimensionless:
        raise NotApplicable("all of its quantities are pure numbers")
    if model.independent not in ("", "time"):
        raise NotApplicable(f"'{model.independent}' is not a time")
    kg, m, s, a = (2.0 ** random.choice(POWERS) for _ in range(4))
    factors = (kg, m, s, a)
    touched = False

    def change(e: Expression) -> Expression:
        nonlocal touched
        if not isinstance(e, Literal) or not isinstance(e.value, Fraction) or e.type.dimension.is_none:
            return e
        touched = True
        return replace(e, value=e.value * Fraction(size(e.type.dimension, factors)))

    made = rewritten(undrawn(model), change)
    if not touched:
        raise NotApplicable("all of its quantities are pure numbers")

    def sized(v: Variable) -> Variable:
        by = size(v.type.dimension, factors) if v.type.kind in (Kind.REAL, Kind.POINT) else 1.0
        given = v.attributes
        changed = {
            n: getattr(given, n) * by
            for n in ("nominal", "minimum", "maximum")
            if getattr(given, n) is not None
        }
        return replace(v, attributes=replace(given, **changed))

    made = replace(made, variables=tuple(sized(v) for v in made.variables))
    words = f"units of kg, m, s, A smaller by {kg:g}, {m:g}, {s:g}, {a:g}"
    return Twin("other units", words, made, factors=factors)
