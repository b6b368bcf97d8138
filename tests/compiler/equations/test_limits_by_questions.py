"""Friction whose limit asks about the motion, in a model that asks for a reaction too: nothing of either is left over."""

from __future__ import annotations

import pytest

import mechc

TEXT = """\
import mech.planar.*;
model M
  Bar bar(m = 3 kg, l = 1 m);
  Revolute hinge(world -> bar.a, angle = 0 rad, der(angle) = {rate} rad/s);
  friction 0.5 s^-1*abs(momentum(hinge.angle)) on hinge.angle;
  output load = reaction(hinge);
  experiment(stop = 1 s, tolerance = 1e-10);
end M;
"""


@pytest.mark.parametrize("rate", [0.93, -0.93])
def test_a_limit_by_a_momentum_beside_a_reaction(rate: float) -> None:
    """p' = -0.5 |p| sign(p): the rate falls as exp(-t/2); the hinge carries m a_c = m l/2 w^2 towards itself."""
    solution = mechc.loads(TEXT.format(rate=rate)).simulate()
    end = rate * 2.718281828459045**-0.5
    assert solution["der(hinge.angle)"][-1] == pytest.approx(end, rel=1e-8)
    size = (solution["load[1]"][-1] ** 2 + solution["load[2]"][-1] ** 2) ** 0.5
    # the tangential part is m l/2 alpha with alpha = -w/2
    assert size == pytest.approx(1.5 * ((end**2) ** 2 + (end / 2) ** 2) ** 0.5, rel=1e-7)
