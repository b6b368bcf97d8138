"""Pages: what they hold, and, in a real browser where there is one, that they move and agree with native runs."""

from __future__ import annotations

import csv
import importlib.util
import io
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.cli.main import run
from mechc.web.assembly import has_zig
from mechc.web.page import page

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

needs_zig = pytest.mark.skipif(not has_zig(), reason="live pages are built by zig: pip install ziglang")
needs_browser = pytest.mark.skipif(
    BROWSER is None or importlib.util.find_spec("playwright") is None,
    reason="needs chromium, and pip install playwright",
)

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
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        flags = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        browser = playwright.chromium.launch(executable_path=BROWSER, args=flags)
        yield browser
        browser.close()


class Opened:
    """A page in the browser, with all that it has said and asked for."""

    def __init__(self, browser: Any, path: Path, hash: str = "", **options: Any) -> None:
        self.tab = browser.new_page(**({"viewport": {"width": 1100, "height": 760}} | options))
        self.said: list[str] = []
        self.tab.on("console", lambda message: self.said.append(message.text))
        self.tab.on("pageerror", lambda error: self.said.append(str(error)))
        self.tab.on("request", lambda request: self._request(request.url))
        self.tab.goto(path.as_uri() + hash)
        self.wait("window.page && window.page.ready")
        self.tab.evaluate("page.playing(false)")

    def wait(self, condition: str) -> None:
        for _ in range(600):
            if self.tab.evaluate(condition):
                return
            self.tab.wait_for_timeout(50)
        pytest.fail(f"waited in vain for {condition}: {self.said}")

    def _request(self, url: str) -> None:
        if not url.startswith(("file:", "blob:", "data:")):
            self.said.append(f"asks for {url}")

    def ask(self, expression: str, argument: Any = None) -> Any:
        return self.tab.evaluate(expression, argument)

    def set(self, name: str, value: float) -> None:
        """Move a slider, and wait for the run."""
        before = self.ask("page.runs")
        self.ask(
            "([n, v]) => { const e = document.getElementById('s-' + n); e.value = v;"
            " e.dispatchEvent(new Event('input')); e.dispatchEvent(new Event('change')); }",
            [name, value],
        )
        self.wait(f"page.runs > {before}")
        self.tab.wait_for_timeout(150)  # the run that the end of the drag asks for

    def columns(self) -> dict[str, np.ndarray[Any, Any]]:
        """Return the CSV that the page gives, by name without unit."""
        rows = list(csv.reader(io.StringIO(self.ask("page.csv()"))))
        table = np.array([[float(x) for x in row] for row in rows[1:]])
        return {name.split(" [")[0]: table[:, k] for k, name in enumerate(rows[0])}


def off(opened: Opened, solution: mechc.Solution, until: float = np.inf) -> float:
    """Return the largest difference of coordinates, rates and states, over nominal + |value|."""
    found = opened.columns()
    times = found["time"]
    kept = times <= until
    native, nominal = solution(times[kept]), opened.ask("page.info.nominal")
    return max(
        float((np.abs(found[q.name][kept] - native[q.name]) / (size + np.abs(native[q.name]))).max())
        for q, size in zip(solution.problem.states, nominal, strict=True)
        if q.kind != "account"
    )


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
    before = opened.ask("page.values(0)[0]")
    opened.tab.keyboard.press("End")
    assert opened.ask("page.values(0)[0]") > before + 0.5
    assert opened.said == []


HARD = {
    "double_pendulum": 1e-9,
    "stewart_platform": 1e-9,
    "bouncing_ball": 1e-7,
    "kepler": 1e-9,
    "slider_crank_friction": 1e-7,
    "billiard_stadium": 1e-7,
}


@pytest.mark.slow
@needs_zig
@needs_browser
@pytest.mark.parametrize("name", HARD)
def test_examples_agree_with_native_runs(name: str, browser: Any, tmp_path: Path) -> None:
    """As far as two native runs at different tolerances agree that well; what is chaotic is compared up to there."""
    model = mechc.load(EXAMPLES / f"{name}.mech")
    path = tmp_path / f"{name}.html"
    path.write_text(page(model))
    opened = Opened(browser, path)
    solution = model.simulate()
    assert opened.said == []
    end = float(solution.time[-1])
    other = model.simulate(tolerance=solution_tolerance(opened) / 10)
    trusted = [t for t in np.linspace(0, end, 21)[1:] if off(opened, other, t) < 1e4 * HARD[name]]
    assert trusted, "nothing is compared"
    # where stability bounds the steps, rounding steers their lengths: two native builds differ likewise
    exactly = model.simulate(reproducible=True)
    rounding = abs(off(opened, exactly, max(trusted)) - off(opened, solution, max(trusted)))
    assert off(opened, solution, max(trusted)) < HARD[name] + 4 * rounding


def solution_tolerance(opened: Opened) -> float:
    found: float = opened.ask("page.info.tolerance")
    return found
