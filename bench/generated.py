"""One evaluation beside Pinocchio's own code generation: its ABA on CasADi's symbols, written as C and compiled.

Both are called from C in one process, in turn, at the same random states of the same chains; processor times, medians.
"""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from ctypes import POINTER, Structure, c_double, c_int, c_long, c_longlong, c_void_p
from fractions import Fraction
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from msgspec import Struct

from mechc.compiler.outline import summary_of
from mechc.compiler.pipeline import compile_source
from mechc.compiler.problem import HEADER, header, make_problem
from mechc.compiler.targets.c import emit_c
from mechc.lang.source import SourceFile
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import load_functions, with_code
from mechc.runtime.native.build import build_shared, model_flags
from mechc.runtime.native.kernel import kernel_sources

from .machine import table
from .peer_builds import built
from .systems import POINTS_RELATIVE, SPATIAL

STATES = 64
ROUNDS = 41
BATCH = 1e-3
"""Seconds of one batch, about."""
GOALS = {
    ("planar", 2): 1.0,
    ("planar", 7): 0.66,
    ("planar", 20): 0.70,
    ("planar", 100): 0.75,
    ("spatial", 7): 0.68,
    ("spatial", 20): 0.72,
}
"""Largest share of the time of Pinocchio's code with sizes at run time."""
TEXTS = {"planar": POINTS_RELATIVE, "spatial": SPATIAL}


class _Task(Structure):
    _fields_ = (
        ("ours", c_void_p),
        ("theirs", c_void_p),
        ("work", c_void_p),
        ("n", c_int),
        ("states", c_int),
        ("y", c_void_p),
        ("p", c_void_p),
        ("z", c_void_p),
    )


class Contestant(Struct, eq=False):
    """A task with what it holds alive."""

    task: _Task
    held: tuple[Any, ...]


def caller() -> ctypes.CDLL:
    """Return the library that calls both."""
    text = Path(__file__).with_name("call_rates.c").read_text(encoding="utf-8")
    sources = {"call_rates.c": text, "model.h": kernel_sources()["model.h"]}
    library = ctypes.CDLL(str(build_shared(sources, model_flags(), name="bench")))
    library.time_of.restype = c_double
    library.time_of.argtypes = [POINTER(_Task), c_long, c_int]
    return library


def ours(kind: str, n: int, y: Any, *, turning: bool = True) -> Contestant:
    """Return the code of mechc; without ``turning`` sines and cosines cost nothing, and mean nothing."""
    program = compile_source(SourceFile("chain.mech", TEXTS[kind]), structural={"n": Fraction(n)}).program
    if turning:
        problem = make_problem(program)
    else:
        sources = {"model.c": emit_c(program, turns=True), HEADER: header(), "sincos_batch.h": NO_TURNS}
        flags = model_flags(loops=program.long)
        problem = with_code(summary_of(program).description, library=build_shared(sources, flags))
    functions = load_functions(problem)
    case = prepare(problem, functions, SimulationOptions())
    task = _Task(ctypes.addressof(functions.struct), None, None, n, STATES, y.ctypes.data, case.p.ctypes.data)
    return Contestant(task, (functions, case, y))


def theirs(program: Path, kind: str, n: int, given: bool, y: Any, flags: tuple[str, ...]) -> Contestant:
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(
            [program, kind, str(n), "given" if given else "baked", "chain.c"], cwd=folder, check=True
        )
        text = Path(folder, "chain.c").read_text(encoding="utf-8")
    library = ctypes.CDLL(str(build_shared({"chain.c": text}, flags, name="bench")))
    sizes = [c_longlong() for _ in range(4)]
    library.F_work.argtypes = [POINTER(c_longlong)] * 4
    library.F_work(*map(ctypes.byref, sizes))
    work = np.zeros(max(1, sizes[3].value))
    each = {"planar": (1.0, 1.0), "spatial": (1.0, 0.5, 0.1, 0.01)}[kind]
    p = np.concatenate([[9.81], np.repeat(each, n)])
    at = ctypes.cast(library.F, c_void_p).value
    task = _Task(None, at, work.ctypes.data, n, STATES, y.ctypes.data, p.ctypes.data)
    return Contestant(task, (library, work, p, y))


