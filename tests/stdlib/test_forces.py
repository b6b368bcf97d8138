"""Force elements and fields of the library: accelerations at a known state, by the laws they are named after."""

from __future__ import annotations

import numpy as np
import pytest

import mechc

# A particle of 2 kg at (3, 4) m, at (3, 4, 12) m in space, with the velocity (1, -2[, 0.5]) m/s.
HEAD = {
    2: (
        "import mech.planar.*;\nimport mech.fields.*;\nParticle p(m = 2 kg);\n"
        "Translation t(world -> p.a, position = {3, 4} m, der(position) = {1, -2} m/s);\n"
        "output a = der(vel(p.a));\n"
    ),
    3: (
        "import mech.spatial.*;\nimport mech.fields.*;\nParticle p(m = 2 kg);\n"
        "Translation t(world -> p.a, position = {3, 4, 12} m, der(position) = {1, -2, 0.5} m/s);\n"
        "output a = der(vel(p.a));\n"
    ),
}
r2, v2 = np.array([3.0, 4]), np.array([1.0, -2])
r3, v3 = np.array([3.0, 4, 12]), np.array([1.0, -2, 0.5])
n2, n3 = r2 / 5, r3 / 13
B = np.array([0.2, -0.1, 0.4])

PARTICLES = [
    (2, "Spring s(world -> p.a, k = 10 N/m, rest = 2 m);", -10 * 3 * n2 / 2),
    (3, "Spring s(world -> p.a, k = 10 N/m, rest = 2 m);", -10 * 11 * n3 / 2),
    (2, "Damper d(world -> p.a, c = 3 N.s/m);", -3 * (v2 @ n2) * n2 / 2),
    (3, "Damper d(world -> p.a, c = 3 N.s/m);", -3 * (v3 @ n3) * n3 / 2),
    (2, "UniformMagneticField f(to = p.a, q = 3 C, B = 0.4 T);", 3 * 0.4 * np.array([v2[1], -v2[0]]) / 2),
    (3, "UniformMagneticField f(to = p.a, q = 3 C, B = {0.2, -0.1, 0.4} T);", 3 * np.cross(v3, B) / 2),
    (2, "InverseSquare f(world -> p.a, k = 7 J.m);", -7 / 25 * n2 / 2),
    (3, "InverseSquare f(world -> p.a, k = -7 J.m);", 7 / 169 * n3 / 2),
    (3, "CentralField f(world -> p.a, V0 = 7 J, r0 = 2 m, n = 3);", -3 * 7 / 8 * 169 * n3 / 2),
    (3, "Gravitation f(world -> p.a, m1 = 5 kg, m2 = 2 kg, G = 0.1 m^3/kg/s^2);", -0.1 * 5 / 169 * n3),
    (2, "Coulomb f(world -> p.a, q1 = 1e-5 C, q2 = 2e-5 C);", 2e-10 / (4 * np.pi * 8.8541878128e-12) / 25 * n2 / 2),
    (2, "LinearDrag f(to = p.a, c = 3 N.s/m);", -3 * v2 / 2),
    (3, "LinearDrag f(to = p.a, c = 3 N.s/m);", -3 * v3 / 2),
    (3, "QuadraticDrag f(to = p.a, k = 3 kg/m);", -3 * np.linalg.norm(v3) * v3 / 2),
]  # fmt: skip


def start(text: str) -> dict[str, float]:
    solution = mechc.loads(text).simulate(stop=1e-3, tolerance=1e-8)
    assert solution.outcome.value == "completed", solution.message
    return {name: float(values[0]) for name, values in solution.items()}


@pytest.mark.parametrize(("space", "element", "acceleration"), PARTICLES)
def test_on_a_particle(space: int, element: str, acceleration: np.ndarray) -> None:
    got = start(HEAD[space] + element)
    assert [got[f"a[{i + 1}]"] for i in range(space)] == pytest.approx(acceleration, rel=1e-13)


# A rotor (4 kg.m^2) on the stator (6 kg.m^2), both turning about one axis: rates 1 and 3 rad/s against each other.
ROTORS = {
    2: (
        "import mech.planar.*;\nBody stator(J = 6 kg.m^2);\nBody rotor(J = 4 kg.m^2);\n"
        "Revolute base(world -> stator.a, der(angle) = 1 rad/s);\n"
        "Revolute shaft(stator.a -> rotor.a, angle = 0.5 rad, der(angle) = 3 rad/s);\n"
    ),
    3: (
        "import mech.spatial.*;\nBody stator(J = 6 kg.m^2*identity(3));\nBody rotor(J = 4 kg.m^2*identity(3));\n"
        "Revolute base(world -> stator.a, der(angle) = 1 rad/s, axis = {1, 0, 0});\n"
        "Revolute shaft(stator.a -> rotor.a, angle = 0.5 rad, der(angle) = 3 rad/s, axis = {1, 0, 0});\n"
    ),
}
TORQUES = [
    (2, "TorsionSpring e(stator.a -> rotor.a, k = 8 N.m/rad, rest = 0.2 rad);", -8 * 0.3),
    (3, "TorsionSpring e(angle = shaft.angle, k = 8 N.m/rad, rest = 0.2 rad);", -8 * 0.3),
    (2, "TorsionDamper e(stator.a -> rotor.a, c = 2 N.m.s);", -2 * 3.0),
    (3, "TorsionDamper e(angle = shaft.angle, c = 2 N.m.s);", -2 * 3.0),
    (2, "Motor e(stator.a -> rotor.a, drive_torque = 5 N.m);", 5.0),
    (3, "Motor e(stator.a -> rotor.a, axis = {1, 0, 0}, drive_torque = 5 N.m);", 5.0),
    (2, "SpeedMotor e(stator.a -> rotor.a, gain = 2 N.m.s, speed = 7 rad/s);", 2 * 4.0),
    (3, "SpeedMotor e(stator.a -> rotor.a, axis = {1, 0, 0}, gain = 2 N.m.s, speed = 7 rad/s);", 2 * 4.0),
]


@pytest.mark.parametrize(("space", "element", "torque"), TORQUES)
def test_between_two_rotors(space: int, element: str, torque: float) -> None:
    """The rotor gets the torque, the stator its reaction."""
    outputs = "output stator_acceleration = der(base.angle, 2);\noutput relative = der(shaft.angle, 2);\n"
    got = start(ROTORS[space] + element + "\n" + outputs)
    assert got["stator_acceleration"] == pytest.approx(-torque / 6, rel=1e-13)
    assert got["relative"] == pytest.approx(torque / 4 + torque / 6, rel=1e-13)


def test_constants() -> None:
    """A few of them against scipy's CODATA values, and the standard gravity by definition."""
    from scipy import constants

    names = {
        "speed_of_light": constants.c,
        "elementary_charge": constants.e,
        "planck_constant": constants.h,
        "boltzmann_constant": constants.k,
        "standard_gravity": constants.g,
        "astronomical_unit": constants.au,
        "electron_mass": constants.m_e,
        "proton_mass": constants.m_p,
        "atomic_mass": constants.atomic_mass,
        "electric_constant": constants.epsilon_0,
        "gravitational_constant": constants.G,
    }
    text = "import mech.constants.*;\ncoordinate x = 1 m;\nkinetic 1/2*1 kg*der(x)^2;\n"
    got = start(text + "".join(f"output c_{name} = {name}();\n" for name in names))
    for name, value in names.items():
        # later adjustments differ in the ninth digit
        assert got[f"c_{name}"] == pytest.approx(value, rel=1e-7)
