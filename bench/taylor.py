"""Taylor's method beside dop853 and heyoka: processor time at equal true error.

heyoka is a package of its own (``pip install heyoka``); without it mechc stands alone. It gets the same rewritten formulas.
"""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable, Mapping, Sequence

import numpy as np

import mechc
from mechc.compiler.pipeline import program_with
from mechc.measurement.peers.heyoka import COMPACT, equations
from mechc.measurement.references import compile_for_reference
from mechc.runtime.case import Case, SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.integrate.solver import Solver
from mechc.runtime.native import kernel as native
from mechc.runtime.problem import Array
from mechc.runtime.reference.high_precision import PrecisionReference, reference

from .machine import table, write
from .systems import BENT_BARS

ERRORS = (1e-9, 1e-11, 1e-13)
TOLERANCES = tuple(10.0**-k for k in range(7, 15))
OURS = ("dop853", "taylor")

REFERENCE_LADDER = (1e-16, 1e-19, 1e-22)
REFERENCE_HEAD = ("system", "dop853 [ms]", "doubt", "series [ms]", "doubt", "dop853 / series", "apart")
REFERENCE_WORDS = (
    "References: processor time of the runs that make one, by dop853 in 113 bits at 1e-16, 1e-19 and 1e-22, and by Taylor series of 106 bits "
    "at 1e-28 and 1e-30. Doubt: the difference of the two best runs, which is the error of the looser one; apart: the difference of the "
    "two best of both methods, so the error of dop853."
)

SYSTEMS: Mapping[str, tuple[str, float, Mapping[str, float]]] = {
    "double pendulum, (1, 0.5) rad": ("double_pendulum_points", 10.0, {"th1": 1.0, "th2": 0.5}),
    "double pendulum, horizontal": ("double_pendulum_points", 10.0, {}),
    "Kepler e = 0.6, 10 orbits": ("kepler", 20 * np.pi, {"e": 0.6}),
    "Kepler e = 0.9, 10 orbits": ("kepler", 20 * np.pi, {"e": 0.9}),
    "pleiades": ("pleiades", 3.0, {}),
    "heavy top": ("heavy_top_rotation", 10.0, {}),
    "chain of 7": ("", 10.0, {}),
}
"""Example, duration, values; the chain is that of systems.py."""


class Measured:
    """A system with its reference at the end, and what it takes to reach an error."""

    def __init__(self, name: str) -> None:
        self.name = name
        example, stop, values = SYSTEMS[name]
        model = (
            mechc.load(f"examples/{example}.mech")
            if example
            else mechc.loads(BENT_BARS.replace("Integer n = 10", "Integer n = 7"))
        )
        program = program_with(model.compilation, {"series"})
        problem = model.problem(method="taylor")
        options = SimulationOptions(points=2, stop=stop, values=values, max_step=stop)
        self.case: Case = prepare(problem, load_functions(problem), options)
        self.program = program
        self.kernel = native.load_kernel()
        self.code = compile_for_reference(model)
        self.exact = self.reference(self.code.explicit)

    def reference(self, method: str, ladder: Sequence[float] | None = None) -> PrecisionReference:
        return reference(
            self.code.library,
            self.case,
            np.ones(self.case.y0.size),
            np.array([self.case.stop]),
            precision=self.code.precision,
            method=method,
            seconds=60.0,
            ladder=ladder,
        )

    def error(self, y: Array) -> float:
        return float(np.max(self.exact.error(y[None, :])))

    def ours(self, method: str, tolerance: float) -> Array:
        atol = tolerance * np.ones(self.case.y0.size)
        with Solver(self.kernel, self.case, method, tolerance, atol) as solver:
            solver.advance(self.case.stop, 10**9)
            return solver.report()[1]

    def heyoka(self, tolerance: float) -> Callable[[], Array]:
        """Return a run of heyoka from the formulas that series are made from."""
        import heyoka as hy

        system, compact = equations(self.program)
        integrator = hy.taylor_adaptive(system, self.case.y0.copy(), tol=tolerance, compact_mode=compact)
        used = len(integrator.pars)
        integrator.pars[:] = self.case.p[:used]

        def run() -> Array:
            integrator.time = 0.0
            integrator.state[:] = self.case.y0
            outcome = integrator.propagate_until(self.case.stop, max_steps=10**5)[0]
            end = np.array(integrator.state)
            return end if outcome == hy.taylor_outcome.time_limit else np.full_like(end, np.nan)

        return run


def milliseconds(runs: Sequence[Callable[[], Array]], rounds: int) -> list[float]:
    """Median processor times, in turns."""
    taken = np.zeros((rounds, len(runs)))
    for row in taken:
        for k, run in enumerate(runs):
            begun = time.process_time()
            run()
            row[k] = time.process_time() - begun
    return [float(x) for x in 1e3 * np.median(taken, axis=0)]


