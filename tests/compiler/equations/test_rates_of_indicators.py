"""Conditions whose rates are known are located with them, which takes a tenth of the evaluations."""

from __future__ import annotations

import pytest

import mechc

GAP = """
input Angle to = 0 rad;
coordinate Angle q = 0.1 rad;
kinetic 1/2*1 kg.m^2*der(q)^2;
let twist = to - q;
force (if twist > 0.05 rad then 1 N.m else 0 N.m) + {} on twist;
experiment(stop = 1 s);
"""


@pytest.mark.parametrize(("damper", "known"), [("0.5 N.m.s*der(twist)", True), ("0 N.m", False)])
def test_an_input_that_keeps_its_value_has_no_rate(damper: str, known: bool) -> None:
    """Where the equations take its rate to be zero, conditions do as well."""
    model = mechc.loads(GAP.format(damper))
    rates = model.compilation.program.function("indicator_rates")
    assert bool(model.problem().held_inputs) is known
    assert ("array='y'" in str(rates)) is known
