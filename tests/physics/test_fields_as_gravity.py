"""Gravity as a function of the place: a potential, or an acceleration.

Judges: Kepler's closed orbit, SciPy, and Hill's tidal frequency of a dumb-bell.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from refusals import refused
from scipy.integrate import solve_ivp

import mechc

MU = 3.986004418e14
FIELDS = (
    "function potential_of_earth(Length r[3]) = -3.986004418e14 m^3/s^2/norm(r);\n"
    "function earth(Length r[3]) = -3.986004418e14 m^3/s^2*r/norm(r)^3;\n"
)
SATELLITE = FIELDS + (
    "model Satellite\n import mech.spatial.*; gravity FIELD; Body b(m = 5 kg, J = diag({1, 2, 3} kg.m^2));\n"
    " Free fr(world -> b.a, position = {7000, 0, 0} km, der(position) = {0, 8, 1} km/s); initial der(fr.orientation) = {0, 0, 0};\n"
    " experiment(stop = 6000 s, tolerance = 1e-11);\nend Satellite;"
)


def orbit(t: np.ndarray) -> np.ndarray:
    def rates(_: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[3:], -MU * y[:3] / np.linalg.norm(y[:3]) ** 3])

    run = solve_ivp(
        rates, (0, t[-1]), [7e6, 0, 0, 0, 8e3, 1e3], rtol=1e-13, atol=1e-6, t_eval=t, method="DOP853"
    )
    return np.asarray(run.y[:3])


@pytest.mark.parametrize("field", ["potential_of_earth", "earth"])
def test_a_satellite(field: str) -> None:
    solution = mechc.loads(SATELLITE.replace("FIELD", field)).simulate(estimate_error=False)
    mine = np.array([solution[f"fr.position[{k}]"] for k in (1, 2, 3)])
    assert mine == pytest.approx(orbit(solution.time), rel=1e-7, abs=1)
    assert np.ptp(solution["der(fr.orientation)[3]"]) < 1e-12


def test_a_potential_is_an_energy_and_an_acceleration_is_a_force() -> None:
    specific = (8e6 * 8 + 1e6) / 2 - MU / 7e6
    by_energy = mechc.loads(SATELLITE.replace("FIELD", "potential_of_earth")).simulate(estimate_error=False)
    assert by_energy["energy.total"] == pytest.approx(5 * specific, rel=1e-9)
    by_force = mechc.loads(SATELLITE.replace("FIELD", "earth")).simulate(estimate_error=False)
    balance = by_force["energy.total"] - by_force["energy.supplied"]
    assert np.ptp(balance) < 1e-6 * abs(5 * specific)


def test_a_note_says_what_is_left_out() -> None:
    codes = [d.code for d in mechc.loads(SATELLITE.replace("FIELD", "earth")).diagnostics]
    assert codes.count("N0569") == 1


def test_masses_of_a_body_feel_it_each_at_its_place() -> None:
    """A dumb-bell that points to the earth swings about that with sqrt(3) times the rate of its orbit, by its two masses."""
    rate = math.sqrt(MU / 7e6**3)
    text = FIELDS + (
        "model Dumbbell\n gravity potential_of_earth; coordinate Angle way = 0 rad; coordinate Length away = 7000 km; coordinate Angle tilt = 0.001 rad;\n"
        f" initial der(way) = {rate!r} rad/s; initial der(away) = 0 m/s; initial der(tilt) = 0 rad/s;\n"
        " frame at_centre = world * rotz(way) * trans({away, 0, 0}); frame bar = at_centre * rotz(tilt);\n"
        " mass 10 kg at bar * {50, 0, 0} m; mass 10 kg at bar * {-50, 0, 0} m; experiment(stop = 3000 s, tolerance = 1e-12);\nend Dumbbell;"
    )
    solution = mechc.loads(text).simulate(estimate_error=False)
    expected = 0.001 * np.cos(math.sqrt(3) * rate * solution.time)
    assert solution["tilt"] == pytest.approx(expected, abs=3e-5)


def test_in_the_plane_and_the_nearest_one_holds() -> None:
    """Inside the part a spring field, outside uniform gravity."""
    text = (
        "function bowl(Length r[2]) = 1/2*4 s^-2*dot(r, r);\n"
        "model Ball\n gravity bowl; coordinate Length x = 1 m; initial der(x) = 0 m/s; mass 3 kg at world * {x, 0 m}; end Ball;\n"
        "model M\n gravity {0, -9.81} m/s^2; Ball ball; coordinate Length y = 0 m; initial der(y) = 0 m/s; mass 2 kg at world * {0 m, y};\n"
        " experiment(stop = 1 s);\nend M;"
    )
    solution = mechc.loads(text).simulate(estimate_error=False)
    assert solution["ball.x"] == pytest.approx(np.cos(2 * solution.time), abs=1e-8)
    assert solution["y"][-1] == pytest.approx(-9.81 / 2, rel=1e-9)


def test_of_numbers_without_a_dimension() -> None:
    text = "dimensionless; function sun(r[2]) = -1/norm(r); gravity sun; coordinate x = 1; coordinate y = 0; initial der(x) = 0; initial der(y) = 1;\nmass 1 at world * {x, y}; experiment(stop = 6, tolerance = 1e-11);"
    solution = mechc.loads(text).simulate(estimate_error=False)
    assert solution["x"] == pytest.approx(np.cos(solution.time), abs=1e-8)


MASS = "coordinate Length x = 1 m; mass 1 kg at world * {x, 0 m};\n"


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("function f(Length r[2]) = 3 J*norm(r)/1 m; gravity f;\n" + MASS, "E0323"),
        ("function f(Length r[3]) = 3 m^2/s^2*norm(r)/1 m; gravity f;\n" + MASS, "E0305"),
        ("function f(Length r[2], Mass m) = 3 m^2/s^2*norm(r)/1 m; gravity f;\n" + MASS, "E0309"),
        (
            "function f(Length r[2]) = 3 m^2/s^2*norm(r)/1 m; gravity {0, -9.81} m/s^2; gravity f;\n" + MASS,
            "E0418",
        ),
        ("function f(Time r) = {0, -1 m/s^3*r}; gravity f;\n" + MASS, "E0305"),
        ("gravity g;\n" + MASS, "E0201"),
    ],
)
def test_wrong_models(text: str, code: str) -> None:
    caught = refused(text)
    assert caught[0].code == code, caught[0].message


def test_a_field_that_reaches_no_mass() -> None:
    text = "function f(Length r[2]) = 3 m^2/s^2*norm(r)/1 m; gravity f; coordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2;"
    assert "W0401" in [d.code for d in mechc.loads(text).diagnostics]
