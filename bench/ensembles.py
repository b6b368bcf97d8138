"""Ensembles: lanes and scalar threads of mechc beside others that run many double pendulums, at equal true error.

heyoka, numba and MuJoCo (``pip install heyoka numba mujoco``) are left out where they are not installed. All times are
processor times of one thread, the contestants in turn, of the whole call from Python.
"""

from __future__ import annotations

import importlib.util
import math
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

import mechc

from . import ensemble_peers as peers
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
CHAIN = """
import mech.planar.*;
model Chain
  parameter tilt = 30 deg;
  gravity {0, -9.81} m/s^2;
  Bar bars[i in 1:7](m = 1 kg, l = 30 cm);
  Revolute joints[i in 1:7]((if i == 1 then world else bars[i - 1].b) -> bars[i].a, angle = if i == 1 then tilt else 0 rad);
  experiment(stop = 2 s, tolerance = 1e-9);
end Chain;
"""
TOP = Path(__file__).parents[1] / "examples" / "heavy_top_rotation.mech"
EXACT = 200
"""Members whose true error is looked at."""
WANTED = (1e-9, 1e-12)
"""Errors at which times are compared, interpolated between tolerances in logarithms."""
PROCESSES = 5
ROUNDS = 3
FEW = 64
"""Members of those that take a thousand times as long."""

Solver = Callable[[Any, float], tuple[float, Any]]


def starts(n: int) -> Any:
    """Return angles [n, 2] within a radian of the vertical."""
    return np.random.default_rng(1).uniform(-1, 1, (n, 2))


def by_mechc(model: mechc.Model, method: str, lanes: str) -> Solver:
    """Return what gives CPU seconds and end angles [n, 2]."""

    def solve(angles: Any, tolerance: float) -> tuple[float, Any]:
        begun = time.process_time()
        runs = model.ensemble(
            {("a", "b"): angles},
            "final(a), final(b)",
            tolerance=tolerance,
            method=method,
            errors="none",
            threads=1,
            lanes=lanes,
        )
        return time.process_time() - begun, np.column_stack([runs["final(a)"], runs["final(b)"]])

    return solve


def exact(model: mechc.Model, angles: Any) -> Any:
    """Return end angles to some 15 digits: by heyoka in long double where it is there, else by mechc at 1e-14."""
    if importlib.util.find_spec("heyoka"):
        return peers.exactly(angles)
    return by_mechc(model, "taylor", "off")(angles, 1e-14)[1]


def contestants(model: mechc.Model, n: int) -> dict[str, tuple[Solver, tuple[float, ...], int]]:
    """Return solvers with their tolerances (steps, for those of one size) and numbers of members."""
    found: dict[str, tuple[Solver, tuple[float, ...], int]] = {
        "mechc, dop853 in lanes": (by_mechc(model, "dop853", "on"), (1e-8, 1e-9, 1e-10, 1e-12, 1e-13), n),
        "mechc, taylor in lanes": (
            by_mechc(model, "taylor", "on"),
            (1e-6, 1e-7, 1e-8, 1e-10, 1e-11, 1e-12),
            n,
        ),
        "mechc, dop853, one by one": (by_mechc(model, "dop853", "off"), (1e-8, 1e-9, 1e-10, 1e-12, 1e-13), n),
    }
    if importlib.util.find_spec("heyoka"):
        tolerances = (1e-5, 1e-6, 1e-7, 1e-9, 1e-10, 1e-11)
        found["heyoka, batch of 8, fast_math"] = (peers.by_heyoka, tolerances, n)
        found["heyoka, its ensemble function"] = (peers.by_heyoka_ensemble, tolerances, n)
    if importlib.util.find_spec("numba"):
        found["numba, prange of a DOP853 by hand"] = (peers.by_numba, (1e-8, 1e-9, 1e-10, 1e-12, 1e-13), n)
    if importlib.util.find_spec("mujoco"):
        found["MuJoCo, rollout, steps of 10 and 1 ms"] = (peers.by_mujoco, (1e-2, 1e-3), FEW)
    return found


def at_error(ladder: list[tuple[float, float]], wanted: float) -> float:
    """Return the time at an error, interpolated in logarithms; not-a-number beyond what was measured."""
    errors, times = np.log(np.array(sorted(ladder))).T
    if not errors[0] <= math.log(wanted) <= errors[-1]:
        return math.nan
    return math.exp(float(np.interp(math.log(wanted), errors, times)))


