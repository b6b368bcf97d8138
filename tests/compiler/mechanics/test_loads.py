"""What forces and constraints cannot mean, or do not do, is told."""

from __future__ import annotations

import pytest

import mechc

PLANE = """
coordinate Length x[2] = {1, 0} m;
coordinate Length y[2] = 0 m;
coordinate Angle a = 0 rad;
frame F = world * trans(x) * rot(a);
frame G = F * trans({1, 0} m);
point P = world * x;
point Q = world * y;
mass 1 kg at F;
inertia 1 kg.m^2 on F;
mass 1 kg at Q;
"""


def codes(statement: str) -> list[str]:
    return [found.code for found in mechc.loads(PLANE + statement).diagnostics]


@pytest.mark.parametrize(
    ("statement", "code"),
    [
        ("force {0, 1} N on P from Q;", "W0530"),  # moving points of the plane, not of its bodies
        ("force {0, 1} N on F from Q;", "W0530"),
        ("force {0, 1} N on P from world;", ""),
        ("force 1 N/m*(P - Q) on P from Q;", ""),
        ("force {0, 1} N on F from F;", "W0531"),
        ("force {0, 1} N on F at Q from F;", "W0531"),
        ("torque 1 N.m on G from F;", "W0531"),
        ("force 1 N on x[1] from x[1];", "W0531"),
        ("when time > 1 s then impulse {0, 1} N.s on F from F; end when;", "W0531"),
        ("force {0, 1} N on F;", ""),
        ("force {0, 1} N on F at Q from world;", ""),
        ("force 1 N on x[1] from x[2];", ""),
    ],
)
def test_forces_that_make_momentum_or_cancel_are_told(statement: str, code: str) -> None:
    assert codes(statement) == ([code] if code else [])


def test_a_constraint_of_accelerations_says_so() -> None:
    with pytest.raises(mechc.CompileError) as raised:
        mechc.loads(PLANE + "constraint c: der(x[1], 2) = der(y[1], 2);")
    (found,) = raised.value.diagnostics
    assert (found.code, found.message) == ("E0501", "constraint 'c' contains accelerations")
