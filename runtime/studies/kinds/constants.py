"""A run with the constants of its motion that are found, checked beside the energy."""

from __future__ import annotations

from msgspec.structs import replace

from ...case import SimulationOptions
from ...outcome import ENDED
from ...problem import Problem
from ...results.accuracy import Drift
from ...results.solution import Solution
from ..formulas.combination import along
from ..runs.simulate import plan_run
from .invariants import constants_of
from .symmetries import as_it_slides, cut

DEGREE = 2
"""In velocities or momenta, of the constants that are looked for."""
LONG = 70
"""Characters of a formula in the report."""


def with_constants(solution: Solution, problem: Problem, options: SimulationOptions) -> Solution:
    """Find the constants of the motion and add their drifts along the run, relative to the sizes of their terms.

    The model has the part ``phase``. Raises SimulationError where it has no velocities.
    """
    if solution.outcome not in ENDED:
        solution.add_remark("the run did not reach its end, so constants of the motion were not sought")
        return solution
    case = as_it_slides(plan_run(problem, options).case)
    found, doubts = constants_of(case, DEGREE, along(case, solution))
    drifts = [
        Drift(cut(one.formula, LONG), "", one.drift.largest * one.drift.size, one.drift.largest)
        for one in found
        if one.drift is not None and one.independent
    ]
    accuracy = solution.accuracy
    remarks = [*solution.motion.judged().remarks]
    remarks += [f"constant: {one.formula}" for one in found if one.independent and len(one.formula) > LONG]
    remarks += [
        f"in it {name} = {text}" for one in found if one.independent for name, text in one.where.items()
    ]
    remarks += doubts
    if found and not drifts:
        remarks.append(
            "no drift of constants: no part of the run stays in the modes in which they are constant"
        )
    elif not drifts:
        remarks.append(f"no constants of the motion were found up to the degree {DEGREE} in velocities")
    checked = replace(accuracy, conserved=(*accuracy.conserved, *drifts))
    return type(solution)(solution.motion.told(accuracy=checked, remarks=tuple(dict.fromkeys(remarks))))
