"""What a run gives: the motion over time, how it ended, and how accurate it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from msgspec import Struct, to_builtins
from msgspec.structs import replace

from ..integrate.events import Event
from ..integrate.trajectory import Statistics
from ..interface import Quantity
from ..outcome import Failure, Outcome
from ..problem import Array, Problem
from ..rows import AT_ONCE
from .accuracy import Accuracy, Drift, Judged
from .branches import Branches
from .doubts import Contradiction
from .evaluate import Table
from .files import json_number
from .quantities import Display, LazyValues, Results, Values

if TYPE_CHECKING:
    from .branch_jumps import Jump
    from .condition import Condition
    from .energy_accounts import EnergyAccounts
    from .extents import Extent
    from .further_solutions import Several
    from .sensitivity import Sensitivities, Sensitivity

Columns = Callable[[Array], Array]
"""times [n] -> rows [n, number of columns]"""


class TrueError(Struct, frozen=True):
    """Difference from a closed solution: largest and at the end, in SI; ``relative``: largest by the largest value."""

    name: str
    unit: str
    largest: float
    at_end: float
    relative: float


class Motion(Struct, frozen=True, eq=False):
    """What a run found, from which everything that is told of it follows.

    ``columns`` [n, k]: one for each of ``quantities(problem)``, at the times ``time`` [n]; ``at`` gives them at other
    times. ``as_stated``: the default experiment, with no value and no input changed. ``pictured``: the numbers of
    ``problem.scene`` at times, where somebody asked for a picture; ``states_at``: states and discrete variables at times,
    those among them that tell what touches and sticks. ``stopped``: why the run ended
    before its end, if it did, and its companion. ``own_sizes``: nominal values whose declaration makes the
    rules give those by which the run was repeated, as states stay far below others; ``nominal`` [ny] is what these gave before.
    """

    problem: Problem
    time: Array
    columns: Table
    at: Columns
    interpolation: str
    experiment: str
    parameters: Mapping[str, float]
    statistics: Statistics
    judged: Judged
    stopped: Failure | None = None
    companion_stopped: Failure | None = None
    events: Sequence[Event] = ()
    as_stated: bool = False
    pictured: Columns | None = None
    states_at: Callable[[Array], tuple[Array, Array | None]] | None = None
    own_sizes: Mapping[str, float] = MappingProxyType({})
    nominal: Array | None = None
    sensitivities: Sensitivities | None = None
    condition: Condition | None = None
    sought: Callable[[], Branches] | None = None

    def told(self, **changes: Any) -> Motion:
        """Return the same with a verdict that says something else."""
        return replace(self, judged=Judged(replace(self.judged(), **changes)))


class Solution(Results):
    """A mapping from the names of states, outputs, inputs and discrete variables to arrays over ``time``.

    Call it with a time, or an array of times, for everything at these times: states by the dense output of the
    method (by cubic Hermite interpolation between output points if that was not kept, see
    ``interpolation``), outputs by the functions of the model.
    """

    def __init__(self, motion: Motion) -> None:
        problem = motion.problem
        self._report = None
        self.motion = motion
        self.problem = problem
        self.model = problem.name
        self.experiment = motion.experiment
        self.parameters = motion.parameters
        self.statistics = motion.statistics
        self.events = motion.events
        self.interpolation = motion.interpolation
        self._at = motion.at

    @cached_property
    def time(self) -> Array:  # type: ignore[override]
        return self._given(self.motion.time)

    @property
    def outcome(self) -> Outcome:
        """How the run ended."""
        return self.motion.judged().outcome

    @property
    def message(self) -> str:
        """How it ended, in words."""
        return self.motion.judged().message

    @property
    def failure(self) -> Failure | None:
        """Why it failed, if it did."""
        return self.motion.judged().failure

    @property
    def accuracy(self) -> Accuracy:
        """How accurate it was."""
        return self.motion.judged().accuracy

    def _given(self, values: Array) -> Array:
        """Give numbers away that belong to whoever asks: while they are still to be judged, a copy."""
        return values.copy() if self.motion.judged.pending else values

    @cached_property
    def quantities(self) -> Mapping[str, Quantity]:
        """All quantities by their names."""
        return {quantity.name: quantity for quantity in quantities(self.problem)}

    @cached_property
    def _column(self) -> Mapping[str, int]:
        """The column of each quantity: an account is a state and an output by one name, the later one stands for both."""
        return {quantity.name: index for index, quantity in enumerate(quantities(self.problem))}

    @cached_property
    def _values(self) -> Mapping[str, Array]:  # type: ignore[override]
        column = self.motion.columns.column
        if len(self.motion.columns) > AT_ONCE:
            return LazyValues(list(self._column), lambda name: column(self._column[name]))
        return Values({name: self._given(column(index)) for name, index in self._column.items()})

    @cached_property
    def _extents(self) -> Mapping[str, Extent]:
        """The first and last, lowest and highest value of states and outputs."""
        from .extents import extents

        return extents(self.motion.columns, self._column)

    @cached_property
    def _units(self) -> dict[str, str]:  # type: ignore[override]
        return {"time": self.problem.time.unit} | {name: q.unit for name, q in self.quantities.items()}

    @cached_property
    def branches(self) -> Branches:
        """Which solutions outputs follow that equations determine."""
        return Branches() if self.motion.sought is None else self.motion.sought()

    @property
    def jumps(self) -> tuple[Jump, ...]:
        """Where outputs that equations determine leave the solution that they have followed."""
        return self.branches.jumps

    @property
    def further_solutions(self) -> tuple[Several, ...]:
        """Other solutions of equations for outputs that were found at the start."""
        return self.branches.several

    @cached_property
    def energy(self) -> EnergyAccounts | None:
        """Where its energy came from and where it went."""
        from .energy_accounts import energy_accounts

        return energy_accounts(self.problem, self.motion.columns)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is to be known of the run: what it said itself, then what its results show."""
        return (*self.motion.judged().remarks, *self._shown_remarks)

    @cached_property
    def _shown_remarks(self) -> tuple[str, ...]:
        from .remarks import shown_remarks

        listed, met = quantities(self.problem), self._extents
        if not len(self.time):
            return ()
        return (
            *shown_remarks(self, listed, met),
            *self.branches.remarks(self.problem),
        )

    @property
    def report(self) -> Mapping[str, Any]:
        """What the run says of itself (``summary``)."""
        if self._report is None:
            self._report = self.summary()
        return self._report

    def __call__(self, time: float | Sequence[float] | Array) -> dict[str, Array]:
        at = self._inside(time)
        rows = self._at(np.atleast_1d(at).ravel())
        return Values({name: rows[:, i].reshape(at.shape) for name, i in self._column.items()})

    def __copy__(self) -> Self:
        other = type(self).__new__(type(self))
        vars(other).update(vars(self))
        return other

    def __reduce__(self) -> tuple[type[Results], tuple[object, ...]]:
        """Pickle as what a file of results gives back: functions of the method do not reach other processes."""
        return Results, (self.time, dict(self._values), self._units, self.report)

    def add_remark(self, remark: str) -> None:
        """Say something further about the run."""
        self.motion = self.motion.told(remarks=(*self.motion.judged().remarks, remark))
        self._report = None

    @property
    def runs(self) -> tuple[Self, ...]:
        """Itself: every answer to a study tells the motions that it was made from."""
        return (self,)

    @property
    def true_errors(self) -> tuple[TrueError, ...]:
        """Compare with the closed solutions that the model states; they hold for its default experiment only."""
        if not self.motion.as_stated:
            return ()
        exact = [q for q in self.problem.outputs if q.kind == "exact"]
        return tuple(self._true_error(q.name, q.name.removeprefix("exact(")[:-1], q.unit) for q in exact)

    def _true_error(self, exact: str, name: str, unit: str) -> TrueError:
        table, largest, size, last = self.motion.columns, -np.inf, -np.inf, np.nan
        own, stated = self._column[name], self._column[exact] - self.problem.ny
        for rows, outputs in table.parts():
            values = table.y[rows, own] if own < self.problem.ny else outputs[:, own - self.problem.ny]
            difference = np.abs(values - outputs[:, stated])
            largest = np.maximum(largest, difference.max())
            size = np.maximum(size, np.abs(outputs[:, stated]).max())
            last = difference[-1]
        relative = largest / size if size > 0 else largest
        return TrueError(name, unit, float(largest), float(last), float(relative))

    def sensitivity(self, of: str, to: str) -> Sensitivity:
        """Give d(``of``)/d(``to``) over ``time``: of a state or output, in a parameter, initial value or input that the run
        was asked to be differentiated in. Raises SimulationError if it was asked for none, KeyError for other names."""
        if self.motion.sensitivities is None:
            from .sensitivity import none_asked

            raise none_asked()
        return self.motion.sensitivities.of(of, to)

    @property
    def condition(self) -> Condition:
        """How small changes of the start grow along the motion. Raises SimulationError if the run was not asked for it."""
        if self.motion.condition is None:
            from .condition import no_condition

            raise no_condition()
        return self.motion.condition

    def columns(
        self, names: Sequence[str] | None = None, display: Display | None = None
    ) -> dict[str, tuple[str, Array]]:
        """Give unit and values by name, time first, derivatives last."""
        columns = super().columns(names, display)
        found = self.motion.sensitivities
        for one in found.listed(None if names is None else self.named(names)) if found else ():
            unit, factor = display(one.name, one.unit) if display else (one.unit, 1.0)
            columns[one.name] = (unit, one.values if factor == 1.0 else one.values * factor)
        return columns

    def final(self) -> dict[str, float]:
        """Give coordinates, rates, states, outputs and discrete variables at the last time."""
        table = self.motion.columns
        last = table.rows(slice(len(table) - 1, len(table)))[0].tolist()
        wanted = (name for name, q in self.quantities.items() if q.kind != "input")
        return {name: last[self._column[name]] for name in wanted}

    def summary(self, names: Sequence[str] | None = None) -> dict[str, Any]:
        """Give the report of the run as JSON knows it: not-a-number and infinity are null; derivatives of all, or of ``names``."""
        shown = {name: json_number(value) for name, value in self.final().items()}
        accuracy = _accuracy_summary(self.accuracy)
        if self.true_errors:
            accuracy["true_error"] = {
                e.name: {"largest": e.largest, "at_end": e.at_end, "relative": e.relative}
                for e in self.true_errors
            }
        contact = self.statistics.contact
        return {
            "model": self.model,
            "experiment": self.experiment,
            "outcome": self.outcome.value,
            "message": self.message,
            "remarks": list(self.remarks),
            "time": float(self.motion.time[-1]),
            "final": {name: value for name, value in shown.items() if not name.startswith("exact(")},
            **self._sensitivity_summary(names),
            **({} if self.motion.condition is None else {"condition": self.motion.condition.summary()}),
            **self.branches.summary(),
            "energy": to_builtins(self.energy) if self.energy else None,
            "events": [_event_summary(e) for e in self.events],
            **({} if contact is None else {"contact": to_builtins(contact)}),
            "statistics": {k: v for k, v in to_builtins(self.statistics).items() if k != "contact"},
            "accuracy": accuracy,
        }

    def _sensitivity_summary(self, names: Sequence[str] | None) -> dict[str, Any]:
        found = self.motion.sensitivities
        if found is None:
            return {}
        wanted = set(found.columns if names is None else self.named(names))
        errors = found.errors_at_end()
        return {
            "sensitivities": {n: v for n, v in found.at_end().items() if n in wanted},
            "sensitivity_errors": errors and {n: v for n, v in errors.items() if n in wanted},
        }


