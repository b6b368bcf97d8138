"""Experiments: their options and settings as one function each, evaluated before a run."""

from __future__ import annotations

from mechc.lang.diagnostics import Reporter
from mechc.runtime import interface

from ...flat.model import Experiment, Kind, Literal, Role, Setting
from ...graph import Node
from ...graph.evaluate import evaluate
from ...mechanics.meaning.symbols import Scalar
from ...mechanics.system import MechanicalSystem
from ..model import Function
from .entries import Layout


def experiment_plans(
    system: MechanicalSystem, layout: Layout, reporter: Reporter
) -> tuple[tuple[interface.Experiment, ...], tuple[Function, ...]]:
    """Return a plan and a function for each experiment of the model."""
    plans, functions = [], []
    for number, experiment in enumerate(system.model.experiments):
        plan, function = _plan(system, layout, experiment, number, reporter)
        plans.append(plan)
        functions.append(function)
    return tuple(plans), tuple(functions)


def _plan(
    system: MechanicalSystem, layout: Layout, experiment: Experiment, number: int, reporter: Reporter
) -> tuple[interface.Experiment, Function]:
    lowering = system.lowering
    words = {
        name: str(e.value)
        for name, e in experiment.options.items()
        if isinstance(e, Literal) and isinstance(e.value, str)
    }
    numeric = {name: e for name, e in experiment.options.items() if name not in words}
    outputs: list[Node] = [lowering.scalar(e) for e in numeric.values()]
    targets: list[interface.Setting] = []
    for setting in experiment.settings:
        places = _targets(system, layout, setting, reporter)
        values = _values(system, setting)
        values = values * len(places) if len(values) == 1 else values
        for place, value in zip(places, values, strict=True):
            targets.append(interface.Setting(place[0], place[1], setting.guess))
            outputs.append(value)
    sweeps = []
    for sweep in experiment.sweeps:
        if sweep.structural:
            continue
        swept = _find(system, layout, sweep.target, sweep.indices, rate=sweep.rate)
        if not swept:
            caption, help = _why_not(system, sweep.target, rate=sweep.rate)
            reporter.error(
                "E0820", f"'{sweep.target}' cannot be swept", sweep.origin.span, caption=caption, help=help
            )
            continue
        constants = tuple(evaluate(system.graph, [lowering.scalar(v) for v in sweep.values], {}))
        sweeps.append((interface.Setting(*swept[0], False), constants))
    name = f"experiment_{number}"
    plan = interface.Experiment(
        experiment.name, experiment.doc, name, tuple(numeric), words, tuple(targets), tuple(sweeps)
    )
    title = f"experiment '{experiment.name}'" if experiment.name else "the default experiment"
    return plan, Function(name, f"options and settings of {title}", tuple(outputs))


def _values(system: MechanicalSystem, setting: Setting) -> tuple[Node, ...]:
    rotations = {c.variable.name for c in system.symbols.coordinates if c.is_rotation}
    if setting.target in rotations and not setting.rate:
        from ...mechanics.meaning.quaternions import rotation_quaternion

        return rotation_quaternion(system.graph, system.lowering, setting.value)
    return system.lowering.numbers(setting.value)


def _targets(
    system: MechanicalSystem, layout: Layout, setting: Setting, reporter: Reporter
) -> list[tuple[str, int]]:
    found = _find(system, layout, setting.target, setting.indices, rate=setting.rate)
    if not found:
        caption, help = _why_not(system, setting.target, rate=setting.rate)
        reporter.error(
            "E0822",
            f"'{setting.target}' has no initial value to set",
            setting.origin.span,
            caption=caption,
            help=help,
        )
    return found


def _why_not(system: MechanicalSystem, name: str, *, rate: bool) -> tuple[str, str]:
    """Say why a quantity has no initial value of its own, and what to do where that is known."""
    scalars = system.v if rate else system.q
    for row in system.drives:
        if all(scalars[k].variable.name != name for k in (row.v if rate else row.q)):
            continue
        if not row.balanced:
            return "its motion is prescribed", "change a quantity that the drive depends on"
        return (
            "it has no mass: the balance of forces decides it",
            "set those of the others, or say in the model where it starts: the others follow",
        )
    return "its joint closes a loop, and computes it", ""


def _find(
    system: MechanicalSystem, layout: Layout, name: str, indices: tuple[int, ...], *, rate: bool
) -> list[tuple[str, int]]:
    """Return (array, index) of every number that a name and leading indices stand for."""
    symbols = system.symbols
    scalars: list[Scalar] = [*symbols.parameters, *symbols.inputs, *symbols.discretes, *symbols.states]
    scalars += system.v if rate else system.q
    result = []
    for s in scalars:
        rotation = s.variable.type.kind is Kind.ROTATION
        matches = rotation or s.indices[: len(indices)] == indices
        if s.variable.name == name and matches and s.node in layout.slots:
            if rate and s.variable.role is not Role.COORDINATE:
                continue
            slot = layout.slots[s.node]
            result.append((slot.array, slot.index))
    return result
