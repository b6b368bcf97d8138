"""Elements that both versions of the model description have, and XML as text."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement, indent, tostring

from .identity import CATEGORIES, Identity
from .units import number, shown_unit
from .variables import Variable


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


def description_of(variable: Variable, name: str) -> dict[str, str]:
    """Return the attributes that say what a variable is, under its ``name``."""
    attributes = {"name": name, "valueReference": str(variable.reference)}
    if variable.entry.doc.strip():
        attributes["description"] = first_line(variable.entry.doc)
    attributes["causality"] = variable.causality
    attributes["variability"] = variable.variability
    if variable.initial:
        attributes["initial"] = variable.initial
    return attributes


def range_of(variable: Variable, nominal: float | None) -> dict[str, str]:
    """Return the attributes of unit, limits and nominal value."""
    entry = variable.entry
    attributes: dict[str, str] = {}
    if entry.unit:
        attributes["unit"] = entry.unit
        if shown_unit(entry):
            attributes["displayUnit"] = shown_unit(entry)
    for name, value in (("min", entry.minimum), ("max", entry.maximum), ("nominal", nominal)):
        if value is not None:
            attributes[name] = number(value)
    return attributes
