"""Pages in a real browser: chromium without a window, by Playwright, where both are there."""

from __future__ import annotations

import bisect
import csv
import importlib.util
import io
import json
import shutil
from collections import defaultdict
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
        """Move a slider, let it go, and wait for the runs."""
        self.ask(
            "([n, v]) => { const e = document.getElementById('s-' + n); e.value = v;"
            " e.dispatchEvent(new Event('input')); e.dispatchEvent(new Event('change')); }",
            [name, value],
        )
        self.wait("page.idle()")

    def columns(self) -> dict[str, np.ndarray[Any, Any]]:
        """Return the CSV that the page gives, by name without unit."""
        rows = list(csv.reader(io.StringIO(self.ask("page.csv()"))))
        table = np.array([[float(x) for x in row] for row in rows[1:]])
        return {name.split(" [")[0]: table[:, k] for k, name in enumerate(rows[0])}


def traced(browser: Any, opened: Opened, expression: str, argument: Any) -> tuple[Any, dict[str, Any]]:
    """Return the answer of a script that sets marks 'move', and what was spent between them (``per_move``)."""
    browser.start_tracing(
        page=opened.tab, categories=["toplevel", "blink.user_timing", "devtools.timeline", "__metadata"]
    )
    answer = opened.ask(expression, argument)
    return answer, per_move(json.loads(browser.stop_tracing())["traceEvents"])


def per_move(events: list[dict[str, Any]]) -> dict[str, np.ndarray[Any, Any]]:
    """Return milliseconds of processor time between the marks: scripts of page and worker, and the rest of the page's thread."""
    threads = {(e["pid"], e["tid"]): e["args"]["name"] for e in events if e.get("name") == "thread_name"}
    edges = sorted(e["ts"] for e in events if e.get("name") == "move" and e.get("ph") in ("R", "I", "i"))
    found: dict[str, Any] = defaultdict(lambda: np.zeros(len(edges) - 1))
    for (pid, tid), thread in threads.items():
        if thread not in ("CrRendererMain", "DedicatedWorker thread"):
            continue
        own = [e for e in events if (e["pid"], e["tid"], e.get("ph")) == (pid, tid, "X") and "tdur" in e]
        ends = 0.0
        for e in sorted((e for e in own if e["name"] == "FunctionCall"), key=lambda e: e["ts"]):
            move = bisect.bisect_right(edges, e["ts"]) - 1
            if e["ts"] >= ends and 0 <= move < len(edges) - 1:  # of calls within each other the outer one
                ends = e["ts"] + e["dur"]
                found["page" if thread == "CrRendererMain" else "worker"][move] += e["tdur"] / 1000
        for e in own:
            move = bisect.bisect_right(edges, e["ts"]) - 1
            if e["name"].endswith("RunTask") and thread == "CrRendererMain" and 0 <= move < len(edges) - 1:
                found["thread of the page"][move] += e["tdur"] / 1000
    return found


def off(opened: Opened, solution: mechc.Solution, until: float = np.inf) -> float:
    """Return the largest difference of coordinates, rates and states between events, over nominal + |value|."""
    found = opened.columns()
    times = found["time"]
    same = np.diff(times) == 0
    kept = (times <= until) & ~np.append(same, False) & ~np.append(False, same)
    native, nominal = solution(times[kept]), opened.ask("Array.from(page.run.nominal)")
    return max(
        float((np.abs(found[q.name][kept] - native[q.name]) / (size + np.abs(native[q.name]))).max())
        for q, size in zip(solution.problem.states, nominal, strict=True)
        if q.kind != "account"
    )
