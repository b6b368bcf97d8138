"""What a force, a damping or a friction may act on, and where accelerations may not stand."""

from __future__ import annotations

import pytest
from compiled import compiled, outcome

from mechc.lang.diagnostics import CompileError

TWO = """
coordinate Length x = 0.3 m; coordinate Length y = 0.1 m;
kinetic 1/2*2 kg*(der(x)^2 + der(y)^2); potential 1/2*10 N/m*x^2;
"""
STATE = {"x": 0.3, "y": 0.1, "der(x)": 0.5, "der(y)": -0.7}
T, V = 0.74, 0.45


@pytest.mark.parametrize(
    ("statement", "x", "y"),
    [
        ("force 0.1 on potential_energy();", 0.1 * 3, 0),
        ("force 0.1 m/s^2 on momentum(x);", 0.2, 0),
        ("force p: 3 N on x; force 0.1 on power(p);", 3 + 0.3, 0),
        ("damping 0.1 s/J on potential_energy();", -0.1 * (3 * 0.5) * 3, 0),
        ("damping 0.1 s/kg/m^2 on kinetic_energy();", -0.1 * T * 2 * 0.5, 0.1 * T * 2 * 0.7),
        ("damping 0.1 s/kg/m^2 on energy();", -0.1 * (T + V) * 2 * 0.5, 0.1 * (T + V) * 2 * 0.7),
        ("damping 0.1 s/kg/m^2 on 1/2*2 kg*(der(x)^2 + der(y)^2);", -0.1 * T, 0.1 * T * 1.4),
    ],
)
def test_questions_that_are_acted_on(statement: str, x: float, y: float) -> None:
    """What contains velocities is a rate itself: f on s is f ds/dv, damping c on s is c s ds/dv; V is a place."""
    model = compiled(TWO + statement)
    rates = outcome(model, "rhs", STATE)
    assert 2 * rates["der(x)"] == pytest.approx(x - 3, rel=1e-13)
    assert 2 * rates["der(y)"] == pytest.approx(y, rel=1e-13, abs=1e-15)


@pytest.mark.parametrize(
    ("statement", "code", "words"),
    [
        ("force 0.1 on energy();", "E0322", "a force on an energy (J) is a rate"),
        ("force 0.1 on momentum(x);", "E0322", "a force on a momentum (kg.m/s) is an acceleration"),
        ("damping 0.1 s/J on energy();", "E0322", "the damping of an energy (J) is in s/kg/m^2"),
        ("force 0.1 Hz on energy();", "E0539", "not affine in the velocities"),
        ("let e = kinetic_energy(); force 0.1 Hz on e;", "E0539", "not affine in the velocities"),
        ("force 1 N on der(x)^2*1 s/m;", "E0539", "not affine in the velocities"),
        ("friction 0.1 Hz on kinetic_energy();", "E0539", "not affine in the velocities"),
        ("force p: -1 N*der(x)*1 s/m on x; force 0.1 on power(p);", "E0539", "not affine"),
        ("potential 0.1 N.s*der(y); force 0.1 on potential_energy();", "E0539", "neither a place nor a rate"),
        ("constraint c: y = 0.1 m; force 0.1 m on multiplier(c);", "E0539", "about forces"),
        ("force 1 N on der(x, 2)*1 s;", "E0539", "contains accelerations"),
        ("friction 0.1 kg*der(y, 2)^2/(1 m/s^2) on x;", "E0519", "not affine in accelerations"),
        ("contact c: y friction 0.1*der(x, 2)/(1 m/s^2) along der(x);", "E0519", "coefficient of friction"),
        ("contact c: y restitution 0.1*der(x, 2)/(1 m/s^2);", "E0519", "restitution"),
        ("damping 0.1 kg*der(y, 2)/(1 m/s) on x;", "E0519", "a damping"),
        ("gravity {0, -1*der(x, 2)}; mass 1 kg at world*{x, y};", "E0519", "'gravity'"),
        ("mass 1 kg*der(x, 2)/(1 m/s^2) at world*{x, y};", "E0513", "a mass"),
        ("inertia 1 kg.m^2*der(x, 2)/(1 m/s^2) on world*rot(y/(1 m));", "E0513", "an inertia"),
        ("gravity {0, -9.81*(1 + x/(1 m))} m/s^2; mass 1 kg at world*{x, y};", "E0513", "'gravity'"),
        ("gravity {0, -9.81*(1 + der(x)/(1 m/s))} m/s^2; mass 1 kg at world*{x, y};", "E0513", "'gravity'"),
    ],
)
def test_what_nothing_acts_on(statement: str, code: str, words: str) -> None:
    with pytest.raises(CompileError) as caught:
        compiled(TWO + statement)
    (found,) = caught.value.diagnostics
    assert found.code == code
    assert words in found.message + found.caption


def test_limit_of_friction_that_is_linear_in_an_acceleration() -> None:
    """x slides: 2 x'' = -10 x - 0.1 (y'' + 5), and y'' = 0.4."""
    model = compiled(TWO + "force 0.8 N on y; friction 0.1 kg*(der(y, 2) + 5 m/s^2) on x;")
    rates = outcome(model, "rhs", STATE | {"slip(friction[1])": 1.0})
    assert rates["der(y)"] == pytest.approx(0.4, rel=1e-14)
    assert 2 * rates["der(x)"] == pytest.approx(-3 - 0.1 * 5.4, rel=1e-13)
