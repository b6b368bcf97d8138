"""Motions of five models to more digits than a run has, from equations written by hand; none of it shares code with mechc.

``Extrapolated`` integrates in numbers of 64 bits; flights, orbits and linear motions are closed forms in mpmath.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import mpmath as mp
import numpy as np
from numpy.typing import NDArray

Values = Mapping[str, float]
"""Parameters and stated starts by name, in SI."""
Motion = dict[str, NDArray[np.float64]]
"""States by name at the times asked for."""
Real = np.longdouble
Row = Any
"""An array of ``Real``."""

COLUMNS = 8
MOST = 20_000
"""Steps after which an integration gives no more numbers."""
MOST_BOUNCES = 1000
"""The same of a ball that bounces."""


def extrapolated(f: Callable[[Row], Row], y: Row, h: Row) -> tuple[Row, Row]:
    """Make one step of Gragg, Bulirsch and Stoer for y' = f(y); return it, and what its last column changed."""
    table: list[Row] = []
    slope = f(y)
    for j in range(COLUMNS):
        n = 2 * (j + 1)
        part = h / n
        before, here = y, y + part * slope
        for _ in range(n - 1):
            before, here = here, before + 2 * part * f(here)
        row = [(before + here + part * f(here)) / 2]
        for k, last in enumerate(table):
            row.append(row[k] + (row[k] - last) / (Real(n) ** 2 / Real(n - 2 * (k + 1)) ** 2 - 1))
        table = row
    return table[-1], abs(table[-1] - table[-2])


def integrated(
    f: Callable[[Row], Row], y: Row, times: NDArray[np.float64], tolerance: float
) -> Iterator[Row]:
    """Give the states of y' = f(y) at some times, from 0 on; no numbers where that takes too many steps."""
    t, size, count = Real(0), abs(y), 0
    h = Real(times[-1]) / 10**6
    for until in times.astype(Real):
        while t < until and count < MOST:
            count += 1
            part = min(h, until - t)
            after, off = extrapolated(f, y, part)
            scale = np.maximum(size, abs(after))
            error = float(np.max(off[scale > 0] / scale[scale > 0], initial=0.0)) / tolerance
            if error <= 1:
                t, y, size = (until if part == until - t else t + part), after, np.maximum(size, abs(after))
            if not np.isfinite(error):
                h = part / 8
            elif error > 1 or part == h:
                h = part * Real(min(4.0, 0.9 * max(error, 1e-15) ** (-1 / (2 * COLUMNS - 1))))
        yield y if t == until else y * np.nan


def _named(names: str, rows: Any) -> Motion:
    table = np.array([[float(x) for x in row] for row in rows], dtype=float)
    return dict(zip(names.split(), table.T, strict=True))


# ---------------------------------------------------------------- a bob on a spring under a cart


def cart_spring(v: Values, times: NDArray[np.float64], tolerance: float) -> Motion:
    """Newton's law of the bob along and across the spring, and of the cart, which feels the spring without mass."""
    M, m, k, l, g, K = (Real(v[n]) for n in ("M", "m", "k", "l", "g", "K"))

    def f(y: Row) -> Row:
        X, r, th, dX, dr, dth = y
        s, c = np.sin(th), np.cos(th)
        pull = k * (r - l)
        aX = (pull * s - K * X) / M
        ar = r * dth**2 + g * c - pull / m - aX * s
        return np.array([dX, dr, dth, aX, ar, -(g * s + 2 * dr * dth + aX * c) / r])

    y = np.array([v.get(n, 0.0) for n in ("X", "r", "th", "der(X)", "der(r)", "der(th)")], dtype=Real)
    turn = 8 * np.arctan(Real(1))
    whole = np.array([0, 0, np.rint(y[2] / turn), 0, 0, 0]) * turn  # sines of large angles have few digits
    rows = (row + whole for row in integrated(f, y - whole, times, tolerance))
    return _named("X r th der(X) der(r) der(th)", rows)


# ---------------------------------------------------------------- a kite of four bars

_CORNERS = [f"{n}[{i}]" for n in "abc" for i in (1, 2)]
KITE = " ".join([*_CORNERS, *(f"der({n})" for n in _CORNERS), "half"])
"""States, and half the angle between a and b."""


