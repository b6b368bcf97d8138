"""Constraints between velocities: which could be written between positions."""

from __future__ import annotations

import pytest

import mechc

PLANE = (
    "coordinate x = 0 m;coordinate y = 0.2 m;coordinate Angle a = 0.3 rad;parameter l = 1 m;"
    "kinetic 1/2*1 kg*(der(x)^2 + der(y)^2) + 1/2*1 kg.m^2*der(a)^2;"
)


@pytest.mark.parametrize(
    ("constraint", "integrable"),
    [
        ("der(x) = l*der(a)", True),
        ("x*der(y) + y*der(x) = 0", True),
        ("y*der(x) - x*der(y) = 0", True),  # with the factor 1/y^2
        ("der(x) = 1 m/s", True),
        ("der(x)*cos(a) = l*der(a)", True),
        ("-der(x)*sin(a) + der(y)*cos(a) = 0", False),
        ("der(x) = y*der(a)", False),
        ("der(x) = a*1 m/s", False),
        ("{der(x), der(y)} = {y*der(a), l*der(a)}", True),
        ("{der(x), der(y)} = {l*cos(a)*der(a), l*sin(a)*der(a)}", True),
    ],
)
def test_note(constraint: str, integrable: bool) -> None:
    model = mechc.loads(f"{PLANE}constraint c: {constraint};")
    assert ("N0505" in [d.code for d in model.diagnostics]) is integrable


@pytest.mark.parametrize("example", ["chaplygin_sleigh", "ball_on_turntable"])
def test_rolling_and_knives_stay_nonholonomic(example: str) -> None:
    from gallery import load

    assert not load(example).diagnostics