def compared(model: mechc.Model, n: int) -> list[str]:
    """Measure all double pendulums."""
    angles = starts(n)
    reference = exact(model, angles[:EXACT])
    solvers = contestants(model, n)
    best: dict[tuple[str, float], float] = {}
    errors: dict[tuple[str, float], float] = {}
    for turn in range(ROUNDS + 1):
        for name, (solve, tolerances, count) in solvers.items():
            for tolerance in tolerances if count == n or turn < 2 else ():
                seconds, ends = solve(angles[:count], tolerance)
                k = min(EXACT, count)
                errors[name, tolerance] = float(np.median(np.abs(ends[:k] - reference[:k]).max(axis=1)))
                if turn:  # the first one compiles
                    here = best.get((name, tolerance), math.inf)
                    best[name, tolerance] = min(here, seconds / count)
    rows, summary = [], []
    for name, (_, tolerances, _) in solvers.items():
        ladder = [(errors[name, t], best[name, t]) for t in tolerances]
        for t, (error, each) in zip(tolerances, ladder, strict=True):
            rows.append([name, f"{t:g}", f"{each * 1e6:.1f}", f"{error:.1e}"])
        each = [at_error(ladder, wanted) for wanted in WANTED]
        summary.append([name, *("-" if math.isnan(x) else f"{x * 1e6:.1f}" for x in each)])
    parts = [
        f"{n} double pendulums over 10 s, starts spread by a radian, one thread; processor time, best of {ROUNDS}. The error "
        f"is the median over {EXACT} members of the largest difference of an angle at the end from a solution in long "
        "double. The first table is interpolated from the second.",
        table(["us a member at an error of", *(f"{wanted:g}" for wanted in WANTED)], summary),
    ]
    if importlib.util.find_spec("heyoka"):
        parts.append(by_processes(angles, reference))
    return [*parts, table(["", "tolerance", "us a member", "error"], rows)]


def best_of_mechc(angles: Any, tolerance: float) -> tuple[float, Any]:
    """The best of four runs in lanes by Taylor's method, as many as heyoka has; what compiles is not among them."""
    solve = by_mechc(mechc.loads(PENDULUM), "taylor", "on")
    solve(angles, tolerance)
    return min((solve(angles, tolerance) for _ in range(4)), key=lambda one: one[0])


def by_processes(angles: Any, reference: Any) -> str:
    """Say what both take at best in several processes."""
    told = []
    for name, best, tolerances in (
        ("mechc, taylor in lanes", best_of_mechc, (1e-7, 1e-8, 1e-10, 1e-11, 1e-12)),
        ("heyoka, both its ways", peers.best_of_heyoka, (1e-6, 1e-7, 1e-9, 1e-10, 1e-11)),
    ):
        ladder = []
        for tolerance in tolerances:
            seconds, ends = peers.in_processes(best, angles, tolerance, PROCESSES)
            error = float(np.median(np.abs(ends[:EXACT] - reference).max(axis=1)))
            ladder.append((error, seconds / len(angles)))
        times = ", ".join(f"{at_error(ladder, wanted) * 1e6:.1f} us at {wanted:g}" for wanted in WANTED)
        told.append(f"{name}: {times}")
    return f"The best of {PROCESSES} processes of their own, four runs each: {'; '.join(told)}."


def against_one_by_one(n: int) -> str:
    """Compare lanes with one member after the other for larger models, and for what is kept."""
    cases: Mapping[str, tuple[mechc.Model, str, str]] = {
        "double pendulum, final(a)": (
            mechc.loads(PENDULUM),
            "a ~ uniform(-1 rad, 1 rad), b ~ uniform(-1 rad, 1 rad)",
            "final(a)",
        ),
        "double pendulum, max(a)": (
            mechc.loads(PENDULUM),
            "a ~ uniform(-1 rad, 1 rad), b ~ uniform(-1 rad, 1 rad)",
            "max(a)",
        ),
        "double pendulum, mean(a), energy": (
            mechc.loads(PENDULUM),
            "a ~ uniform(-1 rad, 1 rad), b ~ uniform(-1 rad, 1 rad)",
            "mean(a), final(energy.total)",
        ),
        "chain of 7 bars, joint angles": (mechc.loads(CHAIN), "tilt ~ normal(30 deg, 5 deg)", ""),
        "heavy top, quaternions": (mechc.load(TOP), "m ~ normal(1 kg, 0.05 kg)", "final(cos_nutation)"),
    }
    rows = []
    for name, (model, vary, keep) in cases.items():
        asked: dict[str, Any] = {
            "vary": vary,
            "samples": n,
            "errors": "none",
            "threads": 1,
            "tolerance": 1e-9,
        }
        asked |= {"keep": keep} if keep else {}
        best = {"on": math.inf, "off": math.inf}
        for turn in range(ROUNDS + 1):
            for lanes in best:
                begun = time.process_time()
                model.ensemble(**asked, lanes=lanes)
                if turn:
                    best[lanes] = min(best[lanes], time.process_time() - begun)
        on, off = best["on"] / n * 1e6, best["off"] / n * 1e6
        rows.append([name, f"{off:.1f}", f"{on:.1f}", f"{off / on:.1f}"])
    return table(["us a member at 1e-9", "one by one", "in lanes", "times faster"], rows)


def by_threads(model: mechc.Model, n: int) -> str:
    """Say what a second thread saves of the time on the clock."""
    best = {1: math.inf, 2: math.inf}
    for _ in range(5):
        for threads in best:
            begun = time.perf_counter()
            model.ensemble(
                {("a", "b"): starts(n)}, "final(a)", tolerance=1e-9, errors="none", threads=threads
            )
            best[threads] = min(best[threads], time.perf_counter() - begun)
    return f"Time on the clock of two threads over that of one, {n} double pendulums in lanes: {best[2] / best[1]:.2f}."


def main(quick: bool = False) -> None:
    n = 2000 if quick else 10_000
    model = mechc.loads(PENDULUM)
    write(
        "ensembles",
        "Ensembles",
        [*compared(model, n), against_one_by_one(1000 if quick else 4000), by_threads(model, n)],
    )
