"""Constraints with their multipliers, prescribed motions with their reactions (V5, U44, U50, U128 to U140, P7)."""

from __future__ import annotations

import numpy as np
import pytest
from closed_forms import integrate, swing, swing_rate
from gallery import EXAMPLES, Array, at, check_estimate, load, references, run

import mechc

g = 9.81
CLOSED = 1e-9
"""Bound on energy balance over the energies of the run: ten times the tolerance of 1e-10."""


def closed(name: str) -> mechc.Solution:
    solution = run(name)
    balance = solution.accuracy.energy
    assert balance is not None and balance.relative is not None
    assert balance.relative < CLOSED
    return solution


def largest(difference: Array) -> float:
    return float(np.max(np.abs(difference)))


def test_multiplier_is_the_tension() -> None:
    """V5: m g cos(theta) + m l theta'^2, which is m g (3 cos(theta) - 2 cos(60 deg)), along the closed form."""
    solution = closed("pendulum_tension")
    theta = swing(solution.time, np.radians(60), np.sqrt(g))
    assert largest(solution["tension"] - g * (3 * np.cos(theta) - 1)) < 1e-7
    assert solution["tension"][0] == pytest.approx(g / 2, rel=1e-12)
    assert largest(solution["theta"] - theta) < 1e-8
    assert largest(solution["r"] - 1) < 1e-14
    other = run("pendulum_tension", set={"m": 2.5, "l": 0.7})
    theta = swing(other.time, np.radians(60), np.sqrt(g / 0.7))
    assert largest(other["theta"] - theta) < 1e-8
    pull = 2.5 * g * np.cos(theta) + 2.5 * 0.7 * swing_rate(other.time, np.radians(60), np.sqrt(g / 0.7)) ** 2
    assert largest(other["tension"] - pull) < 1e-6


def test_multiplier_changes_its_sign_with_the_sides() -> None:
    """r = l instead of l = r: minus the tension."""
    text = (EXAMPLES / "pendulum_tension.mech").read_text(encoding="utf-8")
    turned = mechc.loads(text.replace("string: l = r", "string: r = l")).simulate(stop=1, tolerance=1e-10)
    theta = swing(turned.time, np.radians(60), np.sqrt(g))
    assert largest(turned["tension"] + g * (3 * np.cos(theta) - 1)) < 1e-7


def test_pendulum_of_index_3() -> None:
    points = [p for p in references("pendulum_dae") if p["t"] <= 10]
    solution = closed("pendulum_cartesian")
    names = {"x": "x", "y": "y", "vx": "der(x)", "vy": "der(y)", "lambda (tension per length)": "lambda"}
    for point in points:
        expected = [point["values"][k] for k in names]
        assert at(solution, point["t"], list(names.values())) == pytest.approx(expected, abs=1e-7)
    check_estimate(solution, {names[k]: v for k, v in points[-1]["values"].items() if k in names})
    assert largest(solution["x"] ** 2 + solution["y"] ** 2 - 1) < 1e-8  # between the steps, too


def test_chaplygin_sleigh() -> None:
    solution = closed("chaplygin_sleigh")
    names = {"x": "x", "y": "y", "theta": "theta", "xdot": "der(x)", "ydot": "der(y)"}
    for point in references("chaplygin_sleigh"):
        expected = [point["values"][k] for k in names]
        assert at(solution, point["t"], list(names.values())) == pytest.approx(expected, abs=3e-8)


def test_ball_on_turntable_runs_in_circles() -> None:
    """The centre turns with 2/7 of the rate of the table, whatever its speed."""
    solution = closed("ball_on_turntable")
    t, rate = solution.time, 2 / 7 * 3
    assert largest(solution["p[1]"] - (0.2 + 0.3 / rate * (np.cos(rate * t) - 1))) < 1e-8
    assert largest(solution["p[2]"] - 0.3 / rate * np.sin(rate * t)) < 1e-8


