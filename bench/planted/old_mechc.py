"""What a former mechc is asked, in its own process and by its own modules: a run with its companion, and outputs at states.

Reads and writes pickles of plain values: a model's text in, what its run says; then times and states in, outputs, until there is
nothing more to read. Run in the folder of that mechc.
"""

from __future__ import annotations

import pickle
import sys
from importlib import import_module
from types import SimpleNamespace
from typing import Any

sys.path.insert(0, "")
mechc: Any = import_module("mechc")
runs: Any = import_module("mechc.runtime.simulate")
evaluate_rows: Any = import_module("mechc.runtime.evaluate").evaluate_rows
REFUSALS: Any = (
    import_module("mechc.lang.diagnostics").CompileError,
    import_module("mechc.runtime.outcome").SimulationError,
)


def quantities(listed: Any) -> list[dict[str, Any]]:
    return [{"name": q.name, "unit": q.unit, "kind": q.kind} for q in listed]


def run(text: str) -> tuple[dict[str, Any], Any]:
    """Run a model; give what is told of it, and the plan of its run."""
    made: list[Any] = []
    run_once = runs._run

    def noted(plan: Any, *given: Any) -> Any:
        made.append((plan, run_once(plan, *given)))
        return made[-1][1]

    runs._run = noted
    try:
        solution = mechc.loads(text).simulate()
    except REFUSALS as refused:
        return {"outcome": "refused", "message": str(refused).splitlines()[0]}, None
    finally:
        runs._run = run_once
    accuracy = solution.accuracy
    told: dict[str, Any] = {
        "outcome": solution.outcome.value,
        "message": solution.message,
        "energy": None if accuracy.energy is None else (accuracy.energy.absolute, accuracy.energy.relative),
        "estimate": None,
    }
    if accuracy.error is None or len(made) < 2:
        return told, None
    (plan, main), (_, companion) = made[-2:]
    problem, error = plan.case.problem, accuracy.error
    fixed = plan.method.fixed_step
    told |= {
        "estimate": SimpleNamespace(by_state=error.by_state, nominal=error.nominal, largest=error.largest),
        "main": rows(main), "companion": rows(companion),
        "steps": max(main.statistics.steps, companion.statistics.steps),
        "tolerance": 0.0 if fixed else error.tolerance,
        "factor": factor(plan, error),
        "problem": {
            "states": quantities(problem.states), "outputs": quantities(problem.outputs),
            "nq": problem.nq, "nv": problem.nv,
            "energy_balance": problem.energy_balance, "conserved": problem.conserved,
            "rows": 0 if problem.hybrid is None else len(problem.hybrid.rows),
        },
    }  # fmt: skip
    return told, plan.case


def factor(plan: Any, error: Any) -> float:
    """From the difference of both runs to the error of the first, as the run took it."""
    if plan.method.fixed_step:
        return float(runs.companion_step(plan.case.step, plan.method.order)[1])
    tight, found = runs.companion_tolerance(plan.case.tolerance)
    return float(found) if tight == error.tolerance else 1.0


def rows(run: Any) -> tuple[Any, Any, Any]:
    return run.t, run.y, None if run.happened is None else run.happened.grid_z


def main() -> None:
    case: Any = None
    while True:
        try:
            asked = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        if isinstance(asked, str):
            answer, case = run(asked)
        else:
            answer = evaluate_rows(case, "outputs", *asked)
        pickle.dump(answer, sys.stdout.buffer)
        sys.stdout.buffer.flush()


if __name__ == "__main__":
    main()
