"""Sections: against closed forms, against SciPy's events, and what they say of themselves."""

from __future__ import annotations

import json
import math
import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shared_models import example

import mechc
from mechc.cli.main import run as run_command
from mechc.presentation.answers import figure
from mechc.runtime.outcome import Outcome, SimulationError
from mechc.runtime.studies.flow.crossings import chandrupatla, crossings

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


TWO = """\
model Two
  dimensionless;
  parameter w = sqrt(2);
  coordinate x = 1;
  coordinate y = 0.5;
  kinetic 1/2*(der(x)^2 + der(y)^2);
  potential 1/2*(x^2 + w^2*y^2);
  experiment(stop = 30);
  experiment starts(stop = 30, y in {0.1, 0.2, 0.3});
end Two;
"""

BALL = """\
model Ball
  dimensionless;
  coordinate z = 1;
  kinetic 1/2*der(z)^2;
  potential z;
  contact z restitution 1;
  experiment(stop = 10);
end Ball;
"""


def test_points_of_a_harmonic_motion() -> None:
    """x = cos t goes up through zero at t = 3 pi/2 + 2 pi k, where y = cos(w t)/2."""
    found = mechc.loads(TWO).section(where="x = 0", count=300)
    t = found.arrays["time"]
    assert found.outcome is Outcome.COMPLETED and found.summary()["count"] == len(t) == 300
    expected = 1.5 * math.pi + 2 * math.pi * np.arange(300)
    assert np.abs(t - expected).max() < 1e-7  # 1e-10 a step, 15 steps a turn, 300 turns
    assert np.abs(found.arrays["y"] - 0.5 * np.cos(math.sqrt(2) * expected)).max() < 1e-7
    assert np.abs(found.arrays["x"]).max() < 1e-12
    told = found.summary()["accuracy"]["errors"]["y"]
    assert told is not None and 0 < told < 1e-6


@pytest.mark.parametrize(("direction", "count"), [("up", 5), ("down", 5), ("both", 10)])
def test_directions(direction: str, count: int) -> None:
    """cos t is zero ten times within 30, by turns on its way down and up."""
    found = mechc.loads(TWO).section(where="x = 0", direction=direction, stop=30)
    assert found.summary()["count"] == count


def test_a_formula_is_a_surface() -> None:
    """x^2 + y = 1/4, as SciPy locates it."""
    found = mechc.loads(TWO).section(where="x^2 + y = 1/4 + 0*x", direction="both", stop=20)

    def rate(t: float, s: np.ndarray) -> list[float]:
        return [s[2], s[3], -s[0], -2 * s[1]]

    def surface(t: float, s: np.ndarray) -> float:
        return float(s[0] ** 2 + s[1] - 0.25)

    twin = solve_ivp(rate, (0, 20), [1, 0.5, 0, 0], events=surface, rtol=1e-12, atol=1e-12)
    assert np.abs(found.arrays["time"] - twin.t_events[0]).max() < 1e-8


def test_multiples_of_a_time_that_is_a_formula() -> None:
    found = mechc.loads(TWO).section(every="2*pi/w", count=50)
    assert np.abs(found.arrays["y"] - 0.5).max() < 1e-7
    assert np.abs(found.arrays["time"] - np.arange(50) * 2 * math.pi / math.sqrt(2)).max() < 1e-12 * 250


def test_several_starts() -> None:
    found = mechc.loads(TWO).section(experiment="starts", where="x = 0", count=5)
    assert [point["y"] for point in found.summary()["points"]][::5] == pytest.approx(
        [a * math.cos(math.sqrt(2) * 1.5 * math.pi) for a in (0.1, 0.2, 0.3)], abs=1e-8
    )


def test_through_impacts() -> None:
    """An elastic ball is at half its height every sqrt(2) (4 sqrt(1/4 ...)): up once in a bounce of 2 sqrt(2)."""
    found = mechc.loads(BALL).section(where="z = 1/2", count=20)
    # down to 0, then up to 1/2: sqrt(2) less the unit from 1/2 to 1
    first = math.sqrt(2) + (math.sqrt(2) - 1)
    assert found.arrays["time"] == pytest.approx(first + 2 * math.sqrt(2) * np.arange(20), abs=1e-7)
    assert (found.arrays["der(z)"] > 0).all()
    # its jump is not a passage; the turn at the top is
    jumps = mechc.loads(BALL).section(where="der(z) = 0", count=5)
    assert jumps.summary()["count"] == 0 or (np.abs(jumps.arrays["z"] - 1) < 1e-6).all()


def test_henon_heiles_against_scipy() -> None:
    found = example("henon_heiles").section(where="q1 = 0", count=20)

    def rate(t: float, s: np.ndarray) -> list[float]:
        return [s[2], s[3], -s[0] - 2 * s[0] * s[1], -s[1] - s[0] ** 2 + s[1] ** 2]

    def surface(t: float, s: np.ndarray) -> float:
        return float(s[0])

    surface.direction = 1  # type: ignore[attr-defined]
    start = [0, 0.1, math.sqrt(1 / 6 - 0.01 + 2 / 3 * 0.001), 0]
    twin = solve_ivp(rate, (0, 130), start, events=surface, rtol=1e-13, atol=1e-13, method="DOP853")
    rows = twin.y_events[0]
    rows = rows[np.asarray(twin.t_events[0]) > 1e-9][:20]
    assert np.abs(found.arrays["q2"] - rows[:, 1]).max() < 1e-8


