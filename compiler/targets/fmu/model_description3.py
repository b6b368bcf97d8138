"""The model description of FMI 3.0, and the description of how its sources are built."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.etree.ElementTree import Element, SubElement

from .arrays import Group
from .elements import definitions, description_of, interfaces, range_of, root_of, text_of, truth, value_text
from .identity import Identity
from .variables import FmuVariable, VariableTable


def write(identity: Identity, table: VariableTable, groups: Sequence[Group]) -> str:
    """Return the text of ``modelDescription.xml``; ``groups`` are its variables, arrays among them."""
    root = root_of(identity, "3.0", "instantiationToken")
    both = {
        "canGetAndSetFMUState": "true",
        "canSerializeFMUState": "true",
        "providesDirectionalDerivatives": "true",
        "providesAdjointDerivatives": "true",
    }
    exchange = {"needsCompletedIntegratorStep": truth(identity.needs_completed_step)}
    simulation = {
        "providesIntermediateUpdate": "true",
        "mightReturnEarlyFromDoStep": "true",
        "canReturnEarlyAfterIntermediateUpdate": "true",
        "hasEventMode": "true",
    }
    interfaces(root, identity, table, both=both, exchange=exchange, simulation=simulation)
    definitions(root, identity, table)
    variables = SubElement(root, "ModelVariables")
    for group in groups:
        _variable(variables, group, table)
    structure = SubElement(root, "ModelStructure")
    own = {k: group for group in groups for k in group.members}
    for title, unknowns, knowns in (
        ("Output", table.outputs, [v.depends for v in table.variables]),
        ("ContinuousStateDerivative", table.derivatives, [v.depends for v in table.variables]),
        ("InitialUnknown", table.initial_unknowns, [v.initially for v in table.variables]),
        ("EventIndicator", table.indicators, [None] * len(table.variables)),
    ):
        for group in dict.fromkeys(own[k] for k in unknowns):
            _unknown(structure, title, table, group, [knowns[k - 1] for k in group.members], own)
    return text_of(root)


def build_description(identity: Identity) -> str:
    """Return the text of ``sources/buildDescription.xml``."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = SubElement(root, "BuildConfiguration", modelIdentifier=identity.model_identifier)
    files = SubElement(configuration, "SourceFileSet", language="C11")
    for name in identity.sources:
        SubElement(files, "SourceFile", name=name)
    SubElement(files, "IncludeDirectory", name=".")
    return text_of(root)


_ELEMENTS = {"real": "Float64", "integer": "Int32", "boolean": "Boolean"}


def _variable(parent: Element, group: Group, table: VariableTable) -> None:
    members = [table.at(k) for k in group.members]
    variable = members[0]
    attributes = description_of(variable, group.name)
    if variable.causality == "output" and not variable.derivative:
        attributes["intermediateUpdate"] = "true"
    attributes |= range_of(variable, _nominal(members))
    if variable.start is not None:
        attributes["start"] = " ".join(value_text(v, v.start) for v in members if v.start is not None)
    if variable.derivative:
        attributes["derivative"] = str(table.at(variable.derivative).reference)
    if variable.reinit:
        attributes["reinit"] = "true"
    element = SubElement(parent, _ELEMENTS[variable.entry.type], attributes)
    for size in group.shape:
        SubElement(element, "Dimension", start=str(size))


def _nominal(members: Sequence[FmuVariable]) -> float | None:
    """Return the nominal value of an array, which has one only: the largest of its elements."""
    return max((v.nominal for v in members if v.nominal is not None), default=None)


def _unknown(
    parent: Element,
    title: str,
    table: VariableTable,
    group: Group,
    depends: Sequence[frozenset[int] | None],
    own: Mapping[int, Group],
) -> None:
    """Write an unknown with all that one of its elements depends on, where that is known of each."""
    attributes = {"valueReference": str(table.at(group.members[0]).reference)}
    known = [d for d in depends if d is not None]
    if len(known) == len(depends):
        firsts = {own[k].members[0] for k in frozenset().union(*known)}
        attributes["dependencies"] = " ".join(str(table.at(k).reference) for k in sorted(firsts))
    SubElement(parent, title, attributes)
