"""Pendulums of one freedom, and small swings of several (K4, V10, V11, T12, U43, U46, U66, U82, U83, U123)."""

from __future__ import annotations

import numpy as np
import pytest
from closed_forms import small_swings, swing, swing_period, swing_rate, time_between
from gallery import Case, check, load, references, run, upward_crossings, values
from scipy.special import ellipj

g = 9.81
w0 = np.sqrt(g)
axis = np.deg2rad(30), np.deg2rad(40)
cosines = np.array([np.cos(axis[1]) * np.cos(axis[0]), -np.sin(axis[0]), np.sin(axis[1]) * np.cos(axis[0])])
compound = np.sqrt(2 * g * 0.3 / (2 * 0.3**2 + np.array([0.02, 0.03, 0.04]) @ cosines**2))

# Every swing lasts a few periods of about 30 steps: a few hundred steps, each within the tolerance.
SWINGS = [
    Case(
        "pendulum",
        {
            "theta": lambda t: swing(t, 1, w0),
            "der(theta)": lambda t: swing_rate(t, 1, w0),
            "p_theta": lambda t: swing_rate(t, 1, w0),
            "energy.total": lambda t: -g * np.cos(1) + 0 * t,
        },
        bound=100,
    ),
    Case(
        "pendulum",
        {
            "theta": lambda t: swing(t, 1, np.sqrt(g / 0.4)),
            "p_theta": lambda t: 3 * 0.4**2 * swing_rate(t, 1, np.sqrt(g / 0.4)),
        },
        bound=100,
        set={"m": 3, "l": 0.4},
    ),
    Case("pendulum_point", {"theta": lambda t: swing(t, 1, w0)}, bound=100),
    Case("pendulum_parts", {"pin.angle": lambda t: swing(t, 1, w0)}, bound=100),
    Case("bar_pendulum", {"hinge.angle": lambda t: swing(t, np.deg2rad(80), np.sqrt(1.5 * g))}, bound=100),
    Case(
        "bar_pendulum",
        {"hinge.angle": lambda t: swing(t, np.deg2rad(80), np.sqrt(3 * g / (2 * 2.4)))},
        bound=100,
        set={"l": 2.4},
    ),
    Case(
        "physical_pendulum",
        {"axis.angle": lambda t: swing(t, np.deg2rad(100), np.sqrt(g * 0.4 / 0.25))},
        bound=100,
    ),
    Case(
        "compound_pendulum_axis",
        {"theta": lambda t: swing(t, np.deg2rad(50), compound), "w2": lambda t: compound**2},
        bound=100,
    ),
    Case(
        "pendulum_accelerating_support",
        {"theta": lambda t: swing(t, np.deg2rad(70), np.sqrt(g + 3))},
        bound=100,
    ),
    Case(
        "pendulum_accelerating_support",
        {"theta": lambda t: swing(t, np.deg2rad(70), np.sqrt((g - 2) / 0.4))},
        bound=100,
        set={"r": 0.4, "a": -2, "m": 3},
    ),
    Case(
        "coupled_pendulums",
        {name: lambda t: swing(t, np.deg2rad(60), w0) for name in ("th1", "th2")},
        bound=300,
        experiment="together",
    ),
    Case(
        "pendulum_phase_portrait",
        {"theta": lambda t: 2 * np.arcsin(2 / w0 * ellipj(w0 * t, 4 / g)[0]), "level": lambda t: 8 / g - 1},
        bound=100,
        experiment="libration",
    ),
    Case(
        # An error grows by exp(w0 t) = 500 on the way up to the saddle.
        "pendulum_phase_portrait",
        {"theta": lambda t: 4 * np.arctan(np.exp(w0 * t)) - np.pi},
        bound=1000,
        experiment="separatrix",
    ),
    Case("pendulum_period", {"theta": lambda t: swing(t, np.pi / 3, 1)}, bound=100),
]


