"""The same pendulum as energies, as points and masses, and from the library: one motion, to rounding."""

from __future__ import annotations

import random

import pytest
from compiled import compiled, outcome

ENERGIES = """
parameter m = 1.3 kg;
parameter l = 0.8 m;
parameter g = 9.81 m/s^2;
coordinate th = 1 rad;
kinetic   1/2*m*l^2*der(th)^2;
potential -m*g*l*cos(th);
"""

POINTS = """
parameter m = 1.3 kg;
parameter l = 0.8 m;
parameter g = 9.81 m/s^2;
coordinate th = 1 rad;
gravity {0, -g};
mass m at world * rot(th) * {0, -l};
"""

COMPONENTS = """
import mech.planar.*;
gravity {0, -9.81 m/s^2};
Body bob(m = 1.3 kg, com = {0 m, -0.8 m});
Revolute th(world -> bob.a, angle = 1 rad);
"""

TURNED_IN_SPACE = """
import mech.spatial.*;
gravity {0, -9.81 m/s^2, 0};
Body bob(m = 1.3 kg, com = {0 m, -0.8 m, 0 m});
Revolute th(world -> bob.a, angle = 1 rad);
"""

ROUNDING = 1e-14
"""Some ten operations of half a unit in the last place each, relative to g/l."""


@pytest.mark.parametrize(
    ("text", "name"),
    [(POINTS, "th"), (COMPONENTS, "th.angle"), (TURNED_IN_SPACE, "th.angle")],
    ids=["points", "components", "spatial components"],
)
def test_equals_the_energies(text: str, name: str) -> None:
    plain, other = compiled(ENERGIES), compiled(text)
    numbers = random.Random(3)
    for _ in range(20):
        angle, speed = numbers.uniform(-3, 3), numbers.uniform(-5, 5)
        state, same = {"th": angle, "der(th)": speed}, {name: angle, f"der({name})": speed}
        expected = outcome(plain, "rhs", state)["der(th)"]
        assert outcome(other, "rhs", same)[f"der({name})"] == pytest.approx(
            expected, rel=0, abs=13 * ROUNDING
        )
        energies = outcome(plain, "outputs", state), outcome(other, "outputs", same)
        for which in ("energy.kinetic", "energy.potential", "energy.total"):
            assert energies[1][which] == pytest.approx(energies[0][which], rel=ROUNDING, abs=20 * ROUNDING)
