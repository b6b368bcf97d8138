"""Mass, centre, inertia tensor and principal axes of bodies and of all together, where they are at a state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from ...case import Case, find_experiment, inputs_at, prepare
from ...functions import load_functions
from ...outcome import Outcome, SimulationError
from ...problem import Array, Problem
from ...settings import settable
from ..findings import Cell, Curve, Findings, Panel, Table, Value
from ..formulas.combination import stop_of
from ..study import OF_A_MOTION, Study

ROUNDING = 1e-12
"""Of the largest moment: below that a product of inertia is none, and a triangle inequality is not broken."""


class Body(Struct, frozen=True, eq=False):
    """A rigid body, or several together: mass, place of the mass centre, tensor about it in the axes of the world."""

    name: str
    mass: float
    centre: Array
    tensor: Array

    def about(self, point: Array) -> Array:
        """Return the tensor about a point (parallel axes)."""
        d = self.centre - point
        if len(d) == 2:
            return self.tensor + self.mass * float(d @ d)
        result: Array = self.tensor + self.mass * (float(d @ d) * np.eye(3) - np.outer(d, d))
        return result


class InertiaOf(Study, frozen=True, kw_only=True):
    """Inertia of each body and of the whole model at the start, about the mass centre and about a point."""

    of_past = True
    unused = OF_A_MOTION
    needs = frozenset({"matter"})
    about: Annotated[
        str,
        settable(
            "A point by its coordinates, as '0, 0, 50 cm'; bare numbers are metres (default: the origin).",
            "point",
        ),
    ] = ""

    def solve(self, problem: Problem) -> Findings:
        """Sum over all masses. Raises SimulationError where there are none."""
        if not problem.matter:
            raise SimulationError(
                f"'{problem.name}' has no masses",
                help="declare bodies, as in 'Box b;', or 'mass m at frame;' and 'inertia J on frame;'",
            )
        functions = load_functions(problem)
        says = stop_of(find_experiment(problem, self.experiment), self)
        case = prepare(problem, functions, self if says else replace(self, stop=self.start or 0.0))
        bodies = bodies_of(case)
        whole = together("all together", bodies)
        size = len(whole.centre)
        point = _point(self.about, size)
        told = [*bodies, whole] if len(bodies) > 1 else bodies
        tables = [_masses(told, size)]
        details: dict[str, Any] = {
            "bodies": [_plain(body, point) for body in bodies],
            "total": _plain(whole, point),
        }
        remarks = [f"{body.name}: {text}" for body in told for text in judged(body)]
        if size == 3:
            tables += [_tensors(told, point), _principal(told, point)]
        else:
            tables.append(
                Table(
                    "moments of inertia",
                    (("body", ""), ("about the centre", "kg.m^2"), ("about the point", "kg.m^2")),
                    tuple((b.name, float(b.tensor[0, 0]), float(b.about(point)[0, 0])) for b in told),
                )
            )
        error = ROUNDING * max(float(np.abs(whole.tensor).max()), 1e-300)
        return Findings(
            study="inertia",
            model=problem.name,
            outcome=Outcome.COMPLETED,
            message=f"{len(bodies)} bod{'y' if len(bodies) == 1 else 'ies'}, {whole.mass:.6g} kg",
            values=(
                Value("mass", "kg", whole.mass, 1e-15 * abs(whole.mass)),
                *(
                    Value(f"centre.{'xyz'[k]}", "m", float(x), 1e-15 * max(1.0, abs(float(x))))
                    for k, x in enumerate(whole.centre)
                ),
            ),
            errors_from=f"rounding; tensors to {error:.1e} kg.m^2",
            remarks=tuple(remarks),
            tables=tuple(tables),
            panels=(_panel(told),),
            details=details,
        )


def bodies_of(case: Case) -> list[Body]:
    """Return the bodies of a case at its start: masses and inertias of one instance belong together."""
    problem = case.problem
    assert case.functions.matter is not None, "the part matter"
    numbers = case.functions.matter(case.begin, case.y0, inputs_at(case, case.begin), case.z, case.p)
    masses = sum(q.kind == "mass" for q in problem.matter)
    planar = len(numbers) == 3 * masses + len(problem.matter) - masses
    points: dict[str, list[tuple[float, Array]]] = {}
    tensors: dict[str, Array] = {}
    size, place = (2 if planar else 3), 0
    for quantity in problem.matter:
        name = quantity.name
        if quantity.kind == "mass":
            points.setdefault(name, []).append((float(numbers[place]), numbers[place + 1 : place + 1 + size]))
            place += 1 + size
            continue
        width = 1 if planar else 9
        own = numbers[place : place + width].reshape(1 if planar else 3, -1)
        tensors[name] = tensors.get(name, 0.0) + own
        place += width
    found = []
    for name in dict.fromkeys([*points, *tensors]):
        zero = np.zeros((1, 1)) if planar else np.zeros((3, 3))
        particles = [Body(name, m, x, zero) for m, x in points.get(name, [])]
        body = together(name, particles) if particles else Body(name, 0.0, np.zeros(size), zero)
        found.append(replace(body, tensor=body.tensor + tensors.get(name, zero)))
    return found


def together(name: str, bodies: Sequence[Body]) -> Body:
    """Return several bodies as one."""
    mass = sum(body.mass for body in bodies)
    size = len(bodies[0].centre)
    centre = sum((body.mass * body.centre for body in bodies), np.zeros(size)) / (mass or 1.0)
    tensor = sum((body.about(centre) for body in bodies[1:]), bodies[0].about(centre))
    return Body(name, mass, centre, tensor)


def principal(tensor: Array) -> tuple[Array, Array]:
    """Return the principal moments, smallest first, and the axes as columns, each with its largest entry positive."""
    moments, axes = np.linalg.eigh(0.5 * (tensor + tensor.T))
    signs = np.sign(axes[np.abs(axes).argmax(axis=0), range(axes.shape[1])])
    return moments, axes * np.where(signs == 0, 1.0, signs)


def judged(body: Body) -> list[str]:
    """Say what the moments are like: a sphere's, a symmetric top's; and whether a body can have them at all."""
    if body.tensor.shape != (3, 3):
        return ["the moment of inertia is negative"] if body.tensor[0, 0] < 0 else []
    moments, _ = principal(body.tensor)
    small = ROUNDING * float(np.abs(moments).max(initial=0.0)) * 100
    if float(np.abs(moments).max(initial=0.0)) == 0.0:
        return []
    low, middle, high = (float(m) for m in moments)
    found = []
    if low + middle < high - small or low < -small:
        found.append("no body has such moments: the largest exceeds the sum of the others")
    elif abs(low + middle - high) <= small:
        found.append("flat: the largest moment is the sum of the others")
    if high - low <= small:
        found.append("spherical top: all axes are principal")
    elif middle - low <= small or high - middle <= small:
        found.append("symmetric top: two moments are equal, and the axes to them are free in their plane")
    return found


def _point(text: str, size: int) -> Array:
    if not text:
        return np.zeros(size)
    try:
        found = np.array([float(part) for part in text.replace("{", "").replace("}", "").split(",")])
    except ValueError:
        found = np.empty(0)
    if len(found) != size:
        raise SimulationError(
            f"the point '{text}' is {size} numbers in metres, as in '{', '.join(['0'] * size)}'"
        )
    return found


def _masses(told: Sequence[Body], size: int) -> Table:
    return Table(
        "masses",
        (("body", ""), ("mass", "kg"), *((f"centre {'xyz'[k]}", "m") for k in range(size))),
        tuple((b.name, b.mass, *(float(x) for x in b.centre)) for b in told),
    )


def _tensors(told: Sequence[Body], point: Array) -> Table:
    heads = ("xx", "yy", "zz", "xy", "yz", "zx")
    rows: list[tuple[Cell, ...]] = []
    for body in told:
        for what, tensor in (("centre", body.tensor), ("point", body.about(point))):
            entries = [tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[1, 2], tensor[2, 0]]
            rows.append((f"{body.name}, about the {what}", *(float(x) + 0.0 for x in entries)))
    return Table(
        "inertia tensors in the axes of the world",
        (("body", ""), *((h, "kg.m^2") for h in heads)),
        tuple(rows),
    )


def _principal(told: Sequence[Body], point: Array) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for body in told:
        for what, tensor in (("centre", body.tensor), ("point", body.about(point))):
            moments, axes = principal(tensor)
            name = f"{body.name}, about the {what}"
            rows += [(name, float(m), *(float(x) + 0.0 for x in axes[:, k])) for k, m in enumerate(moments)]
    return Table(
        "principal moments",
        (("body", ""), ("moment", "kg.m^2"), ("axis x", ""), ("y", ""), ("z", "")),
        tuple(rows),
    )


def _plain(body: Body, point: Array) -> dict[str, Any]:
    moments, axes = principal(body.tensor)
    at_point, turned = principal(body.about(point))
    return {
        "name": body.name,
        "mass": body.mass,
        "centre": body.centre.tolist(),
        "tensor": body.tensor.tolist(),
        "principal": moments.tolist(),
        "axes": axes.T.tolist(),
        "point": point.tolist(),
        "tensor_about_point": body.about(point).tolist(),
        "principal_about_point": at_point.tolist(),
        "axes_about_point": turned.T.tolist(),
    }


def _panel(told: Sequence[Body]) -> Panel:
    """Draw where the masses are, seen along z, with the principal axes of the whole as long as its radii of gyration."""
    curves = [Curve(b.name, b.centre[:1], b.centre[1:2], style="points") for b in told]
    whole = told[-1]
    if whole.tensor.shape == (3, 3) and whole.mass:
        moments, axes = principal(whole.tensor)
        for k, moment in enumerate(moments):
            reach = np.sqrt(max(float(moment), 0.0) / abs(whole.mass))
            ends = np.array([whole.centre - reach * axes[:, k], whole.centre + reach * axes[:, k]])
            curves.append(Curve(f"axis {k + 1}", ends[:, 0], ends[:, 1]))
    return Panel(
        "principal axes",
        "x",
        "m",
        "y",
        "m",
        tuple(curves),
        equal=True,
    )
