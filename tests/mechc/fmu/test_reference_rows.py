"""Reference results that come with FMUs: of sampled controllers, and those that Euler's method made."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

import mechc
from mechc.cli.main import run as run_command
from mechc.compiler.targets.fmu import inspect
from mechc.compiler.targets.fmu.archive import archive_findings
from mechc.compiler.targets.fmu.reference import OWN, parse_reference, read_reference
from mechc.compiler.targets.fmu.rules import check_file
from mechc.fmu.documents import reference
from mechc.fmu.guard import check_fmu
from mechc.fmu.run import run_fmu
from mechc.requests.parse_values import UsageMistake
from mechc.runtime.outcome import Outcome, SimulationError

SAMPLED = """\
model Sampled
  coordinate Length x = 0 m;
  discrete Force u = 0 N;
  kinetic 1/2*1 kg*der(x)^2;
  when sample(1 ms) then
    u := 40 N/m*(1 m - x) - 8 N.s/m*der(x);
  end when;
  force u on x;
  experiment(stop = 0.5 s);
end Sampled;
"""
SWING = """\
model Swing
  coordinate Length x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*4 N/m*x^2;
  experiment(stop = 2 s);
end Swing;
"""


def test_a_sampled_controller_has_rows() -> None:
    """Each even time is near a sample instant: the rows lie between, on the exact motion under a force that is held."""
    model = mechc.loads(SAMPLED)
    found = parse_reference("r.csv", reference(model, None, model.simulate(), 0.0))
    assert found.time.size > 100
    h, x, v, exact = 1e-3, 0.0, 0.0, {}
    for k in range(500):
        u = 40 * (1 - x) - 8 * v
        exact[round((k + 0.5) * h, 9)] = x + v * h / 2 + u * h**2 / 8
        x, v = x + v * h + u * h**2 / 2, v + u * h
    assert found.columns["x"] == pytest.approx([exact[round(t, 9)] for t in found.time], abs=1e-9)


def exported(text: str, name: str, folder: Path) -> Path:
    (folder / f"{name}.mech").write_text(text)
    path = folder / f"{name}.fmu"
    assert run_command(["compile", str(folder / f"{name}.mech"), "--target", "fmu", "-o", str(path)]) == 0
    return path


def with_reference(path: Path, rows: str, folder: Path) -> Path:
    made = folder / f"changed_{path.name}"
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(made, "w") as new:
        for name in old.namelist():
            new.writestr(name, rows if name == OWN else old.read(name))
    return made


@pytest.mark.slow
def test_references_made_by_eulers_method_are_followed(tmp_path: Path) -> None:
    path = exported(SWING, "swing", tmp_path)
    assert check_fmu(path).passed
    h, x, v, rows = 0.02, 1.0, 0.0, ["time,x"]
    for k in range(101):
        rows.append(f"{k * h:.12g},{x:.12g}")
        x, v = x + h * v, v - h * 4 * x
    report = check_fmu(with_reference(path, "\n".join(rows) + "\n", tmp_path))
    (line,) = [line for line in report.lines if line.what == "ModelExchange reference"]
    assert line.passed and "Euler" in line.detail
    wrong = [rows[0], *(f"{t:.12g},{np.cos(1.9 * t):.12g}" for t in np.linspace(0, 2, 101))]
    report = check_fmu(with_reference(path, "\n".join(wrong) + "\n", tmp_path))
    (line,) = [line for line in report.lines if line.what == "ModelExchange reference"]
    assert not line.passed


SHUT = """\
model Shut
  coordinate Length x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*100 N/m*x^2;
  assert abs(x) < 2 m, "it leaves";
  experiment(stop = 2 s);