def test_reaction_of_a_hinge() -> None:
    """U134: (9/4) m g sin(theta) cos(theta) across, 9 m g/8 at 45 degrees; m g (1 + 9 cos(theta)^2)/4 upwards, 5 m g/2 at the
    bottom; theta from the vertical. The hinge is pushed the way the rod came from."""
    solution = closed("hinge_reaction")
    theta = solution["hinge.angle"] + np.pi / 2
    assert theta[0] == pytest.approx(np.pi / 2) and theta[-1] < -0.5
    assert largest(solution["F[1]"] + 9 / 4 * 2 * g * np.sin(theta) * np.cos(theta)) < 1e-6
    assert largest(solution["F[2]"] - 2 * g * (1 + 9 * np.cos(theta) ** 2) / 4) < 1e-6
    fallen = solution["der(hinge.angle)"]
    assert largest(fallen**2 - 3 * g * np.cos(theta)) < 1e-6  # I = m l^2/3
    fine = solution(np.linspace(0, 0.6, 20001))
    assert np.max(np.abs(fine["F[1]"])) == pytest.approx(9 / 8 * 2 * g, rel=1e-7)
    assert abs(fine["hinge.angle"][np.argmin(fine["F[1]"])]) == pytest.approx(np.pi / 4, abs=1e-3)
    assert np.max(fine["F[2]"]) == pytest.approx(5 / 2 * 2 * g, rel=1e-7)


def test_reactions_of_prescribed_rotations() -> None:
    """U136 and U140: constant in the axes of the body; of the block 0.23145502 m a^2 w^2. The angular momentum of the rod,
    m a^2 w sin(alpha)/12, is across it, in the plane of rod and axis."""
    block = run("block_about_diagonal")
    for k, value in enumerate((-30, 24, -6), start=1):
        assert largest(168 * block[f"N[{k}]"] - value) < 1e-12
    assert np.linalg.norm([block[f"N[{k}]"][-1] for k in (1, 2, 3)]) == pytest.approx(0.23145502, abs=5e-9)
    rod = run("tilted_rod")
    along, across = (
        np.array([np.sin(np.pi / 3), 0, np.cos(np.pi / 3)]),
        [-np.cos(np.pi / 3), 0, np.sin(np.pi / 3)],
    )
    L = np.array([rod[f"L[{k}]"] for k in (1, 2, 3)])
    assert largest(along @ L) < 1e-14
    assert largest(L - 10 / 12 * np.sin(np.pi / 3) * np.array(across)[:, None]) < 1e-14
    assert largest(rod["N[2]"] + 100 / 12 * np.sin(np.pi / 3) * np.cos(np.pi / 3)) < 1e-12
    assert largest(rod["N[1]"]) < 1e-12 and largest(rod["N[3]"]) < 1e-12


def test_cylinder_turned_about_its_diagonal() -> None:
    """U142: m w^2 r h |3 r^2 - h^2|/(6 (4 r^2 + h^2)), nothing for h = sqrt(3) r; moments m (3 r^2 + h^2)/12 and m r^2/2."""
    (body,) = load("cylinder_about_diagonal").inertia().details["bodies"]
    assert body["principal"] == pytest.approx([3 * 0.01 / 2, *[3 * (0.03 + 0.25) / 12] * 2], rel=1e-13)
    solution = run("cylinder_about_diagonal")
    assert largest(np.abs(solution["N[2]"]) - 3 * 400 * 0.05 * 0.22 / (6 * 0.29)) < 1e-12
    assert largest(solution["N[1]"]) < 1e-12 and largest(solution["N[3]"]) < 1e-12
    assert largest(run("cylinder_about_diagonal", "balanced")["N[2]"]) < 1e-12


