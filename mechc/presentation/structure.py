"""The text of ``mechc check --structure``: bodies, joints, loops and degrees of freedom in mechanical words."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..compiler.flat.model import Literal, Role
from .numbers import plural
from .style import PLAIN, Style, pad, width

if TYPE_CHECKING:
    from ..compiler.mechanics.system import MechanicalSystem
    from ..lang.source import Span
    from ..model import CompiledModel


SWITCHING = {
    "contact": ("contact", "counted as open"),
    "friction": ("friction", "counted as sliding"),
    "freewheel": ("friction", "counted as sliding"),
}
"""Words for rows that hold at times only, by kind of mode; they take no freedom away for good."""


def structure(model: CompiledModel, style: Style = PLAIN) -> str:
    """Return what moves, what holds it, and how many freedoms are left, for the default parameters.

    The number of freedoms is that of the velocities less the independent equations, so it is right where a count of
    joints is not. A nonholonomic constraint takes a freedom of the velocities, but no position.
    """
    system, equations = model.compilation.system, model.compilation.equations
    rows = [(label, text) for label, text in _rows(model, system)]
    column = max(width(label) for label, _ in rows)
    free = equations.nv - len(equations.constraints)
    positions = equations.nv - sum(c.level == "position" for c in equations.constraints)
    rows.append(
        ("degrees of freedom", str(free) + (f", {positions} of positions" if positions != free else ""))
    )
    column = max(column, width("degrees of freedom"))
    lines = [f"  {style.cyan(pad(label, column))}  {text}" for label, text in rows]
    return "\n".join([style.bold(model.name), *lines])


def _rows(model: CompiledModel, system: MechanicalSystem) -> Iterator[tuple[str, str]]:
    equations = model.compilation.equations
    origins = [*(m.origin for m in system.masses), *(i.origin for i in system.inertias)]
    bodies = dict.fromkeys(origin.instance for origin in origins)
    own = sum(x.origin.instance == "" for x in system.masses)
    named = [name for name in bodies if name]
    if bodies:
        parts = [*named, *([plural(own, "mass", "masses") + " of the model itself"] if own else [])]
        yield "bodies", f"{len(named) + own}: {', '.join(parts)}"
    if bodies and all(mass.gravity is None for mass in system.model.masses):
        yield "gravity", "none"
    if left := _left_to_the_library(system):
        yield "by default", ", ".join(left)
    for edge in system.topology.tree:
        count = sum(s.variable.name in edge.joint.coordinates for s in system.v)
        driven = sum(
            system.v[i].variable.name in edge.joint.coordinates for row in system.drives for i in row.v
        )
        words = plural(count, "freedom") + (f", {driven} prescribed" if driven else "")
        yield f"joint {edge.joint.name}", words
    others = [s for s in system.v if not any(s.variable.name in j.coordinates for j in system.model.joints)]
    if others:
        names = dict.fromkeys(s.variable.name for s in others)
        yield "other coordinates", f"{plural(len(others), 'freedom')}: {', '.join(names)}"
    prescribed = sum(len(row.v) for row in system.drives)
    if prescribed:
        yield "prescribed", plural(prescribed, "motion")
    stated: dict[str, int] = {}
    lasting = [row for row in system.constraints if row.mode is None]
    for row in lasting:
        stated[row.name] = stated.get(row.name, 0) + len(row.residuals)
    closing = {joint.name for joint in system.topology.closures}
    levels = {row.name: row.level for row in lasting}
    for name, count in stated.items():
        titles = {name, *(f"{name}[{k}]" for k in range(1, count + 1))}
        rank = sum(entry.name in titles for entry in equations.constraints)
        what = "loop closed by" if name in closing else "constraint"
        words = plural(count, "equation")
        if rank < count:
            words += f", {rank} independent"
        if levels[name] == "velocity":
            words += " between velocities"
        yield f"{what} {name}", words
    if stated:
        yield "equations", f"{sum(stated.values())}, rank {len(equations.constraints)}"
    switching = {row.name: row.mode.kind for row in system.constraints if row.mode is not None}
    for name, kind in switching.items():
        what, words = SWITCHING.get(kind, ("switching", "not counted"))
        yield f"{what} {name}", words


def _left_to_the_library(system: MechanicalSystem) -> list[str]:
    """Return the sizes of parts that nobody stated: those that the library gives them, such as ``upper.l = 1 m``."""
    return [
        f"{variable.name} = {variable.value.span.text}"
        for variable in system.model.variables
        if variable.role is Role.PARAMETER
        and variable.value is not None
        and variable.origin.declared is not None
        and not variable.type.dimension.is_none
        and _is_within(variable.value.span, variable.origin.span)
        and isinstance(variable.value, Literal)
        and variable.value.value
    ]


def _is_within(value: Span, declaration: Span) -> bool:
    """Whether a value is that of the declaration itself, not one that the text around the part gives."""
    return value.file is declaration.file and declaration.start <= value.start < declaration.end
