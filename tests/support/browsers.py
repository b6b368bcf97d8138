"""Pages in a real browser: chromium without a window, by Playwright, where both are there."""

from __future__ import annotations

import csv
import importlib.util
import io
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = (
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--js-flags=--expose-gc",
    "--enable-precise-memory-info",
)

needs_browser = pytest.mark.skipif(
    BROWSER is None or importlib.util.find_spec("playwright") is None,
    reason="needs chromium, and pip install playwright",
)


def running_browser() -> Iterator[Any]:
    """Yield a browser, and close it."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=[*FLAGS])
        yield browser
        browser.close()


def waited(tab: Any, condition: str, said: list[str] | None = None) -> None:
    """Wait until an expression is true; the browser's own way to would need ``eval``, which pages forbid."""
    for _ in range(600):
        if tab.evaluate(condition):
            return
        tab.wait_for_timeout(50)
    pytest.fail(f"waited in vain for {condition}: {said}")


class Opened:
    """A page in the browser, with all that it has said and asked for."""

    def __init__(self, browser: Any, path: Path, hash: str = "", **options: Any) -> None:
        self.path = path
        self.tab = browser.new_page(**({"viewport": {"width": 1100, "height": 760}} | options))
        self.said: list[str] = []
        self.tab.on("console", lambda message: self.said.append(message.text))
        self.tab.on("pageerror", lambda error: self.said.append(str(error)))
        self.tab.on("request", lambda request: self._request(request.url))
        self.tab.goto(path.as_uri() + hash)
        self.wait("window.page && window.page.ready")
        self.tab.evaluate("page.playing(false)")

    def wait(self, condition: str) -> None:
        waited(self.tab, condition, self.said)

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
    """Return the largest difference of coordinates, rates and states between events, over nominal + |value|."""
    found = opened.columns()
    times = found["time"]
    same = np.diff(times) == 0
    kept = (times <= until) & ~np.append(same, False) & ~np.append(False, same)
    native, nominal = solution(times[kept]), opened.ask("page.info.nominal")
    return max(
        float((np.abs(found[q.name][kept] - native[q.name]) / (size + np.abs(native[q.name]))).max())
        for q, size in zip(solution.problem.states, nominal, strict=True)
        if q.kind != "account"
    )