def test_lamina_turned_about_its_side() -> None:
    """U143: -m a^2 w^2/2 along its normal at the corner, of moments 4/3, 1/3, 5/3 and the product -1/2 of m a^2."""
    solution = run("spun_lamina")
    for k, value in enumerate((0, 0, -0.5), start=1):
        assert largest(solution[f"N[{k}]"] - value) < 1e-12
    (plate,) = load("spun_lamina").inertia().details["bodies"]
    corner = np.array(plate["tensor_about_point"])
    assert corner == pytest.approx(np.array([[4 / 3, -0.5, 0], [-0.5, 1 / 3, 0], [0, 0, 5 / 3]]), abs=1e-13)
    moments = np.array(plate["principal_about_point"])
    assert moments == pytest.approx([0.1262266, 1.5404401, 5 / 3], abs=5e-8)
    axis = plate["axes_about_point"][1]
    assert np.degrees(np.arctan(axis[1] / axis[0])) == pytest.approx(-22.5, abs=1e-9)


def test_rod_in_circle_is_a_pendulum() -> None:
    """Its ends on a circle of radius r, a rod of length r sqrt(3) swings like a pendulum of length r."""
    solution = closed("rod_in_circle")
    assert largest(solution["phi"] - swing(solution.time, np.radians(20), np.sqrt(g))) < 1e-8
    # U128: its inertia about the middle of the circle is m r^2/2, its lowest energy -m g r/2: it goes round beyond m g r above that
    assert largest(solution["energy.kinetic"] - solution["der(phi)"] ** 2 / 4) < 1e-9
    for share, turns in ((0.999, False), (1.001, True)):
        rate = 2 * np.sqrt(share * g)
        turned = run("rod_in_circle", set={"phi": 0.0, "der(phi)": float(rate)}, stop=8.0)
        assert (largest(turned["phi"]) > np.pi) is turns


def test_bead_on_hyperbola() -> None:
    """Energy in x alone; at the start, at rest, the wire carries the weight across itself."""
    solution = closed("bead_on_hyperbola")
    x, v = solution["x"], solution["der(x)"]
    assert largest((1 + 1 / x**4) * v**2 / 2 + g / x - 2 * g) < 1e-7
    assert solution["push"][0] == pytest.approx(g * 0.5 / np.hypot(0.5, 2), rel=1e-12)


def test_equation_of_a_bead_on_a_hyperbola() -> None:
    """U44: y'' (1 + c^2/y^4) - 2 c^2 y'^2/y^5 + g = 0, and the energy that goes with L; of c = 2 and 3 kg."""
    c2 = 4.0

    def rates(_: float, s: Array) -> list[float]:
        y, v = s
        return [v, (2 * c2 * v**2 / y**5 - g) / (1 + c2 / y**4)]

    solution = run("bead_on_hyperbola", set={"c": 2.0, "m": 3.0, "x": 1.0})
    y, v = solution["y"], solution["der(y)"]
    expected = integrate(rates, [2, 0], solution.time)
    assert largest(y - expected[0]) < 1e-8
    assert largest(v - expected[1]) < 1e-8
    energy = 3 / 2 * v**2 * (1 + c2 / y**4) + 3 * g * y
    assert largest(energy - 3 * g * 2) < 1e-7
    assert largest(solution["energy.total"] - energy) < 1e-7


def test_rope_over_edge() -> None:
    solution = closed("rope_over_edge")
    """U50: exponential with the rate sqrt(M g/(L (2 m + M))); with a rope without mass g/2."""
    rate = np.sqrt(0.5 * g / (2 * 2.5))
    assert largest(solution["y"] - (4.1 * np.cosh(rate * solution.time) - 4)) < 1e-9
    light = run("rope_over_edge", set={"M": 0.0})
    assert largest(light["y"] - (0.1 + g / 4 * light.time**2)) < 1e-9
    other = run("rope_over_edge", set={"m": 3.0})
    assert largest(other["y"] - (12.1 * np.cosh(np.sqrt(0.5 * g / (2 * 6.5)) * other.time) - 12)) < 1e-9


