"""A hand in the picture: what is taken follows the pointer, and the motion begins from there."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browsers import Opened, needs_browser, off

import mechc
from mechc.web.page import page

PENDULUM = """
model Pendulum
  coordinate Angle theta = 40 deg;
  gravity {0, -9.81} m/s^2;
  point bob = world * {0.8 m*sin(theta), -0.8 m*cos(theta)};
  mass 1 kg at bob;
  draw line(world, bob);
  draw sphere(5 cm) at bob;
  experiment(stop = 2 s, tolerance = 1e-10);
end Pendulum;
"""
LINKAGE = """
import mech.planar.*;
model Linkage "a four-bar linkage that swings; only the angle of its crank is given"
  gravity {0, -9.81} m/s^2;
  Bar crank(m = 1 kg, l = 0.3 m); Bar coupler(m = 1 kg, l = 0.7 m); Bar rocker(m = 1 kg, l = 0.5 m);
  Revolute a(world -> crank.a, angle = 60 deg);
  Revolute b(crank.b -> coupler.a, angle ~ -30 deg);
  Revolute c(world * trans({0.8 m, 0 m}) -> rocker.a, angle ~ 100 deg);
  Revolute d(coupler.b -> rocker.b);
  draw sphere(3 cm) on coupler.c;
  experiment(stop = 1 s, tolerance = 1e-10);
end Linkage;
"""
THROWN = """
import mech.spatial.*;
model Thrown
  gravity {0, 0, -9.81} m/s^2;
  Body body(m = 1 kg, J = 0.01*identity(3) kg.m^2);
  Free free(world -> body.a, position = {0, 0, 1} m);
  initial der(free.position) = {0, 0, 0} m/s;
  draw sphere(10 cm) on body.a;
  experiment(stop = 0.4 s, tolerance = 1e-10);
end Thrown;
"""


class Hand:
    """A pointer on the picture of a page, which takes shape ``k`` and moves it by pixels."""

    def __init__(self, browser: Any, path: Path, text: str, shape: int) -> None:
        self.model = mechc.loads(text)
        path.write_text(page(self.model))
        self.opened = Opened(browser, path)
        self.ask, self.tab = self.opened.ask, self.opened.tab
        self.ask("page.playing(false)")
        self.ask("page.go(0)")
        self.shape = shape
        box = self.tab.locator("#scene canvas").bounding_box()
        self.corner = np.array([box["x"], box["y"]])

    def seen(self) -> np.ndarray:
        place = self.ask(f"page.values({self.shape}).slice(0, 3)")
        found = self.ask(f"(({{x, y}}) => [x, y])(page.project({place}))")
        return np.array(found)

    def drag(self, *steps: tuple[float, float], wait: float = 400) -> np.ndarray:
        at = self.seen()
        self.tab.mouse.move(*(self.corner + at))
        self.tab.mouse.down()
        for step in steps:
            at = at + step
            self.tab.mouse.move(*(self.corner + at))
            self.tab.wait_for_timeout(20)
        self.tab.wait_for_timeout(wait)
        return at

    def throw(self, at: np.ndarray, step: float, count: int) -> None:
        """Move on to the right in steps of 20 ms, by events of the page itself: those of a pointer wait for a busy machine."""
        x, y = at + self.corner
        self.tab.evaluate(f"""async () => {{
          const canvas = document.querySelector('#scene canvas');
          const send = (type, x) => canvas.dispatchEvent(new PointerEvent(type, {{clientX: x, clientY: {y}, pointerId: 1, bubbles: true}}));
          const begun = performance.now();
          for (let k = 1; k <= {count}; k++) {{ while (performance.now() < begun + 20 * k); send('pointermove', {x} + {step} * k); }}
          send('pointerup', {x} + {step} * {count});
        }}""")
        self.let_go()

    def let_go(self) -> None:
        self.tab.mouse.up()
        self.opened.wait("page.idle()")


@needs_browser
def test_a_bob_follows_along_its_circle(browser: Any, tmp_path: Path) -> None:
    hand = Hand(browser, tmp_path / "pendulum.html", PENDULUM, 1)
    pivot = np.array(hand.ask("(({x, y}) => [x, y])(page.project([0, 0, 0]))"))
    at = hand.drag((10, -10), (30, -30), (30, -40))
    right, down = at - pivot
    wanted = math.atan2(right, down)
    assert hand.ask("page.run.y0[0]") == pytest.approx(wanted, abs=1e-6)
    hand.let_go()
    theta = hand.ask("page.sliders.find(s => s.name === 'theta').value")
    assert theta == pytest.approx(wanted, abs=1e-6)
    native = hand.model.simulate(set={"theta": theta, "der(theta)": hand.ask("page.run.y0[1]")})
    assert off(hand.opened, native) < 1e-9
    assert hand.opened.said == []


@needs_browser
def test_a_linkage_is_put_together_as_the_command_does(browser: Any, tmp_path: Path) -> None:
    hand = Hand(browser, tmp_path / "linkage.html", LINKAGE, -1)
    names = [s["kind"] for s in hand.ask("page.shapes")]
    hand.shape = len(names) - 1 - names[::-1].index("sphere")
    before = hand.seen()
    at = hand.drag((4, 3), (10, 8))
    # nearer to the pointer than anywhere else along its path
    angle = hand.ask("page.sliders.find(s => s.name === 'a.angle').value")
    found = np.linalg.norm(hand.seen() - at)
    assert found < np.linalg.norm(before - at)
    start = hand.model.simulate(set={"a.angle": angle}, stop=0.0, estimate_error=False)
    y0 = hand.ask("Array.from(page.run.y0)")
    for k, q in enumerate(start.problem.states):
        if q.kind == "coordinate":
            assert y0[k] == pytest.approx(start[q.name][0], abs=1e-9), q.name
    hand.let_go()


@needs_browser
def test_a_body_in_space_follows_and_is_thrown(browser: Any, tmp_path: Path) -> None:
    hand = Hand(browser, tmp_path / "thrown.html", THROWN, -1)
    hand.shape = [s["kind"] for s in hand.ask("page.shapes")].index("sphere")
    at = hand.drag((10, -10), (20, -5), wait=300)
    assert np.abs(hand.seen() - at).max() < 0.5
    assert hand.ask("Array.from(page.run.y0).slice(7, 13).every(v => v === 0)")
    hand.throw(at, 12, 6)
    rates = np.array(hand.ask("page.sliders.filter(s => s.name.startsWith('der(')).map(s => s.value)"))
    scale = hand.ask(f"page.project(page.values({hand.shape}).slice(0, 3)).scale")
    # pixels in a second, by timers of the browser
    assert np.linalg.norm(rates) * scale == pytest.approx(12 / 0.02, rel=0.5)
    assert hand.opened.said == []


HUNG = """
import mech.spatial.*;
model Hung "a bob on a ball joint: only a rotation moves it"
  gravity {0, 0, -9.81} m/s^2;
  Body body(m = 1 kg, J = 0.01*identity(3) kg.m^2, com = {0.6, 0, 0} m);
  Spherical ball(world -> body.a);
  initial ball.orientation = axis_angle({0, 1, 0}, 30 deg);
  initial der(ball.orientation) = {0, 0, 0} rad/s;
  draw sphere(5 cm) at body.a*body.com;
  experiment(stop = 1 s, tolerance = 1e-10);
