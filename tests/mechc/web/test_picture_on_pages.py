"""What a page shows of a motion, in a real browser: tracks to one scale, what travels far, the speed of playing, curves in panels."""

from __future__ import annotations

import io
import math
import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from browsers import Opened, needs_browser
from PIL import Image

import mechc
from mechc.web.page import page

pytestmark = needs_browser

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
PHONE = {"width": 390, "height": 844}


def opened(browser: Any, folder: Path, text: str, **options: Any) -> Opened:
    path = folder / "page.html"
    path.write_text(page(mechc.loads(text)))
    return Opened(browser, path, **options)


CHAIN = """
structural parameter Integer n = 30;
coordinate Length x[n] = {1 mm*i for i in 1:n};
coordinate Length drift = 1 km;
initial der(drift) = 1 m/s;
kinetic 1/2*1 kg*(dot(der(x), der(x)) + der(drift)^2);
potential 1/2*10 N/m*dot(x, x);
experiment(stop = 5 s);
"""
RANGES = "[...motion(page.run, page.info.scene).ranges].map(([s, r]) => [s.text, ...r])"


def test_tracks_of_an_array_have_one_scale_and_those_left_out_are_counted(
    browser: Any, tmp_path: Path
) -> None:
    tab = opened(browser, tmp_path, CHAIN)
    ranges = {name: (low, high) for name, low, high in tab.ask(RANGES)}
    assert len(ranges) == 24 and len(set(ranges.values())) == 1
    assert ranges["x[1]"] == pytest.approx((-0.024, 0.024), rel=1e-3)
    assert tab.ask("page.info.scene.left") == 7  # 31 coordinates
    assert tab.ask("document.getElementById('chosen').textContent").startswith("6 of ")
    assert tab.ask("page.info.moreCurves") == 25
    assert tab.said == []


@pytest.mark.slow
def test_a_track_that_hardly_moves_beside_another_has_a_scale_of_its_own(
    browser: Any, tmp_path: Path
) -> None:
    """A body above a wheel is so on one scale; what goes a kilometre has another than what swings by a millimetre."""
    model = """coordinate Length upper = 60 cm; coordinate Length lower = 30 cm; coordinate Length {far};
    kinetic 1/2*1 kg*(der(upper)^2 + der(lower)^2 + der({name})^2);
    potential 1/2*100 N/m*((upper - 0.7 m)^2 + (lower - 0.2 m)^2) + 1 N*{name};
    experiment(stop = 5 s);"""
    near = opened(browser, tmp_path, model.format(far="third = 50 cm", name="third").replace("1 N*", "0 N*"))
    assert len({tuple(r[1:]) for r in near.ask(RANGES)}) == 1
    far = opened(browser, tmp_path, model.format(far="far = 1 m", name="far"))
    found = {name: (low, high) for name, low, high in far.ask(RANGES)}
    assert found["far"][1] - found["far"][0] > 10
    assert found["upper"] == pytest.approx((0.6, 0.8), rel=1e-3)


@pytest.mark.slow
def test_tracks_leave_their_room_to_the_curves(browser: Any, tmp_path: Path) -> None:
    text = "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; potential 1/2*10 N/m*x^2; experiment(stop = 5 s);"
    heights = "['#scene', '#plot'].map(id => document.querySelector(id).clientHeight)"
    for screen in ({"width": 1440, "height": 900}, PHONE):
        scene, plot = opened(browser, tmp_path, text, viewport=screen).ask(heights)
        assert scene < 130 < plot


CAR = """
model Car
  coordinate Length x = 0 m; coordinate Length y = 0 m;
  initial der(x) = 25 m/s; initial der(y) = {side} m/s;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  draw box({{4, 2}} m) at {{x, y}};
  experiment(stop = 8 s);
end Car;
"""


def test_what_travels_far_is_followed_and_leaves_a_trace(browser: Any, tmp_path: Path) -> None:
    tab = opened(browser, tmp_path, CAR.format(side=0.4))
    wide = tab.ask("document.getElementById('scene').clientWidth")
    for share in (0, 0.3, 1):
        tab.ask(f"page.go({8 * share})")
        at = tab.ask("page.project(Array.from(page.values(0).slice(0, 3)))")
        assert at["x"] == pytest.approx(wide / 2, abs=1) and 4 * at["scale"] > wide / 30
    assert "trail" in tab.ask("page.shapes.map(s => s.kind)")
    tab.ask("document.getElementById('follow').click()")
    assert 4 * tab.ask("page.project([0, 0, 0]).scale") < wide / 30
    assert tab.said == []
    across = opened(browser, tmp_path, CAR.format(side=10))  # a way that fills the picture is seen whole
    assert not across.ask("page.follows()")


