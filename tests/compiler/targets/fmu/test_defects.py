"""Planted defects: each of them is found, in both versions, and the file without them is clean."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import pytest

from mechc.api import loads
from mechc.cli.main import run as main
from mechc.compiler.targets.fmu.export import make_package, start_of
from mechc.compiler.targets.fmu.inspect import inspect
from mechc.compiler.targets.fmu.rules import check_description
from mechc.runtime.native.build import find_compiler

Plant = Callable[[Element, int], None]

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
    start = start_of(model.problem(reproducible=True))
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


def remove_unknown(group: str) -> Plant:
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


DEFECTS: dict[str, tuple[Plant, str]] = {
    "parameter without start": (parameter_without_start, "missing start"),
    "start on a calculated variable": (start_on_calculated, "superfluous start"),
    "undeclared unit": (undeclared_unit, "unit"),
    "display unit of another unit": (foreign_display_unit, "display unit"),
    "missing initial unknown": (remove_unknown("InitialUnknowns"), "missing in initial unknowns"),
    "superfluous initial unknown": (superfluous_initial_unknown, "superfluous in initial unknowns"),
    "duplicate initial unknown": (duplicate_initial_unknown, "duplicate in initial unknowns"),
    "missing output": (remove_unknown("Outputs"), "missing in outputs"),
    "state instead of its derivative": (state_for_derivative, "no derivative"),
    "wrong derivative reference": (wrong_derivative, "derivative of"),
    "continuous integer": (continuous_integer, "variability"),
    "illegal causality and variability": (illegal_pair, "causality"),
    "duplicate name": (duplicate_name, "duplicate name"),
    "two settable variables with one reference": (shared_reference, "value reference"),
    "unstructured name": (unstructured_name, "structured name"),
    "elements in the wrong order": (wrong_order, "element order"),
    "wrong number of event indicators": (wrong_indicators, "event indicators"),
    "wrong token": (wrong_token, "token"),
}
"""What is planted, and the rule that must find it."""

IN_BINARY = ("event indicators", "token")
"""Rules that compare the description with the binary."""


def written(path: Path, files: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path


def planted(files: dict[str, bytes], fmi: int, name: str) -> Element:
    root = ElementTree.fromstring(files["modelDescription.xml"])
    DEFECTS[name][0](root, fmi)
    return root


@pytest.mark.slow
def test_the_sound_file_passes(package: tuple[int, dict[str, bytes]], tmp_path: Path) -> None:
    _, files = package
    report = inspect(written(tmp_path / "sound.fmu", files))
    assert report.passed, report
    assert [line.what for line in report.lines] == [
        "model description",
        "platforms",
        "ModelExchange binary",
        "ModelExchange run",
        "CoSimulation binary",
        "CoSimulation run",
    ]


def test_the_rules_find_nothing_in_the_sound_file(package: tuple[int, dict[str, bytes]]) -> None:
    _, files = package
    assert check_description(ElementTree.fromstring(files["modelDescription.xml"])) == []


@pytest.mark.parametrize("name", [n for n in DEFECTS if DEFECTS[n][1] not in IN_BINARY])
def test_a_rule_finds_a_planted_defect(package: tuple[int, dict[str, bytes]], name: str) -> None:
    fmi, files = package
    assert DEFECTS[name][1] in {f.rule for f in check_description(planted(files, fmi, name))}


@pytest.mark.parametrize("name", [n for n in DEFECTS if DEFECTS[n][1] in IN_BINARY])
def test_the_check_finds_a_description_unlike_its_binary(
    package: tuple[int, dict[str, bytes]], tmp_path: Path, name: str
) -> None:
    fmi, files = package
    changed = {**files, "modelDescription.xml": ElementTree.tostring(planted(files, fmi, name))}
    report = inspect(written(tmp_path / "planted.fmu", changed), run=False)
    assert not report.passed
    assert DEFECTS[name][1] in report.rules


@pytest.mark.slow
@pytest.mark.parametrize("name", list(DEFECTS))
def test_the_check_finds_a_planted_defect(
    package: tuple[int, dict[str, bytes]], tmp_path: Path, name: str
) -> None:
    fmi, files = package
    text = ElementTree.tostring(planted(files, fmi, name), encoding="utf-8", xml_declaration=True)
    path = written(tmp_path / "planted.fmu", {**files, "modelDescription.xml": text})
    assert main(["fmu", "check", "--no-run", str(path)]) == 1
    report = inspect(path, run=False)
    assert DEFECTS[name][1] in report.rules
