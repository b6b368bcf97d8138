"""From the pointer to the picture: processor time of scripts, which another load of the machine changes little, on eight models.

Counted are the page's handler of the pointer, its worker (where the start is sought and the motion integrated), and what the page does with
the answer, up to after its last call that draws. ``-s`` shows these, the rest of the page's thread (style, layout, paint), and wall time.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browsers import Opened, needs_browser, traced
from msgspec import Struct

import mechc
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.web.page import page

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"

pytestmark = [pytest.mark.slow, needs_browser]

MOVES = 30

FREE = """
import mech.planar.*;
model FourBar "swings: only the angle of its crank is given"
  gravity {0, -9.81} m/s^2;
  Bar crank(m = 1 kg, l = 0.2 m); Bar coupler(m = 2 kg, l = 0.5 m); Bar rocker(m = 1.5 kg, l = 0.4 m);
  Revolute a(world -> crank.a, angle = 60 deg);
  Revolute b(crank.b -> coupler.a, angle ~ -30 deg);
  Revolute d(world * trans({0.5 m, 0 m}) -> rocker.a, angle ~ 90 deg);
  cut Revolute c(coupler.b -> rocker.b);
  draw sphere(1 cm) on crank.b;
  experiment(stop = 5 s);
end FourBar;
"""
DRIVEN = """
import mech.planar.*;
model DrivenFourBar "a motor turns the crank; a bar hangs from the coupler"
  parameter speed = 10 rad/s;
  gravity {0, -9.81} m/s^2;
  Bar crank(m = 1 kg, l = 0.2 m); Bar coupler(m = 2 kg, l = 0.5 m); Bar rocker(m = 1.5 kg, l = 0.4 m); Bar hung(m = 1 kg, l = 0.3 m);
  Revolute a(world -> crank.a);
  Revolute b(crank.b -> coupler.a, angle ~ -30 deg);
  Revolute d(world * trans({0.5 m, 0 m}) -> rocker.a, angle ~ 90 deg);
  cut Revolute c(coupler.b -> rocker.b);
  Revolute e(coupler.c -> hung.a, angle = -60 deg);
  drive a.angle = 60 deg + speed*time;
  draw sphere(1 cm) on hung.b;
  experiment(stop = 2 s);
end DrivenFourBar;
"""


class Held(Struct, frozen=True):
    """A model, the kind of the shape and its name by which a hand holds it; a slider where there is nothing to hold."""

    text: str = ""
    kind: str = ""
    name: str = ""
    slider: str = ""


MODELS = {
    "double_pendulum": Held(kind="disk", name="elbow"),
    "four_bar_free": Held(FREE, "sphere", ""),
    "four_bar_driven": Held(DRIVEN, "sphere", ""),
    "bouncing_ball": Held(kind="sphere"),
    "slider_crank": Held(kind="disk", name="big_end"),
    "quarter_car": Held(slider="v"),
    "stewart_platform": Held(slider="Rb"),
    "heavy_top_rotation": Held(kind="mass"),
}

DRAG = """async ([shape, slider, count, step]) => {
  const canvas = document.querySelector('#scene canvas'), box = canvas.getBoundingClientRect(), ms = [], runs = [];
  let answered, n = page.runs;
  Object.defineProperty(page, 'runs', {get: () => n, set: v => { n = v; queueMicrotask(() => answered?.()); }});
  canvas.setPointerCapture = () => {};
  page.playing(false); page.go(page.run.start);
  const middle = page.project(page.values(shape ?? 0).slice(0, 3)), input = slider && document.getElementById('s-' + slider), first = input && +input.value;
  let x = box.x + middle.x, y = box.y + middle.y;
  const send = type => canvas.dispatchEvent(new PointerEvent(type, {clientX: x, clientY: y, pointerId: 1, button: 0, buttons: 1, bubbles: true}));
  if (!input) send('pointerdown');
  for (let k = 0; k < count; k++) {
    x += step * Math.cos(k / 3); y += step * Math.sin(k / 3);
    performance.mark('move');
    const begun = performance.now(), drawn = new Promise((good, bad) => { answered = () => good(performance.now()); setTimeout(() => bad('no picture of move ' + k), 10000); });
    if (input) { input.value = first * (1 + 0.002 * k); input.dispatchEvent(new Event('input')); } else send('pointermove');
    ms.push(await drawn - begun); runs.push(page.run.ms);
    await new Promise(requestAnimationFrame); await new Promise(r => setTimeout(r));
  }
  performance.mark('move');
  return {ms, runs, share: page.run.share, values: Object.fromEntries(page.sliders.filter(s => s.value !== s.default).map(s => [s.name, s.value])), y0: Array.from(page.run.y0), size: [canvas.width, canvas.height]};
}"""


@pytest.mark.parametrize("name", MODELS)
def test_a_picture_follows_the_pointer(name: str, browser: Any, tmp_path: Path) -> None:
    held = MODELS[name]
    model = mechc.loads(held.text) if held.text else mechc.load(EXAMPLES / f"{name}.mech")
    path = tmp_path / "page.html"
    path.write_text(page(model))
    opened = Opened(browser, path, viewport={"width": 1280, "height": 720})
    shapes = [(s["kind"], s["name"]) for s in opened.ask("page.shapes")]
    shape = None if held.slider else shapes.index((held.kind, held.name))
    found, spent = traced(browser, opened, DRAG, [shape, held.slider or None, MOVES, 2.0])
    script = spent["page"] + spent["worker"]
    assert script.size == MOVES and spent["worker"].min() > 0, "each move has asked the worker"
    print(
        f"{name}: script {np.median(script):.1f} ms (most {script.max():.1f}) of processor time, of it worker {np.median(spent['worker']):.1f};"
        f" all of the page's thread {np.median(spent['thread of the page']):.1f}; {found['share']:.2f} of the time; wall {np.median(found['ms']):.1f} (most {max(found['ms']):.1f});"
        f" picture {found['size']}"
    )
    assert np.median(script) < 30
    assert opened.said == []
    opened.tab.close()
    assert_started_as_the_command_does(model, found)


def assert_started_as_the_command_does(model: mechc.Model, found: dict[str, Any]) -> None:
    """All states of the page's start against those of ``mechc init`` with the same values, to 1e-9."""
    problem = model.problem(quick=True)
    assert found["values"], "something was moved"
    options = SimulationOptions(values=found["values"], start=0.0, stop=0.0)
    case = prepare(problem, load_functions(problem), options)
    for q, page_value, value in zip(problem.states, found["y0"], case.y0, strict=True):
        if q.kind != "account":
            assert page_value == pytest.approx(value, rel=1e-9, abs=1e-9), q.name