@pytest.mark.slow
def test_what_was_followed_stays_so_and_as_near(browser: Any, tmp_path: Path) -> None:
    """A slider that leads it aside, too, neither ends that nor changes the scale."""
    tab = opened(browser, tmp_path, CAR.format(side=0.4))
    wide = tab.ask("document.getElementById('scene').clientWidth")
    before = tab.ask("page.project([0, 0, 0]).scale")
    tab.ask("page.sliders.find(s => s.name === 'der(y)').set(20, false)")
    tab.wait("page.idle()")
    assert tab.ask("page.follows()") and not tab.ask("document.getElementById('follow').parentNode.hidden")
    for share in (0, 0.5, 1):
        tab.ask(f"page.go({8 * share})")
        at = tab.ask("page.project(Array.from(page.values(0).slice(0, 3)))")
        assert at["x"] == pytest.approx(wide / 2, abs=1)
        assert at["scale"] == pytest.approx(before, rel=0.01)


TURNED = """
coordinate Angle phi = 0 rad;
initial der(phi) = {w} rad/s;
kinetic 1/2*1 kg.m^2*der(phi)^2;
experiment(stop = {stop} s);
"""


@pytest.mark.parametrize(
    ("w", "stop", "speed"),
    [
        (140, 2, 0.1),  # 22 turns in a second
        *(
            pytest.param(*case, marks=pytest.mark.slow)
            for case in (
                (1, 10, 1),
                (4000, 10, 0.1),  # no slower than a minute for all
                (1, 2, 0.5),
                (1, 0.45, 0.1),
                (1e-3, 3000, 200),
                (1, 2e-6, 5e-7),
            )
        ),
    ],
)
def test_the_speed_lets_the_motion_be_seen(
    w: float, stop: float, speed: float, browser: Any, tmp_path: Path
) -> None:
    tab = opened(browser, tmp_path, TURNED.format(w=w, stop=stop))
    found = tab.ask("page.speed")
    assert found == speed
    assert tab.ask("+document.getElementById('speed').value") == found
    if 0.5 < stop < 100:
        assert "1" in tab.ask("[...document.getElementById('speed').options].map(o => o.value)")
    turns = w * found / 60 / (3.141592653589793 / 9)
    assert turns <= 1 or stop / found >= 59


BAR = """
import mech.planar.*;
Bar bar(m = 1 kg, l = 1 m);
Revolute hinge(world -> bar.a, der(angle) = 140 rad/s);
experiment(stop = 4 s);
"""
UNSEEN = """
coordinate Angle phi = 0 rad; initial der(phi) = 140 rad/s; kinetic 1/2*1 kg.m^2*der(phi)^2;
draw box({1, 0.1} m) at {0, 0} m;
experiment(stop = 4 s);
"""


@pytest.mark.slow
@pytest.mark.parametrize(("text", "speed"), [(BAR, 0.1), (UNSEEN, 1)])
def test_the_speed_is_that_of_what_is_seen(text: str, speed: float, browser: Any, tmp_path: Path) -> None:
    assert opened(browser, tmp_path, text).ask("page.speed") == speed


MIXED = """
coordinate Length s = 1 m; coordinate Length large = 200 m; coordinate Angle phi = 0.1 rad; coordinate Length still = 3 m;
kinetic 1/2*1 kg*(der(s)^2 + der(large)^2 + der(still)^2) + 1/2*1 kg.m^2*der(phi)^2;
potential 1/2*10 N/m*(s^2 + large^2) + 5 N.m*phi^2;
experiment(stop = 5 s);
"""


def test_curves_have_a_panel_for_each_unit_and_size(browser: Any, tmp_path: Path) -> None:
    tab = opened(browser, tmp_path, MIXED, viewport={"width": 1440, "height": 900})
    assert tab.ask("page.panels()") == [["s"], ["large"], ["phi"]]
    tab.tab.set_viewport_size({"width": 1440, "height": 560})  # in less height those of one unit go together
    tab.wait("page.panels().length === 2")
    assert tab.ask("page.panels()") == [["s", "large"], ["phi"]]


