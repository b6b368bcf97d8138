"""Every example runs as it stands and is in the gallery."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest
from gallery import EXAMPLES, ROOT, TOLERANCE, load, run

import mechc

NAMES = sorted(path.stem for path in EXAMPLES.glob("*.mech"))
SLOW = {
    "ball_on_plate",
    "beam",
    "fekete",
    "four_wheels",
    "stewart_platform",
    "valve_train",
    "wheelset_hunting",
}

spec = importlib.util.spec_from_file_location("figures", ROOT / "docs" / "figures.py")
assert spec is not None and spec.loader is not None
figures = importlib.util.module_from_spec(spec)
spec.loader.exec_module(figures)


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow) if n in SLOW else n for n in NAMES])
def test_runs(name: str) -> None:
    """With its own stop and the tolerance of the gallery: the energy balance closes, the constraints hold."""
    solution = run(name)
    balance = solution.accuracy.energy
    if balance is not None and balance.relative is not None:
        assert balance.relative < 100 * TOLERANCE
    for drift in solution.accuracy.constraints:
        assert drift.before is not None and drift.before < 1000 * TOLERANCE
        assert drift.after < 1e-12, drift
    constrained = bool(load(name).compilation.equations.constraints)
    assert constrained == bool(solution.accuracy.constraints)


@pytest.mark.parametrize("name", [n for n in NAMES if n not in SLOW])
def test_named_experiments_run(name: str) -> None:
    """All but the sweeps, at their own tolerance and stop."""
    model = load(name)
    for experiment in model.compilation.flat.experiments:
        if experiment.name and not experiment.sweeps:
            solution = model.simulate(experiment=experiment.name, estimate_error=False)
            assert isinstance(solution, mechc.Solution)
            assert solution.outcome.value in ("completed", "terminated"), (experiment.name, solution.message)


def test_gallery_page_is_up_to_date() -> None:
    """docs/gallery.md is what ``make gallery`` writes, with all examples and tests, and the pictures that it shows."""
    assert sorted(r.example for r in figures.ROWS) == NAMES
    page = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    assert page == figures.page()
    for r in figures.ROWS:
        test: Path = ROOT / "tests" / "physics" / r.test
        assert f'"{r.example}"' in test.read_text(encoding="utf-8") or "test_examples" in r.test, r.example
    assert set(figures.SHOWN) <= set(NAMES)
    for name in figures.SHOWN:
        assert (ROOT / "docs" / "gallery" / f"{name}.png").is_file(), name
