"""Pages: what they hold, and, in a real browser where there is one, that they move and agree with native runs."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browsers import Opened, needs_browser, off, waited
from parts_of_pages import parts_of

import mechc
from mechc.cli.main import run
from mechc.requests.parse_values import UsageMistake
from mechc.web.page import page
from mechc.web.run_facts import facts_of

ROOT = Path(__file__).resolve().parents[3]

BALL = """
model Ball "thrown"
  parameter Mass m(min = 0.5 kg, max = 3 kg) = 1 kg;
  parameter k = 0.1 N.s/m;
  coordinate Length x = 0 m;
  coordinate Length y = 1 m;
  initial der(x) = 1 m/s;
  kinetic 1/2*m*(der(x)^2 + der(y)^2);
  potential m*9.81 m/s^2*y;
  damping k on x;
  draw sphere(5 cm) at {x, y};
  draw trail({x, y});
  experiment(stop = 1 s, tolerance = 1e-10);
end Ball;
"""


STOPPED = """
model Stopped "everything of the experiment follows a parameter"
  parameter l(min = 0.1 m) = 0.5 m;
  parameter w = 2 rad/s;
  parameter e = 0.5;
  parameter k = 1 N.m;
  input Torque M = 0 N.m;
  coordinate theta = 0 rad;
  kinetic 1/2*1 kg*l^2*der(theta)^2;
  potential -1 kg*9.81 m/s^2*l*cos(theta) + 1/2*k*theta^2;
  torque M on theta;
  contact stop: 0.5 rad - theta restitution e;
  experiment(theta = (0.1 m)/l*1 rad, der(theta) = w, k = 2*l*1 N, M = 1 N*l, stop = 2*pi*1 rad/w);
end Stopped;
"""


def test_a_recorded_page_needs_nothing() -> None:
    text = page(mechc.loads(BALL), recorded=True)
    assert not re.search(r"(src|href)=[\"']?(https?:)?//", text)
    assert "&quot;" not in re.search(r"<title>(.*)</title>", text)[1]  # type: ignore[index]
    assert "without --recorded it has sliders" in str(parts_of(text)["info"])


def test_what_is_there_is_not_written_over(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model, other = tmp_path / "ball.mech", tmp_path / "notes.html"
    model.write_text(BALL)
    other.write_text("my notes")
    assert run(["compile", str(model), "--target", "web", "--recorded", "-o", str(other)]) == 2
    assert "which is not a page of mechc" in capsys.readouterr().err
    assert other.read_text() == "my notes"
    fresh = tmp_path / "ball.html"
    for _ in range(2):  # a page is written over
        assert run(["compile", str(model), "--target", "web", "--recorded", "-o", str(fresh)]) == 0
    assert run(["compile", str(model), "--target", "web", "-o", str(tmp_path / "ball.txt")]) == 2


@pytest.mark.parametrize("example", ["double_pendulum", "lagrange_top", "fekete", "stewart_platform"])
def test_smooth_models_have_small_pages(example: str) -> None:
    assert len(page(mechc.load(ROOT / "examples" / f"{example}.mech"))) <= 130_000


def test_a_curve_has_no_page() -> None:
    with pytest.raises(UsageMistake, match="is a curve and does not move: a page shows motions"):
        page(mechc.load(ROOT / "examples" / "curves" / "thrown.mech"), recorded=True)


MESHES = """
import mech.spatial.*;
model Meshes
  Body body(m = 1 kg, com = {0, 0, 0} m, J = diag({1, 1, 1} kg.m^2));
  Prismatic slide(world -> body.a, axis = {1, 0, 0}, der(position) = 2 m/s);
  draw none;
  draw mesh("t.obj", scale = {2, -1, 0.5} m) on body.a;
  experiment(stop = 1 s);
end Meshes;
"""


def meshes(folder: Path, text: str = "v 0.1 0 0\nv 0.2 0.3 0\nv 0.1 0 -0.4\nf 1 2 3\n") -> mechc.Model:
    (folder / "t.obj").write_text(text)
    (folder / "meshes.mech").write_text(MESHES)
    return mechc.load(folder / "meshes.mech")


def test_a_mesh_that_cannot_be_read(tmp_path: Path) -> None:
    model = meshes(tmp_path, "f 1 2 3\n")
    assert model.simulate()["slide.position"][-1] == pytest.approx(2, rel=1e-9)
    with pytest.raises(UsageMistake, match="there is no corner 1, and a 'draw' of the model shows it"):
        page(model, recorded=True)


def test_no_browser_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "ball.mech"
    model.write_text(BALL)
    monkeypatch.setattr("webbrowser.open", lambda url: False)
    assert run(["view", str(model), "--recorded", "-o", str(tmp_path / "b.html")]) == 0
    assert "no browser was found here" in capsys.readouterr().err


CRANK = """
import mech.planar.*;
model Crank "turned at a speed, from where it is held by a rod"
  parameter speed = 10 rad/s;
  parameter tilt = 30 deg;
  parameter l(max = 90 cm) = 80 cm;
  parameter rod = 1 m;
  input w = 2 rad/s;
  Bar arm(m = 200 g, l = l);
  Revolute hinge(world -> arm.a, angle = tilt, der(angle) = speed + w);
  coordinate h ~ 0.6 m;
  kinetic 1/2*1 kg*der(h)^2;
  constraint (h - 0.2 m)^2 + (pos(arm.b)[2] - 0.2 m)^2 + 0.16 m^2 = rod^2;
  experiment(stop = 0.01 s{display});
