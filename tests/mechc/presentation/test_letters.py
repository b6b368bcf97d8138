"""Names and units of pictures."""

from __future__ import annotations

import pytest

from mechc.presentation.letters import letters, unit_text
from mechc.presentation.numbers import as_quotient


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("theta", r"$\theta$"),
        ("x", "$x$"),
        ("x12", "$x_{12}$"),
        ("q[3]", "$q_{3}$"),
        ("r[1,2]", "$r_{1,2}$"),
        ("r[1,]", "$r_{1}$"),
        ("p_theta", r"$p_{\theta}$"),
        ("E_pot", r"$E_{\mathrm{pot}}$"),
        ("der(theta)", r"$\dot{\theta}$"),
        ("der(R)[2]", r"$\dot{R}_{2}$"),
        ("tip[1]", "tip$_{1}$"),
        ("th1", "th1"),
        ("at_1[2]", "at_1$_{2}$"),
        ("height", "height"),
        ("leg[1].slide.position", "leg[1].slide.position"),
        ("der(elbow.angle)", "der(elbow.angle)"),
    ],
)
def test_names(name: str, shown: str) -> None:
    assert letters(name) == shown


def test_units() -> None:
    assert unit_text("kg.m^2/s") == "kg·m²/s"
    assert unit_text("1/s^12") == "1/s¹²"
    assert unit_text("m^-1") == "m⁻¹"


@pytest.mark.parametrize(
    ("unit", "shown"),
    [
        ("rad.s/kg/m^2", "rad.s/(kg.m^2)"),
        ("1/s/m", "1/(s.m)"),
        ("m/s.kg/A", "m.kg/(s.A)"),
        ("m^(1/2)/s", "m^(1/2)/s"),
        ("kg/m^(1/2)/s^0.5", "kg/(m^(1/2).s^0.5)"),
        ("N.m/rad", "N.m/rad"),
        ("m", "m"),
        ("1", "1"),
    ],
)
def test_a_unit_has_one_stroke_for_people(unit: str, shown: str) -> None:
    assert as_quotient(unit) == shown
    assert unit_text(unit).count("/") <= shown.count("/")
