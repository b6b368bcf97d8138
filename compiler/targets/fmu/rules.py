"""Rules of the standard for a model description, beside what fmpy's validation finds.

Each rule yields sentences. Variables are read into one form for both versions.
"""

from __future__ import annotations

import re
import zipfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

_SIMPLE = r"[A-Za-z_][A-Za-z0-9_]*(?:\[\d+(?:,\d+)*\])?"
_QUOTED = r"'(?:[^'\\]|\\.)+'(?:\[\d+(?:,\d+)*\])?"
_PATH = rf"(?:{_SIMPLE}|{_QUOTED})(?:\.(?:{_SIMPLE}|{_QUOTED}))*"
_STRUCTURED = re.compile(rf"(?:{_PATH}|der\({_PATH}(?:,\d+)?\))")

_DISCRETE = {
    "Integer",
    "Boolean",
    "String",
    "Enumeration",
    "Int8",
    "UInt8",
    "Int16",
    "UInt16",
    "Int32",
    "UInt32",
}
_DISCRETE |= {"Int64", "UInt64", "Binary", "Clock"}

_LEGAL = {
    "parameter": {"fixed", "tunable"},
    "structuralParameter": {"fixed", "tunable"},
    "calculatedParameter": {"fixed", "tunable"},
    "input": {"discrete", "continuous"},
    "output": {"constant", "discrete", "continuous"},
    "local": {"constant", "fixed", "tunable", "discrete", "continuous"},
    "independent": {"continuous"},
}
_ORDER = {
    2: "ModelExchange CoSimulation UnitDefinitions TypeDefinitions LogCategories DefaultExperiment "
    "VendorAnnotations ModelVariables ModelStructure",
    3: "ModelExchange CoSimulation ScheduledExecution UnitDefinitions TypeDefinitions LogCategories "
    "DefaultExperiment ModelVariables ModelStructure Annotations",
}


@dataclass(frozen=True, slots=True)
class Described:
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


def check_file(path: Path) -> list[str]:
    """Return what is wrong with an FMU: fmpy's findings, then those of the rules; nothing if it is right."""
    try:
        with zipfile.ZipFile(path) as archive:
            text = archive.read("modelDescription.xml")
    except (OSError, zipfile.BadZipFile, KeyError) as error:
        return [f"the file is no FMU: {error}"]
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        return [f"modelDescription.xml is no XML: {error}"]
    return list(dict.fromkeys([*_by_fmpy(path), *check_description(root)]))


def _by_fmpy(path: Path) -> list[str]:
    from fmpy.validation import validate_fmu

    try:
        return [str(p) for p in validate_fmu(str(path))]
    except Exception as error:  # fmpy raises plain exceptions of many kinds for a file that is wrong
        return [str(error)]


def check_description(root: Element) -> list[str]:
    """Return the findings of the rules for a model description."""
    version = 2 if root.get("fmiVersion", "").startswith("2") else 3
    variables = read_variables(root, version)
    return [
        *_order(root, version),
        *_names(root, variables),
        *_references(variables, version),
        *_units(root, variables),
        *_attributes(variables, version),
        *_structure(root, variables, version),
    ]


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
                start=typed.get("start") if typed.tag != "String" else _string_start(typed),
                unit=typed.get("unit"),
                display=typed.get("displayUnit"),
                derivative=typed.get("derivative"),
            )
        )
    return found


def _string_start(element: Element) -> str | None:
    child = element.find("Start")
    return child.get("value") if child is not None else element.get("start")


def _usual_initial(causality: str, variability: str) -> str:
    if causality in ("parameter", "structuralParameter") or variability == "constant":
        return "exact"
    if causality in ("input", "independent"):
        return ""
    return "calculated"


def _order(root: Element, version: int) -> Iterator[str]:
    order = _ORDER[version].split()
    tags = [child.tag for child in root]
    for tag in tags:
        if tag not in order:
            yield f"<{tag}> is no element of a model description of FMI {version}"
    known = [order.index(tag) for tag in tags if tag in order]
    if known != sorted(known):
        yield "the elements of the model description are in the wrong order"


def _names(root: Element, variables: list[Described]) -> Iterator[str]:
    for name, count in Counter(v.name for v in variables).items():
        if count > 1:
            yield f"the name '{name}' is given to {count} variables"
    if root.get("variableNamingConvention") == "structured":
        for v in variables:
            if not _STRUCTURED.fullmatch(v.name):
                yield f"the name '{v.name}' does not follow the structured naming convention"


def _references(variables: list[Described], version: int) -> Iterator[str]:
    groups: dict[tuple[str, str], list[Described]] = {}
    for v in variables:
        groups.setdefault((v.type if version == 2 else "", v.reference), []).append(v)
    for (_, reference), group in groups.items():
        names = ", ".join(f"'{v.name}'" for v in group)
        if len(group) > 1 and version == 3:
            yield f"the value reference {reference} is given to several variables: {names}"
        elif sum(_settable(v) for v in group) > 1:
            yield f"several variables that can be set have the value reference {reference}: {names}"


