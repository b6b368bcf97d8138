"""Long runs by the structure-preserving methods: energy over 1e6 periods of a pendulum and 1e5 Kepler orbits."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from scipy.special import ellipk

import mechc
from mechc.runtime.case import Case, SimulationOptions, prepare
from mechc.runtime.functions import Functions, load_functions
from mechc.runtime.integrate.solver import Solver
from mechc.runtime.native import kernel as native
from mechc.runtime.native.status import Status
from mechc.runtime.problem import Array

from .machine import table, write

EXAMPLES = Path(__file__).parent.parent / "examples"
SAMPLES = 400_000
BLOCKS = 64
BETWEEN = 0.618
EPSILON = np.finfo(float).eps


def pendulum_energy(y: Array) -> Array:
    """Without the cancellation of 1 - cos."""
    energy: Array = y[:, 1] ** 2 / 2 + 2 * 9.81 * np.sin(y[:, 0] / 2) ** 2
    return energy


def orbit_energy(y: Array) -> Array:
    energy: Array = (y[:, 2] ** 2 + y[:, 3] ** 2) / 2 - 1 / np.hypot(y[:, 0], y[:, 1])
    return energy


def hanging_energy(y: Array) -> Array:
    """Of the point on a rod, its second coordinate upwards."""
    energy: Array = (y[:, 2] ** 2 + y[:, 3] ** 2) / 2 + y[:, 1]
    return energy


class Motion(Struct, frozen=True):
    name: str
    file: str
    period: float
    periods: int
    energy: Callable[[Array], Array]
    runs: tuple[tuple[str, int], ...]
    """Methods and steps for each period: first such that the truncation error is seen, then that rounding is.
    To the steps comes ``BETWEEN``: a whole number for each period would see the same points again and again."""


SWING = float(4 * ellipk(np.sin(0.5) ** 2) / np.sqrt(9.81))
MOTIONS = (
    Motion(
        "pendulum, released at 1 rad",
        "pendulum.mech",
        SWING,
        10**6,
        pendulum_energy,
        (("verlet", 61), ("gauss2", 37), ("gauss4", 23), ("gauss6", 15), ("gauss8", 9), ("rattle", 37),
         ("lobatto4", 23), ("lobatto6", 15), ("gauss6", 101), ("gauss8", 37), ("lobatto6", 101)),
    ),
    Motion(
        "pendulum as a point on a rod (constraint)",
        "pendulum_cartesian.mech",
        float(4 * ellipk(0.5)),
        10**5,
        hanging_energy,
        (("rattle", 37), ("lobatto4", 23), ("lobatto6", 15), ("lobatto6", 101)),
    ),
    Motion(
        "Kepler orbit, e = 0.6",
        "kepler.mech",
        2 * np.pi,
        10**5,
        orbit_energy,
        (("verlet", 2003), ("gauss4", 307), ("gauss6", 127), ("gauss8", 61), ("gauss8", 307), ("lobatto6", 127)),
    ),
)  # fmt: skip


def turned(case: Case, y: Array) -> Array:
    """The state with its velocities reversed."""
    half = y.size // 2
    return np.concatenate([y[:half], -y[half : 2 * half]])


def run(
    functions: Functions, case: Case, method: str, step: float, stop: float
) -> tuple[Array, Array, int, float]:
    """State at the end, rows at whole steps drawn at random, number of steps, seconds."""
    steps = np.unique(np.random.default_rng(1).integers(0, int(stop / step), SAMPLES, endpoint=True))
    case = replace(case, stop=stop, grid=np.concatenate([[0.0], steps[steps > 0] * step]), max_step=stop)
    begun = time.process_time()
    with Solver(native.load_kernel(), case, method, 1e-10, np.full(case.y0.size, 1e-10), step) as solver:
        assert solver.advance(stop, 2**62) == Status.REACHED, method
        report, y = solver.report()
        _, rows = solver.grid_rows(report.n_grid)
    return y, rows.copy(), int(report.steps), time.process_time() - begun


def measure(motion: Motion, method: str, per_period: int, periods: int) -> list[str]:
    problem = mechc.load(EXAMPLES / motion.file).problem(method=method)
    functions = load_functions(problem)
    case = prepare(problem, functions, SimulationOptions(stop=motion.period, points=2))
    step, stop = motion.period / (per_period + BETWEEN), motion.period * periods
    _, rows, steps, seconds = run(functions, case, method, step, stop)
    energy = motion.energy(rows)
    moving = (rows[:, rows.shape[1] // 2 :] ** 2).sum(axis=1) / 2
    error = (energy - energy[0]) / moving.max()
    first, _, _, last = np.array_split(np.abs(error), 4)
    means = np.array([block.mean() for block in np.array_split(error, BLOCKS)])
    (slope, _), covariance = np.polyfit(np.linspace(0, 1, BLOCKS), means, 1, cov=True)
    walk, doubt = EPSILON * np.sqrt(steps), float(np.sqrt(covariance[0, 0]))
    bounded = last.max() <= 1.05 * first.max() + 5 * walk
    driftless = abs(slope) <= 5 * walk + 4 * doubt
    some = step * round(motion.period * max(10, periods // 1000) / step)  # whole steps
    there = run(functions, case, method, step, some)[0]
    back = run(functions, replace(case, y0=turned(case, there)), method, step, some)[0]
    return [
        method,
        f"{per_period + BETWEEN:g}",
        f"{steps:.3g}",
        f"{seconds:.1f}",
        f"{first.max():.2e}",
        f"{last.max():.2e}",
        f"{slope:+.1e}",
        f"{doubt:.0e}",
        f"{walk:.0e}",
        "yes" if bounded and driftless else "**no**",
        f"{np.abs(turned(case, back) - case.y0).max():.0e}",
    ]


def main(quick: bool = False) -> None:
    head = [
        "method", "steps per period", "steps", "CPU, s", "energy error, first quarter", "last quarter",
        "drift over the run", "its doubt", "eps sqrt(steps)", "bounded, no drift", "returns to",
    ]  # fmt: skip
    parts = [
        "Largest error of the energy, relative to the largest kinetic energy, in the first and the last quarter of the run; the "
        f"drift is the slope of a straight line through the means of {BLOCKS} parts of the run, times its length, beside "
        "the doubt of that fit and what rounding alone does if it is random. Bounded: the last quarter is within 5 % of "
        "the first; no drift: within 5 times rounding and 4 times the doubt. The last column: the distance from the "
        "start after a thousandth of the run forwards and, with the velocities reversed, backwards."
    ]
    for motion in MOTIONS:
        periods = motion.periods // 100 if quick else motion.periods
        rows = []
        for method, per_period in motion.runs:
            rows.append(measure(motion, method, per_period, periods))
            print(motion.name, rows[-1], flush=True)
        parts.append(f"## {motion.name}: {periods:g} periods\n\n{table(head, rows)}")
    write("long_runs", "Long runs", parts)


if __name__ == "__main__":
    main()
