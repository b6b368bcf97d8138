"""Parameters that nothing uses change nothing, not even where a guessed start is moved to."""

from __future__ import annotations

import mechc
from mechc.compiler.flat.operands import idle_parameters

TEXT = """
parameter R = 2 m;
parameter twice = 2*R;
coordinate Length x ~ 1 m;
coordinate Angle a ~ 0.1 rad;
kinetic 1/2*1 kg*der(x)^2 + 1/2*1 kg.m^2*der(a)^2;
constraint c: x = twice*a + 0.2 m;
experiment(stop = 0.1 s);
"""
IDLE = "parameter unused = 37 m;\nparameter by_it = 3*unused;\n"


def test_what_is_used_is_known() -> None:
    model = mechc.loads(IDLE + TEXT)
    assert idle_parameters(model.compilation.flat) == {"unused", "by_it"}


def test_an_idle_length_moves_no_start() -> None:
    with_it, without = (mechc.loads(t).simulate() for t in (IDLE + TEXT, TEXT))
    assert list(with_it["x"]) == list(without["x"])
    assert with_it.accuracy.error is not None and without.accuracy.error is not None
    assert with_it.accuracy.error.nominal == without.accuracy.error.nominal
