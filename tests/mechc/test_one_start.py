"""One start for all targets: C programs begin as a run does, and go on like it, row by row."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from c_programs import build, check_rows, rows_of_program
from slow_params import slow_but

import mechc
from mechc.fmu.export import FmuOptions, export_fmu
from mechc.requests.parse_values import UsageMistake
from mechc.runtime.native.build import find_compiler

EXAMPLES = Path(__file__).parents[2] / "examples"
CIRCLE = (
    "coordinate x = 3 m;coordinate y ~ 3 m;kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);"
    "constraint rod: sqrt(x^2 + y^2) = 5 m;experiment(stop = 1 s);"
)
PARTS = 13

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")


@pytest.fixture(scope="module")
def objects(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files of the kernel are the same in many programs: each is compiled once."""
    return tmp_path_factory.mktemp("objects")


@pytest.mark.slow
def test_known_values_stay(tmp_path: Path, objects: Path) -> None:
    names, rows = rows_of_program(mechc.loads(CIRCLE), tmp_path, objects)
    assert names[:3] == ["time", "x", "y"] and rows[0, :3].tolist() == [0, 3, 4]


@pytest.mark.parametrize(
    "name", slow_but(["four_bar"], ["four_bar", "heavy_top_rotation", "sampled_controller"])
)
def test_rows(name: str, tmp_path: Path, objects: Path) -> None:
    check_rows(mechc.load(EXAMPLES / f"{name}.mech"), tmp_path, objects)


@pytest.mark.slow
@pytest.mark.parametrize("part", range(PARTS))
def test_rows_of_all_examples(part: int, tmp_path: Path, objects: Path) -> None:
    for path in sorted(EXAMPLES.glob("*.mech"))[part::PARTS]:
        try:
            check_rows(mechc.load(path), tmp_path / path.stem, objects)
        except UsageMistake as refused:
            if "drives a coordinate" not in str(refused):  # a program is told no derivatives of inputs
                raise


@pytest.mark.parametrize("every", slow_but([", every = 0.1 s"], ["", ", every = 0.1 s"]))
def test_a_motion_without_duration_is_one_row(every: str, tmp_path: Path, objects: Path) -> None:
    """As of a run; also where the stop time is said to the program."""
    text = f"parameter a = 2 m;coordinate x = 3 m;kinetic 1/2*1 kg*der(x)^2;output w = a*x;experiment(stop = 0 s{every});"
    model = mechc.loads(text)
    own = check_rows(model, tmp_path / "own", objects)
    names, _ = rows_of_program(model, tmp_path / "own", objects)
    assert own.shape[0] == 1 and own[0, [0, 1, names.index("w")]].tolist() == [0, 3, 6]
    moving = mechc.loads(text.replace("stop = 0", "stop = 1"))
    _, rows = rows_of_program(moving, tmp_path / "moving", objects, "0")
    assert rows.tolist() == own.tolist()


def test_values_that_are_set_and_inputs_of_experiments(tmp_path: Path, objects: Path) -> None:
    """Settings of the caller go before those of the experiment; initial values that follow from others follow them."""
    text = (
        "parameter k = 4 N/m;input Force F = 0 N;coordinate x = 1 m;coordinate y = 2*x;"
        "kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);potential 1/2*k*(x^2 + y^2);force F on x;"
        "experiment(stop = 1 s, k = 9 N/m, F = 3 N, x = 5 m);"
    )
    file = tmp_path / "pair.mech"
    file.write_text(text)
    check_rows(mechc.load(file), tmp_path / "own", objects)
    other = mechc.load(file, set={"x": "2 m", "k": 1})
    rows = check_rows(other, tmp_path / "set", objects)
    assert rows[0, 1:3].tolist() == [2, 4]


