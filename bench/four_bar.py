"""A falling four-bar: mechc, Exudyn's generalised-alpha and MuJoCo's RK4 at the same error, in one run.

``MECHC_PEERS`` names the Python of an environment with exudyn and mujoco (bench/peers/README.md).
"""

from __future__ import annotations

import json
import math
import os
import statistics
import subprocess
from itertools import pairwise
from pathlib import Path

import numpy as np
from msgspec import Struct

import mechc
from mechc.measurement.benchmark import benchmark
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.integrate.solver import Solver
from mechc.runtime.native import kernel as native
from mechc.runtime.native.status import Status
from mechc.runtime.problem import Array

from .machine import table, write

PEERS = Path(__file__).parent / "peers"
LENGTHS, GROUND, GRAVITY, STOP = (0.4, 1.0, 0.8), 1.0, 9.81, 10.0
LEVEL = 1e-4

TEXT = f"""
import mech.planar.*;
model Falling "three bars in a loop with the ground, released at 60 degrees"
  gravity {{0, -{GRAVITY} m/s^2}};
  Bar crank(m = 1 kg, l = {LENGTHS[0]} m);
  Bar coupler(m = 1 kg, l = {LENGTHS[1]} m);
  Bar rocker(m = 1 kg, l = {LENGTHS[2]} m);
  Revolute a(world -> crank.a, angle = 60 deg);
  Revolute b(crank.b -> coupler.a, angle ~ -40 deg);
  Revolute c(coupler.b -> rocker.a, angle ~ -90 deg);
  cut Revolute d(rocker.b -> world * trans({{{GROUND} m, 0 m}}));
  experiment(stop = {STOP} s);
end Falling;
"""


class Run(Struct, frozen=True):
    """``error``: the largest at the end, over the three angles against the world [rad] and their rates [rad/s]."""

    method: str
    setting: str
    seconds: float
    error: float


def in_world(y: Array) -> Array:
    """Angles against the world and their rates, from joint angles and rates."""
    return np.concatenate([np.cumsum(y[:3]), np.cumsum(y[3:6])])


def ours(quick: bool) -> tuple[list[Run], Array, Array, float]:
    """Runs of the kernel, the angles at the start, the state at the end, and what that is known to."""
    model = mechc.loads(TEXT)
    known = benchmark(model, methods=("dop853",), tolerances=(1e-6,), seconds=5 if quick else 30).reference
    end = in_world(known.high[-1] + known.low[-1])
    problem = model.problem()
    functions = load_functions(problem)
    case = prepare(problem, functions, SimulationOptions(points=2))
    kernel, nominal = native.load_kernel(), np.ones(problem.ny)
    runs = []
    for tolerance in (1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12):
        times = []
        for _ in range(11 if quick else 101):
            with Solver(kernel, case, "dop853", tolerance, tolerance * nominal) as solver:
                assert solver.advance(case.stop, 10**9) == Status.REACHED
                report, y = solver.report()
            times.append(report.seconds)
        error = float(np.abs(in_world(y) - end).max())
        runs.append(Run("mechc dop853", f"tolerance {tolerance:g}", statistics.median(times), error))
    return runs, in_world(case.y0)[:3], end, float(known.doubt[-1])


def peers(name: str, script: str, start: Array, end: Array, quick: bool) -> list[Run]:
    """Runs of a peer; none where it is not installed."""
    python = os.environ.get("MECHC_PEERS")
    if (
        python is None
        or subprocess.run([python, "-c", f"import {name.lower()}"], capture_output=True).returncode
    ):
        return []
    steps = [2e-3, 1e-3, 5e-4] if quick else [4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4, 6.25e-5]
    case = {
        "lengths": LENGTHS, "ground": GROUND, "gravity": GRAVITY, "stop": STOP,
        "angles": start.tolist(), "steps": steps, "longest": 4.0,
    }  # fmt: skip
    done = subprocess.run(
        [python, str(PEERS / script)], input=json.dumps(case), capture_output=True, text=True, check=True
    )
    rows = json.loads(done.stdout.splitlines()[-1])
    return [
        Run(f"{name} {method}", f"step {step:g} s", seconds, float(np.abs(np.array(state) - end).max()))
        for method, step, seconds, state in rows
    ]


def time_at(runs: list[Run], level: float) -> float | None:
    """Shortest time to an error, between two runs of one method by the logarithms."""
    found = [r.seconds for r in runs if r.error <= level]
    best = min(found, default=None)
    for coarse, fine in pairwise(runs):
        if coarse.method == fine.method and coarse.error > level >= fine.error > 0:
            share = math.log(coarse.error / level) / math.log(coarse.error / fine.error)
            between = coarse.seconds * (fine.seconds / coarse.seconds) ** share
            best = between if best is None else min(best, between)
    return best


def main(quick: bool = False) -> None:
    runs, start, end, doubt = ours(quick)
    rows, notes = [], []
    reached = time_at(runs, LEVEL)
    assert reached is not None
    notes.append(f"mechc reaches {LEVEL:g} in {reached * 1e3:.3f} ms of kernel time (goal: less than 1 ms).")
    for name, script, goal in (("Exudyn", "exudyn_four_bar.py", 100), ("MuJoCo", "mujoco_four_bar.py", 50)):
        found = peers(name, script, start, end, quick)
        if not found:
            notes.append(f"{name}: not installed.")
            continue
        runs += found
        theirs = time_at(found, LEVEL)
        notes.append(
            f"{name} does not reach {LEVEL:g} with these steps."
            if theirs is None
            else f"{name} reaches it in {theirs * 1e3:.0f} ms: **{theirs / reached:.0f} times** "
            f"(goal: at least {goal})."
        )
    rows = [[r.method, r.setting, f"{r.seconds * 1e3:.3f} ms", f"{r.error:.1e}"] for r in runs]
    text = (
        f"Bars of {', '.join(f'{x:g}' for x in LENGTHS)} m and 1 kg on a ground of {GROUND:g} m, released at 60 "
        f"degrees, {STOP:g} s; the error at the end is the largest of the angles [rad] and their rates [rad/s], "
        f"against a run in `__float128` known to {doubt:.0e}, to which all others converge. mechc: kernel time, "
        "median; peers: CPU time of their own loop in C or C++, without output and without calls into Python. "
        "Exudyn with dense matrices and modified Newton, the constraints on positions (index 3) or velocities "
        "(index 2); MuJoCo with its constraint as hard as the step allows. Times between two runs are interpolated "
        "in the logarithms."
    )
    write(
        "four_bar",
        "A falling four-bar",
        [text, " ".join(notes), table(["method", "setting", "time", "error"], rows)],
    )


if __name__ == "__main__":
    main()
