"""Models with delays: their state is all that was within the longest delay, which no list of numbers holds."""

from __future__ import annotations

from .outcome import SimulationError
from .problem import Problem

ANSWERED = "runs, sweeps, ensembles, 'response', 'linearize', 'spectrum', 'diagram', 'hysteresis', 'threshold', 'virial' and 'inertia' answer for such models"


def refuse_delays(problem: Problem, why: str) -> None:
    """Raise SimulationError for a model with delays. ``why``: what asks for a state of numbers."""
    delays = problem.hybrid.delays if problem.hybrid is not None else ()
    if not delays:
        return
    raise SimulationError(
        f"'{problem.name}' looks back, as in '{delays[0].text}', and {why}",
        delays[0].origin,
        help=ANSWERED,
    )
