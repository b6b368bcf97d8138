"""Unit definitions of a model description."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree.ElementTree import Element, SubElement

from mechc.lang.units import BASE, parse_unit
from mechc.runtime.interface import Quantity


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
