"""The facts of a page from a native run of its model, which decides by what the page integrates: by which method, with which sizes.

A page is written once: it cannot be compiled again for what its own run turns out to lack.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mechc.presentation.stillness import extents_of
from mechc.requests.request import asked
from mechc.runtime.case import find_experiment, find_setting, inputs_at
from mechc.runtime.driving_inputs import derived
from mechc.runtime.integrate.solver import kink_times
from mechc.runtime.native.kernel import EVENT_KINDS as KINDS
from mechc.runtime.native.kernel import INTERPOLATIONS
from mechc.runtime.problem import Array
from mechc.runtime.studies.kinds.motion import Simulate
from mechc.session import answer, case_of
from mechc.solution import Solution

from .facts import OF_EXPERIMENTS, ROWS, InputTable, PageFacts, RunFigures, RunSpan, Settings

if TYPE_CHECKING:
    from mechc.model import CompiledModel
    from mechc.requests.parse_values import Given
    from mechc.requests.request import Asked
    from mechc.runtime.case import Case


class RunFacts(PageFacts, frozen=True, kw_only=True):
    """A model with a native run of it, which is shown in the units of pictures."""

    solution: Solution
    found: RunFigures

    @property
    def times(self) -> Array:
        first = self.span.start
        times: Array = first + np.arange(ROWS, dtype=np.float64) * ((self.span.stop - first) / (ROWS - 1))
        times[-1] = self.span.stop
        return times

    def recorded(self) -> Iterator[Array]:
        """Yield times, states, outputs and numbers of the picture of the native run."""
        pictured = self.solution.motion.pictured
        assert pictured is not None
        end = float(self.solution.time[-1])
        times = np.minimum(self.times, end)
        at = self.solution.motion.at(times)
        ny, n_out = self.problem.ny, len(self.problem.outputs)
        yield from (times, at[:, :ny], at[:, ny : ny + n_out], pictured(times))

    def rows(self) -> bytes:
        """Return what is recorded, one block after another, in single precision."""
        return b"".join(np.asarray(block, dtype="<f4").tobytes() for block in self.recorded())

    def told(self, *, recorded: bool) -> dict[str, object]:
        """Return all that a page is told; of a recorded one also what the run said of itself."""
        return self.info(self.found) | ({"failures": {}, **self.of_record()} if recorded else {})

    def of_record(self) -> dict[str, object]:
        error, energy = self.solution.accuracy.error, self.solution.accuracy.energy
        kinds = {name: k for k, name in enumerate(KINDS)}
        return {
            "recorded": "This page holds one motion, not the model: without --recorded it has sliders.",
            "events": [{"t": e.time, "kind": kinds.get(e.kind, 0), "index": 0} for e in self.solution.events],
            "energy": {"worst": energy.absolute, "relative": energy.relative} if energy else None,
            "error": {"largest": error.largest, "atEnd": error.at_end} if error else None,
            "ms": 1e3 * self.solution.statistics.run_time,
            "steps": self.solution.statistics.steps,
        }


def facts_of(
    model: CompiledModel, values: Mapping[str, Given], experiment: str | None, options: Mapping[str, Any]
) -> RunFacts:
    """Run a model that has a scene, and return what its page is told. Raises what ``simulate`` raises."""
    solution = answer(*_posed(model, values, {**options, "experiment": experiment}))
    assert isinstance(solution, Solution)
    solution.angles = model.angles
    display, solution = solution.display, solution.in_picture()
    said = solution.statistics.method
    method = "auto" if solution.statistics.switches else said
    given = {**options, "experiment": experiment, "method": method if method != "dop853" else None}
    ready, question = _posed(model, values, given)
    problem = solution.problem
    case, nominal = case_of(ready, question, problem), solution.motion.nominal
    assert nominal is not None
    u = inputs_at(case, case.begin) if case.functions.inputs is not None else np.zeros(len(problem.inputs))
    return RunFacts(
        model=ready,
        problem=problem,
        experiment=find_experiment(problem, case.experiment or None),
        method=method,
        display=display,
        pictured=solution.display,
        span=_span(case),
        settings=_settings(case),
        tables=_tables(case),
        stops=tuple(kink_times(case)),
        known=case.known.tolist(),
        solution=solution,
        found=RunFigures(
            case.p.tolist(), case.y0.tolist(), u.tolist(), nominal.tolist(), extents_of(solution)
        ),
    )


def _posed(
    model: CompiledModel, values: Mapping[str, Given], given: Mapping[str, Any]
) -> tuple[CompiledModel, Asked]:
    """Return the model with the values and the question about its motion."""
    question = asked(Simulate, given)
    return model.with_values(values).for_experiment(question.experiment), question


def _span(case: Case) -> RunSpan:
    asked = case.asked
    return RunSpan(
        case.begin,
        float(case.grid[0]),
        case.stop,
        case.tolerance,
        case.step or 0.0,
        (asked.max_step if asked else None) or 0.0,
        frozenset(name for name in OF_EXPERIMENTS if getattr(asked, name, None) is not None),
        case.begin != min(0.0, float(case.grid[0])),
    )


def _settings(case: Case) -> Settings:
    problem, found = case.problem, Settings([], [], [])
    options = case.asked.values if case.asked else {}
    for place in (find_setting(problem, name) for name in options):
        if place.array == "p":
            found.p.append((place.index, float(case.p[place.index])))
        elif place.array == "y":
            found.y.append((place.index, float(case.wanted[place.index])))
        elif place.array == "u":
            found.u.append((place.index, float(case.tables[place.index].values[0])))
    return found


def _tables(case: Case) -> tuple[InputTable, ...]:
    """Return what is given over time, with the derivatives of what drives."""
    driving = derived(case.problem)
    given = {find_setting(case.problem, name).index for name in (case.asked.inputs if case.asked else ())}
    given |= {k for index in given if index in driving for k in driving[index]}
    return tuple(
        InputTable(
            case.problem.inputs[index].name,
            index,
            INTERPOLATIONS[table.interpolation],
            table.times.tolist(),
            table.values.tolist(),
            table.slopes.tolist(),
            index in driving and table.times.size > 1,
        )
        for index, table in case.tables.items()
        if index in given
    )