def quantities(problem: Problem) -> tuple[Quantity, ...]:
    """All quantities of a solution, in the order of its columns."""
    discretes = (quantity for quantity in problem.discretes if quantity.kind != "mode")
    return (*problem.states, *problem.outputs, *problem.inputs, *discretes)


def _event_summary(event: Event) -> dict[str, Any]:
    before, after = ({n: json_number(x) for n, x in side.items()} for side in (event.before, event.after))
    summary = {"time": event.time, "name": event.name, "kind": event.kind, "before": before, "after": after}
    return summary | ({"speed": event.value} if event.kind == "impact" else {})


def _accuracy_summary(accuracy: Accuracy) -> dict[str, Any]:
    error, energy = accuracy.error, accuracy.energy
    return {
        "estimated_error": json_number(error.largest) if error else None,
        "estimated_error_at_end": json_number(error.at_end) if error else None,
        "by_state": _numbers(error.by_state) if error else None,
        "by_state_at_end": _numbers(error.by_state_at_end) if error else None,
        "energy_drift": _drift_number(energy) if energy else None,
        "energy_change": json_number(energy.absolute) if energy else None,
        "energy_unit": energy.unit if energy else None,
        "conserved": {drift.name: _drift_summary(drift) for drift in accuracy.conserved},
        "constraints": {
            drift.level: {
                "before_projection": None if drift.before is None else json_number(drift.before),
                "after_projection": json_number(drift.after),
            }
            for drift in accuracy.constraints
        },
        "remark": accuracy.remark,
        "contradictions": [_contradiction_summary(doubt) for doubt in accuracy.contradictions],
    }


def _contradiction_summary(doubt: Contradiction) -> dict[str, Any]:
    numbers = {name: json_number(getattr(doubt, name)) for name in ("found", "allowed")}
    return {
        "kind": doubt.kind,
        "name": doubt.name,
        "unit": doubt.unit,
        **numbers,
        "since": doubt.since,
        "persists": doubt.persists,
        "message": doubt.text(),
        "likely": doubt.causes,
    }


def _numbers(values: Mapping[str, float]) -> dict[str, float | None]:
    return {name: json_number(value) for name, value in values.items()}


def _drift_number(drift: Drift) -> float | None:
    return None if drift.relative is None else json_number(drift.relative)


def _drift_summary(drift: Drift) -> dict[str, float | None]:
    return {"absolute": json_number(drift.absolute), "relative": _drift_number(drift)}
