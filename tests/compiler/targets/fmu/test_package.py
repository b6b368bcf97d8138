"""What is in an FMU beside its binary: documents, licences, terminals, reference results, sources that stand alone."""

from __future__ import annotations

import csv
import hashlib
import io
import os
import re
import shutil
import subprocess
import sys
import zipfile
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from lxml import etree
from msgspec.structs import replace

from mechc.api import load, loads
from mechc.cli.main import run as main
from mechc.compiler.equations.needs import EVERYTHING
from mechc.compiler.targets.fmu import driver
from mechc.compiler.targets.fmu.checks import check_package, native_motion
from mechc.compiler.targets.fmu.export import make_package, start_of
from mechc.compiler.targets.fmu.inspect import inspect
from mechc.compiler.targets.fmu.reference import parse_reference, read_reference
from mechc.fmu.account import account
from mechc.fmu.documents import native_run, reference
from mechc.fmu.export import FmuOptions, export_fmu, fmu_packages
from mechc.lang.diagnostics import CompileError
from mechc.runtime.native.build import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")

ROOT = Path(__file__).parents[4]
HEADERS = Path(fmpy.__file__).parent / "c-code"

ARM = """
model Arm "a mass on a spring, <pulled> by a hand"
  parameter m = 2 kg "mass";
  parameter k = 8 N/m;
  input Force hand[2] = {0.5, 0} N;
  coordinate x[2] = {0.3, 0} m;
  kinetic 1/2*m*(der(x[1])^2 + der(x[2])^2);
  potential 1/2*k*(x[1]^2 + x[2]^2);
  force hand[1] on x[1];
  force hand[2] on x[2];
  output Length tip[2] = 2*x;
  experiment(stop = 2 s);
end Arm;
"""


VERSIONS = [2, pytest.param(3, marks=pytest.mark.slow)]
"""For what takes its time and has little to do with the version."""


@pytest.fixture(scope="module", params=[2, 3])
def arm(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, int]:
    path = tmp_path_factory.mktemp("arm") / "arm.fmu"
    export_fmu(loads(ARM), path, FmuOptions(fmi=str(request.param)))
    return path, request.param


