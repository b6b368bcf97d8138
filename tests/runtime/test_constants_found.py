"""What studies say of constants and equations beside the formulas: conditions, what is left out, what rests."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from shared_models import FOUR_BAR, example

import mechc


@pytest.mark.parametrize("name", ["pendulum_cartesian", "rod_in_circle", "double_pendulum_cartesian"])
@pytest.mark.parametrize("study", ["symmetries", "invariants"])
def test_energy_of_a_constrained_model_holds_for_all_values(name: str, study: str) -> None:
    """There are no parameters whose values it could need."""
    found: Any = example(name).study(study).summary()
    assert len(found[study]) >= 1
    assert not any("because" in str(one.get("holds", "")) for one in found[study])


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("bouncing_ball", "contacts, which are not part of H"),
        ("coulomb_block", "dry friction, which H knows nothing of"),
        ("relay_attitude", "while what switches stays as it is at the start"),
    ],
)
def test_hamiltons_equations_say_what_is_left_out(name: str, said: str) -> None:
    assert any(said in remark for remark in example(name).hamilton().remarks)
    assert not example("hamilton_pendulum").hamilton().remarks


def test_rest_on_a_saddle_is_not_chaotic() -> None:
    """Four states at rest: the exponents are the real parts of the eigenvalues, and nothing moves."""
    text = """\
model Rest
  dimensionless;
  coordinate a = 0;
  coordinate b = 0;
  kinetic 1/2*(der(a)^2 + der(b)^2);
  potential cos(a) + 2*(a - b)^2;
  experiment(stop = 10);
end Rest;
"""
    found = mechc.loads(text).lyapunov(time=100)
    assert found.message.startswith("unstable, though not chaotic")
    assert any("the start is an equilibrium" in remark for remark in found.remarks)
    # K = [[3, -4], [-4, 4]]
    rate = math.sqrt(-(3.5 - math.sqrt(0.25 + 16)))
    assert found.details["exponents"][0] == pytest.approx(rate, abs=1e-4)


def test_strong_damping_leads_downhill() -> None:
    """From 60 degrees a four-bar does not settle on the top at 85.8 degrees."""
    (mode,) = mechc.loads(FOUR_BAR).modes().summary()["modes"]
    assert mode["damping"] == 0 and mode["frequency"] == pytest.approx(9.948964, abs=1e-6)


@pytest.mark.parametrize("form", ["x^2 + y^2 = l^2", "sqrt(x^2 + y^2) = l"])
@pytest.mark.parametrize(("g", "l"), [(14.0905, 4.98819), (2.77385, 24.5321), (11.3, 0.0123), (9.81, 1.0)])
def test_a_constrained_pendulum_is_found_at_rest(form: str, g: float, l: float) -> None:
    """sqrt(g/l), within the stated error, also where the rows that constraints make superfluous are rounding alone."""
    text = f"""\
model Hanging
  dimensionless;
  coordinate x ~ 0;
  coordinate y ~ -1;
  parameter l = {l};
  kinetic 1/2*(der(x)^2 + der(y)^2);
  potential {g}*y;
  constraint {form};
