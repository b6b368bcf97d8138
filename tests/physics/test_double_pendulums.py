"""Double pendulums against 30-digit solutions (K1, K2, V3, V6, U52)."""

from __future__ import annotations

import numpy as np
import pytest
from closed_forms import integrate, small_swings
from gallery import Array, at, check_estimate, load, references, run, values

TIP = {"xB": "B[1]", "yB": "B[2]"}
K1 = {"q1": "q1", "q2": "q2", "u1": "der(q1)", "u2": "der(q2)"}
POINTS = {
    "th1": "th1", "th2": "th2", "w1": "der(th1)", "w2": "der(th2)", "x2": "tip[1]", "y2": "tip[2]",
}  # fmt: skip
PARTS = {"q1": "shoulder.angle", "q2": "elbow.angle", "xB": "tip[1]", "yB": "tip[2]"}
SPACE = {
    "q1": "q1", "q2": "q2", "q3": "q3", "u1": "der(q1)", "u2": "der(q2)", "u3": "der(q3)",
    "xP": "trajectory[1]", "yP": "trajectory[2]", "zP": "trajectory[3]",
}  # fmt: skip
WRONG = "DoublePendulumAsPublished"

RUNS = [
    ("double_pendulum_bars", None, None, "thesis_double_pendulum_2d_right_caseA", K1 | TIP),
    ("double_pendulum_bars", None, "caseB", "thesis_double_pendulum_2d_right_caseB", K1 | TIP),
    ("double_pendulum_bars", WRONG, None, "thesis_double_pendulum_2d_aswritten_caseA", K1 | TIP),
    ("double_pendulum_bars", WRONG, "caseB", "thesis_double_pendulum_2d_aswritten_caseB", K1 | TIP),
    ("double_bars", None, None, "thesis_double_pendulum_2d_right_caseA", PARTS),
    ("double_pendulum_points", None, None, "double_pendulum_point_masses", POINTS),
]


@pytest.mark.parametrize(("example", "model", "experiment", "data", "names"), RUNS)
def test_reference(
    example: str, model: str | None, experiment: str | None, data: str, names: dict[str, str]
) -> None:
    """Up to the horizon of 10 s; 30 times the tolerance, times the growth that the reference itself shows."""
    solution = run(example, experiment, model=model)
    for point in references(data):
        if point["t"] > 10:
            continue
        expected = np.array([point["values"][k] for k in names])
        got = at(solution, point["t"], list(names.values()))
        assert np.max(np.abs(got - expected) / (1 + np.abs(expected))) < 30e-10 * point["growth"], point["t"]
        if point["t"] == solution.time[-1]:
            check_estimate(solution, dict(zip(names.values(), expected, strict=True)))


def test_double_pendulum_in_space() -> None:
    """K2: it passes close to its singular position (rates of 500 rad/s), where errors grow a thousandfold."""
    solution = run("double_pendulum_3d", tolerance=1e-12)
    for point in references("thesis_double_pendulum_3d"):
        expected = np.array([point["values"][k] for k in SPACE])
        got = at(solution, point["t"], list(SPACE.values()))
        bound = 300e-12 * point["growth"]  # 1e3 at 5 s, 1e6 at 10 s: the horizon
        assert np.max(np.abs(got - expected) / (1 + np.abs(expected))) < bound, point["t"]


def test_the_two_cases_part_between_4_5_and_4_9_seconds() -> None:
    """K1: the tips of cases A and B are nearest before 4.5 s, and farther apart than at the start from before 4.9 s."""
    a, b = run("double_pendulum_bars"), run("double_pendulum_bars", "caseB")
    t = np.linspace(4.2, 5.1, 181)
    one, other = a(t), b(t)
    apart = np.hypot(one["B[1]"] - other["B[1]"], one["B[2]"] - other["B[2]"])
    begun = np.linalg.norm(at(a, 0.0, ["B[1]", "B[2]"]) - at(b, 0.0, ["B[1]", "B[2]"]))
    assert 4.4 < t[np.argmin(apart)] < 4.5
    assert 4.5 < t[np.flatnonzero(apart < begun)[-1]] < 4.9
    assert np.interp(4.9, t, apart) > 4 * apart.min()