def test_a_curve_says_its_value_under_the_pointer(browser: Any, tmp_path: Path) -> None:
    tab = opened(
        browser,
        tmp_path,
        "coordinate x = 1 m; initial der(x) = 1 m/s; kinetic 1/2*1 kg*der(x)^2; experiment(stop = 4 s);",
    )
    box = tab.tab.query_selector("#plot").bounding_box()
    left, right = box["x"] + 58, box["x"] + box["width"] - 12
    tab.tab.mouse.move((left + right) / 2, box["y"] + box["height"] / 2)
    assert tab.ask("document.querySelector('.reading').textContent") == "x 3 m at 2 s"
    tab.tab.mouse.move(5, 5)
    assert tab.ask("document.querySelector('.reading').hidden")


SAMPLED = """
coordinate x = 0 m; discrete Force u = 0 N;
kinetic 1/2*1 kg*der(x)^2;
when sample({every}) then u := 1 N - 1 N/m*x; end when;
force u on x;
experiment(stop = 5 s);
"""


@pytest.mark.slow
def test_marks_of_events_are_no_comb(browser: Any, tmp_path: Path) -> None:
    """Pixels in the colour of events just above the axis of time."""
    count = """() => {
      const canvas = document.getElementById('plot'), c = canvas.getContext('2d'), {data} = c.getImageData(60, canvas.height - 40, canvas.width - 70, 1);
      let n = 0;
      for (let k = 0; k < data.length; k += 4) if (data[k] > 190 && data[k] - data[k + 2] > 60) n++;
      return n;
    }"""
    few = opened(browser, tmp_path, SAMPLED.format(every="0.5 s"), viewport={"width": 1440, "height": 900})
    assert few.ask(count) >= 9
    many = opened(browser, tmp_path, SAMPLED.format(every="10 ms"), viewport={"width": 1440, "height": 900})
    assert many.ask(count) == 0
    whens = "".join(
        f"when x > {at + 1e-5 * k:.5f} m then n := n + 1; end when;" for at in (1, 3) for k in range(100)
    )
    clustered = opened(browser, tmp_path, CLOSE + whens, viewport={"width": 1440, "height": 900})
    assert clustered.ask("page.run.events.length") > 150
    assert 2 <= clustered.ask(count) <= 12  # 200 events at two places


CLOSE = """
coordinate x = 0 m; initial der(x) = 1 m/s; discrete Integer n = 0;
kinetic 1/2*1 kg*der(x)^2;
experiment(stop = 5 s);
"""
TEXTS = """(() => {
  const found = {plot: [], phase: []}, draw = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
    const wide = this.measureText(text).width, share = {left: 0, center: 0.5, right: 1}[this.textAlign];
    found[this.canvas.id]?.push({text, left: x - share * wide, right: x + (1 - share) * wide, y, colour: this.fillStyle});
    draw.call(this, text, x, y);
  };
  document.getElementById('theme').click();
  CanvasRenderingContext2D.prototype.fillText = draw;
  return found;
})()"""
"""All that is written on the canvases."""


def numbers_left_of(texts: list[Any], edge: float) -> list[Any]:
    return [t for t in texts if re.fullmatch(r"[−0-9.e]+", t["text"]) and t["right"] < edge]


@pytest.mark.slow
@pytest.mark.parametrize("screen", [PHONE, {"width": 1440, "height": 900}], ids=["phone", "desk"])
def test_each_panel_has_two_numbers_with_a_minus_that_is_read(
    screen: Any, browser: Any, tmp_path: Path
) -> None:
    """Three ranges around zero in panels of least height, where steps of 5 would meet one number alone."""
    text = """coordinate Angle a = 0 rad; coordinate Length b = 0 m; coordinate Time c = 0 s;
    initial der(a) = {w} rad/s; initial der(b) = {w} m/s; initial der(c) = {w};
    kinetic 1/2*(1 kg.m^2*der(a)^2 + 1 kg*der(b)^2 + 1 J*der(c)^2);
    potential 1/2*(1 N.m*a^2 + 1 N/m*b^2 + 1 J/s^2*c^2);
    experiment(stop = 10 s);"""
    tab = opened(browser, tmp_path, text.format(w=4), viewport=screen)
    assert tab.ask("page.panels().length") == 3
    texts = tab.ask(TEXTS)
    beside = numbers_left_of(texts["plot"], 58)
    high = tab.ask("document.getElementById('plot').clientHeight") - 34
    for k in range(3):
        inside = [t for t in beside if high * k / 3 < t["y"] < high * (k + 1) / 3]
        assert len(inside) >= 2
        assert all(b["y"] - a["y"] > 11 for a, b in pairwise(sorted(inside, key=lambda t: t["y"])))
    assert not [t for t in texts["plot"] + texts["phase"] if re.match("-[0-9]", t["text"])]


