"""The variables of an FMU, from which the C description and both model descriptions are written."""

from __future__ import annotations

from msgspec import Struct

from mechc.runtime.case import Case
from mechc.runtime.interface import Quantity
from mechc.runtime.problem import Array, Problem


class FmuVariable(Struct, frozen=True):
    """One scalar. ``index``: its position in the list, from 1; ``reference``: the value reference.

    ``derivative``: the index of the state of which this is the derivative, else 0. ``depends``: positions
    of the knowns of a derivative or an output; None where this is not an unknown. ``initially``: the same for
    the initial value; None also where it depends on everything.
    """

    index: int
    reference: int
    name: str
    causality: str
    variability: str
    initial: str
    entry: Quantity
    start: float | None = None
    nominal: float | None = None
    derivative: int = 0
    depends: frozenset[int] | None = None
    initially: frozenset[int] | None = None
    reinit: bool = False
    """A state that events or projections change."""


class VariableTable(Struct, frozen=True):
    """All variables in the order of the model description; derivatives in the order of the states."""

    variables: tuple[FmuVariable, ...]
    derivatives: tuple[int, ...]
    outputs: tuple[int, ...]
    initial_unknowns: tuple[int, ...]
    settable_parameters: tuple[int, ...]
    indicators: tuple[int, ...]
    """Positions of the event indicators in the list."""
    zero_crossings: tuple[int, ...]
    """For each of them, its place among the outputs of the function ``indicators``."""
    inputs_move: bool
    """An input that nobody sets depends on time."""
    free_initial: bool
    """Whether no initial value depends on other quantities."""

    def at(self, index: int) -> FmuVariable:
        return self.variables[index - 1]


class Start(Struct, frozen=True):
    """What the exported experiment begins with: the case, inputs at its start, sizes of the states."""

    problem: Problem
    case: Case
    inputs: Array
    nominal: Array
    given_parameters: frozenset[int]
    given_states: frozenset[int]
    given_inputs: frozenset[int]
