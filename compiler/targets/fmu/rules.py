"""Rules of the standard for a model description, beside what fmpy's validation finds.

Each finding names its rule.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from .archive import NoArchive, archive_findings, read_description
from .read_description import Described, Finding, read_variables
from .structure import structure_findings

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


def check_file(path: Path) -> list[Finding]:
    """Return what is wrong with an FMU: fmpy's findings, then those of the rules; nothing if it is right."""
    unfit = archive_findings(path)
    if unfit:
        return unfit
    try:
        root = ElementTree.fromstring(read_description(path))
    except NoArchive as error:
        return [Finding("archive", f"the file is not an FMU: {error}")]
    except (ElementTree.ParseError, ValueError, LookupError) as error:  # or it is in no known encoding
        return [Finding("archive", f"modelDescription.xml is not an XML: {error}")]
    return list(dict.fromkeys([*_by_fmpy(path), *check_description(root)]))


def _by_fmpy(path: Path) -> list[Finding]:
    from fmpy.validation import validate_fmu

    try:
        return [Finding("fmpy", str(p)) for p in validate_fmu(str(path))]
    except Exception as error:  # fmpy raises plain exceptions of many kinds for a file that is wrong
        return [Finding("fmpy", str(error))]


def check_description(root: Element) -> list[Finding]:
    """Return the findings of the rules for a model description."""
    version = 2 if root.get("fmiVersion", "").startswith("2") else 3
    variables = read_variables(root, version)
    return [
        *_order(root, version),
        *_names(root, variables),
        *_references(variables, version),
        *_units(root, variables),
        *_attributes(variables, version),
        *structure_findings(root, variables, version),
    ]


def _order(root: Element, version: int) -> Iterator[Finding]:
    order = _ORDER[version].split()
    tags = [child.tag for child in root]
    for tag in tags:
        if tag not in order:
            yield Finding(
                "element order", f"<{tag}> is not an element of a model description of FMI {version}"
            )
    known = [order.index(tag) for tag in tags if tag in order]
    if known != sorted(known):
        yield Finding("element order", "the elements of the model description are in the wrong order")


def _names(root: Element, variables: list[Described]) -> Iterator[Finding]:
    for name, count in Counter(v.name for v in variables).items():
        if count > 1:
            yield Finding("duplicate name", f"the name '{name}' is given to {count} variables")
    if root.get("variableNamingConvention") == "structured":
        for v in variables:
            if not _STRUCTURED.fullmatch(v.name):
                yield Finding(
                    "structured name", f"the name '{v.name}' does not follow the structured naming convention"
                )


def _references(variables: list[Described], version: int) -> Iterator[Finding]:
    groups: dict[tuple[str, str], list[Described]] = {}
    for v in variables:
        groups.setdefault((v.type if version == 2 else "", v.reference), []).append(v)
    for (_, reference), group in groups.items():
        names = ", ".join(f"'{v.name}'" for v in group)
        if len(group) > 1 and version == 3:
            text = f"the value reference {reference} is given to several variables: {names}"
            yield Finding("value reference", text)
        elif sum(_settable(v) for v in group) > 1:
            text = f"several variables that can be set have the value reference {reference}: {names}"
            yield Finding("value reference", text)


def _settable(v: Described) -> bool:
    return v.causality in ("parameter", "input", "structuralParameter") or v.initial in ("exact", "approx")


def _units(root: Element, variables: list[Described]) -> Iterator[Finding]:
    units = {
        unit.get("name", ""): {d.get("name", "") for d in unit.findall("DisplayUnit")}
        for unit in root.findall("UnitDefinitions/Unit")
    }
    for v in variables:
        if v.unit is not None and v.unit not in units:
            yield Finding("unit", f"the unit '{v.unit}' of '{v.name}' is not declared")
        elif v.display is not None and v.display not in units.get(v.unit or "", set()) | {v.unit}:
            text = (
                f"the display unit '{v.display}' of '{v.name}' is not declared for its unit '{v.unit or ''}'"
            )
            yield Finding("display unit", text)


def _attributes(variables: list[Described], version: int) -> Iterator[Finding]:
    for v in variables:
        if v.causality not in _LEGAL:
            yield Finding("causality", f"'{v.name}' has the unknown causality '{v.causality}'")
        elif v.variability not in _LEGAL[v.causality]:
            text = f"'{v.name}' is {v.causality} and {v.variability}, which do not go together"
            yield Finding("causality", text)
        if v.type in _DISCRETE and v.variability == "continuous":
            yield Finding("variability", f"'{v.name}' is of type {v.type} and cannot be continuous")
        needs = v.type != "Clock" and (v.causality == "input" or v.initial in ("exact", "approx"))
        if needs and v.start is None and v.causality != "independent":
            yield Finding("missing start", f"'{v.name}' has no start value")
        if not needs and v.start is not None:
            yield Finding("superfluous start", f"'{v.name}' is calculated and has a start value")
    independent = [v for v in variables if v.causality == "independent"]
    if len(independent) > 1 or (version == 3 and not independent):
        yield Finding("independent", f"there are {len(independent)} independent variables")
