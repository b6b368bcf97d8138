"""Mass and inertia of the library's bodies: their kinetic energy in a given motion, by formulas of textbooks."""

from __future__ import annotations

import numpy as np
import pytest
from numpy import pi
from scipy.integrate import solve_ivp

import mechc

v, w = np.array([1.0, -2.0, 0.5]), np.array([3.0, 0.7, -1.1])
rho = 800.0

# declaration, mass, mass centre in frame a, inertia about it
PLANAR = [
    ("Body(m = 2 kg, J = 0.3 kg.m^2, com = {0.1, -0.2} m)", 2, (0.1, -0.2), 0.3),
    ("Bar(m = 2 kg, l = 1.5 m)", 2, (0.75, 0), 2 * 1.5**2 / 12),
    ("Rod(m = 2 kg, l = 1.5 m)", 2, (0, -0.75), 2 * 1.5**2 / 12),
    ("Rod(m = 2 kg, l = 1.5 m, direction = {3, 4})", 2, (0.45, 0.6), 2 * 1.5**2 / 12),
    ("Disk(m = 2 kg, r = 0.4 m)", 2, (0, 0), 2 * 0.16 / 2),
    ("Disk(density = 800 kg/m^3, r = 0.4 m, inner = 0.3 m, thickness = 0.1 m)",
     rho * pi * 0.07 * 0.1, (0, 0), rho * pi * 0.07 * 0.1 * 0.25 / 2),
    ("Box(m = 2 kg, size = {0.3, 0.5} m)", 2, (0, 0), 2 * (0.09 + 0.25) / 12),
    ("Box(density = 800 kg/m^3, size = {0.3, 0.5} m, depth = 0.2 m)",
     rho * 0.03, (0, 0), rho * 0.03 * (0.09 + 0.25) / 12),
    ("Sphere(m = 2 kg, r = 0.4 m)", 2, (0, 0), 0.4 * 2 * 0.16),
    ("Sphere(density = 800 kg/m^3, r = 0.4 m, inner = 0.2 m)",
     rho * 4 / 3 * pi * 0.056, (0, 0), rho * 8 / 15 * pi * (0.4**5 - 0.2**5)),
    ("Sphere(m = 2 kg, r = 0.4 m, inner = 0.4 m)", 2, (0, 0), 2 / 3 * 2 * 0.16),
]  # fmt: skip

axis = np.array([1.0, 2.0, 2.0]) / 3
along, across = 2 * 0.16 / 2, 2 * (3 * 0.16 + 0.49) / 12
turned = np.array(
    [axis, [0, 1 / np.sqrt(2), -1 / np.sqrt(2)], np.cross(axis, [0, 1 / np.sqrt(2), -1 / np.sqrt(2)])]
).T
SPATIAL = [
    ("Body(m = 2 kg, J = {{0.3, 0.01, 0}, {0.01, 0.4, 0}, {0, 0, 0.5}} kg.m^2, com = {0.1, -0.2, 0.3} m)",
     2, (0.1, -0.2, 0.3), [[0.3, 0.01, 0], [0.01, 0.4, 0], [0, 0, 0.5]]),
    ("Bar(m = 2 kg, l = 1.5 m)", 2, (0.75, 0, 0), 2 * 1.5**2 / 12 * np.diag([0, 1, 1])),
    ("Rod(m = 2 kg, l = 1.5 m, direction = {1, 2, 2})",
     2, tuple(0.75 * axis), 2 * 1.5**2 / 12 * (np.eye(3) - np.outer(axis, axis))),
    ("Link(m = 2 kg, r = {1, 2, 2} m, side = {0, 1, -1}, width = 0.3 m, height = 0.5 m)",
     2, (0.5, 1, 1), 2 / 12 * (turned @ np.diag([0.34, 9.25, 9.09]) @ turned.T)),
    ("Link(r = {0, 0, 2} m)", 7850 * 0.02, (0, 0, 1), 7850 * 0.02 / 12 * np.diag([4.01, 4.01, 0.02])),
    ("Tube(r = {2, 0, 0} m, diameter = 0.4 m, inner = 0.2 m, density = 800 kg/m^3)",
     rho * 2 * pi * 0.03, (1, 0, 0), rho * 2 * pi * 0.03 * np.diag([0.025, 0.0125 + 1 / 3, 0.0125 + 1 / 3])),
    ("Disk(m = 2 kg, r = 0.4 m)", 2, (0, 0, 0), 2 * 0.16 * np.diag([0.25, 0.25, 0.5])),
    ("Disk(m = 2 kg, r = 0.4 m, inner = 0.3 m, axis = {0, 5, 0})",
     2, (0, 0, 0), 2 * 0.25 * np.diag([0.25, 0.5, 0.25])),
    ("Box(m = 2 kg, size = {0.3, 0.5, 0.7} m)", 2, (0, 0, 0), 2 / 12 * np.diag([0.74, 0.58, 0.34])),
    ("Cylinder(m = 2 kg, r = 0.4 m, l = 0.7 m, axis = {1, 2, 2})",
     2, (0, 0, 0), across * np.eye(3) + (along - across) * np.outer(axis, axis)),
    ("Cylinder(density = 800 kg/m^3, r = 0.4 m, inner = 0.3 m, l = 0.7 m)",
     rho * pi * 0.07 * 0.7, (0, 0, 0),
     rho * pi * 0.07 * 0.7 * np.diag([(0.75 + 0.49) / 12, (0.75 + 0.49) / 12, 0.125])),
    ("Sphere(m = 2 kg, r = 0.4 m)", 2, (0, 0, 0), 0.4 * 2 * 0.16 * np.eye(3)),
    ("Sphere(density = 800 kg/m^3, r = 0.4 m, inner = 0.2 m)",
     rho * 4 / 3 * pi * 0.056, (0, 0, 0), rho * 8 / 15 * pi * (0.4**5 - 0.2**5) * np.eye(3)),
    ("Sphere(m = 2 kg, r = 0.4 m, inner = 0.4 m)", 2, (0, 0, 0), 2 / 3 * 2 * 0.16 * np.eye(3)),
]  # fmt: skip