def _settable(v: Described) -> bool:
    return v.causality in ("parameter", "input", "structuralParameter") or v.initial in ("exact", "approx")


def _units(root: Element, variables: list[Described]) -> Iterator[str]:
    units = {
        unit.get("name", ""): {d.get("name", "") for d in unit.findall("DisplayUnit")}
        for unit in root.findall("UnitDefinitions/Unit")
    }
    for v in variables:
        if v.unit is not None and v.unit not in units:
            yield f"the unit '{v.unit}' of '{v.name}' is not declared"
        elif v.display is not None and v.display not in units.get(v.unit or "", set()) | {v.unit}:
            yield f"the display unit '{v.display}' of '{v.name}' is not declared for its unit '{v.unit or ''}'"


def _attributes(variables: list[Described], version: int) -> Iterator[str]:
    for v in variables:
        if v.causality not in _LEGAL:
            yield f"'{v.name}' has the unknown causality '{v.causality}'"
        elif v.variability not in _LEGAL[v.causality]:
            yield f"'{v.name}' is {v.causality} and {v.variability}, which do not go together"
        if v.type in _DISCRETE and v.variability == "continuous":
            yield f"'{v.name}' is of type {v.type} and cannot be continuous"
        needs = v.causality == "input" or v.initial in ("exact", "approx")
        if needs and v.start is None and v.causality != "independent":
            yield f"'{v.name}' has no start value"
        if not needs and v.start is not None:
            yield f"'{v.name}' is calculated and has a start value"
    independent = [v for v in variables if v.causality == "independent"]
    if len(independent) > 1 or (version == 3 and not independent):
        yield f"there are {len(independent)} independent variables"


def _structure(root: Element, variables: list[Described], version: int) -> Iterator[str]:
    by_key = {v.key: v for v in variables}
    titles = (
        ("Outputs/Unknown", "Derivatives/Unknown", "InitialUnknowns/Unknown")
        if version == 2
        else ("Output", "ContinuousStateDerivative", "InitialUnknown")
    )
    key = "index" if version == 2 else "valueReference"
    outputs, derivatives, unknowns = (
        [e.get(key, "") for e in root.findall(f"ModelStructure/{title}")] for title in titles
    )
    for keys, title in ((outputs, "outputs"), (derivatives, "derivatives"), (unknowns, "initial unknowns")):
        for k, count in Counter(keys).items():
            if count > 1:
                yield f"the {title} name variable {k} {count} times"
            if k not in by_key:
                yield f"the {title} name variable {k}, which does not exist"
    wanted = {v.key for v in variables if v.causality == "output"}
    yield from _compare(by_key, set(outputs), wanted, "outputs")
    states: set[str] = set()
    for k in derivatives:
        if k in by_key:
            of = by_key[k].derivative
            if of is None:
                yield f"'{by_key[k].name}' is listed as a derivative and is none"
            else:
                states.add(of)
    for v in variables:
        if v.derivative is None:
            continue
        state = by_key.get(v.derivative)
        if state is None:
            yield f"'{v.name}' is the derivative of variable {v.derivative}, which does not exist"
        elif (
            state.key == v.key
            or state.variability != "continuous"
            or state.causality not in ("local", "output")
        ):
            yield f"'{v.name}' is the derivative of '{state.name}', which is no state"
    if len(states) < len([k for k in derivatives if k in by_key and by_key[k].derivative is not None]):
        yield "two derivatives belong to one state"
    for k in derivatives:
        yield from _rate_name(by_key, k)
    involved = set(outputs) | set(derivatives) | states
    initial = {
        v.key
        for v in variables
        if v.initial in ("calculated", "approx")
        and (v.causality in ("output", "calculatedParameter") or v.key in involved)
    }
    yield from _compare(by_key, set(unknowns), initial, "initial unknowns")


def _rate_name(by_key: dict[str, Described], key: str) -> Iterator[str]:
    """A derivative named der(x) belongs to x."""
    v = by_key.get(key)
    state = by_key.get(v.derivative or "") if v else None
    if v is None or state is None:
        return
    found = re.fullmatch(r"der\((.*?)(?:,(\d+))?\)", v.name)
    if not found:
        return
    order = int(found[2] or 1)
    of = found[1] if order == 1 else f"der({found[1]})" if order == 2 else f"der({found[1]},{order - 1})"
    if state.name != of:
        yield f"'{v.name}' is declared as the derivative of '{state.name}'"


def _compare(by_key: dict[str, Described], found: set[str], wanted: set[str], title: str) -> Iterator[str]:
    for k in sorted(wanted - found):
        yield f"'{by_key[k].name}' is missing from the {title}"
    for k in sorted(found - wanted):
        if k in by_key:
            yield f"'{by_key[k].name}' does not belong to the {title}"
