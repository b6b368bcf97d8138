"""The Python interface."""

from __future__ import annotations

import math
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from c_programs import build

import mechc
from mechc.requests.parse_values import UsageMistake

PENDULUM = """\
model Pendulum
  structural parameter Integer n = 2 "pendulums side by side";
  parameter l = 1 m;
  parameter g = 9.81 m/s^2;
  coordinate Angle th[n] = 10 deg;
  kinetic sum(1/2*1 kg*l^2*der(th[i])^2 for i in 1:n);
  potential sum(-1 kg*g*l*cos(th[i]) for i in 1:n);
  experiment(stop = 2 s);
  experiment three(n = 3, stop = 1 s);
  experiment family(n in {1, 2, 3}, l in {1, 2} m, stop = 0.1 s);
end Pendulum;
"""


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> mechc.Model:
    path = tmp_path_factory.mktemp("api") / "pendulum.mech"
    path.write_text(PENDULUM)
    return mechc.load(path)


def test_importing_costs_nothing() -> None:
    program = "import sys, mechc; print([m for m in ('numpy', 'lark', 'mechc.api') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_names() -> None:
    assert set(mechc.__all__) <= set(dir(mechc))
    with pytest.raises(AttributeError, match="'mechc' has no attribute 'simulate'"):
        _ = mechc.simulate


def test_a_model_describes_itself(model: mechc.Model) -> None:
    assert model.name == "Pendulum" and repr(model) == "<mechc model Pendulum>"
    assert [c.name for c in model.coordinates] == ["th[1]", "th[2]"]
    assert [(p.name, p.unit) for p in model.parameters] == [("l", "m"), ("g", "m/s^2")]
    assert dict(model.structural_parameters) == {"n": 2}
    assert model.experiments == ("", "three", "family")


def test_simulate(model: mechc.Model) -> None:
    solution = model.simulate(set={"th": [0.01, 0.02], "l": "100 cm"}, tolerance=1e-10)
    assert solution.time[-1] == 2.0
    omega = math.sqrt(9.81)  # the pendulum is linear to 0.01^2/16 of its frequency
    np.testing.assert_allclose(solution["th[1]"], 0.01 * np.cos(omega * solution.time), atol=1e-6)
    assert solution.unit("th[2]") == "rad"
    assert solution(0.5)["th[2]"] == pytest.approx(0.02 * math.cos(omega * 0.5), abs=1e-5)
    assert solution.accuracy.error is not None
    assert next(iter(solution.to_dataframe().columns)) == "th[1] [rad]"
    assert len(solution.plot().axes) >= 4


def test_a_text_without_the_ending_of_a_picture_names_what_is_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    solution = mechc.loads(
        "model M dimensionless; coordinate r = 1; coordinate s = 2; kinetic der(r)^2 + der(s)^2; "
        "potential r^2 + s^2; experiment(stop = 1); end M;"
    ).simulate()
    (axes,) = solution.plot("r:s").axes
    line = axes.lines[0]
    assert line.get_xdata()[0] == 1 and line.get_ydata()[0] == 2
    with pytest.raises(KeyError, match="there is no 'p'"):
        solution.plot("p")
    with pytest.raises(ValueError, match="has no ending of a picture"):
        solution.plot(Path("r:s"))
    assert not list(tmp_path.iterdir())
    solution.plot("p.svg")
    assert (tmp_path / "p.svg").read_bytes().startswith(b"<?xml")


def test_vectors_are_arrays_with_their_elements_as_columns(model: mechc.Model) -> None:
    solution = model.simulate(stop=0.1, estimate_error=False)
    np.testing.assert_array_equal(
        solution["th"], np.column_stack([solution["th[1]"], solution["th[2]"]]), strict=True
    )
    assert solution["der(th)"].shape == (len(solution.time), 2) and solution(0.05)["th"].shape == (2,)
    assert solution.unit("th") == "rad" and list(solution.columns(["th"])) == ["time", "th[1]", "th[2]"]
    assert len(solution.plot(names=["th"]).axes) == 1
    for ask in (solution.__getitem__, solution.unit, lambda name: solution.plot(names=[name])):
        with pytest.raises(KeyError, match=r"there is no 'de\(th\)'; did you mean 'der\(th"):
            ask("de(th)")