def content(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def test_the_files(arm: tuple[Path, int]) -> None:
    path, fmi = arm
    files = set(content(path))
    assert {
        "modelDescription.xml",
        "documentation/index.html",
        "documentation/diagram.png",
        "documentation/reference.csv",
        "documentation/licenses/license.txt",
        "documentation/licenses/mechc.txt",
        "documentation/licenses/fmi.txt",
        "sources/model.c",
    } <= files
    own = {2: {"model.png", "sources/fmi2Functions.h"}, 3: {"sources/buildDescription.xml"}}
    own[3] |= {"terminalsAndIcons/icon.png", "terminalsAndIcons/terminalsAndIcons.xml"}
    assert own[fmi] <= files
    assert not own[5 - fmi] & files
    # the importer of FMI 3 brings its own headers
    assert fmi == 2 or not any("fmi3" in name and name.endswith(".h") for name in files)


def test_the_licences_are_those_of_the_sources(arm: tuple[Path, int]) -> None:
    path, fmi = arm
    files = content(path)
    assert files["documentation/licenses/mechc.txt"] == (ROOT / "LICENSE").read_bytes()
    notice = files["documentation/licenses/fmi.txt"].decode()
    assert notice.startswith("Copyright (C) 2008")
    assert "Redistributions in binary form must reproduce" in notice
    assert f"fmi{fmi}*.h" in files["documentation/licenses/license.txt"].decode()


class Page(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.seen: list[str] = []
        self.links: list[str] = []
        self.words = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append(tag)
        self.links += [value for name, value in attrs if name in ("src", "href") and value]

    def handle_data(self, data: str) -> None:
        self.words += data


def test_the_page_shows_picture_equations_and_variables(arm: tuple[Path, int]) -> None:
    files = content(arm[0])
    page = Page()
    page.feed(files["documentation/index.html"].decode())
    assert all(f"documentation/{link}" in files for link in page.links)
    assert page.seen.count("math") >= 3  # the Lagrangian and two equations
    assert "by a hand" in page.words and "<pulled>" in page.words
    for words in ("Equations of motion", "Lagrangian", "hand[1]", "tip[2]", "mass"):
        assert words in page.words
    assert files["documentation/diagram.png"].startswith(b"\x89PNG")


@pytest.mark.slow
def test_long_equations_are_left_out_of_the_page(tmp_path: Path) -> None:
    path = tmp_path / "m.fmu"
    export_fmu(load(ROOT / "examples" / "hanging_chain.mech"), path, FmuOptions(check=False))
    page = content(path)["documentation/index.html"].decode()
    assert re.search(r"They have \d+ terms and are not printed here", page)
    assert "<math" not in page


def test_terminals(arm: tuple[Path, int]) -> None:
    path, fmi = arm
    if fmi == 2:
        pytest.skip("terminals are of FMI 3")
    text = content(path)["terminalsAndIcons/terminalsAndIcons.xml"]
    schema = etree.XMLSchema(etree.parse(str(HEADERS.parent / "schema/fmi3/fmi3TerminalsAndIcons.xsd")))
    root = etree.fromstring(text)
    schema.assertValid(root)
    found = {t.get("name"): [m.get("variableName") for m in t] for t in root.iter("Terminal")}
    assert found == {"hand": ["hand[1]", "hand[2]"], "tip": ["tip[1]", "tip[2]"]}
    assert {t.get("matchingRule") for t in root.iter("Terminal")} == {"sequence"}


def test_the_build_description_fits_its_schema(arm: tuple[Path, int]) -> None:
    path, fmi = arm
    if fmi == 2:
        pytest.skip("FMI 2 lists its sources in the model description")
    files = content(path)
    root = etree.fromstring(files["sources/buildDescription.xml"])
    etree.XMLSchema(etree.parse(str(HEADERS.parent / "schema/fmi3/fmi3BuildDescription.xsd"))).assertValid(
        root
    )
    listed = {f"sources/{s.get('name')}" for s in root.iter("SourceFile")}
    assert listed == {name for name in files if name.endswith(".c")}


@pytest.mark.slow
def test_the_same_model_gives_the_same_bytes(arm: tuple[Path, int], tmp_path: Path) -> None:
    path, fmi = arm
    again = tmp_path / "again.fmu"
    export_fmu(loads(ARM), again, FmuOptions(fmi=str(fmi), check=False))
    assert hashlib.sha256(again.read_bytes()).digest() == hashlib.sha256(path.read_bytes()).digest()
    export_fmu(loads(ARM.replace("k = 8", "k = 9")), again, FmuOptions(fmi=str(fmi), check=False))
    tokens = [fmpy.read_model_description(str(p)).guid for p in (path, again)]
    assert tokens[0] != tokens[1]


@pytest.mark.slow
def test_another_process_gives_the_same_bytes(tmp_path: Path) -> None:
    """Sets of texts have another order in each process; nothing may come from it. Seen: the token."""
    model = ROOT / "examples" / "stick_slip_belt.mech"
    made = set()
    for seed in ("1", "2"):
        path = tmp_path / f"{seed}.fmu"
        command = [sys.executable, "-m", "mechc", "compile", str(model), "--target", "fmu", "-o", str(path)]
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        subprocess.run(
            [*command, "--sources-only", "--no-check"], check=True, env=environment, capture_output=True
        )
        made.add(hashlib.sha256(path.read_bytes()).hexdigest())
    assert len(made) == 1


def test_the_reference_is_the_motion(arm: tuple[Path, int]) -> None:
    reference = read_reference(arm[0])
    assert reference is not None
    # x1 = 1/16 + (0.3 - 1/16) cos 2t, the answer of this oscillator; the run has a tolerance of 1e-8
    exact = 0.0625 + 0.2375 * np.cos(2 * reference.time)
    assert np.max(np.abs(reference.columns["x[1]"] - exact)) < 1e-7
    assert (reference.time[0], reference.time[-1], len(reference.time)) == (0.0, 2.0, 201)
    names = next(csv.reader(io.StringIO(content(arm[0])["documentation/reference.csv"].decode())))
    assert names[:4] == ["time", "x[1]", "x[2]", "der(x[1])"]


def test_other_results_are_noticed(arm: tuple[Path, int], tmp_path: Path) -> None:
    path, _ = arm
    assert [line.what for line in inspect(path).lines if "reference" in line.what] == [
        "ModelExchange reference",
        "CoSimulation reference",
    ]
    changed = tmp_path / "changed.fmu"
    with zipfile.ZipFile(changed, "w") as archive:
        for name, data in content(path).items():
            if name.endswith("reference.csv"):
                rows = data.decode().splitlines()
                cells = rows[100].split(",")
                cells[1] = repr(float(cells[1]) + 1e-3)
                data = "\n".join([*rows[:100], ",".join(cells), *rows[101:]]).encode()
            archive.writestr(name, data)
    report = inspect(changed)
    assert report.rules == {"reference results"}
    assert any("'x[1]' at time 0.99" in line.detail for line in report.lines)


@pytest.mark.slow
def test_a_chaotic_reference_ends_where_it_cannot_be_trusted(tmp_path: Path) -> None:
    path = tmp_path / "m.fmu"
    model = load(ROOT / "examples" / "double_pendulum.mech")
    export_fmu(model, path, FmuOptions(check=False))
    reference = read_reference(path)
    assert reference is not None
    run = model.simulate(stop=float(reference.time[-1]), tolerance=1e-6, estimate_error=False)
    for name in ("shoulder.angle", "elbow.angle"):
        values = reference.columns[name]
        assert np.max(np.abs(run(reference.time)[name] - values)) < 2e-4 * np.max(np.abs(values))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["me", "cs"])
def test_one_kind(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "m.fmu"
    export_fmu(loads(ARM), path, FmuOptions(kind=kind, fmi="2" if kind == "me" else "3"))
    description = fmpy.read_model_description(str(path))
    assert (description.modelExchange is None, description.coSimulation is None) == (
        kind == "cs",
        kind == "me",
    )


def test_both_versions(tmp_path: Path) -> None:
    written = export_fmu(loads(ARM), tmp_path / "m.fmu", FmuOptions(fmi="both", check=False))
    assert written == (tmp_path / "fmi2" / "m.fmu", tmp_path / "fmi3" / "m.fmu")
    assert [fmpy.read_model_description(str(p)).fmiVersion for p in written] == ["2.0", "3.0"]


def moves(path: Path, library: Path) -> list[float]:
    """The states at the end, by a binary that takes the place of that in the file."""
    other = library.parent / "other.fmu"
    with zipfile.ZipFile(other, "w") as archive:
        for name, data in content(path).items():
            if not name.startswith("binaries/"):
                archive.writestr(name, data)
        with zipfile.ZipFile(path) as original:
            (place,) = [n for n in original.namelist() if n.startswith("binaries/")]
        archive.writestr(place, library.read_bytes())
    return [float(v) for v in driver.co_simulation(other, np.linspace(0.0, 2.0, 9), 0.25)[-1]]


@pytest.mark.slow
@pytest.mark.parametrize("arm", VERSIONS, indirect=True)
def test_the_sources_compile_by_one_command(arm: tuple[Path, int], tmp_path: Path) -> None:
    path, _ = arm
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path)
    compiler = find_compiler()
    assert compiler is not None
    flags = ["-std=c11", "-Wall", "-Wextra", "-Werror", "-pedantic-errors", "-O1", "-fPIC", f"-I{HEADERS}"]
    sources = sorted(str(p) for p in (tmp_path / "sources").glob("*.c"))
    library = tmp_path / "built.so"
    subprocess.run([*compiler.command, *flags, "-shared", *sources, "-o", str(library), "-lm"], check=True)
    wanted = driver.co_simulation(path, np.linspace(0.0, 2.0, 9), 0.25)[-1]
    # another optimisation may contract products and sums: rounding errors of a few dozen steps
    assert moves(path, library) == pytest.approx(wanted.tolist(), rel=1e-12)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cmake") is None, reason="needs cmake")
def test_fmpy_compiles_the_sources(tmp_path: Path, arm: tuple[Path, int]) -> None:
    path = tmp_path / "arm.fmu"
    export_fmu(loads(ARM), path, FmuOptions(fmi=str(arm[1]), sources_only=True))
    assert not any(name.startswith("binaries/") for name in content(path))
    subprocess.run([sys.executable, "-m", "fmpy.cli", "compile", str(path)], check=True)
    assert fmpy.platform in fmpy.supported_platforms(str(path))
    assert inspect(path).passed


@pytest.mark.slow
def test_sources_need_no_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "ziglang", None)
    (path,) = export_fmu(loads(ARM), tmp_path / "arm.fmu", FmuOptions(sources_only=True))
    files = content(path)
    assert "sources/model.c" in files
    assert not any(name.startswith("binaries/") for name in files)