def kinetic_energy(library: str, declaration: str, rates: str, extra: str = "") -> float:
    name, _, rest = declaration.partition("(")
    model = mechc.loads(
        f"import mech.{library}.*;\n{name} body({rest};\nFree motion(world -> body.a, {rates});\n{extra}"
    )
    solution = model.simulate(stop=1e-3, tolerance=1e-8)
    assert solution.outcome.value == "completed", solution.message
    return float(solution["energy.kinetic"][0])


@pytest.mark.parametrize(("declaration", "mass", "centre", "inertia"), PLANAR)
def test_planar(declaration: str, mass: float, centre: tuple[float, float], inertia: float) -> None:
    rates = "der(x) = 1 m/s, der(y) = -2 m/s, der(angle) = 3 rad/s"
    speed = v[:2] + 3 * np.array([-centre[1], centre[0]])
    expected = mass * speed @ speed / 2 + inertia * 9 / 2
    assert kinetic_energy("planar", declaration, rates) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize(("declaration", "mass", "centre", "inertia"), SPATIAL)
def test_spatial(
    declaration: str, mass: float, centre: tuple[float, float, float], inertia: np.ndarray
) -> None:
    rates = "der(position) = {1, -2, 0.5} m/s, der(orientation) = {3, 0.7, -1.1} rad/s"
    # a slender bar has no inertia about itself: a ball around its end keeps that rotation from being massless
    slender = declaration.startswith(("Bar", "Rod"))
    extra = "inertia 1 kg.m^2*identity(3) on body.a;\n" if slender else ""
    inertia = inertia + np.eye(3) if slender else inertia
    speed = v + np.cross(w, centre)
    expected = mass * speed @ speed / 2 + w @ np.asarray(inertia) @ w / 2
    assert kinetic_energy("spatial", declaration, rates, extra) == pytest.approx(expected, rel=1e-13)


def test_a_rotor_that_a_free_body_carries_turns_it() -> None:
    """A gyrostat whose motor speeds up: J w' + w x (J w + Jr s e) + Jr s' e = 0 and Jr (s' + e.w') = M in the axes of the body, by SciPy."""
    s = mechc.loads(
        "import mech.spatial.*; model M Body b(m = 2 kg, J = diag({0.5, 0.6, 0.9}) kg.m^2);"
        "Free free(world -> b.a, der(orientation) = {1, 2, 0.5} rad/s);"
        "CarriedRotor rotor(to = b.a, J = 0.1 kg.m^2, axis = {1, 2, 2}, angle = 0 rad, der(angle) = 30 rad/s);"
        "force 0.3 N.m on rotor.angle; output rate[3] = components(b.a, angvel(b.a));"
        "experiment(stop = 2 s, tolerance = 1e-11); end M;"
    ).simulate(estimate_error=False)
    J, e = np.diag([0.5, 0.6, 0.9]), np.array([1, 2, 2]) / 3

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        rate, spin = y[:3], y[3]
        M = np.block([[J, 0.1 * e[:, None]], [0.1 * e[None, :], np.array([[0.1]])]])
        found: np.ndarray = np.linalg.solve(M, np.append(-np.cross(rate, J @ rate + 0.1 * spin * e), 0.3))
        return found

    y = solve_ivp(rates, (0, 2), [1, 2, 0.5, 30], "DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    assert [*s["rate"][-1], s["der(rotor.angle)"][-1]] == pytest.approx(y, abs=1e-9)
