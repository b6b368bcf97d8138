"""Numbers with units in many writings, with their exact value in SI."""

from __future__ import annotations

from fractions import Fraction
from math import pi
from random import Random

from random_models.measures import put_together, sized
from random_models.tree import NUMBER, POWER_OF, SIGNED, TIME, Dim, E, dim, node

_F = Fraction
_MASSES = (("kg", _F(1)), ("g", _F(1, 1000)), ("t", _F(1000)))
_LENGTHS = (("m", _F(1)), ("cm", _F(1, 100)), ("mm", _F(1, 1000)), ("dm", _F(1, 10)), ("km", _F(1000)))
_TIMES = (("s", _F(1)), ("ms", _F(1, 1000)), ("min", _F(60)))
_CURRENTS = (("A", _F(1)), ("mA", _F(1, 1000)))
_NAMED: dict[Dim, tuple[tuple[str, Fraction], ...]] = {
    dim(1, 1, -2): (("N", _F(1)), ("kN", _F(1000)), ("mN", _F(1, 1000)), ("J/m", _F(1))),
    dim(1, 2, -2): (("J", _F(1)), ("N.m", _F(1)), ("kJ", _F(1000)), ("W.s", _F(1)), ("mJ", _F(1, 1000))),
    dim(1, 2, -3): (("W", _F(1)), ("kW", _F(1000)), ("J/s", _F(1)), ("N.m/s", _F(1))),
    dim(1, 0, -2): (("N/m", _F(1)), ("N/mm", _F(1000)), ("J/m^2", _F(1)), ("kN/m", _F(1000))),
    dim(1, 0, -1): (("N.s/m", _F(1)), ("kg/s", _F(1)), ("N/m.s", _F(0))),
    dim(1, 2, -1): (("N.m.s", _F(1)), ("J.s", _F(1))),
    dim(0, 0, -1): (("Hz", _F(0)), ("rad/s", _F(1)), ("s^-1", _F(1)), ("deg/s", _F(pi / 180))),
    dim(0, 0, -2): (("rad/s^2", _F(1)), ("s^-2", _F(1))),
    dim(1, -1, -2): (("Pa", _F(1)), ("kPa", _F(1000)), ("N/m^2", _F(1))),
    dim(0, 0, 1, 1): (("C", _F(1)), ("mC", _F(1, 1000))),
    dim(1, 0, -2, -1): (("T", _F(1)), ("mT", _F(1, 1000))),
    dim(0, 1, -1): (("m/s", _F(1)), ("km/h", _F(1000, 3600)), ("cm/s", _F(1, 100)), ("mm/ms", _F(1))),
}
# "N/m.s" and "Hz" would be other dimensions to a careless reader; they are left out here
_NAMED = {d: tuple(u for u in units if u[1]) for d, units in _NAMED.items()}


SHARE, IN_NUMBERS = 0.12, 0.01
"""Of the quantities, and of the bare numbers, in one of all units."""


def unit(d: Dim, random: Random) -> tuple[str, Fraction]:
    """Choose a unit of a dimension: its text and its size in SI."""
    if d in _NAMED and random.random() < 0.6:
        return random.choice(_NAMED[d])
    plain = random.random() < 0.5
    above: list[str] = []
    below: list[str] = []
    size = _F(1)
    for exponent, choices in zip(d, (_MASSES, _LENGTHS, _TIMES, _CURRENTS), strict=True):
        if not exponent:
            continue
        if exponent.denominator != 1:
            raise ValueError("rational exponents have no unit here")
        name, factor = choices[0] if plain or abs(exponent) > 2 else random.choice(choices[:3])
        size *= factor ** int(exponent)
        n = abs(int(exponent))
        power = "" if n == 1 else f"^{n}"
        if exponent > 0:
            above.append(name + power)
        elif above and random.random() < 0.8:
            below.append(name + power)
        else:
            above.append(f"{name}^-{n}")
    return ".".join(above) + "".join(f"/{b}" for b in below), size


def quantity(
    value: Fraction | float | int | str, d: Dim, random: Random | None = None, *, angle: bool = False
) -> E:
    """Write a number of SI in a unit of its dimension, in SI itself without ``random``; ``angle`` allows degrees."""
    si = _F(value) if not isinstance(value, float) else _F(str(value))
    negative = si < 0
    si = abs(si)
    if d == NUMBER and not (angle and random is not None and random.random() < 0.7):
        other = _elsewhere(si, d, random, IN_NUMBERS)
        return _sign(_bare(si, random), negative) if other is None else _literal(si, *other, d, negative)
    if random is None:
        return _literal(si, *_plain(d), d, negative)
    usual = random.choice((("deg", _F(pi / 180)), ("rad", _F(1)))) if d == NUMBER else unit(d, random)
    return _literal(si, *(_elsewhere(si, d, random, SHARE) or usual), d, negative)


def _elsewhere(si: Fraction, d: Dim, random: Random | None, share: float) -> tuple[str, Fraction] | None:
    """Choose now and then one of all units there are, by random numbers of its own: models keep all else.

    A time stays as exact as it is, so that ticks belong together.
    """
    if random is None:
        return None
    own = Random(hash(random.getstate()[1]))
    if own.random() >= share:
        return None
    if d == NUMBER and share != IN_NUMBERS:
        return sized(own.choice(("rad", "deg", "rev", "rev")), own)
    try:
        text, size = put_together(d, own)
    except ValueError:
        return None
    if d == NUMBER and any(angle in text for angle in ("rad", "deg", "rev")):
        return None  # no number: braces with a unit behind them have none inside
    return (text, size) if d != TIME or _F(_digits(si / size)) * size == si else None


def _plain(d: Dim) -> tuple[str, Fraction]:
    parts = [f"{name}^{e}" if e != 1 else name for e, name in zip(d, ("kg", "m", "s", "A"), strict=True) if e]
    return ".".join(parts), _F(1)


def _digits(x: Fraction) -> str:
    """Return a decimal text that is close to a number, and exact if it has few digits."""
    if x == 0:
        return "0"
    text = f"{float(x):.6g}"
    if "e" in text:
        mantissa, exponent = text.split("e")
        return f"{mantissa}e{int(exponent)}"
    return text


def _literal(si: Fraction, text: str, size: Fraction, d: Dim, negative: bool) -> E:
    digits = _digits(si / size)
    exact = _F(digits) * size
    e = node("quantity", f"{digits} {text}", dim=d, binding=POWER_OF, value=lambda: float(exact), data=exact)
    return _sign(e, negative)


def _bare(si: Fraction, random: Random | None) -> E:
    digits = _digits(si)
    if random is not None and random.random() < 0.1 and "." in digits and "e" not in digits:
        digits = digits.rstrip("0") + random.choice(("", "0", "e0"))
        digits = digits.removesuffix(".")
        digits = digits if not digits.endswith(".e0") else digits[:-3]
    exact = _F(digits)
    return node("number", digits, value=lambda: float(exact), data=exact)


def _sign(e: E, negative: bool) -> E:
    if not negative:
        return e
    return node("negate", "-", (e, SIGNED), dim=e.dim, binding=SIGNED, value=lambda x: -x)