def test_a_failed_check_leaves_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "mechc.compiler.targets.fmu.model_description3.value_text",
        lambda variable, value: repr(float(value)) if value != 2.0 else "two",
    )
    with pytest.raises(CompileError, match="fails its check and was not written: it is not valid"):
        export_fmu(loads(ARM), tmp_path / "m.fmu", FmuOptions())
    assert list(tmp_path.iterdir()) == []


def test_a_binary_that_moves_otherwise_is_not_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from mechc.compiler.targets.fmu import checks

    def shifted(*given: Any) -> Any:
        motion = native_motion(*given)
        return replace(motion, states=motion.states + 1e-15)

    monkeypatch.setattr(checks, "native_motion", shifted)
    with pytest.raises(CompileError, match="Co-Simulation does not give the same motion"):
        export_fmu(loads(ARM), tmp_path / "m.fmu", FmuOptions())
    assert list(tmp_path.iterdir()) == []


def test_a_model_exchange_unit_that_moves_otherwise_is_not_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By 1e-4, where the bound is 2e-6 at the end of the run."""
    by_cvode = driver.by_cvode
    monkeypatch.setattr(driver, "by_cvode", lambda *given, **more: by_cvode(*given, **more) * (1 + 1e-4))
    with pytest.raises(CompileError, match=r"Model Exchange differs from the native run by .* at time"):
        export_fmu(loads(ARM), tmp_path / "m.fmu", FmuOptions(kind="me"))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda rows: rows[:20], "ends at time .*, and the native run goes on"),
        (lambda rows: np.where(np.arange(len(rows))[:, None] > 20, np.nan, rows), "not finite"),
    ],
)
def test_a_model_exchange_unit_that_ends_early_is_not_written(
    change: Any, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    by_cvode = driver.by_cvode
    monkeypatch.setattr(driver, "by_cvode", lambda *given, **more: change(by_cvode(*given, **more)))
    with pytest.raises(CompileError, match=told):
        export_fmu(loads(ARM), tmp_path / "m.fmu", FmuOptions(kind="me"))


@pytest.mark.slow
def test_the_points_of_a_comparison_cover_a_run_that_ends_early() -> None:
    text = ARM.replace(
        "experiment(stop = 2 s)",
        'when x[1] < 0 m then terminate("there"); end when; experiment(stop = 100 s)',
    )
    checked = check_package(fmu_packages(loads(text).with_values({"hand[1]": 0}), FmuOptions())[0])
    assert checked is not None and checked.me is not None
    # 0.3 cos(2 t) is zero there; the last whole point lies half a step before
    assert np.pi / 4 * (1 - 1 / 47) < checked.me.until < np.pi / 4
    assert checked.times[-1] == pytest.approx(np.pi / 4, abs=1e-8)


@pytest.mark.slow
def test_a_run_that_may_fail_goes_as_far_as_it_can(tmp_path: Path) -> None:
    text = ARM.replace(
        "experiment(stop = 2 s)", 'assert x[1] > 0.2 m, "too near";\n  experiment(stop = 0.3 s)'
    )
    path = tmp_path / "m.fmu"
    path.write_bytes(
        fmu_packages(loads(text).with_values({"hand[1]": 0}), FmuOptions(kind="me"))[0].package.data
    )
    times = np.linspace(0.0, 2.0, 21)
    # 0.3 cos(2 t) falls to 0.2 at 0.42
    assert len(driver.by_cvode(path, times, 1e-6, may_fail=True)) == 5
    with pytest.raises(FMICallException):
        driver.by_cvode(path, times, 1e-6)


STIFF_FLOOR = """
model StiffFloor "regularized friction: stiff from the time on at which the mass comes to rest"
  gravity {0, -9.81} m/s^2;
  coordinate Length x = 0 m;
  coordinate Length y = 0 m;
  initial der(x) = 1 m/s;
  mass 1 kg at world*{x, y};
  contact floor: y friction 0.3 along der(x), law = "regularized", v_stick = 1 mm/s;
  force 1 N on x;
  experiment(stop = 1 s);
