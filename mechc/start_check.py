"""Whether the runs of a model can begin: its assembly, without a run and without a C compiler."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .model import CompiledModel
    from .runtime.outcome import SimulationError


def impossible_starts(model: CompiledModel) -> list[SimulationError]:
    """Return what keeps the default start, or that of an experiment, from being assembled; each message once.

    Costs the Python form of the equations (a tenth to a quarter of the compilation), and nothing for a model that has
    no constraints and no initial conditions. What only a run can say, such as a parameter without a value, is no
    matter of a check; nor are sweeps.
    """
    if not model.compilation.equations.assembly:
        return []
    from .runtime.case import SimulationOptions, prepare
    from .runtime.functions import load_functions
    from .runtime.outcome import SimulationError

    found: dict[str, SimulationError] = {}
    names: list[str | None] = [e.name for e in model.compilation.flat.experiments if not e.sweeps]
    for name in names or [None]:
        changed = model.for_experiment(name)
        problem = changed.problem("python")
        options = SimulationOptions(experiment=name, values=changed.settings, start=0.0, stop=0.0)
        try:
            prepare(problem, load_functions(problem), options)
        except SimulationError as error:
            if error.code.startswith("E06"):
                found.setdefault(str(error), error)
    return list(found.values())
