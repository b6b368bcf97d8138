"""Starts from guesses at which conditions have no slope: kinetic energies at rest, squares at zero, speeds of nothing.

Nearest states by hand: along the axis in which the quadratic form is largest.
"""

from __future__ import annotations

import numpy as np
import pytest

import mechc
from mechc.runtime.outcome import SimulationError

PENDULUMS = """
  dimensionless;
  coordinate a = 0;
  coordinate b = 0;
  kinetic der(a)^2 + 1/2*der(b)^2 + der(a)*der(b)*cos(a - b);
  potential -2*cos(a) - cos(b);
"""


def start(text: str) -> dict[str, float]:
    found = mechc.loads(text).simulate(stop=1e-9, estimate_error=False)
    assert isinstance(found, mechc.Solution)
    return {q.name: float(found[q.name][0]) for q in found.problem.states}


def test_energy_of_a_double_pendulum_guessed_at_rest() -> None:
    """T = v M v/2 = 1.5; the shortest v lies along the vector of the largest value of M."""
    state = start(f"{PENDULUMS} initial energy() = -1.5;")
    values, vectors = np.linalg.eigh([[2.0, 1.0], [1.0, 1.0]])
    v = vectors[:, 1] * np.sqrt(3.0 / values[1]) * np.sign(vectors[0, 1])
    assert (state["der(a)"], state["der(b)"]) == pytest.approx(tuple(v), rel=1e-9)


@pytest.mark.parametrize(("given", "other"), [("der(a)", "der(b)"), ("der(b)", "der(a)")])
def test_energy_where_one_velocity_is_given(given: str, other: str) -> None:
    state = start(f"{PENDULUMS} initial {given} = 0; initial energy() = -1.5;")
    assert state[given] == 0.0
    assert abs(state[other]) == pytest.approx({"der(a)": 1.5, "der(b)": 3.0}[other] ** 0.5, rel=1e-12)


@pytest.mark.parametrize("energy", [1e-6, 1.0, 1e9])
def test_energies_of_any_size(energy: float) -> None:
    state = start(
        "coordinate Length x = 0 m; kinetic 1/2*(3 kg)*der(x)^2; potential 0 J; "
        f"initial energy() = {energy} J;",
    )
    assert state["der(x)"] == pytest.approx((2 * energy / 3) ** 0.5, rel=1e-12)


def test_a_speed_whose_direction_is_open() -> None:
    state = start(
        "coordinate Length r[2] = {0, 1} m; kinetic 1/2*(2 kg)*dot(der(r), der(r)); potential (20 N)*r[2]; "
        "initial norm(der(r)) = 300 m/s;",
    )
    assert np.hypot(state["der(r[1])"], state["der(r[2])"]) == pytest.approx(300, rel=1e-12)


@pytest.mark.parametrize("size", [1.0, 1e3])
def test_a_square_at_zero(size: float) -> None:
    state = start(
        "dimensionless; coordinate x ~ 0; coordinate y = 1; kinetic 1/2*(der(x)^2 + der(y)^2); potential y; "
        f"constraint apart: x^2 = {size}^2;",
    )
    assert abs(state["x"]) == pytest.approx(size, rel=1e-12)


def test_an_ellipse_from_its_centre() -> None:
    """The nearest points are the ends of the short axis, however far the long one is."""
    state = start(
        "dimensionless; coordinate x ~ 0; coordinate y ~ 0; kinetic 1/2*(der(x)^2 + der(y)^2); potential y; "
        "constraint on: (x/50)^2 + (y/20)^2 = 1;",
    )
    assert (abs(state["x"]), abs(state["y"])) == pytest.approx((0, 20), abs=1e-9)


def test_two_arms_guessed_stretched() -> None:
    """No slope shortens them; 2 cos a = 1.2."""
    state = start(
        "dimensionless; coordinate a ~ 0; coordinate b ~ 0; "
        "kinetic der(a)^2 + 1/2*der(b)^2 + der(a)*der(b)*cos(a - b); potential sin(a) + sin(b); "
        "constraint x: cos(a) + cos(b) = 1.2; constraint y: sin(a) + sin(b) = 0;",
    )
    assert state["a"] == pytest.approx(-state["b"], abs=1e-12)
    assert np.cos(state["a"]) == pytest.approx(0.6, abs=1e-12)


def test_an_energy_below_the_potential_is_refused() -> None:
    with pytest.raises(SimulationError) as caught:
        start(f"{PENDULUMS} initial energy() = -3.5;")
    assert caught.value.code == "E0605"
    assert any("off by 0.5" in note for note in caught.value.notes)