end StiffFloor;
"""


@pytest.mark.slow
def test_a_model_that_turns_out_to_be_stiff_has_the_jacobian_of_its_native_run() -> None:
    made = fmu_packages(loads(STIFF_FLOOR), FmuOptions())[0]
    assert made.method == "auto"
    checked = check_package(made)
    assert checked is not None and checked.me is not None and checked.me.until > 0.9


PARALLELOGRAM = """
model Parallelogram "lies flat twice a turn, if the rocker is as long as the crank"
  import mech.planar.*;
  parameter l = 1.1 m;
  gravity {0, -9.81 m/s^2};
  Bar crank(m = 1 kg, l = 1 m);
  Bar coupler(m = 2 kg, l = 2 m);
  Bar rocker(m = 3 kg, l = l);
  Revolute a(world -> crank.a, angle = 30 deg, der(angle) = 10 rad/s);
  Revolute b(crank.b -> coupler.a, angle ~ -30 deg);
  Revolute d(world * trans({2 m, 0 m}) -> rocker.a, angle ~ 30 deg);
  cut Revolute c(coupler.b -> rocker.b);
  experiment(stop = 1 s);
end Parallelogram;
"""


@pytest.mark.slow
def test_a_model_that_meets_a_singular_position_is_exported_as_it_ran() -> None:
    """With compliant multipliers, though the stated values need none."""
    made = fmu_packages(loads(PARALLELOGRAM).with_values({"l": 1.0}), FmuOptions())[0]
    checked = check_package(made)
    assert checked is not None and checked.me is not None
    assert np.any(np.sin(checked.states[:, 0]) < 0), "it went through the position"


TWO = """
model Two "two masses on a spring, at rest as a whole"
  coordinate Length x[2] = {0, 1.1} m;
  mass 1 kg at world*{x[1], 0};
  mass 3 kg at world*{x[2], 0};
  potential 1/2*(7 N/m)*(x[2] - x[1] - 1 m)^2;
  experiment(stop = 3 s);
