"""x'' + 0.04 x' + x = cos w t against a stop at 0.3 with restitution 0.8: flights in closed form, impacts by Newton's method."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

STOP, RESTITUTION, DAMPED = 0.3, 0.8, 0.02
FAST = math.sqrt(1 - DAMPED**2)
STEPS = 64
"""Pieces of a period of the force; in each a flight has one maximum at most."""
GRID = np.linspace(0, 1, STEPS + 1)
AT_REST = 1e-10


class Flight:
    """The motion from (x, v) at time s on."""

    def __init__(self, w: float, s: float, x: float, v: float) -> None:
        force = 1 / complex(1 - w * w, 2 * DAMPED * w)
        self.w, self.s, self.a, self.b = w, s, force.real, -force.imag
        p, r = self.forced(s)
        self.c = x - p
        self.d = (v - r + DAMPED * self.c) / FAST

    def forced(self, t: float) -> tuple[float, float]:
        c, s = math.cos(self.w * t), math.sin(self.w * t)
        return self.a * c + self.b * s, self.w * (self.b * c - self.a * s)

    def at(self, t: float) -> tuple[float, float]:
        p, r = self.forced(t)
        fall, angle = math.exp(-DAMPED * (t - self.s)), FAST * (t - self.s)
        c, s = math.cos(angle), math.sin(angle)
        x = fall * (self.c * c + self.d * s)
        return x + p, r - DAMPED * x + fall * FAST * (self.d * c - self.c * s)

    def gap(self, t: float) -> tuple[float, float]:
        """By how much it is beyond the stop, and the rate of that."""
        x, v = self.at(t)
        return x - STOP, v

    def rise(self, t: float) -> tuple[float, float]:
        """Velocity and acceleration."""
        x, v = self.at(t)
        return v, math.cos(self.w * t) - x - 2 * DAMPED * v

    def fall(self, t: float) -> tuple[float, float]:
        v, a = self.rise(t)
        return -v, -a


def newton(f: Callable[[float], tuple[float, float]], low: float, high: float) -> float:
    """The root of a function that passes from below zero to above it, by Newton's method between bounds."""
    t = (low + high) / 2
    for _ in range(100):
        value, slope = f(t)
        low, high = (low, t) if value > 0 else (t, high)
        ahead = t - value / slope if slope else low
        if not low < ahead < high:
            ahead = (low + high) / 2
        if abs(ahead - t) < 2e-15 * max(1.0, abs(t)):
            return ahead
        t = ahead
    return t


def impacts(
    w: float, s: float, x: float, v: float, begin: float, end: float
) -> tuple[float, float, float, int]:
    """Return where the flight begins that passes ``end``, and the number of impacts from ``begin`` on."""
    flight, hits = Flight(w, s, x, v), 0
    while True:
        rate, (place, then) = flight.at(begin)[1], flight.at(end)
        top = end
        if place <= STOP:
            if not rate > 0 > then:
                return s, x, v, hits
            top = newton(flight.fall, begin, end)
            if flight.at(top)[0] <= STOP:
                return s, x, v, hits
        elif rate < 0:  # it has left the stop and comes back
            begin = newton(flight.rise, begin, end)
        s = newton(flight.gap, begin, top)
        x, v, hits = STOP, -RESTITUTION * flight.at(s)[1], hits + 1
        if abs(v) < AT_REST and math.cos(w * s) > STOP:  # it rests until the force presses no more
            s, v = s + (math.acos(STOP) - w * s) % (2 * math.pi) / w, 0.0
        if s >= end:
            return s, x, v, hits
        flight, begin = Flight(w, s, x, v), s


def after_a_period(w: float, x: float, v: float) -> tuple[float, float, int]:
    """The state after a period that begins with the force at its largest, and the number of impacts."""
    s, hits, times = 0.0, 0, GRID * (2 * math.pi / w)
    for begin, end in itertools.pairwise(times):
        if s < end:
            s, x, v, more = impacts(w, s, x, v, max(begin, s), end)
            hits += more
    return *Flight(w, s, x, v).at(times[-1]), hits


def strobed(w: Floats, periods: int, kept: int) -> Floats:
    """Return x at the ends of the last periods [w, kept], from x = v = 0; all values of w go together but for impacts."""
    force = 1 / (1 - w**2 + 2j * DAMPED * w)
    a, b, period = force.real, -force.imag, 2 * np.pi / w
    c, s = np.cos(2 * np.pi * GRID), np.sin(2 * np.pi * GRID)
    begin, x, v = np.zeros_like(w), np.zeros_like(w), np.zeros_like(w)
    found = np.zeros((w.size, kept))

    def at(k: int) -> tuple[Floats, Floats]:
        t, turned = GRID[k] * period - begin, w * begin
        p, r = a * np.cos(turned) + b * np.sin(turned), w * (b * np.cos(turned) - a * np.sin(turned))
        fall, co, si = np.exp(-DAMPED * t), np.cos(FAST * t), np.sin(FAST * t)
        one, other = x - p, (v - r + DAMPED * (x - p)) / FAST
        y = fall * (one * co + other * si)
        rate = fall * FAST * (other * co - one * si) - DAMPED * y + w * (b * c[k] - a * s[k])
        return y + a * c[k] + b * s[k], rate

    for n in range(periods):
        rate = v
        for k in range(1, STEPS + 1):
            place, then = at(k)
            struck = (begin < GRID[k] * period) & ((place > STOP) | (rate > 0) & (then < 0) & (place > 0.05))
            for i in np.flatnonzero(struck):
                first = max(GRID[k - 1] * period[i], begin[i])
                begin[i], x[i], v[i], _ = impacts(w[i], begin[i], x[i], v[i], first, GRID[k] * period[i])
            if struck.any():
                place, then = at(k)
            rate = then
        rests = begin > period
        x, v = np.where(rests, STOP, place), np.where(rests, 0.0, rate)
        begin = np.where(rests, begin - period, 0.0)
        if n >= periods - kept:
            found[:, n - periods + kept] = x
    return found
