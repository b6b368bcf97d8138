"""Functions of a model called from Python: ``model.functions``, and Pinocchio's functions, on the arm of seven joints.

``MECHC_PEERS`` names the Python of an environment with pin (bench/peers/README.md); without it mechc stands alone. Robots stand in
``robot_functions.py``.
"""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import mechc
from mechc.runtime.functions import load_functions

from .machine import table, write
from .peer_builds import PEERS
from .robot_functions import FUNCTIONS, Pinocchio, Robot, library_of_pinocchio, nanoseconds
from .systems import SPATIAL

PEER = PEERS / "pinocchio_functions.py"
NATIVE = {**FUNCTIONS, "frame jacobian": FUNCTIONS["jacobian"]}
JOINTS = 7
STATES = 1000


def microseconds(call: Callable[[], Any], count: int = 2000, repeat: int = 30) -> float:
    """Least processor time of a call."""
    best = float("inf")
    for _ in range(repeat):
        begun = time.process_time()
        for _ in range(count):
            call()
        best = min(best, time.process_time() - begun)
    return best / count * 1e6


def pinocchio() -> dict[str, float]:
    """What Pinocchio takes, by the names of our functions; nothing without it."""
    python = os.environ.get("MECHC_PEERS")
    if python is None:
        return {}
    done = subprocess.run([python, str(PEER), str(JOINTS)], capture_output=True, text=True, check=True)
    return {name: float(value) for name, value in (line.split("\t") for line in done.stdout.splitlines())}


def pinocchio_in_c(repeat: int) -> dict[str, float]:
    """Microseconds of those functions called from C++; nothing where they cannot be built."""
    library = library_of_pinocchio(os.environ.get("MECHC_PEERS"))
    if library is None:
        return {}
    lines = ["0 -9.81 0"]
    for i in range(JOINTS):
        axis = " ".join("1" if k == i % 3 else "0" for k in range(3))
        lines.append(
            f"{i} 0 {axis} 1 0 0 0 1 0 0 0 1 0 {-1 if i else 0} 0 1 0 -0.5 0 0.1 0 0 0 0.01 0 0 0 0.1"
        )
    states = np.random.default_rng(1).uniform(-1, 1, (64, 3 * JOINTS))
    arm = Robot("\n".join(lines), [f"j{i}" for i in range(JOINTS)], "", [0.0] * JOINTS, False, states)
    theirs = Pinocchio(library, arm)
    found = {}
    for name, functions in NATIVE.items():
        times = nanoseconds({str(k): theirs.timed(k) for k in functions}, repeat)
        found[name] = min(times.values()) / 1e3
    return found


def main(quick: bool = False) -> None:
    model = mechc.loads(SPATIAL)
    f = model.functions
    random = np.random.default_rng(1)
    y = random.uniform(-1, 1, len(f.states))
    many = random.uniform(-1, 1, (STATES, y.size))
    a, more = y[:JOINTS].copy(), many[:, :JOINTS].copy()
    frame = f.frame(f"link[{JOINTS}].a").jacobian
    calls: dict[str, tuple[Callable[..., Any], bool]] = {
        **{name: (getattr(f, name), name == "inverse_dynamics") for name in f.offers},
        "frame jacobian": (frame, False),
    }
    repeat = 5 if quick else 30
    nothing = microseconds(lambda: None, repeat=repeat)
    theirs, native = pinocchio(), pinocchio_in_c(repeat)
    rows = []
    for name, (function, given) in calls.items():
        one = microseconds(lambda g=function, x=((y, a) if given else (y,)): g(*x), repeat=repeat) - nothing
        block = (many, more) if given else (many,)
        inside = microseconds(lambda g=function, x=block: g(*x), count=5, repeat=repeat) / STATES
        other = theirs[name] - theirs["nothing"] if name in theirs else None
        cells = [f"{one:.2f}", f"{inside:.2f}", f"{one - inside:.2f}"]
        cells += ["-", "-"] if other is None else [f"{other:.2f}", f"{other / one:.1f}"]
        cells += [f"{native[name]:.2f}", f"{native[name] / inside:.1f}"] if name in native else ["-", "-"]
        rows.append([name, *cells])
    problem = model.problem()
    functions, empty = load_functions(problem), np.empty(0)
    p = np.full(len(problem.parameters) + problem.nh, np.nan)
    functions.parameters(p, np.zeros(len(problem.parameters), dtype=np.uint8))
    for _ in range(200):  # the first calls go through ctypes
        functions.rhs(0.0, y, empty, empty, p)
    plain = microseconds(lambda: functions.rhs(0.0, y, empty, empty, p), repeat=repeat) - nothing
    head = [
        "function",
        "one state [us]",
        "in an array [us]",
        "the call [us]",
        "Pinocchio [us]",
        "Pinocchio / mechc",
        "in C++ [us]",
        "in C++ / in an array",
    ]
    words = (
        f"Microseconds of processor time of one call from Python at a random state of the spatial arm of {JOINTS} joints, best of "
        f"{repeat} batches, less an empty call; the same in an array of {STATES} states, for each; what the call costs beside the "
        "function itself; and Pinocchio's functions of the same name in Python (`crba`, `nonLinearEffects`, `rnea`, `aba`, "
        "`computeKineticEnergy`, `computePotentialEnergy`, `computeJointJacobian`), and in C++, at 64 states in turn. Pinocchio writes into its own data, mechc makes "
        "an array for each answer. Goal: the call below one microsecond."
    )
    contract = f"`functions.rhs(t, y, u, z, p)` of `load_functions`, the contract of solvers: {plain:.2f} us."
    write("functions", "Functions of a model from Python", [words, table(head, rows), contract])


if __name__ == "__main__":
    main()
