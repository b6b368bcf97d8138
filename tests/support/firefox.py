"""Firefox without a window, by its own protocol (Marionette: texts of JSON after their length); as much of it as pages are asked."""

from __future__ import annotations

import base64
import json
import os
import re
import shutil
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

FIREFOX = shutil.which("firefox") or shutil.which("firefox-esr")
SETTINGS = {
    "marionette.port": 0,  # a free one, which it writes into its folder
    "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "toolkit.telemetry.reportingpolicy.firstRun": False,
    "app.update.disabledForTesting": True,
    "webgl.force-enabled": True,
}
KEYS = {"Tab": "\ue004", "Enter": "\ue007", "Escape": "\ue00c", "ArrowDown": "\ue015", "ArrowUp": "\ue013"}
needs_firefox = pytest.mark.skipif(FIREFOX is None, reason="needs Firefox")
FUNCTION = re.compile(r"\s*(\([^()]*\)|\w+)\s*=>")

ASK = """
const [ask, argument, done] = arguments, script = document.createElement('script'), root = document.documentElement;
root.dataset.argument = JSON.stringify(argument);
script.textContent = `{
  const root = document.documentElement, give = (key, value) => { root.dataset[key] = value; root.dispatchEvent(new Event('answered')); };
  new Promise(good => good((${ask})(JSON.parse(root.dataset.argument)))).then(
    value => give('found', JSON.stringify(value ?? null)), error => give('failed', String(error)));
}`;
delete root.dataset.found; delete root.dataset.failed;
root.addEventListener('answered', () => done([root.dataset.found ?? null, root.dataset.failed ?? null]), {once: true});
document.body.append(script); script.remove();
"""
"""Asks in the world of the page, whose own names are not seen from outside, without the ``eval`` that pages forbid."""


class Firefox:
    """A running browser; a page in it is a tab as Playwright's are, as far as tests ask."""

    def __init__(self, folder: Path) -> None:
        assert FIREFOX is not None
        lines = [f"user_pref({json.dumps(name)}, {json.dumps(value)});\n" for name, value in SETTINGS.items()]
        (folder / "user.js").write_text("".join(lines))
        # which has no WebGL: xvfb-run brings a display
        shown = [] if os.environ.get("DISPLAY") else ["--headless"]
        command = [FIREFOX, *shown, "--no-remote", "--marionette", "--profile", str(folder)]
        self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        port = folder / "MarionetteActivePort"
        for _ in range(1200):
            if port.exists() and port.read_text():
                break
            time.sleep(0.05)
        self._socket = socket.create_connection(("127.0.0.1", int(port.read_text())), timeout=120)
        self._received = b""
        self._read()  # who it is
        self._count = 0
        self.call("WebDriver:NewSession", capabilities={"alwaysMatch": {"acceptInsecureCerts": True}})
        self.call("WebDriver:SetTimeouts", script=60_000, pageLoad=120_000)

    def _read(self) -> Any:
        while b":" not in self._received:
            self._received += self._socket.recv(1 << 20)
        size, _, rest = self._received.partition(b":")
        while len(rest) < int(size):
            rest += self._socket.recv(1 << 20)
        self._received = rest[int(size) :]
        return json.loads(rest[: int(size)])

    def call(self, name: str, **given: Any) -> Any:
        self._count += 1
        text = json.dumps([0, self._count, name, given]).encode()
        self._socket.sendall(b"%d:%s" % (len(text), text))
        _, _, error, found = self._read()
        if error is not None:
            raise RuntimeError(f"{name}: {error['message']}")
        return found

    def new_page(self, viewport: dict[str, int] | None = None, **_: Any) -> FirefoxTab:
        return FirefoxTab(self, viewport or {"width": 1280, "height": 800})

    def close(self) -> None:
        with suppress(OSError, RuntimeError, ValueError):
            self.call("Marionette:Quit", flags=["eForceQuit"])
        self._socket.close()
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()


class FirefoxTab:
    def __init__(self, browser: Firefox, viewport: dict[str, int]) -> None:
        self.browser = browser
        self.handle = browser.call("WebDriver:NewWindow", type="window")["handle"]
        self.keyboard = self
        self.browser.call("WebDriver:SwitchToWindow", handle=self.handle)
        for _ in range(2):  # the window is larger than what it shows
            rect = browser.call("WebDriver:GetWindowRect")
            inner = self._run("return [innerWidth, innerHeight]")
            width, height = rect["width"] - inner[0], rect["height"] - inner[1]
            browser.call(
                "WebDriver:SetWindowRect",
                width=viewport["width"] + width,
                height=viewport["height"] + height,
            )

    def _run(self, script: str, *arguments: Any) -> Any:
        self.browser.call("WebDriver:SwitchToWindow", handle=self.handle)
        return self.browser.call("WebDriver:ExecuteScript", script=script, args=list(arguments))["value"]

    def on(self, event: str, told: Callable[[Any], None]) -> None:
        """Tell nothing: what a page says on its console is asked of Chromium."""

    def goto(self, address: str) -> None:
        self.browser.call("WebDriver:SwitchToWindow", handle=self.handle)
        self.browser.call("WebDriver:Navigate", url=address)

    def evaluate(self, expression: str, argument: Any = None) -> Any:
        self.browser.call("WebDriver:SwitchToWindow", handle=self.handle)
        asked = expression if FUNCTION.match(expression) else f"() => ({expression})"
        found, failed = self.browser.call("WebDriver:ExecuteAsyncScript", script=ASK, args=[asked, argument])[
            "value"
        ]
        if failed is not None:
            raise RuntimeError(failed)
        return json.loads(found)

    def wait_for_timeout(self, milliseconds: float) -> None:
        time.sleep(milliseconds / 1000)

    def insert_text(self, text: str) -> None:
        self._run("document.execCommand('insertText', false, arguments[0])", text)

    def type(self, text: str) -> None:
        keys = [{"type": kind, "value": key} for key in text for kind in ("keyDown", "keyUp")]
        self.browser.call("WebDriver:SwitchToWindow", handle=self.handle)
        self.browser.call(
            "WebDriver:PerformActions", actions=[{"type": "key", "id": "keys", "actions": keys}]
        )

    def press(self, key: str) -> None:
        self.type(KEYS[key])

    def screenshot(self, path: str | Path) -> None:
        self.browser.call("WebDriver:SwitchToWindow", handle=self.handle)
        shown = self.browser.call("WebDriver:TakeScreenshot", full=False)["value"]
        Path(path).write_bytes(base64.b64decode(shown))

    def close(self) -> None:
        self.browser.call("WebDriver:SwitchToWindow", handle=self.handle)
        self.browser.call("WebDriver:CloseWindow")


def running_firefox() -> Iterator[Firefox]:
    """Yield a browser, and close it."""
    with TemporaryDirectory() as folder:
        browser = Firefox(Path(folder))
        try:
            yield browser
        finally:
            browser.close()
