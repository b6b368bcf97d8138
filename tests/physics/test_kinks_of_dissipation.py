"""A dissipation that bends at rest is a force that jumps there: located like any other, and told where a motion slides along it."""

from __future__ import annotations

import numpy as np
import pytest

import mechc
from mechc.runtime.native.build import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")

PULLED = """
parameter pull = 1 N;
coordinate x = 0 m;
initial der(x) = -1 m/s;
kinetic 1/2*1 kg*der(x)^2;
force pull on x;
dissipation {};
experiment(stop = 2 s);
"""


@pytest.mark.parametrize("law", ["0.3 N*abs(der(x))", "0.3 N*max(der(x), -der(x))"])
def test_the_jump_is_an_event(law: str) -> None:
    """-1 m/s ends after 1/1.3 s, and 0.7 m/s^2 follow: two parabolas, each a step or two."""
    found = mechc.loads(PULLED.format(law)).simulate()
    assert found.outcome.name == "COMPLETED"
    turn = 1 / 1.3
    t = np.asarray(found.time)
    exact = np.where(t < turn, -t + 0.65 * t**2, -turn / 2 + 0.35 * (t - turn) ** 2)
    assert np.abs(found["x"] - exact).max() < 1e-12
    assert found.statistics.rejected == 0
    assert abs(found["energy.dissipated"][-1] - 0.3 * (turn / 2 + 0.35 * (2 - turn) ** 2)) < 1e-12


def test_a_motion_that_slides_along_the_jump_says_so() -> None:
    """It comes to rest after 1/1.3 s and stays there: no law on either side holds it."""
    model = mechc.loads(PULLED.format("1.1 N*abs(der(x))"))
    found = model.simulate(set={"pull": 0.2})
    assert found.outcome.name == "FAILED"
    assert abs(found.time[-1] - 1 / 1.3) < 1e-9
    assert "write it as 'friction'" in found.message


def test_what_only_bends_costs_no_event() -> None:
    """The force of abs(v)^3 does not jump, nor does that of max(0, v)^2."""
    for law in ("0.3 kg/m*abs(der(x))^3", "0.3 N.s/m*max(0 m/s, der(x))^2"):
        assert mechc.loads(PULLED.format(law)).compilation.equations.switching is None


def test_what_solves_the_law_of_a_damping_is_no_event() -> None:
    """Its force is found by comparisons that have no sides."""
    law = "coordinate x = 0 m; kinetic 1/2*1 kg*der(x)^2; constraint h: x = 0.1 m*sin(time/(1 s));"
    law += "damping 0.3 N.s/m*(1.3 + sin(multiplier(h)/(1 N))) on x; output held = multiplier(h);"
    assert mechc.loads(law).compilation.equations.switching is None