end Shut;
"""


@pytest.mark.slow
def test_where_eulers_method_fails_nothing_is_followed(tmp_path: Path) -> None:
    path = exported(SHUT, "shut", tmp_path)
    wrong = ["time,x", *(f"{t:.12g},{np.cos(9 * t):.12g}" for t in np.linspace(0, 2, 101))]
    report = check_fmu(with_reference(path, "\n".join(wrong) + "\n", tmp_path))
    (line,) = [line for line in report.lines if line.what == "ModelExchange reference"]
    assert not line.passed and "largest difference" in line.detail


RUBBED = """\
model Rubbed "a spring draws a block over a floor on which it sticks and slips"
  coordinate Length x = 0 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*100 N/m*(x - 0.1 m/s*time)^2;
  friction 1 N static 2 N on x;
  experiment(stop = 10 s);
end Rubbed;
"""


@pytest.mark.slow
def test_errors_of_the_integrator_are_not_those_of_a_unit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = exported(RUBBED, "rubbed", tmp_path)
    rows = read_reference(path)
    assert rows is not None
    monkeypatch.setattr(inspect, "BOUND", 1e-5)  # the first run is off by 2e-5
    for finer in (1, 100):
        monkeypatch.setattr(inspect, "FINER", finer)
        (line,) = [line for line in inspect.run_lines(path, "me", rows) if line.what.endswith("reference")]
        assert line.passed is (finer > 1), line


PUSHED = """\
model Pushed
  input Force u = 0 N;
  input Force w = 0 N;
  coordinate Length x = 0 m;
  kinetic 1/2*2 kg*der(x)^2;
  force u + w on x;
  experiment(stop = 2 s);
end Pushed;
"""


@pytest.mark.slow
def test_references_in_which_nothing_changes_say_little(tmp_path: Path) -> None:
    for text, name, still in ((PUSHED, "pushed", True), (SWING, "swing", False)):
        report = check_fmu(exported(text, name, tmp_path))
        details = [line.detail for line in report.lines if line.what.endswith("reference")]
        assert [("nothing changes" in detail) for detail in details] == [still, still]


@pytest.mark.slow
@pytest.mark.parametrize("version", ["2", "3"])
def test_an_fmu_that_ends_before_the_stop_says_so(version: str, tmp_path: Path) -> None:
    """2 kg under 3 N pass 0.48 m at 0.8 s; Co-Simulation tells the state of the end at its next communication point."""
    text = PUSHED.replace("end Pushed;", '  when x > 0.48 m then terminate("far"); end when;\nend Pushed;')
    (tmp_path / "pushed.mech").write_text(text)
    path = tmp_path / "pushed.fmu"
    options = ["--target", "fmu", "--fmi", version, "-o", str(path)]
    assert run_command(["compile", str(tmp_path / "pushed.mech"), *options]) == 0
    table = tmp_path / "u.csv"
    table.write_text("time [s],u [N]\n0,3\n2,3\n")
    for kind in ("cs", "me"):
        found = run_fmu(path, kind=kind, every=0.01, inputs={"u": str(table)})
        assert found.outcome is Outcome.TERMINATED and "before 2" in found.message
        assert found.time[-1] == pytest.approx(0.8, abs=0.011)
        assert found["x"][-1] == pytest.approx(0.48, abs=1e-6)


@pytest.mark.slow
def test_tables_drive_inputs_of_an_fmu(tmp_path: Path) -> None:
    """A force that rises from 0 to 4 N in 2 s, on 2 kg: x = t^3/6, and 1/4 t^2 more for 1 N beside it.

    Held over steps of h the ramp is late by h/2: x is too small by h t^2/4, 2 mm of 1.33 m; Model
    Exchange by fmpy is off by half as much again.
    """
    path = exported(PUSHED, "pushed", tmp_path)
    ramp, beside = tmp_path / "u.csv", tmp_path / "w.csv"
    ramp.write_text("time [ms],u [kN]\n0,0\n1000,2e-3\n2000,4e-3\n")
    beside.write_text("time [s],w [N]\n0,1\n3,1\n")
    for kind in ("me", "cs"):
        alone = run_fmu(path, kind=kind, every=0.002, inputs={"u": str(ramp)})
        assert alone["x"][-1] == pytest.approx(8 / 6 - 0.002, abs=2e-3 if kind == "me" else 1e-4)
        both = run_fmu(path, kind=kind, every=0.002, inputs={"u": str(ramp), "w": str(beside)})
        assert both["x"][-1] == pytest.approx(8 / 6 + 1 - 0.002, abs=2e-3 if kind == "me" else 1e-4)
    code = run_command(
        ["fmu", "run", str(path), "--input", f"u={ramp}", "--every", "0.01", "-o", str(tmp_path / "x.csv")]
    )
    assert code == 0 and "x [m]" in (tmp_path / "x.csv").read_text().splitlines()[0]
    beside.write_text("time [s],w [m]\n0,1\n3,1\n")
    with pytest.raises(SimulationError, match="is in m, the model has it in N"):
        run_fmu(path, inputs={"w": str(beside)})
    with pytest.raises(UsageMistake, match="no input 'v'"):
        run_fmu(path, inputs={"v": str(beside)})


CLOCKED = """\
<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Counter" instantiationToken="{1}">
  <ScheduledExecution modelIdentifier="Counter"/>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
    <Clock name="tick" valueReference="1" causality="input" intervalVariability="constant" intervalDecimal="1.0"/>
    <Int32 name="count" valueReference="2" causality="output" clocks="1"/>
    <Int32 name="step" valueReference="3" causality="input" start="1"/>
    <Binary name="packet" valueReference="4" causality="input"><Start value="666f6f"/></Binary>
    <Binary name="echo" valueReference="5" causality="output"/>
  </ModelVariables>
  <ModelStructure>
    <Output valueReference="2"/>
    <Output valueReference="5" dependencies="4"/>
    <InitialUnknown valueReference="5" dependencies="4"/>
  </ModelStructure>