@pytest.mark.slow
def test_what_is_constant_but_for_rounding_is_drawn_so(browser: Any, tmp_path: Path) -> None:
    """1e-9 of a velocity does not fill the panel, and numbers beside it differ."""
    text = """coordinate x = 0 m; initial der(x) = 0.7267 m/s; kinetic 1/2*1 kg*der(x)^2;
    force 1e-9 N*sin(20 rad/s*time) on x; experiment(stop = 5 s);"""
    tab = opened(browser, tmp_path, text)
    beside = [t for t in numbers_left_of(tab.ask(TEXTS)["phase"], 110) if t["text"].startswith("0.7")]
    assert len({t["text"] for t in beside}) == len(beside) >= 2
    assert all(t["left"] >= 0 for t in beside)
    values = [float(t["text"]) for t in beside]
    assert 1e-7 < max(values) - min(values) < 1e-5


@pytest.mark.slow
def test_the_cursor_strikes_no_name_and_texts_stay_in_their_plot(browser: Any, tmp_path: Path) -> None:
    tab = opened(browser, tmp_path, MIXED + SAMPLED_TOO, viewport={"width": 1440, "height": 900})
    wide = tab.ask("document.getElementById('plot').clientWidth")
    texts = tab.ask(TEXTS)["plot"]
    assert any("events" in t["text"] for t in texts)
    assert all(t["right"] <= wide - 1 for t in texts)
    assert all(t["right"] <= wide - 12 for t in texts if "events" in t["text"])
    at = wide / 2
    second = [t["y"] for t in texts if t["text"] in ("large / m", "φ / rad")]
    assert len(second) == 2
    tab.ask("page.go(2.5)")
    box = tab.tab.query_selector("#plot").bounding_box()
    left = tab.ask("document.querySelector('.marker').getBoundingClientRect().left")
    assert abs(left - box["x"] - at) < 40
    for y in second:
        name = {"x": left - 1, "y": box["y"] + y, "width": 3, "height": 12}
        curve = {"x": left - 1, "y": box["y"] + y + 22, "width": 3, "height": 12}
        assert len(tones(tab, name)) == 1 < len(tones(tab, curve))


SAMPLED_TOO = """
discrete Integer n = 0;
when sample(0.5 s) then n := n + 1; end when;
"""


def tones(tab: Opened, clip: dict[str, float]) -> set[bytes]:
    """Return the colours in a part of the screen."""
    seen = Image.open(io.BytesIO(tab.tab.screenshot(clip=clip))).convert("RGB").tobytes()
    return {seen[k : k + 3] for k in range(0, len(seen), 3)}


@pytest.mark.slow
def test_equations_fit_a_phone_and_can_be_closed(browser: Any, tmp_path: Path) -> None:
    path = tmp_path / "page.html"
    path.write_text(page(mechc.load(EXAMPLES / "double_pendulum.mech")))
    tab = Opened(browser, path, viewport=PHONE)
    tab.ask("document.getElementById('equations').click()")
    tab.wait("document.querySelectorAll('dialog math').length > 5")
    assert tab.ask("(d => d.scrollWidth <= d.clientWidth)(document.querySelector('dialog'))")
    assert tab.ask("getComputedStyle(document.querySelector('dialog .row')).overflowX") == "auto"
    tab.ask("document.querySelector('dialog .row').click()")
    assert tab.ask("document.querySelector('dialog').open")
    tab.tab.click("dialog .close")
    assert not tab.ask("document.querySelector('dialog').open")
    assert tab.said == []