def test_rolling_ball_with_cavity() -> None:
    """U130: 585/827 g sin(alpha) = 0.70737606 g sin(alpha), as its moment is 242/585 m a^2; of a solid ball 5/7."""
    solution = closed("rolling_ball_with_cavity")
    assert largest(solution["acceleration"] - 585 / 827) < 1e-12
    assert solution["acceleration"][-1] == pytest.approx(0.70737606, abs=5e-9)
    m = 4 / 3 * np.pi * 7800 * (0.03**3 - 0.01**3)
    assert solution["energy.kinetic"] == pytest.approx(
        m * (1 + 242 / 585) * solution["der(s)"] ** 2 / 2, rel=1e-12
    )
    assert solution["friction_force"] == pytest.approx(m * g * np.sin(np.radians(10)) * 242 / 827, rel=1e-12)
    assert largest(run("rolling_ball_with_cavity", set={"hollow": 0.0})["acceleration"] - 5 / 7) < 1e-12


def test_ladder_between_wall_and_floor() -> None:
    """Both reactions at the start; the wall would have to pull once the top is below 2/3 of its height."""
    solution = closed("ladder")
    theta, rate = solution["theta"], solution["der(theta)"]
    assert largest(rate**2 - 3 * g * (np.cos(0.3) - np.cos(theta))) < 1e-7
    assert solution["by_wall"][0] == pytest.approx(0.75 * g * np.sin(0.3) * np.cos(0.3), rel=1e-11)
    assert solution["by_floor"][0] == pytest.approx(g * (1 - 0.75 * np.sin(0.3) ** 2), rel=1e-11)
    k = int(np.argmax(solution["by_wall"] < 0))
    wall, top = solution["by_wall"][k - 1 : k + 1], solution["top"][k - 1 : k + 1]
    assert np.interp(0, -wall, top) / solution["top"][0] == pytest.approx(2 / 3, abs=1e-4)


def test_differential_shares_the_torque() -> None:
    """In the end each wheel takes half of 20 N.m: 10 rad/s against 1 N.m.s, 2 rad/s against 5 N.m.s."""
    solution = closed("differential")
    assert solution["der(left)"][-1] == pytest.approx(10, abs=1e-3)
    assert solution["der(right)"][-1] == pytest.approx(2, abs=1e-3)
    assert solution["each_side"][-1] == pytest.approx(10, abs=1e-3)
    assert largest(2 * solution["carrier"] - solution["left"] - solution["right"]) < 1e-11


def test_pendulum_from_the_horizontal() -> None:
    """Positions and velocities of the closed form to 1e-8 over four periods; the tension m (v^2/l - g y/l)."""
    solution = closed("pendulum_from_horizontal")
    names = {"x": "guide.position[1]", "y": "guide.position[2]"}
    names |= {f"v{k}": f"der({name})" for k, name in names.items()}
    for point in references("iftomm_a01_simple_pendulum"):
        expected = [point["values"][k] for k in names]
        assert at(solution, point["t"], list(names.values())) == pytest.approx(expected, abs=1e-8)
        tension = point["values"]["thetadot"] ** 2 - g * point["values"]["y"]
        assert float(solution(point["t"])["tension"]) == pytest.approx(tension, abs=1e-6)
    check_estimate(solution, {names[k]: v for k, v in point["values"].items() if k in names})


CAR_AXIS = """dimensionless;
coordinate xl = 0;
coordinate yl = 0.5;
coordinate xr = 1;
coordinate yr = 0.5;
initial der(xl) = -0.5;
initial der(yl) = 0;
initial der(xr) = -0.5;
initial der(yr) = 0;
parameter m = 0.01^2*10/2 "of each end of the axle";
let yb = 0.1*sin(10*time) "the bump under the right wheel";
let xb = sqrt(1 - yb^2);
kinetic 1/2*m*(der(xl)^2 + der(yl)^2 + der(xr)^2 + der(yr)^2);
potential m*(yl + yr) + 1/2*(norm({xl, yl}) - 0.5)^2 + 1/2*(norm({xr - xb, yr - yb}) - 0.5)^2;
constraint across: xl*xb + yl*yb = 0;
constraint axle: (xl - xr)^2 + (yl - yr)^2 = 1;
output first = multiplier(across);
output second = multiplier(axle);
"""


