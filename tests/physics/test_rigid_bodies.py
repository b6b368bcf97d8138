"""Tops and free bodies (P13, T14, T15, T22, U137-U139, U145, Dzhanibekov)."""

from __future__ import annotations

import numpy as np
import pytest
from closed_forms import integrate, swing
from gallery import Array, Case, Formula, at, check, check_estimate, load, references, run, upward_crossings
from numpy import cos, pi, sin, sqrt

EULER = {
    "theta": "theta", "phi": "phi", "psi": "psi",
    "thetadot": "der(theta)", "phidot": "der(phi)", "psidot": "der(psi)",
}  # fmt: skip
BODY = {
    "w1": "der(R)[1]", "w2": "der(R)[2]", "w3": "der(R)[3]",
    "R12": "axis2[1]", "R22": "axis2[2]", "R32": "axis2[3]",
}  # fmt: skip
QUATERNION = ["R[1]", "R[2]", "R[3]", "R[4]"]


def test_heavy_symmetric_top() -> None:
    """P13; the spin angle grows to 188, an error of its rate with the time."""
    solution = run("heavy_symmetric_top")
    for point in references("heavy_symmetric_top"):
        expected = np.array([point["values"][k] for k in EULER])
        got = at(solution, point["t"], list(EULER.values()))
        assert np.max(np.abs(got - expected) / (1 + np.abs(expected))) < 300e-10
        if point["t"] == solution.time[-1]:
            check_estimate(solution, dict(zip(EULER.values(), expected, strict=True)))
    assert solution["p_psi"] == pytest.approx(4, abs=100e-10)
    assert solution["p_phi"] == pytest.approx(3.625254671094455935, abs=100e-10)


def test_nutation_of_the_heavy_symmetric_top() -> None:
    solution = run("heavy_symmetric_top")
    lowest = upward_crossings(solution, "der(theta)")
    assert np.diff(lowest) == pytest.approx(1.128850532250744616523439135, rel=1e-8)
    assert solution["theta"].max() <= 0.5786730700614316154529222017 + 300e-10
    assert solution["theta"].min() >= 0.5 - 300e-10


def test_heavy_top_without_euler_angles() -> None:
    """U145: the same top as a body with a Rotation; its tip, and the conserved momenta."""
    solution = run("heavy_top_rotation")
    for point in references("heavy_symmetric_top"):
        theta, phi = point["values"]["theta"], point["values"]["phi"]
        tip = [sin(theta) * sin(phi), -sin(theta) * cos(phi), cos(theta)]
        assert at(solution, point["t"], ["tip[1]", "tip[2]", "tip[3]"]) == pytest.approx(tip, abs=3000e-10)
        assert solution(point["t"])["cos_nutation"] == pytest.approx(cos(theta), abs=3000e-10)
    assert solution["l3"] == pytest.approx(4, abs=300e-10)
    assert solution["lZ"] == pytest.approx(3.625254671094455935, abs=300e-10)


def test_rates_in_the_body_from_those_of_euler_angles() -> None:
    """U145: w1 = phi' sin(theta) sin(psi) + theta' cos(psi), w2 = phi' sin(theta) cos(psi) - theta' sin(psi), w3 = phi' cos(theta)
    + psi': those of the body with a Rotation, from the reference in Euler angles."""
    solution = run("heavy_top_rotation")
    for point in references("heavy_symmetric_top"):
        theta, psi = point["values"]["theta"], point["values"]["psi"]
        th, ph, ps = (point["values"][f"{name}dot"] for name in ("theta", "phi", "psi"))
        w = [
            ph * sin(theta) * sin(psi) + th * cos(psi),
            ph * sin(theta) * cos(psi) - th * sin(psi),
            ph * cos(theta) + ps,
        ]
        found = at(solution, point["t"], ["der(R)[1]", "der(R)[2]", "der(R)[3]"])
        assert found == pytest.approx(w, abs=3000e-10)


