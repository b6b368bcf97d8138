"""Energies that a model contains already: warned of; what only looks like it: not."""

from __future__ import annotations

import pytest

import mechc

PENDULUM = """\
import mech.planar.*;
parameter g = 9.81 m/s^2;
gravity {0, -g};
Bar bar(m = 2 kg, l = 1 m);
Revolute pin(world -> bar.a, angle = 10 deg);
"""
HOOP = """\
parameter m = 1 kg; parameter R = 1 m; parameter w = 5 rad/s;
coordinate theta = 10 deg;
kinetic 1/2*m*R^2*(der(theta)^2 + sin(theta)^2*w^2);
potential -m*9.81 m/s^2*R*cos(theta);
"""
FALL = "coordinate Length y = 1 m; gravity {0, -9.81} m/s^2; mass 2 kg at world * {0 m, y};\n"
OSCILLATOR = "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; potential 1/2*3 N/m*x^2;\n"


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        (FALL + "potential 2 kg*9.81 m/s^2*(y - 3 m);", "W0567", "weight"),
        (PENDULUM + "potential 2 kg*g*pos(bar.c)[2];", "W0567", "weight"),
        (HOOP + "potential -1/2*m*w^2*R^2*sin(theta)^2;", "W0567", "centrifugal"),
        (HOOP + "potential 1/2*m*w^2*R^2*cos(theta)^2;", "W0567", "centrifugal"),
        (OSCILLATOR + "parameter c = 0.3 kg/s; force c*der(x) on x;", "W0532", "along every motion"),
        (OSCILLATOR + "force 0.1 kg/m*abs(der(x))*der(x) on x;", "W0532", "along every motion"),
    ],
)
def test_an_energy_too_much_is_warned_of(text: str, code: str, words: str) -> None:
    found = [d.message for d in mechc.loads(text).diagnostics if d.code == code]
    assert len(found) == 1 and words in found[0]


@pytest.mark.parametrize(
    "text",
    [
        FALL + "potential -2 kg*9.81 m/s^2*y;",
        FALL + "potential 1 kg*9.81 m/s^2*y;",
        PENDULUM + "potential 1/2*20 N.m*pin.angle^2;",
        HOOP,
        OSCILLATOR + "parameter c = 0.3 kg/s; force -c*der(x) on x;",
        OSCILLATOR + "force 0.3 kg/s*der(x)*(1 - x^2/1 m^2) on x;",
        OSCILLATOR + "force 2 N on x;",
        OSCILLATOR + "input Force u = 0 N; force u on x;",
    ],
)
def test_what_a_model_needs_is_not(text: str) -> None:
    assert [d.code for d in mechc.loads(text).diagnostics if d.code in ("W0567", "W0532")] == []
