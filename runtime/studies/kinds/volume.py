"""What becomes of a small volume of starts: the determinant of the flow (Liouville 1838), and the rate at which it shrinks."""

from __future__ import annotations

import math

import numpy as np

from ...outcome import Outcome, SimulationError
from ...problem import Array, Problem
from ..findings import Curve, Findings, Panel, Value
from ..flow.linearised import Linearised, determinant
from ..flow.mass_matrix import KINETIC, mass_matrix
from ..flow.pieces import with_horizon
from ..flow.time_dependence import after_initial_events
from ..runs.simulate import Plan, plan_run
from ..study import Study

TOLERANCE = 1e-10
HORIZON = 10.0
TIMES = 24


class Volume(Study, frozen=True, kw_only=True):
    """The ratio of a small volume of states after the run to that before; in coordinates and momenta, where there are
    momenta, else in coordinates and velocities."""

    needs = frozenset({"jacobian"})
    of_own_states = True

    def solve(self, problem: Problem) -> Findings:
        """Carry the changes of the start along. Raises SimulationError where the motion has no derivatives."""
        plan = after_initial_events(plan_run(problem, with_horizon(problem, self, HORIZON, TOLERANCE)))
        case = plan.case
        if problem.constraints:
            raise SimulationError(
                f"'{problem.name}' has constraints: what a volume of its states is depends on the coordinates that are "
                "taken as independent",
                help="write it in coordinates that are free, or look at 'lyapunov', whose exponents depend on no "
                "coordinates",
            )
        linear = Linearised(plan)
        canonical = KINETIC in [q.name for q in problem.outputs] and problem.nq == problem.nv > 0
        before = _determinant(plan, case.begin, case.y0) if canonical else 1.0
        span = case.stop - case.begin
        times = np.linspace(0.0, span, TIMES + 1)[1:]
        whole = linear.map(case.begin, case.y0, span, closed=False).remembered()
        ratios, errors = [], []
        for k, t in enumerate(times):
            found = whole
            if k < len(times) - 1:
                found = linear.map(case.begin, case.y0, float(t), checked=False, closed=False).of(
                    whole.memory
                )
            value, error = determinant(found)
            after = _determinant(plan, case.begin + float(t), found.end) if canonical else 1.0
            factor = abs(after / before) if before else math.nan
            ratios.append(abs(value) * factor)
            errors.append(error * factor)
            if self.progress is not None:
                self.progress((k + 1) / len(times))
        ratio, error = ratios[-1], errors[-1]
        preserved = abs(ratio - 1) <= max(error, 1e-12)
        rate = math.log(ratio) / span if ratio > 0 else -math.inf
        unit = problem.time.unit
        words = "is preserved" if preserved else "shrinks" if ratio < 1 else "grows"
        remarks: tuple[str, ...] = (
            () if canonical else ("in coordinates and velocities: the model has no momenta for all of them",)
        )
        if whole.memory:
            remarks += (f"of states and of {linear.named(whole)}, which the motion keeps and reads",)
        return Findings(
            study="volume",
            model=problem.name,
            outcome=Outcome.COMPLETED,
            message=f"the volume {words}: its ratio is {ratio:.10g} after {span:g}" + (f" {unit}" if unit else ""),
            values=(
                Value("ratio", "", ratio, error),
                Value("rate", f"1/{unit}" if unit else "", rate, error / ratio / span if ratio > 0 else None),
            ),
            errors_from="a run at a tighter tolerance",
            remarks=remarks,
            panels=(
                Panel("volume", "time", unit, "ratio", "", (
                    Curve("ratio", np.r_[0.0, times], np.r_[1.0, ratios]),)),
            ),
            details={"ratio": ratio, "rate": rate, "preserved": bool(preserved), "canonical": canonical},
        )  # fmt: skip


def _determinant(plan: Plan, t: float, y: Array) -> float:
    return float(np.linalg.det(mass_matrix(plan, t, y)))