end Two;
"""


def test_outputs_that_are_nothing_but_rounding_are_no_reference() -> None:
    model = loads(TWO)
    _, solution = native_run(model, None, 3.0)
    momentum = solution(np.linspace(0.0, 3.0, 5))["momentum.x"]
    assert 0 < np.max(np.abs(momentum)) < 1e-14
    columns = parse_reference("reference.csv", reference(model, None, solution, 0.0)).columns
    assert "momentum.x" not in columns
    assert {"x[1]", "der(x[2])", "energy.total"} <= set(columns)


def test_an_interrupted_write_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import os

    def refuse(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", refuse)
    monkeypatch.setattr("mechc.runtime.native.build.os.replace", refuse)
    with pytest.raises(CompileError, match=r"E0901.*No space left on device"):
        export_fmu(loads(ARM), tmp_path / "m.fmu", FmuOptions(sources_only=True))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("arm", VERSIONS, indirect=True)
def test_check_and_run_from_the_command_line(
    arm: tuple[Path, int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, fmi = arm
    assert main(["fmu", "check", str(path)]) == 0
    table = capsys.readouterr().out
    assert f"Arm, FMI {fmi}.0, ModelExchange and CoSimulation, by mechc" in table
    assert table.count("ok  ") == 8
    picture, rows = tmp_path / "m.png", tmp_path / "m.csv"
    options = ["--set", "k=32", "--stop", "1", "--plot", str(picture), "-o", str(rows), "--display", "mm"]
    assert main(["fmu", "run", str(path), "--kind", "me", *options]) == 0
    assert "x[1] [mm]" in capsys.readouterr().out
    assert picture.read_bytes().startswith(b"\x89PNG")
    last = list(csv.DictReader(io.StringIO(rows.read_text(encoding="utf-8"))))[-1]
    exact = 1 / 64 + (0.3 - 1 / 64) * np.cos(4.0)
    # CVode at its tolerance of 1e-4
    assert float(last["x[1] [m]"]) == pytest.approx(exact, abs=1e-3)


def test_an_unknown_name_in_a_run(arm: tuple[Path, int], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fmu", "run", str(arm[0]), "--set", "kk=1"]) == 2
    assert "no variable that can be set 'kk'; it has" in capsys.readouterr().err


@pytest.mark.parametrize("arm", VERSIONS, indirect=True)
def test_values_of_a_run_have_units(arm: tuple[Path, int], capsys: pytest.CaptureFixture[str]) -> None:
    printed = []
    for value in ("k=3200", "k=3.2 kN/m"):
        assert main(["fmu", "run", str(arm[0]), "--stop", "0.1", "--set", value]) == 0
        printed.append(capsys.readouterr().out)
    assert printed[0] == printed[1]
    assert main(["fmu", "run", str(arm[0]), "--set", "k=2 kg"]) == 2
    assert "'k' takes one number in N/m, not '2 kg'" in capsys.readouterr().err


def test_a_file_that_is_no_fmu(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "m.fmu"
    path.write_text("nothing", encoding="utf-8")
    assert main(["fmu", "check", str(path)]) == 1
    assert "the file is not an FMU" in capsys.readouterr().out
    assert main(["fmu", "run", str(path)]) == 2
    assert "is not an FMU" in capsys.readouterr().err


def test_the_files_of_every_method_are_found() -> None:
    model = loads(ARM).keeping(EVERYTHING)
    start = start_of(model.problem(quick=True))
    equations = model.compilation.equations
    made = make_package(equations, start, fmi=3, method="gauss4", platforms=(), parts=EVERYTHING)
    text = "\n".join(data.decode() for name, data in made.files.items() if name.endswith(".c"))
    defined = set(re.findall(r"^const mech_method mech_(\w+) =", text, re.M))
    defined |= {f"gauss{n}" for n in re.findall(r"^GAUSS\((\d)", text, re.M)}
    defined |= set(re.findall(r"^LOBATTO\((\w+)", text, re.M))
    (table,) = re.findall(r"mech_methods\[\] = \{(.*?)\}", text, re.S)
    assert set(re.findall(r"&mech_(\w+)", table)) == defined
    assert len(defined) >= 12


@pytest.mark.slow
def test_a_lean_binary_is_smaller_by_a_third() -> None:
    model = load(ROOT / "examples" / "double_pendulum.mech")
    lean, full = account(model), account(model.keeping(EVERYTHING))
    assert lean.binary < 0.7 * full.binary
    assert set(lean.sources) < set(full.sources)
    assert {"hybrid.c", "radau5.c", "gauss.c", "lobatto.c"} <= set(full.sources) - set(lean.sources)
