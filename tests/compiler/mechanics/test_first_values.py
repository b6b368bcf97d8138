"""First values of discrete variables: formulas of what is known before the state."""

from __future__ import annotations

import pytest
from refusals import refused

import mechc

SLIDER = "coordinate Length x = 0.3 m; kinetic 1/2*2 kg*der(x)^2; initial der(x) = 1 m/s; parameter p = 7;"


def test_first_values_by_later_ones() -> None:
    """b = a + 3, a = 2 + c, whatever their order in the text."""
    text = """discrete Real b = a + 3; discrete Real a = 2 + c; discrete Real c = p;
when x > 0.5 m then c := 5; end when;"""
    solution = mechc.loads(SLIDER + text).simulate(stop=1, set={"p": 8})
    for name, value in {"a": 10, "b": 13, "c": 8}.items():
        assert solution[name][0] == value
    assert (solution["a"][-1], solution["c"][-1]) == (10, 5)


def test_value_of_the_state_at_the_start() -> None:
    text = "discrete Length c = 0; when initial() then c := x; end when;"
    assert mechc.loads(SLIDER + text).simulate(stop=1)["c"][-1] == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("value", "culprit"),
    [
        ("x/(1 m)", "x"),
        ("der(x)*1 s/m", "der(x)"),
        ("2*time/(1 s)", "time"),
        ("2*u; input Real u = 3", "u"),
        ("energy()/(1 J)", "der(x)"),
        ("2*b; discrete Real b = 1 + x/(1 m)", "x"),
        ("2*b; discrete Real b = 1 + c", "c"),
        ("integral(1 + 0*x/(1 m))/(1 s)", "integral"),
    ],
)
def test_first_value_that_is_not_known(value: str, culprit: str) -> None:
    found = next(
        d
        for d in refused(SLIDER + f"discrete Real c = {value}; when x > 0.5 m then c := 5; end when;")
        if d.code.startswith("E")
    )
    assert found.code == "E0811"
    assert f"variable 'c' must not depend on '{culprit}" in found.message


@pytest.mark.parametrize("closure", ["energy()/(9 J)", "vel(to)[1]*1 s/m"])
def test_closure_with_velocities(closure: str) -> None:
    text = f"""import mech.planar.*;
model Own
  frame from; frame to;
  coordinate Angle angle ~ 0 rad;
  place to = from * rot(angle);
  closure angle = heading(to) - heading(from);
  closure local(from, to) = {{0.1 m*{closure}, 0 m}};
end Own;
model M
  Bar bar(m = 1.1 kg, l = 0.9 m); Revolute pin(world -> bar.a, angle = 0.4 rad);
  Box box(m = 1 kg, size = {{0.3, 0.4}} m); Planar free(world -> box.a, x ~ 0.2 m, y ~ 0.3 m, angle ~ 0.1 rad);
  Own hold(bar.b -> box.a);
end M;"""
    caught = refused(text)
    assert caught[0].code == "E0501"
    assert "the closure of 'hold' contains velocities" in caught[0].message
