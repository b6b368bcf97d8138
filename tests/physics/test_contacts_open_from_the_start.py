"""Contacts that `when initial() then release floor;` opens take no part in the start, as constraints do not.

Judges: free fall, and the same body on the floor.
"""

from __future__ import annotations

from typing import Any

import pytest

import mechc

BODY = """
coordinate Length x = 0 m; coordinate Length y = HEIGHT; initial der(x) = 1 m/s; initial der(y) = SPEED;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2); potential 9.81 N*y;
contact floor: y restitution 0.5 friction 0.3 along der(x);
when OPEN then release floor; end when;
discrete Integer n = 0; when closed(floor) then n := n + 1; end when;
experiment(stop = 0.5 s);
"""
METHODS: list[dict[str, Any]] = [{}, {"method": "moreau", "step": "1 ms"}]


def _run(opens: str, height: str, speed: str, **options: Any) -> mechc.Solution:
    text = BODY.replace("OPEN", opens).replace("HEIGHT", height).replace("SPEED", speed)
    return mechc.loads(text).simulate(estimate_error=False, **options)


@pytest.mark.parametrize("options", METHODS)
@pytest.mark.parametrize("opens", ["initial()", "initial() and x < 1 m"])
@pytest.mark.parametrize(("height", "speed"), [(0.0, -1.0), (-1e-3, 0.0), (0.0, 0.0)])
def test_it_falls_freely(opens: str, height: float, speed: float, options: dict[str, Any]) -> None:
    found = _run(opens, f"{height} m", f"{speed} m/s", **options)
    assert found.outcome.name == "COMPLETED"
    assert found["x"][-1] == pytest.approx(0.5, rel=1e-9)
    assert found["y"][-1] == pytest.approx(height + 0.5 * speed - 9.81 / 8, rel=1e-9)
    assert [e.kind for e in found.events] == ["when"]


def test_a_condition_that_does_not_hold_leaves_it_closed() -> None:
    found = _run("initial() and x > 1 m", "0 m", "0 m/s")
    assert found["x"][-1] == pytest.approx(1 / (2 * 0.3 * 9.81), rel=1e-8)
    assert found["n"][-1] == 0
    fallen = _run("initial() and x > 1 m", "0 m", "-1 m/s")
    assert fallen["y"][-1] == pytest.approx(0, abs=1e-9)
    assert next(e.kind for e in fallen.events if e.name == "floor") == "impact"


@pytest.mark.parametrize("options", METHODS)
def test_and_is_not_penetrated_then(options: dict[str, Any]) -> None:
    found = _run("initial() and x > 1 m", "-1 mm", "0 m/s", **options)
    assert found.outcome.name == "FAILED"
    assert "floor" in found.message


def test_a_clock_opens_after_the_impact() -> None:
    """It rebounds with 0.5 m/s and loses 0.3*1.5 m/s along the floor."""
    found = _run("sample(10 s)", "0 m", "-1 m/s")
    assert found["y"][-1] == pytest.approx(0.25 - 9.81 / 8, rel=1e-9)
    assert found["x"][-1] == pytest.approx(0.5 * (1 - 0.45), rel=1e-9)


def test_it_may_be_engaged_later() -> None:
    """Thrown up from below with 2 m/s, it passes the floor on its way up, where that closes, and lands."""
    text = BODY.replace("OPEN", "initial()").replace("HEIGHT", "-0.1 m").replace("SPEED", "2 m/s")
    text = text.replace("restitution 0.5", "restitution 0").replace(
        "release floor;", "release floor; elsewhen y > 0.01 m then engage floor;"
    )
    found = mechc.loads(text).simulate(estimate_error=False)
    speed = (4 - 2 * 9.81 * 0.1) ** 0.5
    landed = (2 - speed) / 9.81 + 2 * speed / 9.81
    assert found["y"][-1] == pytest.approx(0, abs=1e-9)
    assert [e.time for e in found.events if e.kind == "impact"] == pytest.approx([landed], rel=1e-9)
    assert found["n"][-1] == 1


@pytest.mark.parametrize("part", ["min(y - x, y + x)", "y"])
def test_derivatives_go_through_such_a_start(part: str) -> None:
    text = (
        "parameter Length h = -1 mm; coordinate Length x = 0 m; coordinate Length y; initial y = h; kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);"
        f"potential 9.81 N*y; contact g: {part}; when initial() then release g; end when; experiment(stop = 0.5 s);"
    )
    found = mechc.loads(text).simulate(sensitivity=["h"])
    assert found["y"][-1] == pytest.approx(-1e-3 - 9.81 / 8, rel=1e-9)
    assert found.sensitivity("y", "h").values[-1] == pytest.approx(1, rel=1e-9)