def at_error(curve: Sequence[tuple[float, float]], error: float) -> float:
    """Return the time at an error on the lower envelope of (error, time); NaN where it does not reach it."""
    best = [(e, t) for e, t in curve if e == e and not any(f <= e and s < t for f, s in curve)]
    reached = [t for e, t in best if e <= error]
    worse = [(e, t) for e, t in best if e > error]
    if not reached:
        return np.nan
    below = min((t, -e) for e, t in best if e <= error)
    if not worse:
        return below[0]
    above = max((t, e) for e, t in worse)
    share = np.log(above[1] / error) / np.log(above[1] / -below[1])
    return float(np.exp(np.log(above[0]) + share * np.log(below[0] / above[0])))


def least_error(curve: Sequence[tuple[float, float]]) -> float:
    return min(e for e, _ in curve if e == e)


def reference_row(system: Measured) -> list[str]:
    """Return time and doubt of the reference by the eighth-order method, and by series, and how far they are apart."""
    before, now = system.reference("dop853", REFERENCE_LADDER), system.reference("taylor")
    apart = np.abs((before.high - now.high) + (before.low - now.low)) / (1 + np.abs(now.high))
    return [
        system.name,
        f"{1e3 * before.seconds:.0f}",
        f"{before.doubt[0]:.0e}",
        f"{1e3 * now.seconds:.1f}",
        f"{now.doubt[0]:.0e}",
        f"{before.seconds / now.seconds:.0f}",
        f"{apart.max():.0e}",
    ]


def measure(system: Measured, rounds: int) -> list[list[str]]:
    name = system.name
    peers = ("heyoka",) if importlib.util.find_spec("heyoka") else ()
    curves: dict[str, list[tuple[float, float]]] = {method: [] for method in (*OURS, *peers)}
    for tolerance in TOLERANCES:
        runs: dict[str, Callable[[], Array]] = {
            m: lambda m=m, tol=tolerance: system.ours(m, tol)  # type: ignore[misc]
            for m in OURS
        }
        failing = name.endswith("horizontal") and tolerance > 1e-10  # heyoka does not come back there
        if peers and not failing:
            runs["heyoka"] = system.heyoka(tolerance / 10)
        errors = [system.error(run()) for run in runs.values()]
        for method, error, taken in zip(runs, errors, milliseconds([*runs.values()], rounds), strict=True):
            curves[method].append((error, taken))
    rows = []
    both = max(least_error(curves[m]) for m in ("taylor", *peers))
    for error in dict.fromkeys(max(error, both) for error in ERRORS):
        times = {method: at_error(curve, error) for method, curve in curves.items()}
        ratios = [f"{times[m] / times['taylor']:.2f}" for m in ("dop853", *peers)]
        label = f"{error:.0e}" if error in ERRORS else f"{error:.1e}, the least of both"
        rows.append([name, label, *(f"{t:.3f}" for t in times.values()), *ratios])
    least = [f"{least_error(curve):.1e}" for curve in curves.values()]
    rows.append([name, "least error", *least, *["" for _ in ("", *peers)]])
    return rows


def main(quick: bool = False) -> None:
    rows, references = [], []
    for name in SYSTEMS:
        system = Measured(name)
        references.append(reference_row(system))
        rows += measure(system, 5 if quick else 25)
        print(" | ".join(references[-1]))
        print("\n".join(" | ".join(row) for row in rows if row[0] == name), flush=True)
    head = ["system", "true error", "dop853 [ms]", "taylor [ms]"]
    head += ["heyoka [ms]"] if len(rows[0]) > 5 else []
    head += ["dop853 / taylor", "heyoka / taylor"][: len(rows[0]) - len(head)]
    words = (
        "Processor time of a whole run at equal true error of the state at its end (relative to 1 + |value|), interpolated on "
        "each method's own curve over tolerances from 1e-7 to 1e-14 (a tenth of that for heyoka), medians of runs in turns; "
        "nan: not reached; where taylor and heyoka do not both reach an error, at the least one that both reach. Without output between. heyoka gets the same rewritten formulas, in compact mode beyond "
        f"{COMPACT} operations; from the horizontal start it does not come back at tolerances above 1e-10, which are left out."
    )
    write(
        "taylor",
        "Taylor series",
        [
            words,
            table(head, rows),
            *against(rows, head[-1]),
            REFERENCE_WORDS,
            table(REFERENCE_HEAD, references),
        ],
    )


def against(rows: Sequence[Sequence[str]], peer: str) -> list[str]:
    """Return what all ratios of the last column come to."""
    ratios = [float(row[-1]) for row in rows if row[-1] not in ("", "nan")]
    mean = float(np.exp(np.mean(np.log(ratios))))
    return [f"{peer}: at least {min(ratios):.2f}, geometric mean of all {len(ratios)} rows {mean:.2f}."]


if __name__ == "__main__":
    main()