def test_car_axis() -> None:
    """The problem of the test set for IVP solvers (F. Mazzia, C. Magherini 2008, Bari), after 3.

    The published positions and velocities are met to 2e-11, the published multipliers, which are less exact, to 2e-10.
    """
    solution = mechc.loads(CAR_AXIS).simulate(stop=3, tolerance=1e-12)
    published = {
        "xl": 0.4934557842755629e-1,
        "yl": 0.4969894602303324,
        "xr": 1.041742524885400,
        "yr": 0.3739110272652214,
        "der(xl)": -0.7705836840321485e-1,
        "der(yl)": 0.7446866596327776e-2,
        "der(xr)": 0.1755681574942899e-1,
        "der(yr)": 0.7703410437794031,
        "first": -0.4736886750784630e-2,
        "second": -0.1104680411345730e-2,
    }
    for name, value in published.items():
        assert solution[name][-1] == pytest.approx(
            value, abs=5e-10 if name in {"first", "second"} else 5e-11
        ), name


@pytest.mark.slow
def test_fekete_points() -> None:
    """Twenty particles on a sphere at rest after 1000: the published positions have ten digits, multipliers -19/4."""
    solution = closed("fekete")
    (point,) = references("fekete")
    for i in range(20):
        for k in range(3):
            published = point["values"][f"y{3 * i + k + 1}"]
            assert solution[f"p[{i + 1},{k + 1}]"][-1] == pytest.approx(published, abs=1e-10)
            assert abs(solution[f"der(p[{i + 1},{k + 1}])"][-1]) < 1e-10
        assert solution[f"lambda[{i + 1}]"][-1] == pytest.approx(-4.75, abs=1e-9)
    assert solution["energy.potential"][-1] == pytest.approx(-54.011129974584, abs=1e-11)


def test_chain_that_is_thrown() -> None:
    """The middle of the beads falls freely; the angular momentum about it is constant."""
    solution = closed("jointed_chain")
    t = solution.time
    assert largest(solution["centre[3]"] - (0.078 + 3 * t - g / 2 * t**2)) < 1e-8
    assert largest(solution["centre[2]"] - (0.3 + 1.5 * t)) < 1e-8
    spin = np.zeros((3, t.size))
    for i in range(1, 6):
        r = [solution[f"free[{i}].position[{k}]"] - solution[f"centre[{k}]"] for k in (1, 2, 3)]
        v = [solution[f"der(free[{i}].position[{k}])"] for k in (1, 2, 3)]
        spin += 0.1 * np.cross(np.array(r), np.array(v), axis=0)
    assert largest(spin - spin[:, :1]) < 1e-9
    assert np.ptp(solution["span"]) > 0.1


@pytest.mark.slow
def test_freedoms_of_jointed_chains() -> None:
    """U42: 2 N + 1 of N particles in space, N + 1 in the plane."""
    space = mechc.load(EXAMPLES / "jointed_chain.mech")
    plane = mechc.loads("""import mech.planar.*;
import mech.couplings.*;

model PlaneChain
  structural parameter Integer n = 5;
  Particle bead[n](m = 0.1 kg);
  Translation free[i in 1:n](world -> bead[i].a, position ~ {0.25*i, 0.13*mod(i, 2)} m);
  Distance rod[i in 1:n-1](bead[i].a -> bead[i+1].a, l = 0.3 m);
  output end_of_chain = pos(bead[n].a);
end PlaneChain;
""")
    for n in (2, 5):
        assert space.kinematics(set={"n": n}).summary()["freedoms"] == 2 * n + 1
        assert plane.kinematics(set={"n": n}).summary()["freedoms"] == n + 1