@pytest.mark.parametrize("case", SWINGS, ids=str)
def test_swing(case: Case) -> None:
    check(case)


def test_generalised_force_of_a_pendulum() -> None:
    """U43: the rate of p_theta is the torque -m g r sin(theta)."""
    found = load("pendulum").hamilton().details
    assert found["equations"] == {"der(theta)": "p_theta/(l^2*m)", "der(p_theta)": "-g*l*m*sin(theta)"}
    solution = run("pendulum", set={"m": 3, "l": 0.4})
    t = np.linspace(0.5, 1.5, 7)
    ahead, behind = solution(t + 1e-4)["p_theta"], solution(t - 1e-4)["p_theta"]
    torque = -3 * g * 0.4 * np.sin(solution(t)["theta"])
    assert (ahead - behind) / 2e-4 == pytest.approx(torque, abs=1e-5)  # w^2 h^2/6 of 12 N.m, and tol/h


@pytest.mark.parametrize(
    ("degrees", "period"),
    [
        (10, 6.2951685), (30, 6.3925680), (60, 6.7430014), (90, 7.4162987), (120, 8.6260626),
        (150, 11.0722526), (170, 15.326968), (179, 24.511115),
    ],
)  # fmt: skip
def test_period_in_units_of_the_frequency(degrees: float, period: float) -> None:
    """U82, U83: the printed digits, half a unit of the last one."""
    solution = run("pendulum_period", stop=45.0, tolerance=1e-12, set={"amplitude": np.deg2rad(degrees)})
    first, second = upward_crossings(solution, "theta")[:2]
    assert second - first == pytest.approx(period, abs=6e-8 if degrees < 160 else 6e-7)
    assert second - first == pytest.approx(swing_period(np.deg2rad(degrees), 1), rel=1e-8)
    if degrees == 60:
        assert (second - first) / (2 * np.pi) == pytest.approx(1.073182, abs=5e-7)


@pytest.mark.parametrize("point", references("pendulum_period_elliptic")[:11], ids=lambda p: p["case"])
def test_period_of_the_simple_pendulum(point: dict[str, object]) -> None:
    degrees = float(str(point["case"]).split()[1])
    period = dict(point["values"])["period"]  # type: ignore[call-overload]
    solution = run("pendulum", stop=14.0, set={"theta": np.deg2rad(degrees)})
    first, second = upward_crossings(solution, "theta")[:2]
    # near the top (179 deg) a relative error of the energy changes the period 1/cos(amplitude/2)^2 times more
    assert second - first == pytest.approx(period, rel=1e-8 if degrees < 175 else 1e-6)


@pytest.mark.parametrize(("experiment", "rate"), [("rotation", 7), ("fast", 10)])
def test_turns_of_a_rotating_pendulum(experiment: str, rate: int) -> None:
    solution = run("pendulum_phase_portrait", experiment)
    turn = values("pendulum_period_elliptic", f"rotating, thetadot={rate}")["time_per_turn"]
    for n in (1, 3, 7):
        assert solution(n * turn)["theta"] == pytest.approx(2 * np.pi * n, abs=300e-10)


def test_equivalent_length_of_a_physical_pendulum() -> None:
    """U123: k^2/l, here 0.5^2/0.4 m; small swings last as long as those of a simple pendulum of that length."""
    assert run("physical_pendulum")["equivalent"] == pytest.approx(0.625, rel=1e-14)
    (mode,) = load("physical_pendulum").modes().summary()["modes"]
    assert mode["frequency"] == pytest.approx(np.sqrt(g / 0.625), rel=1e-12)


