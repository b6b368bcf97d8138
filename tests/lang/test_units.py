"""Units against values known from the SI brochure, and the rules of their text."""

from __future__ import annotations

import math
import re
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mechc.lang.units import (
    DIMENSIONLESS,
    NAMED_TYPES,
    UNIT_NAMES,
    UNIT_PATTERN,
    Dimension,
    UnitError,
    parse_unit,
    parse_written_unit,
    preferred_unit,
    to_si,
    unit_end,
)


@pytest.mark.parametrize(
    ("text", "dimension", "factor"),
    [
        ("m", "m", 1),
        ("km/h", "m/s", Fraction(1000, 3600)),
        ("N.m/rad", "kg.m^2/s^2", 1),
        ("m^3/kg/s^2", "m^3/kg/s^2", 1),
        ("MV/m", "kg.m/s^3/A", 10**6),
        ("bar", "kg/m/s^2", 10**5),
        ("mT", "kg/s^2/A", Fraction(1, 1000)),
        ("Wb", "kg.m^2/s^2/A", 1),
        ("uF", "s^4.A^2/kg/m^2", Fraction(1, 10**6)),
        ("kOhm", "kg.m^2/s^3/A^2", 1000),
        ("H", "kg.m^2/s^2/A^2", 1),
        ("eV", "kg.m^2/s^2", Fraction("1.602176634e-19")),
        ("au", "m", 149597870700),
        ("t", "kg", 1000),
        ("d", "s", 86400),
        ("Mm", "m", 10**6),
        ("kK", "K", 1000),
        ("MA", "A", 10**6),
        ("ks", "s", 1000),
        ("kt", "kg", 10**6),
        ("m^-1", "1/m", 1),
        ("1/m", "1/m", 1),
        ("cm^2", "m^2", Fraction(1, 10000)),
        ("N/m^(1/2)", "kg.m^(1/2)/s^2", 1),
        ("1", "1", 1),
        ("mol.cd.K", "K.mol.cd", 1),
        ("Nm", "kg.m^2/s^2", 1),
        ("kNm/rad", "kg.m^2/s^2", 1000),
        ("ml/min", "m^3/s", Fraction(1, 60 * 10**6)),
        ("%", "1", Fraction(1, 100)),
        ("%/K", "1/K", Fraction(1, 100)),
        ("inch", "m", Fraction("0.0254")),
        ("ft", "m", Fraction("0.3048")),
        ("mph", "m/s", Fraction("0.44704")),
        ("gal", "m^3", Fraction("0.003785411784")),
        ("lb", "kg", Fraction("0.45359237")),
        ("lbf", "kg.m/s^2", Fraction("4.4482216152605")),
        ("hp", "kg.m^2/s^3", Fraction("745.69987158227022")),
        ("ft.lbf/rad", "kg.m^2/s^2", Fraction("1.3558179483314004")),
    ],
)
def test_dimension_and_factor(text: str, dimension: str, factor: Fraction) -> None:
    unit = parse_unit(text)
    assert str(unit.dimension) == dimension
    assert unit.factor == factor


def test_pressures_of_workshops() -> None:
    assert parse_unit("cP").factor == Fraction(1, 1000) and parse_unit("cSt").factor == Fraction(1, 10**6)
    assert float(parse_unit("psi").factor) == pytest.approx(6894.757293168361, rel=1e-15)  # NIST SP 811


def test_angles_are_numbers_that_remember() -> None:
    assert parse_unit("rad").dimension == DIMENSIONLESS
    assert float(parse_unit("deg").factor) == math.radians(1)
    assert float(60 * parse_unit("rpm").factor) == pytest.approx(2 * math.pi, rel=1e-15)
    assert parse_unit("rev/min").factor == parse_unit("rpm").factor
    assert [parse_unit(u).angle for u in ("deg", "rad/s", "rpm", "rad/s^2", "rad/m")] == [True] * 5
    assert [parse_unit(u).angle for u in ("Hz", "m", "N.m/rad", "rad^2")] == [False] * 4


def test_a_broken_power_of_a_prefix() -> None:
    assert float(parse_unit("mm^0.5").factor) == pytest.approx(math.sqrt(1e-3), rel=1e-15)


