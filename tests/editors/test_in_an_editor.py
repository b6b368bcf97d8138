"""The packed extension in code-server, the build of Visual Studio Code for browsers, driven as by hand: hover, fix, rename.

Needs ``code-server`` (``npm install -g code-server``), chromium with Playwright, and ``npm install; npm run package`` in editors/vscode.
"""

from __future__ import annotations

import json
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from browsers import needs_browser, running_browser

ROOT = Path(__file__).resolve().parents[2]
PACKED = sorted((ROOT / "editors" / "vscode").glob("*.vsix"))
SERVER = shutil.which("code-server")
SETTINGS = {
    "mechc.path": str(Path(sys.executable).with_name("mechc")),
    "security.workspace.trust.enabled": False,
    "workbench.startupEditor": "none",
    "editor.minimap.enabled": False,
}
FILES = {
    "parts.mech": "model Rod\n  parameter Length size = 1 m;\nend Rod;\n",
    "one.mech": "import parts.*;\nmodel One\n  Rod rod;\n  coordinate x = rod.size;\n  kinetic 1/2*(1 kg)*der(x)^2;\n  output bad = rod.siz;\nend One;\n",
    "two.mech": "import parts.*;\nmodel Two\n  Rod rod(size = 2 m);\n  coordinate y = rod.size;\n  kinetic 1/2*(1 kg)*der(y)^2;\nend Two;\n",
}
PATIENCE = 60_000
"""Milliseconds until something has to be seen."""

pytestmark = [
    pytest.mark.slow,
    needs_browser,
    pytest.mark.skipif(SERVER is None, reason="needs code-server: npm install -g code-server"),
    pytest.mark.skipif(
        not PACKED, reason="needs the extension: npm install; npm run package in editors/vscode"
    ),
]


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    """Install the extension, open a folder in an editor, and give the address of its window."""
    assert SERVER is not None
    folder, data = tmp_path / "models", tmp_path / "data"
    (data / "User").mkdir(parents=True)
    (data / "User" / "settings.json").write_text(json.dumps(SETTINGS), encoding="utf-8")
    folder.mkdir()
    for name, text in FILES.items():
        (folder / name).write_text(text, encoding="utf-8")
    begin = [SERVER, "--extensions-dir", str(tmp_path / "extensions"), "--user-data-dir", str(data)]
    subprocess.run([*begin, "--install-extension", str(PACKED[-1])], check=True, capture_output=True)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    local = [
        "--auth",
        "none",
        "--bind-addr",
        f"127.0.0.1:{port}",
        "--disable-telemetry",
        "--disable-update-check",
    ]
    with subprocess.Popen(
        [*begin, *local, str(folder)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        until = time.monotonic() + 60
        while time.monotonic() < until:
            with socket.socket() as asked:
                if asked.connect_ex(("127.0.0.1", port)) == 0:
                    break
            time.sleep(0.2)
        yield f"http://127.0.0.1:{port}/?folder={folder}"
        process.terminate()


class Window:
    """The window of an editor, with the keys of its commands."""

    def __init__(self, page: Any, address: str) -> None:
        self.page = page
        page.goto(address, timeout=PATIENCE)
        page.wait_for_selector(".explorer-folders-view .monaco-list-row", timeout=PATIENCE)

    def press(self, *keys: str) -> None:
        for key in keys:
            self.page.keyboard.press(key)
            self.page.wait_for_timeout(1000)

    def write(self, text: str) -> None:
        self.page.keyboard.type(text, delay=20)
        self.page.wait_for_timeout(1500)

    def open(self, name: str) -> None:
        self.page.locator(".explorer-folders-view .monaco-list-row", has_text=name).first.dblclick()
        self.page.wait_for_selector(f".tab.active[data-resource-name='{name}']", timeout=PATIENCE)
        self.page.locator(".view-lines").first.click()

    def go(self, line: int, column: int) -> None:
        self.press("Control+g")
        self.write(f"{line}:{column}")
        self.press("Enter")

    def seen(self, selector: str, text: str) -> None:
        self.page.locator(selector, has_text=text).first.wait_for(timeout=PATIENCE)


def test_hover_fix_and_rename(address: str, tmp_path: Path) -> None:
    def texts() -> dict[str, str]:
        return {name: (tmp_path / "models" / name).read_text(encoding="utf-8") for name in FILES}

    for browser in running_browser():
        window = Window(browser.new_page(viewport={"width": 1400, "height": 800}), address)
        window.open("one.mech")
        window.page.wait_for_selector(".squiggly-error", timeout=PATIENCE)
        window.go(3, 4)
        window.press("Control+k", "Control+i")
        window.seen(".monaco-hover", "parameter Length size = 1 m")
        window.press("Escape")
        window.go(6, 21)
        window.press("Control+.")
        window.page.wait_for_timeout(5000)
        window.press("Enter", "Control+s")
        until = time.monotonic() + 30
        while "bad = rod.size;" not in texts()["one.mech"] and time.monotonic() < until:
            window.press("Control+s")
        assert texts()["one.mech"] == FILES["one.mech"].replace("rod.siz;", "rod.size;")
        window.go(4, 23)
        window.press("F2")
        window.page.wait_for_timeout(3000)
        window.press("Control+a")
        window.write("extent")
        window.press("Enter")
        window.page.wait_for_timeout(5000)
        window.press("F1")
        window.write("File: Save All")
        window.press("Enter")
        until = time.monotonic() + 30
        while "extent" not in texts()["two.mech"] and time.monotonic() < until:
            window.page.wait_for_timeout(500)
        fixed = {**FILES, "one.mech": FILES["one.mech"].replace("rod.siz;", "rod.size;")}
        assert texts() == {name: text.replace("size", "extent") for name, text in fixed.items()}
