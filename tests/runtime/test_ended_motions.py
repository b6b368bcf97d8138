"""Every study of a motion that ends before it should: it says so and why, or its answer needs no motion."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from studied_models import model_of, settings_of_kind, write_measured

import mechc
from mechc.runtime.outcome import SimulationError
from mechc.runtime.studies.table import STUDIES

WORDS = "enough is enough"

SAYS, SAME, SWITCHES = "says", "same", "switches"
"""It says that the motion ended; it gives the answer of the model without the end; it refuses models with events."""

EXPECTED: dict[str, dict[str, str]] = {
    **{
        name: {"terminate": SAYS, "assert": SAYS, "failure": SAYS}
        for name in (
            "simulate", "sweep", "ensemble", "fit", "virial", "floquet", "scattering", "optimum", "hysteresis", "diagram", "spectrum",
            "rainflow",
            "threshold", "lyapunov", "volume", "section", "symmetries", "invariants", "kinematics", "action",
        )
    },
    "orbit": {"terminate": SAYS, "assert": SAYS},
    **{name: {"terminate": SWITCHES, "assert": SAYS, "failure": SAYS} for name in ("along", "gradient")},
    **{name: {"terminate": SWITCHES, "assert": SAME} for name in ("steady", "period", "portrait")},
    **{
        name: {"terminate": SAME, "assert": SAME}
        for name in ("linearize", "response", "equilibria", "modes", "brackets", "hamilton", "field", "inertia", "energy", "dimensions")
    },
    "task": {"terminate": SAYS, "assert": SAYS, "failure": SAYS},
    "curves": {},
}  # fmt: skip
"""What each study does with each end. A curve is not a motion."""

PLACES = {
    "scattering": ("x > -5", "x < -5"),
    "hysteresis": ("x > 0.5", "x < 0.5"),
    "diagram": ("x > 0.5", "x < 0.5"),
    "steady": ("phi > 1", "phi < 1"),
    "inertia": ("time >= 1 s", "time < 1 s"),
    "kinematics": ("time >= 1 s", "time < 1 s"),
}
"""Where motions end, and what holds before."""

SINGULAR = {
    "hysteresis": "state Real w = 0; equation der(w) = 1/(1 - time)^2;",
    "diagram": "state Real w = 0; equation der(w) = 1/(1 - time)^2;",
    "kinematics": "force 0.001 N.s^2/(1 s - time)^2 on x;",
}

CASES = [
    pytest.param(name, end, marks=() if end == "terminate" else pytest.mark.slow)
    for name, expected in EXPECTED.items()
    for end in expected
]


def ending(name: str, end: str) -> str:
    """Return the statement by which the motion of a model ends at about t = 1."""
    reached, before = PLACES.get(name, ("x < 0.54", "x > 0.54"))
    match end:
        case "terminate":
            return f'when {reached} then terminate("{WORDS}"); end when;'
        case "assert":
            return f'assert {before}, "{WORDS}";'
    return SINGULAR.get(name, "force 0.001/(1 - time)^2 on x;")


def asked(name: str, statement: str, folder: Path) -> Any:
    given: dict[str, Any] = settings_of_kind(name, STUDIES[name].question().unused)
    if name == "fit":
        given["data"] = str(write_measured(folder))
    head, _, tail = model_of(name).rpartition("end ")
    return getattr(mechc.loads(f"{head}  {statement}\nend {tail}"), name)(**given)


LEFT = ("accuracy", "remarks", "message", "may_be_incomplete", "signs", "signs_expected", "singular_points")


def leaves(value: object) -> list[Any]:
    """Return all words and numbers of an answer, in order, but for errors, remarks, what is rounding, and how complete it is."""
    if isinstance(value, dict):
        return [x for key, one in value.items() if key not in LEFT for x in leaves(one)]
    if isinstance(value, list | tuple):
        return [x for one in value for x in leaves(one)]
    return [pytest.approx(value, rel=1e-7, abs=1e-9)] if isinstance(value, float) else [value]


def test_every_study_is_here() -> None:
    assert set(EXPECTED) == set(STUDIES)


@pytest.mark.parametrize(("name", "end"), CASES)
def test_a_study_says_that_its_motion_ended(name: str, end: str, tmp_path: Path) -> None:
    expected = EXPECTED[name][end]
    try:
        answer = asked(name, ending(name, end), tmp_path)
    except SimulationError as refusal:
        text = str(refusal)
        assert expected != SAME, text
        assert ("switch" in text) is (expected == SWITCHES), text
    else:
        text = f"{answer} {answer.summary()}"
        assert expected != SWITCHES, text
    if expected == SAME:
        wanted = asked(name, "", tmp_path).summary()
        found = leaves(answer.summary())
        assert found == leaves(wanted)
    elif expected == SAYS:
        told = {
            "terminate": (WORDS, "terminated"),
            "assert": (WORDS,),
            "failure": ("singular there", "failed"),
        }
        assert any(words in text for words in told[end]), text


ENDED_AT_HALF = """
model Damped
  dimensionless;
  coordinate x = 1;
  kinetic 1/2*der(x)^2; potential 1/2*x^2; damping 1 on x;
  when time >= 0.5 then terminate("end"); end when;
  experiment(stop = 2);
end Damped;
"""


def test_a_volume_is_told_up_to_the_end_and_not_beyond() -> None:
    """Of x'' + x' + x = 0 it shrinks as exp(-t), by Liouville's formula."""
    model = mechc.loads(ENDED_AT_HALF)
    assert model.volume(stop=0.5)["ratio"] == pytest.approx(math.exp(-0.5), rel=1e-9)
    for ask in (model.volume, model.lyapunov, lambda: model.floquet(period=2)):
        try:
            text = ask().message
        except SimulationError as refusal:
            text = refusal.message
        assert "end at t = 0.5" in text


def bounced(t: float, e: float) -> float:
    """The height of a ball that falls from 1 m and keeps the share e of its speed at each impact."""
    fall, speed = math.sqrt(2 / 9.81), math.sqrt(2 * 9.81)
    if t < fall:
        return 1 - 9.81 * t**2 / 2
    t -= fall
    while t >= 2 * e * speed / 9.81:
        t, speed = t - 2 * e * speed / 9.81, e * speed
    return e * speed * t - 9.81 * t**2 / 2


def test_a_fit_passes_over_values_with_which_the_motion_ends_before_the_data(tmp_path: Path) -> None:
    """With e = 0.6, where the search begins, the second fall below 0.2 m is at 0.9 s; with 0.8 it is after 1 s."""
    model = mechc.loads("""
    model Ball
      parameter e(min = 0, max = 1) = 0.6;
      coordinate y = 1 m;
      kinetic 1/2*1 kg*der(y)^2; potential 1 kg*9.81 m/s^2*y;
      contact floor: y restitution e;
      discrete Integer n = 0;
      when y < 0.2 m then n := n + 1; end when;
      when n > 1 then terminate("twice"); end when;
    end Ball;
    """)
    data = tmp_path / "ball.csv"
    rows = "".join(f"{t / 50},{bounced(t / 50, 0.8)!r}\n" for t in range(51))
    data.write_text("time [s],y [m]\n" + rows, encoding="utf-8")
    assert model.fit(data, vary="e")["e"] == pytest.approx(0.8, abs=1e-7)