def test_steps_without_a_row_of_the_output(tmp_path: Path, objects: Path) -> None:
    """Errors between the ends of steps bound these whether there is a row or not, as in a run: the same bits."""
    text = (
        "coordinate x = 1 m;coordinate y = 0 m;initial der(y) = 0.3 m/s;kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);"
        "potential -(1 J.m)/sqrt(x^2 + y^2);experiment(stop = 8 s, every = 3 s);"
    )
    model = mechc.loads(text)
    own = check_rows(model, tmp_path, objects)
    assert own[:, 0].tolist() == [0, 3, 6, 8]
    program = tmp_path / "program"
    run = subprocess.run([str(program), "9"], capture_output=True, text=True, check=True)
    assert [float(line.split(",")[0]) for line in run.stdout.splitlines()[1:]] == [0, 3, 6, 9]
    many = subprocess.run([str(program), "1e9"], capture_output=True, text=True, check=False)
    assert (many.returncode, many.stderr) == (2, "a row every 3 of 1e+09 are too many\n")


@pytest.mark.slow
def test_sizes_that_a_first_run_gives(tmp_path: Path, objects: Path) -> None:
    text = (
        "coordinate x = 0 m;kinetic 1/2*1 kg*der(x)^2;potential 1/2*1 N/m*x^2;"
        "force 1 N*cos(2 s^-1*time) on x;experiment(stop = 100 s);"
    )
    check_rows(mechc.loads(text), tmp_path, objects)


def test_sizes_that_states_reach_far_below_others(tmp_path: Path, objects: Path) -> None:
    """What x reaches among the rows of the program is its size, and none of z, to which the rules would lend it."""
    text = (
        "coordinate x = 0 m;coordinate y = 1e5 m;coordinate z = 0 m;initial der(x) = 1e-8 m/s;"
        "kinetic 1/2*1 kg*(der(x)^2 + der(y)^2 + der(z)^2);potential 1/2*40 N/m*x^2 + 1/2*1 N/m*y^2;"
        "force 10 kN*sin(1 s^-1*time) on z;experiment(stop = 10 s);"
    )
    check_rows(mechc.loads(text), tmp_path, objects)


def test_what_cannot_be_assembled_ends_the_program(tmp_path: Path, objects: Path) -> None:
    model = mechc.loads(CIRCLE)
    model.compile("c", tmp_path)
    main = tmp_path / "main.c"
    text = main.read_text()
    assert text.count("    mech_start_report made;") == 1
    apart = "    y0[0] = 6; given[0] = MECH_KNOWN;\n    mech_start_report made;"
    main.write_text(text.replace("    mech_start_report made;", apart))
    done = subprocess.run([build(tmp_path, objects)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "the initial state cannot be assembled: rod\n"


CRANK = (
    "model Crank parameter r = 0.1 m;parameter l = 0.3 m;coordinate Length s ~ 0.2 m;coordinate Angle phi = 40 deg;"
    "initial der(phi)*r = 0.2 m/s;kinetic 1/2*1 kg*der(s)^2 + 1/2*0.1 kg.m^2*der(phi)^2;"
    "constraint rod: (s - r*cos(phi))^2 + (r*sin(phi))^2 = l^2;experiment(stop = 1 s);end Crank;"
)


@pytest.mark.slow
def test_a_unit_whose_parameters_are_set_begins_as_a_run(tmp_path: Path) -> None:
    """The constraint, and a condition at the start that a unit did not meet with other parameters."""
    fmpy = pytest.importorskip("fmpy")
    model = mechc.loads(CRANK)
    (unit,) = export_fmu(
        model, tmp_path / "crank.fmu", FmuOptions("3", "cs", None, False, False, ("host",), False)
    )
    names = [q.name for q in model.problem().states]
    result = fmpy.simulate_fmu(
        str(unit), start_values={"r": 0.12}, output=names, stop_time=0.5, output_interval=0.1
    )
    run = model.simulate(stop=0.5, set={"r": 0.12}, estimate_error=False)
    for name in names:
        assert result[name][0] == pytest.approx(run[name][0], rel=1e-13), name
        assert result[name][-1] == pytest.approx(run[name][-1], rel=1e-6), name
