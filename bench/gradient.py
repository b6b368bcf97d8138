"""What a gradient costs beside a run, over the number of parameters: the discrete adjoint, and derivatives along the motion."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from mechc.compiler.pipeline import compile_source
from mechc.lang.source import SourceFile
from mechc.model import CompiledModel
from mechc.runtime.case import SimulationOptions
from mechc.runtime.integrate.kernel_run import run_kernel
from mechc.runtime.integrate.solver import SolverOptions
from mechc.runtime.studies.runs.simulate import plan_run
from mechc.runtime.tangent.flow import Tangents
from mechc.runtime.tangent.gradient import Gradients

from .machine import table, write

CHAIN = """
model Row "masses in a row, on springs that stiffen, with dampers"
  structural parameter Integer n = 1;
  parameter Mass m[n] = 1 kg;
  parameter Length l[n] = 1 m;
  parameter c[n] = 0.05 N.s/m;
  parameter k[n] = 9 N/m;
  coordinate Length x[i in 1:n] = i*1.1 m + 0.2 m*sin(i);
  let d[i in 1:n] = x[i] - (if i == 1 then 0 m else x[i-1]) - l[i];
  kinetic sum(1/2*m[i]*der(x[i])^2 for i in 1:n);
  potential sum(1/2*k[i]*d[i]^2*(1 + (d[i]/l[i])^2) for i in 1:n);
  dissipation sum(1/2*c[i]*der(x[i])^2 for i in 1:n);
  output last = x[n];
  experiment(stop = 10 s);
end Row;
"""
RODS = """
model Rods "masses on rods, one below the other, in Cartesian coordinates"
  structural parameter Integer n = 1;
  parameter Mass m[n] = 1 kg;
  parameter Length l[n] = 1 m;
  parameter c[n] = 0.05 N.s/m;
  parameter Acceleration g = 9.81 m/s^2;
  coordinate Length x[i in 1:n] = 0.6 m*i;
  coordinate Length y[i in 1:n] ~ -0.8 m*i;
  let a[i in 1:n] = x[i] - (if i == 1 then 0 m else x[i-1]);
  let b[i in 1:n] = y[i] - (if i == 1 then 0 m else y[i-1]);
  kinetic sum(1/2*m[i]*(der(x[i])^2 + der(y[i])^2) for i in 1:n);
  potential sum(m[i]*g*y[i] for i in 1:n);
  dissipation sum(1/2*c[i]*(der(x[i])^2 + der(y[i])^2) for i in 1:n);
  for i in 1:n loop
    constraint rod[i]: a[i]^2 + b[i]^2 = l[i]^2;
  end for;
  output last = x[n];
  experiment(stop = 2 s);
end Rods;
"""
SYSTEMS = (
    ("springs", CHAIN, 1),
    ("springs", CHAIN, 10),
    ("springs", CHAIN, 100),
    ("rods", RODS, 1),
    ("rods", RODS, 10),
)
FORWARD = 40
"""Most directions that are also differentiated along the motion."""
TOLERANCE = 1e-8


def seconds(calls: Sequence[Callable[[], Any]], least: float) -> list[float]:
    """Least processor time of each call, in turns, of as many as fit in a while."""
    best, begun = [float("inf")] * len(calls), time.process_time()
    while best[0] == float("inf") or time.process_time() - begun < least:
        for k, call in enumerate(calls):
            before = time.process_time()
            call()
            best[k] = min(best[k], time.process_time() - before)
    return best


def main(quick: bool = False) -> None:
    rows = []
    for name, text, n in SYSTEMS:
        if quick and n > 10:
            continue
        model = _model(text, n)
        problem = model.problem()
        names = [q.name for q in problem.parameters]
        plan = plan_run(problem, SimulationOptions(points=2, tolerance=TOLERANCE))
        case = plan.case
        options = SolverOptions("dop853", TOLERANCE, plan.nominal, dense=False)
        before = time.process_time()
        begun = Gradients(case, "last", names)
        made = time.process_time() - before
        calls: list[Callable[[], Any]] = [
            lambda c=case, o=options: run_kernel(c, o),
            lambda g=begun, p=plan: g.at(p.nominal, TOLERANCE),
        ]
        found = begun.at(plan.nominal, TOLERANCE)
        forward, off = "-", "-"
        if len(names) <= FORWARD:
            tangents = Tangents(case, plan.method, plan.nominal, names)
            w = tangents.start()
            calls.append(lambda t=tangents, c=case, w=w: t.flow(c.begin, c.y0, w, np.array([c.stop])))
        run, gradient, *taken = seconds(calls, 2.0)
        if taken:
            forward = f"{taken[0] / run:.1f}"
        off = f"{_difference(model, names):.0e}"
        rows.append([
            name, str(len(names)), str(problem.ny), str(found.steps), f"{run * 1e3:.3g}", f"{gradient / run:.1f}", forward, off,
            f"{found.memory / 1e3:.3g}", f"{made:.1f}",
        ])  # fmt: skip
    head = ["system", "parameters", "states", "steps", "run [ms]", "gradient / run", "along the motion / run"]
    head += ["difference", "memory [kB]", "made in [s]"]
    words = (
        "Processor time of the gradient of a goal (where the last of 1, 10 and 100 masses in a row on springs that stiffen is after 10 s, "
        "or the last of 1 and 10 on rods, which are constraints, after 2 s) in all masses, lengths, dampers and springs, over that of one run with the same tolerance of 1e-8; the same by derivatives along "
        "the motion, in as many directions, up to 40. Difference: of both, over the largest derivative, at a tolerance of 1e-13, "
        "in the parameters of the last masses. The assembly of a start on constraints and its derivatives belong to neither. Memory: the states of all steps. Made: derivation and C compiler, once. Goal: below "
        "five runs; differences below 1e-9."
    )
    write("gradient", "Gradients in many parameters", [words, table(head, rows)])


def _model(text: str, n: int) -> CompiledModel:
    return CompiledModel(compile_source(SourceFile("chain.mech", text), structural={"n": Fraction(n)}), {})


def _difference(model: CompiledModel, names: list[str]) -> float:
    """How far the gradient is from derivatives along the motion, of the parameters of the last masses: others reach the goal late."""
    some = [n for k, n in enumerate(names) if (k + 1) % (len(names) // 4) in (0, len(names) // 4 - 1)]
    plan = plan_run(model.problem(), SimulationOptions(points=2, tolerance=1e-13, stop=2.0))
    back = Gradients(plan.case, "last", some).at(plan.nominal, 1e-13).derivatives
    tangents = Tangents(plan.case, plan.method, plan.nominal, some)
    flow = tangents.flow(plan.case.begin, plan.case.y0, tangents.start(), np.array([plan.case.stop]))
    place = [q.name for q in model.problem().outputs].index("last")
    along = flow.output_tangents[-1, place]
    return float(np.abs(back - along).max() / np.abs(along).max())


if __name__ == "__main__":
    main()
