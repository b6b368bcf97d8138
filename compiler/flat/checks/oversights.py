"""Warnings about texts that are right and probably not meant: units and angles, what nothing uses, inputs that nothing sets."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from msgspec import Struct

from mechc.lang import ast
from mechc.lang.units import Dimension, parse_unit

from ..model import Experiment, Role
from ..names.classes import Stated
from ..names.instance import Instance, VariableMember
from ..names.scope import Flattening
from ..names.space import branches_of
from ..statements.record import StatementRecord
from ..values.angles import hertz_for_angles, warn_of_degrees


class Inside(Struct, frozen=True):
    """A statement, and the nodes in it that somebody looks at, in the order of the text."""

    stated: Stated
    references: list[ast.Reference]
    modifications: list[ast.Modification]
    calls: list[ast.Call]
    quantities: list[ast.Quantity]
    declared: list[ast.Parameter | ast.Input]


_PLACES: dict[type[ast.Node], int] = {
    ast.Reference: 0,
    ast.Modification: 1,
    ast.Call: 2,
    ast.Quantity: 3,
    ast.Parameter: 4,
    ast.Input: 4,
}
_rules: dict[type[ast.Node], tuple[int, tuple[str, ...]]] = {}
"""Where nodes of a kind are listed, -1 for nowhere, and the fields in which nodes may stand, last ones first."""


def inside_of(instance: Instance) -> Sequence[Inside]:
    """List the nodes of each statement of a model, inherited ones too."""
    return [inside(stated) for stated in instance.cls.statements]


def inside(stated: Stated) -> Inside:
    """List the nodes of a statement."""
    return Inside(stated, *listed(stated.statement))


def listed(node: ast.Node) -> tuple[list[Any], ...]:
    """List a node and what stands in it by the places of ``_PLACES``; much of the time of a large model is spent here."""
    found: tuple[list[Any], ...] = ([], [], [], [], [])
    pending = [node]
    while pending:
        at = pending.pop()
        place, branches = _rules.get(at.__class__) or _rule(at.__class__)
        if place >= 0:
            found[place].append(at)
        if place == 0:
            pending += [i for part in at.parts[::-1] for i in part.indices[::-1]]  # type: ignore[attr-defined]
            continue
        for name in branches:
            value = getattr(at, name)
            if value.__class__ is tuple:
                pending += [v for v in value[::-1] if isinstance(v, ast.Node)]
            elif isinstance(value, ast.Node):
                pending.append(value)
    return found


def _rule(kind: type[ast.Node]) -> tuple[int, tuple[str, ...]]:
    rule = _rules[kind] = (_PLACES.get(kind, -1), branches_of(kind)[::-1])
    return rule


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


_SUBSCRIPT = re.compile(r"\[\d+(, ?\d+)*\]")


def warn_of_unused(instance: Instance, inside: Sequence[Inside]) -> None:
    """Warn of parameters and inputs that the model declares itself and that none of its statements names.

    What is said under conditions counts, whether they hold or not. Bases and components are not asked: those of a
    library offer more than each of their users needs. The parameters of a shape are for its contacts.
    """
    if instance.cls.model.shape:
        return
    used = {name for found in inside for name in _names(found.references, found.modifications)}
    for inherited in instance.cls.inherited:
        references, modifications, *_ = listed(inherited.modification)
        used.update(_names(references, modifications))
    for found in inside:
        if found.stated.model is not instance.cls.model:
            continue
        for node in found.declared:
            if node.name in used:
                continue
            word = "parameter" if isinstance(node, ast.Parameter) else "input"
            instance.flattening.reporter.warning(
                "W0402",
                f"nothing uses the {word} '{node.name}'",
                node.name_span,
                caption="its value changes nothing",
                help="use it in a statement of the model, or remove it",
            )


def warn_of_unset(instance: Instance, record: StatementRecord, experiments: Sequence[Experiment]) -> None:
    """Warn of inputs of components without a default that the model and its experiments give no value; once for an array of
    components. Those of the model itself are what it asks from outside.
    """
    told = {s.target for e in experiments for s in e.settings}
    told.update(s.target for e in experiments for s in e.sweeps)
    for member in record.variables:
        if member.role is not Role.INPUT or member.value is not None or member.scope.instance is instance:
            continue
        of_all = _SUBSCRIPT.sub("", member.name)
        if member.name in told or of_all in told:
            continue
        told.add(of_all)
        component, _, name = of_all.rpartition(".")
        instance.flattening.reporter.warning(
            "W0403",
            f"nothing here gives the input '{of_all}' a value: it is 0 unless a run sets it",
            member.scope.origin(member.declaration.span).shown,
            help=f"write '{name} = …' where '{component}' is declared; for a value from outside, give the model an input: 'input {name};' and '{name} = {name}'",
        )


def _names(references: Iterable[ast.Reference], modifications: Iterable[ast.Modification]) -> Iterator[str]:
    """Yield the first parts of references; what a modification or an experiment sets is not used by that."""
    set_by = {id(m.target) for m in modifications if m.kind != "->"}
    for reference in references:
        if id(reference) not in set_by:
            yield reference.parts[0].name
