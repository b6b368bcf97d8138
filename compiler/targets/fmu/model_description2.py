"""The model description of FMI 2.0."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

from mechc.runtime.interface import derived_among

from .elements import definitions, description_of, interfaces, range_of, root_of, text_of, truth, value_text
from .identity import Identity
from .variables import FmuVariable, VariableTable


def write(identity: Identity, table: VariableTable) -> str:
    """Return the text of ``modelDescription.xml``."""
    root = root_of(identity, "2.0", "guid", numberOfEventIndicators=str(len(table.indicators)))
    both = {
        "canNotUseMemoryManagementFunctions": "true",
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "true",
        "providesDirectionalDerivative": "true",
    }
    # the inverse of the attribute of FMI 3
    exchange = {"completedIntegratorStepNotNeeded": truth(not identity.needs_completed_step)}
    simulation = {"canInterpolateInputs": "true"} if _all_drive(table) else {}
    for element in interfaces(root, identity, table, both=both, exchange=exchange, simulation=simulation):
        _sources(element, identity)
    definitions(root, identity, table)
    variables = SubElement(root, "ModelVariables")
    for variable in table.variables:
        # event indicators are not variables in this version
        if variable.index not in table.indicators:
            _variable(variables, variable, "me" in identity.kinds)
    _structure(root, table)
    return text_of(root)


def _all_drive(table: VariableTable) -> bool:
    """Tell whether all inputs drive coordinates, or are derivatives of such: these go on during a step."""
    inputs = [v.entry.name for v in table.variables if v.causality == "input"]
    return bool(inputs) and 3 * len(derived_among(inputs)) == len(inputs)


def _sources(element: Element, identity: Identity) -> None:
    files = SubElement(element, "SourceFiles")
    for name in identity.sources:
        SubElement(files, "File", name=name)


_ELEMENTS = {"real": "Real", "integer": "Integer", "boolean": "Boolean"}


def _variable(parent: Element, variable: FmuVariable, exchange: bool) -> None:
    element = SubElement(parent, "ScalarVariable", description_of(variable, variable.name))
    real = range_of(variable, variable.nominal)
    if variable.start is not None:
        real["start"] = value_text(variable, variable.start)
    if variable.derivative:
        real["derivative"] = str(variable.derivative)
    if variable.reinit and exchange:
        real["reinit"] = "true"
    SubElement(element, _ELEMENTS[variable.entry.type], real)


def _structure(root: Element, table: VariableTable) -> None:
    structure = SubElement(root, "ModelStructure")
    for title, indices in (("Outputs", table.outputs), ("Derivatives", table.derivatives)):
        if indices:
            group = SubElement(structure, title)
            for k in indices:
                _unknown(group, table, k, table.at(k).depends)
    if table.initial_unknowns:
        group = SubElement(structure, "InitialUnknowns")
        for k in table.initial_unknowns:
            variable = table.at(k)
            _unknown(group, table, k, variable.initially, at_start=True)


def _unknown(
    parent: Element,
    table: VariableTable,
    index: int,
    depends: frozenset[int] | None,
    *,
    at_start: bool = False,
) -> None:
    """Write an unknown; FMI 2 counts parameters among the knowns of the initial values only."""
    attributes = {"index": str(index)}
    if depends is not None:
        listed = [k for k in sorted(depends) if at_start or table.at(k).causality != "parameter"]
        attributes["dependencies"] = " ".join(map(str, listed))
    SubElement(parent, "Unknown", attributes)
