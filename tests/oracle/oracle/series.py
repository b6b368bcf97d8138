"""Numbers that know how they go on in time and how they answer to small displacements.

A ``Series`` is a number along the motion, ``v[0] + v[1] t + v[2] t^2 + ...`` (t: time from now), with its first
derivatives ``e[k, d]`` by the displacements d, which are series as well. Its last axis holds equal numbers with
different imaginary parts, of the order of 1e-40: one complex step for each unknown of the equations of motion.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from oracle.values import NotCovered

Array = Any
STEP = 1e-40


class Series:
    """``v`` has the shape (orders, steps), ``e`` (orders, displacements, steps) or is None."""

    __slots__ = ("e", "v")

    def __init__(self, v: Array, e: Array | None = None) -> None:
        self.v, self.e = v, e

    @property
    def real(self) -> float:
        return float(self.v[0, 0].real)

    def der(self) -> Series:
        """The derivative by time: one order less is known of it."""
        if len(self.v) < 2:
            raise NotCovered("a derivative by time of what is known at one instant only")
        k = np.arange(1, len(self.v))
        return Series(k[:, None] * self.v[1:], None if self.e is None else k[:, None, None] * self.e[1:])

    def order(self, k: int) -> Array:
        """The k-th derivative by time now, one number for each complex step."""
        if len(self.v) <= k:
            raise NotCovered(f"the derivative of order {k} of a quantity that is known to {len(self.v) - 1}")
        return self.v[k] * (1, 1, 2, 6)[k]

    def __neg__(self) -> Series:
        return Series(-self.v, None if self.e is None else -self.e)

    def __add__(self, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        if not isinstance(other, Series):
            v = self.v.astype(complex)
            v[0] = v[0] + other
            return Series(v, self.e)
        k = min(len(self.v), len(other.v))
        e = [x.e[:k] for x in (self, other) if x.e is not None]
        return Series(self.v[:k] + other.v[:k], sum(e[1:], e[0]) if e else None)

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        if not isinstance(other, Series):
            return Series(self.v * other, None if self.e is None else self.e * other)
        e = None
        for a, b in ((self, other), (other, self)):
            if b.e is not None:
                part = product(a.v[:, None], b.e)
                e = part if e is None else e + part
        return Series(product(self.v, other.v), e)

    def __sub__(self, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else self + (-other)

    def __rsub__(self, other: Any) -> Any:
        return -self + other

    def __truediv__(self, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        return self * (power(other, -1.0) if isinstance(other, Series) else 1 / other)

    def __rtruediv__(self, other: Any) -> Any:
        return power(self, -1.0) * other

    __radd__ = __add__
    __rmul__ = __mul__


def spread(x: Any, many: tuple[int, int]) -> Any:
    """The same number at each of many places: the last axis goes through the steps and, within each, through the places."""
    if not isinstance(x, Series) or many[0] == 1:
        return x
    v, e = x.v, x.e
    if v.shape[-1] == many[0]:
        v = np.repeat(v, many[1], axis=-1)
    if e is not None and e.shape[-1] == many[0]:
        e = np.repeat(e, many[1], axis=-1)
    return Series(v, e)


def places(shares: Array, steps: int, orders: int = 3) -> Series:
    """Numbers that differ from place to place, the same for each step."""
    v = np.zeros((orders, steps * len(shares)), complex)
    v[0] = np.tile(shares, steps)
    return Series(v)


def steps_of(x: Any) -> int:
    """How many complex steps a number has."""
    if not isinstance(x, Series):
        return 1
    return int(max(x.v.shape[-1], 1 if x.e is None else x.e.shape[-1]))


def product(a: Array, b: Array) -> Array:
    """The product of two series in time, as far as both are known."""
    k = min(len(a), len(b))
    out = a[0] * b[:k]
    for j in range(1, k):
        out[j:] += a[j] * b[: k - j]
    return out


def real(x: Any) -> float:
    return x.real if isinstance(x, Series) else float(np.real(x))


def known(x: Any, orders: int = 3) -> Array:
    """The time part of any number."""
    if isinstance(x, Series):
        return x.v
    v = np.zeros((orders, 1), complex)
    v[0] = x
    return v


def integrate(first: Any, rate: Array, v: Array) -> Array:
    """F(v) as a series from its value now and its derivative F'(v) as a series."""
    k = np.arange(1, len(v))
    rest = product(rate[: len(v) - 1], k[:, None] * v[1:]) / k[:, None] if len(v) > 1 else v[1:]
    first = np.broadcast_to(first, np.broadcast_shapes(np.shape(first), v[0].shape, rest.shape[1:]))
    return np.concatenate([first[None], np.broadcast_to(rest, (len(v) - 1, *first.shape))])