def kite_start(v: Values) -> tuple[Row, Row, list[Row]] | None:
    """Give the corners a and b below the pivot and both places of c; None where the bars do not reach."""
    l, s = Real(v["l"]), Real(v["s"])
    x = np.array([v["a[1]"], v["b[1]"]], dtype=Real)
    if (abs(x) > l).any():
        return None
    a, b = (np.array([one, -np.sqrt(l**2 - one**2)]) for one in x)
    half = (b - a) / 2
    if not half.any():  # c may stand anywhere about both
        near = np.array([v.get("c[1]", 0.1), v.get("c[2]", -1.2)], dtype=Real) - a
        return a, b, [a + s * near / np.sqrt(near @ near)]
    rest = s**2 - half @ half
    if rest < 0:
        return None
    across = np.array([-half[1], half[0]]) / np.sqrt(half @ half)
    return a, b, [(a + b) / 2 + sign * np.sqrt(rest) * across for sign in (-1, 1)]


def kite(v: Values, times: NDArray[np.float64], tolerance: float) -> Motion:
    """Lagrange's equations in the angle of the axis and one that stays regular where a meets b: with a and b at -d and d beside the
    axis, sin d = s/l sin p and the distance of c is r = l cos d + s cos p; the shorter bar gives the angle."""
    l, s, g = Real(v["l"]), Real(v["s"]), Real(v["g"])
    found = kite_start(v)
    assert found is not None
    a, b, both = found
    near = np.array([v.get("c[1]", 0.1), v.get("c[2]", -1.2)])
    c = min(both, key=lambda one: float((one - near) @ (one - near)))

    if not (b - a).any():
        return _double_pendulum(l, s, g, (a, c), times, tolerance)

    def angles(q: Row) -> tuple[Row, ...]:
        """d, p and their first and second derivatives by the angle q."""
        short, ratio = q, min(s / l, l / s)
        sine = ratio * np.sin(short)
        other = np.arcsin(sine)
        slope = ratio * np.cos(short) / np.cos(other)
        bend = (slope**2 * sine - ratio * np.sin(short)) / np.cos(other)
        if s <= l:
            return other, slope, bend, short, Real(1), Real(0)
        turned = Real(0) if turn > 0 else Real(np.pi)
        return short, Real(1), Real(0), turned + turn * other, turn * slope, turn * bend

    ta, tb = np.arctan2(a[0], -a[1]), np.arctan2(b[0], -b[1])
    axis, d = (ta + tb) / 2, (tb - ta) / 2
    along = c @ np.array([np.sin(axis), -np.cos(axis)])
    turn = Real(1) if along > l * np.cos(d) else Real(-1)
    q = d if s > l else np.arctan2(l * np.sin(d) / s, (along - l * np.cos(d)) / s)

    def f(y: Row) -> Row:
        axis, q, daxis, dq = y
        d, d1, d2, p, p1, p2 = angles(q)
        r = l * np.cos(d) + s * np.cos(p)
        r1 = -l * np.sin(d) * d1 - s * np.sin(p) * p1
        r2 = -l * (np.cos(d) * d1**2 + np.sin(d) * d2) - s * (np.cos(p) * p1**2 + np.sin(p) * p2)
        about, inner = 2 * l**2 + r**2, 2 * l**2 * d1**2 + r1**2
        weight, weight1 = 2 * l * np.cos(d) + r, -2 * l * np.sin(d) * d1 + r1
        a_axis = -(g * np.sin(axis) * weight + 2 * r * r1 * dq * daxis) / about
        pull = r * r1 * daxis**2 - (2 * l**2 * d1 * d2 + r1 * r2) * dq**2
        return np.array([daxis, dq, a_axis, (pull + g * np.cos(axis) * weight1) / inner])

    def places(y: Row) -> list[Row]:
        axis, q, daxis, dq = y
        d, d1, _, p, p1, _ = angles(q)
        r, dr = l * np.cos(d) + s * np.cos(p), -(l * np.sin(d) * d1 + s * np.sin(p) * p1) * dq
        arms = [
            (axis - d, daxis - d1 * dq, l, 0.0),
            (axis + d, daxis + d1 * dq, l, 0.0),
            (axis, daxis, r, dr),
        ]
        x = [one for t, _, n, _ in arms for one in (n * np.sin(t), -n * np.cos(t))]
        w = [
            one
            for t, dt, n, dn in arms
            for one in (dn * np.sin(t) + n * np.cos(t) * dt, -dn * np.cos(t) + n * np.sin(t) * dt)
        ]
        return [*x, *w, d]

    start = np.array([axis, q, 0, 0], dtype=Real)
    return _named(KITE, map(places, integrated(f, start, times, tolerance)))