def test_a_data_frame_without_pandas_says_how_to_get_it(
    model: mechc.Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match=r"needs pandas: pip install pandas"):
        model.simulate(stop=0.1, estimate_error=False).to_dataframe()


def test_a_solution_in_words_and_in_a_notebook(model: mechc.Model) -> None:
    solution = model.simulate(stop=0.1)
    assert str(solution).startswith("Pendulum: completed at time = 0.1 s\n")
    assert repr(solution) == "<mechc solution of Pendulum: completed, 500 times, 7 quantities>"
    assert solution.plot()._repr_png_().startswith(b"\x89PNG")


def test_models_and_results_reach_other_processes(model: mechc.Model) -> None:
    longer = model.with_values({"l": 4.0, "n": 1})
    there = pickle.loads(pickle.dumps(longer))
    assert dict(there.structural_parameters) == {"n": 1} and there.settings == {"l": 4.0}
    assert pickle.loads(pickle.dumps(longer)).compilation is there.compilation, "compiled once for all tasks"
    solution = longer.simulate(stop=0.1)
    back = pickle.loads(pickle.dumps(solution))
    np.testing.assert_array_equal(back["th[1]"], there.simulate(stop=0.1)["th[1]"])
    assert back.report == solution.summary() and back.unit("der(th[1])") == "rad/s"


def test_structural_values_compile_again_once(model: mechc.Model) -> None:
    three = model.with_values({"n": 3})
    assert len(three.coordinates) == 3 and len(model.coordinates) == 2
    assert model.with_values({"n": 3}).compilation is three.compilation
    assert three.simulate(stop=0.1, estimate_error=False)["th[3]"][0] == pytest.approx(math.radians(10))
    assert "th[3]" in model.simulate(experiment="three", estimate_error=False)


def test_values_that_were_set_stay_with_the_model_they_were_set_on(model: mechc.Model) -> None:
    longer = model.with_values({"l": 4.0})
    assert longer.simulate(stop=0.1).parameters["l"] == 4.0
    assert model.simulate(stop=0.1).parameters["l"] == 1.0
    assert longer.with_values({"n": 3}).simulate(stop=0.1).parameters["l"] == 4.0
    assert model.with_values({"n": 3}).simulate(stop=0.1).parameters["l"] == 1.0


def test_load_with_values(tmp_path: Path) -> None:
    path = tmp_path / "p.mech"
    path.write_text(PENDULUM.replace("Integer n = 2", "Integer n"))
    with pytest.raises(mechc.CompileError):
        mechc.load(path)
    assert len(mechc.load(path, set={"n": 4, "l": "2 m"}).coordinates) == 4


def test_sweeps_over_parameters_and_structure(model: mechc.Model) -> None:
    sweep = model.sweep(experiment="family", estimate_error=False)
    assert [dict(p) for p in sweep.points] == [
        {"n": float(n), "l": length} for n in (1, 2, 3) for length in (1.0, 2.0)
    ]
    assert [len([k for k in s if k.startswith("th[")]) for s in sweep.solutions] == [1, 1, 2, 2, 3, 3]
    assert [s.parameters["l"] for s in sweep.solutions] == [1.0, 2.0] * 3


@pytest.mark.parametrize(
    "wrong",
    [
        {"l": 2.0},
        {"tolerance": "tight"},
        {"set": {"n": [1, 2]}},
        {"set": {"ll": 1}},
        {"set": {"l": "1 s"}},
        {"experiment": "four"},
        {"stop": "soon"},
    ],
)
def test_mistakes(model: mechc.Model, wrong: dict[str, object]) -> None:
    with pytest.raises(UsageMistake):
        model.simulate(**wrong)  # type: ignore[arg-type]


