"""Whether the runs of a model can begin: each is prepared as it would be, assembled, and looked at where it begins."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec.structs import replace

from .runtime.methods import KERNEL_METHODS

if TYPE_CHECKING:
    from .model import CompiledModel
    from .runtime.outcome import SimulationError
    from .runtime.problem import Problem

IN_PYTHON = ("", "auto", "dop853")
"""Methods of the kernel that Python has as well, as far as the first instant goes."""


def impossible_starts(model: CompiledModel) -> list[SimulationError]:
    """Return what the default run, or that of an experiment, would be refused for at its first instant; each once.

    Costs the Python form of the equations (a tenth to a quarter of the compilation). Models that switch are looked at by
    the kernel, where there is a C compiler: nothing else knows their contacts. What only a run can say, such as a
    parameter without a value, is no matter of a check; nor are sweeps.
    """
    from .runtime.outcome import SimulationError

    found: dict[str, SimulationError] = {}
    experiments = model.compilation.outline.experiments
    names: list[str | None] = [e.name for e in experiments if not e.sweeps] if experiments else [None]
    for name in names:
        try:
            _begin(model.for_experiment(name), name)
        except SimulationError as error:
            found.setdefault(str(error), error)
    return list(found.values())


def _begin(model: CompiledModel, name: str | None) -> None:
    """Prepare a run and take it to its first instant. Raises SimulationError."""
    from .runtime.case import SimulationOptions, find_experiment, prepare
    from .runtime.functions import load_functions
    from .runtime.integrate.choose_method import choose_method
    from .runtime.outcome import AT_SINGULAR_POSITIONS, SimulationError
    from .runtime.results.diagnosis import failure_at_start

    if _without_value(model):
        return
    if model.compilation.equations.curve is not None:
        from .runtime.curves.posed import pose

        at_rest = model.problem()
        pose(at_rest, model.settings, find_experiment(at_rest, name), None)
        return
    problem, method = _problem(model, model.method(name))
    experiment = find_experiment(problem, name)
    said = experiment is not None and "stop" in experiment.options
    options = SimulationOptions(
        experiment=name,
        values=model.settings,
        stop=None if said else 0.0,
        method=method,
        estimate_error=False,
        dense=False,
    )
    case = prepare(problem, load_functions(problem), options)
    if problem.library is not None:
        from .runtime.studies.kinds.motion import simulate  # with scipy

        failure = simulate(problem, replace(options, start=case.begin, stop=case.begin)).failure
    elif problem.hybrid is None:
        choose_method(case)
        failure = failure_at_start(case)
    else:
        return
    # where constraints are dependent or the mass matrix is singular, a run begins anew with others
    if failure is not None and failure.kind not in AT_SINGULAR_POSITIONS:
        raise SimulationError(failure.message, failure.origin)


def _problem(model: CompiledModel, method: str) -> tuple[Problem, str | None]:
    """Return the functions that a look at the first instant needs, and the method if it is not the experiment's own."""
    from .runtime.native.build import find_compiler

    switches = model.compilation.program.hybrid is not None
    kernels = method not in IN_PYTHON and not method.startswith("scipy:")
    if (switches or kernels) and find_compiler() is not None:
        return model.problem("c", method=method), None
    return model.problem("python"), "auto" if method in KERNEL_METHODS else None


def _without_value(model: CompiledModel) -> bool:
    """Tell whether a parameter gets its value from outside."""
    equations = model.compilation.equations
    given = {rule.index for rule in equations.parameter_rules}
    missing = {p.name for k, p in enumerate(equations.parameters) if k not in given}
    return not missing <= model.settings.keys()