def test_effective_potential_of_the_heavy_top() -> None:
    """U145: phi' = (lZ - l3 cos(theta))/(I1 sin(theta)^2); I1 theta'^2/2 + U_eff is the energy, U_eff = (lZ - l3 cos(theta))^2/(2 I1
    sin(theta)^2) + m g a cos(theta) + l3^2/(2 I3)."""
    solution = run("heavy_symmetric_top")
    I1, I3, weight, lZ, l3 = 0.5, 0.2, 0.5 * 9.81, 3.625254671094455935, 4.0
    theta = solution["theta"]
    left = lZ - l3 * cos(theta)
    assert solution["der(phi)"] == pytest.approx(left / (I1 * sin(theta) ** 2), abs=1000e-10)
    effective = left**2 / (2 * I1 * sin(theta) ** 2) + weight * cos(theta) + l3**2 / (2 * I3)
    energy = I1 / 2 * sin(0.5) ** 2 + I3 / 2 * 20**2 + weight * cos(0.5)
    assert I1 / 2 * solution["der(theta)"] ** 2 + effective == pytest.approx(energy, abs=1000e-10)


@pytest.mark.parametrize(("share", "sleeps"), [(1.01, True), (0.99, False)])
def test_sleeping_top(share: float, sleeps: bool) -> None:
    """U145: stable while l3^2 > 4 I1 m g a, here above a spin of 2 sqrt(I1 m g l)/I3 = 15.66; a slower one falls."""
    least = 2 * sqrt(0.5 * 9.81 * 0.5) / 0.2
    assert least == pytest.approx(15.66, abs=0.005)
    solution = run("heavy_top_rotation", "sleeping", set={"der(R)[3]": float(share * least)}, stop=60.0)
    assert bool(solution["cos_nutation"].min() > 1 - 1e-7) is sleeps
    if not sleeps:
        assert solution["cos_nutation"].min() < 0.999


@pytest.mark.parametrize(("experiment", "precession"), [(None, 0.0), ("loops", -2.0), ("waves", 4.0)])
def test_lagrange_top(experiment: str | None, precession: float) -> None:
    """T14: bounds of the nutation are the roots of the cubic in u = cos(theta); shape of the precession."""
    I1, I3, weight, u0 = 4e-3, 1e-3, 9.81 * 0.05, cos(pi / 6)
    p3 = I3 * 200
    pz = I1 * (1 - u0**2) * precession + p3 * u0
    E = I1 / 2 * precession**2 * (1 - u0**2) + weight * u0
    left = 2 * I1 * np.polymul([-1, 0, 1], [-weight, E])  # I1^2 u'^2 = left - right
    right = np.polymul([-p3, pz], [-p3, pz])
    roots = np.roots(np.polysub(left, right)).real
    bounds = np.sort(np.arccos(roots[np.abs(roots) < 1]))
    solution = run("lagrange_top", experiment)
    turning = [solution(t)["theta"] for t in upward_crossings(solution, "der(theta)")]
    assert np.array(turning) == pytest.approx(bounds[0], abs=3000e-10)
    assert solution["theta"].max() == pytest.approx(bounds[1], abs=1e-4)  # of the points of the grid
    assert solution["theta"].max() <= bounds[1] + 3000e-10
    slowest, fastest = solution["der(phi)"].min(), solution["der(phi)"].max()
    match experiment:
        case None:  # cusps: it stops at the top of each wave
            assert -1e-6 < slowest < 1e-3 < fastest
        case "loops":
            assert slowest < -1 and fastest > 1
        case "waves":
            assert slowest > 1
    assert solution["pz"] == pytest.approx(pz, abs=100e-10)  # phi and psi are cyclic
    assert solution["p3"] == pytest.approx(p3, abs=100e-10)
    rest = solution["U_eff"] + I1 / 2 * solution["der(theta)"] ** 2
    assert rest == pytest.approx(E, abs=1000e-10)