def _double_pendulum(
    l: Row, s: Row, g: Row, ends: tuple[Row, Row], times: NDArray[np.float64], tolerance: float
) -> Motion:
    """The kite whose corners a and b are one: two masses there, and a third one on the second rod."""
    a, c = ends

    def f(y: Row) -> Row:
        p, q, dp, dq = y
        sine, cosine = np.sin(p - q), np.cos(p - q)
        one, two = -s * sine * dq**2 - 3 * g * np.sin(p), l * sine * dp**2 - g * np.sin(q)
        across = 3 - cosine**2
        ddp = (one - cosine * two) / (l * across)
        return np.array([dp, dq, ddp, (two - l * cosine * ddp) / s])

    def places(y: Row) -> list[Row]:
        p, q, dp, dq = y
        x, dx = np.array([l * np.sin(p), -l * np.cos(p)]), np.array([np.cos(p), np.sin(p)]) * l * dp
        end = x + s * np.array([np.sin(q), -np.cos(q)])
        return [*x, *x, *end, *dx, *dx, *(dx + np.array([np.cos(q), np.sin(q)]) * s * dq), Real(0)]

    start = np.array([np.arctan2(a[0], -a[1]), np.arctan2(c[0] - a[0], a[1] - c[1]), 0, 0], dtype=Real)
    return _named(KITE, map(places, integrated(f, start, times, tolerance)))


# ---------------------------------------------------------------- an orbit, and a mass in a trap that feels its tide


def tide(v: Values, times: NDArray[np.float64], tolerance: float) -> Motion:
    """A circle and a cosine where the orbit is a circle, else both equations integrated."""
    GM, r0, w = (Real(v[n]) for n in ("GM", "r0", "w"))
    x, y, u = Real(v.get("x", v["r0"])), Real(v.get("y", 0.0)), Real(v["u"])
    dx, dy = Real(v.get("der(x)", 0.0)), Real(v.get("der(y)", np.sqrt(GM / r0)))
    du = Real(v.get("der(u)", 0.0))
    names = "x y u der(x) der(y) der(u) energy.supplied"
    if not ("x" in v or "y" in v or "der(x)" in v or "der(y)" in v or "der(u)" in v):
        with mp.workdps(40):
            n, W = mp.sqrt(_mp(GM) / _mp(r0) ** 3), mp.sqrt(_mp(w) ** 2 + _mp(GM) / _mp(r0) ** 3)
            rows = []
            for t in times.tolist():
                c, s, at = mp.cos(n * t), mp.sin(n * t), _mp(u) * mp.cos(W * t)
                work = -(n**2) * (at**2 - _mp(u) ** 2) * mp.mpf(1e-9) / 2
                rate = -_mp(u) * W * mp.sin(W * t)
                rows.append([_mp(r0) * c, _mp(r0) * s, at, -_mp(r0) * n * s, _mp(r0) * n * c, rate, work])
            return _named(names, rows)

    def f(state: Row) -> Row:
        x, y, u, dx, dy, du, _ = state
        cube = GM / np.sqrt(x**2 + y**2) ** 3
        return np.array([dx, dy, du, -cube * x, -cube * y, -(w**2 + cube) * u, Real(-1e-9) * cube * u * du])

    return _named(names, integrated(f, np.array([x, y, u, dx, dy, du, Real(0)]), times, tolerance))


def _mp(x: Any) -> Any:
    """Give a number of 64 bits to mpmath, every digit of it."""
    high = float(x)
    return mp.mpf(high) + mp.mpf(float(x - Real(high)))


# ---------------------------------------------------------------- a stiff sensor on a frame


