"""The generated module on its own: runs with NumPy only, and gets the motion right."""

from __future__ import annotations

import csv
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from compiled import compiled
from msgspec.structs import replace
from sample_equations import chain, equations, pendulum
from scipy.integrate import solve_ivp

from mechc.compiler.equations.model import Equations, Function
from mechc.compiler.graph import Graph
from mechc.compiler.program import lower
from mechc.compiler.targets.python import emit_python
from mechc.runtime.interface import Constraint, Experiment, Quantity, Setting


def module(model: Equations) -> Any:
    namespace: dict[str, Any] = {"__name__": "generated"}
    exec(emit_python(lower(model)), namespace)
    return SimpleNamespace(**namespace)


def run(path: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a module isolated from the environment and the current folder."""
    return subprocess.run([sys.executable, "-I", str(path), *arguments], capture_output=True, text=True)


def oscillator() -> Equations:
    """x'' = -k x with k swept over 1 and 4, x(0) = 2."""
    g = Graph()
    x, v, k = g.symbol("x"), g.symbol("v"), g.symbol("k")
    return equations(
        g,
        [
            Function("rhs", "", (v, g.neg(g.mul(k, x)))),
            Function("initial", "", (g.two, g.zero)),
            Function("outputs", "", (g.add(g.mul(k, g.mul(x, x)), g.mul(v, v)),)),
            Function("experiment_0", "", (g.constant(Fraction(1, 2)), g.constant(1))),
        ],
        name="Oscillator",
        states=[(x, Quantity("x", "coordinate", "m")), (v, Quantity("der(x)", "rate", "m/s"))],
        nv=1,
        parameters=[(k, Quantity("k", "parameter", "1/s2"), g.one)],
        outputs=[Quantity("e", "energy", "")],
        experiments=[
            Experiment(
                "",
                "",
                "experiment_0",
                ("every", "stop"),
                {},
                (),
                ((Setting("p", 0, False), (1.0, 4.0)),),
            )
        ],
    )


def test_the_module_runs_with_numpy_only(tmp_path: Path) -> None:
    path = tmp_path / "m.py"
    check = "\nimport sys\nprint(sorted({'mechc', 'scipy', 'sympy', 'lark'} & {m.split('.')[0] for m in sys.modules}))\n"
    path.write_text(emit_python(lower(pendulum())) + check)
    done = run(path)
    assert done.returncode == 0, done.stderr
    *table, modules = done.stdout.splitlines()
    assert modules == "[]"
    assert len(table) == 12
    assert table[0].split()[:3] == ["time", "[s]", "theta"]


def test_the_motion_of_the_double_pendulum() -> None:
    """Against SciPy at 1e-12; the bound is 100 tolerances for 5 s of a motion that is not chaotic yet."""
    generated = module(chain(2))
    motion = generated.simulate(5.0, 1e-9)
    p = generated.all_parameters({})
    reference = solve_ivp(
        lambda t, y: generated.rhs(t, y.tolist(), (), (), p),
        (0, 5),
        np.ones(4),
        "DOP853",
        rtol=1e-12,
        atol=1e-12,
    )
    found = [motion[name][-1] for name, *_ in generated.STATES]
    np.testing.assert_allclose(found, reference.y[:, -1], atol=1e-7)
    assert motion["time"].shape == (501,)


def test_the_method_has_order_five() -> None:
    """A hundredth of the tolerance, a fifth-order method: the error falls about a hundredfold."""
    generated = module(oscillator())
    errors = []
    for tolerance in (1e-5, 1e-7, 1e-9):
        motion = generated.simulate(20.0, tolerance, points=2)
        errors.append(abs(motion["x"][-1] - 2 * np.cos(20.0)))
    assert errors[1] < errors[0] / 30
    assert errors[2] < errors[1] / 30
    assert errors[2] < 1e-7


def test_sweeps_and_output_times(tmp_path: Path) -> None:
    path = tmp_path / "m.py"
    path.write_text(emit_python(lower(oscillator())))
    done = run(path, "-o", str(tmp_path / "rows.csv"))
    assert done.returncode == 0, done.stderr
    assert "k = 1" in done.stdout
    assert "k = 4" in done.stdout
    with open(tmp_path / "rows.csv", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    assert head == ["k", "time [s]", "x [m]", "der(x) [m/s]", "e"]
    assert [[float(v) for v in row[:2]] for row in rows] == [
        [k, t] for k in (1.0, 4.0) for t in (0.0, 0.5, 1.0)
    ]
    assert float(rows[-1][2]) == pytest.approx(2 * np.cos(2.0), abs=1e-6)


def test_an_account_of_energy_is_one_column(tmp_path: Path) -> None:
    path = tmp_path / "m.py"
    text = "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; damping 0.1 N.s/m on x; experiment(stop = 1 s);"
    path.write_text(emit_python(compiled(text).program))
    assert run(path, "-o", str(tmp_path / "rows.csv")).returncode == 0
    with open(tmp_path / "rows.csv", encoding="utf-8") as file:
        head, first, *_ = csv.reader(file)
    assert len(head) == len(set(head)) == len(first) and "energy.dissipated [J]" in head


def test_settings_of_experiments_inputs_and_values() -> None:
    """The experiment of the pendulum: theta = 1.2, l = l; with values of the caller going before."""
    generated = module(pendulum())
    motion = generated.simulate(1.0)
    assert motion["theta"][0] == 1.2
    assert motion["x"][0] == pytest.approx(0.8 * np.sin(1.2))
    motion = generated.simulate(1.0, values={"theta": 0.0, "l": 2.0, "b": 0.0, "torque": 0.0})
    assert np.all(motion["theta"] == 0.0)
    driven = generated.simulate(
        1.0, signals={"torque": lambda t: 2.0 * t}, values={"theta": 0.0, "g": 0.0, "b": 0.0}
    )
    # J theta'' = 2 t with J = 1.28
    assert driven["theta"][-1] == pytest.approx(1 / (3 * 1.28), rel=1e-7)


def test_command_line_mistakes_are_explained(tmp_path: Path) -> None:
    path = tmp_path / "m.py"
    path.write_text(emit_python(lower(pendulum())))
    assert "no parameter, state or input 'nothing'" in run(path, "--set", "nothing=1").stderr
    assert "'much' is no number" in run(path, "--set", "m=much").stderr
    done = run(path, "--set", "der(theta)=20")
    assert done.returncode == 1
    assert "theta stays below 3 rad" in done.stderr
    assert "Traceback" not in done.stderr
    path.write_text(emit_python(lower(chain(1))))
    assert "give a stop time" in run(path).stderr


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--every", "1e-9"], "a row every 1e-09 of 1 are too many"),
        (["--every", "0"], "the time between two rows is positive, it is 0"),
        (["--every", "-1"], "the time between two rows is positive, it is -1"),
        (["--every", "nan"], "the time between two rows is positive, it is nan"),
        (["--stop", "-1"], "the stop time -1 is no time from 0 on"),
        (["--stop", "nan"], "the stop time nan is no time from 0 on"),
        (["--stop", "inf"], "the stop time inf is no time from 0 on"),
        (["--tolerance", "0"], "the tolerance lies between 1e-14 and 1, it is 0"),
    ],
)
def test_times_that_have_no_rows_are_refused(options: list[str], words: str, tmp_path: Path) -> None:
    path = tmp_path / "m.py"
    path.write_text(emit_python(lower(oscillator())))
    done = run(path, *options)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", f"{words}\n")


def test_an_undefined_rate_is_named() -> None:
    """The motion of x' = -1/sqrt(x) ends at t = 2/3, where x is zero; a step beyond has no root."""
    g = Graph()
    x = g.symbol("x")
    model = equations(
        g,
        [Function("rhs", "", (g.neg(g.div(g.one, g.sqrt(x))),)), Function("initial", "", (g.one,))],
        states=[(x, Quantity("x", "state", "m"))],
        nx=1,
    )
    with pytest.raises(RuntimeError, match=r"at t = 0\.66\d*: the rate of x is undefined"):
        module(model).simulate(5.0)


def test_quaternions_stay_of_unit_length() -> None:
    """A constant rotation about the third axis with 2 rad/s, after 3 s."""
    g = Graph()
    q = [g.symbol(f"q{i}") for i in range(4)]
    rates = (g.neg(q[3]), q[2], g.neg(q[1]), q[0])
    model = replace(
        equations(
            g,
            [Function("rhs", "", rates), Function("initial", "", (g.two, g.zero, g.zero, g.zero))],
            states=[(s, Quantity(f"R[{i + 1}]", "coordinate", "")) for i, s in enumerate(q)],
        ),
        rotations=(0,),
    )
    motion = module(model).simulate(3.0, 1e-6)
    norm = sum(motion[f"R[{i}]"] ** 2 for i in range(1, 5))
    np.testing.assert_allclose(norm, 1.0, atol=1e-15)
    assert motion["R[1]"][-1] == pytest.approx(np.cos(3.0), abs=1e-5)
    assert motion["R[4]"][-1] == pytest.approx(np.sin(3.0), abs=1e-5)


def test_the_text_is_the_same_each_time() -> None:
    assert emit_python(lower(pendulum())) == emit_python(lower(pendulum()))


def test_the_text_of_the_pendulum_reads_well() -> None:
    text = emit_python(lower(pendulum()))
    assert "    return [der_theta, (torque - der_theta * b - k0 * sin(theta)) / J]\n" in text
    assert '    ("theta", "rad"),  # from the vertical\n' in text
    assert "from math import cos, sin\n" in text


def cartesian_pendulum(projected: bool) -> Equations:
    """A point on a circle of radius 1 in x and y, with its multiplier solved by hand."""
    g = Graph()
    x, y, vx, vy = (g.symbol(n) for n in ("x", "y", "vx", "vy"))
    gravity = g.constant(Fraction(981, 100))
    square = g.add(g.mul(x, x), g.mul(y, y))
    speed = g.add(g.mul(vx, vx), g.mul(vy, vy))
    lam = g.div(g.sub(g.mul(gravity, y), speed), square)
    phi = g.mul(g.half, g.sub(square, g.one))
    rate = g.add(g.mul(x, vx), g.mul(y, vy))
    back, slow = g.neg(g.div(phi, square)), g.neg(g.div(rate, square))
    model = equations(
        g,
        [
            Function("rhs", "", (vx, vy, g.mul(lam, x), g.sub(g.mul(lam, y), gravity))),
            Function(
                "initial", "", (g.constant(Fraction(8, 10)), g.constant(Fraction(-1, 2)), g.zero, g.zero)
            ),
            Function("project_position", "", (g.mul(back, x), g.mul(back, y), phi)),
            Function("project_velocity", "", (g.mul(slow, x), g.mul(slow, y), rate)),
            Function("displace", "", (vx, vy)),
        ],
        states=[
            (s, Quantity(n, "coordinate", ""))
            for s, n in ((x, "x"), (y, "y"), (vx, "der(x)"), (vy, "der(y)"))
        ],
        nv=2,
    )
    return replace(model, constraints=(Constraint("circle", "position", "m^2"),)) if projected else model


@pytest.mark.parametrize("projected", [True, False])
def test_constraints_are_met_by_projection(projected: bool) -> None:
    motion = module(cartesian_pendulum(projected)).simulate(5.0, 1e-5)
    drift = np.abs(np.hypot(motion["x"], motion["y"]) - 1.0)
    across = np.abs(motion["x"] * motion["der(x)"] + motion["y"] * motion["der(y)"])
    if projected:
        assert max(drift.max(), across.max()) < 1e-13
    else:
        assert drift.max() > 1e-6


def test_models_with_events_are_refused() -> None:
    model = oscillator()
    with_event = replace(model, functions=(*model.functions, Function("indicators", "", (model.graph.one,))))
    with pytest.raises(RuntimeError, match="the model has events"):
        module(with_event).simulate(1.0)
