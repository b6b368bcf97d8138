"""Directions by name: parameters, initial values and inputs in which a motion is differentiated."""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from ..case import Case, find_experiment, find_setting
from ..interface import Setting
from ..outcome import SimulationError
from ..problem import Directions


class Direction(Struct, frozen=True):
    """One direction: its name, its SI unit, and what it changes (``array`` is y, p or u); none where it is a vector of
    changes of the initial state."""

    name: str
    unit: str
    array: str = "y"
    index: int = -1


def named(case: Case, names: Sequence[str]) -> tuple[Direction, ...]:
    """Find what the names stand for. Raises SimulationError for names that stand for nothing, or stand twice."""
    problem = case.problem
    arrays = {"p": problem.parameters, "y": problem.states, "u": problem.inputs}
    found = []
    for k, name in enumerate(names):
        if name in names[:k]:
            raise SimulationError(f"'{name}' is given twice")
        setting = find_setting(problem, name)
        quantity = arrays[setting.array][setting.index]
        if quantity.kind == "account":
            raise SimulationError(
                f"'{name}' is an account of energy, which begins at zero: it has no initial value"
            )
        if setting.array == "y" and any(i <= setting.index < i + 4 for i in problem.rotations):
            raise SimulationError(
                f"'{name}' is one of four numbers of a rotation, which do not change one by one",
                quantity.origin,
                help="its rates and the parameters of the model are directions",
            )
        found.append(Direction(name, quantity.unit, setting.array, setting.index))
    return tuple(found)


def chosen(case: Case) -> tuple[set[Setting], set[Setting]]:
    """Give what the caller has set, and what else the experiment sets."""
    names = case.asked.values if case.asked is not None else ()
    by_caller = {find_setting(case.problem, name) for name in names}
    experiment = find_experiment(case.problem, case.asked.experiment if case.asked is not None else None)
    settings = experiment.settings if experiment is not None else ()
    return by_caller, {Setting(s.array, s.index) for s in settings} - by_caller


def as_asked(case: Case, listed: Sequence[Direction], states: int) -> Directions:
    """Give the request for a problem with derivatives: ``states`` vectors first, then parameters and inputs."""
    by_caller, by_experiment = chosen(case)
    given = {s.index for s in by_caller | by_experiment if s.array == "p"}
    return Directions(
        states=states,
        parameters=tuple(d.index for d in listed if d.array == "p"),
        inputs=tuple(d.index for d in listed if d.array == "u"),
        given=tuple(sorted(given)),
        tables=tuple(sorted(case.tables)),
        units=tuple(d.unit for d in listed if d.array == "y"),
    )