def sensor(v: Values, times: NDArray[np.float64], tolerance: float) -> Motion:
    """The linear motion by its eigenvectors; what is dissipated is what the energy lacks."""
    with mp.workdps(60):
        M, m, K, C, k, c, x, y = (mp.mpf(v[n]) for n in ("M", "m", "K", "C", "k", "c", "x", "y"))
        A = mp.matrix([
            [0, 0, 1, 0], [0, 0, 0, 1],
            [-(K + k) / M, k / M, -(C + c) / M, c / M], [k / m, -k / m, c / m, -c / m],
        ])  # fmt: skip
        start = mp.matrix([x, y, mp.mpf(v.get("der(x)", 0)), mp.mpf(v.get("der(y)", 0))])
        values, vectors = mp.eig(A)
        parts = mp.lu_solve(vectors, start)

        def energy(s: Any) -> Any:
            return (M * s[2] ** 2 + m * s[3] ** 2 + K * s[0] ** 2 + k * (s[1] - s[0]) ** 2) / 2

        rows = []
        for t in times.tolist():
            s = vectors * mp.matrix([p * mp.exp(e * t) for p, e in zip(parts, values, strict=True)])
            s = [mp.re(one) for one in s]
            rows.append([*s, energy(start) - energy(s)])
        return _named("x y der(x) der(y) energy.dissipated", rows)


# ---------------------------------------------------------------- a ball on a paddle


