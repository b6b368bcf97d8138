"""The tutorial: followed as a reader does, and the answers of its exercises against closed forms."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from page_blocks import blocks, follow
from scipy.optimize import fsolve
from scipy.special import ellipk

import mechc
from mechc.runtime.studies.findings import Findings

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
FILES = {block.file: block.text for block in blocks(PAGE) if block.file}
"""The last text of each file."""

G = 9.81


def test_follow_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All commands print what is shown, and make the pictures that are."""
    monkeypatch.chdir(tmp_path)
    assert follow(PAGE) >= 20
    pictures = re.findall(r"!\[[^]]+\]\(tutorial/([^)]+)\)", PAGE)
    assert len(pictures) == 5
    assert [name for name in pictures if not (tmp_path / name).exists()] == []
    assert (tmp_path / "swing.html").stat().st_size > 50_000


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
    end = mechc.loads(FILES["parallelogram.mech"]).simulate()
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
        return float(
            G * (tip[1] / 2 + 2 * (tip[1] + 0.25 * np.sin(bar)) + 1.5 * 0.2 * np.sin(rocker))
        )  # masses 1, 2 and 1.5 kg at the middles of the bars

    h = 1e-4
    torque = (potential(np.pi / 3 + h) - potential(np.pi / 3 - h)) / (2 * h)
    assert mechc.loads(FILES["held.mech"]).simulate()["needed"][-1] == pytest.approx(torque, rel=1e-6)
    falling = mechc.loads(FILES["stop.mech"])
    for share, moves in ((0.99, True), (1.01, False)):
        end = falling.simulate(set={"dry": share * torque}, stop=0.5, estimate_error=False)
        assert bool(abs(end["a.angle"][-1] - np.pi / 3) > 1e-3) is moves


def test_fifth_exercise() -> None:
    """The measurement knows its damping and its mass."""
    swing = mechc.loads(FILES["swing.mech"])
    measured = swing.simulate(set={"c": 0.03, "rocker.m": 1.8}, every="50 ms")
    data = {"time": measured.time, "a.angle": measured["a.angle"]}
    found = swing.fit(data, "c, rocker.m")
    assert found["c"] == pytest.approx(0.03, rel=1e-6)
    assert found["rocker.m"] == pytest.approx(1.8, rel=1e-6)
