"""Numbers, times, counts and units as people read them."""

from __future__ import annotations

import re

_FACTOR = re.compile(r"(^|[./])([^./^]+(?:\^(?:\([^)]*\)|-?\d+(?:\.\d+)?))?)")
"""A factor of a unit, with the sign before it."""


def number(value: float) -> str:
    """Return a number with seven digits, as short as possible."""
    return f"{value + 0.0:.7g}"  # no minus before a zero


def duration(seconds: float) -> str:
    """Return a time in the unit that suits its size: ``183 us``, ``2.1 ms``, ``3.4 s``, ``2 min 5 s``."""
    if seconds < 0.9995e-3:
        return f"{seconds * 1e6:.3g} us"
    if seconds < 0.9995:
        return f"{seconds * 1e3:.3g} ms"
    if seconds < 99.95:
        return f"{seconds:.3g} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s"


def count(value: int) -> str:
    """Return an integer with thin groups of three digits: ``12 345``."""
    return f"{value:,}".replace(",", " ")


def plural(n: int, word: str, words: str = "") -> str:
    """Return ``1 mass``, ``2 masses``: the plural is ``words``, or made as usual."""
    usual = word[:-1] + "ies" if word.endswith("y") else word + "s"
    return f"{n} {word if n == 1 else words or usual}"


def with_unit(unit: str) -> str:
    """Return what follows a number: a blank and its unit, nothing for a pure number."""
    return f" {as_quotient(unit)}" if unit and unit != "1" else ""


def unit_in_brackets(unit: str) -> str:
    """Return what follows a name at the head of a column."""
    return f" [{as_quotient(unit)}]" if unit and unit != "1" else ""


def as_quotient(unit: str) -> str:
    """Return a unit with one stroke at most: ``rad.s/kg/m^2`` as ``rad.s/(kg.m^2)``."""
    factors = _FACTOR.findall(unit)
    below = [symbol for sign, symbol in factors if sign == "/"]
    if len(below) < 2:
        return unit
    return f"{'.'.join(symbol for sign, symbol in factors if sign != '/')}/({'.'.join(below)})"
