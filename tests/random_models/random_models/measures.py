"""All units by their definitions, and units that are put together of any of them: ``W.s/mm``, ``V.C/dm``, ``mrad.m/K.kK``."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from fractions import Fraction
from math import pi
from random import Random

from random_models.tree import Dim, dim, over, to_power

F = Fraction
_TEN: dict[str, int] = {
    "": 0, "f": -15, "p": -12, "n": -9, "u": -6, "m": -3, "c": -2, "d": -1, "h": 2, "k": 3, "M": 6, "G": 9, "T": 12,
}  # fmt: skip
# symbol: size in SI by its definition, dimension, prefixes; sources: SI brochure (2019), IAU 2012 B2 (au), CODATA 2018 (eV)
UNITS: dict[str, tuple[Fraction, Dim, str]] = {
    "kg": (F(1), dim(1), ""), "g": (F(1, 1000), dim(1), "fpnumM"), "t": (F(1000), dim(1), "kM"),
    "m": (F(1), dim(0, 1), "fpnumcdkMG"), "au": (F(149_597_870_700), dim(0, 1), ""),
    "s": (F(1), dim(0, 0, 1), "fpnumkM"), "min": (F(60), dim(0, 0, 1), ""), "h": (F(60 * 60), dim(0, 0, 1), ""),
    "d": (F(24 * 60 * 60), dim(0, 0, 1), ""), "A": (F(1), dim(0, 0, 0, 1), "fpnumkM"),
    "rad": (F(1), dim(), "um"), "deg": (F(pi) / 180, dim(), ""), "rev": (2 * F(pi), dim(), ""),
    "rpm": (2 * F(pi) / 60, dim(0, 0, -1), ""), "Hz": (F(1), dim(0, 0, -1), "mkMGT"),
    "N": (F(1), dim(1, 1, -2), "pnumkMG"), "J": (F(1), dim(1, 2, -2), "pnumkMGT"),
    "eV": (F("1.602176634e-19"), dim(1, 2, -2), "mkMGT"), "W": (F(1), dim(1, 2, -3), "pnumkMGT"),
    "Pa": (F(1), dim(1, -1, -2), "numhkMGT"), "bar": (F(100_000), dim(1, -1, -2), "mk"),
    "C": (F(1), dim(0, 0, 1, 1), "pnumk"), "V": (F(1), dim(1, 2, -3, -1), "numkM"),
    "Ohm": (F(1), dim(1, 2, -3, -2), "umkMG"), "F": (F(1), dim(-1, -2, 4, 2), "fpnum"),
    "Wb": (F(1), dim(1, 2, -2, -1), "num"), "H": (F(1), dim(1, 2, -2, -2), "pnum"),
    "T": (F(1), dim(1, 0, -2, -1), "pnum"),
}  # fmt: skip
_INCH, _POUND = F("0.0254"), F("0.45359237")
SHOP: dict[str, tuple[Fraction, Dim, str]] = {
    "Nm": (F(1), dim(1, 2, -2), "numckM"), "l": (F(1, 1000), dim(0, 3), "umcdh"), "%": (F(1, 100), dim(), ""),
    "inch": (_INCH, dim(0, 1), ""), "ft": (F("0.3048"), dim(0, 1), ""), "mph": (F("0.44704"), dim(0, 1, -1), ""),
    "gal": (F("0.003785411784"), dim(0, 3), ""), "lb": (_POUND, dim(1), ""),
    "lbf": (F("4.4482216152605"), dim(1, 1, -2), "k"), "psi": (F("4.4482216152605") / _INCH**2, dim(1, -1, -2), ""),
    "hp": (550 * F("0.3048") * F("4.4482216152605"), dim(1, 2, -3), ""),
    "P": (F(1, 10), dim(1, -1, -1), "cm"), "St": (F(1, 10000), dim(0, 2, -1), "cm"),
}  # fmt: skip
"""Of workshops; sources: the agreement on yard and pound of 1959, NIST SP 811. Random models do without, so that they stay the same."""
CANCELLING: dict[str, str] = {"K": "numkM", "mol": "numk", "cd": "mk"}
"""Units that no quantity here has: they stand above and below the stroke."""
_BASE = ("kg", "m", "s", "A")

Units = Mapping[str, tuple[Fraction, Dim, str]]

Part = tuple[str, Fraction]
"""A unit with its exponent."""


def sized(symbol: str, random: Random, units: Units = UNITS) -> tuple[str, Fraction]:
    """Choose a prefix of a unit: its text, its size in SI."""
    size, _, prefixes = units[symbol]
    prefix = random.choice(("", *prefixes))
    return prefix + symbol, size * F(10) ** _TEN[prefix]


def measured(text: str) -> tuple[float, tuple[Fraction, ...]]:
    """Return the size in SI of a unit, and its exponents of kg, m, s and A; raises KeyError for what is none of these units."""
    size, exponents, below = 1.0, [F(0)] * len(_BASE), False
    for sign, name, power in re.findall(r"([./]?)([A-Za-z]+)(?:\^\(?(-?\d+(?:/\d+)?)\)?)?", text):
        below = sign == "/"
        exponent = F(power or 1) * (-1 if below else 1)
        symbol, prefix = next(
            (u, name[: len(name) - len(u)])
            for u in sorted(UNITS, key=len, reverse=True)
            if name.endswith(u) and name[: len(name) - len(u)] in ("", *UNITS[u][2])
        )
        one, own, _ = UNITS[symbol]
        size *= float(one * F(10) ** _TEN[prefix]) ** float(exponent)
        exponents = [a + exponent * b for a, b in zip(exponents, own, strict=True)]
    return size, tuple(exponents)


def put_together(d: Dim, random: Random, units: Units = UNITS) -> tuple[str, Fraction]:
    """Write a unit of a dimension by any unit, and by what is missing then: its text, its size in SI."""
    alike = [name for name, (_, own, _) in units.items() if own == d]
    symbol = random.choice(alike) if alike and random.random() < 0.6 else random.choice(list(units))
    name, size = sized(symbol, random, units)
    own = units[symbol][1]
    power = F(1) if symbol in alike else F(random.choice((1, 1, 1, -1, 2)))
    parts: list[Part] = [(name, power)]
    size **= int(power)
    for base, exponent in zip(_BASE, over(d, to_power(own, power)), strict=True):
        if exponent.denominator != 1:
            raise ValueError("rational exponents have no unit here")
        if exponent:
            name, one = (
                sized(_like(base, random, units), random, units) if abs(exponent) <= 3 else (base, F(1))
            )
            parts.append((name, exponent))
            size *= one ** int(exponent)
    if random.random() < 0.1:
        symbol = random.choice(list(CANCELLING))
        above, below = (random.choice(("", *CANCELLING[symbol])) for _ in range(2))
        parts += [(above + symbol, F(1)), (below + symbol, F(-1))]
        size *= F(10) ** (_TEN[above] - _TEN[below])
    if random.random() < 0.05:
        name, exponent = parts.pop()
        parts += [(name, exponent - F(1, 2)), (name, F(1, 2))]
    if random.random() < 0.5:
        random.shuffle(parts)
    return written(parts, random), size


def _like(base: str, random: Random, units: Units) -> str:
    """Choose a unit of the dimension of a base unit."""
    own = units[base][1]
    return random.choice([name for name, (_, there, _) in units.items() if there == own])


def written(parts: Sequence[Part], random: Random) -> str:
    """Write the product of powers of units, some of them behind strokes."""
    text = ""
    for name, exponent in parts:
        if not exponent:
            continue
        below = bool(text) and (random.random() < 0.7 if exponent < 0 else random.random() < 0.1)
        e = -exponent if below else exponent
        power = "" if e == 1 else f"^{e}" if e.denominator == 1 else f"^({e})"
        text += ("/" if below else "." if text else "") + name + power
    return text
