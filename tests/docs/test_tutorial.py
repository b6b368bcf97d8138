"""The tutorial: followed as a reader does, and the answers of its exercises against closed forms."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np
import pytest
from page_blocks import blocks, follow
from PIL import Image, ImageDraw
from PIL.PngImagePlugin import PngInfo
from scipy.optimize import fsolve
from scipy.special import ellipk

import mechc
from mechc.runtime.studies.findings import Findings

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
FILES = {block.file: block.text for block in blocks(PAGE) if block.file}
PICTURES = re.findall(r"!\[[^]]+\]\(tutorial/([^)]+)\)", PAGE)
KEPT = ROOT / "docs" / "tutorial"
LIVE = "swing_page.png"
"""The page of the last step, which a browser shows."""

G = 9.81


@pytest.mark.slow
def test_follow_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All commands print what is shown, and make the pictures that are."""
    monkeypatch.chdir(tmp_path)
    assert follow(PAGE) >= 20
    assert [name for name in PICTURES if not (tmp_path / name).exists()] == [LIVE]
    assert [name for name in PICTURES if name != LIVE and _differs(KEPT / name, tmp_path / name)] == [], (
        "python docs/pictures.py makes the pictures again"
    )
    assert (tmp_path / "swing.html").stat().st_size > 50_000


def test_every_picture_is_shown() -> None:
    assert {path.name for path in KEPT.iterdir()} == set(PICTURES)


def _differs(kept: Path, made: Path) -> bool:
    """Say whether more than 0.1% of the points of two pictures differ visibly; another matplotlib may draw otherwise."""
    with Image.open(kept) as a, Image.open(made) as b:
        if a.info.get("Software") != b.info.get("Software"):
            return False
        if a.size != b.size:
            return True
        one, other = (np.asarray(image.convert("RGB"), dtype=int) for image in (a, b))
    return float(np.mean(np.abs(one - other).max(axis=2) > 48)) > 1e-3


def test_a_picture_with_another_word_differs(tmp_path: Path) -> None:
    """Between ``theta [deg]`` and ``theta [rad]`` at an axis, say."""
    with Image.open(KEPT / "pendulum.png") as kept:
        changed = kept.convert("RGB")
        ImageDraw.Draw(changed).text((8, 8), "angle [rad] of another axis", fill="black", font_size=22)
        changed.save(tmp_path / "changed.png", pnginfo=_software(kept.info["Software"]))
    assert _differs(KEPT / "pendulum.png", tmp_path / "changed.png")


def _software(words: str) -> PngInfo:
    info = PngInfo()
    info.add_text("Software", words)
    return info


def test_what_is_changed_stands_in_the_file() -> None:
    """The lines that a reader is asked to write are those of the whole file that follows them."""
    found = list(blocks(PAGE))
    for excerpt, whole in itertools.pairwise(
        [b for b in found if b.language == "modelica" or b.file in ("wrong.mech", "stop.mech", "swing.mech")]
    ):
        if excerpt.language == "modelica" and whole.file:
            lines = [line for line in excerpt.text.splitlines() if line != "..."]
            assert [line for line in lines if line not in whole.text.splitlines()] == []


def _period(name: str, **changed: str) -> float:
    found = mechc.loads(FILES[name]).study("period", set=changed)
    assert isinstance(found, Findings)
    return found["period"]


def test_first_exercise() -> None:
    """A swing of a = 0.1 deg lasts longer than a small one by less than a^2 = 3e-6 of it."""
    small = 2 * np.pi / np.sqrt(G / 0.5 + 3 / 0.5**2)
    assert _period("spiral.mech", theta="0.1 deg") == pytest.approx(small, rel=3e-6)
    assert f"{small:.5f} s" in PAGE


def test_second_exercise() -> None:
    period = 4 * np.sqrt(0.5 / G) * ellipk(np.sin(np.pi / 6) ** 2)
    for name in ("pendulum.mech", "rod.mech"):
        assert _period(name) == pytest.approx(period, rel=1e-10)
    assert f"{period:.6f} s" in PAGE


def test_third_exercise() -> None:
    end = mechc.loads(FILES["four_bar.mech"]).simulate(set={"rocker.l": 0.2}, stop=0.1)
    angle = np.pi / 3 + 10 * end.time
    np.testing.assert_allclose(end["needed"], 3.25 * G * 0.2 * np.cos(angle), atol=1e-8)
    assert f"{3.25 * G * 0.2 * np.cos(angle[-1]):.3f} N.m" in PAGE


def test_fourth_exercise() -> None:
    """The torque that holds the crank is dV/dangle along the loop, here by differences of the closed linkage."""

    def potential(crank: float) -> float:
        tip = 0.2 * np.array([np.cos(crank), np.sin(crank)])

        def gap(x: list[float]) -> list[float]:
            rocker = np.array([0.5 + 0.4 * np.cos(x[1]), 0.4 * np.sin(x[1])])
            return list(tip + 0.5 * np.array([np.cos(x[0]), np.sin(x[0])]) - rocker)

        bar, rocker = fsolve(gap, [0.5, 1.5], xtol=1e-14)
        # masses 1, 2 and 1.5 kg at the middles of the bars
        return float(G * (tip[1] / 2 + 2 * (tip[1] + 0.25 * np.sin(bar)) + 1.5 * 0.2 * np.sin(rocker)))

    h = 1e-4
    torque = (potential(np.pi / 3 + h) - potential(np.pi / 3 - h)) / (2 * h)
    assert mechc.loads(FILES["held.mech"]).simulate()["needed"][-1] == pytest.approx(torque, rel=1e-6)
    falling = mechc.loads(FILES["stop.mech"])
    for share, moves in ((0.99, True), (1.01, False)):
        end = falling.simulate(set={"dry": share * torque}, stop=0.5, estimate_error=False)
        assert bool(abs(end["shoulder.angle"][-1] - np.pi / 3) > 1e-3) is moves


def test_fifth_exercise() -> None:
    """The measurement knows its damping and its mass."""
    swing = mechc.loads(FILES["swing.mech"])
    measured = swing.simulate(set={"oil": 0.03, "rocker.m": 1.8}, every="50 ms")
    data = {"time": measured.time, "shoulder.angle": measured["shoulder.angle"]}
    found = swing.fit(data, "oil,rocker.m")
    assert found["oil"] == pytest.approx(0.03, rel=1e-6)
    assert found["rocker.m"] == pytest.approx(1.8, rel=1e-6)
