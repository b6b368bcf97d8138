"""Linear systems with delays: their exact frequency response, and Padé approximations of the delays by states.

x' = A x + B u + E w, y = C x + D u + F w, w_j = v_j(t - T_j), v = G x + D' u: each delayed number w_j is one more input, and the
quantity v_j that it delays one more output. No v depends on a w without a delay.

The approximation of order n of exp(-z) is (1 - Z)/(1 + Z) with the continued fraction Z = 1/(2/z + 1/(6/z + 1/(10/z + ..))) of
tanh(z/2) after n terms: a ladder of n stores between a wave that goes in and the one that comes back, with entries up to 4 n however
large the coefficients of its polynomials are. For Re z >= 0 it is off by at most |z|^(2n + 1) n!^2/((2n)! (2n + 1)!), as its denominator
is at least 1 there and the integral in its remainder at most B(n + 1, n + 1).
G. A. Baker, P. Graves-Morris, Padé Approximants, Cambridge University Press 1996.
"""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ..interface import Quantity
from ..problem import Array
from .frequency_response import Amplitudes, polynomial
from .linear_system import LinearSystem
from .zeros import Complex

CLOSE = 1e-10
"""Of exp(-z) up to the fastest pole that may be unstable."""
TRUSTED = 1e-11
"""Poles of an approximation are poles where each of its delays is right to this share."""
LOWEST, HIGHEST = 16, 150
"""Orders of an approximation in which poles are looked for."""


class LinearDelays(Struct, frozen=True, eq=False):
    """``whole``: the system from inputs and delayed numbers to outputs and what is delayed; ``times`` [m] of the delays; ``delayed``: what
    w_j are called, with their units."""

    whole: LinearSystem
    times: Array
    delayed: tuple[Quantity, ...]

    @property
    def condition(self) -> float:
        return max(1.0, self.whole.condition)

    @property
    def period(self) -> None:
        return None

    @property
    def states(self) -> int:
        return len(self.whole.a) + len(self.times)

    def amplitudes(self, w: Array) -> Amplitudes:
        """Return the equations in x and the delayed numbers at s = i w."""
        it, n, m = self.whole, len(self.whole.a), len(self.times)
        b, e, c, f, g = self._parts()
        s: Complex = np.asarray(1j * w, dtype=complex)
        turned = np.exp(-s[:, None] * self.times)
        equations = np.zeros((len(w), n + m, n + m), dtype=complex)
        equations[:, :n, :n] = s[:, None, None] * np.eye(n) - it.a
        equations[:, :n, n:] = -e
        equations[:, n:, :n] = -turned[:, :, None] * g
        equations[:, n:, n:] = np.eye(m)
        sizes = np.abs(equations)
        sizes[:, :n, :n] = np.abs(w)[:, None, None] * np.eye(n) + np.abs(it.a)
        # the phase of w_j is off by the rounding of w T_j
        sizes[:, range(n, n + m), range(n, n + m)] += np.abs(w)[:, None] * self.times
        direct = polynomial(it.d, s)[:, :, : -m or None]
        k = len(c)
        moved = turned[:, :, None] * direct[:, k:]
        p = np.concatenate([polynomial(b, s), moved], axis=1)
        return Amplitudes(equations, sizes, p, np.hstack([c, f]), direct[:, :k])

    def approximated(self, order: int) -> LinearSystem:
        """Return the system with Padé approximations of its delays: ``order`` states more for each."""
        it, m = self.whole, len(self.times)
        b, e, c, f, g = self._parts()
        k, inner = len(c), len(it.a)
        ladder, into, out, through = pade(order)
        # w = stores -> J z + through v
        j, store = np.kron(np.eye(m), out), np.kron(np.diag(1 / self.times), ladder)
        drive = np.kron(np.diag(1 / self.times), into[:, None])
        direct = [part[:, : part.shape[1] - m] for part in it.d]
        a = np.zeros((inner + m * order,) * 2)
        a[:inner, :inner], a[:inner, inner:] = it.a + through * e @ g, e @ j
        a[inner:, :inner], a[inner:, inner:] = drive @ g, store
        behind = tuple(
            Quantity(f"{q.name}.pade[{i}]", "state", q.unit)
            for q in self.delayed
            for i in range(1, order + 1)
        )
        return replace(
            it,
            a=a,
            b=tuple(
                np.vstack([one + through * e @ d[k:], drive @ d[k:]])
                for one, d in zip(b, direct, strict=True)
            ),
            c=np.hstack([c + through * f @ g, f @ j]),
            d=tuple(d[:k] + through * f @ d[k:] for d in direct),
            drives=it.drives[: len(it.drives) - m],
            behind=behind,
        )

    def fastest(self) -> float:
        """Return a bound of the size of the poles whose real part is not negative, in the balanced norm of the sum of all terms."""
        from scipy.linalg import matrix_balance

        _, e, _, _, g = self._parts()
        terms = np.abs(self.whole.a) + np.abs(e) @ np.abs(g)
        with np.errstate(invalid="ignore"):
            balanced, _ = matrix_balance(terms, permute=False, separate=True)
        return float(np.abs(np.linalg.eigvals(balanced)).max(initial=0.0))

    def order(self) -> int | None:
        """Return the order in which approximations have all poles whose real part is not negative; None beyond ``HIGHEST``."""
        z = self.fastest() * float(self.times.max(initial=0.0))
        return next((n for n in range(LOWEST, HIGHEST + 1) if bound(n, z) < CLOSE), None)

    def trusted(self, values: Complex, order: int) -> np.ndarray:
        """Tell which poles of the approximation are those of the system."""
        found = np.ones(len(values), dtype=bool)
        for t in dict.fromkeys(self.times.tolist()):
            z = values * t
            with np.errstate(all="ignore"):
                off = np.abs(approximation(order, z) * np.exp(z) - 1)
            found &= off < TRUSTED
        return found

    def _parts(self) -> tuple[tuple[Array, ...], Array, Array, Array, Array]:
        """Return B by the derivatives of the inputs, E, C, F, G."""
        it, m = self.whole, len(self.times)
        k = len(it.c) - m
        inputs = it.b[0].shape[1] - m
        b = tuple(part[:, :inputs] for part in it.b)
        return b, it.b[0][:, inputs:], it.c[:k], it.d[0][:k, inputs:], it.c[k:]