class _Ball:
    """A ball in the air, and on a paddle at a sin w t; ``lost`` to drag and impacts, ``given`` by the paddle."""

    def __init__(self, v: Values, least: float) -> None:
        self.m, self.a, self.w, self.g, cd = (mp.mpf(v[n]) for n in ("m", "a", "w", "g", "cd"))
        self.k, self.e, self.least = cd / self.m, mp.mpf(0.8), least
        self.t, self.y, self.v = mp.mpf(0), mp.mpf(v["y"]), mp.mpf(v.get("der(y)", 0.0))
        self.lost = self.given = mp.mpf(0)
        self.rests = False
        self.happened: list[float] = []

    def flight(self, h: Any) -> tuple[Any, Any]:
        """Height and speed after h in the air."""
        y, v, g, k = self.y, self.v, self.g, self.k
        if k == 0:
            return y + v * h - g * h**2 / 2, v - g * h
        if g == 0:
            return y + mp.sign(v) * mp.log(1 + k * abs(v) * h) / k, v / (1 + k * abs(v) * h)
        end, rate = mp.sqrt(g / k), mp.sqrt(g * k)
        if v > 0:
            phase = mp.atan(v / end)
            if rate * h <= phase:
                left = phase - rate * h
                return y + mp.log(mp.cos(left) / mp.cos(phase)) / k, end * mp.tan(left)
            y, v, h = y - mp.log(mp.cos(phase)) / k, mp.mpf(0), h - phase / rate
        u, s, c = -v / end, mp.sinh(rate * h), mp.cosh(rate * h)
        return y - mp.log(c + u * s) / k, -end * (s + u * c) / (c + u * s)

    def gap(self, h: Any) -> tuple[Any, Any, Any]:
        """Height above the paddle after h in the air, its rate, and the rate of that."""
        y, v = self.flight(h)
        turn, a, w = self.w * (self.t + h), self.a, self.w
        sine = a * mp.sin(turn)
        return y - sine, v - a * w * mp.cos(turn), w**2 * sine - self.g - self.k * v * abs(v)

    def root(self, part: int, low: Any, high: Any) -> Any:
        """Where the gap (0) or its rate (1) changes its sign, by steps of Newton where they stay between, else by halves."""
        sign = mp.sign(self.gap(low)[part]) or -mp.sign(self.gap(high)[part])
        near = mp.mpf(10) ** (3 - mp.mp.dps)
        here = (low + high) / 2
        for _ in range(100):
            found = self.gap(here)
            value, rate = found[part], found[part + 1]
            low, high = (here, high) if mp.sign(value) == sign else (low, here)
            better = here - value / rate if rate else low
            if not low < better < high:
                better = (low + high) / 2
            if abs(better - here) < near:
                return better
            here = better
        return here

    def move(self, h: Any) -> None:
        y, v = self.flight(h)
        self.lost += self.m * ((self.v**2 - v**2) / 2 + self.g * (self.y - y))
        self.t, self.y, self.v = self.t + h, y, v

    def fly(self, until: Any) -> None:
        """Fly to a time, or to the next impact."""
        while self.t < until and not self.rests and len(self.happened) < MOST_BOUNCES:
            far = self.y - abs(self.a)
            h = mp.mpf(1) / 10 / self.w if self.w else until
            if far > 0:
                h = max(h, far / (abs(self.v) + mp.sqrt(self.g * far) + far) / 2)
            h = min(h, until - self.t)
            value, rate, _ = self.gap(0)
            after, rate_after, _ = self.gap(h)
            hit = None
            if rate > 0 and after < 0:
                hit = self.root(0, self.root(1, 0, h), h)
            elif rate <= 0 and after < 0:
                hit = self.root(0, 0, h) if value > 0 else mp.mpf(0)
            elif rate < 0 < rate_after:
                lowest = self.root(1, 0, h)
                if self.gap(lowest)[0] < 0:
                    hit = self.root(0, 0, lowest) if value > 0 else mp.mpf(0)
            if hit is None:
                last = h == until - self.t
                self.move(h)
                self.t = until if last else self.t
                continue
            self.move(hit)
            self.bounce()

    def bounce(self) -> None:
        paddle = self.a * self.w * mp.cos(self.w * self.t)
        rel = self.v - paddle
        self.happened.append(float(self.t))
        before, self.v = self.v, paddle - self.e * rel
        loss = self.m * (1 - self.e**2) * rel**2 / 2
        self.lost += loss
        self.given += self.m * (self.v**2 - before**2) / 2 + loss
        self.y = self.a * mp.sin(self.w * self.t)
        if abs(rel) < self.least and self.press(self.t) > 0:
            self.rests, self.v = True, paddle

    def press(self, t: Any) -> Any:
        """Force of the paddle on a ball that rests, over its mass."""
        v = self.a * self.w * mp.cos(self.w * t)
        return self.g + self.k * v * abs(v) - self.a * self.w**2 * mp.sin(self.w * t)

    def rest(self, until: Any) -> None:
        """Ride on the paddle to a time, or until it draws away."""
        end = until
        t, part = self.t, mp.mpf(1) / 50 / self.w if self.w else until
        while t < until:
            after = min(t + part, until)
            if self.press(after) < 0:
                for _ in range(2 * mp.mp.prec):
                    middle = (t + after) / 2
                    t, after = (middle, after) if self.press(middle) > 0 else (t, middle)
                end, self.rests = after, False
                self.happened.append(float(end))
                break
            t = after
        before = self.m * (self.v**2 / 2 + self.g * self.y)
        drag = self.dragged(end) - self.dragged(self.t)
        self.t, self.y = end, self.a * mp.sin(self.w * end)
        self.v = self.a * self.w * mp.cos(self.w * end)
        self.lost += drag
        self.given += self.m * (self.v**2 / 2 + self.g * self.y) - before + drag

    def dragged(self, t: Any) -> Any:
        """The integral of the power of the drag on the paddle."""
        if self.w == 0:
            return mp.mpf(0)
        turn = self.w * t
        n, s = mp.floor(turn / mp.pi + mp.mpf(1) / 2), mp.sin(turn)
        whole = n * mp.mpf(4) / 3 + (-1) ** int(n) * (s - s**3 / 3)
        return self.m * self.k * abs(self.a * self.w) ** 3 / self.w * whole


def juggle(v: Values, times: NDArray[np.float64], tolerance: float) -> Motion:
    """Flights in closed form between impacts that are located to all digits; bounces that pile up come to rest."""
    with mp.workdps(34 if tolerance < 1e-16 else 28):
        ball = _Ball(v, 1e-11 if tolerance < 1e-16 else 1e-9)
        rows = []
        for t in times.tolist():
            while ball.t < t and len(ball.happened) < MOST_BOUNCES:
                (ball.rest if ball.rests else ball.fly)(mp.mpf(t))
            told = ball.t == t
            rows.append([ball.y, ball.v, ball.given, ball.lost] if told else [mp.nan] * 4)
        made = _named("y der(y) energy.supplied energy.dissipated", rows)
    return made | {"happened": np.array(ball.happened)}