def test_both_cases_in_one_run() -> None:
    """K1: the two pendulums of one model move as those of two runs, with either potential; the times at which their tips are nearest and part."""
    for experiment, name, stop in ((None, "DoublePendulum", 4.9), ("published", WRONG, 4.35)):
        both = run("double_pendulum_cases", experiment)
        t = np.linspace(0, stop, 4901)
        one, other = (run("double_pendulum_bars", case, model=name)(t) for case in (None, "caseB"))
        apart = np.hypot(one["B[1]"] - other["B[1]"], one["B[2]"] - other["B[2]"])
        assert both(t)["apart"] == pytest.approx(apart, abs=1e-6)  # chaotic: errors of 1e-10 grow
        least = np.flatnonzero((apart[1:-1] < apart[:-2]) & (apart[1:-1] <= apart[2:]))[-1] + 1
        beyond = np.flatnonzero((apart[1:] > apart[0]) & (apart[:-1] <= apart[0]))[-1] + 1
        found = both.final()
        assert (found["nearest"], found["parted"]) == pytest.approx((t[least], t[beyond]), abs=2e-3)


def test_as_published_the_two_cases_part_within_half_a_second_after_4_s() -> None:
    """K1: with the potential of the thesis the tips are 2 cm apart at 4 s, and more than 1.3 m at 4.35 s; with the right one they stay within
    80 cm for 10 s."""
    t = np.linspace(0, 10, 2001)
    apart = {}
    for name in ("DoublePendulum", WRONG):
        one, other = (run("double_pendulum_bars", case, model=name)(t) for case in (None, "caseB"))
        apart[name] = np.hypot(one["B[1]"] - other["B[1]"], one["B[2]"] - other["B[2]"])
    assert apart["DoublePendulum"].max() < 0.8 and apart[WRONG].max() > 3.5
    assert np.interp(4.0, t, apart[WRONG]) < 0.02 and np.interp(4.35, t, apart[WRONG]) > 1.3


def test_the_printed_potential_makes_the_motion_chaotic() -> None:
    """K1: in a section the right motion keeps to five small rings, and that of the printed potential wanders over all angles."""
    reach = {}
    for name in ("DoublePendulum", WRONG):
        found = load("double_pendulum_bars", name).section(where="der(q1) = 0", count=300)
        reach[name] = np.ptp(found.arrays["der(q2)"]), found.details["accuracy"]["agreeing"][0]
    assert reach["DoublePendulum"][0] < 3.6 and reach["DoublePendulum"][1] == 200
    assert reach[WRONG][0] > 18 and reach[WRONG][1] < 200


@pytest.mark.parametrize(
    ("example", "case", "M", "K", "names"),
    [
        (
            "double_pendulum_bars",
            "thesis double pendulum",
            [[10 / 3, 5 / 6], [5 / 6, 1 / 3]],
            9.8 * np.array([[3, 0.5], [0.5, 0.5]]),
            ("q1", "q2"),
        ),
        (
            "double_pendulum_points",
            "point double pendulum",
            [[2, 1], [1, 1]],
            9.81 * np.array([[2, 0], [0, 1]]),
            ("th1", "th2"),
        ),
    ],
)
def test_small_swings(
    example: str, case: str, M: list[list[float]], K: Array, names: tuple[str, str]
) -> None:
    """Frequencies of the reference; at an amplitude of 1e-6 the linear motion is good to 1e-10."""
    solution = run(example, set={names[0]: 1e-6, names[1]: 0.0})
    omega, motion = small_swings(M, K, [1, 0], solution.time)
    known = values("normal_modes_set", case)
    assert omega == pytest.approx([known["omega1"], known["omega2"]], rel=1e-13)
    for name, expected in zip(names, motion, strict=True):
        assert solution[name] / 1e-6 == pytest.approx(expected, abs=1e-7)


def test_generalised_momenta() -> None:
    """U52: p1 and p2 as stated, and the motion by the textbook's equations."""
    m1, m2, l1, l2, g = 2.0, 1.0, 0.8, 1.2, 9.81
    solution = run("double_pendulum_momenta")
    th1, th2, w1, w2 = (solution[n] for n in ("th1", "th2", "der(th1)", "der(th2)"))
    coupling = m2 * l1 * l2 * np.cos(th1 - th2)
    assert solution["p1"] == pytest.approx((m1 + m2) * l1**2 * w1 + coupling * w2, abs=1e-12)
    assert solution["p2"] == pytest.approx(m2 * l2**2 * w2 + coupling * w1, abs=1e-12)

    def rates(_: float, y: Array) -> list[float]:
        a, b, u, v = y
        M = [[(m1 + m2) * l1, m2 * l2 * np.cos(a - b)], [l1 * np.cos(a - b), l2]]
        Q = [
            -m2 * l2 * v**2 * np.sin(a - b) - (m1 + m2) * g * np.sin(a),
            l1 * u**2 * np.sin(a - b) - g * np.sin(b),
        ]
        return [u, v, *np.linalg.solve(M, Q)]

    expected = integrate(rates, [np.deg2rad(40), np.deg2rad(-20), 0, 0], solution.time)
    assert np.max(np.abs(np.array([th1, th2]) - expected[:2])) < 1000e-10
