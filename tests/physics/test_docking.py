"""Constraints that nothing fulfils at the start and that hold from where they are engaged: docking, catching."""

from __future__ import annotations

import pytest

import mechc
from mechc.runtime.outcome import Outcome

COORDINATES = """\
coordinate Length x = 0 m;
coordinate Length y = 2 m;
initial der(x) = 1 m/s;
kinetic 1/2*1 kg*der(x)^2 + 1/2*3 kg*der(y)^2;
constraint clamp: x = y;
let apart = y - x;
"""
JOINTS = """\
import mech.planar.*;
Body ship(m = 1 kg, J = 0.1 kg.m^2);
Body port(m = 3 kg, J = 0.5 kg.m^2);
Translation p(world -> ship.a, position = {0, 0} m, der(position) = {1, 0} m/s);
Translation q(world -> port.a, position = {2, 0} m);
cut Revolute clamp(port.a -> ship.a);
let apart = q.position[1] - p.position[1];
"""
DOCKS = "when initial() then release clamp; end when;\nwhen apart < 0 m then engage clamp; end when;\n"
GAP = "output gap = apart;\n"
ASKED = GAP + "output holds = if closed(clamp) then 1 else 0;\n"


@pytest.mark.parametrize("text", [COORDINATES, JOINTS])
def test_what_is_open_at_first_is_engaged_where_both_meet(text: str) -> None:
    """1 kg at 1 m/s takes 3 kg along: 1/4 m/s and 3/8 J less; before, the start contradicted the constraint."""
    s = mechc.loads(text + DOCKS + GAP).simulate(stop=4)
    assert s.outcome is Outcome.COMPLETED
    (engaged,) = (e for e in s.events if e.name == "clamp")
    assert engaged.kind == "engage" and engaged.time == pytest.approx(2)
    assert s["gap"][0] == 2 and s["gap"][-1] == pytest.approx(0, abs=1e-12)
    assert s["energy.total"][-1] == pytest.approx(1 / 8, rel=1e-12)
    assert s["energy.dissipated"][-1] == pytest.approx(3 / 8, rel=1e-12)


def test_what_is_released_later_holds_at_the_start() -> None:
    """Guesses move onto it, and not onto what is left open."""
    text = COORDINATES.replace("y = 2 m", "y ~ 2 m")
    later = mechc.loads(text + "when time > 1 s then release clamp; end when;" + ASKED).simulate(stop=2)
    opened = mechc.loads(text + DOCKS + ASKED).simulate(stop=1)
    assert later["gap"][0] == pytest.approx(0, abs=1e-12) and later["holds"][0] == 1
    assert opened["gap"][0] == 2 and opened["holds"][0] == 0