def pade(order: int) -> tuple[Array, Array, Array, float]:
    """Return x' = a x + b v, w = c x + d v of the Padé approximation of exp(-s), as many powers above as below."""
    a, b, c = np.zeros((order, order)), np.zeros(order), np.zeros(order)
    odd = order % 2 == 1
    ends = np.arange(order) % 2 == (0 if odd else 1)
    """The stores whose sum is the flow (of odd orders) or the effort (of even ones) at the front."""
    for k in range(order):
        factor = 2.0 * (2 * k + 1)
        before = np.arange(order) < k
        own = np.arange(order) % 2 != k % 2
        if (k % 2 == 0) == odd:  # what is left of v
            a[k] -= factor * ends
            a[k] -= factor * (own & before)
            b[k] = factor
        else:
            a[k] += factor * (ends & ~before)
    c[:] = (2.0 if odd else -2.0) * ends
    return a, b, c, -1.0 if odd else 1.0


def approximation(order: int, z: Complex) -> Complex:
    """Return the Padé approximation of exp(-z): (1 - Z)/(1 + Z), Z from its end."""
    tail: Complex = np.zeros_like(z)
    for k in range(order, 0, -1):
        tail = z / (2 * (2 * k - 1) + z * tail)
    return np.asarray((1 - tail) / (1 + tail), dtype=complex)


def bound(order: int, z: float) -> float:
    """Return a bound of the error of the approximation of exp(-z) for |z| = ``z`` with a real part that is not negative."""
    if not z:
        return 0.0
    n = order
    logarithm = (
        (2 * n + 1) * math.log(z) + 2 * math.lgamma(n + 1) - math.lgamma(2 * n + 1) - math.lgamma(2 * n + 2)
    )
    return math.exp(min(logarithm, 700.0))


def right_up_to(order: int, share: float) -> float:
    """Return the z up to which the bound of the error is below a share."""
    return float((share / bound(order, 1.0)) ** (1 / (2 * order + 1)))
