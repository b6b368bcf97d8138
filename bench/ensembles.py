"""Ensembles of a double pendulum: mechc's threads over its scalar kernel beside heyoka's batch mode, at equal true error.

heyoka (``pip install heyoka``) is left out where it is not installed.
"""

from __future__ import annotations

import importlib.util
import math
import time
from typing import Any

import numpy as np

import mechc

from .machine import table, write

PENDULUM = """
model DoublePendulum
  coordinate a = 0 rad;
  coordinate b = 0 rad;
  kinetic 1/2*2 kg*(1 m*der(a))^2 + 1/2*1 kg*(1 m*der(b))^2 + 1 kg*(1 m)^2*der(a)*der(b)*cos(a - b);
  potential -9.81 m/s^2*1 m*(2 kg*cos(a) + 1 kg*cos(b));
  experiment(stop = 10 s);
end DoublePendulum;
"""
EXACT = 100
"""Members whose true error is looked at."""
BATCH = 8


def starts(n: int) -> Any:
    """Return angles [n, 2] within a radian of the vertical."""
    return np.random.default_rng(1).uniform(-1, 1, (n, 2))


def by_mechc(model: mechc.Model, angles: Any, tolerance: float, threads: int = 1) -> tuple[float, Any]:
    """Return CPU seconds and end angles [n, 2]."""
    begun = time.process_time()
    runs = model.ensemble(
        {("a", "b"): angles}, "final(a), final(b)", tolerance=tolerance, errors="none", threads=threads
    )
    return time.process_time() - begun, np.column_stack([runs["final(a)"], runs["final(b)"]])


def _equations() -> Any:
    import heyoka as hy

    a, b, va, vb = hy.make_vars("a", "b", "va", "vb")
    c, s = hy.cos(a - b), hy.sin(a - b)
    # 2 a'' + b'' c = -vb^2 s - 2 g sin a;  a'' c + b'' = va^2 s - g sin b
    first, second = -vb * vb * s - 19.62 * hy.sin(a), va * va * s - 9.81 * hy.sin(b)
    determinant = 2.0 - c * c
    return [
        (a, va),
        (b, vb),
        (va, (first - c * second) / determinant),
        (vb, (2.0 * second - c * first) / determinant),
    ]


def by_heyoka(angles: Any, tolerance: float) -> tuple[float, Any]:
    import heyoka as hy

    integrator = hy.taylor_adaptive_batch(
        _equations(), state=np.zeros((4, BATCH)), tol=tolerance, fast_math=True, compact_mode=False
    )
    ends = np.empty_like(angles)
    begun = time.process_time()
    for k in range(0, len(angles), BATCH):
        integrator.set_time(0.0)
        integrator.state[:2] = angles[k : k + BATCH].T
        integrator.state[2:] = 0.0
        integrator.propagate_until(10.0)
        ends[k : k + BATCH] = integrator.state[:2].T
    return time.process_time() - begun, ends


def exact(model: mechc.Model, angles: Any) -> Any:
    """Return end angles to some 15 digits: by heyoka in long double where it is there, else by mechc at 1e-14."""
    if not importlib.util.find_spec("heyoka"):
        return by_mechc(model, angles, 1e-14)[1]
    import heyoka as hy

    real = np.longdouble
    integrator = hy.taylor_adaptive(
        _equations(), state=np.zeros(4, dtype=real), tol=real(1e-18), fp_type=real
    )
    ends = np.empty(angles.shape, dtype=real)
    for k, row in enumerate(angles):
        integrator.time = real(0)
        integrator.state[:] = [*row.astype(real), real(0), real(0)]
        integrator.propagate_until(real(10))
        ends[k] = integrator.state[:2]
    return ends


def main(quick: bool = False) -> None:
    n = 2000 if quick else 10_000
    model, angles = mechc.loads(PENDULUM), starts(n)
    by_mechc(model, angles[:8], 1e-9)  # compiled
    reference = exact(model, angles[:EXACT])
    rows = []
    solvers = [("mechc, scalar kernel", lambda tol: by_mechc(model, angles, tol))]
    if importlib.util.find_spec("heyoka"):
        solvers.append((f"heyoka, batch {BATCH}, fast_math", lambda tol: by_heyoka(angles, tol)))
    for name, solve in solvers:
        for tolerance in (1e-8, 1e-10, 1e-12) if name.startswith("mechc") else (1e-8, 1e-12, 1e-15):
            seconds, ends = min((solve(tolerance) for _ in range(3)), key=lambda found: found[0])
            error = float(np.median(np.abs(ends[:EXACT] - reference).max(axis=1)))
            rows.append(
                [name, f"{tolerance:g}", f"{seconds / n * 1e6:.1f}", f"{error:.1e}", f"{seconds:.2f}"]
            )
    assert all(math.isfinite(float(row[3])) for row in rows)
    parts = [
        f"{n} double pendulums over 10 s, starts spread by a radian, one thread; CPU time, best of three. The error is the "
        f"median over {EXACT} members of the largest difference of an angle at the end from a solution in long double.",
        table(["", "tolerance", "us a member", "error", "CPU seconds"], rows),
    ]
    write("ensembles", "Ensembles", parts)
