"""Experiments that set structural parameters: what begins with one has its equations, too, not those of the declared values."""

from __future__ import annotations

import csv
import subprocess
from pathlib import Path

import numpy as np
import pytest
from c_programs import build
from click.testing import CliRunner
from differentiable_modules import module

import mechc
from mechc.cli.main import mechc as command_line
from mechc.document.contents import contents
from mechc.presentation.sweep_report import sweep_report
from mechc.requests.parse_values import UsageMistake
from mechc.runtime.native.build import find_compiler

TEXT = """import mech.planar.*;
model Weights "4 kg on 4 N/m: cos(t); 1 kg as declared: cos(2 t)"
  structural parameter Integer n = 1;
  parameter m = 1 kg;
  gravity {0, -10} m/s^2;
  coordinate Length x = 1 m;
  kinetic 1/2*n*m*der(x)^2;
  potential 1/2*4 N/m*x^2;
  Particle weight[n](m = m);
  Weld pin[i in 1:n](world -> weight[i].a);
  experiment(stop = 1 s, n = 4);
  experiment declared(stop = 1 s);
end Weights;
"""


@pytest.fixture(scope="module")
def weights() -> mechc.Model:
    return mechc.loads(TEXT)


def test_functions(weights: mechc.Model) -> None:
    assert weights.functions.mass_matrix(weights.functions.start) == pytest.approx(4)


def test_a_python_module(weights: mechc.Model, tmp_path: Path) -> None:
    """A run at 1e-8 of a motion whose errors do not grow, in some ten steps."""
    (path,) = weights.compile("python", tmp_path / "weights.py")
    assert module(path).simulate()["x"][-1] == pytest.approx(np.cos(1), abs=1e-7)


@pytest.mark.parametrize("target", ["casadi", "jax"])
def test_modules_that_do_not_run(weights: mechc.Model, target: str, tmp_path: Path) -> None:
    (path,) = weights.compile(target, tmp_path / "weights.py")
    assert '"weight[4].m"' in path.read_text(encoding="utf-8")


@pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")
def test_a_program(weights: mechc.Model, tmp_path: Path) -> None:
    weights.compile("c", tmp_path)
    rows = subprocess.run([build(tmp_path, tmp_path)], capture_output=True, text=True, check=True).stdout
    last = list(csv.DictReader(rows.splitlines()))[-1]
    assert float(last["x [m]"]) == pytest.approx(np.cos(1), abs=1e-7)


def test_equations(tmp_path: Path) -> None:
    file = tmp_path / "weights.mech"
    file.write_text(TEXT)
    assert "0 = 4*m*x'' + 4*x" in CliRunner().invoke(command_line, ["equations", str(file)]).output


@pytest.mark.parametrize(("experiment", "n"), [(None, 4), ("declared", 1)])
def test_a_report(weights: mechc.Model, experiment: str | None, n: int) -> None:
    """Equations of the experiment, and the forces of all its joints: each holds 1 kg."""
    text = str(contents(weights, "", experiment=experiment)[0])
    assert f"pin[{n}]" in text
    assert f"pin[{n + 1}]" not in text
    assert ("4*m*x'' + 4*x" in text) == (n == 4)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--target", "c", "--experiment", "declared"), "--experiment is of --target fmu and web, not of c"),
        (("--target", "python", "--fmi", "2"), "--fmi is of --target fmu, not of python"),
        (("--target", "web", "--no-check"), "--check/--no-check is of --target fmu, not of web"),
        (("--target", "fmu", "--recorded"), "--recorded is of --target web, not of fmu"),
    ],
)
def test_options_of_another_target(options: tuple[str, ...], said: str, tmp_path: Path) -> None:
    file = tmp_path / "weights.mech"
    file.write_text(TEXT)
    done = CliRunner().invoke(command_line, ["compile", str(file), *options])
    assert done.exit_code == 2
    assert said in done.output


ROWS = """
model Block
  structural parameter Integer k = 2;
  coordinate Length x[k] = {1 m for i in 1:k};
  kinetic sum(1/2*1 kg*der(x[i])^2 for i in 1:k);
end Block;
model Row
  Block block[2];
end Row;
model Rows
  structural parameter Integer n = 2;
  Row row[n];
  experiment(stop = 1 s);
  experiment all(row.block.k = 3, stop = 1 s);
  experiment more(n = 3, row.block.k = 1, row[3].block.k = 4, stop = 1 s);
  experiment some(row[2].block.k in {1, 3}, stop = 1 s);
end Rows;
"""


