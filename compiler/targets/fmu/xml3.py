"""The model description of FMI 3.0, and the description of how its sources are built."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement, indent, tostring

from .identity import CATEGORIES, DATE, Identity, tool
from .units import number, shown_unit, unit_definitions
from .variables import Table, Variable
from .xml2 import first_line


def write(identity: Identity, table: Table) -> str:
    """Return the text of ``modelDescription.xml``."""
    root = Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=identity.name,
        instantiationToken=identity.token,
        generationTool=tool(),
        generationDateAndTime=DATE,
        variableNamingConvention="structured",
    )
    if identity.doc.strip():
        root.set("description", first_line(identity.doc))
    common = {
        "modelIdentifier": identity.model_identifier,
        "canGetAndSetFMUState": "true",
        "canSerializeFMUState": "true",
        "providesDirectionalDerivatives": "true",
        "providesAdjointDerivatives": "true",
    }
    if "me" in identity.kinds:
        needed = "true" if identity.needs_completed_step else "false"
        SubElement(root, "ModelExchange", {**common, "needsCompletedIntegratorStep": needed})
    if "cs" in identity.kinds:
        SubElement(
            root,
            "CoSimulation",
            {
                **common,
                "canHandleVariableCommunicationStepSize": "true",
                "maxOutputDerivativeOrder": "0" if table.inputs_move else "1",
                "providesIntermediateUpdate": "true",
                "mightReturnEarlyFromDoStep": "true",
                "canReturnEarlyAfterIntermediateUpdate": "true",
                "hasEventMode": "true",
            },
        )
    unit_definitions(root, [v.entry for v in table.variables])
    categories = SubElement(root, "LogCategories")
    for name, doc in CATEGORIES.items():
        SubElement(categories, "Category", name=name, description=doc)
    SubElement(
        root,
        "DefaultExperiment",
        startTime=number(identity.start),
        stopTime=number(identity.stop),
        tolerance=number(identity.tolerance),
        stepSize=number(identity.step),
    )
    variables = SubElement(root, "ModelVariables")
    for variable in table.variables:
        _variable(variables, variable, table)
    structure = SubElement(root, "ModelStructure")
    for k in table.outputs:
        _unknown(structure, "Output", table, k, table.at(k).depends)
    for k in table.derivatives:
        _unknown(structure, "ContinuousStateDerivative", table, k, table.at(k).depends)
    for k in table.initial_unknowns:
        _unknown(structure, "InitialUnknown", table, k, table.at(k).initially)
    for k in table.indicators:
        _unknown(structure, "EventIndicator", table, k, None)
    return _text(root)


def build_description(identity: Identity) -> str:
    """Return the text of ``sources/buildDescription.xml``."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = SubElement(root, "BuildConfiguration", modelIdentifier=identity.model_identifier)
    files = SubElement(configuration, "SourceFileSet", language="C11")
    for name in identity.sources:
        SubElement(files, "SourceFile", name=name)
    SubElement(files, "IncludeDirectory", name=".")
    return _text(root)


def _text(root: Element) -> str:
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"


_ELEMENTS = {"real": "Float64", "integer": "Int32", "boolean": "Boolean"}


def _variable(parent: Element, variable: Variable, table: Table) -> None:
    entry = variable.entry
    attributes = {"name": variable.name, "valueReference": str(variable.reference)}
    if entry.doc.strip():
        attributes["description"] = first_line(entry.doc)
    attributes["causality"] = variable.causality
    attributes["variability"] = variable.variability
    if variable.initial:
        attributes["initial"] = variable.initial
    if variable.causality == "output" and not variable.derivative:
        attributes["intermediateUpdate"] = "true"
    if entry.unit:
        attributes["unit"] = entry.unit
        if shown_unit(entry):
            attributes["displayUnit"] = shown_unit(entry)
    for name, value in (("min", entry.minimum), ("max", entry.maximum), ("nominal", variable.nominal)):
        if value is not None:
            attributes[name] = number(value)
    if variable.start is not None:
        attributes["start"] = number(variable.start)
    if variable.derivative:
        attributes["derivative"] = str(table.at(variable.derivative).reference)
    if variable.reinit:
        attributes["reinit"] = "true"
    SubElement(parent, _ELEMENTS[entry.type], attributes)


def _unknown(parent: Element, title: str, table: Table, index: int, depends: frozenset[int] | None) -> None:
    attributes = {"valueReference": str(table.at(index).reference)}
    if depends is not None:
        attributes["dependencies"] = " ".join(str(table.at(k).reference) for k in sorted(depends))
    SubElement(parent, title, attributes)
