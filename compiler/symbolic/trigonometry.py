"""Shorten sums of products of sines and cosines: ``cos(a)*cos(b) + sin(a)*sin(b)`` becomes ``cos(a - b)``.

Terms with the same other factors are brought together; their trigonometric part is a finite Fourier series, which is
unique, so that everything that cancels does. Of each part the shorter one is kept, the series or what stood there.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from functools import lru_cache

import sympy as sp

Angle = tuple[tuple[sp.Expr, sp.Rational], ...]
"""A linear combination: (what is multiplied, factor), in a fixed order."""

Series = dict[Angle, tuple[sp.Rational, sp.Rational]]
"""Real and imaginary part of the factor of exp(i angle)."""

HIGHEST = 6
"""Sines and cosines to a higher power are left as they are."""

_HALF = sp.Rational(1, 2)


def shorten(expression: sp.Expr) -> sp.Expr:
    """Return an equal sum, with what cancels gone and angles brought together."""
    parts: dict[sp.Expr, list[tuple[sp.Rational, tuple[sp.Expr, ...]]]] = defaultdict(list)
    logarithms = expression.has(sp.log)  # each hint walks through all, and that of logarithms several times
    for term in sp.Add.make_args(sp.expand(expression, log=logarithms, basic=False)):
        factor, others, waves = _apart(term)
        parts[others].append((factor, waves))
    return sp.Add(*(others * _shortest(terms) for others, terms in parts.items()))


def _apart(term: sp.Expr) -> tuple[sp.Rational, sp.Expr, tuple[sp.Expr, ...]]:
    """Return the rational factor of a term, its other factors, and its sines and cosines one by one."""
    factor, rest = term.as_coeff_Mul(rational=True)
    others, waves = [], []
    for part in sp.Mul.make_args(rest):
        base, power = part.as_base_exp()
        if isinstance(base, sp.sin | sp.cos) and power.is_Integer and 0 < power <= HIGHEST:
            waves += [base] * int(power)
        else:
            others.append(part)
    return factor, sp.Mul(*others), tuple(waves)


def _shortest(terms: Sequence[tuple[sp.Rational, tuple[sp.Expr, ...]]]) -> sp.Expr:
    plain = sp.Add(*(factor * sp.Mul(*waves) for factor, waves in terms))
    if len(terms) == 1 and len(terms[0][1]) < 2:  # that is its own series
        return plain
    series = _written(_sum(_product(factor, waves) for factor, waves in terms))
    return series if sp.count_ops(series) < sp.count_ops(plain) else plain


def _product(factor: sp.Rational, waves: Iterable[sp.Expr]) -> Series:
    series: Series = {(): (factor, sp.S.Zero)}
    for wave in waves:
        angle = _angle(wave.args[0])
        opposite = tuple((what, -count) for what, count in angle)
        grown: Series = {}
        for other, (re, im) in series.items():
            re, im = re * _HALF, im * _HALF
            if isinstance(wave, sp.cos):
                up, down = (re, im), (re, im)
            else:  # sin A = (exp(iA) - exp(-iA))/2i
                up, down = (im, -re), (-im, re)
            _add(grown, _added(other, angle), up)
            _add(grown, _added(other, opposite), down)
        series = grown
    return series


def _sum(parts: Iterable[Series]) -> Series:
    total: Series = {}
    for part in parts:
        for angle, value in part.items():
            _add(total, angle, value)
    return total


def _add(series: Series, angle: Angle, value: tuple[sp.Rational, sp.Rational]) -> None:
    re, im = series.get(angle, (sp.S.Zero, sp.S.Zero))
    series[angle] = (re + value[0], im + value[1])


@lru_cache(1000)
def _angle(argument: sp.Expr) -> Angle:
    found = sp.expand(argument).as_coefficients_dict()
    return tuple(sorted(found.items(), key=lambda item: item[0].sort_key()))


def _added(a: Angle, b: Angle) -> Angle:
    counts = dict(a)
    for what, count in b:
        counts[what] = counts.get(what, sp.S.Zero) + count
    return tuple(sorted(((w, c) for w, c in counts.items() if c), key=lambda item: item[0].sort_key()))


def _written(series: Series) -> sp.Expr:
    """Return the series in sines and cosines; each angle and its opposite make one term."""
    constant = series.get((), (sp.S.Zero,))[0]
    cosines: dict[sp.Expr, sp.Rational] = {}
    terms: list[sp.Expr] = []
    for angle, (re, im) in series.items():
        if not angle or angle[0][1] < 0:
            continue
        argument = sp.Add(*(count * what for what, count in angle))
        if re:
            cosines[argument] = 2 * re
        terms.append(-2 * im * sp.sin(argument))
    if len(cosines) == 1:
        ((argument, size),) = cosines.items()
        if size == constant:
            return sp.Add(2 * constant * sp.cos(argument / 2) ** 2, *terms)
        if size == -constant:
            return sp.Add(2 * constant * sp.sin(argument / 2) ** 2, *terms)
    return sp.Add(constant, *(size * sp.cos(argument) for argument, size in cosines.items()), *terms)