def with_derivative(x: Series, v: Array, rate: Array) -> Series:
    """F(x) from the series of F and of F'."""
    return Series(v, None if x.e is None else product(rate[:, None], x.e))


@np.errstate(all="ignore")  # what is not a number is refused where it is used
def reciprocal(v: Array) -> Array:
    out = [1 / v[0]]
    for n in range(1, len(v)):
        out.append(-sum(v[j] * out[n - j] for j in range(1, n + 1)) * out[0])
    return np.stack(np.broadcast_arrays(*out))


@np.errstate(all="ignore")  # what is not a number is refused where it is used
def root(v: Array) -> Array:
    out = [np.sqrt(v[0])]
    for n in range(1, len(v)):
        inner = sum((out[j] * out[n - j] for j in range(1, n)), 0 * v[0])
        out.append((v[n] - inner) / (2 * out[0]))
    return np.stack(np.broadcast_arrays(*out))


@np.errstate(all="ignore")  # what is not a number is refused where it is used
def constant_power(v: Array, p: float) -> Array:
    """v^p in time: by products for whole p, else from p v^(p-1), which needs v > 0."""
    if p == int(p) and abs(p) <= 64:
        base, out = (v if p >= 0 else reciprocal(v)), np.zeros_like(v)
        out[0] = 1
        for _ in range(abs(int(p))):
            out = product(out, base)
        return out
    if v[0].real.min() < 0:
        raise ValueError("a power of a negative number")
    out = [v[0] ** p]
    for n in range(1, len(v)):
        out.append(sum((p * j - (n - j)) * v[j] * out[n - j] for j in range(1, n + 1)) / (n * v[0]))
    return np.stack(np.broadcast_arrays(*out))


def power(x: Any, p: Any) -> Any:
    if isinstance(p, Series):
        return apply("exp", p * apply("log", x))
    if not isinstance(x, Series):
        if x < 0 and p != int(p):
            raise ValueError("a power of a negative number")
        return float(x) ** p
    if p == 0:
        return 1.0
    return with_derivative(x, constant_power(x.v, p), p * constant_power(x.v, p - 1))


def exponential(v: Array) -> Array:
    out = [np.exp(v[0])]
    for n in range(1, len(v)):
        out.append(sum(j * v[j] * out[n - j] for j in range(1, n + 1)) / n)
    return np.stack(np.broadcast_arrays(*out))


def turn(v: Array) -> tuple[Array, Array]:
    """Sine and cosine."""
    s, c = [np.sin(v[0])], [np.cos(v[0])]
    for n in range(1, len(v)):
        s.append(sum(j * v[j] * c[n - j] for j in range(1, n + 1)) / n)
        c.append(-sum(j * v[j] * s[n - j] for j in range(1, n + 1)) / n)
    return np.stack(np.broadcast_arrays(*s)), np.stack(np.broadcast_arrays(*c))


def one(v: Array) -> Array:
    out = np.zeros_like(v)
    out[0] = 1
    return out


def hyperbolic(v: Array) -> tuple[Array, Array]:
    up, down = exponential(v), exponential(-v)
    return (up - down) / 2, (up + down) / 2