def test_loads_reports_diagnostics() -> None:
    with pytest.raises(mechc.CompileError) as caught:
        mechc.loads("model A parameter m = 1 kg; kinetic m; end A;", name="a.mech")
    (found,) = caught.value.diagnostics
    assert found.span is not None and found.span.file.name == "a.mech"


def test_the_text_of_an_error_says_all() -> None:
    with pytest.raises(mechc.CompileError) as caught:
        mechc.loads("parameter m = 1 kg;\npotential m;\nparameter m = 2 kg;", name="a.mech")
    text, whole = str(caught.value), mechc.render(caught.value.diagnostics)
    for d in caught.value.diagnostics:
        assert all(
            part in text for part in (d.code, d.message, d.caption, d.help, *(x.text for x in d.labels))
        )
    for place in ("a.mech:3:11",):
        assert place in text and place in whole
    assert "\n  = help: " in text and "again here" in text and "first here" in text


@pytest.mark.parametrize(
    ("option", "meant"), [("tol", "tolerance"), ("stop_time", "stop"), ("tEnd", "stop"), ("solver", "method")]
)
def test_options_by_their_names_elsewhere(model: mechc.Model, option: str, meant: str) -> None:
    with pytest.raises(UsageMistake, match=f"that is called '{meant}' here"):
        model.simulate(**{option: 1})  # type: ignore[arg-type]


