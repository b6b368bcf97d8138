"""The Python module on its own: short, needs NumPy and SciPy only, and gets the motion right."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from differentiable_modules import module, plain_module, plain_text
from sample_equations import chain, pendulum
from slow_params import slow_but

import mechc
from mechc.compiler.program import lower
from mechc.compiler.targets.python import load_arrays
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import load_functions

EXAMPLES = sorted((Path(__file__).parents[3] / "examples").glob("*.mech"))

SWING = """
model Swing
  parameter m = 1 kg;
  parameter l = 0.8 m;
  parameter J = m*l^2;
  parameter g = 9.81 m/s^2;
  input Torque push = 0 N.m;
  coordinate Angle theta = 60 deg;
  initial der(theta) = (0.1 m/s)/l;
  kinetic 1/2*J*der(theta)^2;
  potential -m*g*l*cos(theta);
  force push on theta;
  assert abs(theta) < 3 rad, "theta stays below 3 rad";
  experiment(stop = 2 s, push = 0.5 N.m);
end Swing;
"""


def written(model: mechc.Model, folder: Path) -> ModuleType:
    (path,) = model.compile("python", folder / "made.py")
    return module(path)


@pytest.fixture(scope="module")
def swing(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    return written(mechc.loads(SWING), tmp_path_factory.mktemp("swing"))


def test_a_model_of_one_coordinate_is_short(tmp_path: Path) -> None:
    """What runs a model was copied into each module: 629 lines."""
    text = "coordinate theta = 60 deg; kinetic 1/2*1 kg.m^2*der(theta)^2; potential -9.81 J*cos(theta); experiment(stop = 1 s);"
    (path,) = mechc.loads(text).compile("python", tmp_path / "pendulum.py")
    lines = path.read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 70 and "from numpy import cos, pi, sin" in lines
    assert "    return [der_theta, -9.81 * sin(theta)]" in lines


def test_it_needs_nothing_of_mechc(tmp_path: Path) -> None:
    (path,) = mechc.loads(SWING).compile("python", tmp_path / "m.py")
    with path.open("a", encoding="utf-8") as file:
        file.write(
            "\nimport sys\nmoved = simulate(0.5)\nprint(sorted({'mechc', 'lark'} & set(sys.modules)))\n"
        )
    done = subprocess.run([sys.executable, "-I", str(path)], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "[]\n", "")


def test_motions_agree_with_runs(swing: ModuleType) -> None:
    """Two integrators at 1e-8 for some swings: 1e-6."""
    model = mechc.loads(SWING)
    for values, start in (({}, None), ({"l": 1.1}, [0.4, 0.0, 0.0])):
        mine = swing.simulate(values=values, **({} if start is None else {"start": start}))
        given = {} if start is None else {"theta": start[0], "der(theta)": start[1]}
        run = model.simulate(set={**values, **given}, estimate_error=False)
        assert mine["time"][-1] == 2.0
        for name in ("theta", "der(theta)", "energy.total"):
            assert mine[name][-1] == pytest.approx(run[name][-1], rel=1e-6), name


def test_values_that_move_the_start_ask_for_one(swing: ModuleType) -> None:
    with pytest.raises(ValueError, match="other values may move the start"):
        swing.simulate(values={"l": 1.1})
    with pytest.raises(KeyError, match="no parameter \\['much'\\]"):
        swing.simulate(values={"much": 1.0}, start=[0.0, 0.0, 0.0])


def test_inputs_are_functions_of_time(swing: ModuleType) -> None:
    """J theta'' = 2 t with J = 0.64, from rest."""
    driven = swing.simulate(1.0, {"g": 0.0}, [0.0, 0.0, 0.0], signals={"push": lambda t: 2.0 * t})
    assert driven["theta"][-1] == pytest.approx(1 / (3 * 0.64), rel=1e-7)


def test_assertions_end_a_motion(swing: ModuleType) -> None:
    with pytest.raises(RuntimeError, match=r"at t = \d\.\d+: theta stays below 3 rad"):
        swing.simulate(start=[2.9, 20.0, 0.0])


def test_parameters_follow_others(swing: ModuleType) -> None:
    names = [name for name, _ in swing.PARAMETERS]
    assert swing.parameters({"l": 2.0})[names.index("J")] == 4.0
    assert swing.parameters({"l": 2.0, "J": 5.0})[names.index("J")] == 5.0


def test_constraints_begin_fulfilled(tmp_path: Path) -> None:
    """A point on a circle of 5 m; accelerations keep it there up to the tolerance."""
    made = written(
        mechc.loads(
            "coordinate x = 3 m;coordinate y ~ 3 m;kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);potential 9.81 N*y;"
            "constraint rod: sqrt(x^2 + y^2) = 5 m;experiment(stop = 3 s);"
        ),
        tmp_path,
    )
    assert made.START[:2] == pytest.approx([3, 4], abs=1e-14)
    found = made.simulate()
    np.testing.assert_allclose(np.hypot(found["x"], found["y"]), 5, rtol=1e-6)
    assert made.assembly(0.0, np.array([3.0, 4.0, 0.0, 0.0]), (), made.parameters()) == [0, 0]


def test_sizes_are_those_of_the_run(tmp_path: Path) -> None:
    """A motion of a nanometre in SI, at tolerances that refer to one."""
    text = "coordinate x = 1 nm; kinetic 1/2*1 kg*der(x)^2; potential 1/2*1 N/m*x^2; experiment(stop = 6 s);"
    found = written(mechc.loads(text), tmp_path).simulate()
    assert found["x"][-1] == pytest.approx(1e-9 * np.cos(6), rel=1e-6)


def test_what_switches_has_functions_but_no_motion(tmp_path: Path) -> None:
    """Indicators and rates of a mode in Python; a motion is refused in words."""
    model = mechc.load(next(p for p in EXAMPLES if p.stem == "bouncing_ball"))
    made = written(model, tmp_path)
    with pytest.raises(RuntimeError, match="events are found by mechc run, a C program"):
        made.simulate()
    functions = load_functions(problem := model.problem())
    case = prepare(problem, functions, SimulationOptions())
    found = made.rhs(0.0, case.y0, (), case.z, made.parameters())
    np.testing.assert_allclose(found, functions.rhs(0.0, case.y0, np.empty(0), case.z, case.p), rtol=1e-15)
    assert len(made.indicators(0.0, case.y0, (), case.z, made.parameters())) > 0


def test_the_motion_of_a_chain_over_arrays() -> None:
    generated = plain_module(lower(chain(2)))
    p, y = generated.parameters(), np.random.default_rng(1).normal(size=(4, 7))
    together = np.array(generated.rhs(0.0, y, (), p))
    apart = np.array([generated.rhs(0.0, column, (), p) for column in y.T]).T
    np.testing.assert_allclose(together, apart, rtol=1e-13)


def test_the_text_is_the_same_each_time() -> None:
    assert plain_text(lower(pendulum())) == plain_text(lower(pendulum()))


def test_the_text_of_the_pendulum_reads_well() -> None:
    text = plain_text(lower(pendulum()))
    assert "    return [der_theta, (torque - der_theta * b - k0 * sin(theta)) / J]\n" in text
    assert '    ("theta", "rad"),  # from the vertical\n' in text


def agrees(path: Path, folder: Path) -> None:
    """Compare rates and outputs of an example with those of its compiled code."""
    model = mechc.load(path)
    if model.is_curve:
        return
    made = written(model, folder)
    functions = load_functions(problem := model.problem())
    case = prepare(problem, functions, SimulationOptions(stop=made.STOP))
    given = (case.z,) if problem.discretes else ()
    p, u = made.parameters(), np.empty(0)
    if problem.inputs:
        u = np.array(made.inputs(case.begin, (), (), *given, p))
    np.testing.assert_allclose(made.START, case.y0, 1e-13, 1e-13)
    for name in ("rhs", "outputs"):
        function = getattr(functions, name)
        if function is None:
            continue
        expected = function(case.begin, case.y0, u, case.z, case.p)
        with np.errstate(all="ignore"):
            found = np.array(getattr(made, name)(case.begin, case.y0, u, *given, p))
        finite = np.isfinite(expected)
        assert (np.isfinite(found) == finite).all(), name
        size = max(1.0, np.max(abs(expected[finite]), initial=0.0))
        assert np.max(abs(found - expected)[finite], initial=0.0) <= 1e-11 * size, (path.stem, name)


@pytest.mark.parametrize(
    "name",
    slow_but(
        ["four_bar"],
        ["four_bar", "heavy_top_rotation", "stokes_drag", "bouncing_ball", "rolling_coin"],
    ),
)
def test_examples_agree_with_their_compiled_code(name: str, tmp_path: Path) -> None:
    agrees(next(path for path in EXAMPLES if path.stem == name), tmp_path)


def test_a_branch_that_is_not_taken_may_divide_by_zero(tmp_path: Path) -> None:
    """It raised ZeroDivisionError: Python divides numbers so, and computes both branches. a = 0.3 cos(t) without the spring."""
    text = """
    parameter M = 2 N.m;
    parameter k = 0 N.m/rad;
    coordinate Angle a = 0.3 rad;
    kinetic 1/2*1 kg.m^2*der(a)^2;
    force (if k > 0 then M/k*1 N.m/rad else if time > 0 s then -a*1 N.m/rad else -a*1 N.m/rad + 0 N.m*(1 s/time)) on a;
    experiment(stop = 1 s);
    """
    made = written(mechc.loads(text), tmp_path)
    assert made.simulate()["a"][-1] == pytest.approx(0.3 * np.cos(1), rel=1e-7)
    assert made.rhs(1.0, [0.3, 0.0, 0.0], (), made.parameters({"k": 4.0}))[1] == 0.5
    functions, parameters = load_arrays(mechc.loads(text).compilation.program)
    parameters(p := np.zeros(made_size(made)), np.zeros(made_size(made), np.uint8))
    time: Any = np.ones(1)  # one column of many
    assert functions["rhs"](time, np.array([[0.3], [0], [0]]), np.zeros(0), np.zeros(0), p)[1] == [-0.3]


def made_size(module: ModuleType) -> int:
    """Return the size of p: parameters and constants made of them."""
    return len(module.parameters())
