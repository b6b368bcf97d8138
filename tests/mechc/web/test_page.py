"""Pages: what they hold, and, in a real browser where there is one, that they move and agree with native runs."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browsers import Opened, needs_browser, needs_zig, off, running_browser

import mechc
from mechc.cli.main import run
from mechc.web.page import page

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


def test_a_recorded_page_needs_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mechc.web.assembly.has_zig", lambda: False)
    text = page(mechc.loads(BALL), recorded=True)
    assert not re.search(r"(src|href)=[\"']?(https?:)?//", text)
    assert "&quot;" not in re.search(r"<title>(.*)</title>", text)[1]  # type: ignore[index]
    assert "sliders are there where it is written" in text


def test_what_is_there_is_not_written_over(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model, other = tmp_path / "ball.mech", tmp_path / "notes.html"
    model.write_text(BALL)
    other.write_text("my notes")
    assert run(["compile", str(model), "--target", "web", "--recorded", "-o", str(other)]) == 2
    assert "which is no page of mechc" in capsys.readouterr().err
    assert other.read_text() == "my notes"
    fresh = tmp_path / "ball.html"
    for _ in range(2):  # a page is written over
        assert run(["compile", str(model), "--target", "web", "--recorded", "-o", str(fresh)]) == 0
    assert run(["compile", str(model), "--target", "web", "-o", str(tmp_path / "ball.txt")]) == 2


def test_no_browser_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "ball.mech"
    model.write_text(BALL)
    monkeypatch.setattr("webbrowser.open", lambda url: False)
    assert run(["view", str(model), "--recorded", "-o", str(tmp_path / "b.html")]) == 0
    assert "no browser was found here" in capsys.readouterr().err


# ---------------------------------------------------------------- in a browser


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    yield from running_browser()


@needs_zig
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


@pytest.mark.slow
@needs_browser
def test_a_recorded_page_moves_on_a_phone(browser: Any, tmp_path: Path) -> None:
    path = tmp_path / "ball.html"
    path.write_text(page(mechc.loads(BALL), recorded=True))
    opened = Opened(browser, path, viewport={"width": 360, "height": 640})
    assert opened.ask("document.documentElement.scrollWidth") <= 360
    assert opened.ask("document.querySelectorAll('fieldset:not([hidden])').length") == 0
    drift = mechc.loads(BALL).simulate().accuracy.energy
    assert drift is not None and opened.ask("page.energy.worst") == drift.absolute, (
        "not that of rounded numbers"
    )
    before = opened.ask("page.values(0)[0]")
    opened.tab.keyboard.press("End")
    assert opened.ask("page.values(0)[0]") > before + 0.5
    assert opened.said == []
