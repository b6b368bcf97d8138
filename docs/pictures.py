"""Make the pictures of the tutorial by following it: ``python docs/pictures.py``; ``make gallery`` does it, too.

The page that its last step writes, and that of the double pendulum, are photographed where chromium and playwright are there, and otherwise
left as they are.
"""

from __future__ import annotations

import contextlib
import importlib.util
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
PAGE = HERE / "tutorial.md"
KEPT = HERE / "tutorial"
LIVE = "swing_page.png"
"""The picture of the page; all others are written by commands."""
EXAMPLE = HERE.parent / "examples" / "double_pendulum.mech"
OF_EXAMPLE = HERE / "gallery" / "page_double_pendulum.png"
BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

sys.path.insert(0, str(HERE.parent / "tests" / "support"))


def main() -> None:
    from page_blocks import follow

    text = PAGE.read_text(encoding="utf-8")
    names = re.findall(r"!\[[^]]+\]\(tutorial/([^)]+)\)", text)
    KEPT.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        follow(text)
        if BROWSER and importlib.util.find_spec("playwright"):
            photograph(Path("swing.html"), Path(LIVE), at=0.45)
            subprocess.run(
                [sys.executable, "-m", "mechc", "compile", EXAMPLE, "--target", "web", "-o", "example.html"],
                check=True,
            )
            photograph(Path("example.html"), OF_EXAMPLE, at=0.37)
        for name in names:
            if Path(name).exists():
                shutil.copy(name, KEPT / name)
    for path in KEPT.glob("*.png"):
        if path.name not in names:
            path.unlink()


def photograph(page: Path, picture: Path, at: float) -> None:
    """Open a page, go to a share of its time, and keep what is seen."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        # the policy of the page forbids the text that says what to wait for
        tab = browser.new_page(viewport={"width": 1100, "height": 760}, bypass_csp=True)
        tab.goto(page.resolve().as_uri())
        tab.wait_for_function("window.page && window.page.ready", timeout=60_000)
        tab.evaluate("page.playing(false)")
        slider = tab.locator("input[type=range]").first
        tab.evaluate(
            "(share) => { const e = document.getElementById('time'); if (e) { e.value = share * e.max;"
            " e.dispatchEvent(new Event('input')); } }",
            at,
        )
        slider.wait_for()
        tab.wait_for_timeout(400)
        tab.screenshot(path=str(picture))
        browser.close()


if __name__ == "__main__":
    main()
