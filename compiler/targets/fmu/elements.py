"""Elements that both versions of the model description have, and XML as text."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from mechc.lang.units import BASE, parse_unit
from mechc.runtime.interface import Quantity

from .identity import CATEGORIES, DATE, Identity, tool
from .variables import FmuVariable, VariableTable


def root_of(identity: Identity, version: str, token: str, **further: str) -> Element:
    """Return the root; ``token`` is the name that the version has for the token, ``further`` its own attributes."""
    root = Element(
        "fmiModelDescription",
        {
            "fmiVersion": version,
            "modelName": identity.name,
            token: identity.token,
            "generationTool": tool(),
            "generationDateAndTime": DATE,
            "variableNamingConvention": "structured",
            **further,
        },
    )
    if identity.doc.strip():
        root.set("description", first_line(identity.doc))
    return root


def interfaces(
    root: Element,
    identity: Identity,
    table: VariableTable,
    *,
    both: Mapping[str, str],
    exchange: Mapping[str, str],
    simulation: Mapping[str, str],
) -> list[Element]:
    """Append the interfaces and return them: with the attributes of the version for both, and for either."""
    common = {"modelIdentifier": identity.model_identifier, **both}
    found = []
    if "me" in identity.kinds:
        found.append(SubElement(root, "ModelExchange", {**common, **exchange}))
    if "cs" in identity.kinds:
        steps = {
            "canHandleVariableCommunicationStepSize": "true",
            "maxOutputDerivativeOrder": "0" if table.inputs_move else "1",
        }
        found.append(SubElement(root, "CoSimulation", {**common, **steps, **simulation}))
    return found


def definitions(root: Element, identity: Identity, table: VariableTable) -> None:
    """Append what stands between the interfaces and the variables: units, categories of messages, the experiment."""
    unit_definitions(root, [v.entry for v in table.variables])
    log_categories(root)
    default_experiment(root, identity)


def truth(value: bool) -> str:
    return "true" if value else "false"


def text_of(root: Element) -> str:
    """Return a document as text, indented."""
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"


def first_line(doc: str) -> str:
    """Return a description on one line."""
    return " ".join(doc.split())


def log_categories(root: Element) -> None:
    """Append the categories of messages."""
    categories = SubElement(root, "LogCategories")
    for name, doc in CATEGORIES.items():
        SubElement(categories, "Category", name=name, description=doc)


def default_experiment(root: Element, identity: Identity) -> None:
    """Append the default experiment."""
    SubElement(
        root,
        "DefaultExperiment",
        startTime=number(identity.start),
        stopTime=number(identity.stop),
        tolerance=number(identity.tolerance),
        stepSize=number(identity.step),
    )


def description_of(variable: FmuVariable, name: str) -> dict[str, str]:
    """Return the attributes that say what a variable is, under its ``name``."""
    attributes = {"name": name, "valueReference": str(variable.reference)}
    if variable.entry.doc.strip():
        attributes["description"] = first_line(variable.entry.doc)
    attributes["causality"] = variable.causality
    attributes["variability"] = variable.variability
    if variable.initial:
        attributes["initial"] = variable.initial
    return attributes


def range_of(variable: FmuVariable, nominal: float | None) -> dict[str, str]:
    """Return the attributes of unit, limits and nominal value, as far as its type has them."""
    entry = variable.entry
    attributes: dict[str, str] = {}
    if entry.type == "boolean":
        return attributes
    if entry.unit:
        attributes["unit"] = entry.unit
        if shown_unit(entry):
            attributes["displayUnit"] = shown_unit(entry)
    for name, value in (("min", entry.minimum), ("max", entry.maximum), ("nominal", nominal)):
        if value is not None and (name != "nominal" or entry.type == "real"):
            attributes[name] = value_text(variable, value)
    return attributes


def value_text(variable: FmuVariable, value: float) -> str:
    """Write a value as the type of its variable wants it."""
    match variable.entry.type:
        case "integer":
            return str(round(value))
        case "boolean":
            return "true" if value else "false"
        case _:
            return number(value)


def number(value: float) -> str:
    """Write a number so that reading it gives the same number."""
    return repr(float(value))


def shown_unit(entry: Quantity) -> str:
    """Return the display unit where it is another unit of the same dimension, else an empty text."""
    if not entry.display or not entry.unit or entry.display == entry.unit:
        return ""
    return entry.display


def unit_definitions(parent: Element, entries: Iterable[Quantity]) -> None:
    """Append one ``Unit`` for each unit in use, with its display units."""
    displays: dict[str, set[str]] = {}
    for entry in entries:
        if entry.unit:
            found = displays.setdefault(entry.unit, set())
            if shown_unit(entry):
                found.add(shown_unit(entry))
    if not displays:
        return
    top = SubElement(parent, "UnitDefinitions")
    for text in sorted(displays):
        unit = parse_unit(text)
        element = SubElement(top, "Unit", name=text)
        exponents = dict(zip(BASE, unit.dimension.exponents, strict=True))
        if all(e == int(e) for e in exponents.values()):
            written = {name: str(int(e)) for name, e in exponents.items() if e}
            if unit.angle:
                written["rad"] = "-1" if "/rad" in text else "1"
            if unit.factor != 1:
                written["factor"] = number(float(unit.factor))
            SubElement(element, "BaseUnit", written)
        for display in sorted(displays[text]):
            factor = float(unit.factor / parse_unit(display).factor)
            SubElement(element, "DisplayUnit", name=display, factor=number(factor))
