"""Scattering: against closed forms of angle and cross section, and an integral by SciPy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar
from shared_models import example

import mechc

PARTICLE = """\
model Particle
  dimensionless;
  parameter b = 0.5;
  parameter E = 0.5;
  coordinate x = -10;
  coordinate y = b;
  initial der(x) = sqrt(2*E);
  kinetic 1/2*(der(x)^2 + der(y)^2);
  {force};
end Particle;
"""


def angles(text: str, over: str, **settings: object) -> dict[str, np.ndarray]:
    found = mechc.loads(text).scattering(over=over, **settings).summary()
    b = np.array(found["parameter"]["b"])
    return {"b": b, **{n: np.array(found[n], dtype=float) for n in ("angle", "cross_section", "deflection")}}


def test_rutherford() -> None:
    """tan(angle/2) = alpha/(2 E b), (alpha/(4 E))^2/sin(angle/2)^4; of attraction the other way round."""
    model = example("rutherford")
    for alpha in (1.0, -1.0):
        found = model.scattering(over="b = 0.2 .. 3, 2", set={"alpha": alpha}).summary()
        b = np.array(found["parameter"]["b"])
        exact = 2 * np.arctan(1 / b)
        assert np.abs(np.array(found["angle"]) - exact).max() < 1e-10
        assert np.abs(np.array(found["deflection"]) - alpha * exact).max() < 1e-10
        section = 0.25 / np.sin(exact / 2) ** 4
        assert np.abs(np.array(found["cross_section"]) / section - 1).max() < 1e-8
        assert np.array(found["angle_errors"]).max() < 1e-10


def test_a_hard_disk() -> None:
    """pi - 2 asin(b/R), and in space a quarter of R^2; beyond its edge nothing."""
    hard = PARTICLE.format(force="contact sqrt(x^2 + y^2) - 1 restitution 1")
    found = angles(hard, "b = 0.2 .. 1.4, 3")
    exact = [math.pi - 2 * math.asin(b) if b < 1 else 0.0 for b in found["b"]]
    assert np.abs(found["angle"] - exact).max() < 1e-8
    assert found["cross_section"][:2] == pytest.approx(0.25, abs=1e-8)


def test_an_inverse_square_potential() -> None:
    """pi (1 - b/sqrt(b^2 + k/E))."""
    found = angles(PARTICLE.format(force="potential 0.4/(x^2 + y^2)"), "b = 0.3 .. 2, 2")
    exact = math.pi * (1 - found["b"] / np.sqrt(found["b"] ** 2 + 0.8))
    assert np.abs(found["angle"] - exact).max() < 1e-10


def test_the_rainbow_of_a_lennard_jones_well() -> None:
    """The deflection is pi - 2 b times the integral of du/sqrt(1 - b^2 u^2 - V(1/u)/E); its least is the rainbow."""
    energy = 5.0

    def inside(u: float, b: float) -> float:
        return 1 - b**2 * u**2 - 4 * (u**12 - u**6) / energy

    def deflection(b: float) -> float:
        grid = np.linspace(0, 2, 2001)
        first = next(k for k in range(1, 2001) if inside(grid[k], b) < 0)
        turn = brentq(inside, grid[first - 1], grid[first], args=(b,), xtol=1e-15)
        # u = turn sin(s): the root at the end is gone
        return float(
            math.pi
            - 2 * b * quad(lambda s: turn * math.cos(s) / math.sqrt(inside(turn * math.sin(s), b)), 0, math.pi / 2,
                           epsabs=1e-11)[0]
        )  # fmt: skip

    text = PARTICLE.format(force="potential 4*(1/(x^2 + y^2)^6 - 1/(x^2 + y^2)^3)")
    found = mechc.loads(text).scattering(over="b = 1.2 .. 1.4, 2", set={"E": energy})
    for b, angle in zip(found.summary()["parameter"]["b"], found.summary()["deflection"], strict=True):
        assert angle == pytest.approx(deflection(b), abs=1e-9)
    (rainbow,) = found.summary()["rainbows"]
    least = minimize_scalar(deflection, bounds=(1.2, 1.4), method="bounded", options={"xatol": 1e-9})
    assert rainbow["deflection"] == pytest.approx(least.fun, abs=1e-9)
    assert rainbow["b"] == pytest.approx(least.x, abs=1e-4)
    assert any("rainbow" in remark for remark in found.remarks)


def test_orbiting_is_told() -> None:
    """At a low energy there is an impact parameter at which the particle goes round and round."""
    text = PARTICLE.format(force="potential 4*(1/(x^2 + y^2)^6 - 1/(x^2 + y^2)^3)")
    found = mechc.loads(text).scattering(over="b = 2.2 .. 2.24, 5", set={"E": 0.2})
    assert max(abs(d) for d in found.summary()["deflection"]) > 1
    assert found.summary()["orbiting"] == [b for b, d in zip(found.summary()["parameter"]["b"], found.summary()["deflection"], strict=True) if abs(d) > math.pi]  # fmt: skip


def test_what_is_refused() -> None:
    def refused(text: str, words: str) -> None:
        with pytest.raises(mechc.SimulationError, match=words):
            mechc.loads(text).scattering(over="b = 1 .. 2, 2")

    text = PARTICLE.format(force="potential 1/sqrt(x^2 + y^2)")
    refused(text.replace("x = -10", "x = 10"), "moves away")
    refused(text.replace("sqrt(2*E)", "0*E"), "comes from nowhere")
    refused(text.replace("1/2*(der(x)^2", "1/2*((1 + x^2)*der(x)^2"), "not Cartesian")
    refused(text.replace("kinetic", "coordinate w = 0; coordinate w2 = 0; kinetic 1/2*(der(w)^2 + der(w2)^2) +"), "one particle")  # fmt: skip


def test_a_varied_quantity_that_is_no_impact_parameter() -> None:
    """Over the speed the angle is that of b = 1, and there is no cross section; with y = 2 c the impact parameter is 2 c."""
    found = example("rutherford").scattering(over="v = 1 .. 3, 3")
    said = found.summary()
    assert np.abs(np.array(said["angle"]) - 2 * np.arctan(1 / np.array([1.0, 4.0, 9.0]))).max() < 1e-10
    assert said["cross_section"] == [None] * 3 and said["rainbows"] == []
    assert said["impact_parameter"] == pytest.approx([1, 1, 1], rel=1e-12)
    assert any("'v' is not the impact parameter" in remark for remark in found.remarks)
    alone = example("rutherford").scattering(over="v = 1 .. 2, 1").summary()
    assert alone["impact_parameter"] == [1] and alone["cross_section"] == [None]
    halved = PARTICLE.format(force="potential 1/sqrt(x^2 + y^2)").replace("= b;", "= 2*b;")
    twice = mechc.loads(halved).scattering(over="b = 0.5 .. 1, 2").summary()
    assert twice["impact_parameter"] == pytest.approx([1, 2], rel=1e-12)
    assert twice["cross_section"] == [None, None]


def test_an_impact_parameter_that_changes_more_than_itself() -> None:
    """Where the speed or the force follow from it too, the angles are of other beams at other centres."""
    text = PARTICLE.format(force="potential 1/sqrt(x^2 + y^2)")
    for changed in (text.replace("sqrt(2*E)", "1 + b"), text.replace("potential 1/", "potential b/")):
        found = mechc.loads(changed).scattering(over="b = 0.5 .. 1, 2")
        assert found.summary()["cross_section"] == [None, None]
        assert any("changes" in remark for remark in found.remarks)


def test_a_slanted_beam_has_its_impact_parameter() -> None:
    """Along a line turned by 0.3 at a distance b from the centre, of mass 4: the same angles and cross sections."""
    turned = """\
model Slanted
  dimensionless;
  parameter b = 1;
  coordinate x = -20*cos(0.3) - b*sin(0.3);
  coordinate y = -20*sin(0.3) + b*cos(0.3);
  initial der(x) = 1/2*cos(0.3);
  initial der(y) = 1/2*sin(0.3);
  kinetic 1/2*4*(der(x)^2 + der(y)^2);
  potential 1/sqrt(x^2 + y^2);
end Slanted;
"""
    found = mechc.loads(turned).scattering(over="b = 0.2 .. 3, 2").summary()
    exact = 2 * np.arctan(1 / np.array([0.2, 3.0]))
    assert found["impact_parameter"] == pytest.approx([0.2, 3], rel=1e-10)
    assert found["cross_section"] == pytest.approx(0.25 / np.sin(exact / 2) ** 4, rel=1e-7)


def test_one_motion_has_no_column_of_starts() -> None:
    found = mechc.loads(PARTICLE.format(force="potential 1/sqrt(x^2 + y^2)")).scattering()
    assert "start" not in str(found) and "nan" not in str(found)