def _sizes(model: mechc.Model, experiment: str | None = None, set: dict[str, int] | None = None) -> list[int]:
    """How many coordinates each block has."""
    solution = model.simulate(experiment=experiment, set={**(set or {})})
    names = [entry.name for entry in solution.quantities.values() if entry.kind == "coordinate"]
    blocks = [f"row[{i}].block[{j}]" for i in (1, 2, 3) for j in (1, 2)]
    return [sum(name.startswith(f"{block}.") for name in names) for block in blocks]


def test_a_name_without_an_index_stands_for_the_structural_parameters_of_all_components() -> None:
    model = mechc.loads(ROWS)
    assert _sizes(model, experiment="all") == [3, 3, 3, 3, 0, 0]
    assert _sizes(model, experiment="more") == [1, 1, 1, 1, 4, 4], "also of components that only it has"
    assert [_sizes(model, experiment="all", set={"row.block[1].k": 1})] == [[1, 3, 1, 3, 0, 0]]
    assert _sizes(model, set={"row.block.k": 3}) == [3, 3, 3, 3, 0, 0]
    assert _sizes(model, set={"row.block.k": 3, "row[1].block[2].k": 1}) == [3, 1, 3, 3, 0, 0]
    assert _sizes(model, set={"n": 3, "row[3].block.k": 4}) == [2, 2, 2, 2, 4, 4]
    assert _sizes(model.with_values({"row[1].block[2].k": 1}), set={"row.block.k": 3}) == [3, 3, 3, 3, 0, 0]
    assert _sizes(model.with_values({"row.block.k": 1}), experiment="more") == [1, 1, 1, 1, 1, 1], (
        "values from outside win over those of an experiment"
    )
    points = model.sweep(experiment="some")
    assert [[*point.values()] for point in points.points] == [[1], [3]]


def test_structural_settings_follow_the_others_of_their_experiment() -> None:
    """As other settings do: ``n`` is 3, in names, too."""
    model = mechc.loads(
        ROWS.replace("Row row[n];", "structural parameter Integer w = 1; parameter a = 1 kg; Row row[n];")
        .replace(
            "n = 3, row.block.k = 1, row[3].block.k = 4", "n = 3, w = n + 1, a = n*1 kg, row[n].block.k = w"
        )
        .replace("row.block.k = 3", "w = 2*w")
    )
    assert _sizes(model, "more") == [2, 2, 2, 2, 4, 4]
    with pytest.raises(UsageMistake, match="experiment 'all' do not settle"):
        model.simulate(experiment="all")


def test_settings_of_components_follow_a_swept_size() -> None:
    """Each value has its last row, which the declared size need not have."""
    text = ROWS.replace(
        "row[2].block.k in {1, 3}", "n in {2, 3}, row[n].block[1].k = 4, row[n].block[2].x[1] = 7 m"
    )
    runs = mechc.loads(text).sweep(experiment="some").solutions
    assert [run["row[2].block[2].x[1]"][0] for run in runs] == [7, 1]
    assert runs[1]["row[3].block[2].x[1]"][0] == 7
    for run, last in zip(runs, (2, 3), strict=True):
        names = [name for name in run.quantities if "block[1]" in name and not name.startswith("der")]
        assert sum(name.startswith(f"row[{last}]") for name in names) == 4
        assert all(sum(name.startswith(f"row[{row}]") for name in names) == 2 for row in range(1, last))


def test_the_table_of_a_sweep_leaves_open_what_a_run_does_not_have() -> None:
    """It ended with a message about a bug where a later run had less components than the first."""
    text = ROWS.replace("row[2].block.k in {1, 3}", "n in {2, 1}")
    rows = sweep_report(mechc.loads(text).sweep(experiment="some")).splitlines()
    head, first, second = (row.replace(" [m]", "").split() for row in rows[2:5])
    place = head.index("row[2].block[1].x[1]")
    assert [first[place], second[place]] == ["1", "-"]
