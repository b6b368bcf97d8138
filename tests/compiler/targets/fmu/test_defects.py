"""Planted defects: each of them is found, in both versions, and the file without them is clean."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import pytest

from mechc.api import loads
from mechc.compiler.targets.fmu.export import make_package, start_of
from mechc.compiler.targets.fmu.inspect import inspect
from mechc.compiler.targets.fmu.rules import check_description
from mechc.runtime.build import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")

MODEL = """
model Planted
  parameter m = 2 kg;
  parameter k = 8 N/m;
  parameter c = 0.02 s*k;
  parameter phase = 10 deg;
  input Force F = 0.5 N;
  coordinate x = 0.3 m;
  kinetic 1/2*m*der(x)^2;
  potential 1/2*k*x^2;
  damping c*cos(phase) on x;
  force F on x;
  output Force stretch = k*x;
  experiment(stop = 1 s);
end Planted;
"""


@pytest.fixture(scope="module", params=[2, 3])
def package(request: pytest.FixtureRequest) -> tuple[int, dict[str, bytes]]:
    model = loads(MODEL)
    start = start_of(model.problem("c", reproducible=True))
    made = make_package(model.compilation.equations, start, fmi=request.param, method="dop853")
    return request.param, dict(made.files)


def variable(root: Element, name: str) -> Element:
    return next(v for v in root.findall("ModelVariables/*") if v.get("name") == name)


def typed(root: Element, name: str) -> Element:
    found = variable(root, name)
    return found[0] if found.tag == "ScalarVariable" else found


def position(root: Element, name: str) -> int:
    return [v.get("name") for v in root.findall("ModelVariables/*")].index(name) + 1


def unknowns(root: Element, fmi: int, group: str) -> tuple[Element, list[Element]]:
    """The element that holds the unknowns of a group, and them."""
    structure = root.find("ModelStructure")
    assert structure is not None
    if fmi == 3:
        tag = {
            "Outputs": "Output",
            "Derivatives": "ContinuousStateDerivative",
            "InitialUnknowns": "InitialUnknown",
        }
        return structure, structure.findall(tag[group])
    parent = structure.find(group)
    assert parent is not None
    return parent, parent.findall("Unknown")


def key(root: Element, fmi: int, name: str) -> dict[str, str]:
    if fmi == 2:
        return {"index": str(position(root, name))}
    return {"valueReference": variable(root, name).get("valueReference", "")}


def remove_unknown(group: str) -> Callable[[Element, int], None]:
    def plant(root: Element, fmi: int) -> None:
        parent, found = unknowns(root, fmi, group)
        parent.remove(found[0])

    return plant


def parameter_without_start(root: Element, fmi: int) -> None:
    del typed(root, "m").attrib["start"]


def start_on_calculated(root: Element, fmi: int) -> None:
    typed(root, "stretch").set("start", "1.0")


def undeclared_unit(root: Element, fmi: int) -> None:
    typed(root, "m").set("unit", "slug")


def foreign_display_unit(root: Element, fmi: int) -> None:
    typed(root, "m").set("displayUnit", "deg")


def superfluous_initial_unknown(root: Element, fmi: int) -> None:
    parent, found = unknowns(root, fmi, "InitialUnknowns")
    SubElement(parent, found[0].tag, key(root, fmi, "m"))


def duplicate_initial_unknown(root: Element, fmi: int) -> None:
    parent, found = unknowns(root, fmi, "InitialUnknowns")
    SubElement(parent, found[0].tag, found[0].attrib)


def state_for_derivative(root: Element, fmi: int) -> None:
    _, found = unknowns(root, fmi, "Derivatives")
    found[0].attrib.update(key(root, fmi, "x"))


def wrong_derivative(root: Element, fmi: int) -> None:
    other = key(root, fmi, "x")
    typed(root, "der(x,2)").set("derivative", next(iter(other.values())))


def continuous_integer(root: Element, fmi: int) -> None:
    found = variable(root, "stretch")
    if fmi == 2:
        found[0].tag = "Integer"
        found[0].attrib.pop("unit", None)
    else:
        found.tag = "Int32"
        for name in ("unit", "displayUnit"):
            found.attrib.pop(name, None)


def illegal_pair(root: Element, fmi: int) -> None:
    variable(root, "m").set("variability", "continuous")


def duplicate_name(root: Element, fmi: int) -> None:
    variable(root, "k").set("name", "m")


def shared_reference(root: Element, fmi: int) -> None:
    variable(root, "k").set("valueReference", variable(root, "m").get("valueReference", ""))


def unstructured_name(root: Element, fmi: int) -> None:
    variable(root, "k").set("name", "k (stiffness)")


def wrong_order(root: Element, fmi: int) -> None:
    moved = root.find("ModelStructure")
    assert moved is not None
    root.remove(moved)
    root.insert(0, moved)


def wrong_indicators(root: Element, fmi: int) -> None:
    if fmi == 2:
        root.set("numberOfEventIndicators", "1")
    else:
        structure, _ = unknowns(root, fmi, "InitialUnknowns")
        element = Element("EventIndicator", key(root, fmi, "der(x,2)"))
        structure.append(element)


def wrong_token(root: Element, fmi: int) -> None:
    root.set("guid" if fmi == 2 else "instantiationToken", "{00000000-0000-0000-0000-000000000000}")


DEFECTS = {
    "parameter without start": parameter_without_start,
    "start on a calculated variable": start_on_calculated,
    "undeclared unit": undeclared_unit,
    "display unit of another unit": foreign_display_unit,
    "missing initial unknown": remove_unknown("InitialUnknowns"),
    "superfluous initial unknown": superfluous_initial_unknown,
    "duplicate initial unknown": duplicate_initial_unknown,
    "missing output": remove_unknown("Outputs"),
    "state instead of its derivative": state_for_derivative,
    "wrong derivative reference": wrong_derivative,
    "continuous integer": continuous_integer,
    "illegal causality and variability": illegal_pair,
    "duplicate name": duplicate_name,
    "two settable variables with one reference": shared_reference,
    "unstructured name": unstructured_name,
    "elements in the wrong order": wrong_order,
    "wrong number of event indicators": wrong_indicators,
    "wrong token": wrong_token,
}


SEEN_IN_BINARY = ("wrong number of event indicators", "wrong token")
"""What only the comparison with the binary finds."""


def written(path: Path, files: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path


@pytest.mark.slow
def test_the_sound_file_passes(package: tuple[int, dict[str, bytes]], tmp_path: Path) -> None:
    _, files = package
    report = inspect(written(tmp_path / "sound.fmu", files))
    assert report.passed, report
    assert len(report.lines) == 5


def test_the_rules_find_nothing_in_the_sound_file(package: tuple[int, dict[str, bytes]]) -> None:
    _, files = package
    assert check_description(ElementTree.fromstring(files["modelDescription.xml"])) == []


@pytest.mark.parametrize("name", [n for n in DEFECTS if n not in SEEN_IN_BINARY])
def test_the_rules_find_a_planted_defect(package: tuple[int, dict[str, bytes]], name: str) -> None:
    fmi, files = package
    root = ElementTree.fromstring(files["modelDescription.xml"])
    DEFECTS[name](root, fmi)
    assert check_description(root)


@pytest.mark.slow
@pytest.mark.parametrize("name", list(DEFECTS))
def test_a_planted_defect_is_found(package: tuple[int, dict[str, bytes]], tmp_path: Path, name: str) -> None:
    fmi, files = package
    root = ElementTree.fromstring(files["modelDescription.xml"])
    DEFECTS[name](root, fmi)
    changed = {
        **files,
        "modelDescription.xml": ElementTree.tostring(root, encoding="utf-8", xml_declaration=True),
    }
    report = inspect(written(tmp_path / "planted.fmu", changed), run=False)
    assert not report.passed
