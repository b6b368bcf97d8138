"""Inputs that are given over time, on pages: they move as native runs do, whatever is given and however it is interpolated."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browsers import Opened, needs_browser, off

import mechc
from mechc.cli.main import run
from mechc.requests.parse_values import UsageMistake
from mechc.web.page import page

PUSHED = """
model Pushed
  parameter m = 2 kg;
  parameter k = 50 N/m;
  parameter Time last = 4 s;
  input Force F(interpolation = "{}") = 0 N;
  input Force G = 1 N;
  coordinate Length x = 0.1 m;
  kinetic 1/2*m*der(x)^2;
  potential 1/2*k*x^2;
  force F + G on x;
  experiment(stop = last, tolerance = 1e-10);
end Pushed;
"""

BALL = """
model Ball
  input Force F = 0 N;
  parameter e = 0.6;
  coordinate Length x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1 kg*9.81 m/s^2*x;
  force F on x;
  contact floor: x restitution e;
  experiment(stop = 1.5 s, tolerance = 1e-10);
end Ball;
"""

FOLLOWED = """
model Followed "measured from 2 s on"
  parameter Time last = 5 s;
  input Length road(interpolation = "spline");
  coordinate Length s;
  coordinate Length x = 0.1 m;
  drive s = road;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*80 N/m*(x - s)^2;
  experiment(start = 2 s, stop = last, tolerance = 1e-10);
end Followed;
"""

TIMES = np.linspace(0.0, 4.0, 21)
PUSH = 5 * np.sin(1.3 * TIMES) + np.where(np.arange(21) % 5 == 0, 3.0, 0.0)


def opened(browser: Any, model: mechc.Model, path: Path, **options: Any) -> Opened:
    path.write_text(page(model, options=options), encoding="utf-8")
    return Opened(browser, path)


@needs_browser
@pytest.mark.parametrize(
    "kind", ["linear", *(pytest.param(k, marks=pytest.mark.slow) for k in ("step", "spline", "function"))]
)
def test_a_table_moves_what_it_moves_natively(browser: Any, tmp_path: Path, kind: str) -> None:
    """Before and after a slider is moved, and with a second input that keeps its slider."""
    model = mechc.loads(PUSHED.format("linear" if kind == "function" else kind))
    given: Any = (lambda t: 5 * np.sin(1.3 * t) * (t < 2.5)) if kind == "function" else (TIMES, PUSH)
    shown = opened(browser, model, tmp_path / "page.html", inputs={"F": given})
    assert off(shown, model.simulate(inputs={"F": given})) < 1e-9
    assert [s["name"] for s in shown.ask("page.sliders")] == ["m", "k", "last", "x", "G"]
    for name, value in (("m", 3.0), ("G", 3.0)):
        shown.set(name, value)
    assert off(shown, model.simulate(set={"m": 3.0, "G": 3.0}, inputs={"F": given})) < 1e-9
    assert shown.said == []


@needs_browser
def test_a_table_among_impacts(browser: Any, tmp_path: Path) -> None:
    model = mechc.loads(BALL)
    given = {"F": (np.array([0.0, 0.3, 0.3, 0.9]), np.array([0.0, 6.0, -4.0, 2.0]))}
    shown = opened(browser, model, tmp_path / "page.html", inputs=given)
    assert off(shown, model.simulate(inputs=given)) < 1e-9
    assert shown.ask("page.run.events.length") == len(model.simulate(inputs=given).events) > 1


@needs_browser
def test_a_measured_motion_drives_on_a_page(browser: Any, tmp_path: Path) -> None:
    """Its derivatives come with it, its motion begins where the table does, and no slider goes beyond its end."""
    model = mechc.loads(FOLLOWED)
    times = np.linspace(2.0, 6.0, 30)
    given = {"road": (times, 0.1 * np.cos(2 * times))}
    shown = opened(browser, model, tmp_path / "page.html", inputs=given)
    assert off(shown, model.simulate(inputs=given)) < 1e-9
    shown.set("last", 5.5)
    assert off(shown, model.simulate(set={"last": 5.5}, inputs=given)) < 1e-9
    shown.set("last", 6.5)
    assert "the table of road reaches from 2 to 6" in shown.ask(
        "document.getElementById('failure').textContent"
    )


def test_commands_give_pages_their_tables(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without the table a page of what is driven is refused; other targets have no place for tables."""
    model, table, out = tmp_path / "m.mech", tmp_path / "road.csv", tmp_path / "m.html"
    model.write_text(FOLLOWED)
    table.write_text("time [s],road [cm]\n" + "".join(f"{2 + k / 10},{k % 3}\n" for k in range(41)))
    command = ["compile", str(model), "--target", "web", "--recorded", "-o", str(out)]
    assert run(command) == 2
    assert "drives a coordinate, which needs its derivatives" in capsys.readouterr().err
    assert run([*command, "--input", f"road={table}"]) == 0
    assert (
        run(["view", str(model), "--no-open", "-o", str(out), "--recorded", "--input", f"road={table}"]) == 0
    )
    assert run(["compile", str(model), "--target", "casadi", "--input", f"road={table}"]) == 2
    assert "told its inputs when it runs" in capsys.readouterr().err


def test_a_table_of_no_input_has_no_page() -> None:
    with pytest.raises(UsageMistake, match="no input"):
        page(mechc.loads(BALL), options={"inputs": {"H": (TIMES, PUSH)}})