def tangent(v: Array) -> Array:
    s, c = turn(v)
    return product(s, reciprocal(c))


def hyperbolic_tangent(v: Array) -> Array:
    out = [np.tanh(v[0])]
    for n in range(1, len(v)):  # y' = (1 - y^2) v'
        so_far = np.stack(np.broadcast_arrays(*out))
        rate = one(so_far) - product(so_far, so_far)
        out.append(sum(rate[n - j] * j * v[j] for j in range(1, n + 1)) / n)
    return np.stack(np.broadcast_arrays(*out))


# name: (value of a number, series of the derivative, domain)
_RATES: dict[str, tuple[Callable[[Any], Any], Callable[[Array], Array], Callable[[float], bool]]] = {
    "sin": (np.sin, lambda v: turn(v)[1], lambda x: True),
    "cos": (np.cos, lambda v: -turn(v)[0], lambda x: True),
    "tan": (np.tan, lambda v: one(v) + product(tangent(v), tangent(v)), lambda x: True),
    "asin": (np.arcsin, lambda v: reciprocal(root(one(v) - product(v, v))), lambda x: abs(x) <= 1),
    "acos": (np.arccos, lambda v: -reciprocal(root(one(v) - product(v, v))), lambda x: abs(x) <= 1),
    "atan": (np.arctan, lambda v: reciprocal(one(v) + product(v, v)), lambda x: True),
    "sinh": (np.sinh, lambda v: hyperbolic(v)[1], lambda x: True),
    "cosh": (np.cosh, lambda v: hyperbolic(v)[0], lambda x: True),
    "tanh": (
        np.tanh,
        lambda v: one(v) - product(hyperbolic_tangent(v), hyperbolic_tangent(v)),
        lambda x: True,
    ),
    "asinh": (np.arcsinh, lambda v: reciprocal(root(one(v) + product(v, v))), lambda x: True),
    "acosh": (np.arccosh, lambda v: reciprocal(root(product(v, v) - one(v))), lambda x: x >= 1),
    "atanh": (np.arctanh, lambda v: reciprocal(one(v) - product(v, v)), lambda x: abs(x) <= 1),
    "exp": (np.exp, exponential, lambda x: True),
    "log": (np.log, reciprocal, lambda x: x >= 0),
    "log10": (np.log10, lambda v: reciprocal(v) / np.log(10), lambda x: x >= 0),
    "sqrt": (np.sqrt, lambda v: reciprocal(root(v)) / 2, lambda x: x >= 0),
}

FUNCTIONS = frozenset(_RATES)


@np.errstate(all="ignore")
def apply(name: str, x: Any) -> Any:
    """An elementary function of one number (section 12)."""
    value, rate, domain = _RATES[name]
    if not domain(real(x)):
        raise ValueError(f"{name} of {real(x)}")
    if not isinstance(x, Series):
        return float(value(x))
    slope = rate(x.v)
    return with_derivative(x, integrate(value(x.v[0]), slope, x.v), slope)


def angle_of(y: Any, x: Any) -> Any:
    """atan2(y, x)."""
    if not isinstance(y, Series) and not isinstance(x, Series):
        return float(np.arctan2(y, x))
    a, b = known(y), known(x)
    k = min(len(a), len(b))
    a, b = np.broadcast_arrays(a[:k], b[:k])
    inverse = reciprocal(product(a, a) + product(b, b))
    n = np.arange(1, k)[:, None]
    rate = product(product(b, n * a[1:]) - product(a, n * b[1:]), inverse[: k - 1]) if k > 1 else a[1:]
    now = (
        np.arctan2(a[0].real, b[0].real)
        + 1j * (b[0].real * a[0].imag - a[0].real * b[0].imag) * inverse[0].real
    )
    e = None
    for z, w in ((y, b), (x, -a)):
        if isinstance(z, Series) and z.e is not None:
            part = product(product(w, inverse)[:, None], z.e)
            e = part if e is None else e + part
    return Series(np.concatenate([now[None], rate / n]), e)
