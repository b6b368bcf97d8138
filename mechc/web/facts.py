"""What a page is told of a model: names, units, ranges of sliders, what is drawn, and how it is integrated.

``run_facts.py`` takes from a native run what only a run tells, ``playground.py`` from a run in the page; nothing here needs NumPy.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from msgspec import Struct, to_builtins

from mechc.display import Display, factor, shown_unit
from mechc.presentation.extents import Extents
from mechc.presentation.surfaces import drawn_triangles
from mechc.runtime.interface import Experiment, Quantity, Scene
from mechc.runtime.limits_of_time import DEFAULT_TOLERANCE
from mechc.runtime.problem import Problem

from .failures import failure_texts
from .kernels import WebKernel, kernel_for
from .sizes import UsualSizes, sizes_of
from .turning import turning

if TYPE_CHECKING:
    from mechc.compiler.equations.model import Equations
    from mechc.model import CompiledModel

ROWS = 1001
"""Output times of a page."""

SPAN = 4.0
"""A slider goes to the value times this, one of what may not vanish from the value over this."""

FAR = 100.0
"""Declared limits that are as many times smaller or larger than the value exclude what is impossible, and are no range."""

LONG = 1e4
"""Numbers of settings from which another unit is looked for."""

SIZES = ("kg", "kg.m^2", "kg/m^3", "m", "m^2", "m^3", "s")
"""Units of what makes a model another if it vanishes: masses, inertias, lengths, areas, volumes, times."""

NEVER_NEGATIVE = ("kg", "kg.m^2", "kg/m^3", "N/m", "N.m/rad", "N.s/m", "N.m.s/rad", "N.m.s")
"""Units of what is not negative unless the model says so; products of inertia may be."""

ARRAY = re.compile(r"\[[^\]]*\](?=\)*$)")
"""The place of an entry in its array."""

OF_MATRIX = re.compile(r"\[(\d+), ?(\d+)\]$")

MOST_CURVES = 6
"""At first, of all that has curves."""

OF_EXPERIMENTS = ("start", "stop", "step", "tolerance")
"""Numbers of experiments that a page follows when parameters change."""


class RunSpan(Struct, frozen=True):
    """The times of a run, its tolerance, and what bounds its steps; ``asked``: those of ``OF_EXPERIMENTS`` that the caller gave."""

    begin: float = 0.0
    start: float = 0.0
    stop: float = 0.0
    tolerance: float = DEFAULT_TOLERANCE
    step: float = 0.0
    max_step: float = 0.0
    asked: frozenset[str] = frozenset()
    with_table: bool = False
    """Whether the motion begins at the start, where a table does."""


class Settings(Struct, frozen=True):
    """What the caller set, by array: index and value. What the experiment sets, the page finds itself."""

    p: list[tuple[int, float]] = []
    y: list[tuple[int, float]] = []
    u: list[tuple[int, float]] = []


class InputTable(Struct, frozen=True):
    """A table of the input with an index in u, in the numbers of the kernel; ``drives``: none of its ends may be passed."""

    name: str
    index: int
    kind: int
    t: list[float]
    v: list[float]
    slopes: list[float]
    drives: bool


class RunFigures(Struct, frozen=True):
    """What a run says of itself: parameters, the state and inputs it begins with, nominal values, and how far quantities go."""

    p: list[float]
    y0: list[float]
    u: list[float]
    nominal: list[float]
    extents: Extents


class PageFacts(Struct, frozen=True, kw_only=True):
    """A model and how it is run. ``display`` are the units that the model asks for, ``pictured`` those of pictures."""

    model: CompiledModel
    problem: Problem
    experiment: Experiment | None
    method: str
    display: Display
    pictured: Display
    span: RunSpan
    settings: Settings
    known: list[bool]
    """Which entries of the initial state are given."""
    tables: tuple[InputTable, ...] = ()
    stops: tuple[float, ...] = ()
    """Times at which tables have kinks, increasing."""

    @property
    def kernel(self) -> WebKernel:
        return kernel_for(self.method, events=self.problem.hybrid is not None)

    @property
    def scene(self) -> Scene:
        scene = self.problem.scene
        assert scene is not None, "the model was compiled with a scene"
        return scene

    # ------------------------------------------------------------ for the page

    def of_run(self) -> dict[str, object]:
        """Return what a page must know to run the model (``engine.js``), as plain data; values are in SI."""
        problem, span = self.problem, self.span
        return {
            "name": self.model.name,
            "rows": ROWS,
            "second": problem.time.unit,
            "begin": span.begin,
            "start": span.start,
            "stop": span.stop,
            "tolerance": span.tolerance,
            "companion": 0.01 if span.tolerance > 1e-13 else 10.0,
            "step": span.step,
            "maxStep": span.max_step,
            "method": self.kernel.methods.index(self.method),
            "states": [self.entry(q) for q in problem.states],
            "outputs": [self.entry(q) for q in problem.outputs],
            "settings": {name: list(map(list, getattr(self.settings, name))) for name in ("p", "y", "u")},
            "tables": [to_builtins(table) for table in self.tables],
            "stops": [*self.stops],
            "withTable": span.with_table,
            "numbers": self.numbers(),
            "limits": self.limits(),
            "failures": failure_texts(problem),
            "rowNames": [row.name for row in problem.hybrid.rows] if problem.hybrid else [],
        }

    def info(self, found: RunFigures) -> dict[str, object]:
        """Return all that a page is told, as plain data; values are in SI, ``factor`` leads to shown units."""
        problem = self.problem
        duration = self.span.stop - self.span.begin
        first = self.curves(found.extents)
        sizes = array_sizes(found.extents)
        return {
            **self.of_run(),
            "states": [self.entry(q, sizes) for q in problem.states],
            "outputs": [self.entry(q, sizes) for q in problem.outputs],
            "digits": max(2, 2 - math.floor(math.log10(duration))) if duration > 0 else 2,
            "hybrid": problem.hybrid is not None,
            "joule": next((self.shown(q) for q in problem.outputs if q.name == "energy.total"), ("", 1.0)),
            "balance": [*(problem.energy_balance or (-1, -1, -1))],
            "sizes": [k for k, q in enumerate(problem.outputs) if q.kind == "energy"],
            "turning": turning(self.model.compilation.equations),
            **self.sliders(found),
            "curves": first[:MOST_CURVES],
            "moreCurves": len(first[MOST_CURVES:]),
            "phase": self.phase(found.extents),
            "scene": self.picture(),
        }

    def entry(self, q: Quantity, sizes: Mapping[str, float] | None = None) -> dict[str, object]:
        unit, by = self.shown(q, sizes)
        return {"name": q.name, "kind": q.kind, "unit": q.unit, "shown": unit, "factor": by, "doc": q.doc}

    def shown(self, q: Quantity, sizes: Mapping[str, float] | None = None) -> tuple[str, float]:
        """Return the unit that a quantity of the motion is shown in, and its value in SI.

        ``sizes``: how far arrays go; where the numbers of one would be long, all its entries are shown in SI.
        """
        listed = {other.name: other for other in (*self.problem.states, *self.problem.outputs)}
        unit, from_si = shown_unit(self.pictured, listed, q.name, q.unit)
        size = (sizes or {}).get(ARRAY.sub("", q.name), 0.0)
        long = size < LONG <= size * from_si and "rad" not in q.unit
        return (q.unit, 1.0) if long else (unit, 1 / from_si)

    def set_in(self, q: Quantity) -> tuple[str, float]:
        """Return the unit that a parameter or an input is set in, and its value in SI: that of the text, if it has one."""
        display = self.display if q.display else self.pictured
        unit = display.unit(q.unit, q.display)
        return unit, factor(unit) / factor(q.unit)

    def read_in(self, q: Quantity, value: float) -> tuple[str, float]:
        """Return the unit in which a setting is shown: that of the text, or SI, where the number would be long in the one asked for."""
        unit, by = self.set_in(q)
        own = q.display or q.unit
        in_own = factor(own) / factor(q.unit)
        return (own, in_own) if abs(value) >= LONG * by and abs(value) < LONG * in_own else (unit, by)

    def numbers(self) -> list[str]:
        """Return what the page takes from the numbers of the experiment, in their order; "" where the caller said another."""
        return [
            name if name in OF_EXPERIMENTS and name not in self.span.asked else ""
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

    def sliders(self, found: RunFigures) -> dict[str, object]:
        problem = self.problem
        equations = self.model.compilation.equations
        free = {r.index for r in equations.parameter_rules if not equations.graph.support(r.value)}
        free |= set(range(len(problem.parameters))) - {r.index for r in equations.parameter_rules}
        free &= parameters_read(equations)
        held = {table.index for table in self.tables}
        starts = {
            k
            for k, q in enumerate(problem.states)
            if q.kind in ("coordinate", "rate", "state")
            and self.known[k]
            and k not in problem.dependent
            and not any(first <= k < first + 4 for first in problem.rotations)
        }
        turns = {
            k: self.rates_of(k)
            for k in problem.rotations
            if k not in problem.dependent and (self.known[k] or not problem.assembly)
        }
        turned = [first + k for first in turns for k in range(4)]
        turned += [k for rates in turns.values() for k in rates if k not in starts]
        usual, far = self.usual_sizes(found), array_sizes(found.extents)
        return {
            "turns": [{"index": first, "rates": rates} for first, rates in turns.items()],
            "turned": [
                {"name": problem.states[k].name, "index": k, "value": found.y0[k], "factor": 1.0}
                for k in turned
            ],
            "parameters": folded_last(
                slider(
                    q,
                    k,
                    found.p[k],
                    range_of(q, found.p[k], usual.of(q.name, q.unit)),
                    self.read_in(q, found.p[k]),
                )
                | ({"fold": "products of inertia"} if is_no_product(q, found.p[k]) else {})
                for k, q in enumerate(problem.parameters)
                if k in free
            ),
            "starts": [
                slider(
                    q,
                    k,
                    found.y0[k],
                    range_of_start(q, found.y0[k], self.reach(q, found, k)),
                    self.shown(q, far),
                )
                for k, q in enumerate(problem.states)
                if k in starts
            ],
            "inputs": [
                slider(
                    q,
                    k,
                    found.u[k],
                    range_of(q, found.u[k], usual.of(q.name, q.unit)),
                    self.read_in(q, found.u[k]),
                )
                for k, q in enumerate(problem.inputs)
                if k not in held
            ],
        }

    def usual_sizes(self, found: RunFigures) -> UsualSizes:
        """Return how large settings are. Constants of the run stand behind the parameters."""
        settings = zip((*self.problem.inputs, *self.problem.parameters), (*found.u, *found.p), strict=False)
        return sizes_of(((q.name, q.unit, value) for q, value in settings), found.extents.sizes)

    def reach(self, q: Quantity, found: RunFigures, k: int) -> float:
        """Return how far a state goes in the motion, to two digits; twice its nominal value where it stays."""
        extents = found.extents
        return 2 * found.nominal[k] if extents.constant(q.name) else float(f"{extents.largest(q.name):.2g}")

    def rates_of(self, first: int) -> list[int]:
        """Return the indices of the angular velocity of the rotation whose quaternion begins at ``first``."""
        problem = self.problem
        return [problem.nq + i for i, of in enumerate(problem.partner) if of == first]

    # ------------------------------------------------------------ what is shown first

    def curves(self, extents: Extents) -> list[str]:
        """Return the quantities that have curves at first: coordinates, or states, those that move if any do, without quaternions if there are others."""
        states = [q for q in self.problem.states if q.kind == "coordinate"]
        states = states or [q for q in self.problem.states if q.kind == "state"]
        turned = {self.problem.states[k + j].name for k in self.problem.rotations for j in range(4)}
        first = [q for q in states if q.name not in turned] or states
        first = [q for q in first if not extents.constant(q.name)] or first
        first = first or [q for q in self.problem.outputs if q.kind == "output"] or list(self.problem.outputs)
        return [q.name for q in first]

    def phase(self, extents: Extents) -> list[str]:
        names = [q.name for q in (*self.problem.states, *self.problem.outputs)]
        paired = [n for n in names if f"der({n})" in names]
        moving = [n for n in paired if not (extents.constant(n) or extents.steady(f"der({n})"))] or paired
        if moving:
            return [moving[0], f"der({moving[0]})"]
        return [names[0], names[min(1, len(names) - 1)]]

    def left_out(self, scene: Scene) -> int:
        """Return how many coordinates or states have no place and no track either, where there are tracks."""
        shown = {shape.text for shape in scene.shapes if shape.kind in ("bead", "dial")}
        kinds = {q.kind for q in self.problem.states if q.name in shown}
        turned = 4 * len(self.problem.rotations)
        return max(0, sum(q.kind in kinds for q in self.problem.states) - turned - len(shown)) if kinds else 0

    def picture(self) -> dict[str, object]:
        scene = self.scene
        meshes: dict[str, object] = {}
        for shape in scene.shapes:
            if shape.kind == "mesh":
                meshes.setdefault(shape.text, _mesh(shape.text))
        return {
            "size": scene.size,
            "flat": self.model.compilation.flat.space != 3,
            "up": _up(self.model, scene.size),
            "unit": "" if self.model.compilation.flat.dimensionless else "m",
            "left": self.left_out(scene),
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


def array_sizes(extents: Extents) -> dict[str, float]:
    """Return the largest value of each array and of all else."""
    sizes: dict[str, float] = {}
    for name in extents.ends:
        array = ARRAY.sub("", name)
        sizes[array] = max(sizes.get(array, 0.0), extents.largest(name))
    return sizes


def parameters_read(equations: Equations) -> set[int]:
    """Return the parameters that functions of the model read, themselves or through formulas of others."""
    places = {node: slot.index for node, slot in equations.layout.items() if slot.array == "p"}
    rules = {rule.index: rule.value for rule in equations.parameter_rules}
    graph, read = equations.graph, set[int]()
    ahead = [node for function in equations.functions for node in function.outputs]
    while ahead:
        found = {places[node] for node in graph.support(*ahead) if node in places} - read
        read |= found
        ahead = [rules[index] for index in found if index in rules]
    return read


def range_of(q: Quantity, value: float, usual: float | None) -> tuple[float, float]:
    """Return from where to where a parameter or an input may go: to zero where that leaves a model, within declared limits.

    ``usual``: how large it would be, of a value that is zero.
    """
    least = q.minimum if q.minimum is not None and math.isfinite(q.minimum) else -math.inf
    most = q.maximum if q.maximum is not None and math.isfinite(q.maximum) else math.inf
    size = abs(value)
    if value == 0:
        size = usual or (math.pi if q.unit == "rad" else factor(q.display or q.unit) / factor(q.unit))
        size = min(size, math.pi) if q.unit == "rad" else size
        entry = OF_MATRIX.search(q.name)
        positive = q.unit in NEVER_NEGATIVE and (entry is None or entry[1] == entry[2])
        low, high = (0.0 if positive else -size), size
    elif value < 0:
        low, high = SPAN * value, 0.0
    else:
        low = value / SPAN if least > 0 or (q.unit in SIZES and least != 0) else 0.0
        high = SPAN * value
    if q.unit == "rad":
        low, high = max(low, min(-2 * math.pi, value)), min(high, max(2 * math.pi, value))
    near = size / FAR, size * FAR
    low = least if least == 0 or near[0] <= abs(least) <= near[1] else max(low, least)
    high = most if most == 0 or near[0] <= abs(most) <= near[1] else min(high, most)
    return min(low, value), max(high, value)


def is_no_product(q: Quantity, value: float) -> bool:
    """Tell whether it is a product of inertia that vanishes, as those about principal axes do: few want to change it."""
    entry = OF_MATRIX.search(q.name)
    return value == 0 and q.unit == "kg.m^2" and entry is not None and entry[1] != entry[2]


def folded_last(sliders: Iterable[dict[str, object]]) -> list[dict[str, object]]:
    """Return the sliders, those that are folded away at the end."""
    return sorted(sliders, key=lambda s: "fold" in s)


def range_of_start(q: Quantity, value: float, reach: float) -> tuple[float, float]:
    """Return from where to where the start value of what reaches this far may go."""
    half = max(2 * abs(value), reach) or 1.0
    half = min(half, math.pi) if q.unit == "rad" and abs(value) <= math.pi else half
    low = q.minimum if q.minimum is not None and math.isfinite(q.minimum) else -half
    high = q.maximum if q.maximum is not None and math.isfinite(q.maximum) else half
    return min(low, value), max(high, value)


def slider(
    q: Quantity, index: int, value: float, ends: tuple[float, float], shown: tuple[str, float]
) -> dict[str, object]:
    """Return what a page is told of a slider; ``shown``: the unit and its value in SI."""
    return {
        "name": q.name,
        "index": index,
        "value": value,
        "min": min(short(ends[0]), value),
        "max": max(short(ends[1]), value),
        "shown": shown[0],
        "factor": shown[1],
        "doc": q.doc,
    }


def short(value: float) -> float:
    """Return a value to six digits: pages are short."""
    return float(f"{value:.6g}")


def _mesh(path: str) -> dict[str, Any]:
    """Return points, normals and triangles of a file, as the page draws them."""
    corners = drawn_triangles(path)
    normals: list[float] = []
    for a, b, c in corners:
        u, v = [y - x for x, y in zip(a, b, strict=True)], [y - x for x, y in zip(a, c, strict=True)]
        across = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
        size = math.sqrt(sum(x * x for x in across)) or 1.0
        normals += [float(f"{x / size:.3g}") for x in across] * 3
    return {
        "points": [float(f"{x:.6g}") for triangle in corners for corner in triangle for x in corner],
        "normals": normals,
        "index": list(range(3 * len(corners))),
    }


def _up(model: CompiledModel, size: int) -> list[float]:
    """Return the axis against which things fall: z of a picture in space, y of one in the plane, where no field says it."""
    system = model.compilation.system
    graph = system.graph
    for mass in system.masses:
        if mass.field is not None and all(graph.is_constant(n) for n in mass.field):
            numbers = [float(graph.value(n)) for n in mass.field]
            axis = max(range(len(numbers)), key=lambda k: abs(numbers[k]))
            if numbers[axis] < 0:
                return [1.0 if k == axis else 0.0 for k in range(3)]
    return [0.0, 0.0, 1.0] if size == 3 else [0.0, 1.0, 0.0]
