"""Experiments of a curve: options and parameters are numbers; guesses are functions of the place."""

from __future__ import annotations

from collections.abc import Mapping

from mechc.lang.diagnostics import Reporter
from mechc.runtime.interface import Experiment, Setting

from ...flat.model import Literal
from ...graph import Node
from ...graph.evaluate import evaluate
from ...mechanics.system import MechanicalSystem
from ..model import Function, Slot
from .forms import Forms


def curve_experiments(
    system: MechanicalSystem, layout: Mapping[Node, Slot], forms: Forms, reporter: Reporter
) -> tuple[tuple[Experiment, ...], tuple[Function, ...]]:
    """Return a plan and a function of (s, p) for each experiment."""
    plans, functions = [], []
    lowering, graph = system.lowering, system.graph
    scalars = [*system.symbols.parameters, *system.q]
    for number, experiment in enumerate(system.model.experiments):
        words = {
            name: str(e.value)
            for name, e in experiment.options.items()
            if isinstance(e, Literal) and isinstance(e.value, str)
        }
        numeric = {n: e for n, e in experiment.options.items() if n not in words}
        outputs: list[Node] = [lowering.scalar(e) for e in numeric.values()]
        targets: list[Setting] = []
        for setting in experiment.settings:
            found = [
                layout[s.node]
                for s in scalars
                if s.variable.name == setting.target and s.indices[: len(setting.indices)] == setting.indices
            ]
            if setting.rate or (not setting.guess and any(slot.array != "p" for slot in found)):
                reporter.error(
                    "E0553",
                    f"'{setting.target}' is a curve: an experiment can give another guess of it",
                    setting.origin.span,
                    help=f"write '{setting.target} ~ ..'",
                )
                continue
            values = lowering.numbers(setting.value)
            values = values * len(found) if len(values) == 1 else values
            for slot, value in zip(found, values, strict=True):
                targets.append(Setting(slot.array, slot.index, setting.guess))
                outputs.append(value)
        sweeps = []
        for sweep in experiment.sweeps:
            if sweep.structural:
                continue
            slots = [
                layout[s.node]
                for s in system.symbols.parameters
                if s.variable.name == sweep.target and s.indices[: len(sweep.indices)] == sweep.indices
            ]
            if not slots:
                reporter.error("E0820", f"'{sweep.target}' cannot be swept", sweep.origin.span)
                continue
            constants = tuple(evaluate(graph, [lowering.scalar(v) for v in sweep.values], {}))
            sweeps.append((Setting(slots[0].array, slots[0].index, False), constants))
        name = f"experiment_{number}"
        plans.append(
            Experiment(
                experiment.name, experiment.doc, name, tuple(numeric), words, tuple(targets), tuple(sweeps)
            )
        )
        title = f"experiment '{experiment.name}'" if experiment.name else "the default experiment"
        functions.append(Function(name, f"options and settings of {title}", tuple(forms.of_guess(outputs))))
    return tuple(plans), tuple(functions)
