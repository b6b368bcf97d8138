"""Initial values that are stated with those of others follow what a run sets."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

import mechc

TEXT = """
coordinate Length x = 1 m;
coordinate Length y = 2*x;
initial der(x) = 2 m/s;
initial der(y) = 3*x/1 s + der(x);
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
experiment(stop = 1 ms, x = 3 m);
experiment declared(stop = 1 ms);
"""


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({}, (3, 6, 2, 11)),
        ({"experiment": "declared"}, (1, 2, 2, 5)),
        ({"set": {"x": "5 m"}}, (5, 10, 2, 17)),
        ({"set": {"der(x)": 1}}, (3, 6, 1, 10)),
        ({"set": {"y": 0.5, "der(y)": 0}}, (3, 0.5, 2, 0)),
    ],
)
def test_they_follow_settings(options: dict[str, object], expected: tuple[float, ...]) -> None:
    solution = mechc.loads(TEXT).simulate(estimate_error=False, **options)  # type: ignore[arg-type]
    start = tuple(solution[name][0] for name in ("x", "y", "der(x)", "der(y)"))
    assert start == pytest.approx(expected, abs=1e-14)


def test_rates_of_any_size_are_assembled() -> None:
    """A four-bar driven at 1e7 rad/s: its rates are the same multiples of the speed as at 10 rad/s."""
    model = mechc.load(Path(__file__).parents[2] / "examples" / "four_bar.mech")
    slow, fast = (
        model.simulate(set={"speed": speed}, stop=0.0, estimate_error=False) for speed in (10.0, 1e7)
    )
    for name in ("der(b.angle)", "der(d.angle)"):
        assert fast[name][0] / 1e7 == pytest.approx(slow[name][0] / 10, rel=1e-11)


FOUR_BARS = """\
import mech.planar.*;
Bar a;
Bar b;
Bar c;
Revolute j1(world -> a.a, angle ~ 90 deg);
Revolute j2(a.b -> b.a, angle ~ -90 deg);
Revolute j3(b.b -> c.a, angle ~ -90 deg);
"""


def test_known_values_of_a_joint_that_closes_a_loop_hold() -> None:
    """In the parallelogram the angle of the last joint is 180 deg less that of the first."""
    last = "Revolute j4(c.b -> world * trans({1, 0} m), angle = 100 deg, der(angle) = 2 rad/s);"
    solution = mechc.loads(FOUR_BARS + last).simulate(stop=1e-3, estimate_error=False)
    assert math.degrees(solution["j1.angle"][0]) == pytest.approx(80, abs=1e-10)
    assert solution["der(j1.angle)"][0] == pytest.approx(-2, rel=1e-12)


def test_guesses_of_a_joint_that_closes_a_loop_decide_nothing() -> None:
    last = "Revolute j4(c.b -> world * trans({1, 0} m), angle ~ 20 deg);"
    solution = mechc.loads(FOUR_BARS + last).simulate(stop=1e-3, estimate_error=False)
    assert math.degrees(solution["j1.angle"][0]) == pytest.approx(90, abs=1e-10)


def test_known_values_of_a_closing_joint_that_contradict_are_told() -> None:
    last = "Revolute j4(c.b -> world * trans({1, 0} m), angle = 100 deg);"
    model = mechc.loads(FOUR_BARS.replace("~ 90 deg", "= 90 deg") + last)
    with pytest.raises(mechc.SimulationError, match="initial positions that are given contradict"):
        model.simulate(stop=1e-3)


def test_rotations_of_a_closing_joint_take_no_known_value() -> None:
    text = """
    import mech.spatial.*;
    Body a(m = 1 kg, J = identity(3)*1 kg.m^2);
    Free f(world -> a.a);
    Spherical s(world -> a.a, orientation = rotx(30 deg));
    """
    (found,) = refused(text)
    assert found.code == "E0517" and found.span is not None and found.span.text == "rotx(30 deg)"


@pytest.mark.parametrize("numbers", ["2, a, 0.3, 0", "a, 0, 0, 0", "0, a, 0, 0", "0, 0, a, 3", "1, a, 2, 3"])
def test_rotations_of_quaternions_with_zeros(numbers: str) -> None:
    """A component that is always zero is never the one that the others are divided by."""
    text = f"""model Turned
      parameter a = 4;
      coordinate Rotation R = quat({numbers});
      inertia diag({{1, 2, 3}} kg.m^2) on world * R;
      experiment(stop = 1 s);
    end Turned;"""
    q = np.array([float(x.replace("a", "4")) for x in numbers.split(",")])
    start = mechc.loads(text).functions.start[:4]
    assert np.abs(start * np.sign(start @ q) - q / np.linalg.norm(q)).max() < 1e-15
