"""Stiff models: steps of radau5 over the stiffness, and its time beside scipy's Radau on the same functions."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from scipy.integrate import solve_ivp

import mechc
from mechc.runtime.case import Case, SimulationOptions, prepare
from mechc.runtime.functions import Functions, load_functions
from mechc.runtime.integrate.solver import Solver
from mechc.runtime.native import contract
from mechc.runtime.native import kernel as native
from mechc.runtime.native.status import Status
from mechc.runtime.problem import Array
from mechc.runtime.reference.work_precision import WorkPrecisionPoint, time_to_reach

from .kernel import preallocated
from .machine import table, write

ROOT = Path(__file__).parent.parent
STIFF = ROOT / "tests" / "models" / "stiff"
LEVELS = (1e-4, 1e-6, 1e-8)
TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(6, 25))

LADDERS: Mapping[str, tuple[float, float, tuple[Mapping[str, float], ...]]] = {
    "spring": (1.0, 10.0, tuple({"w": w} for w in (1e2, 1e4, 1e6, 1e8))),
    "governor": (0.5, 5.0, tuple({"k": 8e5 * f, "c": 4e4 * f} for f in (1.0, 1e1, 1e2, 1e3, 1e4))),
    "four_bar": (0.5, 5.0, tuple({"k": k, "c": (2 * k) ** 0.5} for k in (1e6, 1e7, 1e8, 1e9, 1e10))),
}
"""For each model the time at which transients are gone, the stop, and what makes it ever stiffer."""

COMPARED: tuple[tuple[str, Path, Mapping[str, float]], ...] = (
    ("spring, frequency 1e6", STIFF / "spring.mech", {"w": 1e6}),
    ("flyball governor", STIFF / "governor.mech", {}),
    ("flyball governor, 100 times stiffer", STIFF / "governor.mech", {"k": 8e7, "c": 4e6}),
    ("four-bar with a coupler of 1e8 N/m", STIFF / "four_bar.mech", {"k": 1e8, "c": 1.4e4}),
    ("squeezing mechanism (Andrews)", ROOT / "examples" / "squeezing_mechanism.mech", {}),
)


def steps_of(model: mechc.Model, values: Mapping[str, float], stop: float) -> int:
    solution = model.simulate(method="radau5", set=values, stop=stop, tolerance=1e-8, estimate_error=False)
    assert solution.outcome.value == "completed", solution.message
    return solution.statistics.steps


def over_stiffness() -> list[list[str]]:
    """Steps at tolerance 1e-8, from the end of transients to the stop."""
    rows = []
    for name, (begin, stop, ladder) in LADDERS.items():
        model = mechc.load(STIFF / f"{name}.mech")
        for values in ladder:
            count = steps_of(model, values, stop) - steps_of(model, values, begin)
            set_to = ", ".join(f"{k} = {v:g}" for k, v in values.items())
            rows.append([f"`{name}`", set_to, f"{count}"])
    return rows


def dense_jacobian(functions: Functions, p: Array) -> Callable[[float, Array], Array]:
    """The Jacobian of the model as scipy wants it, through ctypes into arrays made before."""
    struct = functions.struct
    call = contract.MODEL_FUNCTION(struct.jacobian)
    size, count = struct.nq + struct.nv + struct.nx, struct.n_jacobian
    rows, columns = (np.ctypeslib.as_array(at, (count,)) for at in (struct.jac_row, struct.jac_col))
    state, out, empty, full = np.empty(size), np.empty(count), np.empty(0), np.zeros((size, size))
    places = rows.astype(np.int64) * size + columns

    def jacobian(t: float, y: Array) -> Array:
        state[:] = y
        call(t, state.ctypes.data, empty.ctypes.data, empty.ctypes.data, p.ctypes.data, out.ctypes.data)
        full.flat[places] = out
        return full.copy()  # scipy keeps what it is given

    return jacobian


class Task(Struct, frozen=True):
    """``end`` is the state at the stop, known to ``doubt`` relative to 1 + |value|, as errors are."""

    functions: Functions
    case: Case
    nominal: Array
    end: Array
    doubt: float

    def error(self, y: Array) -> float:
        return float((np.abs(y - self.end) / (self.nominal + np.abs(self.end))).max())


def run_kernel(
    functions: Functions, case: Case, nominal: Array, tolerance: float
) -> tuple[Array, native.ReportStruct]:
    kernel = native.load_kernel()
    with Solver(kernel, case, "radau5", tolerance, tolerance * nominal) as solver:
        assert solver.advance(case.stop, 10**9) == Status.REACHED
        report, y = solver.report()
        return y, report


def task(file: Path, values: Mapping[str, float]) -> Task:
    """The reference is the tightest run that rounding allows."""
    problem = mechc.load(file).problem(method="radau5")
    functions = load_functions(problem)
    case = prepare(problem, functions, SimulationOptions(points=2, values=dict(values)))
    nominal = np.ones(problem.ny)
    end, other = (run_kernel(functions, case, nominal, tolerance)[0] for tolerance in (1e-13, 4e-13))
    made = Task(functions, case, nominal, end, 0.0)
    return replace(made, doubt=made.error(other))


def by_kernel(given: Task, tolerance: float, quick: bool) -> WorkPrecisionPoint:
    runs = [
        run_kernel(given.functions, given.case, given.nominal, tolerance) for _ in range(5 if quick else 15)
    ]
    seconds = statistics.median(report.seconds for _, report in runs)
    return point("radau5", tolerance, given.error(runs[0][0]), seconds, runs[0][1].steps)


def by_scipy(given: Task, tolerance: float, quick: bool) -> WorkPrecisionPoint:
    rhs, jacobian = preallocated(given.functions, given.case.p), dense_jacobian(given.functions, given.case.p)
    span, times = (given.case.begin, given.case.stop), list[float]()
    while not times or (len(times) < 3 and sum(times) < (0.5 if quick else 2.0)):
        begun = time.process_time()
        found = solve_ivp(
            rhs, span, given.case.y0, "Radau", jac=jacobian, rtol=tolerance, atol=tolerance * given.nominal
        )
        times.append(time.process_time() - begun)
    assert found.success, found.message
    return point("scipy", tolerance, given.error(found.y[:, -1]), min(times), found.t.size - 1)


def point(method: str, tolerance: float, error: float, seconds: float, steps: int) -> WorkPrecisionPoint:
    return WorkPrecisionPoint(method, tolerance, error, error, seconds, 0.0, steps, 0)


def beside_scipy(name: str, file: Path, values: Mapping[str, float], quick: bool) -> list[list[str]]:
    given = task(file, values)
    tolerances = TOLERANCES[::3] if quick else TOLERANCES
    made = [[run(given, tolerance, quick) for tolerance in tolerances] for run in (by_kernel, by_scipy)]
    rows = []
    for level in LEVELS:
        ours, theirs = (time_to_reach(points, level) for points in made)
        cells = ["-" if t is None else f"{t * 1e3:.3g} ms" for t in (ours, theirs)]
        ratio = f"{theirs / ours:.0f}" if ours is not None and theirs is not None else "-"
        rows.append([name, f"{level:g}", *cells, ratio, f"{given.doubt:.0e}"])
        print(rows[-1], flush=True)
    return rows


def main(quick: bool = False) -> None:
    head = ["model", "error", "radau5", "scipy's Radau", "ratio", "reference known to"]
    rows = [row for name, file, values in COMPARED for row in beside_scipy(name, file, values, quick)]
    write(
        "stiff",
        "Stiff models",
        [
            "Steps of `radau5` at tolerance 1e-8 after transients, over the stiffness: they should not depend on it. "
            "The models are in `tests/models/stiff`.",
            table(["model", "values", "steps"], over_stiffness()),
            "Time to an error, of the kernel's `radau5` and of `scipy.integrate.Radau` on the same compiled accelerations "
            "and the same Jacobian, called through ctypes into arrays made before. Mechanisms with loops are solved for "
            "accelerations and multipliers (index 1); the kernel projects after each step, scipy does not. The error is "
            "that at the end, relative to 1 + |value|, against the tightest run; kernel time without output, "
            "CPU time for scipy; times between two runs are interpolated in the logarithms; - where no tolerance down "
            "to 1e-12 gives the error. Goal: at least 20 times faster.",
            table(head, rows),
        ],
    )


if __name__ == "__main__":
    main()
