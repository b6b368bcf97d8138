"""axe-core finds nothing on pages and on the site that keeps people from reading or operating them, in light and dark, wide and narrow."""

from __future__ import annotations

import shutil
import subprocess
import tarfile
from pathlib import Path
from typing import Any

import pytest
from browsers import Opened, needs_browser

import mechc
from mechc.web.page import page

ROOT = Path(__file__).resolve().parents[3]
SITE = ROOT / "build" / "website" / "site"
PLACES = ("index", "gallery", "tutorial", "studies", "library", "playground", "live/double_pendulum")
SCREENS = {"desk": {"width": 1280, "height": 800}, "phone": {"width": 390, "height": 844}}
SERIOUS = ("serious", "critical")

pytestmark = [pytest.mark.slow, needs_browser]


@pytest.fixture(scope="module")
def axe(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The text of axe-core, from the registry of npm."""
    folder = tmp_path_factory.mktemp("axe")
    npm = shutil.which("npm")
    if npm is None:
        pytest.skip("needs npm, which fetches axe-core")
    fetched = subprocess.run([npm, "pack", "axe-core"], cwd=folder, capture_output=True, text=True)
    if fetched.returncode:
        pytest.skip(f"axe-core cannot be had: {fetched.stderr.strip()[-200:]}")
    with tarfile.open(next(folder.glob("axe-core-*.tgz"))) as archive:
        text = archive.extractfile("package/axe.min.js")
        assert text is not None
        return text.read().decode()


def violations(tab: Any, axe: str) -> list[str]:
    """What axe finds serious: its rule, how often, and the first place."""
    tab.evaluate(axe + "\n;0")
    found = tab.evaluate("axe.run(document, {resultTypes: ['violations']}).then(r => r.violations)")
    return [
        f"{one['id']} ({one['impact']}), {len(one['nodes'])} times: {one['nodes'][0]['html'][:160]}: {one['nodes'][0]['failureSummary'][:300]}"
        for one in found
        if one["impact"] in SERIOUS
    ]


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("screen", SCREENS)
@pytest.mark.parametrize("name", ["double_pendulum", "stewart_platform", "bouncing_ball"])
def test_pages(name: str, screen: str, scheme: str, browser: Any, axe: str, tmp_path: Path) -> None:
    path = tmp_path / "page.html"
    path.write_text(page(mechc.load(ROOT / "examples" / f"{name}.mech")))
    opened = Opened(browser, path, viewport=SCREENS[screen], color_scheme=scheme)
    assert violations(opened.tab, axe) == []
    opened.tab.close()


@pytest.mark.skipif(not SITE.exists(), reason="needs the site: make docs")
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("screen", SCREENS)
@pytest.mark.parametrize("place", PLACES)
def test_the_site(place: str, screen: str, scheme: str, browser: Any, axe: str) -> None:
    tab = browser.new_page(viewport=SCREENS[screen], color_scheme=scheme, bypass_csp=True)
    tab.goto((SITE / f"{place}.html").as_uri(), timeout=120_000)  # the library is 5 s of processor time
    tab.wait_for_timeout(500)
    assert violations(tab, axe) == []
    tab.close()
