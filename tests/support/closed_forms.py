"""Closed solutions of mechanics, from textbooks and special functions; nothing here uses mechc."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import quad, solve_ivp
from scipy.linalg import eigh
from scipy.special import ellipj, ellipk

Array = NDArray[np.float64]


def swing(t: ArrayLike, amplitude: float, w0: float) -> Array:
    """Angle of theta'' + w0^2 sin(theta) = 0 released at rest: sin(theta/2) = k cd(w0 t), k = sin(amplitude/2)."""
    k = np.sin(amplitude / 2)
    _, cn, dn, _ = ellipj(w0 * np.asarray(t), k * k)
    return np.asarray(2 * np.arcsin(k * cn / dn))


def swing_rate(t: ArrayLike, amplitude: float, w0: float) -> Array:
    """Derivative of ``swing``: -2 k k' w0 sd(w0 t)."""
    k = np.sin(amplitude / 2)
    sn, _, dn, _ = ellipj(w0 * np.asarray(t), k * k)
    return np.asarray(-2 * k * np.sqrt(1 - k * k) * w0 * sn / dn)


def swing_period(amplitude: float, w0: float) -> float:
    """4 K(k)/w0 with k = sin(amplitude/2)."""
    return float(4 * ellipk(np.sin(amplitude / 2) ** 2) / w0)


def eccentric_anomaly(mean: ArrayLike, e: float) -> Array:
    """Solve Kepler's equation E - e sin E = mean by Newton steps, e < 1."""
    mean = np.asarray(mean, dtype=float)
    turns = np.round(mean / (2 * np.pi)) * 2 * np.pi
    m = mean - turns
    E = m + e * np.sign(np.sin(m)) * 0.85
    for _ in range(50):
        E = E - (E - e * np.sin(E) - m) / (1 - e * np.cos(E))
    return np.asarray(E + turns)


def kepler_orbit(t: ArrayLike, r0: Sequence[float], v0: Sequence[float], mu: float) -> Array:
    """Positions, shape (len(t), 3), on the ellipse of r'' = -mu r/|r|^3 (Danby, f and g functions)."""
    r, v = np.asarray(r0, dtype=float), np.asarray(v0, dtype=float)
    distance = float(np.linalg.norm(r))
    a = 1 / (2 / distance - v @ v / mu)
    n = np.sqrt(mu / a**3)
    ecosE, esinE = 1 - distance / a, r @ v / np.sqrt(mu * a)
    e, E0 = float(np.hypot(ecosE, esinE)), np.arctan2(esinE, ecosE)
    t = np.asarray(t, dtype=float)
    dE = eccentric_anomaly(n * t + E0 - e * np.sin(E0), e) - E0
    f = 1 - a / distance * (1 - np.cos(dE))
    g = t + (np.sin(dE) - dE) / n
    return np.asarray(np.multiply.outer(f, r) + np.multiply.outer(g, v))


def integrate(f: Callable[[float, Array], Sequence[float]], y0: Sequence[float], t: ArrayLike) -> Array:
    """Integrate y' = f(t, y) by scipy's DOP853 at 1e-13; states in rows, one column for each time."""
    times = np.asarray(t, dtype=float)
    s = solve_ivp(
        f, (times[0], times[-1]), y0, method="DOP853", t_eval=times, rtol=1e-13, atol=1e-15, max_step=0.05
    )
    assert s.success, s.message
    return np.asarray(s.y)


def time_between(speed2: Callable[[float], float], low: float, high: float) -> float:
    """Time from one turning point to the other, integral of dx/sqrt(speed2(x)); substitution x = c - d cos(s)."""
    c, d = (low + high) / 2, (high - low) / 2

    def integrand(s: float) -> float:
        x = c - d * np.cos(s)
        return float(d * np.sin(s) / np.sqrt(speed2(x)))

    value, _ = quad(integrand, 0, np.pi, epsabs=0, epsrel=1e-12, limit=400)
    return float(value)


def small_swings(M: ArrayLike, K: ArrayLike, q0: ArrayLike, t: ArrayLike) -> tuple[Array, Array]:
    """Frequencies, and the motion of M q'' + K q = 0 released at rest: q in rows, one column for each time."""
    squares, modes = eigh(np.asarray(K, dtype=float), np.asarray(M, dtype=float))
    omega = np.sqrt(squares)
    shares = modes.T @ np.asarray(M, dtype=float) @ np.asarray(q0, dtype=float)
    return omega, modes @ (shares[:, None] * np.cos(np.multiply.outer(omega, np.asarray(t))))