@pytest.mark.slow
@pytest.mark.parametrize("example", ["stick_slip_belt", "double_pendulum"])
@pytest.mark.parametrize("screen", [PHONE, {"width": 1440, "height": 900}], ids=["phone", "desk"])
def test_equations_are_seen_whole(example: str, screen: Any, browser: Any, tmp_path: Path) -> None:
    """Formulas lie inside their rows, which do not scroll up or down, and the button that closes them lies over none of them."""
    path = tmp_path / "page.html"
    path.write_text(page(mechc.load(EXAMPLES / f"{example}.mech")))
    tab = Opened(browser, path, viewport=screen)
    tab.ask("document.getElementById('equations').click()")
    tab.wait("document.querySelectorAll('dialog math').length > 5")
    cut, covered = tab.ask("""(() => {
      const box = e => e.getBoundingClientRect(), close = box(document.querySelector('.close')), rows = [...document.querySelectorAll('dialog .row')];
      return [rows.flatMap(r => [...r.querySelectorAll('math *')].filter(m => box(m).top < box(r).top - 0.5 || box(m).bottom > box(r).bottom + 0.5)).length
          + rows.filter(r => r.scrollHeight > r.clientHeight).length,
        [...document.querySelectorAll('dialog math')].filter(m => box(m).right > close.left && box(m).top < close.bottom && box(m).bottom > close.top).length];
    })()""")
    assert (cut, covered) == (0, 0)


@pytest.mark.slow
def test_a_phone_held_wide_shows_the_scene_and_its_curves(browser: Any, tmp_path: Path) -> None:
    tab = opened(browser, tmp_path, CAR.format(side=10), viewport={"width": 844, "height": 390})
    scene, plot, bar = tab.ask(
        "['scene', 'plot', 'bar'].map(id => document.getElementById(id).getBoundingClientRect().toJSON())"
    )
    assert scene["height"] > 230 and plot["height"] > 230
    assert max(scene["bottom"], plot["bottom"], bar["bottom"]) <= 390
    for cell in tab.ask(
        "[...document.querySelectorAll('dl, dd')].map(e => [e.scrollWidth - e.clientWidth, e.getBoundingClientRect().right])"
    ):
        assert cell[0] <= 0 and cell[1] <= 844


SPACE = """
model Thrown
  coordinate Length r[3] = {{0, 0, 1}} m;
  initial der(r) = {{0.3, 0, 0}} m/s;
  kinetic 1/2*1 kg*dot(der(r), der(r));
  draw trail(r);
  draw sphere(5 cm) at r;
  experiment(stop = 2 s);
end Thrown;
""".replace("{{", "{").replace("}}", "}")


@pytest.mark.slow
def test_trails_in_space_follow_the_theme(browser: Any, tmp_path: Path) -> None:
    tab = opened(browser, tmp_path, SPACE, color_scheme="light")
    count = """async colour => {
      page.go(1.9); page.scene;
      const image = await new Promise(done => { document.getElementById('scene').querySelector('canvas').toBlob(done); page.go(1.9); }), at = await createImageBitmap(image);
      const c = new OffscreenCanvas(at.width, at.height).getContext('2d'); c.drawImage(at, 0, 0);
      const {data} = c.getImageData(0, 0, at.width, at.height);
      let n = 0;
      for (let k = 0; k < data.length; k += 4) if (data[k + 3] > 200 && [0, 1, 2].every(j => Math.abs(data[k + j] - colour[j]) < 12)) n++;
      return n;
    }"""
    light, dark = [0xC8, 0x55, 0x3D], [0xEF, 0x8A, 0x70]
    assert tab.ask(count, light) > 30 and tab.ask(count, dark) < 5
    tab.ask("document.getElementById('theme').click()")
    assert tab.ask(count, dark) > 30 and tab.ask(count, light) < 5


def test_a_top_stands_on_its_tip_and_precesses_about_the_vertical(browser: Any, tmp_path: Path) -> None:
    """A picture in space of a model in its own coordinates has z up: 0.5 rad off it, the top is above its tip, at l cos(theta)."""
    path = tmp_path / "page.html"
    path.write_text(page(mechc.load(EXAMPLES / "heavy_symmetric_top.mech")))
    tab = Opened(browser, path)
    theta = tab.columns()["theta"]
    tip = tab.ask("page.project([0, 0, 0]).y")
    for time in (0, 2.5, 5, 10):
        tab.ask(f"page.go({time})")
        x, y, z = tab.ask("Array.from(page.values(0).slice(0, 3))")
        assert min(theta) - 1e-6 <= math.acos(z / math.hypot(x, y, z)) <= max(theta) + 1e-6
        assert tip - tab.ask("p => page.project(p).y", [x, y, z]) > 50
    assert tab.said == []


