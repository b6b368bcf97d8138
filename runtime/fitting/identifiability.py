"""Which combinations of parameters a motion shows, and which it cannot tell: the null directions of its derivatives.

Directions in the logarithms of parameters are products of powers, directions in the parameters themselves are sums. Where
the numbers of a null direction have small integer ratios, the combinations that are left are said as formulas.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from msgspec import Struct

from ..numerics.rank import decomposed, decomposed_columns, solve
from ..problem import Array

LARGEST_DENOMINATOR = 4
"""Of an exponent or a factor over that of the last name, in a combination that is said as a formula."""
MOST_ORDERED = 6
"""So many parameters that hang together are tried in every order, for the shortest formulas."""
NEAR = 1e-3
"""How far an exponent may be from such a fraction: null directions are known to about the noise of the derivatives."""


class Unseen(Struct, frozen=True):
    """What cannot be told. ``names``: parameters that are undetermined one by one; ``texts``: in words."""

    names: tuple[str, ...] = ()
    texts: tuple[str, ...] = ()


def unseen(names: Sequence[str], values: Array, derivatives: Array, noise: float, smallest: float) -> Unseen:
    """Find the combinations of parameters on which the data do not depend.

    ``values`` [k]: the parameters; ``derivatives`` [n, k]: of the data divided by their noise, by the parameters over their
    sizes (|value|, 1 where that is zero); a direction counts as unseen where a change by its whole size moves the data by
    less than ``noise``, or by less than ``smallest`` of what the best seen direction moves them.
    """
    found = decomposed_columns(derivatives)
    sizes = np.concatenate([found.values, np.zeros(len(names) - found.values.size)])
    limit = max(noise, smallest * float(sizes.max(initial=0.0)))
    null = found.right[sizes <= limit].T
    if not null.size:
        return Unseen()
    involved = np.abs(null).max(axis=1) > np.sqrt(NEAR) * np.abs(null).max()
    chosen = [name for name, yes in zip(names, involved, strict=True) if yes]
    null = null[involved]
    alone = [i for i in range(len(chosen)) if _is_alone(null, i)]
    texts = [f"nothing that was measured depends on {chosen[i]}" for i in alone]
    rest = [i for i in range(len(chosen)) if i not in alone]
    if rest:
        texts.append(_together([chosen[i] for i in rest], values[involved][rest], _spanned(null[rest])))
    return Unseen(tuple(chosen), tuple(texts))


def _is_alone(null: Array, i: int) -> bool:
    """Whether the direction of one parameter by itself is a null direction."""
    unit = np.zeros(null.shape[0])
    unit[i] = 1.0
    return bool(np.linalg.norm(unit - null @ solve(null, unit)) < np.sqrt(NEAR))


def _spanned(columns: Array) -> Array:
    """Give orthonormal columns that span the same."""
    found = decomposed(columns)
    return found.left[:, : found.rank(np.sqrt(NEAR))]


def _together(names: list[str], values: Array, null: Array) -> str:
    """Say what is seen of several parameters that cannot be told apart."""
    apart = f"the data cannot tell {_listed(names)} apart"
    if null.shape[0] == null.shape[1]:
        return f"{apart}: no combination of them is seen"
    sizes = np.where(values != 0, np.abs(values), 1.0)
    products = _combinations(null) if (values != 0).all() else None
    sums = _combinations(null * sizes[:, None])
    if products is not None and (sums is None or _length(products) <= _length(sums)):
        return f"{apart}: {_only([_product(names, row) for row in products])}"
    if sums is not None:
        return f"{apart}: {_only([_sum(names, row) for row in sums])}"
    size = np.abs(null[:, 0]).max()
    shares = ", ".join(
        f"{name} by {share:+.3g} %" for name, share in zip(names, null[:, 0] / size, strict=True)
    )
    return f"{apart}: a change of {shares} together is not seen"


def _combinations(null: Array) -> list[list[int]] | None:
    """Give the shortest basis of what is orthogonal to the null directions, in small integers; None where there is none."""
    rows = decomposed(null.T).right
    k = null.shape[0]
    orders = itertools.permutations(range(k)) if k <= MOST_ORDERED else [tuple(range(k))]
    bases = (_integers(_echelon(rows[null.shape[1] :], order)) for order in orders)
    best = min((basis for basis in bases if basis is not None), key=_order, default=None)
    return best and sorted(best, key=lambda row: [factor == 0 for factor in row])


def _integers(basis: Array) -> list[list[int]] | None:
    """Give each row in the smallest integers; None where it has none."""
    found: list[list[int]] = []
    for row in basis:
        fractions = [Fraction(float(v)).limit_denominator(LARGEST_DENOMINATOR) for v in row]
        if any(abs(float(f) - v) > NEAR * max(1.0, abs(v)) for f, v in zip(fractions, row, strict=True)):
            return None
        common = math.lcm(*(f.denominator for f in fractions))
        found.append([int(f * common) for f in fractions])
    return found


def _order(rows: Sequence[Sequence[int]]) -> tuple[int, int]:
    """Short formulas first, then those in the names that come first."""
    return _length(rows), sum(k * abs(factor) for row in rows for k, factor in enumerate(row))


def _length(rows: Sequence[Sequence[int]]) -> int:
    return sum(abs(factor) for row in rows for factor in row)


def _echelon(rows: Array, order: Sequence[int]) -> Array:
    """Bring rows to reduced echelon form, with pivots in the columns that come first in ``order``."""
    rows = rows.copy()
    at = 0
    for column in order:
        if at == len(rows):
            break
        best = at + int(np.argmax(np.abs(rows[at:, column])))
        if abs(rows[best, column]) < NEAR:
            continue
        rows[[at, best]] = rows[[best, at]]
        rows[at] /= rows[at, column]
        for i in range(len(rows)):
            if i != at:
                rows[i] -= rows[i, column] * rows[at]
        at += 1
    return rows


def _product(names: Sequence[str], exponents: Sequence[int]) -> str:
    """Write a product of powers: ``m*l^2``, ``c/m``."""
    if next(e for e in reversed(exponents) if e) < 0:
        exponents = [-e for e in exponents]
    above = [_power(n, e) for n, e in zip(names, exponents, strict=True) if e > 0]
    below = [_power(n, -e) for n, e in zip(names, exponents, strict=True) if e < 0]
    head = "*".join(above) or "1"
    if not below:
        return head
    return f"{head}/{below[0]}" if len(below) == 1 else f"{head}/({'*'.join(below)})"


def _power(name: str, exponent: int) -> str:
    return name if exponent == 1 else f"{name}^{exponent}"


def _sum(names: Sequence[str], factors: Sequence[int]) -> str:
    """Write a sum: ``x - 2*y``."""
    if next(f for f in factors if f) < 0:
        factors = [-f for f in factors]
    text = ""
    for name, factor in zip(names, factors, strict=True):
        if factor:
            part = name if abs(factor) == 1 else f"{abs(factor)}*{name}"
            sign = "-" if factor < 0 else "+"
            text += f" {sign} {part}" if text else part
    return text


def _only(formulas: Sequence[str]) -> str:
    return f"only {_listed(formulas)} {'is' if len(formulas) == 1 else 'are'} seen"


def _listed(texts: Sequence[str]) -> str:
    return texts[0] if len(texts) == 1 else f"{', '.join(texts[:-1])} and {texts[-1]}"
