"""Dimensions, units and named types: the closed vocabulary of quantities.

Everything here comes from the tables below. The dimension of an angle is 1; that a quantity
was given in radians is remembered beside it, for display only.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from fractions import Fraction
from functools import cache, lru_cache

from msgspec import Struct

from mechc.suggest import closest

Exponent = int | Fraction

BASE = ("kg", "m", "s", "A", "K", "mol", "cd")


def _exponent(value: Exponent) -> Exponent:
    """Return an integer wherever the value is one."""
    return value.numerator if value.denominator == 1 else value


class Dimension(Struct, frozen=True):
    """Exponents of kg, m, s, A, K, mol and cd. ``str`` gives ``kg.m/s^2``."""

    exponents: tuple[Exponent, Exponent, Exponent, Exponent, Exponent, Exponent, Exponent]

    def __mul__(self, other: Dimension) -> Dimension:
        return _product(self, other)

    def __truediv__(self, other: Dimension) -> Dimension:
        return _quotient(self, other)

    def __pow__(self, power: Exponent) -> Dimension:
        return _raised(self, power)

    @property
    def is_none(self) -> bool:
        """True for a pure number."""
        return not any(self.exponents)

    def __str__(self) -> str:
        above = [_power(u, e) for u, e in zip(BASE, self.exponents, strict=True) if e > 0]
        below = [_power(u, -e) for u, e in zip(BASE, self.exponents, strict=True) if e < 0]
        return "/".join([".".join(above) or "1", *below])

    def pretty(self) -> str:
        """Return the base units and, where there is one, the name: ``kg.m/s^2 (N)``."""
        name = _unit_of().get(self)
        base = str(self)
        return base if name is None or name == base else f"{base} ({name})"


def _dimension(exponents: list[Exponent]) -> Dimension:
    kg, m, s, A, K, mol, cd = (_exponent(e) for e in exponents)
    return Dimension((kg, m, s, A, K, mol, cd))


@lru_cache(maxsize=1024)
def _product(a: Dimension, b: Dimension) -> Dimension:
    return _dimension([x + y for x, y in zip(a.exponents, b.exponents, strict=True)])


@lru_cache(maxsize=1024)
def _quotient(a: Dimension, b: Dimension) -> Dimension:
    return _dimension([x - y for x, y in zip(a.exponents, b.exponents, strict=True)])


@lru_cache(maxsize=1024)
def _raised(dimension: Dimension, power: Exponent) -> Dimension:
    return _dimension([x * power for x in dimension.exponents])


def _power(symbol: str, exponent: Exponent) -> str:
    if exponent == 1:
        return symbol
    return f"{symbol}^{exponent}" if isinstance(exponent, int) else f"{symbol}^({exponent})"


DIMENSIONLESS = Dimension((0, 0, 0, 0, 0, 0, 0))


class Unit(Struct, frozen=True):
    """``factor`` times the SI unit of ``dimension``; ``angle`` marks rad, deg, rev/s and the like."""

    symbol: str
    dimension: Dimension
    factor: Fraction
    angle: bool = False


class UnitError(ValueError):
    """A text is not a unit; ``suggestion`` is a unit that may have been meant, or empty."""

    def __init__(self, message: str, suggestion: str = "") -> None:
        super().__init__(message)
        self.suggestion = suggestion


# ---------------------------------------------------------------- the tables

_PI = Fraction(math.pi)
_INCH, _POUND, _STANDARD_GRAVITY = Fraction(254, 10_000), Fraction("0.45359237"), Fraction("9.80665")
_PREFIXES: Mapping[str, Fraction] = {
    "f": Fraction(1, 10**15),
    "p": Fraction(1, 10**12),
    "n": Fraction(1, 10**9),
    "u": Fraction(1, 10**6),
    "m": Fraction(1, 1000),
    "c": Fraction(1, 100),
    "d": Fraction(1, 10),
    "h": Fraction(100),
    "k": Fraction(1000),
    "M": Fraction(10**6),
    "G": Fraction(10**9),
    "T": Fraction(10**12),
}

# symbol: (exponents of the base units, factor, exponent of the angle, usual prefixes)
_TABLE: Mapping[str, tuple[str, Fraction, int, str]] = {
    "kg": ("kg", Fraction(1), 0, ""),
    "g": ("kg", Fraction(1, 1000), 0, "fpnumM"),
    "t": ("kg", Fraction(1000), 0, "kM"),
    "m": ("m", Fraction(1), 0, "fpnumcdkMG"),
    "au": ("m", Fraction(149597870700), 0, ""),
    "s": ("s", Fraction(1), 0, "fpnumkM"),
    "min": ("s", Fraction(60), 0, ""),
    "h": ("s", Fraction(3600), 0, ""),
    "d": ("s", Fraction(86400), 0, ""),
    "A": ("A", Fraction(1), 0, "fpnumkM"),
    "K": ("K", Fraction(1), 0, "numkM"),
    "mol": ("mol", Fraction(1), 0, "numk"),
    "cd": ("cd", Fraction(1), 0, "mk"),
    "rad": ("", Fraction(1), 1, "um"),
    "deg": ("", _PI / 180, 1, ""),
    "rev": ("", 2 * _PI, 1, ""),
    "rpm": ("s^-1", 2 * _PI / 60, 1, ""),
    "Hz": ("s^-1", Fraction(1), 0, "mkMGT"),
    "N": ("kg m s^-2", Fraction(1), 0, "pnumkMG"),
    "J": ("kg m^2 s^-2", Fraction(1), 0, "pnumkMGT"),
    "eV": ("kg m^2 s^-2", Fraction("1.602176634e-19"), 0, "mkMGT"),
    "W": ("kg m^2 s^-3", Fraction(1), 0, "pnumkMGT"),
    "Pa": ("kg m^-1 s^-2", Fraction(1), 0, "numhkMGT"),
    "P": ("kg m^-1 s^-1", Fraction(1, 10), 0, "cm"),
    "St": ("m^2 s^-1", Fraction(1, 10**4), 0, "cm"),
    "bar": ("kg m^-1 s^-2", Fraction(10**5), 0, "mk"),
    "C": ("A s", Fraction(1), 0, "pnumk"),
    "V": ("kg m^2 s^-3 A^-1", Fraction(1), 0, "numkM"),
    "Ohm": ("kg m^2 s^-3 A^-2", Fraction(1), 0, "umkMG"),
    "F": ("kg^-1 m^-2 s^4 A^2", Fraction(1), 0, "fpnum"),
    "Wb": ("kg m^2 s^-2 A^-1", Fraction(1), 0, "num"),
    "H": ("kg m^2 s^-2 A^-2", Fraction(1), 0, "pnum"),
    "T": ("kg s^-2 A^-1", Fraction(1), 0, "pnum"),
    # of workshops and test benches; exact by definition
    "Nm": ("kg m^2 s^-2", Fraction(1), 0, "numckM"),
    "l": ("m^3", Fraction(1, 1000), 0, "umcdh"),
    "%": ("", Fraction(1, 100), 0, ""),
    "inch": ("m", _INCH, 0, ""),
    "ft": ("m", 12 * _INCH, 0, ""),
    "mph": ("m s^-1", 63360 * _INCH / 3600, 0, ""),
    "gal": ("m^3", 231 * _INCH**3, 0, ""),
    "lb": ("kg", _POUND, 0, ""),
    "lbf": ("kg m s^-2", _POUND * _STANDARD_GRAVITY, 0, "k"),
    "psi": ("kg m^-1 s^-2", _POUND * _STANDARD_GRAVITY / _INCH**2, 0, ""),
    "hp": ("kg m^2 s^-3", 550 * 12 * _INCH * _POUND * _STANDARD_GRAVITY, 0, ""),
}


class _Symbol(Struct, frozen=True):
    dimension: Dimension
    factor: Fraction
    angle: int


def _base_dimension(text: str) -> Dimension:
    exponents: list[Exponent] = [0] * len(BASE)
    for piece in text.split():
        symbol, _, power = piece.partition("^")
        exponents[BASE.index(symbol)] = int(power or 1)
    return _dimension(exponents)


_SYMBOLS: Mapping[str, tuple[str, str]] = {
    prefix + symbol: (prefix, symbol) for symbol, row in _TABLE.items() for prefix in ("", *row[3])
}
"""By each single unit with its prefix: the prefix, and the unit without."""


@cache
def _symbol(name: str) -> _Symbol:
    prefix, symbol = _SYMBOLS[name]
    base, factor, angle, _ = _TABLE[symbol]
    return _Symbol(_base_dimension(base), _PREFIXES[prefix] * factor if prefix else factor, angle)


UNIT_NAMES = tuple(sorted(_SYMBOLS))
PREFIXES: Mapping[str, tuple[str, ...]] = {symbol: tuple(row[3]) for symbol, row in _TABLE.items()}
"""Units -> the prefixes that each takes."""
"""Every single unit with its prefixes: what may stand between the dots and strokes."""

_ONE = "(?:" + "|".join(sorted(_SYMBOLS, key=lambda s: (-len(s), s))) + r")(?![A-Za-z0-9_%])"
_EXPONENT = r"\^(?:-?\d{1,3}(?:\.\d{1,3})?(?!\.?\d|[A-Za-z_])|\(-?\d{1,3}/[1-9]\d{0,2}\))"

UNIT_PATTERN = rf"{_ONE}(?:{_EXPONENT})?(?:[./]{_ONE}(?:{_EXPONENT})?)*"
"""Regular expression, without groups, of a unit in a model: ``kg.m^2/s``. For editors and tests;
``unit_end`` finds the same and need not compile it."""

_STEP = re.compile(rf"([A-Za-z]+|%)(?![A-Za-z0-9_%])({_EXPONENT})?")


def unit_end(text: str, start: int = 0) -> int:
    """Return where the longest unit that begins at ``start`` ends; ``start`` itself if there is none."""
    end = position = start
    while (step := _STEP.match(text, position)) and step[1] in _SYMBOLS:
        end = step.end()
        if text[end : end + 1] not in (".", "/"):
            break
        position = end + 1
    return end


_SPELLED_OUT: Mapping[str, str] = {
    "metre": "m", "meter": "m", "second": "s", "sec": "s", "minute": "min", "hour": "h", "hr": "h",
    "day": "d", "kilogram": "kg", "kilo": "kg", "gram": "g", "gramme": "g", "ton": "t", "tonne": "t",
    "newton": "N", "joule": "J", "watt": "W", "pascal": "Pa", "radian": "rad", "degree": "deg",
    "hertz": "Hz", "volt": "V", "ampere": "A", "amp": "A", "kelvin": "K", "tesla": "T", "coulomb": "C",
    "farad": "F", "henry": "H", "weber": "Wb", "ohm": "Ohm", "millimetre": "mm", "millimeter": "mm",
    "centimetre": "cm", "centimeter": "cm", "kilometre": "km", "kilometer": "km", "millisecond": "ms",
    "turn": "rev", "revolution": "rev", "Ns": "N.s", "mps": "m/s", "kmh": "km/h", "L": "l", "litre": "l",
    "liter": "l", "percent": "%", "pound": "lb", "lbm": "lb", "foot": "ft", "feet": "ft", "inche": "inch",
    "gallon": "gal", "horsepower": "hp", "kip": "klbf", "ksi": "klbf/inch^2", "ftlb": "ft.lbf", "lbft": "lbf.ft",
    "inlb": "inch.lbf", "NM": "Nm", "kmph": "km/h", "kmps": "km/s",
    "kph": "km/h", "hz": "Hz", "n": "N", "j": "J", "w": "W", "k": "K", "S": "s", "M": "m", "KG": "kg",
}  # fmt: skip


TEMPERATURES = ("degc", "degf", "celsius", "fahrenheit")
"""Scales whose zero is not that of K, in small letters: no units."""


_CUSTOMARY = ("in", "yd", "mi", "oz", "ps", *TEMPERATURES)
"""Units that are not others misspelt, so that none is guessed for them."""


_FACTOR = r"rad|deg|min|[mc]m|kg|[msh]"
_GLUED = rf"([kmM]?[NJWAV]|[kM]?Pa|kg)((?:{_FACTOR})+)(?<!kgs)"
"""Products without their points, as in ``Nms`` or ``kWh``; ``kgs`` is a plural."""


def suggest_unit(text: str) -> str:
    """Return the unit that ``text`` may have meant, or an empty string."""
    if text in _SPELLED_OUT:
        return _SPELLED_OUT[text]
    singular = text.casefold().removesuffix("s")
    if singular in _SPELLED_OUT:
        return _SPELLED_OUT[singular]
    if len(text) == 1 or text.casefold() in _CUSTOMARY:
        return ""
    if glued := re.fullmatch(_GLUED, text):
        return ".".join([glued[1], *re.findall(_FACTOR, glued[2])])
    near = closest(text, [*UNIT_NAMES, *(w for w in _SPELLED_OUT if len(w) > 4)]) or ""
    return _SPELLED_OUT.get(near, near)


@lru_cache(maxsize=1024)
def parse_unit(text: str) -> Unit:
    """Read a unit such as ``N.m/rad``, ``m^3/kg/s^2``, ``1/m`` or ``1``.

    Raises UnitError, with a suggestion where one is near.
    """
    if text == "1":
        return Unit(text, DIMENSIONLESS, Fraction(1))
    begin = len("1/") if text.startswith("1/") else 0
    if begin == len(text) or unit_end(text, begin) != len(text):
        raise _unit_error(text)
    position = max(begin - 1, 0)  # at the stroke of 1/s, which inverts what follows
    dimension, factor, angle = DIMENSIONLESS, Fraction(1), Fraction(0)
    scale = 1.0
    while position < len(text):
        inverse = text[position] == "/"
        step = _STEP.match(text, position + (text[position] in "./"))
        assert step is not None
        power = Fraction(step[2].strip("^()")) if step[2] else Fraction(1)
        if inverse:
            power = -power
        symbol = _symbol(step[1])
        dimension *= symbol.dimension ** _exponent(power)
        angle += symbol.angle * power
        if power.denominator == 1:
            factor *= symbol.factor**power.numerator
        else:
            scale *= float(symbol.factor) ** float(power)
        position = step.end()
    return Unit(text, dimension, factor * Fraction(scale) if scale != 1.0 else factor, angle == 1)


_SIGNS = str.maketrans(
    {
        "°": "deg",
        "µ": "u",
        "μ": "u",
        "²": "^2",
        "³": "^3",
        "·": ".",
        "⋅": ".",
        "*": ".",
        "Ω": "Ohm",
        " ": ".",
    }
)
"""Signs that instruments write in units, and what the language writes."""


def parse_written_unit(text: str) -> Unit:
    """Read a unit as instruments and spreadsheets write it: ``°/s``, ``µm``, ``m/s²``, ``Nm``, ``sec``. Raises UnitError."""
    plain = re.sub(r"\s*([/.*^])\s*", r"\1", text.strip()).translate(_SIGNS)
    try:
        return parse_unit(plain)
    except UnitError:
        meant = _SPELLED_OUT.get(plain) if len(plain) > 2 or plain in ("Nm", "Ns") else None
        meant = meant or _SPELLED_OUT.get(plain.casefold().removesuffix("s") if len(plain) > 3 else "")
        if glued := re.fullmatch(_GLUED, plain):
            meant = ".".join([glued[1], *re.findall(_FACTOR, glued[2])])
        if meant is None:
            raise
        return parse_unit(meant)


_TURNS = re.compile(r"Hz|\bmin\b|\bh\b")


def may_count_turns(unit: Unit, wanted: Unit) -> bool:
    """Tell whether hertz or something per minute is given for a rate of an angle: they have its dimension, but a turn is 2 pi rad."""
    return wanted.angle and not unit.angle and _TURNS.search(unit.symbol) is not None


def is_written_unit(text: str) -> bool:
    """Tell whether a text is a unit, as instruments write them."""
    try:
        parse_written_unit(text)
    except UnitError:
        return False
    return True


def _unit_error(text: str) -> UnitError:
    for word in re.findall(r"(?<![\w^])[^\W\d_]+", text):
        if word not in _SYMBOLS:
            suggestion = suggest_unit(word)
            return UnitError(f"unknown unit '{word}'", text.replace(word, suggestion) if suggestion else "")
    return UnitError(f"'{text}' is not a unit" if text else "a unit is missing")


# ---------------------------------------------------------------- named types


class NamedType(Struct, frozen=True):
    """A type of the language: its dimension, the SI unit it is shown in, and the angle mark."""

    name: str
    dimension: Dimension
    unit: str
    angle: bool


_TYPE_UNITS: Mapping[str, str] = {
    "Real": "1", "Integer": "1", "Boolean": "1",
    "Length": "m", "Area": "m^2", "Volume": "m^3", "Mass": "kg", "Time": "s", "Angle": "rad",
    "Velocity": "m/s", "Acceleration": "m/s^2", "Jerk": "m/s^3",
    "AngularVelocity": "rad/s", "AngularAcceleration": "rad/s^2", "Frequency": "Hz",
    "Force": "N", "Torque": "N.m", "Energy": "J", "Power": "W", "Action": "J.s",
    "Momentum": "kg.m/s", "AngularMomentum": "kg.m^2/s", "Impulse": "N.s", "AngularImpulse": "N.m.s",
    "Inertia": "kg.m^2", "Stiffness": "N/m", "RotationalStiffness": "N.m/rad",
    "Damping": "N.s/m", "RotationalDamping": "N.m.s/rad", "FlexuralRigidity": "N.m^2",
    "Density": "kg/m^3", "LineDensity": "kg/m", "AreaDensity": "kg/m^2",
    "Pressure": "Pa", "Stress": "Pa", "DynamicViscosity": "Pa.s", "KinematicViscosity": "m^2/s",
    "Curvature": "1/m", "MassFlow": "kg/s", "VolumeFlow": "m^3/s",
    "Temperature": "K", "Amount": "mol", "LuminousIntensity": "cd",
    "Charge": "C", "Current": "A", "Voltage": "V", "Resistance": "Ohm", "Capacitance": "F",
    "Inductance": "H", "MagneticField": "T", "MagneticFlux": "Wb", "ElectricField": "V/m",
}  # fmt: skip


class _NamedTypes(Mapping[str, NamedType]):
    """The types by their names, each read when it is first asked for."""

    def __init__(self) -> None:
        self._read: dict[str, NamedType] = {}

    def __getitem__(self, name: str) -> NamedType:
        if name not in self._read:
            text = _TYPE_UNITS[name]
            unit = parse_unit(text)
            self._read[name] = NamedType(name, unit.dimension, text, unit.angle)
        return self._read[name]

    def __contains__(self, name: object) -> bool:
        return name in _TYPE_UNITS

    def __iter__(self) -> Iterator[str]:
        return iter(_TYPE_UNITS)

    def __len__(self) -> int:
        return len(_TYPE_UNITS)


NAMED_TYPES: Mapping[str, NamedType] = _NamedTypes()

# The unit shown for a dimension: the first entry of each wins.
_SHOWN = (
    "m", "kg", "s", "A", "K", "mol", "cd", "N", "J", "W", "Pa", "C", "V", "Ohm", "F", "Wb", "H", "T",
    "m/s", "m/s^2", "m^2", "m^3", "kg.m^2", "kg.m/s", "kg.m^2/s", "kg/m", "kg/m^3", "N/m", "kg/s",
    "Pa.s", "V/m", "1/s", "1/s^2",
)  # fmt: skip
_SHOWN_ANGLES = ("rad", "rad/s", "rad/s^2", "rad/s^3", "rad/m")


@cache
def _unit_of() -> Mapping[Dimension, str]:
    return {parse_unit(text).dimension: text for text in reversed(_SHOWN)}


@cache
def _angle_unit_of() -> Mapping[Dimension, str]:
    return {parse_unit(text).dimension: text for text in _SHOWN_ANGLES}


def preferred_unit(dimension: Dimension, angle: bool = False) -> str:
    """Return the SI unit to show a quantity in: ``N``, ``rad/s``, ``kg.m^2``; ``1`` for a pure number."""
    if angle and dimension in _angle_unit_of():
        return _angle_unit_of()[dimension]
    return _unit_of().get(dimension) or str(dimension)


def unit_of(dimension: Dimension, angle: bool = False, written: str = "") -> str:
    """Return the SI unit of a dimension as text: empty for a pure number, ``rad`` for an angle.

    ``written``: the unit that the user chose; it is kept where it is one of SI, as N.m for a torque.
    """
    if dimension == DIMENSIONLESS:
        return "rad" if angle else ""
    if written and parse_unit(written).factor == 1:
        return written
    return preferred_unit(dimension, angle)


def to_si(value: Fraction, unit: Unit) -> Fraction:
    """Convert a number given in ``unit`` to SI, exactly."""
    return value * unit.factor