def test_stroboscopic_points_of_a_driven_pendulum() -> None:
    """U91: one point of a motion with the period of the drive, two after it has doubled, many on a strange attractor."""
    model = example("driven_pendulum")

    def spread(g: float, every: int) -> float:
        found = model.section(set={"g": g}, every="2*pi/wD", start=2000, count=40)
        places = np.exp(1j * found.arrays["theta"]) + found.arrays["der(theta)"] * 10
        return max(float(np.abs(places[k::every] - places[k]).max()) for k in range(every))

    assert spread(0.9, 1) < 1e-7
    assert spread(1.07, 1) > 0.1 and spread(1.07, 2) < 1e-7
    assert all(spread(1.15, n) > 5 for n in (1, 2, 3, 4, 6, 8))


def test_stroboscopic_points_without_damping_are_on_closed_curves() -> None:
    """U91: weakly driven the motion is quasi-periodic: its distance from the centre of the island is a smooth function of
    the direction, which many points fill."""
    text = (EXAMPLES / "driven_pendulum.mech").read_text(encoding="utf-8")
    model = mechc.loads(text.replace("damping 1/q on theta;", ""))
    found = model.section(set={"g": 0.05, "theta": 0.5}, every="2*pi/wD", count=400)
    z = found.arrays["theta"] + 1j * found.arrays["der(theta)"]
    z -= (z.real.max() + z.real.min()) / 2 + 1j * (z.imag.max() + z.imag.min()) / 2
    order = np.argsort(np.angle(z))
    turn, radius = np.diff(np.angle(z)[order]), np.abs(z)[order]
    assert turn.min() > 0 and turn.max() < 0.1
    assert np.abs(np.diff(radius)).max() < 1e-3 * radius.max()


def test_a_chaotic_section_says_how_far_its_points_can_be_trusted() -> None:
    found = example("driven_pendulum").section(set={"g": 1.15}, every="2*pi/wD", count=150)
    accuracy = found.summary()["accuracy"]
    assert accuracy["compared"] == [150] and 5 < accuracy["agreeing"][0] < 100
    assert any("chaotic" in remark for remark in found.remarks)


def test_mistakes() -> None:
    model = mechc.loads(TWO)
    with pytest.raises(mechc.UsageMistake, match="'where' is a surface such as 'x = 0', not 'x'"):
        model.section(where="x")
    with pytest.raises(mechc.SimulationError, match="one of both"):
        model.section(where="x = 0", every=1)
    with pytest.raises(mechc.SimulationError, match="up, down or both"):
        model.section(where="x = 0", direction="upwards")
    with pytest.raises(mechc.CompileError, match="zz"):
        model.section(where="zz = 0")
    with pytest.raises(mechc.UsageMistake, match="one formula"):
        model.section(where="x; parameter k = 0 = 1")
    with pytest.raises(mechc.SimulationError, match="positive"):
        model.section(every=-1)


def test_nothing_comes() -> None:
    found = mechc.loads(TWO).section(where="x = 5", count=3)
    assert found.summary()["count"] == 0 and "0 of 3" in found.message


