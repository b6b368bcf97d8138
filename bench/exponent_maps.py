"""Maps of exponents: double pendulums let go at rest, each with one change, beside variational equations written for them in numba.

numba (``pip install numba``) is left out where it is not installed. Times are of the processor, of all threads.
"""

from __future__ import annotations

import functools
import importlib.util
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import mechc

from .machine import table, write

TEXT = """\
model DoublePendulum
  dimensionless;
  coordinate a = 1;
  coordinate b = 1;
  kinetic der(a)^2 + 1/2*der(b)^2 + der(a)*der(b)*cos(a - b);
  potential -9.81*(2*cos(a) + cos(b));
  experiment(stop = 100);
end DoublePendulum;
"""
STOP, SETTLED, AGAIN = 100.0, 10.0, 1.0
"""How long each motion is, what is left out at its beginning, and when its change is made short again."""


def by_mechc(starts: Any, tolerance: float) -> tuple[float, Any, Any]:
    model = mechc.loads(TEXT)
    over = {("a", "b"): starts}
    model.lyapunov(over={("a", "b"): starts[:1000]}, tolerance=tolerance)  # built and kept
    begun = time.process_time()
    found = model.lyapunov(over=over, tolerance=tolerance)
    return time.process_time() - begun, found["lyapunov(time)"], found["megno(time)"] > 4


@functools.cache
def _numba_exponents() -> Callable[..., Any]:
    import numba
    from scipy.integrate._ivp import dop853_coefficients as coefficients

    stages, n = 12, 8
    A, B = coefficients.A[:stages, :stages].copy(), coefficients.B.copy()
    E3, E5 = coefficients.E3[:stages].copy(), coefficients.E5[:stages].copy()

    @numba.njit(fastmath=True, inline="always")
    def rates(y: Any, out: Any) -> None:
        c, s, sa, ca = np.cos(y[0] - y[1]), np.sin(y[0] - y[1]), np.sin(y[0]), np.cos(y[0])
        sb, cb = np.sin(y[1]), np.cos(y[1])
        first, second = -y[3] * y[3] * s - 19.62 * sa, y[2] * y[2] * s - 9.81 * sb
        below = 1.0 / (2.0 - c * c)
        out[0], out[1] = y[2], y[3]
        out[2] = (first - c * second) * below
        out[3] = second - c * out[2]
        turned = y[4] - y[5]
        dc, ds = -s * turned, c * turned
        by_first = -2.0 * y[3] * y[7] * s - y[3] * y[3] * ds - 19.62 * ca * y[4]
        by_second = 2.0 * y[2] * y[6] * s + y[2] * y[2] * ds - 9.81 * cb * y[5]
        out[4], out[5] = y[6], y[7]
        out[6] = (by_first - dc * second - c * by_second + 2.0 * c * dc * out[2]) * below
        out[7] = by_second - dc * out[2] - c * out[6]

    @numba.njit(fastmath=True, parallel=True)
    def run(starts: Any, tolerance: float) -> Any:
        found = np.empty(len(starts))
        for member in numba.prange(len(starts)):
            k = np.zeros((stages + 1, n))
            y, new, middle = np.zeros(n), np.zeros(n), np.zeros(n)
            y[:2] = starts[member]
            y[4], y[5], y[6], y[7] = 0.6, 0.4, 0.5, 0.48
            t, h, again, grown, settled = 0.0, 1e-2, AGAIN, 0.0, 0.0
            rates(y, k[0])
            while t < STOP:
                h = min(h, again - t)
                for j in range(1, stages):
                    for i in range(n):
                        total = 0.0
                        for m in range(j):
                            total += A[j, m] * k[m, i]
                        middle[i] = y[i] + h * total
                    rates(middle, k[j])
                third, fifth = 0.0, 0.0
                for i in range(n):
                    total, e3, e5 = 0.0, 0.0, 0.0
                    for m in range(stages):
                        total += B[m] * k[m, i]
                        e3 += E3[m] * k[m, i]
                        e5 += E5[m] * k[m, i]
                    new[i] = y[i] + h * total
                    scale = tolerance * (1 + max(abs(y[i]), abs(new[i])))
                    third += (e3 / scale) ** 2
                    fifth += (e5 / scale) ** 2
                both = fifth + 0.01 * third
                error = h * fifth / np.sqrt(both * n) if both > 0 else 0.0
                if error <= 1:
                    t += h
                    y[:] = new
                    if t >= again - 1e-12:
                        size = np.sqrt(y[4] ** 2 + y[5] ** 2 + y[6] ** 2 + y[7] ** 2)
                        y[4:] /= size
                        grown += np.log(size)
                        if abs(t - SETTLED) < AGAIN / 2:
                            settled = grown
                        again += AGAIN
                    rates(y, k[0])
                h *= min(6.0, max(0.333, 0.9 * max(error, 1e-10) ** -0.125))
            found[member] = (grown - settled) / (STOP - SETTLED)
        return found

    return run


def by_numba(starts: Any, tolerance: float) -> tuple[float, Any]:
    run = _numba_exponents()
    run(starts[:2], tolerance)
    begun = time.process_time()
    found = run(starts, tolerance)
    return time.process_time() - begun, found


def main(quick: bool = False) -> None:
    side = 40 if quick else 200
    places = np.linspace(-3.0, 3.0, side)
    starts = np.stack(np.meshgrid(places, places, indexing="ij"), axis=-1).reshape(-1, 2)
    rows = []
    for tolerance in (1e-6, 1e-8):
        taken, own, chaotic = by_mechc(starts, tolerance)
        row = [f"{tolerance:g}", f"{taken:.1f} s"]
        if importlib.util.find_spec("numba"):
            other, found = by_numba(starts, tolerance)
            off = np.abs(own - found)
            row += [
                f"{other:.1f} s", f"{other / taken:.2f}", f"{np.median(off[~chaotic]):.1e}",
                f"{own[chaotic].mean():.4f}, {found[chaotic].mean():.4f}",
            ]  # fmt: skip
        rows.append([*row, f"{chaotic.mean():.1%}"])
        print(rows[-1], flush=True)
    head = [
        "tolerance", "mechc", *(["numba", "numba/mechc", "regular motions differ by", "mean of chaotic ones: mechc, numba"] if len(rows[0]) > 3 else []),
        "chaotic",
    ]  # fmt: skip
    text = (
        f"The largest exponent of {side} x {side} double pendulums let go at rest, over a time of {STOP:g}, of which a tenth is left out, "
        "by `model.lyapunov(over=…)`: one change of each motion goes along as states, in lanes and threads. Beside it DOP853 and the "
        "variational equations by hand in numba, over the same time, with prange. Times are of the processor, of all threads."
    )
    write("exponent_maps", "Maps of exponents", [text, table(head, rows)])