end Hung;
"""


@needs_browser
def test_a_body_that_a_rotation_moves_turns_and_is_thrown(browser: Any, tmp_path: Path) -> None:
    hand = Hand(browser, tmp_path / "hung.html", HUNG, -1)
    hand.shape = [k for k, s in enumerate(hand.ask("page.shapes")) if s["kind"] == "sphere"][-1]
    at = hand.drag((8, -10), (20, -15), wait=300)
    assert np.abs(hand.seen() - at).max() < 0.5
    y0 = np.array(hand.ask("Array.from(page.run.y0)"))
    assert np.linalg.norm(y0[:4]) == pytest.approx(1, abs=1e-12) and not y0[4:7].any()
    bob = np.array(hand.ask(f"page.values({hand.shape}).slice(0, 3)"))
    w, x, y, z = y0[:4]
    first = 0.6 * np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    assert bob == pytest.approx(first, abs=1e-9)  # at the start, on its sphere
    hand.throw(at, 12, 6)
    y0 = np.array(hand.ask("Array.from(page.run.y0)"))
    hand.ask("page.playing(false)")
    hand.ask("page.go(0)")
    scale = hand.ask(f"page.project(page.values({hand.shape}).slice(0, 3)).scale")
    ratio = 0.6 * np.linalg.norm(y0[4:7]) * scale / (12 / 0.02)
    assert 0.2 < ratio < 5  # pixels in a second, by timers of the browser, along the picture and towards it
    assert abs(y0[4]) < 1e-3 * np.linalg.norm(y0[4:7])  # about its own axis the bob is not turned
    native = hand.model.simulate(
        set={"ball.orientation": y0[:4].tolist(), "der(ball.orientation)": y0[4:7].tolist()}
    )
    assert off(hand.opened, native) < 1e-8
    hand.ask("page.integrate(false)")
    hand.tab.wait_for_timeout(500)
    assert hand.ask("Array.from(page.run.y0)") == pytest.approx(y0.tolist(), abs=1e-12)  # a slider leaves it
    assert "ball.orientation" in hand.ask("location.hash")
    assert hand.opened.said == []


TOSSED = """
model Tossed "a box that turns about its centre, which is drawn there"
  coordinate Rotation R;
  initial der(R) = {0, 0, 0.5} rad/s;
  frame body = world * R;
  inertia diag({1, 2, 3} kg.m^2) on body;
  draw box(size = {60 cm, 40 cm, 20 cm}) on body;
  experiment(stop = 1 s, tolerance = 1e-10);
end Tossed;
"""


@needs_browser
def test_a_box_about_its_centre_is_turned_by_a_corner(browser: Any, tmp_path: Path) -> None:
    hand = Hand(browser, tmp_path / "tossed.html", TOSSED, 0)
    corner = "(v => [0, 1, 2].map(k => v[k] + 0.3*v[3 + k] - 0.2*v[6 + k] + 0.1*v[9 + k]))(page.values(0))"
    hand.seen = lambda: np.array(hand.ask(f"(({{x, y}}) => [x, y])(page.project({corner}))"))  # type: ignore[method-assign]
    before = hand.seen()
    at = hand.drag((6, -8), (10, -12), wait=300)
    assert np.abs(hand.seen() - at).max() < 0.5 and np.abs(hand.seen() - before).max() > 10
    hand.let_go()
    y0 = np.array(hand.ask("Array.from(page.run.y0)"))
    assert np.linalg.norm(y0[:4]) == pytest.approx(1, abs=1e-12)
    native = hand.model.simulate(set={"R": y0[:4].tolist(), "der(R)": y0[4:7].tolist()})
    assert off(hand.opened, native) < 1e-8
    assert hand.opened.said == []
