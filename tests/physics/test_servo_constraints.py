"""Constraints that are kept by a force elsewhere, a torque, or an input.

Judges: inverse dynamics written by hand, integrated with SciPy, and Newton's and Euler's laws of the whole.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from scipy.integrate import solve_ivp

import mechc

CRANE = """
import mech.planar.*;
model Servo
  gravity {0, -9.81} m/s^2;
  Particle crab(m = 1 kg);
  Body load(m = 0.5 kg, J = 0.1 kg.m^2, com = {0, 1} m);
  Prismatic rail(world -> crab.a, position = 0 m, der(position) = 0 m/s);
  Revolute pivot(crab.a -> load.a, angle ~ -0.5 rad);
  constraint hold: pivot.angle = -0.5 rad*exp(-time/1 s) by force on rail.position;
  output F = multiplier(hold);
  experiment(stop = 3 s, tolerance = 1e-11);
end Servo;
"""


def test_a_crab_balances_its_load() -> None:
    """The inverted crane crab of Modelica's library: the load follows a given angle, by the force on the crab alone."""
    m1, m2, J, l, g = 1.0, 0.5, 0.1, 1.0, 9.81

    def way(t: float) -> tuple[float, float, float]:
        a = -0.5 * math.exp(-t)
        return a, -a, a

    def acceleration(t: float) -> float:
        # of the load about the crab: (m2 l^2 + J) a'' - m2 l cos(a) x'' - m2 g l sin(a) = 0, a turning to the left
        a, _, a2 = way(t)
        return float(((m2 * l**2 + J) * a2 - m2 * g * l * math.sin(a)) / (m2 * l * math.cos(a)))

    run = solve_ivp(
        lambda t, y: [y[1], acceleration(t)], (0, 3), [0, 0], rtol=1e-12, atol=1e-13, dense_output=True
    )
    solution = mechc.loads(CRANE).simulate(estimate_error=False)
    for t in np.linspace(0.1, 3, 15):
        mine, (a, a1, a2) = solution(t), way(t)
        force = (m1 + m2) * acceleration(t) - m2 * l * (a2 * math.cos(a) - a1**2 * math.sin(a))
        assert mine["rail.position"] == pytest.approx(run.sol(t)[0], abs=1e-8)
        assert mine["F"] == pytest.approx(force, abs=1e-8)
    assert solution.unit("F") == "N"


def test_its_work_is_that_of_the_force() -> None:
    solution = mechc.loads(CRANE).simulate(estimate_error=False)
    power = solution["F"] * solution["der(rail.position)"]
    work = np.concatenate([[0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(solution.time))])
    assert solution["energy.supplied"] == pytest.approx(work, abs=2e-4)
    assert np.ptp(solution["energy.total"] - solution["energy.supplied"]) < 1e-8


def test_a_body_along_a_path() -> None:
    """A force beside the mass centre and a torque: m a = F + m g, J alpha = T + r x F."""
    solution = mechc.loads(
        "import mech.planar.*; gravity {0, -9.81} m/s^2; Body b(m = 2 kg, J = 0.3 kg.m^2); Planar free(world -> b.a);\n"
        "point p = b.a * {0.2, 0} m; constraint way: pos(b.a) = {cos(time/1 s), sin(time/1 s)}*1 m by force on p;\n"
        "constraint turn: free.angle = 0.3 rad*sin(time/1 s) by torque on b.a; output F = multiplier(way); output T = multiplier(turn);\n"
        "experiment(stop = 2 s);"
    ).simulate(estimate_error=False)
    t = solution.time
    a = 0.3 * np.sin(t)
    F = 2 * np.array([-np.cos(t), -np.sin(t) + 9.81])
    arm = 0.2 * np.array([np.cos(a), np.sin(a)])
    assert np.array([solution["F[1]"], solution["F[2]"]]) == pytest.approx(F, abs=1e-8)
    assert solution["T"] == pytest.approx(-0.3 * a - (arm[0] * F[1] - arm[1] * F[0]), abs=1e-8)


def test_in_space() -> None:
    """Three equations by a force at a point, in components of the world."""
    solution = mechc.loads(
        "import mech.spatial.*; gravity {0, 0, -9.81} m/s^2; Particle b(m = 2 kg); Translation free(world -> b.a);\n"
        "constraint way: free.position = {cos(time/1 s), sin(time/1 s), 0.1*(time/1 s)^2}*1 m by force on b.a;\n"
        "output F = multiplier(way); experiment(stop = 1 s);"
    ).simulate(estimate_error=False)
    t = solution.time
    expected = 2 * np.array([-np.cos(t), -np.sin(t), 0.2 + 9.81 + 0 * t])
    assert np.array([solution[f"F[{k}]"] for k in (1, 2, 3)]) == pytest.approx(expected, abs=1e-8)


