"""Warnings about texts that are right and probably not meant."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from mechc.lang import ast
from mechc.lang.units import Dimension, parse_unit

from ..names.instance import Instance, VariableMember
from ..names.scope import Flattening
from ..values.angles import hertz_for_angles, warn_of_degrees
from .inside import Inside

_ANGULAR = ("omega", "w", "spin", "Omega", "w0", "omega0")


def lint(instance: Instance, inside: Sequence[Inside]) -> None:
    """Warn of Hz used as an angular velocity, of degrees without unit, of units that are also names of like quantities."""
    flattening = instance.flattening
    variables = {
        name: member.type.dimension
        for name, member in instance.members.items()
        if len(name) <= 3 and isinstance(member, VariableMember) and member.type is not None
    }
    declarations = {
        name: member.declaration
        for name, member in instance.members.items()
        if isinstance(member, VariableMember) and isinstance(member.declaration, ast.Declaration)
    }
    for found in inside:
        if found.stated.model is not instance.cls.model:
            continue
        _angular_frequency(found.stated.statement, flattening)
        if not flattening.dimensionless:
            warn_of_degrees(found.calls, declarations, flattening.reporter)
        if variables:
            _unit_names(found.quantities, variables, flattening)


def _angular_frequency(statement: ast.Statement, flattening: Flattening) -> None:
    if not isinstance(statement, ast.Parameter) or not isinstance(statement.value, ast.Quantity):
        return
    if not statement.type and statement.name in _ANGULAR and statement.value.unit.endswith("Hz"):
        what = f"'{statement.name}' looks like an angular velocity"
        hertz_for_angles(statement.value.span, what, flattening.reporter)


def _unit_names(
    found: Iterable[ast.Quantity], variables: Mapping[str, Dimension], flattening: Flattening
) -> None:
    """Warn where dividing by the variable instead would give the same dimension, so that no check could tell."""
    for node in found:
        last = node.unit.rpartition("/")[2]
        if "/" in node.unit and last in variables and parse_unit(last).dimension == variables[last]:
            flattening.reporter.warning(
                "W0302",
                f"'{last}' is a unit here, and also a name of the model",
                node.span,
                caption=f"this is the quantity {node.text} {node.unit}",
                help=f"write '{node.text} {node.unit.rpartition('/')[0]} / {last}' to divide by the variable",
            )