def test_compile_to_python_and_c(model: mechc.Model, tmp_path: Path) -> None:
    (module,) = model.compile("python", tmp_path / "pendulum.py")
    done = subprocess.run([sys.executable, str(module)], capture_output=True, text=True, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    files = {path.name for path in model.compile("c", tmp_path / "pendulum_c")}
    assert {"pendulum.c", "main.c", "model.h", "solver.h", "dop853.c"} <= files
    with pytest.raises(UsageMistake, match="no target 'fortran'"):
        model.compile("fortran")


def test_the_c_files_build_and_run(model: mechc.Model, tmp_path: Path) -> None:
    from mechc.runtime.native.build import find_compiler

    compiler = find_compiler()
    if compiler is None:
        pytest.skip("needs a C compiler")
    model.compile("c", tmp_path)
    sources = sorted(path.name for path in tmp_path.glob("*.c"))
    flags = ["-std=c11", "-O1", "-Wall", "-Wextra", "-Werror"]
    build = [*compiler.command, *flags, "-o", "pendulum", *sources, "-lm"]
    subprocess.run(build, cwd=tmp_path, check=True)
    done = subprocess.run(
        [str(tmp_path / "pendulum"), "2", "1e-9"], capture_output=True, text=True, check=True
    )
    header, *rows = done.stdout.splitlines()
    assert header.startswith("time [s],th[1] [rad],") and len(rows) == 501
    last = [float(cell) for cell in rows[-1].split(",")]
    expected = model.simulate(tolerance=1e-9)
    assert last[:2] == pytest.approx([2.0, expected["th[1]"][-1]], abs=1e-7)


def test_the_main_program_in_c_has_a_stop_time_where_the_model_says_none() -> None:
    from mechc.exporting import Defaults, defaults_of

    assert defaults_of(
        mechc.loads("coordinate x = 1; kinetic 1/2*1 kg*1 m^2*der(x)^2;").problem()
    ) == Defaults(tolerance=1e-8)


LEAN = "coordinate x = 1 m; initial der(x) = -0.3 m/s; kinetic 1/2*1 kg*der(x)^2; potential 1/2*4 N/m*x^2;"
EVENTS, IMPLICIT, CONSERVING = (
    {"hybrid.c", "impacts.c", "locate.c"},
    {"radau5.c", "newton.c"},
    {"gauss.c", "lobatto.c"},
)


@pytest.fixture(scope="module")
def objects(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("objects")


@pytest.mark.parametrize(
    ("text", "present", "absent"),
    [
        (
            "experiment(stop = 1 s);",
            {"dop853.c", "solver.h"},
            {*EVENTS, *IMPLICIT, *CONSERVING, "verlet.c", "rk4.c"},
        ),
        pytest.param(
            "contact c: x; experiment(stop = 1 s);",
            {"dop853.c", *EVENTS},
            {*IMPLICIT, *CONSERVING, "rk4.c"},
            marks=pytest.mark.slow,
        ),
        ('experiment(stop = 1 s, method = "radau5");', IMPLICIT, {*EVENTS, *CONSERVING, "dop853.c"}),
        pytest.param(
            'experiment(stop = 1 s, method = "gauss4", step = 10 ms);',
            {"gauss.c"},
            {*EVENTS, "radau5.c", "dop853.c"},
            marks=pytest.mark.slow,
        ),
        (
            'experiment(stop = 1 s, method = "verlet", step = 0.1 ms);',
            {"verlet.c"},
            {*EVENTS, "radau5.c", "dop853.c"},
        ),
        pytest.param(
            'experiment(stop = 1 s, method = "dop853");',
            {"dop853.c"},
            {*EVENTS, *IMPLICIT, *CONSERVING},
            marks=pytest.mark.slow,
        ),
    ],
)
def test_the_c_files_are_what_model_and_method_need(
    text: str, present: set[str], absent: set[str], tmp_path: Path, objects: Path
) -> None:
    """And they are whole: the program is built, and its last row is that of a run."""
    from mechc.runtime.native.build import find_compiler
    from mechc.runtime.results.files import read_results

    model = mechc.loads(LEAN + text)
    files = {path.name for path in model.compile("c", tmp_path)}
    assert present <= files and not absent & files
    if find_compiler() is None:
        pytest.skip("needs a C compiler")
    table = subprocess.run([build(tmp_path, objects)], capture_output=True, text=True, check=True).stdout
    (tmp_path / "c.csv").write_text(table)
    own, here = read_results(tmp_path / "c.csv"), model.simulate(estimate_error=False)
    assert own["x"][-1] == pytest.approx(here["x"][-1], abs=1e-6)


def test_everything_kept_is_the_whole_kernel(tmp_path: Path) -> None:
    from mechc.compiler.equations.needs import EVERYTHING
    from mechc.runtime.methods import KERNEL_METHODS

    files = {path.name for path in mechc.loads(LEAN, keep=EVERYTHING).compile("c", tmp_path)}
    assert {row.file or f"{name}.c" for name, row in KERNEL_METHODS.items()} | EVENTS <= files


AWKWARD = """
model Awkward
  parameter c = 0.1 N.s/m;
  input Force u[2] = {1, 2} N;
  coordinate Length r[2, 2] = {{1, 2}, {3, 4}} cm;
  kinetic sum(1/2*1 kg*der(r[i, j])^2 for i in 1:2 for j in 1:2);
  damping c on r[1, 1];
  force u[1] on r[1, 2];
  output a[1, 2] = {{r[1, 1], r[1, 2]}};
  experiment(stop = 1 s);
end Awkward;
"""


def test_the_c_program_writes_the_table_that_a_run_writes(tmp_path: Path) -> None:
    """Names with commas, accounts that are states and outputs; words that are not numbers."""
    from mechc.runtime.native.build import find_compiler
    from mechc.runtime.results.files import read_results

    compiler = find_compiler()
    if compiler is None:
        pytest.skip("needs a C compiler")
    model = mechc.loads(AWKWARD)
    model.compile("c", tmp_path)
    build = [*compiler.command, "-std=c11", "-O1", "-Wall", "-Wextra", "-Werror", "-o", "awkward"]
    subprocess.run([*build, *sorted(p.name for p in tmp_path.glob("*.c")), "-lm"], cwd=tmp_path, check=True)

    def call(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([str(tmp_path / "awkward"), *arguments], capture_output=True, text=True)

    (tmp_path / "c.csv").write_text(call().stdout)
    own, here = read_results(tmp_path / "c.csv"), model.simulate()
    assert [n for n in here if n not in ("u[1]", "u[2]")] == list(own)
    for name in own:
        assert own.unit(name) == here.unit(name)
        np.testing.assert_allclose(own[name][-1], here[name][-1], rtol=1e-7, atol=1e-9)
    for wrong in (["abc"], ["1s"], [""], ["-1"], ["nan"], ["1", "loose"], ["1", "2"], ["1", "1e-9", "x"]):
        done = call(*wrong)
        assert (done.returncode, done.stdout) == (2, "") and done.stderr, wrong


def test_a_written_input_is_read_again(tmp_path: Path) -> None:
    model = mechc.loads(AWKWARD)
    given = model.simulate(set={"u[1]": 3})
    given.save(tmp_path / "u.csv", ["u[1]"])
    again = model.simulate(inputs={"u[1]": str(tmp_path / "u.csv")})
    assert again["r[1,2]"][-1] == pytest.approx(given["r[1,2]"][-1], rel=1e-9) == 0.02 + 1.5
    given.save(tmp_path / "both.csv", ["u[1]", "u[2]"])
    both = model.simulate(inputs={"u": str(tmp_path / "both.csv")})
    assert both["u[1]"][-1] == 3 and both["u[2]"][-1] == 2
    with pytest.raises(mechc.SimulationError, match=r"has no column 'u\[2\]', which 'u' stands for too"):
        model.simulate(inputs={"u": str(tmp_path / "u.csv")})
    with pytest.raises(mechc.SimulationError, match=r"^the data has no column 'u\[2\]'"):
        model.simulate(inputs={"u": ([0, 1], [1, 1])})


CELLS = """
model Cell
  parameter m = 1 kg;
  coordinate x = 1 m;
  kinetic 1/2*m*der(x)^2;
  potential 1/2*4 N/m*x^2;
end Cell;
model Grid
  Cell grid[2, 2];
  coordinate Length r[2] = {1, 2} m;
  kinetic 1/2*1 kg*dot(der(r), der(r));
  experiment plain(stop = 1 s);
  experiment line(r[1] in {3, 4} m, der(r[2]) in {0, 5} m/s, stop = 1 s);
end Grid;
"""


def test_settings_of_all_components_and_of_single_ones() -> None:
    grid = mechc.loads(CELLS).with_values({"grid.m": "4 kg", "grid[2, 1].m": 1})
    last = grid.simulate(experiment="plain").final()
    slow, fast = math.cos(1), math.cos(2)  # sqrt(4 N/m / 4 kg), sqrt(4 N/m / 1 kg)
    found = [last[f"grid[{i},{j}].x"] for i in (1, 2) for j in (1, 2)]
    assert found == pytest.approx([slow, slow, fast, slow], abs=1e-8)
    assert grid.with_values({"grid.m": 1}).settings == {f"grid[{i},{j}].m": 1 for i in (1, 2) for j in (1, 2)}


def test_sweeps_over_elements_and_rates() -> None:
    sweep = mechc.loads(CELLS).sweep(experiment="line", estimate_error=False)
    assert [dict(p) for p in sweep.points] == [
        {"r[1]": r, "der(r[2])": v} for r in (3.0, 4.0) for v in (0.0, 5.0)
    ]
    found = [(s.final()["r[1]"], s.final()["r[2]"]) for s in sweep.solutions]
    assert found == [pytest.approx((r, 2 + v), abs=1e-9) for r in (3, 4) for v in (0, 5)]


def test_answers_print_as_the_command_line_tells_them(model: mechc.Model) -> None:
    from mechc.runtime.native.build import find_compiler

    found = model.study("modes", at="equilibrium")
    assert repr(found).startswith("<mechc modes of ") and "frequency" in str(found)
    if find_compiler() is not None:
        members = model.ensemble(vary={"l": "0.5 m .. 2 m, 3"})
        assert repr(members).startswith("<mechc ensemble of ") and "of 3 members: 3 completed" in str(members)
        assert "l" in list(members)


def test_what_is_written_is_named_after_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "two-bars.mech"
    file.write_text(PENDULUM)
    assert mechc.load(file).compile("python")[0].name == "two_bars.py"
    chosen = mechc.load(file, model="Pendulum")
    assert chosen.compile("python")[0].name == "pendulum.py"
    assert mechc.loads(PENDULUM).compile("python")[0].name == "pendulum.py"
