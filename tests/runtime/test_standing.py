"""Equilibria of models with contacts, friction and switches: those that the model has, none of the equations alone."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.runtime.outcome import SimulationError

SPRING = """\
model M
  parameter Length a = {a} m;
  coordinate Length x(min = -2 m, max = 2 m) = {x} m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*10 N/m*(x - a)^2;
  {more}
end M;
"""
WALL = "contact wall: x restitution 0.5;"


def spring(more: str, a: float = -1.0, x: float = 1.0) -> mechc.Model:
    return mechc.loads(SPRING.format(a=a, x=x, more=more))


def asked(model: mechc.Model, kind: str, **settings: Any) -> Any:
    return model.study(kind, **settings)


def places(found: Any) -> list[float]:
    return [e["values"]["x"] for e in found.equilibria]


def said(found: Any) -> str:
    return " ".join((found.message, *found.remarks))


def test_no_equilibrium_lies_inside_a_wall() -> None:
    found = asked(spring(WALL), "equilibria")
    assert places(found) == []
    assert "0 equilibria away from contacts" in said(found)
    assert "left out: 1 beyond contacts" in said(found)
    assert "rest on contacts are found only where these contacts are closed at the start" in said(found)


def test_an_equilibrium_before_a_wall_is_kept() -> None:
    found = asked(spring(WALL, a=0.5), "equilibria")
    assert places(found) == pytest.approx([0.5], abs=1e-14)
    assert found.equilibria[0]["stable"] is True
    modes = asked(spring(WALL, a=0.5), "modes")
    assert modes.frequencies == pytest.approx([math.sqrt(10)], rel=1e-14)


def test_an_equilibrium_at_a_wall_is_not_told_to_be_stable() -> None:
    """The spring is slack where it touches: on one side the wall, on the other the spring."""
    found = asked(spring(WALL, a=0.0), "equilibria")
    assert places(found) == pytest.approx([0.0], abs=1e-14)
    assert found.equilibria[0]["stable"] is None
    with pytest.raises(SimulationError, match="no mode of small motions here: the contact 'wall' is closed"):
        asked(spring(WALL, a=0.0), "modes")


@pytest.mark.parametrize(("study", "settings"), [("modes", {}), ("linearize", {"at": "equilibrium"})])
def test_small_motions_inside_a_wall_are_refused(study: str, settings: dict[str, Any]) -> None:
    with pytest.raises(SimulationError, match="lies beyond the contact 'wall'"):
        asked(spring(WALL), study, **settings)


def test_branches_end_at_a_wall() -> None:
    found = asked(spring(WALL, a=1.0), "equilibria", over="a = -1 m .. 1 m")
    assert min(places(found)) >= -1e-9
    assert max(places(found)) == pytest.approx(1.0, abs=1e-9)
    assert "branches end at contacts" in said(found)


def test_a_ball_over_a_floor_has_its_height_counted() -> None:
    model = mechc.loads(
        "model B coordinate Length y = 1 m; kinetic 1/2*1 kg*der(y)^2; potential 1 kg*9.81 m/s^2*y;"
        " contact floor: y restitution 0.5; end B;"
    )
    found = asked(model, "equilibria")
    assert "0 equilibria away from contacts" in said(found)
    assert "nothing depends on" not in said(found)


def test_what_a_closed_contact_holds_altogether_is_stable() -> None:
    """The spring would rest at 1.5 m, beyond the wall; pressed against the wall nothing moves."""
    text = (
        "model B coordinate Length x(min = -2 m, max = 2 m) = 1 m; MORE kinetic 1/2*1 kg*der(x)^2;"
        " potential 1/2*2 N/m*x^2 - 3 N*x; contact wall: 1 m - x; end B;"
    )
    found = asked(mechc.loads(text.replace("MORE", "")), "equilibria")
    (one,) = found.details["equilibria"]
    assert one["stable"] is True and found.message.startswith("1 equilibrium on contacts")
    beside = (
        "coordinate Length y(min = -1 m, max = 1 m) = 0 m; kinetic 1/2*1 kg*der(y)^2; potential -1 N/m*y^2;"
    )
    (one,) = asked(mechc.loads(text.replace("MORE", beside)), "equilibria").details["equilibria"]
    assert one["stable"] is False


FRICTION = "friction 2 N on x;"


@pytest.mark.parametrize(
    ("study", "settings", "x"),
    [
        ("equilibria", {}, 1.0),
        ("equilibria", {}, 0.1),
        ("modes", {}, 1.0),
        ("linearize", {"at": "equilibrium"}, 1.0),
    ],
)
def test_what_friction_holds_rests_in_intervals(study: str, settings: dict[str, Any], x: float) -> None:
    with pytest.raises(SimulationError, match="are not points but intervals"):
        asked(spring(FRICTION, a=0.0, x=x), study, **settings)


@pytest.mark.parametrize(("study", "settings"), [("modes", {}), ("linearize", {"at": "equilibrium"})])
def test_what_sticks_at_the_start_has_no_small_motions(study: str, settings: dict[str, Any]) -> None:
    found = asked(spring(FRICTION, a=0.0, x=0.1), study, **settings)
    assert "sticks" in said(found)
    assert not len(found.poles if study == "linearize" else found.frequencies)


def test_friction_on_a_belt_moves_the_equilibrium() -> None:
    """The belt slides below at 3 m/s: x = 2 N/(10 N/m), though the block starts faster than the belt."""
    model = spring("initial der(x) = 4 m/s; friction 2 N on x - 3 m/s*time;", a=0.0)
    found = asked(model, "equilibria")
    assert places(found) == pytest.approx([0.2], abs=1e-14)
    assert asked(model, "modes").at["x"] == pytest.approx(0.2, abs=1e-14)


def test_switches_stand_as_they_do_at_the_equilibrium() -> None:
    """Force 10 N/m*x right of -0.5 m and a stiffer spring of 40 N/m about -1 m left of it: one starts right of it."""
    model = mechc.loads(
        "model S coordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2;"
        " force if x > -1/2*1 m then -10 N/m*(x + 2*1 m) else -40 N/m*(x + 1 m) on x; end S;"
    )
    found = asked(model, "equilibria")
    assert places(found) == pytest.approx([-1.0], abs=1e-14)
    assert abs(complex(*found.equilibria[0]["eigenvalues"][0])) == pytest.approx(math.sqrt(40), rel=1e-13)
    modes = asked(model, "modes")
    assert modes.at["x"] == pytest.approx(-1.0, abs=1e-14)
    assert modes.frequencies == pytest.approx([math.sqrt(40)], rel=1e-13)
    poles = asked(model, "linearize", at="equilibrium").poles
    assert np.abs(poles) == pytest.approx([math.sqrt(40)] * 2, rel=1e-13)


def test_a_relay_has_no_equilibrium_on_either_side() -> None:
    model = mechc.loads(
        "model R coordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2;"
        " force (if x > 0 m then -3 N else 3 N) - 1 N/m*x on x; end R;"
    )
    with pytest.raises(SimulationError, match="on the side of its switches"):
        asked(model, "modes")


def test_the_region_of_an_energy_ends_at_walls() -> None:
    """At 20 J the spring about -1 m reaches from -3 m to 1 m; the wall stands at 0."""
    found = asked(spring(WALL), "energy", over="x = -4 m .. 4 m")
    assert np.array(found.details["region"]) == pytest.approx(np.array([[0.0, 1.0]]), abs=1e-12)
    assert found.details["turning_points"] == pytest.approx([1.0], abs=1e-12)
    assert "ends at the contacts: wall" in said(found)


@pytest.mark.slow
def test_the_region_in_the_plane_ends_at_walls() -> None:
    """Half of the circle of radius 1; the area is counted on a grid, to half a cell along the border."""
    model = mechc.loads(
        "model P dimensionless; coordinate x(min = -2, max = 2) = 1; coordinate y(min = -2, max = 2) = 0;"
        " kinetic 1/2*(der(x)^2 + der(y)^2); potential 1/2*(x^2 + y^2); contact wall: x restitution 1; end P;"
    )
    found = asked(model, "energy")
    area = next(v for v in found.values if v.name == "area")
    assert area.value == pytest.approx(math.pi / 2, abs=(2 + math.pi) * 0.5 * 4 / 240) and area.unit == ""


@pytest.mark.parametrize(("kinds", "unit"), [("mm", "m^2"), ("mr", "m rad")])
def test_the_area_has_the_unit_of_both_coordinates(kinds: str, unit: str) -> None:
    units = {"m": "m", "r": "rad"}
    a, b = (units[k] for k in kinds)
    model = mechc.loads(
        f"model P coordinate x = 1 {a}; coordinate y = 0.5 {b}; kinetic 1/2*1 J.s^2*(der(x)^2/(1 {a}^2) + der(y)^2/(1 {b}^2));"
        f" potential 1/2*1 J*(x^2/(1 {a}^2) + y^2/(1 {b}^2)); end P;"
    )
    area = next(v for v in asked(model, "energy").values if v.name == "area")
    assert area.unit == unit and area.value == pytest.approx(1.25 * math.pi, rel=0.05)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ("", ""),
        ("damping 1 kg/s on x;", "energy is dissipated:"),
        (FRICTION, "energy is dissipated by friction"),
        ("force 1 N*cos(time/1 s) on x;", "energy is supplied"),
    ],
)
def test_the_region_says_what_changes_the_energy(more: str, words: str) -> None:
    remarks = asked(spring(more), "energy").remarks
    assert (
        any(words in remark for remark in remarks)
        if words
        else not any("energy is" in remark for remark in remarks)
    )


@pytest.mark.parametrize(
    ("more", "named"),
    [
        ("coordinate Length y = 0 m; kinetic 1/2*1 kg*der(y)^2;", ""),  # y does not matter
        ("coordinate Length y = 1 m; kinetic 1/2*1 kg*der(y)^2; potential 1 N/m*x*y;", "y"),
        ("coordinate Length w = 0 m; damping 2 N.s/m on w; potential 1/2*5 N/m*(x - w)^2;", "w"),
        ("state w = 0; equation der(w) = x/(1 m.s); potential 1 N*x*w;", "w"),
        ("state w = 0; equation der(w) = x/(1 m.s);", ""),
    ],
)
def test_the_region_says_what_it_holds(more: str, named: str) -> None:
    """Over x alone the region is a section; with y free, x reaches farther than at the y of the start."""
    found = asked(spring(more), "energy", over="x = -4 m .. 4 m")
    said = [remark for remark in found.remarks if "the energy depends on" in remark]
    assert len(said) == bool(named) and all(f"depends on {named}, too" in remark for remark in said)
    assert not (named and any("shrinks within" in remark for remark in found.remarks))


def test_the_energy_at_rest_switches_with_the_place() -> None:
    """One spring of 10 N/m on the right, one of 40 N/m on the left: at 5 J from -1/2 to 1."""
    model = mechc.loads(
        "model S coordinate Length x(min = -2 m, max = 2 m) = 1 m; kinetic 1/2*1 kg*der(x)^2;"
        " potential if x > 0 m then 5 N/m*x^2 else 20 N/m*x^2; end S;"
    )
    found = asked(model, "energy")
    assert np.array(found.details["region"]) == pytest.approx(np.array([[-0.5, 1.0]]), abs=1e-12)
