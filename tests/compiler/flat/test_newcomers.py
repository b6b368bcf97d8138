"""What those who know other programs write first, and what the messages tell them."""

from __future__ import annotations

import pytest

import mechc
from mechc.lang.diagnostics import CompileError

HEAD = """
import mech.rotational.*;
import mech.spatial.{Link, Revolute};
import mech.elements.{Pulley};
model M
  Rotor shaft(J = 1 kg.m^2);
  Rotor load(J = 1 kg.m^2);
  Link bar(r = {1, 0, 0} m);
"""


@pytest.mark.parametrize(
    ("statement", "help"),
    [
        ("connect(shaft.flange_b, load.flange_a);", "'Gear g(motor.angle -> load.angle);'"),
        (
            "TorqueSource t(from = shaft.angle, torque = 1 N.m*step(time, 1 s));",
            "'import mech.control.*;' brings step",
        ),
        (
            "TorqueSource t(from = shaft.angle, torque = 1 N.m*sine(time, 1 Hz, 0 rad));",
            "did you mean 'sin'? 'import mech.control.*;' brings sine",
        ),
        ("Revolute j(world -> bar.frame_b);", "it has a, b, c, shape,"),
        ("SpringDamper s(shaft.angle -> load.angle); output x = s.tau;", "it has torque, from, to, k, c,"),
        ("Revolute j(world*({1, 0, 0} m) -> bar.b);", "write 'world * trans({1, 0, 0} m)'"),
        ("Revolute j(world*{1 m, 0 m, 0 m} -> bar.b);", "write 'world * trans({1 m, 0 m, 0 m})'"),
        ("point P = world*{1 m, 0 m, 0 m}; Revolute j(P -> bar.b);", "times 'trans(...)'"),
        ("Pulley p(world -> bar.a -> bar.b);", "'Pulley p(from = a, over = b, to = c)'"),
        (
            "DCMotor d(from = shaft.angle, voltage = 1 V, K = 0.05 V/(rad/s));",
            "a unit has no parentheses: '0.05 V.s/rad'",
        ),
        ("let x = 2 N/m/(rad.s)*(1 m);", "a unit has no parentheses: '2 N/m/rad/s'"),
        (
            "TorqueSource t(from = shaft.angle, torque = table(time, {0, 1, 2}, {0, 5, 0} N.m));",
            "write '{0, 1, 2} s'",
        ),
        (
            "Revolute j(world -> bar.a); Planetary p(sun = shaft.angle, carrier = load.angle);",
            "'ring = ...', 0 where it is held, a coordinate of its own where it is free",
        ),
    ],
)
def test_help(statement: str, help: str) -> None:
    with pytest.raises(CompileError) as caught:
        mechc.loads(f"{HEAD}  {statement}\nend M;\n")
    assert any(help in d.help for d in caught.value.diagnostics), str(caught.value)
