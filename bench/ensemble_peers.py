"""Others that run many double pendulums: heyoka in batches, a DOP853 of our own by numba's prange, MuJoCo's rollout.

Each gives CPU seconds and end angles [n, 2] for starts at rest; all need ``pip install heyoka numba mujoco``, and are left out
where they are not installed.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable
from typing import Any

import numpy as np

BATCH = 8
STOP = 10.0
CHUNK = 64
"""Members of a rollout, which keeps every step."""


def heyoka_equations() -> Any:
    import heyoka as hy

    a, b, va, vb = hy.make_vars("a", "b", "va", "vb")
    c, s = hy.cos(a - b), hy.sin(a - b)
    # 2 a'' + b'' c = -vb^2 s - 2 g sin a;  a'' c + b'' = va^2 s - g sin b; one division
    first, second = -vb * vb * s - 19.62 * hy.sin(a), va * va * s - 9.81 * hy.sin(b)
    by_first = (first - c * second) / (2.0 - c * c)
    return [(a, va), (b, vb), (va, by_first), (vb, second - c * by_first)]


@functools.cache
def _batch(tolerance: float) -> Any:
    import heyoka as hy

    return hy.taylor_adaptive_batch(
        heyoka_equations(), state=np.zeros((4, BATCH)), tol=tolerance, fast_math=True, compact_mode=False
    )


def by_heyoka(angles: Any, tolerance: float) -> tuple[float, Any]:
    """One integrator of eight lanes, batch after batch."""
    integrator = _batch(tolerance)
    ends = np.empty_like(angles)
    begun = time.process_time()
    for k in range(0, len(angles), BATCH):
        integrator.set_time(0.0)
        integrator.state[:2] = angles[k : k + BATCH].T
        integrator.state[2:] = 0.0
        integrator.propagate_until(STOP)
        ends[k : k + BATCH] = integrator.state[:2].T
    return time.process_time() - begun, ends


def by_heyoka_ensemble(angles: Any, tolerance: float) -> tuple[float, Any]:
    """heyoka's own ensemble function, over batches of eight lanes."""
    import heyoka as hy

    integrator = _batch(tolerance)
    integrator.set_time(0.0)

    def begin(copy: Any, k: int) -> Any:
        copy.set_time(0.0)
        copy.state[:2] = angles[k * BATCH : (k + 1) * BATCH].T
        copy.state[2:] = 0.0
        return copy

    begun = time.process_time()
    found = hy.ensemble_propagate_until_batch(integrator, STOP, len(angles) // BATCH, begin)
    ends = np.concatenate([one[0].state[:2].T for one in found])
    return time.process_time() - begun, ends


Try = Callable[[Any, float], tuple[float, Any]]


def in_processes(best: Try, angles: Any, tolerance: float, processes: int) -> tuple[float, Any]:
    """The best of several processes: times change from process to process."""
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    found = []
    for _ in range(processes):
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
            found.append(pool.submit(best, angles, tolerance).result())
    return min(found, key=lambda one: one[0])


def best_of_heyoka(angles: Any, tolerance: float) -> tuple[float, Any]:
    """The best of both its ways, twice each."""
    tries = [solve(angles, tolerance) for solve in (by_heyoka, by_heyoka_ensemble) for _ in range(2)]
    return min(tries, key=lambda one: one[0])


def exactly(angles: Any) -> Any:
    """Return end angles by heyoka in long double."""
    import heyoka as hy

    real = np.longdouble
    integrator = hy.taylor_adaptive(
        heyoka_equations(), state=np.zeros(4, dtype=real), tol=real(1e-18), fp_type=real
    )
    ends = np.empty(angles.shape, dtype=real)
    for k, row in enumerate(angles):
        integrator.time = real(0)
        integrator.state[:] = [*row.astype(real), real(0), real(0)]
        integrator.propagate_until(real(STOP))
        ends[k] = integrator.state[:2]
    return ends


@functools.cache
def _numba_dop853() -> Any:
    import numba
    from scipy.integrate._ivp import dop853_coefficients as table

    stages = 12
    A, B = table.A[:stages, :stages].copy(), table.B.copy()
    E3, E5 = table.E3[:stages].copy(), table.E5[:stages].copy()

    @numba.njit(fastmath=True, inline="always")
    def rates(y: Any, out: Any) -> None:
        c, s = np.cos(y[0] - y[1]), np.sin(y[0] - y[1])
        first = -y[3] * y[3] * s - 19.62 * np.sin(y[0])
        second = y[2] * y[2] * s - 9.81 * np.sin(y[1])
        out[0], out[1] = y[2], y[3]
        out[2] = (first - c * second) / (2.0 - c * c)
        out[3] = second - c * out[2]

    @numba.njit(fastmath=True, parallel=True)
    def run(angles: Any, tolerance: float) -> Any:
        ends = np.empty_like(angles)
        for member in numba.prange(len(angles)):
            k = np.zeros((stages + 1, 4))
            y, new, middle = np.zeros(4), np.zeros(4), np.zeros(4)
            y[:2] = angles[member]
            t, h = 0.0, 1e-2
            rates(y, k[0])
            while t < STOP:
                h = min(h, STOP - t)
                for j in range(1, stages):
                    for i in range(4):
                        total = 0.0
                        for m in range(j):
                            total += A[j, m] * k[m, i]
                        middle[i] = y[i] + h * total
                    rates(middle, k[j])
                third, fifth = 0.0, 0.0
                for i in range(4):
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
                error = h * fifth / np.sqrt(both * 4) if both > 0 else 0.0
                if error <= 1:
                    t += h
                    y[:] = new
                    rates(y, k[0])
                h *= min(6.0, max(0.333, 0.9 * max(error, 1e-10) ** -0.125))
            ends[member] = y[:2]
        return ends

    return run


def by_numba(angles: Any, tolerance: float) -> tuple[float, Any]:
    """A DOP853 written for this model, members by prange on one thread."""
    import numba

    numba.set_num_threads(1)
    run = _numba_dop853()
    run(angles[:1], tolerance)
    begun = time.process_time()
    ends = run(angles, tolerance)
    return time.process_time() - begun, ends


MUJOCO = """
<mujoco>
  <option timestep="{step}" integrator="RK4" gravity="0 0 -9.81"><flag contact="disable"/></option>
  <worldbody>
    <body><joint name="a" type="hinge" axis="0 -1 0"/>
      <inertial pos="0 0 -1" mass="1" diaginertia="1e-12 1e-12 1e-12"/>
      <body pos="0 0 -1"><joint name="b" type="hinge" axis="0 -1 0"/>
        <inertial pos="0 0 -1" mass="1" diaginertia="1e-12 1e-12 1e-12"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def by_mujoco(angles: Any, step: float) -> tuple[float, Any]:
    """Steps of one size by Runge-Kutta of order 4: the parameter is the step."""
    import mujoco
    from mujoco import rollout

    model = mujoco.MjModel.from_xml_string(MUJOCO.format(step=step))
    data, ends = mujoco.MjData(model), np.empty_like(angles)
    begun = time.process_time()
    for k in range(0, len(angles), CHUNK):
        some = angles[k : k + CHUNK]
        states = np.zeros((len(some), mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)))
        states[:, 1], states[:, 2] = some[:, 0], some[:, 1] - some[:, 0]
        found, _ = rollout.rollout(model, data, states, nstep=round(STOP / step))
        ends[k : k + CHUNK] = np.stack([found[:, -1, 1], found[:, -1, 1] + found[:, -1, 2]], axis=1)
    return time.process_time() - begun, ends
