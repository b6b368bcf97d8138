"""Whether the runs of a model can begin: each is prepared as it would be, assembled, and looked at where it begins."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec.structs import replace

if TYPE_CHECKING:
    from .model import CompiledModel
    from .runtime.outcome import SimulationError


def impossible_starts(model: CompiledModel) -> list[SimulationError]:
    """Return what the default run, or that of an experiment, would be refused for at its first instant; each once.

    Costs the code of the model, which libtcc makes in some milliseconds. Without any compiler nothing is looked at. What only a run
    can say, such as a parameter without a value, is not checked; nor are sweeps.
    """
    from .runtime.native.build import CompilerMissing
    from .runtime.outcome import SimulationError

    found: dict[str, SimulationError] = {}
    experiments = model.compilation.outline.experiments
    names: list[str | None] = [e.name for e in experiments if not e.sweeps] if experiments else [None]
    for name in names:
        try:
            _begin(model.for_experiment(name), name)
        except SimulationError as error:
            found.setdefault(str(error), error)
        except CompilerMissing:
            break
    return list(found.values())


def _begin(model: CompiledModel, name: str | None) -> None:
    """Prepare a run and take it to its first instant. Raises SimulationError."""
    from .runtime.case import SimulationOptions, find_experiment, prepare
    from .runtime.functions import load_functions
    from .runtime.outcome import AT_SINGULAR_POSITIONS, SimulationError

    if _without_value(model):
        return
    if model.compilation.equations.curve is not None:
        from .runtime.curves.posed import pose

        at_rest = model.problem()
        pose(at_rest, model.settings, find_experiment(at_rest, name), None)
        return
    problem = model.problem(method=model.method(name), quick=True)
    experiment = find_experiment(problem, name)
    said = experiment is not None and "stop" in experiment.options
    options = SimulationOptions(
        experiment=name,
        values=model.settings,
        stop=None if said else 0.0,
        estimate_error=False,
        dense=False,
    )
    case = prepare(problem, load_functions(problem), options)
    from .runtime.studies.kinds.motion import simulate  # with scipy

    failure = simulate(problem, replace(options, start=case.begin, stop=case.begin)).failure
    # where constraints are dependent or the mass matrix is singular, a run begins again with others
    if failure is not None and failure.kind not in AT_SINGULAR_POSITIONS:
        raise SimulationError(failure.message, failure.origin)


def _without_value(model: CompiledModel) -> bool:
    """Tell whether a parameter gets its value from outside."""
    equations = model.compilation.equations
    given = {rule.index for rule in equations.parameter_rules}
    missing = {p.name for k, p in enumerate(equations.parameters) if k not in given}
    return not missing <= model.settings.keys()