end Hanging;
"""
    (mode,) = mechc.loads(text).modes().summary()["modes"]
    assert abs(mode["frequency"] - math.sqrt(g / l)) <= mode["error"] + 4e-16 * mode["frequency"]


def test_runs_check_constants_that_are_found() -> None:
    """The Runge-Lenz vector of a Kepler orbit drifts as its run is exact; without asking nothing of it is there."""
    model = example("kepler")
    drifts = []
    for tolerance in (1e-6, 1e-11):
        solution = model.simulate(constants=True, stop=20, tolerance=tolerance, estimate_error=False)
        found = {drift.name: drift for drift in solution.accuracy.conserved}
        (name,) = (name for name in found if name.startswith("x/sqrt(x^2 + y^2)"))
        y, vx, vy, x = (solution[n] for n in ("y", "der(x)", "der(y)", "x"))
        values = x / np.hypot(x, y) + y * vx * vy - x * vy**2
        absolute = found[name].absolute
        assert 0.5 * np.abs(values - values[0]).max() <= absolute <= 2 * np.abs(values - values[0]).max()
        assert len(found) == 3
        drifts.append(absolute)
    assert drifts[0] > 100 * drifts[1]
    assert model.simulate(stop=20).accuracy.conserved == ()


def test_a_run_without_constants_says_so() -> None:
    solution = mechc.loads(
        "model Slow\n dimensionless;\n coordinate x = 1;\n kinetic 1/2*der(x)^2;\n potential x^2;\n damping der(x)^2 + 1 on x;\n"
        " experiment(stop = 3);\nend Slow;"
    ).simulate(constants=True)
    assert any(
        "no constants of the motion were found" in remark for remark in solution.motion.judged().remarks
    )


IN_ARRAYS = """\
model Swing
  parameter l = 1 m;
  coordinate Angle a = 0.3 rad;
  kinetic 1/2*1 kg*l^2*der(a)^2;
  potential -9 N*l*cos(a);
end Swing;
model Row
  Swing s[2](l = {1, 2} m);
  experiment(stop = 1 s);
end Row;
"""


def test_formulas_of_arrays_of_parts() -> None:
    """The names of members of array elements, ``s[1].l``, could not be read again: the studies ended with an assertion."""
    model = mechc.loads(IN_ARRAYS)
    (found,) = model.study("symmetries").summary()["symmetries"]
    terms = found["conserved"].replace(" - ", " + -").split(" + ")
    assert sorted(terms) == sorted(
        [f"1/2*s[{k}].l^2*der(s[{k}].a)^2" for k in (1, 2)] + [f"-9*s[{k}].l*cos(s[{k}].a)" for k in (1, 2)]
    )
    assert model.study("invariants").summary()["independent"] == 2
    rows: Any = model.hamilton().summary()
    assert "1/2*p_s[2].a^2/s[2].l^2" in rows["H"]


def test_the_energy_of_a_damped_model_is_no_share_of_a_symmetry() -> None:
    """Two shafts behind gears of ratio 3, with 1 + 2/9 and 4 + 2/9 kg.m^2 at the motor side, between them a spring and a damper. The boost
    came with 5e-11 of the energy, which the damper takes: less than the rounding of the motion, and named a screw in time."""
    model = mechc.loads("""\
coordinate Angle a = 0 rad;
coordinate Angle b ~ 0 rad;
coordinate Angle c = 0 rad;
coordinate Angle d ~ 0 rad;
initial der(a) = 30 rad/s;
parameter first = 3;
parameter second = 3;
kinetic 1/2*1 kg.m^2*der(a)^2 + 1/2*2 kg.m^2*der(b)^2 + 1/2*4 kg.m^2*der(c)^2 + 1/2*2 kg.m^2*der(d)^2;
potential 1/2*40 N.m*(b - d)^2;
damping 0.5 N.m.s on b - d;
constraint a = first*b;
constraint c = second*d;
experiment(stop = 1 s);
""")
    found: Any = model.study("symmetries").summary()["symmetries"]
    assert [one["conserved"] for one in found] == [
        "der(a) + 38/11*der(c)",
        "time*der(a) - a + 38/11*time*der(c) - 38/11*c",
    ]


def test_each_run_of_a_sweep_tells_its_constants() -> None:
    """Such a sweep ended in an ImportError."""
    runs = mechc.loads(
        "model Free\n dimensionless;\n coordinate x = 1; coordinate y = 2;\n parameter m = 1;\n kinetic m*(der(x)^2 + der(y)^2);\n"
        " potential m/sqrt(x^2 + y^2);\n experiment(stop = 1, m in {1, 2});\nend Free;"
    ).sweep(constants=True)
    assert len(runs.solutions) == 2
    for solution in runs.solutions:
        assert any("sqrt(x^2 + y^2)" in drift.name for drift in solution.accuracy.conserved)