def test_sliding_support() -> None:
    """U66: with total momentum 0, theta'^2 = 2 (g/r)(cos theta - cos theta0)/(1 - m cos^2 theta/(M + m))."""
    solution = run("sliding_support")
    start, share = np.pi / 3, 1 / 3
    half = time_between(
        lambda x: 2 * g * (np.cos(x) - np.cos(start)) / (1 - share * np.cos(x) ** 2), -start, start
    )
    for n in range(1, 7):
        assert solution(n * half)["theta"] == pytest.approx((-1) ** n * start, abs=300e-10)
    assert np.max(np.abs(solution["p"])) < 300e-10
    assert solution["X"] == pytest.approx(-share * (np.sin(solution["theta"]) - np.sin(start)), abs=300e-10)


def test_momentum_and_energy_of_the_sliding_support() -> None:
    """U66: p_X = (M + m) X' + m r theta' cos(theta), E = T + U, of a support that moves on."""
    solution = run("sliding_support", set={"der(X)": 0.7, "der(theta)": 1.1})
    theta, u, v = solution["theta"], solution["der(X)"], solution["der(theta)"]
    assert np.ptp(theta) > 1.5
    assert solution["p"] == pytest.approx(3 * u + v * np.cos(theta), rel=1e-13)
    assert solution["p"] == pytest.approx(3 * 0.7 + 1.1 / 2, rel=300e-10)
    kinetic = u**2 + 1 / 2 * (u**2 + v**2 + 2 * u * v * np.cos(theta))
    assert solution["energy.kinetic"] == pytest.approx(kinetic, rel=1e-13)
    assert solution["energy.total"] == pytest.approx(kinetic - g * np.cos(theta), rel=1e-13)
    assert solution["energy.total"] == pytest.approx(kinetic[0] - g / 2, rel=300e-10)


def test_coupled_pendulums_out_of_phase() -> None:
    """V10: w^2 = g/l + k (1/m1 + 1/m2); the linear formula is good to amplitude^2 w t = 4e-10."""
    solution = run("coupled_pendulums", set={"th1": 3e-6, "th2": -1e-6})
    expected = np.cos(np.sqrt(g + 6 * (1 + 1 / 3)) * solution.time)
    assert solution["th1"] / 3e-6 == pytest.approx(expected, abs=3e-8)
    assert solution["th2"] / -1e-6 == pytest.approx(expected, abs=3e-8)


def test_row_of_pendulums() -> None:
    """Three pendulums: frequencies of the reference, and the motion that they compose."""
    laplacian = np.array([[1, -1, 0], [-1, 2, -1], [0, -1, 1]])
    solution = run("pendulum_row", set={"theta[1]": 2e-6})
    omega, motion = small_swings(np.eye(3), g * np.eye(3) + 2 * laplacian, [1, 0, 0], solution.time)
    known = values("normal_modes_set", "three pendulums")
    assert omega == pytest.approx([known[f"omega{i}"] for i in (1, 2, 3)], rel=1e-13)
    for i in range(3):
        assert solution[f"theta[{i + 1}]"] / 2e-6 == pytest.approx(motion[i], abs=3e-8)


@pytest.mark.parametrize("n", [2, 3, 5, 10])
def test_hanging_chain(n: int) -> None:
    """Small swings of n masses: w^2 are the zeros of Laguerre's polynomial times g/l."""
    tension = np.arange(n, 0, -1.0)  # in the link above each mass
    K = g * (
        np.diag(tension + np.append(tension[1:], 0)) - np.diag(tension[1:], 1) - np.diag(tension[1:], -1)
    )
    solution = run("hanging_chain", set={"n": n, "joint[1].angle": 1e-6})
    omega, y = small_swings(np.eye(n), K, np.arange(1.0, n + 1), solution.time)
    known = values("normal_modes_set", f"hanging chain of n={n} ")
    assert omega**2 / g == pytest.approx([known[f"omega^2_{i + 1}"] for i in range(n)], rel=1e-12)
    link = np.diff(y, axis=0, prepend=0)
    joint = np.diff(link, axis=0, prepend=0)
    for i in range(n):
        assert solution[f"joint[{i + 1}].angle"] / 1e-6 == pytest.approx(joint[i], abs=1e-7)
