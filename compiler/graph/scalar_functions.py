"""Functions of numbers that Python's ``math`` lacks; generated modules hold those that they use.

``lookup`` follows ``graph.Table`` and the C text operation by operation, so that all give the same bits.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from math import sqrt


def floor(x: float) -> float:
    return math.copysign(float(math.floor(x)), x)


def sign(x: float) -> float:
    return 1.0 if x > 0.0 else -1.0 if x < 0.0 else x


# C's fmin and fmax drop NaN; these keep it, like NumPy


def minimum(a: float, b: float) -> float:
    return a if a < b or a != a else b


def maximum(a: float, b: float) -> float:
    return a if a > b or a != a else b


def select(condition: bool, a: float, b: float) -> float:
    return a if condition else b


def derived(value: float, formula: float) -> float:
    """Return the value; a formula beside it has its derivatives."""
    return value


def negation(condition: bool) -> bool:
    return not condition


def lookup(table: tuple[tuple[float, ...], ...], order: int, x: float) -> float:
    """Return the value (order 0) or a derivative of the cubic through (points, values, slopes) at x."""
    points, values, slopes = table
    if x != x:
        return x
    if not points[0] <= x < points[-1]:
        end = 0 if x < points[0] else -1
        if order == 0:
            return values[end] + slopes[end] * (x - points[end])
        return slopes[end] if order == 1 else 0.0
    i = bisect_right(points, x) - 1
    h = points[i + 1] - points[i]
    s = x - points[i]
    d0, d1 = slopes[i], slopes[i + 1]
    secant = (values[i + 1] - values[i]) / h
    c2 = (3.0 * secant - 2.0 * d0 - d1) / h
    c3 = (d0 + d1 - 2.0 * secant) / (h * h)
    if order == 0:
        return values[i] + s * (d0 + s * (c2 + s * c3))
    if order == 1:
        return d0 + s * (2.0 * c2 + s * 3.0 * c3)
    return 2.0 * c2 + 6.0 * c3 * s if order == 2 else 6.0 * c3


def element(values: tuple[float, ...], index: float) -> float:
    """Return the number with an index, a whole one; the first and last ones beyond the ends."""
    last = len(values) - 1
    return values[int(index)] if 0.0 < index < last else values[last if index >= last else 0]


def cell(points: tuple[float, ...], x: float) -> float:
    """Return the index of the last point but one that is not above x."""
    return float(bisect_right(points, x, 1, len(points) - 1) - 1) if x == x else 0.0


def normal(seed: float, k: float) -> float:
    """Return number k of the standard normal numbers of a seed, both whole: Philox 4x32-10 (J. Salmon and others, SC 2011), its 52
    bits by the inverse of the normal distribution (M. Wichura, AS 241, 1988); in whole numbers, sums, products, quotients and roots,
    so that it is the same everywhere."""
    if not (abs(seed) < 9e18 and abs(k) < 9e18):
        return seed - seed + k - k if seed != seed or k != k else float("nan")
    number, key = int(k) & 0xFFFFFFFFFFFFFFFF, int(seed) & 0xFFFFFFFFFFFFFFFF
    a, b, c, d = number & 0xFFFFFFFF, number >> 32, 0, 0
    p, q = key & 0xFFFFFFFF, key >> 32
    for _ in range(10):
        x, y = 0xD2511F53 * a, 0xCD9E8D57 * c
        a, b, c, d = (y >> 32) ^ b ^ p, y & 0xFFFFFFFF, (x >> 32) ^ d ^ q, x & 0xFFFFFFFF
        p, q = (p + 0x9E3779B9) & 0xFFFFFFFF, (q + 0xBB67AE85) & 0xFFFFFFFF
    share = (float((a << 32 | b) >> 12) + 0.5) / 4503599627370496.0
    off = share - 0.5
    if abs(off) <= 0.425:
        r = 0.180625 - off * off
        above = (
            3.3871328727963666080e0,
            1.3314166789178437745e2,
            1.9715909503065514427e3,
            1.3731693765509461125e4,
            4.5921953931549871457e4,
            6.7265770927008700853e4,
            3.3430575583588128105e4,
            2.5090809287301226727e3,
        )
        below = (
            1.0,
            4.2313330701600911252e1,
            6.8718700749205790830e2,
            5.3941960214247511077e3,
            2.1213794301586595867e4,
            3.9307895800092710610e4,
            2.8729085735721942674e4,
            5.2264952788528545610e3,
        )
    else:
        rest, exponent = share if off < 0.0 else 1.0 - share, 0.0
        while rest < 0.70710678118654752:
            rest, exponent = rest * 2.0, exponent + 1.0
        s = (rest - 1.0) / (rest + 1.0)
        odd, square = 0.0, s * s
        for i in range(25, 0, -2):
            odd = odd * square + 1.0 / float(i)
        r = sqrt(exponent * 0.6931471805599453094 - 2.0 * s * odd)
        if r <= 5.0:
            r = r - 1.6
            above = (
                1.42343711074968357734e0,
                4.63033784615654529590e0,
                5.76949722146069140550e0,
                3.64784832476320460504e0,
                1.27045825245236838258e0,
                2.41780725177450611770e-1,
                2.27238449892691845833e-2,
                7.74545014278341407640e-4,
            )
            below = (
                1.0,
                2.05319162663775882187e0,
                1.67638483018380384940e0,
                6.89767334985100004550e-1,
                1.48103976427480074590e-1,
                1.51986665636164571966e-2,
                5.47593808499534494600e-4,
                1.05075007164441684324e-9,
            )
        else:
            r = r - 5.0
            above = (
                6.65790464350110377720e0,
                5.46378491116411436990e0,
                1.78482653991729133580e0,
                2.96560571828504891230e-1,
                2.65321895265761230930e-2,
                1.24266094738807843860e-3,
                2.71155556874348757815e-5,
                2.01033439929228813265e-7,
            )
            below = (
                1.0,
                5.99832206555887937690e-1,
                1.36929880922735805310e-1,
                1.48753612908506148525e-2,
                7.86869131145613259100e-4,
                1.84631831751005468180e-5,
                1.42151175831644588870e-7,
                2.04426310338993978564e-15,
            )
    top, bottom = 0.0, 0.0
    for i in range(7, -1, -1):
        top, bottom = top * r + above[i], bottom * r + below[i]
    if abs(off) <= 0.425:
        return off * top / bottom
    return -top / bottom if off < 0.0 else top / bottom
