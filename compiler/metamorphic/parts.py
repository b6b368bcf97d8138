"""Integrals in two parts: a rule of fixed places that does not suffice gives another value for the sum of both."""

from __future__ import annotations

from fractions import Fraction
from random import Random

from msgspec.structs import replace

from ..flat import types
from ..flat.model import Expression, FlatModel, Quadrature
from .rewriting import number, product, rewritten, total, undrawn
from .twin import NotApplicable, Seen, Twin

SHARE = Fraction(3819660, 10_000_000)
"""Of the interval: the golden section, at which rules have none of their places in common."""


def integrals_in_parts(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Write the integral from a to b as that from a to c and that from c to b."""
    found = 0

    def change(e: Expression) -> Expression:
        nonlocal found
        if not isinstance(e, Quadrature):
            return e
        found += 1
        share = number(SHARE, types.NUMBER, e.span)
        between = total(e.lower, product(share, total(e.upper, e.lower, "subtract")))
        return total(replace(e, upper=between), replace(e, lower=between))

    made = rewritten(undrawn(model), change)
    if not found:
        raise NotApplicable("it has no definite integrals")
    return Twin("integrals in parts", "definite integrals as sums of two", made)