FLOORS = {
    "planar": """import mech.planar.*; import mech.shapes.*;
    gravity {0, -9.81} m/s^2; Disk ball(r = 10 cm, m = 1 kg); Free flight(world -> ball.a, y = 10 cm, der(x) = 1 m/s);
    shape floor: Plane on world; shape Sphere(r = 10 cm) on ball; contact floor with ball friction 0.3;
    experiment(stop = 1 s);""",
    "spatial": """import mech.spatial.*; import mech.shapes.*;
    gravity {0, 0, -9.81} m/s^2; Body ball(m = 1 kg, com = {0, 0, 0} m, J = diag({1, 1, 1} kg.m^2)); Free flight(world -> ball.a, position = {0, 0, 0.5} m, der(position) = {1, 0, 0} m/s);
    shape floor: Plane on world at {0, 0, 5 cm}; shape Sphere(r = 10 cm) on ball; contact floor with ball friction 0.3;
    experiment(stop = 0.2 s);""",
}


def test_an_endless_plane_is_drawn_across_the_picture(browser: Any, tmp_path: Path) -> None:
    """Grey pixels of the line over the whole width; a floor in space lies where it is, not below what moves."""
    tab = opened(browser, tmp_path, FLOORS["planar"])
    count = """() => {
      const canvas = document.querySelector('#scene canvas'), {y, scale} = page.project([0, 0, 0]);
      const {data} = canvas.getContext('2d').getImageData(0, Math.round(y), canvas.width, 1);
      let n = 0;
      for (let k = 0; k < data.length; k += 4) if (Math.abs(data[k] - 128) < 60 && data[k] === data[k + 1] && data[k] === data[k + 2]) n++;
      return n / canvas.width;
    }"""
    tab.ask("page.go(0.5)")
    assert tab.ask(count) > 0.8
    space = opened(browser, tmp_path, FLOORS["spatial"])
    assert space.ask("motion(page.run, page.info.scene).box().floor") == pytest.approx(0.05)
    assert space.said == tab.said == []


MACHINE = """
structural parameter Integer n = 24;
parameter R = 40 m;
coordinate phi = 0 rad;
initial der(phi) = 0.2 rad/s;
kinetic 1/2*1000 kg*R^2*der(phi)^2;
for i in 1:n loop draw box({0.3, 0.2} m) at {R*sin(phi) + 0.1 m*i, R*cos(phi)}; end for;
draw sphere(10 cm) at {0 m, 0 m};
output Length place[2] = {R*sin(phi), R*cos(phi)};
experiment(stop = 10 s, display = "mm");
"""


def test_a_machine_of_many_shapes_is_followed_wherever_it_goes(browser: Any, tmp_path: Path) -> None:
    """24 boxes of 2.6 m together on a circle of 40 m: they fill a third of the picture; three of them, and no machine, are seen as a whole.
    Lengths of 80 m are in m, though the model asks for mm."""
    tab = opened(browser, tmp_path, MACHINE)
    assert tab.ask("page.follows()")
    for time in (0, 5, 10):
        tab.ask(f"page.go({time})")
        seen = tab.ask(
            "[0, 23].map(k => page.project(page.values(k).slice(0, 3)).x / document.getElementById('scene').clientWidth)"
        )
        assert 0.2 < seen[0] < seen[1] < 0.8 and seen[1] - seen[0] > 0.15
    assert {q["shown"] for q in tab.ask("page.info.outputs") if q["name"].startswith("place")} == {"m"}
    few = opened(browser, tmp_path, MACHINE.replace("n = 24", "n = 3"))
    assert few.ask("page.follows()") is None
    assert few.said == tab.said == []


def test_pins_are_open_and_masses_are_not(browser: Any, tmp_path: Path) -> None:
    """The middle of a pin has the colour of the page and that of a mass its own, before a face that is drawn later."""
    text = """coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2;
        draw disk() at {x, 0 m}; draw sphere() at {x + 1 m, 0 m};
        draw box({4, 2} m) at {x + 0.5 m, 0 m}, colour = "#00ff00"; experiment(stop = 1 s);"""
    tab = opened(browser, tmp_path, text)
    shot = Image.open(io.BytesIO(tab.tab.locator("#scene").screenshot())).convert("RGB")
    pin, mass, face = (
        shot.getpixel((round(place["x"]), round(place["y"])))
        for place in (tab.ask(f"page.project([page.values({k})[0], 0, 0])") for k in range(3))
    )
    assert pin == (255, 255, 255)
    assert mass not in (pin, face) and face not in (pin, mass)
    assert tab.said == []