def test_the_command(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file, picture = tmp_path / "two.mech", tmp_path / "section.png"
    file.write_text(TWO, encoding="utf-8")
    command = [
        "study",
        "section",
        str(file),
        "--where",
        "x = 0",
        "--count",
        "7",
        "--json",
        "--plot",
        str(picture),
    ]
    assert run_command(command) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["count"] == len(found["points"]) == 7 and picture.exists()
    assert set(found["points"][0]) == {"time", "x", "y", "der(x)", "der(y)"}


def test_many_roots_at_once() -> None:
    """Roots of (x - r)^3 + (x - r): simple ones, some next to an end, one at it."""
    roots = np.array([0.5, 1e-12, 1 - 1e-12, 0.3, 1.0])

    def value(x: np.ndarray) -> np.ndarray:
        out: np.ndarray = (x - roots) ** 3 + (x - roots)
        return out

    zero, one = np.zeros(5), np.ones(5)
    assert np.abs(chandrupatla(value, zero, one, value(zero), value(one)) - roots).max() < 1e-15
    t = np.linspace(0, 20, 100)
    assert crossings(t, np.sin(t + 1), lambda x: np.sin(x + 1), "up") == pytest.approx(
        np.array([2, 4, 6]) * math.pi - 1
    )


def test_a_direction_of_no_surface_is_refused() -> None:
    with pytest.raises(mechc.SimulationError, match="direction"):
        mechc.loads(TWO).section(every=1, direction="up", count=3)
    assert mechc.loads(TWO).section(every=1, count=3).summary()["count"] == 3


@pytest.mark.parametrize("text", [TWO, BALL], ids=["smooth", "impacts"])
def test_settling_may_outlast_the_experiment(text: str) -> None:
    """The study follows the motion as far as it needs: the stop of the experiment is not a bound of its start."""
    short = text.replace("stop = 30", "stop = 4").replace("stop = 10", "stop = 4")
    model = mechc.loads(short)
    name = "x" if text is TWO else "der(z)"
    found = model.section(where=f"{name} = 0.1", direction="down", start=20, count=3).summary()
    times = [point["time"] for point in found["points"]]
    period, first = (2 * math.pi, math.acos(0.1)) if text is TWO else (2 * math.sqrt(2), math.sqrt(8) - 0.1)
    if text is BALL:
        exact = [k * period - 0.1 for k in (8, 9, 10)]
    else:
        exact = [first + k * period for k in (3, 4, 5)]
    assert times == pytest.approx(exact, abs=1e-8)
    every = model.section(every=1.5, start=20, count=3).summary()
    assert [point["time"] for point in every["points"]] == pytest.approx([21, 22.5, 24])
    with pytest.raises(mechc.SimulationError, match="before the start"):
        model.section(every=1.5, start=20, stop=10, count=3)


def test_the_start_of_an_experiment_counts() -> None:
    late = TWO.replace("experiment(stop = 30)", "experiment(start = 20, stop = 30)")
    found = mechc.loads(late).section(every=5, count=2).summary()
    assert [point["time"] for point in found["points"]] == [20, 25]


def test_settling_much_longer_than_the_experiment_is_waited_for() -> None:
    short = TWO.replace("stop = 30", "stop = 0.1")
    found = mechc.loads(short).section(where="x = 0", start=40, count=1).summary()
    assert found["points"][0]["time"] == pytest.approx(13.5 * math.pi, abs=1e-8)


def test_outputs_and_the_number_of_the_start_are_there_and_drawn() -> None:
    """x = cos t, y = y0 cos(sqrt(2) t), at the times 0, 1, 2, ..."""
    text = TWO.replace("  experiment(", "  output freq = 2*w;\n  output sum = x + y;\n  experiment(", 1)
    found = mechc.loads(text).section(experiment="starts", every=1.0, count=5, of="sum,y")
    times, k = np.tile(np.arange(5.0), 3), np.repeat(np.arange(3), 5)
    y = np.array([0.1, 0.2, 0.3])[k] * np.cos(math.sqrt(2) * times)
    assert (found.arrays["start number"] == k).all() and found.arrays["time"] == pytest.approx(times)
    assert found.arrays["sum"] == pytest.approx(np.cos(times) + y, abs=1e-7)
    assert found.arrays["freq"] == pytest.approx(2 * math.sqrt(2))
    assert [point["sum"] for point in found.summary()["points"]] == found.arrays["sum"].tolist()
    (panel,) = found.panels
    assert (panel.x_label, panel.y_label) == ("sum", "y")
    assert panel.curves[2].name == "y = 0.3"
    assert panel.curves[2].x == pytest.approx((np.cos(times) + y)[k == 2], abs=1e-7)
    assert "asked_every" not in mechc.loads(text).section(every="1 + 0*w", count=2).arrays


def test_outputs_at_points_hold_what_events_have_done() -> None:
    """The ball is at the floor at sqrt(2) (1 + 2 k)."""
    text = BALL.replace(
        "  experiment", "  discrete Integer n = 0;\n  when z < 0.01 then n := n + 1; end when;\n"
        "  output hits = n;\n  output double = 2*z;\n  experiment"
    )  # fmt: skip
    found = mechc.loads(text).section(every=0.75, count=12)
    times = 0.75 * np.arange(12)
    fallen = (times + math.sqrt(2)) % (2 * math.sqrt(2)) - math.sqrt(2)
    assert found.arrays["double"] == pytest.approx(2 - fallen**2, abs=1e-6)
    assert found.arrays["hits"] == pytest.approx(np.floor((times / math.sqrt(2) + 1) / 2))


def test_many_starts_are_one_cloud_without_a_legend() -> None:
    text = TWO.replace("y in {0.1, 0.2, 0.3}", "y in linspace(0.1, 2, 40)").replace(
        "  experiment(", "  output size = y^2 + der(y)^2/w^2;\n  experiment(", 1
    )
    found = mechc.loads(text).section(experiment="starts", every=1.0, count=3, of="size,x")
    drawn = figure(found)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        drawn.canvas.draw()
    (axes,) = drawn.axes
    assert axes.get_legend() is None and axes.get_title(loc="left") == "once in every interval, 40 starts"
    assert axes.get_position().height > 0.7
    assert sum(len(line.get_xdata()) for line in axes.lines) == 120


def test_a_section_is_drawn_in_two_quantities() -> None:
    with pytest.raises(SimulationError, match="in two quantities, not in 3: x, y, der"):
        mechc.loads(TWO).section(every=1.0, count=2, of="x,y,der(x)")