</fmiModelDescription>
"""


def packed(path: Path, *files: tuple[str, str]) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in files:
            archive.writestr(name, text)
    return path


def test_clocks_have_no_starts_and_what_they_tick_is_unknown_before(tmp_path: Path) -> None:
    """As in the Reference FMUs: section 2.4.7.5 and 2.4.8 of FMI 3.0."""
    assert not check_file(packed(tmp_path / "counter.fmu", ("modelDescription.xml", CLOCKED)))
    missing = CLOCKED.replace('<Start value="666f6f"/>', "")
    found = check_file(packed(tmp_path / "missing.fmu", ("modelDescription.xml", missing)))
    assert "missing start" in {finding.rule for finding in found}


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_a_file_that_is_there_twice_may_be_the_same(tmp_path: Path) -> None:
    own = ("modelDescription.xml", CLOCKED)
    assert not archive_findings(packed(tmp_path / "same.fmu", own, ("extra/a", "1"), ("extra/a", "1")))
    (finding,) = archive_findings(packed(tmp_path / "other.fmu", own, ("extra/a", "1"), ("extra/a", "2")))
    assert "two files" in finding.text


def test_texts_and_variables_that_are_not_there_are_not_compared() -> None:
    table = 'time,x,on,name,packet,v\n0,1,false,"Set me!",666f6f,1 2\n1,2,true,"Set me!",666f6f,3 4\n'
    with pytest.raises(ValueError, match="Set"):
        parse_reference("r.csv", table)
    found = parse_reference("r.csv", table, {"x", "on", "v"})
    assert {name: values.tolist() for name, values in found.columns.items()} == {
        "x": [1, 2],
        "on": [0, 1],
        "v[1]": [1, 3],
        "v[2]": [2, 4],
    }


@pytest.mark.slow
def test_rows_of_eulers_method_may_be_a_part_of_its_steps(tmp_path: Path) -> None:
    """The Reference FMUs write every tenth step of Euler's method."""
    path = exported(SWING, "swing", tmp_path)
    h, x, v, rows = 0.005, 1.0, 0.0, ["time,x"]
    for k in range(401):
        if k % 10 == 0:
            rows.append(f"{k * h:.12g},{x:.12g}")
        x, v = x + h * v, v - h * 4 * x
    report = check_fmu(with_reference(path, "\n".join(rows) + "\n", tmp_path))
    (line,) = [line for line in report.lines if line.what == "ModelExchange reference"]
    assert line.passed and "steps of 0.005" in line.detail