def test_by_an_input_of_a_part() -> None:
    """U drives a, and a - b/2 has to follow a sine: both equations by hand."""
    solution = mechc.loads(
        "model Motor\n input Voltage u; input Angle angle; force 0.1 N.m/V*u on angle; end Motor;\n"
        "model M\n coordinate Angle a = 0 rad; coordinate Angle b = 0 rad; initial der(a) = 1 rad/s; initial der(b) = 0 rad/s;\n"
        " kinetic 1/2*1 kg.m^2*der(a)^2 + 1/2*2 kg.m^2*der(b)^2 + 0.5 kg.m^2*der(a)*der(b); Motor m(angle = a);\n"
        " constraint hold: a - 0.5*b = 1 rad*sin(time/1 s) by m.u; output U = m.u; output V = multiplier(hold); experiment(stop = 1 s);\nend M;"
    ).simulate(estimate_error=False)
    # 0.5 a'' + 2 b'' = 0, a'' - b''/2 = -sin t
    t = solution.time
    a2 = -np.sin(t) / (1 + 0.125)
    assert solution["U"] == pytest.approx((a2 + 0.5 * (-a2 / 4)) / 0.1, abs=1e-9)
    assert np.array_equal(solution["U"], solution["V"])
    assert solution.unit("U") == solution.unit("V") == "V"


def test_of_rates() -> None:
    """A speed that is kept by a force on another coordinate, which is coupled by its mass."""
    solution = mechc.loads(
        "coordinate Length x = 0 m; coordinate Length y = 0 m; initial der(x) = 1 m/s; initial der(y) = 0 m/s;\n"
        "kinetic 1/2*2 kg*der(x)^2 + 1/2*1 kg*der(y)^2 + 0.5 kg*der(x)*der(y); damping 3 N.s/m on x;\n"
        "constraint hold: der(x) = 1 m/s by force on y; output F = multiplier(hold); experiment(stop = 1 s);"
    ).simulate(estimate_error=False)
    # x'' = 0: 0.5 y'' = -3, F = y''
    assert solution["F"] == pytest.approx(-6, abs=1e-10)
    assert solution["y"][-1] == pytest.approx(-3, abs=1e-9)


def test_it_is_released() -> None:
    solution = mechc.loads(
        "coordinate Length x = 0 m; initial der(x) = 1 m/s; kinetic 1/2*1 kg*der(x)^2; damping 2 N.s/m on x;\n"
        "constraint hold: x = 1 m/s*time by force on x; when time >= 1 s then release hold; end when;\n"
        "output F = multiplier(hold); experiment(stop = 2 s);"
    ).simulate(estimate_error=False)
    assert solution(0.5)["F"] == pytest.approx(2, abs=1e-10)
    assert solution(1.5)["F"] == 0
    assert solution["x"][-1] == pytest.approx(1 + (1 - math.exp(-2)) / 2, rel=1e-8)


TWO = "coordinate Length x = 0 m; coordinate Length y = 0 m; kinetic 1/2*1 kg*(der(x)^2 + der(y)^2); potential 1/2*5 N/m*(x - y)^2;\n"


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (TWO + "constraint hold: x = 1 m by force on y;", "E0728"),
        (TWO + "input Force u; constraint hold: x = 1 m by u;", "E0728"),
        (TWO + "constraint hold: x = 1 m by y;", "E0726"),
        (TWO + "constraint hold: x = 1 m by force on {x, y};", "E0322"),
        (TWO + "constraint hold: x = 1 m by force on world * {x, y};", "E0726"),
        (TWO + "constraint hold: x = 1 m by force on x; contact floor: y;", "E0727"),
        (TWO + "constraint hold: x = 1 m by force;", "E0110"),
        (TWO + "constraint hold: x = 1 m by force on z;", "E0201"),
        (TWO + "holonomic constraint hold: x = 1 m by force on x;", "E0110"),
        (TWO + "constraint hold: x = 1 m by force on x; output Force F = multiplier(hold)*1 m;", "E0303"),
    ],
)
def test_wrong_models(text: str, code: str) -> None:
    caught = refused(text)
    assert caught[0].code == code, caught[0].message


def test_the_formatter_keeps_it(tmp_path: Path) -> None:
    from mechc.cli.main import run

    text = "constraint hold: a = b by force on s;\nconstraint a = b by torque on arm;\nconstraint a = b by motor.u;\n"
    file = tmp_path / "m.mech"
    file.write_text(text)
    assert run(["fmt", str(file)]) == 0
    assert file.read_text() == text