def turned(e: Array, L: Array, I1: float, t: Array) -> Array:
    """Return the axis e of a free symmetric top, which goes round L at |L|/I1 (Rodrigues); a row for each of x, y, z."""
    n, angle = L / np.linalg.norm(L), np.linalg.norm(L) / I1 * np.asarray(t)
    along = np.multiply.outer(n * (n @ e), 1 - cos(angle))
    round_it = np.multiply.outer(e, cos(angle)) + np.multiply.outer(np.cross(n, e), sin(angle))
    return np.asarray(round_it + along)


def precessing_axis(i: int) -> Formula:
    """e3 of the free symmetric top: the start (0, 0, 1) turned about L = (2, 0, 12)."""
    return lambda t: turned(np.array([0, 0, 1.0]), np.array([2.0, 0, 12]), 2.0, t)[i]


def test_precession_in_space_and_in_the_body() -> None:
    """U138, T11: in space the axis of a free symmetric top goes round at |L|/I1; the notes print for it (I3 - I1) w3/I1, which is the
    rate at which the axis of rotation goes round in the body."""
    solution = run("free_symmetric_top")
    L = np.array([2.0, 0, 12])
    e3 = np.array([solution[f"e3[{k}]"] for k in (1, 2, 3)])
    across = np.array([0, 0, 1.0]) - L * 12 / 148
    round_L = np.unwrap(np.arctan2(np.cross(L, across) @ e3 / sqrt(148), across @ e3))
    assert round_L == pytest.approx(sqrt(148) / 2 * solution.time, abs=1000e-10)
    in_body = np.unwrap(np.arctan2(solution["der(R)[2]"], solution["der(R)[1]"]))
    assert in_body == pytest.approx((3 - 2) * 4 / 2 * solution.time, abs=1000e-10)


def test_free_symmetric_top_in_euler_angles() -> None:
    """T13: about L the nutation stays and phi' = M/I1, psi' = M cos(theta) (1/I3 - 1/I1); else the axis goes round L at |L|/I1."""
    M, spin = 3.0, 9 * cos(0.5)
    along = run("heavy_symmetric_top", set={"g": 0.0, "der(phi)": M / 0.5, "der(psi)": float(spin)})
    assert along["theta"] == pytest.approx(0.5, abs=300e-10)
    assert along["phi"] == pytest.approx(6 * along.time, abs=1000e-10)
    assert along["psi"] == pytest.approx(spin * along.time, abs=1000e-10)
    assert along["p_phi"] == pytest.approx(M, abs=300e-10)
    free = run("heavy_symmetric_top", set={"g": 0.0})
    e2, e3 = np.array([0, cos(0.5), sin(0.5)]), np.array([0, -sin(0.5), cos(0.5)])
    theta, phi = free["theta"], free["phi"]
    found = np.array([sin(theta) * sin(phi), -sin(theta) * cos(phi), cos(theta)])
    expected = turned(e3, 0.5 * sin(0.5) * e2 + 0.2 * 20 * e3, 0.5, free.time)
    assert np.ptp(theta) > 0.1 and np.max(np.abs(found - expected)) < 1000e-10