end Crank;
"""


@pytest.mark.parametrize(
    ("display", "units"),
    [
        ("", {"speed": "rad/s", "tilt": "deg", "l": "cm", "rod": "m", "w": "rad/s"}),
        (', display = "deg"', {"speed": "deg/s", "tilt": "deg", "l": "cm", "rod": "m", "w": "deg/s"}),
    ],
)
def test_settings_keep_the_units_of_the_text(display: str, units: dict[str, str]) -> None:
    """Curves are in degrees where the text writes degrees; a speed that it gives in rad/s stays in rad/s."""
    facts = facts_of(
        mechc.loads(CRANK.replace("{display}", display), keep={"scene"}), {}, None, {"method": "dop853"}
    )
    told: Any = facts.told(recorded=True)
    sliders = {q["name"]: q for q in (*told["parameters"], *told["inputs"])}
    assert {name: sliders[name]["shown"] for name in units} == units
    assert sliders["l"]["factor"] == 0.01 and sliders["l"]["value"] == 0.8
    assert next(row for row in told["limits"] if row[2] == "l")[4:] == [0.9, 0.01, "cm"]
    assert next(q for q in told["states"] if q["name"] == "hinge.angle")["shown"] == "deg"


# ---------------------------------------------------------------- in a browser


@needs_browser
def test_a_live_page(browser: Any, tmp_path: Path) -> None:
    model = mechc.loads(BALL)
    path = tmp_path / "ball.html"
    path.write_text(page(model))
    opened = Opened(browser, path)
    first = opened.columns()
    assert off(opened, model.simulate()) < 1e-9
    closed = (1 - np.exp(-0.1 * first["time"])) / 0.1  # m x'' = -k x', by hand
    assert np.allclose(first["x"], closed, rtol=0, atol=1e-9)
    opened.set("m", 0.5)
    moved = opened.columns()
    assert np.allclose(moved["x"], (1 - np.exp(-0.2 * first["time"])) / 0.2, rtol=0, atol=1e-9)
    opened.ask("page.go(0.25)")
    ball = opened.ask("page.values(0)")
    assert np.allclose(ball[:2], [(1 - np.exp(-0.05)) / 0.2, 1 - 9.81 / 32], rtol=0, atol=1e-5)
    opened.ask("document.getElementById('link').click()")
    link = opened.ask("location.hash")
    assert "m=0.5" in link and "t=0.25" in link
    again = Opened(browser, path, link)
    assert np.array_equal(again.columns()["x"], moved["x"])
    assert again.ask("page.time") == 0.25
    shown = opened.ask("page.series('x')")
    assert np.array_equal(shown, moved["x"])
    assert opened.said == [] and again.said == []


@needs_browser
def test_a_page_shows_its_equations(browser: Any, tmp_path: Path) -> None:
    path = tmp_path / "ball.html"
    path.write_text(page(mechc.loads(BALL)))
    opened = Opened(browser, path)
    opened.ask("document.getElementById('equations').click()")
    opened.wait("document.querySelectorAll('dialog math').length > 5")
    said = opened.ask("document.querySelector('dialog').innerText")
    assert "Lagrangian" in said and "Equations of motion" in said and "Cyclic coordinates: none" in said
    opened.ask("document.querySelector('dialog').click()")
    assert not opened.ask("document.querySelector('dialog').open")
    assert opened.said == []


DOUBLE = """
model Double
  dimensionless;
  coordinate a = 2; coordinate b = 2.5; coordinate aside = 1;
  kinetic der(a)^2 + 1/2*der(b)^2 + der(a)*der(b)*cos(a - b) + 1/2*der(aside)^2;
  potential -9.81*(2*cos(a) + cos(b)) + aside^2/2;
  experiment(stop = 40, tolerance = 1e-8);
