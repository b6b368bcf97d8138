"""The double pendulum by the kernel and by scipy, on the same compiled functions, in one run."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

import mechc
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import Functions, load_functions
from mechc.runtime.integrate.solver import Solver
from mechc.runtime.native import contract
from mechc.runtime.native import kernel as native
from mechc.runtime.native.status import Status
from mechc.runtime.problem import Array

from .machine import table, write

EXAMPLES = Path(__file__).parent.parent / "examples"
MODELS = (("double_pendulum_points.mech", None), ("double_pendulum.mech", "undamped"))
STOP = 10.0
TOLERANCES = (1e-6, 1e-9, 1e-12)


def timed(run: Callable[[], object], repeats: int) -> float:
    """Median of the CPU seconds that a run takes, after one to warm up: other work on the machine adds nothing."""
    run()
    seconds = []
    for _ in range(repeats):
        begun = time.process_time()
        run()
        seconds.append(time.process_time() - begun)
    return statistics.median(seconds)


def preallocated(functions: Functions, p: Array) -> Callable[[float, Array], Array]:
    """The accelerations for scipy, called through ctypes into an array made before."""
    call = contract.MODEL_FUNCTION(functions.struct.rhs)
    size = functions.struct.nq + functions.struct.nv + functions.struct.nx
    state, out, empty = np.empty(size), np.empty(size), np.empty(0)
    y_at, out_at, empty_at, p_at = state.ctypes.data, out.ctypes.data, empty.ctypes.data, p.ctypes.data

    def rhs(t: float, y: Array) -> Array:
        state[:] = y
        call(t, y_at, empty_at, empty_at, p_at, out_at)
        return out.copy()  # scipy keeps what it is given

    return rhs


def measure(file: str, experiment: str | None, quick: bool) -> list[list[str]]:
    problem = mechc.load(EXAMPLES / file).problem()
    functions = load_functions(problem)
    case = prepare(problem, functions, SimulationOptions(experiment=experiment, points=2, stop=STOP))
    kernel = native.load_kernel()
    nominal = np.ones(problem.ny)  # the plain norm of scipy: rtol |y| + atol with atol = rtol

    def by_kernel(tolerance: float) -> tuple[Array, native.ReportStruct]:
        with Solver(kernel, case, "dop853", tolerance, tolerance * nominal) as solver:
            assert solver.advance(case.stop, 10**9) == Status.REACHED
            report, y = solver.report()
            return y, report

    def by_scipy(tolerance: float) -> tuple[Array, int]:
        rhs = preallocated(functions, case.p)
        found = solve_ivp(rhs, (0, case.stop), case.y0, "DOP853", rtol=tolerance, atol=tolerance)
        return found.y[:, -1], int(found.nfev)

    reference, _ = by_kernel(1e-14)
    rows = []
    for tolerance in TOLERANCES:
        y, report = by_kernel(tolerance)
        seconds = statistics.median(by_kernel(tolerance)[1].seconds for _ in range(51))
        other, evaluations = by_scipy(tolerance)
        tighter, its_error = tolerance, np.abs(other - reference).max()
        while np.abs(by_kernel(tighter)[0] - reference).max() > its_error:
            tighter *= 0.8
        matched = statistics.median(by_kernel(tighter)[1].seconds for _ in range(51))
        its = timed(lambda t=tolerance: by_scipy(t), 3 if quick else 7)  # type: ignore[misc]
        rows.append(
            [
                f"{tolerance:g}",
                f"{np.abs(y - reference).max():.1e}",
                f"{np.abs(other - reference).max():.1e}",
                f"{report.evaluations}",
                f"{evaluations}",
                f"{seconds * 1e3:.3f} ms",
                f"{its * 1e3:.1f} ms",
                f"{its / seconds:.0f}",
                f"{its / matched:.0f}",
            ]
        )
    return rows


def main(quick: bool = False) -> None:
    head = ["tolerance", "error", "error, scipy", "evaluations", "scipy", "kernel", "scipy", "ratio"]
    parts = [
        f"{STOP:g} s of two double pendulums: method dop853 of the kernel against "
        "`scipy.integrate.solve_ivp(DOP853)`, which calls the same compiled accelerations through ctypes into an "
        "array made before. Kernel time without output and companion run; medians, CPU time for scipy; errors at the end against "
        "the kernel at 1e-14. The last column is the ratio with the kernel's tolerance tightened until its error is "
        "not larger than that of scipy. Goal at 1e-9: at least 80 times faster at equal or smaller error."
    ]
    for file, experiment in MODELS:
        title = f"## {file}" + (f", {experiment}" if experiment else "")
        parts.append(f"{title}\n\n{table([*head, 'at no larger error'], measure(file, experiment, quick))}")
    write("kernel", "The kernel against scipy", parts)


if __name__ == "__main__":
    main()
