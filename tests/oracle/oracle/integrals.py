"""Definite integrals, by pieces between kinks and by bisection until nothing changes."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np

from oracle.series import Series, real
from oracle.values import NotCovered, Uneven

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
Body = Callable[[Any], tuple[Any, dict[Any, tuple[Any, Any]]]]
Together = Callable[[Any, Any, Any, bool], tuple[Any, Any]]
LOOKS = 200


ONE_BY_ONE = (Uneven, ArithmeticError, ValueError, IndexError, TypeError)
"""Errors of many places at once, after which each is looked at by itself."""


def definite_integral(body: Body, plain: Body, together: Together, lower: Any, upper: Any) -> Any:
    """The integral of ``body(s)[0]``; ``body(s)[1]`` are the decisions taken at s; ``plain``: the same in numbers only.

    ``together``: at many places lower + width*share at once, time parts (orders, steps, places) and displacements; raises
    ``Uneven`` where what is decided differs among them. Much faster.
    """
    width = upper - lower
    if real(width) == 0 and not isinstance(width, Series):
        return 0.0

    def look(sigma: float) -> tuple[Any, dict[Any, Any]]:
        value, seen = plain(lower + width * sigma)
        return value, {key: choice for key, (_, choice) in seen.items()}

    def choices(sigma: float) -> dict[Any, Any]:
        return look(sigma)[1]

    looks = (np.arange(LOOKS) + 0.5) / LOOKS
    taken: Any
    try:
        sizes = list(np.abs(together(lower, width, looks, True)[0][0, 0].real))
        taken = [{}] * LOOKS
    except ONE_BY_ONE:
        values, taken = zip(*(look(sigma) for sigma in looks), strict=True)
        sizes = [size(value) for value in values]
    # ends of pieces are looked at closely: a narrow peak is not missed
    peak = float(looks[int(np.argmax(sizes))])
    cuts: list[Any] = [0.0]
    for i in range(LOOKS - 1):
        cuts += _changes(body, choices, lower, width, (looks[i], taken[i]), (looks[i + 1], taken[i + 1]))
    cuts = sorted([*cuts, peak, 1.0], key=real)
    total: Any = 0.0
    for a, b in itertools.pairwise(cuts):
        total = total + _piece(lambda s: body(s)[0], together, lower + width * a, width * (b - a), max(sizes))
    return total


def _changes(body: Body, choices: Any, lower: Any, width: Any, left: Any, right: Any) -> list[Any]:
    """The places between two looks where a decision changes, as series: they move with the motion."""
    if left[1] == right[1]:
        return []
    if right[0] - left[0] > 1e-15:
        middle = (left[0] + right[0]) / 2
        if left[0] < middle < right[0]:
            look = (middle, choices(middle))
            return _changes(body, choices, lower, width, left, look) + _changes(
                body, choices, lower, width, look, right
            )
    sigma: Any = (left[0] + right[0]) / 2
    key = next(k for k in {**left[1], **right[1]} if left[1].get(k) != right[1].get(k))

    def margin(at: Any) -> Any:
        g, choice = body(lower + width * at)[1][key]
        return g if choice else -g

    try:  # where the change lies as the motion goes on: Newton's method, one order more in each step
        h = 1e-4
        slope = (real(margin(sigma + h)) - real(margin(sigma - h))) / (2 * h)
        if slope and isinstance(margin(sigma), Series):
            for _ in range(8):
                sigma = sigma - margin(sigma) * (1 / slope)
    except KeyError:
        pass
    return [sigma]


def size(x: Any) -> float:
    if not isinstance(x, Series):
        return float(np.abs(x))
    return float(np.abs(x.v.real).max()) + (0.0 if x.e is None else float(np.abs(x.e.real).max()))


def _piece(f: Callable[[Any], Any], together: Together, start: Any, width: Any, largest: float) -> Any:
    """One smooth piece; s = start + width*(6 u^5 - 15 u^4 + 10 u^3) takes the sting out of singular ends."""

    def gauss(a: float, b: float) -> Any:
        total: Any = 0.0
        for x, w in zip(*_rule(a, b), strict=True):
            s = float(_share(x))
            try:
                value = f(start + width * s)
            except (ValueError, ZeroDivisionError):
                if min(s, 1 - s) * abs(real(width)) > 1e-15 * (abs(real(start)) + abs(real(width))):
                    raise
                continue  # at a singular end, but for rounding
            total = total + value * (w * 30 * x * x * (1 - x) ** 2)
        return total

    def sums(panels: list[tuple[float, float]]) -> list[Any]:
        """The rule over some panels."""
        x, w = (np.array(part) for part in zip(*(_rule(a, b) for a, b in panels), strict=True))
        w = w * 30 * x * x * (1 - x) ** 2
        try:
            v, e = together(start, width, _share(np.ravel(x)), False)
        except ONE_BY_ONE:
            return [gauss(a, b) for a, b in panels]

        def added(y: Any) -> Any:
            return (y.reshape(*y.shape[:-1], *w.shape) * w).sum(axis=-1)

        v, e = added(v), None if e is None else added(e)
        return [Series(v[..., k], None if e is None else e[..., k]) for k in range(len(panels))]

    def refine(a: float, b: float, whole: Any, depth: int) -> Any:
        middle = (a + b) / 2
        left, right = sums([(a, middle), (middle, b)])
        error = size(left + right - whole)
        if error <= (1e-12 if depth < 12 else 1e-10) * scale or depth == 40:
            if depth == 40 and error > 1e-9 * scale:
                raise NotCovered("an integral that does not converge")
            return left + right
        return refine(a, middle, left, depth + 1) + refine(middle, b, right, depth + 1)

    ends = np.linspace(0, 1, 5)
    parts = sums(list(itertools.pairwise(ends)))
    scale = sum(size(p) for p in parts) + 1e-3 * largest + 1e-300
    total: Any = 0.0
    for a, b, part in zip(ends, ends[1:], parts, strict=False):
        total = total + refine(a, b, part, 0)
    return total * width


def _rule(a: float, b: float) -> tuple[Any, Any]:
    return (a + b) / 2 + (b - a) / 2 * _NODES, (b - a) / 2 * _WEIGHTS


def _share(x: Any) -> Any:
    """How far along a piece x lies; of its second half from the other end, so that nothing lies beyond it."""
    back = np.minimum(1 - (1 - x) ** 3 * (10 - 15 * (1 - x) + 6 * (1 - x) ** 2), np.nextafter(1, 0))
    return np.where(x > 0.5, back, x**3 * (10 - 15 * x + 6 * x * x))
