"""Oscillators without a linear force (T18, U11, U15, U86, U87, Duffing, van der Pol, the elastic beam)."""

from __future__ import annotations

import numpy as np
import pytest
from closed_forms import time_between
from gallery import Case, at, check, load, references, run, upward_crossings
from numpy import arcsin, cosh, exp, log, sin, sqrt, tanh

high = sqrt(1 - 1 / (1.5 + np.tan(0.3) ** 2))
"""sqrt(E/(E + V)) of the well from 0.3, V = 1."""

CASES = [
    Case(
        "tan_squared_well",
        {"x": lambda t: arcsin(sqrt(1 / 3) * sin(sqrt(3) * t)), "energy.total": lambda t: 0.5},
        bound=100,
    ),
    Case(
        "tan_squared_well",
        {
            "x": lambda t: arcsin(sqrt(0.2) * sin(2 * sqrt(2 * 3.75 / 1.5) * t)) / 2,
            "energy.total": lambda t: 0.75,
        },
        bound=100,
        set={"a": 2.0, "V": 3.0, "m": 1.5},
    ),
    Case(
        "tan_squared_well",
        {"x": lambda t: arcsin(high * sin(sqrt(2 / (1 - high**2)) * t + arcsin(sin(0.3) / high)))},
        bound=100,
        set={"x": 0.3},
    ),
    Case(
        "exponential_force",
        {"x": lambda t: 2 * log(cosh(t / sqrt(2))), "der(x)": lambda t: sqrt(2) * tanh(t / sqrt(2))},
        bound=30,
    ),
    Case("lennard_jones", {"r": lambda t: 2 ** (1 / 6)}, bound=10, experiment="rest"),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_closed_form(case: Case) -> None:
    check(case)


def test_printed_values_of_the_exponential_force() -> None:
    solution = run("exponential_force")
    assert solution(1.0)["x"] == pytest.approx(0.46316264, abs=1e-8)
    assert solution["x"][-1] == pytest.approx(12.755843, abs=1e-6)
    assert solution["der(x)"][-1] == pytest.approx(1.4142115, abs=1e-7)


def test_speed_and_potential_of_the_exponential_force() -> None:
    """U11: v = sqrt(2 F0/(M c) (1 - e^(-c x))), and its work is the fall of V = F0/c e^(-c x)."""
    solution = run("exponential_force", set={"M": 2.0, "F0": 3.0, "c": 0.4})
    x = solution["x"]
    assert x[-1] > 10
    assert solution["der(x)"] == pytest.approx(sqrt(2 * 3 / (2 * 0.4) * (1 - exp(-0.4 * x))), abs=1e-8)
    fallen = 3 / 0.4 * (1 - exp(-0.4 * x[-1]))
    assert solution.energy is not None and solution.energy.supplied == pytest.approx(fallen, rel=1e-9)


@pytest.mark.parametrize(
    ("a", "b", "place", "depth", "stiffness"),
    [(1, 1, 1.122462, 0.25, 14.28661), (2, 3, (4 / 3) ** (1 / 6), 9 / 8, 81 / (4 / 3) ** (1 / 3))],
)
def test_rest_of_the_molecule(a: float, b: float, place: float, depth: float, stiffness: float) -> None:
    """U15: (2a/b)^(1/6), b^2/(4a), 18 b^2/(a r^2), found by mechc; the printed digits."""
    model = load("lennard_jones")
    (found,) = model.equilibria(set={"a": a, "b": b}).summary()["equilibria"]
    assert found["values"]["r"] == pytest.approx(place, abs=5e-7)
    assert found["stable"] is True
    rest = run("lennard_jones", "rest", set={"a": a, "b": b})
    assert -rest["energy.total"][-1] == pytest.approx(depth, rel=1e-13) == rest["depth"][-1]
    (mode,) = model.modes(at="equilibrium", set={"a": a, "b": b}).summary()["modes"]
    assert mode["frequency"] ** 2 == pytest.approx(stiffness, abs=5e-6)


def test_molecule() -> None:
    """U15: depth 1/4; small swings with stiffness 14.28661; the period of a large one by quadrature."""
    assert run("lennard_jones", "rest")["energy.total"][-1] == pytest.approx(-0.25, abs=1e-12)
    minima = upward_crossings(run("lennard_jones", "small", tolerance=1e-12), "der(r)")
    # (amplitude*15)^2 and tol/amplitude
    assert np.diff(minima) == pytest.approx(2 * np.pi / sqrt(14.28661), rel=1e-5)

    def speed2(r: float) -> float:
        return float(2 * ((1.3**-12 - 1.3**-6) - (r**-12 - r**-6)))

    inner = (1 - 1.3**-6) ** (-1 / 6)  # the other root of s^2 - s = E with s = r^-6
    minima = upward_crossings(run("lennard_jones"), "der(r)")
    assert np.diff(minima) == pytest.approx(2 * time_between(speed2, inner, 1.3), rel=300e-10)


@pytest.mark.parametrize(
    ("example", "experiment", "options", "printed", "digits"),
    [
        ("ear_drum", None, {}, 6.311599, 6e-7),
        ("ear_drum", None, {"x": 0.3}, 6.629357, 6e-7),
        ("ear_drum", "mirror", {}, 6.629357, 6e-7),
        ("ear_drum", "large", {}, 7.706476, 6e-7),
        ("ear_drum", "edge", {}, 11.477361, 1.1e-6),
        ("duffing_free", None, {}, 4.7680220, 6e-8),
        ("duffing_free", "inner", {}, 4.6239052, 6e-8),
        ("duffing_free", "outer", {}, 9.2236627, 6e-8),
    ],
)
def test_printed_period(
    example: str, experiment: str | None, options: dict[str, float], printed: float, digits: float
) -> None:
    """U86, U87: from one smallest x to the next; half a unit of the last printed digit (one, where it is cut off)."""
    solution = run(example, experiment, stop=36.0, set=options)
    minima = upward_crossings(solution, "der(x)")
    assert np.diff(minima) == pytest.approx(printed, abs=digits)


def test_inner_turning_point_of_the_double_well() -> None:
    solution = run("duffing_free", "inner")
    first = upward_crossings(solution, "der(x)")[0]
    assert solution(first)["x"] == pytest.approx(0.7483315, abs=6e-8)


def test_ear_drum_escapes_beyond_one_half() -> None:
    assert run("ear_drum", "edge")["x"].min() > -1
    assert run("ear_drum", "escape")["x"][-1] < -1


@pytest.mark.parametrize(
    ("example", "data", "names", "horizon"),
    [
        (
            "duffing_double_well",
            "duffing_double_well",
            {"x": "x", "v": "der(x)"},
            50,
        ),  # chaotic until it settles
        ("van_der_pol", "van_der_pol_mu10", {"x": "x", "v": "v"}, 50),
    ],
)
def test_reference(example: str, data: str, names: dict[str, str], horizon: float) -> None:
    """Bound 300 times the tolerance, times the growth of errors that the reference itself shows."""
    solution = run(example)
    for point in references(data):
        if point["t"] > horizon:
            continue
        expected = [point["values"][k] for k in names]
        bound = 300e-10 * point["growth"]
        assert at(solution, point["t"], list(names.values())) == pytest.approx(expected, abs=bound)


@pytest.mark.slow
def test_beam() -> None:
    """40 links, frequencies up to 6400 rad/s. The published values are good to 4e-12 (angles), 3e-8 (rates):
    the run may be 25 times farther off.
    """
    solution = run("beam")
    (point,) = references("beam")
    for i in range(1, 41):
        assert solution[f"theta[{i}]"][-1] == pytest.approx(point["values"][f"theta{i}"], abs=1e-10)
        assert solution[f"der(theta[{i}])"][-1] == pytest.approx(point["values"][f"thetadot{i}"], abs=1e-6)
