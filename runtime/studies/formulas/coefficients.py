"""Numbers recognised: fractions, and products of powers of parameters, from their values at other parameters."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from ...numerics.rank import FORMULAS, rank, solve
from ...problem import Array

LARGEST_DENOMINATOR = 60
EXACT = 1e-7
"""Relative difference from what a number is recognised as; null spaces have some ten digits."""

HALVES = 2
"""Exponents are multiples of one half."""


def fraction(value: float) -> Fraction | None:
    """Return the fraction of a small denominator that a number is; None if it is none."""
    if not np.isfinite(value) or abs(value) > 1e6:
        return None
    found = Fraction(value).limit_denominator(LARGEST_DENOMINATOR)
    return found if found and abs(float(found) - value) <= EXACT * abs(value) else None


def recognised(values: Array, parameters: Array, names: Sequence[str]) -> str | None:
    """Return the formula of a number from its values [n] at parameters [n, k]; None if it is not recognised.

    Tried in this order: a fraction; a fraction times powers of parameters; a sum of parameters with fractions, its
    reciprocal, and such a sum times powers of parameters that are products of two. The first row may be special.
    """
    number = fraction(float(values[-1]))
    if number is not None and np.abs(values - values[-1]).max() <= EXACT * abs(values[-1]):
        return shown(number)
    found = _monomial(values, parameters, names)
    if found is not None:
        return found
    columns, texts = _sums(parameters, names)
    for power, form in ((1, "{}"), (-1, "1/({})"), (2, "sqrt({})")):
        with np.errstate(all="ignore"):
            wanted = values**power
        text = _sum(wanted, columns, texts)
        if text is not None:
            return form.format(text)
    return None


def _monomial(values: Array, parameters: Array, names: Sequence[str]) -> str | None:
    usable = [k for k in range(len(names)) if (parameters[:, k] > 0).all() and np.ptp(parameters[:, k]) > 0]
    if not usable or len(values) < len(usable) + 3 or not ((values > 0).all() or (values < 0).all()):
        return None
    logs = np.hstack([np.ones((len(values), 1)), np.log(parameters[:, usable])])
    solution = solve(logs, np.log(np.abs(values)), FORMULAS)
    exponents = np.round(solution[1:] * HALVES) / HALVES
    rest = values / np.exp(logs[:, 1:] @ exponents)
    number = fraction(float(rest[-1]))
    if number is None or np.abs(rest - float(number)).max() > EXACT * abs(float(number)):
        return None
    above = [_power(names[k], e) for k, e in zip(usable, exponents, strict=True) if e > 0]
    below = [_power(names[k], -e) for k, e in zip(usable, exponents, strict=True) if e < 0]
    return product(number, above, below)


def _sums(parameters: Array, names: Sequence[str]) -> tuple[Array, list[str]]:
    """Return the terms that sums of parameters may have: these, products and quotients of two of them."""
    columns: list[Array] = [np.ones(len(parameters))]
    texts = ["1"]
    k = len(names)
    columns += [parameters[:, i] for i in range(k)]
    texts += list(names)
    for i in range(k):
        for j in range(i, k):
            columns.append(parameters[:, i] * parameters[:, j])
            texts.append(f"{names[i]}*{names[j]}" if i != j else f"{names[i]}^2")
    for i in range(k):
        for j in range(k):
            if i != j and (parameters[:, j] != 0).all():
                columns.append(parameters[:, i] / parameters[:, j])
                texts.append(f"{names[i]}/{names[j]}")
    return np.array(columns).T, texts


def _sum(values: Array, columns: Array, texts: Sequence[str]) -> str | None:
    count = min(columns.shape[1], len(values) - 3)
    if count < 2 or not np.isfinite(values).all():
        return None
    used = columns[:, :count] / np.abs(columns[:, :count]).max(axis=0)
    solution = solve(used, values, FORMULAS)
    if rank(used, FORMULAS) < count or np.abs(used @ solution - values).max() > 1e-8 * np.abs(values).max():
        return None
    solution = solution / np.abs(columns[:, :count]).max(axis=0)
    text = ""
    for value, name, column in zip(solution, texts, columns.T, strict=False):
        if abs(value) * np.abs(column).max() < 1e-6 * np.abs(values).max():
            continue
        number = fraction(float(value))
        if number is None:
            return None
        one = (
            shown(abs(number))
            if name == "1"
            else product(abs(number), name.split("/")[:1], name.split("/")[1:])
        )
        text += (f" - {one}" if number < 0 else f" + {one}") if text else (f"-{one}" if number < 0 else one)
    return text or None


def _power(name: str, exponent: float) -> str:
    if exponent == 1:
        return name
    return f"sqrt({name})" if exponent == 0.5 else f"{name}^{exponent:g}"


def product(number: Fraction, above: Sequence[str], below: Sequence[str]) -> str:
    """Return the text of a fraction times and divided by factors."""
    sign, size = ("-" if number < 0 else ""), abs(number)
    upper = ([str(size.numerator)] if size.numerator != 1 or not above else []) + list(above)
    lower = ([str(size.denominator)] if size.denominator != 1 else []) + list(below)
    text = sign + "*".join(upper)
    if not lower:
        return text
    return text + "/" + (lower[0] if len(lower) == 1 else f"({'*'.join(lower)})")


def shown(number: Fraction) -> str:
    """Return a fraction as text."""
    return str(number)


def digits(value: float) -> str:
    """Return a number that was not recognised: with the digits that are sure."""
    return f"{value:.8g}"
