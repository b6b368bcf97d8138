"""Pictures in space where no graphics card draws them, as in this browser: what a frame costs, and that it is right."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browsers import Opened, needs_browser, running_browser
from PIL import Image

import mechc
from mechc.web.page import page

pytestmark = needs_browser


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    yield from running_browser()


def opened(browser: Any, folder: Path, *drawn: str) -> Opened:
    """Open the page of a model that holds still what is drawn, and moves what is drawn at x."""
    path = folder / "page.html"
    path.write_text(
        page(
            mechc.loads(
                "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2;" + "".join(drawn) + "experiment(stop = 1 s);"
            )
        )
    )
    return Opened(browser, path)


def picture(tab: Opened) -> Any:
    """Return the pixels of the picture that stands, as floats, by row and column."""
    tab.wait(SIZE + "[0] === 2 * document.getElementById('scene').clientWidth")
    shot = Image.open(io.BytesIO(tab.tab.locator("#scene").screenshot())).convert("RGB")
    return np.asarray(shot, dtype=float)


SIZE = "[document.querySelector('#scene canvas').width]"
COUNTED = """(() => {
  const kind = WebGL2RenderingContext.prototype, found = [0, 0], own = {};
  for (const [name, count, instances] of [['drawElements', 1], ['drawElementsInstanced', 1, 4], ['drawArraysInstanced', 2, 3]]) {
    own[name] = kind[name];
    kind[name] = function (...given) {
      const times = given[instances] ?? 1;
      found[0] += times; found[1] += times * given[count] / 3;
      return own[name].apply(this, given);
    };
  }
  page.go(0.5);
  Object.assign(kind, own);
  return found;
})()"""
"""Calls and instances, of which each begins anew where the processor draws, and triangles of a frame."""


@pytest.mark.parametrize(
    ("shape", "most"),
    [("sphere(1 cm)", 2), ("box({1, 1, 1} cm)", 12), ("cylinder(2 mm, 2 cm)", 48)],
)
def test_a_crowd_is_drawn_at_once(shape: str, most: int, browser: Any, tmp_path: Path) -> None:
    """Solids, their shadows and lines are three calls; far from the eye solids have few triangles."""
    tab = opened(
        browser,
        tmp_path,
        f"for i in 1:150 loop draw {shape} at {{x + 0.2 m*mod(i, 15), 0 m, 0.2 m*floor(i/15)}}; end for;",
    )
    calls, triangles = tab.ask(COUNTED)
    assert calls <= 3
    assert triangles <= 2 * 150 * most + 400  # and those of the floor
    assert tab.said == []


def test_a_picture_that_stands_has_more_pixels(browser: Any, tmp_path: Path) -> None:
    """While it moves it has at most those of the screen, fewer where frames are late."""
    tab = opened(browser, tmp_path, "draw box({1, 1, 1} m) at {x, 0 m, 0 m};")
    wide = tab.ask("document.getElementById('scene').clientWidth")
    tab.wait(f"{SIZE}[0] === {2 * wide}")
    moved = tab.ask(
        f"""new Promise(done => {{ let n = 0; const f = () => {{ page.go(n / 99); n++ < 9 ? requestAnimationFrame(f) : done({SIZE}[0]); }}; f(); }})"""
    )
    assert 0.59 * wide < moved <= wide
    late = tab.ask(
        f"""new Promise(done => {{ let n = 0; const f = () => {{ page.go(n / 99); n++ < 60 ? setTimeout(f, 40) : done({SIZE}[0]); }}; f(); }})"""
    )
    assert late == round(0.6 * wide)
    tab.wait(f"{SIZE}[0] === {2 * wide}")
    assert tab.said == []


def test_a_ball_is_as_large_as_seen_from_there(browser: Any, tmp_path: Path) -> None:
    """A ball of radius r at a distance d is a circle of the tangent of asin(r/d), and hides what is in it."""
    tab = opened(
        browser,
        tmp_path,
        'draw sphere(50 cm) at {0 m, 0 m, 0 m}, colour =  "#ff0000";'
        'draw cylinder(10 cm, 80 cm) at {0 m, 0 m, 0 m}, colour =  "#00ff00";'
        "draw sphere(1 mm) at {x, 0 m, 0 m};",
    )
    pixels = picture(tab)
    red = (pixels[..., 0] > 2 * pixels[..., 1]) & (pixels[..., 0] > 2 * pixels[..., 2])
    place = tab.ask("page.project([0, 0, 0])")
    far = pixels.shape[0] / 2 / math.tan(0.35)
    deep = far / place["scale"]
    rows, columns = np.nonzero(red)
    seen = far * 0.5 / math.sqrt(deep**2 - 0.25)
    assert columns.max() - columns.min() + 1 == pytest.approx(2 * seen, abs=2)
    assert len(rows) == pytest.approx(math.pi * seen**2, rel=0.02)
    green = (pixels[..., 1] > 2 * pixels[..., 0]) & (pixels[..., 1] > 2 * pixels[..., 2])
    assert not green.any()
    assert tab.said == []
