"""What a page is told of a model: names, units, ranges of sliders, what is drawn, and how it is integrated."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct

from mechc.compiler.flat.values.mesh_files import triangles
from mechc.display import Display, factor
from mechc.presentation.stillness import Stillness
from mechc.requests.parse_values import UsageMistake
from mechc.requests.request import asked
from mechc.runtime.case import find_experiment, find_setting, inputs_at
from mechc.runtime.methods import KERNEL_METHODS
from mechc.runtime.native.kernel import EVENT_KINDS as KINDS
from mechc.runtime.problem import Array, Experiment, Problem, Quantity, Scene
from mechc.runtime.studies.kinds.motion import Simulate
from mechc.session import answer, plan
from mechc.solution import Solution

from .failures import failure_texts
from .kernels import WebKernel, kernel_for

if TYPE_CHECKING:
    from mechc.model import CompiledModel
    from mechc.requests.parse_values import Given
    from mechc.requests.request import Asked
    from mechc.runtime.studies.runs.simulate import Plan

ROWS = 1001
"""Output times of a page."""

SPAN = 4.0
"""A slider without limits goes from the value over this to the value times this."""

OF_EXPERIMENTS = ("start", "stop", "step", "tolerance")
"""Numbers of experiments that a page follows when parameters change."""

LONGEST, SHORTEST, SHOWN = 120.0, 1.0, 10.0
"""Runs of other durations are shown in as many seconds as the last of these."""


class Facts(Struct, frozen=True):
    """A model with a native run of it, from which a page takes what it does not compute itself. ``solution`` is shown in
    the units of pictures, ``display`` are those that the model asks for."""

    model: CompiledModel
    plan: Plan
    solution: Solution
    method: str
    display: Display

    @property
    def problem(self) -> Problem:
        return self.solution.problem

    @property
    def kernel(self) -> WebKernel:
        return kernel_for(self.method, events=self.problem.hybrid is not None)

    @property
    def scene(self) -> Scene:
        scene = self.problem.scene
        assert scene is not None, "the model was compiled with a scene"
        return scene

    @property
    def experiment(self) -> Experiment | None:
        return find_experiment(self.problem, self.plan.case.experiment or None)

    @property
    def times(self) -> Array:
        case = self.plan.case
        first = float(case.grid[0])
        times: Array = first + np.arange(ROWS, dtype=np.float64) * ((case.stop - first) / (ROWS - 1))
        times[-1] = case.stop
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

    # ------------------------------------------------------------ for the page

    def info(self, *, recorded: bool) -> dict[str, object]:
        """Return all that a page is told, as plain data; values are in SI, ``factor`` leads to shown units."""
        case, problem = self.plan.case, self.problem
        duration = case.stop - case.begin
        return {
            "name": self.model.name,
            "rows": ROWS,
            "begin": case.begin,
            "start": float(case.grid[0]),
            "stop": case.stop,
            "tolerance": case.tolerance,
            "companion": 0.01 if case.tolerance > 1e-13 else 10.0,
            "step": case.step or 0.0,
            "maxStep": (case.asked.max_step if case.asked else None) or 0.0,
            "method": self.kernel.methods.index(self.method),
            "pace": 1.0 if SHORTEST <= duration <= LONGEST or duration <= 0 else duration / SHOWN,
            "digits": max(2, 2 - math.floor(math.log10(duration))) if duration > 0 else 2,
            "second": problem.time.unit,
            "joule": next((self.shown(q) for q in problem.outputs if q.name == "energy.total"), ("", 1.0)),
            "states": [self.entry(q) for q in problem.states],
            "outputs": [self.entry(q) for q in problem.outputs],
            "balance": [*(problem.energy_balance or (-1, -1, -1))],
            "sizes": [k for k, q in enumerate(problem.outputs) if q.kind == "energy"],
            "nominal": self.plan.nominal.tolist(),
            "settings": self.settings(),
            "numbers": self.numbers(),
            "limits": self.limits(),
            "failures": {} if recorded else failure_texts(problem),
            "rowNames": [row.name for row in problem.hybrid.rows] if problem.hybrid else [],
            **self.sliders(),
            "curves": self.curves(),
            "phase": self.phase(),
            "scene": self.picture(),
            **(self.record_facts() if recorded else {}),
        }

    def entry(self, q: Quantity) -> dict[str, object]:
        unit, by = self.shown(q)
        return {"name": q.name, "kind": q.kind, "unit": q.unit, "shown": unit, "factor": by, "doc": q.doc}

    def shown(self, q: Quantity) -> tuple[str, float]:
        """Return the unit that a quantity of the motion is shown in, and its value in SI."""
        unit, from_si = self.solution.shown_unit(q.name)
        return unit, 1 / from_si

    def set_in(self, q: Quantity) -> tuple[str, float]:
        """Return the unit that a parameter or an input is set in, and its value in SI: that of the text, if it has one."""
        display = self.display if q.display else self.solution.display
        unit = display.unit(q.unit, q.display)
        return unit, factor(unit) / factor(q.unit)

    def settings(self) -> dict[str, list[list[float]]]:
        """Return what the caller set, by array: index and value. What the experiment sets, the page finds itself."""
        case, problem = self.plan.case, self.problem
        options = case.asked.values if case.asked else {}
        found: dict[str, list[list[float]]] = {"p": [], "y": [], "u": []}
        for place in (find_setting(problem, name) for name in options):
            if place.array == "p":
                found["p"].append([place.index, float(case.p[place.index])])
            elif place.array == "y":
                found["y"].append([place.index, float(case.wanted[place.index])])
        for index, table in case.tables.items():
            if len(table.values) != 1:
                raise UsageMistake(
                    f"the input '{problem.inputs[index].name}' is a table, which a page does not hold",
                    "give it a constant value, or a formula in the model",
                )
            if problem.inputs[index].name in options:
                found["u"].append([index, float(table.values[0])])
        return found

    def numbers(self) -> list[str]:
        """Return what the page takes from the numbers of the experiment, in their order; "" where the caller said another."""
        asked = self.plan.case.asked
        return [
            name if name in OF_EXPERIMENTS and getattr(asked, name, None) is None else ""
            for name in (self.experiment.options if self.experiment else ())
        ]

    def limits(self) -> list[list[object]]:
        """Return the declared limits of parameters (p) and initial values (y0): array, index, name, lowest, highest, factor, unit."""
        return [
            [array, index, q.name, q.minimum, q.maximum, *reversed(unit(q))]
            for array, quantities, unit in (
                ("p", self.problem.parameters, self.set_in),
                ("y0", self.problem.states, self.shown),
            )
            for index, q in enumerate(quantities)
            if q.minimum is not None or q.maximum is not None
        ]

    def sliders(self) -> dict[str, object]:
        case, problem = self.plan.case, self.problem
        equations = self.model.compilation.equations
        free = {r.index for r in equations.parameter_rules if not equations.graph.support(r.value)}
        free |= set(range(len(problem.parameters))) - {r.index for r in equations.parameter_rules}
        u = np.zeros(len(problem.inputs))
        if case.functions.inputs is not None:
            u = inputs_at(case, case.begin)
        starts = {
            k
            for k, q in enumerate(problem.states)
            if q.kind in ("coordinate", "rate", "state")
            and case.known[k]
            and k not in problem.dependent
            and not any(first <= k < first + 4 for first in problem.rotations)
        }
        return {
            "parameters": [
                self.slider(q, k, float(case.p[k]), 0.0, self.set_in(q))
                for k, q in enumerate(problem.parameters)
                if k in free
            ],
            "starts": [
                self.slider(q, k, float(case.y0[k]), float(self.plan.nominal[k]), self.shown(q))
                for k, q in enumerate(problem.states)
                if k in starts
            ],
            "inputs": [
                self.slider(q, k, float(u[k]), 0.0, self.set_in(q)) for k, q in enumerate(problem.inputs)
            ],
        }

    def slider(
        self, q: Quantity, index: int, value: float, size: float, shown: tuple[str, float]
    ) -> dict[str, object]:
        unit, by = shown
        if value != 0 and not size:
            low, high = sorted((value / SPAN, value * SPAN))
        else:
            half = max(2 * abs(value), 2 * size) or by
            half = min(half, math.pi) if q.unit == "rad" and abs(value) <= math.pi else half
            low, high = min(value, -half), max(value, half)
        low = q.minimum if q.minimum is not None and math.isfinite(q.minimum) else low
        high = q.maximum if q.maximum is not None and math.isfinite(q.maximum) else high
        return {
            "name": q.name,
            "index": index,
            "value": value,
            "min": min(low, value),
            "max": max(high, value),
            "shown": unit,
            "factor": by,
            "doc": q.doc,
        }

    # ------------------------------------------------------------ what is shown first

    def curves(self) -> list[str]:
        """Return the quantities whose curves are shown first: coordinates of one unit, those that move if any do."""
        first = [
            q for q in (*self.problem.states, *self.problem.outputs) if q.kind in ("coordinate", "state")
        ]
        still = Stillness(self.solution)
        first = [q for q in first if not still.constant(q.name)] or first
        first = first or [q for q in self.problem.outputs if q.kind == "output"] or list(self.problem.outputs)
        return [q.name for q in first if q.unit == first[0].unit][:6]

    def phase(self) -> list[str]:
        names = [q.name for q in (*self.problem.states, *self.problem.outputs)]
        still = Stillness(self.solution)
        paired = [n for n in names if f"der({n})" in names]
        moving = [n for n in paired if not (still.constant(n) or still.steady(f"der({n})"))] or paired
        if moving:
            return [moving[0], f"der({moving[0]})"]
        return [names[0], names[min(1, len(names) - 1)]]

    def picture(self) -> dict[str, object]:
        scene = self.scene
        meshes: dict[str, object] = {}
        for shape in scene.shapes:
            if shape.kind == "mesh":
                meshes.setdefault(shape.text, _mesh(shape.text))
        return {
            "size": scene.size,
            "flat": self.model.compilation.flat.space != 3,
            "up": _up(self.model),
            "unit": "" if self.model.compilation.flat.dimensionless else "m",
            "nScene": scene.n_still + scene.n_moving,
            "meshes": meshes,
            "shapes": [
                {
                    "kind": s.kind,
                    "numbers": list(s.numbers),
                    "name": s.name,
                    "colour": s.colour,
                    "text": s.text,
                    "relative": s.relative,
                    "grid": list(s.grid),
                }
                for s in scene.shapes
            ],
        }

    def record_facts(self) -> dict[str, object]:
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
) -> Facts:
    """Run a model that has a scene, and return what its page is told. Raises what ``simulate`` raises."""
    solution = answer(*_posed(model, values, {**options, "experiment": experiment}))
    assert isinstance(solution, Solution)
    solution.angles = model.angles
    display, solution = solution.display, solution.in_picture()
    said = solution.statistics.method
    method = "auto" if solution.statistics.switches else said
    if method not in KERNEL_METHODS:
        raise UsageMistake(f"a page cannot run '{method}'", f"it takes one of {', '.join(KERNEL_METHODS)}")
    given = {**options, "experiment": experiment, "method": method if method != "dop853" else None}
    ready, question = _posed(model, values, given)
    return Facts(ready, plan(ready, question), solution, method, display)


def _posed(
    model: CompiledModel, values: Mapping[str, Given], given: Mapping[str, Any]
) -> tuple[CompiledModel, Asked]:
    """Return the model with the values and the question about its motion."""
    question = asked(Simulate, given)
    return model.with_values(values).for_experiment(question.experiment), question


def _mesh(path: str) -> dict[str, Any]:
    """Return points, normals and triangles of a file, as the page draws them."""
    corners = np.array(triangles(path))
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.repeat(normals / np.where(lengths > 0, lengths, 1), 3, axis=0)
    return {
        "points": [float(f"{x:.6g}") for x in corners.ravel()],
        "normals": [float(f"{x:.3g}") for x in normals.ravel()],
        "index": list(range(3 * len(corners))),
    }


def _up(model: CompiledModel) -> list[float]:
    """Return the axis against which things fall: z in space, y in the plane, where no field says it."""
    system = model.compilation.system
    size = 3 if system.model.space == 3 else 2
    graph = system.graph
    for mass in system.masses:
        if mass.field is not None and all(graph.is_constant(n) for n in mass.field):
            numbers = [float(graph.value(n)) for n in mass.field]
            axis = int(np.argmax(np.abs(numbers)))
            if numbers[axis] < 0:
                return [1.0 if k == axis else 0.0 for k in range(3)]
    return [0.0, 0.0, 1.0] if size == 3 else [0.0, 1.0, 0.0]
