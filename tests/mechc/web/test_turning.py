"""Angles after whose turn the motion is the same: found by structure, compared with trials of the equations; shown in turns, and within one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from browsers import Opened, needs_browser

import mechc
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.studies.flow.pieces import periodic
from mechc.web.page import page
from mechc.web.turning import turning

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"

WOUND = """
parameter k = 1 N.m;
coordinate Angle phi = 0 deg;
coordinate Angle psi = 0 deg;
coordinate Angle chi = 0 deg;
coordinate Angle gear = 0 deg;
kinetic 1/2*1 kg.m^2*(der(phi)^2 + der(psi)^2 + der(chi)^2 + der(gear)^2);
potential 1/2*k*phi^2 - k*cos(psi - 2*chi) + k*sin(1/2*gear);
experiment(stop = 1 s);
"""


@pytest.mark.parametrize(
    "name", ["wound", "double_pendulum", "slider_crank", "heavy_symmetric_top", "newtons_cradle"]
)
def test_the_structure_shows_what_trials_do(name: str) -> None:
    model = mechc.loads(WOUND) if name == "wound" else mechc.load(EXAMPLES / f"{name}.mech")
    problem = model.problem(quick=True)
    case = prepare(problem, load_functions(problem), SimulationOptions(start=0.0, stop=0.0))
    found = turning(model.compilation.equations)
    assert found == [k for k in range(problem.nq) if periodic(case, k)]
    assert found == [1, 2] if name == "wound" else found


def test_quaternions_do_not_turn() -> None:
    model = mechc.load(EXAMPLES / "heavy_top_rotation.mech")
    assert turning(model.compilation.equations) == []


@needs_browser
def test_many_turns_are_counted_and_a_phase_portrait_shows_one(browser: Any, tmp_path: Path) -> None:
    """A wheel that turns twelve times in 6 s: its curve ends at twelve turns, and the point of the portrait is where it was a turn before."""
    text = "parameter m = 1 kg.m^2; coordinate phi = 0 rad; initial der(phi) = 720 deg/s; kinetic 1/2*m*der(phi)^2; experiment(stop = 6 s);"
    path = tmp_path / "page.html"
    path.write_text(page(mechc.loads(text)))
    tab = Opened(browser, path)
    box = tab.tab.query_selector("#plot").bounding_box()
    tab.tab.mouse.move(box["x"] + box["width"] - 12, box["y"] + box["height"] / 2)
    assert tab.ask("document.querySelector('.reading').textContent") == "φ 12 turns at 6 s"
    place = "t => { page.go(t); return document.querySelector('.dot').style.transform; }"
    first, again, elsewhere = (tab.ask(place, t) for t in (1.1, 1.6, 1.3))
    assert first == again != elsewhere
    assert tab.said == []
