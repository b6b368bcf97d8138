"""Resistance of a medium (U24, U26, U28, U30-U32)."""

from __future__ import annotations

import math
from typing import Any

import pytest
from gallery import Array, Case, Formula, check, run
from numpy import cosh, exp, log, sqrt, tanh
from scipy.integrate import solve_ivp

import mechc
from mechc.runtime.outcome import Outcome

g = 9.81


def mixed(m: float, d: float) -> tuple[float, Formula]:
    """Terminal speed and v(t) of m v' = m g - A v - B v^2 from rest; v+ and v- are the roots of the right side."""
    A, B = 7.75 * 2e-5 * d, 0.17 * 1.29 * d * d
    low, high = (-A - sqrt(A * A + 4 * B * m * g)) / (2 * B), (-A + sqrt(A * A + 4 * B * m * g)) / (2 * B)

    def speed(t: Array) -> Any:
        C = high / low * exp(-B / m * (high - low) * t)
        return (high - low * C) / (1 - C)

    return high, speed


stokes, delay = (7800 - 1260) * 1e-6 * g / (18 * 1.4), 7800e-6 / (18 * 1.4)

CASES = [
    Case(
        "stokes_drag",
        {
            "fall.position[2]": lambda t: -stokes * (t - delay * (1 - exp(-t / delay))),
            "terminal": lambda t: stokes,
        },
        bound=100,
    ),
    Case("mixed_drag", {"der(y)": mixed(0.6, 0.25)[1]}, bound=100),
    Case("mixed_drag", {"der(y)": mixed(1e-7, 0.01)[1]}, bound=100, experiment="bubble"),
    Case("mixed_drag", {"der(y)": mixed(0.5e-9, 1e-4)[1]}, bound=100, experiment="drop"),
    Case("horizontal_drag", {"x": lambda t: 6 * (1 - exp(-t / 2))}, bound=30),
    Case("horizontal_drag", {"x": lambda t: 4 * log(1 + 0.75 * t)}, bound=30, experiment="quadratic"),
    Case(
        "linear_quadratic_drag",
        {"x": lambda t: 4 * log(1 + 1.5 * (1 - exp(-t / 2))), "distance": lambda t: 4 * log(2.5)},
        bound=30,
    ),
    Case(
        "shuttlecock",
        {
            "y": lambda t: 6.8**2 / g * log(cosh(g * t / 6.8)),
            "der(fall.position[2])": lambda t: -6.8 * tanh(g * t / 6.8),
        },
        bound=30,
    ),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_closed_form(case: Case) -> None:
    check(case)


@pytest.mark.parametrize(
    ("example", "experiment", "speed", "digits"),
    [
        ("drag_reynolds", None, 27.8423, 6e-5),
        ("drag_reynolds", "small", 8.80451, 6e-6),
        ("drag_reynolds", "grain", 1.570821, 6e-7),
        ("mixed_drag", "bubble", 0.17909474, 6e-9),
        ("mixed_drag", "drop", 0.3034256, 6e-8),
        ("mixed_drag", None, 20.721499, 6e-7),
    ],
)
def test_printed_terminal_speed(example: str, experiment: str | None, speed: float, digits: float) -> None:
    """U26, U28: half a unit of the last printed digit; the start has decayed by e^-15 or more."""
    assert run(example, experiment)["der(y)"][-1] == pytest.approx(speed, abs=digits)


def test_reynolds_number_of_the_grain() -> None:
    assert run("drag_reynolds", "grain")["Re"][-1] == pytest.approx(101.3, abs=0.05)


def test_free_fall_beside_terminal_speeds() -> None:
    """U26: without air 44.721 m/s after 100 m."""
    solution = run("drag_reynolds", "vacuum")
    assert solution["y"][-1] == pytest.approx(100, rel=1e-9)
    assert solution["der(y)"][-1] == pytest.approx(44.721, abs=5e-4)


def test_stopping_distances() -> None:
    """U30 b: M v/gamma; U31: (m/beta) ln(1 + beta v0/alpha); all have stopped to e^-20."""
    assert run("horizontal_drag")["x"][-1] == pytest.approx(6, abs=1e-7)
    assert run("horizontal_drag", set={"gamma": 1.6})["x"][-1] == pytest.approx(2 * 3 / 1.6, abs=1e-7)
    assert run("linear_quadratic_drag")["x"][-1] == pytest.approx(4 * log(2.5), abs=1e-8)
    other = run("linear_quadratic_drag", set={"alpha": 1.6})
    assert other["x"][-1] == pytest.approx(4 * log(1 + 0.5 * 3 / 1.6), abs=1e-8) == other["distance"][-1]


def test_drag_that_a_motion_needs() -> None:
    """U32: the force that makes a weight fall by y = (vT^2/g) ln cosh(g t/vT) is -m g (v/vT)^2 beside the weight."""
    model = mechc.loads("""model Followed
  parameter m = 5 g;
  parameter vT = 6.8 m/s;
  parameter g = 9.81 m/s^2;
  coordinate Length y;
  kinetic 1/2*m*der(y)^2;
  potential -m*g*y;
  drive y = vT^2/g*log(cosh(g*time/vT));
  output v = der(y);
  output F = reaction(y);
  experiment(stop = 2 s);
end Followed;
""")
    solution = model.simulate()
    v = solution["v"]
    assert v[-1] > 6.7
    assert solution["F"] == pytest.approx(-5e-3 * g * (v / 6.8) ** 2, abs=1e-14)


AT_REST = """
import mech.planar.*;
import mech.fields.*;
gravity {0, -9.81} m/s^2;
Bar b(m = 1 kg, l = 1 m);
Revolute h(world -> b.a, angle = 20 deg);
QuadraticDrag d(to = b.b, k = 0.3 kg/m);
experiment(stop = 1 s, tolerance = 1e-10);
"""


@pytest.mark.parametrize("method", ["radau5", "auto", "dop853"])
def test_drag_from_rest_by_every_method(method: str) -> None:
    """v |v| has a derivative at rest, though that of |v| alone has none: phi'' (1/3) = -g/2 cos phi - k phi'|phi'|."""
    found = mechc.loads(AT_REST).simulate(method=method)
    assert found.outcome.value == "completed"

    def rate(t: float, y: Any) -> list[float]:
        return [y[1], 3 * (-9.81 / 2 * math.cos(y[0]) - 0.3 * y[1] * abs(y[1]))]

    exact = solve_ivp(rate, (0, 1), [math.radians(20), 0], rtol=1e-12, atol=1e-13).y[:, -1]
    assert abs(found["h.angle"][-1] - exact[0]) < 1e-8 and abs(found["der(h.angle)"][-1] - exact[1]) < 1e-8


@pytest.mark.parametrize(
    "dissipation", ["1/3*k*(der(x)^2 + der(y)^2)^(3/2)", "1/3*k*norm({der(x), der(y)})^3"]
)
def test_quadratic_drag_by_its_dissipation_begins_at_rest(dissipation: str) -> None:
    """v = vT tanh(t g/vT), with vT^2 = m g/k: the dissipation is smooth where nothing moves, though the root in it is not."""
    model = mechc.loads(
        "parameter k = 2 kg/m; coordinate x = 0 m; coordinate y = 0 m;"
        "kinetic 1/2*1 kg*(der(x)^2 + der(y)^2); potential 1 kg*8 m/s^2*y;"
        f"dissipation {dissipation};"
    )
    solution = model.simulate(stop=1, tolerance=1e-10)
    assert solution.outcome is Outcome.COMPLETED
    assert solution["der(y)"] == pytest.approx(-2 * tanh(4 * solution.time), abs=1e-8)
    assert not solution["der(x)"].any()
