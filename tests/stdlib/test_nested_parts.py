"""Parts where people put them: in a part of an array, on a frame that is a name of a name, with parameters from other parts, driven by
a file; through the commands that run, export and linearise. SciPy goes the same ways by the laws that the parts state."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from nested_parts import CASES, drive_jacobian
from slow_params import slow_but

from mechc.cli.main import run
from mechc.runtime.native.build import find_compiler


def files(folder: Path, name: str) -> list[str]:
    """Write a model and the table of its input; return what a command is told."""
    case = CASES[name]
    (folder / "m.mech").write_text(case.text, encoding="utf-8")
    with (folder / "table.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([("time", case.input), *zip(case.times, case.values, strict=True)])
    return ["--input", f"{case.input}={folder / 'table.csv'}"]


def last_row(file: Path) -> dict[str, float]:
    head, *rows = csv.reader(file.read_text(encoding="utf-8").splitlines())
    return {name.split(" [")[0]: float(x) for name, x in zip(head, rows[-1], strict=True)}


def check(found: dict[str, float], name: str, share: float) -> None:
    """Compare the last row with SciPy, relative to 1 + the value."""
    case = CASES[name]
    known = case.known(case.times, case.values)
    assert found["time"] == pytest.approx(case.times[-1], abs=1e-12)
    told = {k: v for k, v in known.items() if k in found}
    assert len(told) >= 4, sorted(found)
    for k, v in told.items():
        assert found[k] == pytest.approx(v, abs=share * (1 + abs(v))), k


@pytest.mark.parametrize("name", slow_but(["Drives"], [*CASES]))
def test_runs(name: str, tmp_path: Path) -> None:
    """Largest difference: 2e-9, of the wheels whose motors meet their limits in kinks that no table knows."""
    out = tmp_path / "out.csv"
    assert (
        run(["run", str(tmp_path / "m.mech"), *files(tmp_path, name), "--model", name, "-o", str(out)]) == 0
    )
    check(last_row(out), name, 4e-9)


@pytest.mark.slow
@pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")
@pytest.mark.parametrize("name", CASES)
def test_exported_units(name: str, tmp_path: Path) -> None:
    """A unit holds its inputs over a communication step, which is off by half a step: that of two sizes of steps is taken off."""
    given, unit, out = files(tmp_path, name), tmp_path / "m.fmu", tmp_path / "out.csv"
    assert (
        run(["compile", str(tmp_path / "m.mech"), "--model", name, "--target", "fmu", "-o", str(unit)]) == 0
    )
    rows = []
    for every in ("0.002", "0.001"):
        assert run(["fmu", "run", str(unit), *given, "--every", every, "-o", str(out)]) == 0
        rows.append(last_row(out))
    wide, narrow = rows
    check({k: 2 * v - wide[k] for k, v in narrow.items()}, name, 1e-5)


def test_linearised_drives(tmp_path: Path) -> None:
    """SciPy's central differences of the rates are off by 1e-8 of the largest."""
    out = tmp_path / "out.json"
    told = ["study", "linearize", str(tmp_path / "m.mech"), *files(tmp_path, "Drives"), "--model", "Drives"]
    assert run([*told, "-o", str(out)]) == 0
    answer = json.loads(out.read_text(encoding="utf-8"))
    names = answer["states"]
    A = np.array(answer["A"])
    for k, known in drive_jacobian(CASES["Drives"].values[0]).items():
        part = f"drive[{k}]"
        order = [f"{part}.smooth.x[1]", f"{part}.smooth.x[2]", f"{part}.engine.angle", f"der({part}.engine.angle)", f"{part}.piston.s", f"der({part}.piston.s)"]  # fmt: skip
        places = [names.index(name) for name in order]
        assert A[np.ix_(places, places)] == pytest.approx(known, abs=1e-6 * np.abs(known).max())
