"""Pictures of curves: what is constant along them is named, not drawn."""

from __future__ import annotations

from pathlib import Path

import pytest

import mechc
from mechc.presentation.curve_plots import curve_figure

CURVES = Path(__file__).resolve().parents[3] / "examples" / "curves"


@pytest.mark.parametrize(
    ("name", "said"), [("fermat", "constant: invariant = 0.5288998"), ("clothesline", "")]
)
def test_a_constant_is_named(name: str, said: str) -> None:
    pytest.importorskip("matplotlib")
    solution = mechc.load(CURVES / f"{name}.mech").solve()
    made = curve_figure(solution)
    assert made.get_supxlabel() == said
    assert len(made.axes) == 1


def test_what_was_asked_for_is_drawn() -> None:
    pytest.importorskip("matplotlib")
    solution = mechc.load(CURVES / "fermat.mech").solve()
    made = curve_figure(solution, ["invariant"])
    assert made.axes[0].get_ylabel().startswith("invariant")