@pytest.mark.parametrize(
    ("text", "suggestion"),
    [
        ("metres", "m"),
        ("Seconds", "s"),
        ("Nms", "N.m.s"),
        ("litres", "l"),
        ("lbs", "lb"),
        ("inches", "inch"),
        ("kip", "klbf"),
        ("ftlb", "ft.lbf"),
        ("kmph", "km/h"),
        ("PS", ""),
        ("kG", "kg"),
        ("degrees", "deg"),
        ("newton/metre", "N/metre"),
        ("foo", ""),
        ("", ""),
        ("m/", ""),
        ("N m", ""),
        ("2", ""),
        ("m^n", ""),
        ("1/", ""),
        ("m^2^2", ""),
    ],
)
def test_no_unit(text: str, suggestion: str) -> None:
    with pytest.raises(UnitError) as caught:
        parse_unit(text)
    assert caught.value.suggestion == suggestion


def test_words_and_letters_that_are_no_units() -> None:
    for word in ("in", "at", "on", "to", "from", "x", "theta", "then", "pi", "e", "%%", "%x", "lx"):
        assert unit_end(word) == 0


@given(st.text(alphabet="mskgNraduhl%./^-()0123456789x ", max_size=12))
def test_unit_end_is_the_longest_match_of_the_pattern(text: str) -> None:
    match = re.match(UNIT_PATTERN, text)
    assert unit_end(text) == (match.end() if match else 0)


@given(st.lists(st.sampled_from(UNIT_NAMES), min_size=1, max_size=4), st.integers(-3, 3))
def test_products_of_units_multiply(names: list[str], power: int) -> None:
    text = ".".join(f"{n}^{power}" for n in names)
    dimension, factor = DIMENSIONLESS, Fraction(1)
    for name in names:
        dimension *= parse_unit(name).dimension ** power
        factor *= parse_unit(name).factor ** power
    assert parse_unit(text).dimension == dimension
    assert parse_unit(text).factor == factor


@given(st.lists(st.fractions(-3, 3, max_denominator=6), min_size=7, max_size=7))
def test_the_text_of_a_dimension_reads_back(exponents: list[Fraction]) -> None:
    kg, m, s, A, K, mol, cd = exponents
    dimension = DIMENSIONLESS * Dimension((kg, m, s, A, K, mol, cd))
    assert parse_unit(str(dimension)).dimension == dimension
    assert dimension**2 / dimension == dimension


def test_pretty() -> None:
    assert parse_unit("N").dimension.pretty() == "kg.m/s^2 (N)"
    assert parse_unit("J").dimension.pretty() == "kg.m^2/s^2 (J)"
    assert parse_unit("m").dimension.pretty() == "m"
    assert parse_unit("kg/s").dimension.pretty() == "kg/s"
    assert DIMENSIONLESS.pretty() == "1"


def test_preferred_units() -> None:
    shown = {
        u: preferred_unit(parse_unit(u).dimension, parse_unit(u).angle) for u in ("deg", "rpm", "km", "N.m")
    }
    assert shown == {"deg": "rad", "rpm": "rad/s", "km": "m", "N.m": "J"}
    assert preferred_unit(parse_unit("kg.m^2").dimension) == "kg.m^2"
    assert preferred_unit(DIMENSIONLESS) == "1"
    assert preferred_unit(parse_unit("N.s^3").dimension) == "kg.m.s"


def test_named_types() -> None:
    assert NAMED_TYPES["Torque"].unit == "N.m"
    assert NAMED_TYPES["Torque"].dimension == NAMED_TYPES["Energy"].dimension
    assert NAMED_TYPES["AngularVelocity"].angle
    assert not NAMED_TYPES["Frequency"].angle
    assert NAMED_TYPES["Real"].dimension.is_none
    for type in NAMED_TYPES.values():
        assert parse_unit(type.unit).factor == 1, f"{type.name} is not shown in SI"


def test_conversion() -> None:
    assert to_si(Fraction(80), parse_unit("cm")) == Fraction(4, 5)
    assert to_si(Fraction(36), parse_unit("km/h")) == 10


@pytest.mark.parametrize(
    ("written", "plain"),
    [
        ("°", "deg"),
        ("°/s", "deg/s"),
        ("µm", "um"),
        ("m/s²", "m/s^2"),
        ("N·m", "N.m"),
        ("Nm", "N.m"),
        ("kNm", "kN.m"),
        ("N m", "N.m"),
        ("m s", "m.s"),
        ("m / s", "m/s"),
        ("sec", "s"),
        ("degrees", "deg"),
        ("mm", "mm"),
        ("lb", "lb"),
    ],
)
def test_units_as_instruments_write_them(written: str, plain: str) -> None:
    found, expected = parse_written_unit(written), parse_unit(plain)
    assert (found.dimension, found.factor) == (expected.dimension, expected.factor)


@pytest.mark.parametrize("text", ["S", "M", "k", "n", "mmm", "°C", "lbs", ""])
def test_no_unit_of_an_instrument(text: str) -> None:
    with pytest.raises(UnitError):
        parse_written_unit(text)
