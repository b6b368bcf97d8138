"""How a linear system answers sines: its transfer functions with bounds of their rounding, and phases without jumps.

Each of the systems here is m(w) X = p(w) in the amplitudes X of its states, Y = c X + d(w) in those of its outputs.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np
import scipy.linalg
from msgspec import Struct
from numpy.typing import NDArray

from ..problem import Array
from .linear_system import LinearSystem, OutputForm
from .zeros import EPSILON, Complex

ROUNDING = 8 * EPSILON
"""Of each entry of the equations, relative to the terms it is the sum of."""
AT_ONCE = 2_000_000
"""Entries of the equations that are solved together."""
LARGE = 24
"""States from which on a system is factored once for all frequencies."""
TURN, RISE = math.radians(30), 1.6
"""Between neighbouring frequencies phases turn by no more, and gains change by no greater factor, ..."""
NEAR = 1e-6
"""... unless these are closer than this share of them,"""
MOST = 20_000
"""or there are so many."""
ABRUPT = math.radians(150)
"""A phase that turns by more between frequencies that near is on a pole or a zero of the imaginary axis."""


class Amplitudes(Struct, frozen=True, eq=False):
    """The equations at some frequencies: ``m`` [w][n][n] and ``sizes``, the sums of the sizes of the terms of its entries;
    ``p`` [w][n][inputs], ``c`` [outputs][n], ``d`` [w][outputs][inputs]. ``shifted``: where m = ``shift`` - A of a large A."""

    m: Complex
    sizes: Array
    p: Complex
    c: Array
    d: Complex
    shifted: Schur | None = None
    shift: Complex | None = None


class Schur(Struct, frozen=True, eq=False):
    """A = ``u`` ``t`` ``u``* with an upper triangle t, so that each frequency takes n^2 operations and not n^3."""

    t: Complex
    u: Complex

    def solved(self, shift: Complex, right: Complex) -> Complex:
        """Solve (shift - A) x = right for [w][n][m]."""
        found = np.moveaxis(self.u.conj().T @ right, 1, 0).copy()
        for i in range(len(self.t) - 1, -1, -1):
            found[i] += np.tensordot(self.t[i, i + 1 :], found[i + 1 :], 1)
            found[i] /= (shift - self.t[i, i])[:, None]
        return np.asarray(self.u @ np.moveaxis(found, 0, 1), dtype=complex)

    def beside(self, shift: Complex, c: Array) -> Complex:
        """Return c (shift - A)^-1 [w][k][n]."""
        found = np.repeat((c @ self.u).T[:, None, :], len(shift), axis=1)
        for i in range(len(self.t)):
            found[i] += np.tensordot(self.t[:i, i], found[:i], 1)
            found[i] /= (shift - self.t[i, i])[:, None]
        return np.asarray(np.moveaxis(found, 0, 2) @ self.u.conj().T, dtype=complex)


@functools.lru_cache(maxsize=64)
def _schur_of(system: LinearSystem | OutputForm) -> Schur | None:
    """Return the factors of a large system; small ones are solved as they are."""
    if len(system.a) < LARGE:
        return None
    t, u = scipy.linalg.schur(system.a, output="complex")
    return Schur(np.asarray(t, dtype=complex), np.asarray(u, dtype=complex))


class Transfer(Protocol):
    """A linear system that is asked for its answer to sines. ``condition``: what multiplies its rounding; ``period`` of its
    samples, None where it has none."""

    @property
    def condition(self) -> float: ...

    @property
    def period(self) -> float | None: ...

    @property
    def states(self) -> int: ...

    def amplitudes(self, w: Array) -> Amplitudes: ...


class Continuous(Struct, frozen=True, eq=False):
    """The system at s = i w."""

    system: LinearSystem

    @property
    def condition(self) -> float:
        return max(1.0, self.system.condition)

    @property
    def period(self) -> None:
        return None

    @property
    def states(self) -> int:
        return len(self.system.a)

    def amplitudes(self, w: Array) -> Amplitudes:
        system, identity = self.system, np.eye(len(self.system.a))
        s: Complex = np.asarray(1j * w, dtype=complex)
        m: Complex = np.asarray(s[:, None, None] * identity - system.a, dtype=complex)
        sizes = np.abs(w)[:, None, None] * identity + np.abs(system.a)
        return Amplitudes(
            m, sizes, polynomial(system.b, s), system.c, polynomial(system.d, s), _schur_of(system), s
        )


class Sampled(Struct, frozen=True, eq=False):
    """The system x[k+1] = a x[k] + b u[k], y[k] = c x[k] + d u[k] at exp(i w ``period``)."""

    form: OutputForm
    period: float
    condition: float

    @property
    def states(self) -> int:
        return len(self.form.a)

    def amplitudes(self, w: Array) -> Amplitudes:
        form, z, identity = self.form, np.exp(1j * w * self.period), np.eye(len(self.form.a))
        m = z[:, None, None] * identity - form.a
        shape = (len(w), *form.b.shape)
        return Amplitudes(
            m,
            np.broadcast_to(identity + np.abs(form.a), m.shape),
            np.broadcast_to(form.b.astype(complex), shape),
            form.c,
            np.broadcast_to(form.d.astype(complex), (len(w), *form.d.shape)),
            _schur_of(form),
            z,
        )


class Answers(Struct, frozen=True, eq=False):
    """The transfer functions ``values`` [w][outputs][inputs] and bounds of their rounding; infinite on a pole."""

    values: Complex
    errors: Array


def polynomial(parts: Sequence[Array], s: Complex) -> Complex:
    """Return the sum of parts[k] s^k [len(s)][rows][columns]."""
    found: Complex = np.tensordot(s[:, None] ** np.arange(len(parts)), np.array(parts), 1)
    return found


def held(a: Array, b: Array, period: float) -> tuple[Array, Array]:
    """Return A and B from one sample to the next, for inputs that are held in between."""
    n, m = b.shape
    whole = np.zeros((n + m, n + m))
    whole[:n, :n], whole[:n, n:] = a, b
    step = scipy.linalg.expm(whole * period)
    return step[:n, :n], step[:n, n:]


def answers(transfer: Transfer, w: Array) -> Answers:
    """Return the answers at frequencies ``w`` [rad per unit of time]."""
    slices = max(1, AT_ONCE // max(transfer.states**2, 1))
    parts = [_answers(transfer, w[k : k + slices]) for k in range(0, len(w), slices)]
    return Answers(
        np.concatenate([part.values for part in parts]), np.concatenate([part.errors for part in parts])
    )


def _answers(transfer: Transfer, w: Array) -> Answers:
    it = transfer.amplitudes(w)
    x = _solved(it, it.p)
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        seen = _beside(it)
        # a second step makes each entry right to the rounding of its own terms
        again = x + _solved(it, it.p - it.m @ x)
        x = np.asarray(np.where(np.isfinite(again), again, x), dtype=complex)
        values: Complex = np.asarray(it.c @ x + it.d, dtype=complex)
        errors = np.abs(seen) @ it.sizes @ np.abs(x) + np.abs(seen) @ np.abs(it.p)
        errors = errors + np.abs(it.c) @ np.abs(x) + np.abs(it.d)
    on_a_pole = ~np.isfinite(x).all(axis=(1, 2))
    values[on_a_pole], errors[on_a_pole] = np.inf, np.inf
    return Answers(values, ROUNDING * transfer.condition * errors)


def _beside(it: Amplitudes) -> Complex:
    """Return c m^-1 [w][k][n]."""
    if it.shifted is not None and it.shift is not None:
        return it.shifted.beside(it.shift, it.c)
    c = np.broadcast_to(it.c.T.astype(complex), (len(it.m), *it.c.T.shape))
    turned = Amplitudes(np.swapaxes(it.m, 1, 2), it.sizes, it.p, it.c, it.d)
    return np.swapaxes(_solved(turned, c), 1, 2)


def _solved(it: Amplitudes, right: Complex) -> Complex:
    """Solve many systems; infinity where one is singular."""
    if it.shifted is not None and it.shift is not None:
        return it.shifted.solved(it.shift, right)
    m = it.m
    try:
        return np.asarray(np.linalg.solve(m, right), dtype=complex)
    except np.linalg.LinAlgError:
        pass
    found: Complex = np.full(right.shape, np.inf, dtype=np.complex128)
    for k in range(len(m)):
        try:
            found[k] = np.linalg.solve(m[k], right[k])
        except np.linalg.LinAlgError:
            continue
    return found


def refined(transfers: Sequence[Transfer], w: Array) -> Array:
    """Return frequencies with more between them where some answer turns or rises steeply."""
    found = np.unique(w)
    values = [answers(one, found) for one in transfers]
    while len(found) < MOST:
        steep = np.diff(found) > NEAR * found[1:]
        steep = steep & np.any([_steep(one) for one in values], axis=0)
        if not steep.any():
            break
        low, high = found[:-1][steep], found[1:][steep]
        middle = np.where(low > 0, np.sqrt(low * high), high / 2)
        place = np.flatnonzero(steep) + 1
        found = np.insert(found, place, middle)
        values = [
            Answers(
                np.insert(old.values, place, new.values, axis=0),
                np.insert(old.errors, place, new.errors, axis=0),
            )
            for old, new in zip(values, (answers(one, middle) for one in transfers), strict=True)
        ]
    return found


def _steep(one: Answers) -> NDArray[np.bool_]:
    """Tell between which neighbours an answer that is more than rounding turns or rises too much."""
    known = np.isfinite(one.values) & (np.abs(one.values) > one.errors)
    both = known[1:] & known[:-1]
    with np.errstate(all="ignore"):
        ratio = np.where(both, one.values[1:] / one.values[:-1], 1.0)
    size = np.abs(ratio)
    steep = (np.abs(np.angle(ratio)) > TURN) | (size > RISE) | (size < 1 / RISE)
    return np.asarray(steep.any(axis=(1, 2)))


def phases(one: Answers) -> Array:
    """Return phases in rad [w][outputs][inputs] without jumps, not-a-number where an answer is no more than its rounding.

    They begin above -270 degrees and not above 90. On the imaginary axis a pole takes 180 degrees away and a zero adds them, as with the
    least damping.
    """
    found: Array = np.full(one.values.shape, np.nan)
    known = np.isfinite(one.values) & (np.abs(one.values) > one.errors)
    for k, j in np.ndindex(*one.values.shape[1:]):
        places = np.flatnonzero(known[:, k, j])
        if places.size:
            found[places, k, j] = _unwrapped(one.values[places, k, j])
    return found


def _unwrapped(values: Complex) -> Array:
    turns = np.angle(values[1:] / values[:-1])
    gains = np.log(np.abs(values))
    for i in np.flatnonzero(np.abs(turns) > ABRUPT):
        beside = max(gains[i - 1] if i else -math.inf, gains[i + 2] if i + 2 < len(gains) else -math.inf)
        pole = max(gains[i], gains[i + 1]) > beside
        turns[i] = (-1.0 if pole else 1.0) * abs(turns[i])
    first = float(np.angle(values[0]))
    first -= 2 * math.pi * math.ceil((first - math.pi / 2 - 1e-8) / (2 * math.pi))
    whole: Array = first + np.concatenate([[0.0], np.cumsum(turns)])
    return whole
