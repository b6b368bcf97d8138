"""Numbers and places of the interface, from what the language knows of them."""

from __future__ import annotations

from mechc.lang.source import Span
from mechc.lang.units import UnitError, parse_unit, preferred_unit
from mechc.runtime.interface import PURE, Origin, Quantity


def quantity(
    name: str,
    kind: str,
    unit: str,
    display: str = "",
    nominal: float | None = None,
    minimum: float | None = None,
    maximum: float | None = None,
    doc: str = "",
    span: Span | None = None,
    interpolation: str = "linear",
    type: str = "real",
) -> Quantity:
    """Return a number of an array, with its place in the source and how its unit is usually written."""
    return Quantity(
        name,
        kind,
        unit,
        display,
        nominal,
        minimum,
        maximum,
        doc,
        origin(span),
        interpolation,
        _usual(unit),
        type,
        _exponents(unit),
    )


def origin(span: Span | None) -> Origin | None:
    """Return a place in the source as plain data, with the text of its line."""
    if span is None:
        return None
    line, column = span.file.position(span.start)
    return Origin(span.file.name, line, column, span.file.line(line))


def _exponents(unit: str) -> tuple[str, ...]:
    """Return the exponents of the base units, as fractions; nothing for a pure number."""
    try:
        dimension = parse_unit(unit).dimension
    except UnitError:
        return ()
    return () if dimension.is_none else tuple(str(one) for one in dimension.exponents)


def _usual(unit: str) -> str:
    """Return how a unit is usually written, or nothing where it is."""
    if unit in PURE or "rad" in unit:
        return ""
    try:
        usual = preferred_unit(parse_unit(unit).dimension)
    except UnitError:  # a quotient that is made for a reader
        return ""
    return "" if usual == unit else usual
