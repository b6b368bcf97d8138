"""Conditions that ask about contacts and frictions and are true at the start: they act when they have been false, not at the start.

Judges: rest and free fall, whose instants are known.
"""

from __future__ import annotations

import pytest

import mechc

BODY = (
    "coordinate Length x = 0 m; coordinate Length y GIVEN;\n"
    "kinetic 1/2*1 kg*(der(x)^2 + der(y)^2); potential 9.81 N*y; contact c: y friction 0.3 along der(x);\n"
    "discrete Integer n = 0; when CONDITION then n := n + 1; end when; experiment(stop = 0.5 s);\n"
)


def _text(condition: str, *, y: str = "= 0 m", further: str = "") -> str:
    return BODY.replace("CONDITION", condition).replace("GIVEN", y) + further


@pytest.mark.parametrize(
    "condition", ["closed(c)", "closed(c.friction)", "multiplier(c) > 5 N", "closed(c) and time < 1 s"]
)
def test_what_rests_has_not_come_to_rest(condition: str) -> None:
    found = mechc.loads(_text(condition)).simulate(estimate_error=False)
    assert found["n"][-1] == 0
    assert not found.events


def test_a_friction_that_sticks() -> None:
    text = (
        "coordinate Length x = 0 m; kinetic 1/2*1 kg*der(x)^2; friction f: 3 N on x; force 1 N on x; discrete Integer n = 0;"
        "when closed(f) then n := n + 1; end when; experiment(stop = 0.5 s);"
    )
    assert mechc.loads(text).simulate(estimate_error=False)["n"][-1] == 0


def test_a_law_that_asks_for_the_force_of_a_contact() -> None:
    """Without the load on the floor the force would overcome the friction."""
    further = "force if multiplier(c) > 5 N then 1 N else 10 N on x;"
    assert (
        mechc.loads(_text("closed(c.friction)", further=further)).simulate(estimate_error=False)["n"][-1] == 0
    )


@pytest.mark.parametrize("condition", ["closed(c)", "multiplier(c) > 5 N"])
def test_what_lands_acts_once(condition: str) -> None:
    found = mechc.loads(_text(condition, y="= 0.1 m")).simulate(estimate_error=False)
    assert found["n"][-1] == 1
    assert [e.time for e in found.events if e.kind == "when"] == pytest.approx([(0.2 / 9.81) ** 0.5])


def test_an_impact_at_the_start_closes() -> None:
    found = mechc.loads(_text("closed(c)", further="initial der(y) = -1 m/s;")).simulate(estimate_error=False)
    assert [(e.kind, e.time) for e in found.events] == [("impact", 0), ("when", 0)]


def test_what_lifts_off_and_comes_back() -> None:
    """Lifted with twice its weight from 0.1 s to 0.2 s, it flies for 0.1 s up, then 0.1 s + sqrt(2)*0.1 s until it lands."""
    further = "force if time > 0.1 s and time < 0.2 s then 19.62 N else 0 N on y;"
    found = mechc.loads(_text("closed(c)", further=further)).simulate(estimate_error=False)
    assert [e.time for e in found.events if e.kind == "when"] == pytest.approx([0.3 + 0.1 * 2**0.5])


STEP = (
    "coordinate Length x = -80 mm; initial der(x) = 1.44 m/s; kinetic 1/2*0.96 kg*der(x)^2;\n"
    "potential (if x < 0 m then 0 J else -0.41 J); discrete Integer n = 0;\n"
    "when time > 0 s then n := n + 1; end when; experiment(stop = 0.1 s);\n"
)


def test_what_turns_true_right_after_the_start_acts_beside_a_step_of_a_potential() -> None:
    found = mechc.loads(STEP).simulate(estimate_error=False)
    assert [(e.time, e.name) for e in found.events] == [
        (0, "time > 0 s"),
        (pytest.approx(1 / 18), "potential"),
    ]
