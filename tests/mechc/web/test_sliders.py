"""Sliders: what has one, from where to where it goes, and in which unit."""

from __future__ import annotations

from typing import Any

import pytest

import mechc
from mechc.web.run_facts import facts_of

KINDS = """
model Kinds
  parameter Mass m = 2 kg;
  parameter Mass more = 0 kg;
  parameter Length l = 0.5 m;
  parameter Length aside = 0 m;
  parameter Force push = -8 N;
  parameter Force pull = 0 N;
  parameter Stiffness k = 50 N/m;
  parameter Damping c = 0 N.s/m;
  parameter Damping other = 3 N.s/m;
  parameter Damping third = 1 N.s/m;
  parameter Time T(min = 1e-12 s) = 2 ms;
  parameter e(min = 0, max = 1) = 0.5;
  parameter far(min = 0.1, max = 3) = 1;
  parameter Angle tilt = 0 rad;
  parameter shift = 1e3 m;
  parameter w = 30 m/s;
  parameter Density density = 1000 kg/m^3;
  parameter Mass given = density*1 m^3;
  parameter Mass unused = 1 kg;
  coordinate Length x = 1 m;
  kinetic 1/2*(m + more + given)*der(x)^2;
  potential 1/2*(k + 1 N/m*(e + far + cos(tilt)))*(x - l - aside - shift/1000)^2;
  damping (c + other + third)*(1 + T/1 s) on x;
  force push + pull + 1 N.s/m*w on x;
  experiment(stop = 1 s, display = "mm"{given});
end Kinds;
"""


def sliders(text: str) -> dict[str, Any]:
    facts = facts_of(mechc.loads(text, keep={"scene"}), {}, None, {"method": "dop853"})
    told: Any = facts.told(recorded=True)
    return {q["name"]: q for group in ("parameters", "inputs") for q in told[group]}


def test_ranges_are_those_of_what_a_parameter_is() -> None:
    """Zero where it leaves a model, no negative mass, sizes of others of the unit, limits that are no mere guard."""
    found = sliders(KINDS.replace("{given}", ""))
    ends = {name: (q["min"], q["max"]) for name, q in found.items()}
    pi = 3.141592653589793
    wanted = {
        "m": (0.5, 8),
        "more": (0, 2),
        "l": (0.125, 2),
        "aside": (-1000, 1000),
        "push": (-32, 0),
        "pull": (-8, 8),
        "k": (0, 200),
        "c": (0, 3),
        "T": (0.5e-3, 8e-3),
        "e": (0, 1),
        "far": (0.1, 3),
        "tilt": (-pi, pi),
    }
    for name, (low, high) in wanted.items():
        assert ends[name] == pytest.approx((low, high), rel=1e-12), name


def test_parameters_that_reach_no_equation_have_no_slider() -> None:
    assert "density" in sliders(KINDS.replace("{given}", ""))
    assert "unused" not in sliders(KINDS.replace("{given}", ""))
    given = sliders(KINDS.replace("given = density*1 m^3", "given = 4 kg").replace("{given}", ""))
    assert "density" not in given and "given" in given


def test_long_numbers_of_settings_are_shown_in_units_of_the_text() -> None:
    found = sliders(KINDS.replace("{given}", ""))
    assert (found["w"]["shown"], found["w"]["factor"]) == ("m/s", 1.0)
    assert (found["l"]["shown"], found["l"]["factor"]) == ("mm", 0.001)
