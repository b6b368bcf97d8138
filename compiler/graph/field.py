"""Values of expressions at a random point of the prime field F_p, p = 2^127 - 1.

Two rational functions of degree d that differ agree at a random point with probability <= d/p
(Schwartz, Zippel): with 1e5 nodes of degree 1e4 a false merge anywhere has probability below 1e-23.
One point of 127 bits is stronger than two of 61, and faster.

Since p = 3 mod 4, the circle x^2 + y^2 = 1 over F_p is a cyclic group of p + 1 = 2^127 points. An angle is
an exponent in Z/2^127 of a generator, sine and cosine are the coordinates of that point: addition
theorems hold exactly. All other functions are opaque: a hash of the operation and the values of its
arguments. (A square root in the field would be unsound: sqrt(x*x) would become x or -x at random.)
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from hashlib import blake2b
from math import pi
from typing import Final, NamedTuple

BITS: Final = 127
P: Final = (1 << BITS) - 1
HALF: Final = P >> 1
"""The larger half of the field holds the negatives of the smaller one."""
MASK: Final = P
"""Exponents of the circle group are taken modulo 2^127, so this is also their mask."""

_WINDOW: Final = 5
_DYADIC: Final = 32
"""Angles of symbols are multiples of 2^32: halving them that often stays exact."""
_MOST_DOUBLINGS: Final = 32
"""A symbol whose angle is doubled more often has too little of it left modulo 2^127 to tell angles apart."""
_ROUNDING: Final = Fraction(1, 1 << 51)
_FAR: Final = 1 << 24
"""Multiples of pi above it are not turns: one rounding takes them too far."""
_PI: Final = Fraction(pi)


def hashed(*parts: object) -> int:
    """Return a field element that depends on all parts, the same in every process."""
    digest = blake2b(repr(parts).encode(), digest_size=16).digest()
    return int.from_bytes(digest, "little") % P


def of_fraction(c: Fraction) -> int:
    """Return the residue of an exact rational. Raises ZeroDivisionError if p divides the denominator."""
    if c.denominator == 1:
        return c.numerator % P
    if c.denominator % P == 0:
        raise ZeroDivisionError("denominator vanishes in the field")
    return c.numerator * pow(c.denominator, -1, P) % P


class Angle(NamedTuple):
    """A linear function of symbols: ``free`` is its exponent, ``turns`` its constant part in units of pi.

    Neither is reduced modulo a full turn: half of (a + b) must be half of a plus half of b. ``doublings``: how often the
    symbol that is doubled most often is doubled.
    """

    free: Fraction | int
    turns: Fraction | int = 0
    doublings: int = 0

    def __add__(self, other: Angle) -> Angle:  # type: ignore[override]
        return Angle(self.free + other.free, self.turns + other.turns, max(self.doublings, other.doublings))

    def __sub__(self, other: Angle) -> Angle:
        return Angle(self.free - other.free, self.turns - other.turns, max(self.doublings, other.doublings))

    def __neg__(self) -> Angle:
        return Angle(-self.free, -self.turns, self.doublings)

    def scaled(self, factor: Fraction) -> Angle:
        doublings = self.doublings + _twos(factor.numerator) - _twos(factor.denominator)
        return Angle(_integer(self.free * factor), _integer(self.turns * factor), doublings)

    def exponent(self) -> int | None:
        """Return the exponent of the point on the circle, None if the group has no such point.

        A group of order 2^127 divides by odd numbers in one way, which is wrong for fractions of a turn.
        """
        twos = Fraction(self.turns) * (1 << (BITS - 1))
        if twos.denominator != 1 or not self.free.denominator & 1:
            return None
        free = self.free.numerator * pow(self.free.denominator, -1, 1 << BITS)
        return (free + twos.numerator) & MASK

    @property
    def is_lost(self) -> bool:
        """Whether scaling has left too little of a symbol: nothing of one over pi^2, the square of a double."""
        return self.doublings >= _MOST_DOUBLINGS and self.free != 0


def symbol_angle(name: str, seed: int) -> Angle:
    """Return the angle that a symbol stands for."""
    return Angle(hashed("angle", name, seed) << _DYADIC)


def opaque_angle(value: int, seed: int) -> Angle:
    """Return the angle of an expression that is not a linear function of symbols."""
    return Angle(hashed("angle of value", value, seed) << _DYADIC)


def constant_angle(c: Fraction, seed: int) -> Angle:
    """Return the angle of a constant.

    Rounded multiples of pi are fractions of a turn; any other constant is a multiple of one radian, which
    is independent of everything else.
    """
    turns = half_turns(c)
    if turns is not None:
        return Angle(0, turns)
    angle = symbol_angle("1 radian", seed).scaled(c)
    return symbol_angle(f"{c} radians", seed) if angle.is_lost else angle


def half_turns(c: Fraction) -> Fraction | None:
    """Return the multiple r of pi that c is up to rounding, with 24 r an integer; None if it is none."""
    r = Fraction(round(c / _PI * 24), 24)
    return r if abs(r) <= _FAR and abs(c - r * _PI) <= _ROUNDING * abs(c) else None


def _twos(n: int) -> int:
    """Return how often two divides a number; 0 for zero."""
    return (n & -n).bit_length() - 1 if n else 0


def _integer(x: Fraction) -> Fraction | int:
    return x.numerator if x.denominator == 1 else x


@lru_cache(maxsize=1)
def _powers() -> tuple[tuple[tuple[int, int], ...], ...]:
    """Return table[i][j] = generator^(j 32^i) as (cosine, sine)."""
    x, y = _generator()
    table = []
    for _ in range(-(-BITS // _WINDOW)):
        row = [(1, 0)]
        for _ in range((1 << _WINDOW) - 1):
            c, s = row[-1]
            row.append(((c * x - s * y) % P, (c * y + s * x) % P))
        table.append(tuple(row))
        c, s = row[-1]
        x, y = (c * x - s * y) % P, (c * y + s * x) % P
    return tuple(table)


def _generator() -> tuple[int, int]:
    """Return a point of order 2^127: ((1-t^2)/(1+t^2), 2t/(1+t^2)) that is not a square of the group."""
    t = 2
    while True:
        inverse = pow(1 + t * t, -1, P)
        x, y = (1 - t * t) * inverse % P, 2 * t * inverse % P
        # doubling the angle 126 times must end at -1, the only point of order two
        c, s = x, y
        for _ in range(BITS - 1):
            c, s = (c * c - s * s) % P, 2 * c * s % P
        if c == P - 1:
            return x, y
        t += 1


def circle(exponent: int) -> tuple[int, int]:
    """Return (cosine, sine) of the angle with this exponent."""
    c, s = 1, 0
    for row in _powers():
        digit = exponent & ((1 << _WINDOW) - 1)
        if digit:
            x, y = row[digit]
            c, s = (c * x - s * y) % P, (c * y + s * x) % P
        exponent >>= _WINDOW
        if not exponent:
            break
    return c, s