CASES = [
    Case(
        "free_symmetric_top",
        {
            "der(R)[1]": lambda t: cos(2 * t),
            "der(R)[2]": lambda t: sin(2 * t),
            "der(R)[3]": lambda t: 4,
            "L[1]": lambda t: 2,
            "L[3]": lambda t: 12,
            "e3[1]": precessing_axis(0),
            "e3[2]": precessing_axis(1),
            "e3[3]": precessing_axis(2),
        },
        bound=300,
    ),
    Case(
        "torqued_top",
        {
            "cos_theta": lambda t: 0.5,
            "W3": lambda t: t / 6,
            "phi": lambda t: t * t / 4,
        },
        bound=100,
    ),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_closed_form(case: Case) -> None:
    check(case)


def test_wobble_of_the_earth() -> None:
    """U138: the pole goes round in 333 turns; 40 days of it. The amplitude is 2e-7 of the spin."""
    solution = run("earth_wobble")
    angle = 0.003 * 2 * pi * solution.time / 86164
    assert solution["pole[1]"] == pytest.approx(0.2e-6 * cos(angle), abs=1e-12)
    assert solution["pole[2]"] == pytest.approx(0.2e-6 * sin(angle), abs=1e-12)
    assert solution["wobble"][-1] / 86164 == pytest.approx(333.3, abs=0.1)


def euler(J: tuple[float, float, float], w: Array, N: tuple[float, float, float] = (0, 0, 0)) -> list[float]:
    """Euler's equations, N1 = I1 w1' + (I3 - I2) w2 w3 and cyclic."""
    return [(N[i] - (J[i - 1] - J[i - 2]) * w[i - 2] * w[i - 1]) / J[i] for i in range(3)]


@pytest.mark.parametrize(
    ("experiment", "start"),
    [(None, [0.001, 1, 0.001]), ("smallest", [1, 0.001, 0.001]), ("largest", [0.001, 0.001, 1])],
)
def test_tennis_racket(experiment: str | None, start: list[float]) -> None:
    """U139; about the middle axis the error of the start grows by 1e3, so does that of the steps."""
    solution = run("tennis_racket", experiment)
    w = np.array([solution[f"der(R)[{i}]"] for i in (1, 2, 3)])
    expected = integrate(lambda _, y: euler((1, 2, 3), y), start, solution.time)
    assert np.max(np.abs(w - expected)) < (1e-5 if experiment is None else 300e-10)
    if experiment is None:
        assert w[1].min() < -0.99  # it turns over
        assert solution["growth"][0] == pytest.approx(1 / sqrt(3), rel=1e-12)
        # w1 = a cosh(t/sqrt(3)): its square, 3e-6 at the end, is left out
        near = run("tennis_racket", stop=6.0, set={"der(R)[1]": 1e-4, "der(R)[3]": 0.0})
        grown = 1e-4 * np.cosh(near.time / sqrt(3))
        assert near["der(R)[1]"] == pytest.approx(grown, rel=2e-5) and grown[-1] > 1.5e-3
    else:
        rate = {"smallest": sqrt(2 / 6), "largest": sqrt(2 / 2)}[experiment]
        small = w[1 if experiment == "smallest" else 0]
        follow = w[2 if experiment == "smallest" else 1]
        # linear equations s' = a f, f' = -b s with a b = rate^2
        a = {"smallest": 1.0, "largest": -1.0}[experiment]
        t = solution.time
        assert small == pytest.approx(0.001 * (cos(rate * t) + a / rate * sin(rate * t)), abs=1e-7)
        assert np.max(np.abs(follow)) < 0.002


def test_dzhanibekov() -> None:
    """Rates, middle axis and attitude; an error at the unstable axis grows by exp(2.9 t) until each turn."""
    solution = run("dzhanibekov", tolerance=1e-11)
    for point in references("dzhanibekov_free_body"):
        bound = 1e-6 if point["t"] > 10 else 1e-7
        expected = [point["values"][k] for k in BODY]
        assert at(solution, point["t"], list(BODY.values())) == pytest.approx(expected, abs=bound)
        attitude = np.array([point["values"][f"q{i}"] for i in range(4)])
        got = at(solution, point["t"], QUATERNION)
        assert abs(got @ attitude) == pytest.approx(1, abs=bound)
    assert np.diff(upward_crossings(solution, "der(R)[2]")) == pytest.approx(10.05185827631494, abs=1e-6)


def test_euler_equations_with_torque() -> None:
    """U137."""
    solution = run("euler_equations")
    expected = integrate(
        lambda t, y: euler((0.3, 0.5, 0.7), y, (0.1 * cos(2 * t), 0.05, 0)), [1, 0.5, -0.3], solution.time
    )
    got = np.array([solution[f"w{i}"] for i in (1, 2, 3)])
    assert np.max(np.abs(got - expected)) < 1000e-10


def test_ball_with_an_eccentric_cavity() -> None:
    """U125, T21: centre at -a/14, moments 57/140 - 1/196 and 31/70 of M a^2 about it, 57/140 and 31/70 about the middle; hung
    there, w^2 = 10 g/(57 a)."""
    solution = run("cavity_pendulum")
    assert solution["centre[3]"] == pytest.approx(-0.2 / 14, rel=1e-12)
    assert solution["I[1]"] == pytest.approx(57 / 140 - 1 / 196, rel=1e-12)
    assert solution["I[3]"] == pytest.approx(31 / 70, rel=1e-12)
    assert solution["I[1]"][0] == pytest.approx(0.40204082, abs=5e-9)
    whole = load("cavity_pendulum").inertia(set={"pin.angle": 0.0}).details["total"]
    moments = np.array(whole["tensor_about_point"]) / (whole["mass"] * 0.2**2)
    assert moments == pytest.approx(np.diag([57 / 140, 57 / 140, 31 / 70]), abs=1e-13)
    w0 = sqrt(10 * 9.81 / (57 * 0.2))
    check(Case("cavity_pendulum", {"pin.angle": lambda t: swing(t, np.radians(40), w0)}, bound=100))


def test_the_ball_about_either_axis() -> None:
    """T21: with the mass m of what fills the cavity, M of the whole ball. About the middle of the ball the moment is 2/5 M R^2 -
    2/5 m r^2 - m a^2 and the arm of the weight m a/(M - m); about that of the cavity 2/5 M R^2 + M a^2 - 2/5 m r^2, and M a/(M - m)."""
    for R, r, a in ((0.2, 0.1, 0.1), (0.3, 0.08, 0.15)):
        M, m = R**3, r**3
        about = {
            "CavityPendulum": m * a / (2 / 5 * M * R**2 - 2 / 5 * m * r**2 - m * a**2),
            "AboutCavity": M * a / (2 / 5 * M * R**2 + M * a**2 - 2 / 5 * m * r**2),
        }
        for name, arm in about.items():
            model = load("cavity_pendulum", name)
            found = model.modes(set={"R": R, "r": r, "a": a}).summary()["modes"][0]["frequency"]
            assert found == pytest.approx(sqrt(9.81 * arm), rel=1e-12)


def test_free_lamina() -> None:
    """U144: w1^2 + w2^2 is constant, w3 is not; the angle of the pair obeys a pendulum's equation. w3 is constant if I1 = I2, or if
    w1 w2 = 0 and stays so: of a plate that begins with w1 = 0 alone it does not."""
    solution = run("free_lamina")
    rate = [f"der(pose.orientation)[{k}]" for k in (1, 2, 3)]
    for settings, w3 in (
        ({"plate.size[2]": 0.2}, 3),
        ({rate[0]: 0.0, rate[1]: 0.0}, 3),
        ({rate[0]: 0.0, rate[2]: 0.0}, 0),
    ):
        steady = run("free_lamina", set=settings)
        assert np.max(np.abs(steady["w[3]"] - w3)) < 100e-10
        assert np.ptp(steady["in_plane"]) < 1000e-10
    assert np.ptp(run("free_lamina", set={rate[0]: 0.0})["w[3]"]) > 0.1
    assert solution["in_plane"] == pytest.approx(sqrt(5), abs=1e-7)
    assert np.ptp(solution["w[3]"]) > 0.1
    I1, I2 = 0.3**2, 0.2**2
    ratio = (I2 - I1) / (I1 + I2)

    def euler(t: float, w: Array) -> list[float]:
        return [-w[1] * w[2], w[0] * w[2], -ratio * w[0] * w[1]]

    w = integrate(euler, [1.0, 2.0, 3.0], solution.time)
    for k in range(3):
        assert solution[f"w[{k + 1}]"] == pytest.approx(w[k], abs=1e-7)
