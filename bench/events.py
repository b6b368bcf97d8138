"""What events cost: a thousand of them, and the search for an event that never comes."""

from __future__ import annotations

import math
import statistics

import mechc
from mechc.compiler.targets.c import emit_c
from mechc.runtime.case import SimulationOptions
from mechc.runtime.integrate.solver import Solver
from mechc.runtime.native import kernel as native
from mechc.runtime.native.status import Status
from mechc.runtime.studies.runs.simulate import plan_run

from .machine import table, write

EVENTS = 1000
FIRST = math.sqrt(2 / 9.81)
FLIGHT = """\
coordinate Length h = 1 m;
kinetic 1/2*(1 kg)*der(h)^2;
potential (9.81 N)*h;
"""
BELT = """\
coordinate x = 0 m;
initial der(x) = 1.962 m/s;
kinetic 1/2*(1 kg)*der(x)^2;
potential 1/2*(1 N/m)*x^2;
friction 0.2*(9.81 N) static 0.3*(9.81 N) on x - (1.962 m/s)*time;
"""
CASES = (
    ("bounces of a ball", FLIGHT + "contact floor: h restitution 1;\n", 2 * EVENTS * FIRST),
    (
        "bounces on a plate at 500 Hz",
        FLIGHT + "contact plate: h - (0.01 mm)*sin(time*(3140 rad/s)) restitution 1;\n",
        2 * EVENTS * FIRST,
    ),
    ("cycles of stick and slip, two events each", BELT, EVENTS * 6.36),
)
PENDULUM = """\
coordinate theta = 2 rad;
kinetic 1/2*(1 kg.m^2)*der(theta)^2;
potential -(9.81 J)*cos(theta);
"""
NEVER = PENDULUM + "discrete Integer n = 0;\nwhen theta > 3 rad then n := n + 1; end when;\n"


def measured(text: str, stop: float, repeats: int) -> tuple[float, native.ReportStruct]:
    """Median seconds in the kernel, without output, and the report of one run."""
    plan = plan_run(mechc.loads(text).problem(), SimulationOptions(points=2, stop=stop))
    tolerance = plan.case.tolerance
    seconds = []
    report = native.ReportStruct()
    for _ in range(repeats):
        with Solver(
            native.load_kernel(),
            plan.case,
            plan.method.name,
            tolerance,
            tolerance * plan.nominal,
        ) as solver:
            if plan.case.problem.hybrid is not None:
                solver.start_events(4 * EVENTS)
            assert solver.advance(plan.case.stop, 10**9) == Status.REACHED
            report, _ = solver.report()
            seconds.append(report.seconds)
    return statistics.median(seconds), report


def main(quick: bool = False) -> None:
    repeats = 5 if quick else 51
    rows = []
    for title, text, stop in CASES:
        seconds, report = measured(text, stop, repeats)
        rows.append(
            [
                title,
                f"{report.n_events}",
                f"{report.steps}",
                f"{report.evaluations}",
                f"{seconds * 1e3:.2f} ms",
                f"{seconds / report.n_events * 1e6:.2f} us",
            ]
        )
    plain, without = measured(PENDULUM, 100.0, repeats)
    watched, with_search = measured(NEVER, 100.0, repeats)
    assert without.evaluations and "hybrid" not in emit_c(mechc.loads(PENDULUM).compilation.program)
    write(
        "events",
        "What events cost",
        [
            "Kernel time without output and companion run, medians. Goal: a thousand bounces in less than 3 ms.",
            table(["model", "events", "steps", "evaluations", "time", "for one event"], rows),
            "A pendulum for 100 s, alone and with a condition that never holds. The code of the one alone holds no "
            "event and its steps no search: the kernel asks once in a run whether there is anything to watch.",
            table(
                ["model", "steps", "evaluations", "time", "ratio"],
                [
                    ["alone", f"{without.steps}", f"{without.evaluations}", f"{plain * 1e3:.3f} ms", "1"],
                    [
                        "with a condition",
                        f"{with_search.steps}",
                        f"{with_search.evaluations}",
                        f"{watched * 1e3:.3f} ms",
                        f"{watched / plain:.2f}",
                    ],
                ],
            ),
        ],
    )


if __name__ == "__main__":
    main()
