"""The variables of a model description, read into one form for both versions."""

from __future__ import annotations

from xml.etree.ElementTree import Element

from msgspec import Struct


class Finding(Struct, frozen=True):
    """Something that is wrong with an FMU, and the name of the rule that it breaks."""

    rule: str
    text: str


class Described(Struct, frozen=True):
    """One variable; ``key``: what the model structure calls it by."""

    key: str
    reference: str
    name: str
    type: str
    causality: str
    variability: str
    initial: str
    start: str | None
    unit: str | None
    display: str | None
    derivative: str | None
    clocked: bool = False
    """Whether it has a value at ticks of clocks only."""


def read_variables(root: Element, version: int) -> list[Described]:
    """Return the variables of a model description, with defaults filled in."""
    found = []
    for index, element in enumerate(root.findall("ModelVariables/*"), start=1):
        typed = element if version == 3 else next(iter(c for c in element if c.tag != "Annotations"), element)
        causality = element.get("causality", "local")
        numeric = typed.tag in ("Real", "Float64", "Float32")
        usual = "continuous" if numeric else "discrete"
        if version == 3 and causality in ("parameter", "calculatedParameter", "structuralParameter"):
            usual = "fixed"
        variability = element.get("variability", usual)
        found.append(
            Described(
                key=str(index) if version == 2 else element.get("valueReference", ""),
                reference=element.get("valueReference", ""),
                name=element.get("name", ""),
                type=typed.tag,
                causality=causality,
                variability=variability,
                initial=element.get("initial", _usual_initial(causality, variability)),
                start=_nested_start(typed) if typed.tag in ("String", "Binary") else typed.get("start"),
                unit=typed.get("unit"),
                display=typed.get("displayUnit"),
                derivative=typed.get("derivative"),
                clocked=typed.get("clocks") is not None,
            )
        )
    return found


def _nested_start(element: Element) -> str | None:
    child = element.find("Start")
    return child.get("value") if child is not None else element.get("start")


def _usual_initial(causality: str, variability: str) -> str:
    if causality in ("parameter", "structuralParameter") or variability == "constant":
        return "exact"
    if causality in ("input", "independent"):
        return ""
    return "calculated"