def measured(library: ctypes.CDLL, tasks: list[Contestant], chained: bool) -> list[float]:
    """Return ns of one call of each, the tasks in turn."""
    calls = []
    for one in tasks:
        count = 16
        while library.time_of(one.task, count, chained) < BATCH:
            count *= 2
        calls.append(count)
    times: list[list[float]] = [[] for _ in tasks]
    for _ in range(ROUNDS):
        for one, count, found in zip(tasks, calls, times, strict=True):
            found.append(library.time_of(one.task, count, chained) / count * 1e9)
    return [median(found) for found in times]


def agree(library: ctypes.CDLL, tasks: list[Contestant], n: int) -> None:
    """Fail unless all give the same accelerations."""
    found = [np.empty((STATES, 2, n)) for _ in tasks]
    for one, out in zip(tasks, found, strict=True):
        library.accelerations(ctypes.byref(one.task), c_void_p(out.ctypes.data))
    a = [out[:, 1] for out in found]
    for other in a[1:]:
        assert np.abs(other - a[0]).max() < 1e-9 * np.abs(a[0]).max()


NO_TURNS = """
static inline void mech_turns(double *turns, double a, double b, double c, double d)
{
    turns[0] = a, turns[1] = b, turns[2] = c, turns[3] = d;
    turns[4] = b, turns[5] = a, turns[6] = d, turns[7] = c;
}
"""

FLAGS = (
    ("-O1", "-march=native", "-fno-math-errno", "-fno-trapping-math", "-fPIC"),
    ("-O2", "-march=native", "-fno-math-errno", "-fno-trapping-math", "-fPIC"),
    ("-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math", "-fPIC", "-fno-tree-slp-vectorize"),
)
"""Its code is compiled in several ways, of which the fastest counts."""


def compared(python: str, quick: bool) -> list[str]:
    """Return the paragraphs of the page."""
    program, library = built(python, "pinocchio_casadi", "-O1", casadi=True), caller()
    rows = []
    for (kind, n), goal in GOALS.items():
        y = np.random.default_rng(1).uniform(-1, 1, (STATES, 2 * n))
        flags = FLAGS[:1] if n == 100 or quick else FLAGS
        tasks = [ours(kind, n, y)]
        tasks += [theirs(program, kind, n, given, y, f) for given in (True, False) for f in flags]
        agree(library, tasks, n)
        tasks.append(ours(kind, n, y, turning=False))
        for chained in (False, True):
            mine, *other, bare = measured(library, tasks, chained)
            given, baked = min(other[: len(flags)]), min(other[len(flags) :])
            cells = [f"{mine:.1f}", f"{bare:.1f}", f"{given:.1f}", f"{mine / given:.2f}", f"{goal:.2f}"]
            cells += [f"{baked:.1f}", f"{mine / baked:.2f}"]
            rows.append([f"{kind} {n}", "dependent" if chained else "independent", *cells])
    head = [
        "chain",
        "calls",
        "mechc",
        "without sines",
        "sizes given",
        "ratio",
        "goal",
        "sizes baked in",
        "ratio",
    ]
    return [
        "Beside generated code: Pinocchio's `aba` on CasADi's symbols, written as C, for chains in joint angles; gravity, masses and "
        "sizes once given at run time, as mechc has them, and once baked in. Nanoseconds of processor time, called from C in one "
        f"process in turn, at {STATES} random states (independent), or each state from the derivative before (dependent), medians of "
        f"{ROUNDS}; of the compilations of its code at {' and '.join(f[0] for f in FLAGS)} the fastest counts (at 100 the first). "
        "`without sines`: the same code of mechc where sines and cosines cost nothing, which is what faster ones could bring at most; "
        "what dependent calls take longer is latency.",
        table(head, rows),
    ]
