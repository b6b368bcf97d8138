"""Models of curves: from what is asked to what is found, for the Python interface and the command line."""

from __future__ import annotations

from .compiler.equations.model import EXCHANGED
from .model import CompiledModel
from .requests.parse_values import UsageMistake
from .runtime.studies.kinds.stationary import Curves, Stationary


def check_motion(model: CompiledModel, what: str) -> None:
    """Raise UsageMistake where a curve is asked for ``what`` only a motion has."""
    if model.compilation.equations.curve is not None:
        raise UsageMistake(f"'{model.name}' is a curve, which has no {what}", "'mechc run' finds it")


def curves_of(model: CompiledModel, experiment: str | None, tolerance: float | None, every: bool) -> Curves:
    """Find the curves of a model. Raises UsageMistake for a model that moves, SimulationError."""
    if model.compilation.equations.curve is None:
        raise UsageMistake(
            f"'{model.name}' is a motion and no curve",
            "'simulate' follows it; a curve has a range: 'independent x from a to b;'",
        )
    study = Stationary(experiment=experiment, values=model.settings, tolerance=tolerance, all=every)
    return study.solve(model.problem(), lambda: model.problem(parts={EXCHANGED}))
