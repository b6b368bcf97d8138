"""Formulas as sums of products, so that like terms meet: what is not a sum or product stays as it is written."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from fractions import Fraction
from math import gcd, lcm

from .coefficients import LARGEST_DENOMINATOR

MOST_TERMS = 150
"""A formula that would have more terms is left as it is written."""

Monomial = tuple[tuple[str, Fraction], ...]
"""Factors with their powers, sorted by name."""

Number = Fraction | float
Polynomial = Mapping[Monomial, Number]

_NUMBER = re.compile(r"(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.IGNORECASE)
_NAME = re.compile(r"[A-Za-z_][\w.]*")
_MEMBER = re.compile(r"\.[A-Za-z_][\w.]*")


class _TooLong(Exception):
    pass


def read(text: str) -> Polynomial | None:
    """Take a formula apart; None where it has too many terms."""
    try:
        found, rest = _sum(text.replace(" ", ""), 0)
    except _TooLong:
        return None
    assert rest == len(text.replace(" ", "")), text
    return found


def _sum(text: str, at: int) -> tuple[Polynomial, int]:
    total: dict[Monomial, Number] = {}
    sign = 1
    if text[at : at + 1] in ("-", "+"):
        sign, at = (-1 if text[at] == "-" else 1), at + 1
    while True:
        one, at = _product(text, at)
        for monomial, value in one.items():
            total[monomial] = total.get(monomial, Fraction(0)) + sign * value
        if len(total) > MOST_TERMS:
            raise _TooLong
        if text[at : at + 1] not in ("+", "-") or at >= len(text):
            return {m: v for m, v in total.items() if v}, at
        sign, at = (-1 if text[at] == "-" else 1), at + 1


def _product(text: str, at: int) -> tuple[Polynomial, int]:
    result, at = _power(text, at)
    while text[at : at + 1] in ("*", "/") and at < len(text):
        divides = text[at] == "/"
        factor, at = _power(text, at + 1)
        result = multiplied(result, reciprocal(factor) if divides else factor)
    return result, at


def _power(text: str, at: int) -> tuple[Polynomial, int]:
    base, at = _atom(text, at)
    if text[at : at + 1] != "^":
        return base, at
    start = at + 1
    if text[start : start + 1] == "(":
        end = _closing(text, start) + 1
        exponent = text[start + 1 : end - 1]
    else:
        found = re.compile(r"[\w.]+").match(text, start)
        assert found, text
        end, exponent = found.end(), found[0]
    try:
        power = Fraction(exponent)
    except ValueError:
        return {((f"{_opaque(base)}^{text[start:end]}", Fraction(1)),): Fraction(1)}, end
    return raised(base, power), end


def _atom(text: str, at: int) -> tuple[Polynomial, int]:
    if text[at : at + 1] == "-":
        inner, at = _power(text, at + 1)
        return {m: -v for m, v in inner.items()}, at
    if text[at : at + 1] == "(":
        inner, end = _sum(text, at + 1)
        assert text[end] == ")", text
        return inner, end + 1
    number = _NUMBER.match(text, at)
    if number:
        exact = Fraction(number[0])
        return {(): exact if exact.denominator <= 10**4 else float(number[0])} if exact else {}, number.end()
    name = _NAME.match(text, at)
    assert name, (text, at)
    end = name.end()
    while True:
        if text[end : end + 1] in ("(", "["):  # der(R)[3], f(x)
            end = _closing(text, end) + 1
        elif member := _MEMBER.match(text, end):  # part[2].angle
            end = member.end()
        else:
            break
    written = re.sub(r"(?<=[\w)\]])([+-])(?=[\w(])", r" \1 ", text[at:end])
    return {((written, Fraction(1)),): Fraction(1)}, end


def _closing(text: str, at: int) -> int:
    depth = 0
    for k in range(at, len(text)):
        depth += (text[k] in "([") - (text[k] in ")]")
        if depth == 0:
            return k
    raise AssertionError(text)


def multiplied(a: Polynomial, b: Polynomial) -> Polynomial:
    """Return the product of two sums."""
    if len(a) * len(b) > 4 * MOST_TERMS:
        raise _TooLong
    total: dict[Monomial, Number] = {}
    for one, value in a.items():
        for other, factor in b.items():
            powers = dict(one)
            for name, power in other:
                powers[name] = powers.get(name, Fraction(0)) + power
            key = tuple(sorted((n, p) for n, p in powers.items() if p))
            total[key] = total.get(key, Fraction(0)) + value * factor
    return {m: v for m, v in total.items() if v}


def reciprocal(a: Polynomial) -> Polynomial:
    """Return 1/a; a sum of several terms becomes one factor."""
    return raised(a, Fraction(-1))


def raised(a: Polynomial, power: Fraction) -> Polynomial:
    """Return a^power: expanded for small whole powers, else as powers of factors."""
    if len(a) == 1:
        ((monomial, value),) = a.items()
        if power.denominator == 1:
            number: Number = value ** int(power)
            return {tuple((n, p * power) for n, p in monomial): number}
        if value == 1:
            return {tuple((n, p * power) for n, p in monomial): Fraction(1)}
    if power in (2, 3):
        result = a
        for _ in range(int(power) - 1):
            result = multiplied(result, a)
        return result
    return {((f"({shown(a)})", power),): Fraction(1)}


def _opaque(a: Polynomial) -> str:
    text = shown(a)
    return text if _NAME.fullmatch(text) else f"({text})"


def shown(a: Polynomial, order: Callable[[str], tuple[object, ...]] = lambda name: (name,)) -> str:
    """Return the text of a sum of products; ``order`` sorts factors."""
    text = ""
    for monomial, value in a.items():
        size: Number = -value if value < 0 else value
        one, negative = _term(monomial, size, order), value < 0
        text += (f" - {one}" if negative else f" + {one}") if text else (f"-{one}" if negative else one)
    return text or "0"


def _term(monomial: Monomial, size: Number, order: Callable[[str], tuple[object, ...]]) -> str:
    factors = sorted(monomial, key=lambda item: order(item[0]))
    above = [_factor(n, p) for n, p in factors if p > 0]
    below = [_factor(n, -p) for n, p in factors if p < 0]
    if isinstance(size, float):
        front = f"{size:.8g}"
    elif size.denominator <= LARGEST_DENOMINATOR:
        front = str(size)
    else:
        front = f"{float(size):.10g}"
    upper = "*".join(above) if front == "1" and above else "*".join([front, *above])
    if not below:
        return upper
    return f"{upper}/{below[0]}" if len(below) == 1 else f"{upper}/({'*'.join(below)})"


def _factor(name: str, power: Fraction) -> str:
    if power == 1:
        return name
    return f"{name}^{power}" if power.denominator == 1 else f"{name}^({power})"


def cleared(a: Polynomial, names: Collection[str], leads: Callable[[Monomial], bool]) -> Polynomial:
    """Return a sum without fractions: times what its numbers and the given ``names`` are divided by, and without what
    all terms have of these; the first term that ``leads`` is positive."""
    lowest: dict[str, Fraction] = {}
    for name in {n for monomial in a for n, _ in monomial if n in names}:
        lowest[name] = min(dict(monomial).get(name, Fraction(0)) for monomial in a)
    front = {tuple(sorted((n, -p) for n, p in lowest.items() if p)): Fraction(1)}
    result = multiplied(a, front)
    exact = [v for v in result.values() if isinstance(v, Fraction)]
    if len(exact) == len(result):
        below = lcm(*(v.denominator for v in exact))
        above = gcd(*(int(v * below) for v in exact))
        if below <= LARGEST_DENOMINATOR:
            result = {m: v * below / above for m, v in result.items()}
    first = next((v for m, v in result.items() if leads(m)), next(iter(result.values())))
    return {m: -v for m, v in result.items()} if first < 0 else result
