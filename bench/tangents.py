"""One evaluation of the accelerations with k derivatives: mechc's tangents, CasADi's forward mode, JAX's jvp.

CasADi and JAX stand in the table where they are installed.
"""

from __future__ import annotations

import ctypes
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np

from mechc.compiler.pipeline import compile_source, tangent_program
from mechc.compiler.problem import make_problem
from mechc.lang.source import SourceFile
from mechc.runtime.functions import load_functions
from mechc.runtime.native import kernel as native
from mechc.runtime.problem import Directions, Problem

from .machine import table, write
from .systems import POINTS_ABSOLUTE, SPATIAL

PEERS = Path(__file__).parent / "peers"
COUNTS = (1, 4, 12)
BATCH, ROUNDS = 64, 40


def seconds_of(problems: Sequence[Problem]) -> list[float]:
    """Best processor time of one call of each right-hand side at random states, called in batches from C, in turns."""
    kernel = native.load_kernel()
    calls = []
    for problem in problems:
        functions = load_functions(problem)
        count = len(problem.parameters)
        p = np.full(count + problem.nh, np.nan)
        functions.parameters(p, np.zeros(count, dtype=np.uint8))
        y = np.random.default_rng(1).uniform(-1, 1, (BATCH, problem.ny))
        z, t, out = np.zeros(len(problem.discretes)), np.zeros(BATCH), np.empty_like(y)
        arrays = (t, y, z, p, np.empty(0), out)
        calls.append((functions, problem.ny, arrays))
    best = [float("inf")] * len(problems)
    for _ in range(ROUNDS):
        for i, (functions, ny, arrays) in enumerate(calls):
            begun = time.process_time()
            for _ in range(8):
                kernel.mech_evaluate(
                    ctypes.addressof(functions.struct),
                    ctypes.c_void_p(functions.struct.rhs),
                    ny,
                    None,
                    0,
                    BATCH,
                    *(a.ctypes.data for a in arrays),
                )
            best[i] = min(best[i], (time.process_time() - begun) / 8 / BATCH)
    assert all(np.isfinite(arrays[-1]).all() for _, _, arrays in calls)
    return best


def ours(text: str, n: int) -> list[float]:
    """Seconds of the right-hand side, alone and with each number of derivatives."""
    compilation = compile_source(SourceFile("chain.mech", text), structural={"n": Fraction(n)})
    problems = [make_problem(compilation.program, "c")]
    problems += [make_problem(tangent_program(compilation, Directions(states=k)), "c") for k in COUNTS]
    return seconds_of(problems)


def exported(text: str, n: int, target: str) -> list[float]:
    """The same of the functions that mechc writes for CasADi or JAX."""
    with tempfile.TemporaryDirectory() as folder:
        source, module = Path(folder) / "chain.mech", Path(folder) / "chain.py"
        source.write_text(text)
        command = [
            sys.executable,
            "-m",
            "mechc",
            "compile",
            str(source),
            "--set",
            f"n={n}",
            "--target",
            target,
        ]
        subprocess.run([*command, "-o", str(module)], check=True, capture_output=True)
        return by_script(f"{target}_tangents.py", str(module))


def by_script(script: str, system: str) -> list[float]:
    """What a script of bench/peers measures, alone and with derivatives; nothing where its package is not installed."""
    done = subprocess.run(
        [sys.executable, str(PEERS / script), system, *map(str, COUNTS)], capture_output=True, text=True
    )
    return [float(word) for word in done.stdout.split()] if done.returncode == 0 else []


def main(quick: bool = False) -> None:
    rows = []
    for name, text, n in (
        ("point masses", POINTS_ABSOLUTE, 7),
        ("point masses", POINTS_ABSOLUTE, 20),
        ("spatial arm", SPATIAL, 7),
    ):
        makers = {"mechc": ours(text, n)}
        if text is POINTS_ABSOLUTE and not quick:
            makers |= {
                "CasADi": by_script("casadi_tangents.py", str(n)),
                "JAX": by_script("jax_tangents.py", str(n)),
            }
        elif not quick:
            makers |= {
                "CasADi, exported": exported(text, n, "casadi"),
                "JAX, exported": exported(text, n, "jax"),
            }
        for maker, found in makers.items():
            if not found:
                continue
            ratios = [f"{value / found[0]:.2f}" for value in found[1:]]
            share = [f"{(value / found[0] - 1) / k:.2f}" for value, k in zip(found[1:], COUNTS, strict=True)]
            rows.append([name, str(n), maker, f"{found[0] * 1e9:.0f}", *ratios, *share])
    head = ["system", "n", "by", "rhs [ns]"]
    head += [f"with {k} / rhs" for k in COUNTS] + [f"each of {k}" for k in COUNTS]
    words = (
        "Processor time of one evaluation of all rates together with k directional derivatives, over that of the rates alone, "
        "and what each derivative adds; best of many batches in turns. mechc: the right-hand side of the tangent of the model, "
        "compiled as it is for `--sensitivity`; CasADi: generated C of M and h with LDL and its forward mode; JAX: `jvp` of the "
        "same functions, vectorised over the directions, compiled by XLA on one thread; exported: what `mechc compile --target casadi` "
        "and `--target jax` write, differentiated by them. Goal: at most 1.5 for each."
    )
    write("tangents", "Derivatives of one evaluation", [words, table(head, rows)])


if __name__ == "__main__":
    main()