end Double;
"""


@pytest.mark.slow
@needs_browser
def test_curves_are_pale_from_where_they_are_unknown(browser: Any, tmp_path: Path) -> None:
    """Chaos loses digits: two native runs part when those of the page do; what swings aside is known to the end."""
    model = mechc.loads(DOUBLE)
    path = tmp_path / "double.html"
    path.write_text(page(model))
    opened = Opened(browser, path)
    opened.wait("page.error")
    trusted = opened.ask("page.error.trusted")
    rows = opened.ask("page.run.n")
    times = np.linspace(0, 40, rows)
    one, two = (
        model.simulate(tolerance=tolerance, every=40 / (rows - 1), estimate_error=False)
        for tolerance in (1e-8, 1e-10)
    )
    apart = np.abs(one["a"] - two["a"]) > 0.01 * (2 + np.abs(one["a"]))
    # ln(10) over the exponent, for the two compilers
    assert abs(times[trusted[0]] - times[np.argmax(apart)]) < 4
    assert trusted[2] == rows and 0 < times[trusted[0]] < 38
    assert "; curves are pale from" in opened.ask("document.getElementById('note').textContent")
    assert opened.said == []


@pytest.mark.slow
@needs_browser
def test_links_hold_parameters_of_any_name(browser: Any, tmp_path: Path) -> None:
    """A parameter may be called as the page calls the time; what a link says wrongly is told and changes nothing."""
    model = mechc.loads(
        "parameter t = 1 m; parameter weight = 1 kg; coordinate x = 1 m; kinetic 1/2*weight*der(x)^2;"
        "potential 1/2*5 N/m*x^2*t/1 m; experiment(stop = 2 s, tolerance = 1e-10);"
    )
    path = tmp_path / "thick.html"
    path.write_text(page(model))
    opened = Opened(browser, path, "#t=2&50%&weight=")
    x = opened.ask("page.series('x')")
    assert x[-1] == pytest.approx(np.cos(2 * np.sqrt(10)), abs=1e-8)
    assert opened.ask("page.sliders.filter(s => s.value !== s.default).map(s => [s.name, s.value])") == [
        ["t", 2]
    ]
    said = opened.ask("document.getElementById('note').textContent")
    assert "‘50%’" in said and "‘weight’ to ‘’" in said
    opened.ask("page.go(0.5)")
    opened.ask("document.getElementById('link').click()")
    again = Opened(browser, path, opened.ask("location.hash"))
    assert again.ask("page.time") == 0.5 and again.ask("page.series('x')") == x
    assert opened.said == [] and again.said == []


@pytest.mark.slow
@needs_browser
def test_the_experiment_follows_a_parameter(browser: Any, tmp_path: Path) -> None:
    model = mechc.loads(STOPPED)
    path = tmp_path / "stopped.html"
    path.write_text(page(model))
    opened = Opened(browser, path)
    assert off(opened, model.simulate()) < 1e-7
    opened.set("w", 1.0)
    opened.set("l", 0.8)
    solution = model.simulate(set={"w": 1.0, "l": 0.8})
    assert opened.ask("+document.getElementById('time').max") == float(solution.time[-1]) == 2 * np.pi
    assert opened.columns()["theta"][0] == 0.125
    assert off(opened, solution) < 1e-7
    assert opened.ask("page.sliders.find(s => s.name == 'M').value") == 0.8, "shown as it is"
    opened.set("M", 0.25)  # what the page sets counts more than the experiment
    assert off(opened, model.simulate(set={"w": 1.0, "l": 0.8, "M": 0.25})) < 1e-7
    assert opened.said == []


@pytest.mark.slow
@needs_browser
def test_a_failed_run_leaves_nothing_of_an_earlier_one_in_sight(browser: Any, tmp_path: Path) -> None:
    model = mechc.loads(STOPPED)
    path = tmp_path / "stopped.html"
    path.write_text(page(model))
    opened = Opened(browser, path)
    failure = "document.getElementById('failure').textContent"
    opened.set("e", 1.6)
    native = model.simulate(set={"e": 1.6})
    assert native.failure is not None and opened.ask(failure) == native.failure.message
    assert (
        opened.ask("page.run") is None and opened.ask("document.getElementById('energy').textContent") == "–"
    )
    assert opened.ask("getComputedStyle(document.getElementById('plot')).visibility") == "hidden"
    opened.set("e", 0.25)
    assert opened.ask(failure) == "" and off(opened, model.simulate(set={"e": 0.25})) < 1e-7
    opened.ask("page.sliders.find(s => s.name == 'l').set(0.05, false)")  # as typed: the slider ends before
    opened.wait("document.getElementById('failure').textContent != ''")
    assert opened.ask(failure) == "l is 0.05 m, below its minimum 0.1 m"
    opened.set("l", 0.15)  # the start lies after the stop
    told = model.simulate(set={"e": 0.25, "l": 0.15}).failure
    assert told is not None and opened.ask(failure) == told.message


HELD = """
(() => {
  const real = WebAssembly.instantiate;
  window.Worker = undefined;
  WebAssembly.instantiate = (...all) => new Promise((good, bad) => {
    window.release = () => real(...all).then(good, bad);
    window.refuse = () => bad(Error('no room'));
  });
})();
"""
"""Makes a page wait for its model until it is released, or refused."""


@pytest.mark.slow
@needs_browser
def test_before_the_first_result_nothing_is_shown_as_one(browser: Any, tmp_path: Path) -> None:
    path = tmp_path / "ball.html"
    path.write_text(page(mechc.loads(BALL)))
    seen = "id => getComputedStyle(document.querySelector(id)).visibility + getComputedStyle(document.querySelector(id)).display"
    for then in ("release", "refuse"):
        tab = browser.new_page()
        tab.add_init_script(HELD)
        tab.goto(path.as_uri())
        waited(tab, "window.release !== undefined")
        for hidden in ("#scene canvas", ".dot", ".marker", "#phase", "dl"):
            assert tab.evaluate(seen, hidden).startswith("hidden"), hidden
        assert tab.evaluate(seen, "#computing") == "visibleblock"
        tab.evaluate(f"void {then}()")
        waited(tab, "!document.body.classList.contains('computing')")
        failure = tab.evaluate("document.getElementById('failure').textContent")
        assert tab.evaluate(seen, "#computing").endswith("none")
        if then == "release":
            waited(tab, "page.ready")
            assert failure == "" and tab.evaluate(seen, ".dot").startswith("visible")
        else:
            assert failure == "This page cannot run here: no room"
            assert tab.evaluate(seen, ".dot").startswith("hidden")
        tab.close()


@pytest.mark.slow
@needs_browser
def test_the_picture_holds_meshes_as_they_are_scaled(browser: Any, tmp_path: Path) -> None:
    """A triangle of 10 to 20 cm, stretched, mirrored and squeezed along its axes, on a body that goes 2 m along x."""
    path = tmp_path / "meshes.html"
    text = page(meshes(tmp_path), recorded=True)
    path.write_text(text)
    opened = Opened(browser, path)
    box = opened.tab.evaluate("plan => motion(page.run, plan).box()", parts_of(text)["info"]["scene"])
    assert box["low"] == pytest.approx([0.2, -0.3, -0.2], abs=1e-5)
    assert box["high"] == pytest.approx([2.4, 0, 0], abs=1e-5)
    assert opened.said == []
    opened.tab.close()


@needs_browser
def test_parts_that_do_not_reach_are_told(browser: Any, tmp_path: Path) -> None:
    path = tmp_path / "crank.html"
    path.write_text(page(mechc.loads(CRANK.replace("{display}", ""))))
    opened = Opened(browser, path)
    failure = "document.getElementById('failure').textContent"
    assert opened.ask(failure) == ""
    opened.set("rod", 0.25)  # it needs 0.45 m
    assert "the parts do not reach; move the slider back, or press reset" in opened.ask(failure)
    before = opened.ask("page.runs")
    opened.ask("document.getElementById('reset').click()")
    opened.wait(f"page.runs > {before}")
    assert opened.ask(failure) == "" and opened.ask("page.run.n") > 0
    opened.tab.close()


@pytest.mark.slow
@needs_browser
def test_a_recorded_page_moves_on_a_phone(browser: Any, tmp_path: Path) -> None:
    path = tmp_path / "ball.html"
    path.write_text(page(mechc.loads(BALL), recorded=True))
    opened = Opened(browser, path, viewport={"width": 360, "height": 640})
    assert opened.ask("document.documentElement.scrollWidth") <= 360
    assert opened.ask("document.querySelectorAll('fieldset:not([hidden])').length") == 0
    opened.ask("scrollTo(0, 1e4)")
    place = opened.ask("document.querySelector('main > #scene').getBoundingClientRect().top")
    assert place == 0, "it stays in sight while what is below is set"
    drift = mechc.loads(BALL).simulate().accuracy.energy
    assert drift is not None and opened.ask("page.energy.worst") == drift.absolute, (
        "not that of rounded numbers"
    )
    opened.tab.keyboard.press("Home")  # it has moved on since it was opened
    before = opened.ask("page.values(0)[0]")
    opened.tab.keyboard.press("End")
    assert opened.ask("page.values(0)[0]") > before + 0.5
    assert opened.said == []
