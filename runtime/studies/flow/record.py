"""One quantity of a run without its beginning, at two tolerances: what a spectrum or a count of cycles is made of."""

from __future__ import annotations

from typing import Annotated

from msgspec import Struct
from msgspec.structs import replace

from ...outcome import SimulationError
from ...problem import Problem
from ...results.solution import Solution
from ...settings import Formula, settable
from ..findings import Findings
from ..runs.simulate import plan_run, run_at_two_tolerances
from ..study import Study
from .carried_sweep import interval_of


class RecordStudy(Study, frozen=True, kw_only=True):
    """A study of the quantity ``of`` over a run, without what is still ``settling``."""

    of_past = True
    unused = frozenset({"every", "estimate_error"})

    of: Annotated[Formula | None, settable("The quantity (default: the first coordinate).", "formula")] = None
    settling: Annotated[
        float | Formula | None, settable('A time that is left out first: "50*2*pi/w".', "interval")
    ] = None


class Recorded(Struct, frozen=True, eq=False):
    """The quantity ``of`` from the time ``begin`` on; ``rough``: the run at the tolerance that was asked for."""

    of: Formula
    begin: float
    solution: Solution
    rough: Solution


def observed(problem: Problem, study: RecordStudy) -> Formula:
    """Return the quantity of a study. Raises SimulationError for a model without states."""
    if not problem.states:
        raise SimulationError("the model has no states: nothing moves")
    return study.of or Formula(problem.states[0].name, problem.states[0].name)


def recorded(problem: Problem, study: RecordStudy) -> Recorded:
    """Run the model at two tolerances. Raises SimulationError where nothing remains of the run."""
    of = observed(problem, study)
    study = replace(study, every=None)
    plan = plan_run(problem, replace(study, estimate_error=False))
    begin, length = plan.case.begin, plan.case.stop - plan.case.begin
    settling = 0.0
    if study.settling is not None:
        settling = interval_of(plan, plan.case.y0, study.settling, "the time that is left out")
    if not settling < length:
        raise SimulationError(f"{settling:g} are left out of a run over {length:g}: nothing remains")
    solution, rough = run_at_two_tolerances(problem, study)
    return Recorded(of, begin + settling, solution, rough)


def unfinished(study: str, problem: Problem, solution: Solution, errors_from: str) -> Findings:
    """Return the answer of a study whose run did not come to its end."""
    return Findings(
        study=study,
        model=problem.name,
        outcome=solution.outcome,
        message=solution.message,
        errors_from=errors_from,
        runs=(solution,),
    )
