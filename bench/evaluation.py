"""One evaluation of all accelerations: mechc's code, Pinocchio, MuJoCo, CasADi and SymPy, in one run.

``MECHC_PEERS`` names the Python of an environment with pin, mujoco and casadi (bench/peers/README.md); without
it only SymPy is beside mechc.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import time
from fractions import Fraction
from pathlib import Path

import numpy as np

from mechc.compiler.pipeline import compile_source
from mechc.compiler.problem import make_problem
from mechc.lang.source import SourceFile
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.native import kernel as native

from . import generated
from .machine import table, write
from .peer_builds import PEERS, built
from .systems import BARS, POINTS_ABSOLUTE, POINTS_RELATIVE, SPATIAL

BATCH = 256


def nanoseconds(text: str, n: int) -> float:
    """Best time of one call of the compiled accelerations, at random states, called in batches from C."""
    compilation = compile_source(SourceFile("chain.mech", text), structural={"n": Fraction(n)})
    problem = make_problem(compilation.program)
    functions = load_functions(problem)
    case = prepare(problem, functions, SimulationOptions())
    kernel = native.load_kernel()
    y = np.random.default_rng(1).uniform(-1, 1, (BATCH, problem.ny))
    out, t, empty = np.empty_like(y), np.zeros(BATCH), np.empty(0)
    rhs = ctypes.c_void_p(functions.struct.rhs)
    arrays = (t, y, empty, case.p, empty, out)
    best = float("inf")
    for _ in range(60):
        begun = time.perf_counter()
        kernel.mech_evaluate(
            ctypes.addressof(functions.struct),
            rhs,
            problem.ny,
            None,
            0,
            BATCH,
            *(a.ctypes.data for a in arrays),
        )
        best = min(best, time.perf_counter() - begun)
    assert np.isfinite(out).all()
    return best / BATCH * 1e9


def pinocchio(python: str | None) -> Path | None:
    """Compile the peer; takes about a minute and a half."""
    return None if python is None else built(python, "pinocchio_chain", "-O2", "-march=x86-64-v2")


def by_pinocchio(program: Path | None, kind: str, n: int) -> float:
    """The better of its two conventions, in ns; not-a-number without it."""
    if program is None:
        return float("nan")
    done = subprocess.run([program, kind, str(n)], capture_output=True, text=True, check=True)
    return min(float(word) for word in done.stdout.split())


def by_script(python: str | None, script: str, n: int) -> float:
    """What a script of bench/peers measures, in ns; not-a-number where there is none, or above its time limit."""
    if python is None:
        return float("nan")
    done = subprocess.run([python, str(PEERS / script), str(n)], capture_output=True, text=True, check=True)
    return float(done.stdout)


def main(quick: bool = False) -> None:
    import sys

    python = os.environ.get("MECHC_PEERS")
    program = pinocchio(python)
    rows = []
    for name, text, kind, sizes in (
        ("point masses, absolute angles", POINTS_ABSOLUTE, "planar", (2, 7, 20, 100)),
        ("point masses, joint angles", POINTS_RELATIVE, "planar", (2, 7, 20, 100)),
        ("bars on hinges", BARS, "planar", (7, 100)),
        ("spatial arm", SPATIAL, "spatial", (7, 20)),
    ):
        for n in sizes:
            ours, theirs = nanoseconds(text, n), by_pinocchio(program, kind, n)
            points = text in (POINTS_ABSOLUTE, POINTS_RELATIVE)
            mujoco = by_script(python, "mujoco_chain.py", n) if points else float("nan")
            casadi = by_script(python, "casadi_chain.py", n) if points and n <= 20 else float("nan")
            sympy = float("nan")
            if text is POINTS_ABSOLUTE and n <= (2 if quick else 7):
                sympy = by_script(sys.executable, "sympy_chain.py", n)
            cells = [f"{v:.0f}" if v == v else "-" for v in (ours, theirs, mujoco, casadi, sympy)]
            rows.append([name, str(n), *cells, f"{theirs / ours:.1f}" if theirs == theirs else "-"])
    head = ["system", "n", "mechc", "Pinocchio aba", "MuJoCo", "CasADi", "SymPy", "Pinocchio / mechc"]
    text = (
        "Nanoseconds of one evaluation of all accelerations at random states, best of many batches. mechc: `rhs` of "
        "the default build, parameters at run time; Pinocchio: `aba`, the better of its two conventions, called from "
        "C++; MuJoCo: `mj_forward` without contacts, called through its Python package (about 0.3 us of which are the "
        "call); CasADi: its generated C of M and h with LDL, at one state again and again (the easiest for the processor); SymPy: `LagrangesMethod`, lambdified with common "
        "subexpressions, and numpy's solve. Pinocchio and MuJoCo are general engines that read their model at run "
        "time: the ratio is the worth of specialisation. Goals: n = 7 and 100 at least 6 times faster than "
        "Pinocchio, the spatial arm of 7 joints at least 4 times."
    )
    beside = generated.compared(python, quick) if python else []
    write("evaluation", "One evaluation", [text, table(head, rows), *beside])


if __name__ == "__main__":
    main()
