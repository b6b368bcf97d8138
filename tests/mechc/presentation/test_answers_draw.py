"""Every answer draws itself: a picture of its own, a file, or into axes that are given."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from msgspec.structs import replace

import mechc
from mechc.presentation.answers import figure
from mechc.runtime.outcome import SimulationError

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"

TEXT = """\
model Swing
  parameter k = 4 N/m;
  coordinate Length x = 1 m;
  kinetic 1/2*(1 kg)*der(x)^2;
  potential 1/2*k*x^2;
  experiment(stop = 3 s);
  experiment several(k in {1, 4, 9} N/m, stop = 3 s);
end Swing;
"""


def answers() -> dict[str, Any]:
    model = mechc.loads(TEXT)
    return {
        "modes": model.modes(),
        "section": model.section(where="x = 0", count=5),
        "sweep": model.study("sweep", experiment="several"),
        "ensemble": model.ensemble({"k": [1.0, 4.0]}, keep="x, final(x)"),
        "run": model.simulate(),
    }


@pytest.mark.parametrize("name", answers())
def test_it_draws_a_picture_and_a_file(name: str, tmp_path: Path) -> None:
    found = answers()[name]
    whole, paper = found.plot(), found.plot(tmp_path / "one.svg", style="paper")
    assert isinstance(whole, Figure) and isinstance(paper, Figure)
    assert paper.get_size_inches()[0] < 5.0 < whole.get_size_inches()[0]
    assert "<svg" in (tmp_path / "one.svg").read_text(encoding="utf-8")


def test_it_draws_into_given_axes(tmp_path: Path) -> None:
    figure = Figure()
    axes = figure.subplots(3, 1)
    found = answers()
    assert found["sweep"].plot(ax=axes[0]) is axes[0]
    assert isinstance(found["run"].plot("x", ax=axes[1]), Axes)
    assert (
        found["section"].plot(tmp_path / "here.png", ax=axes[2]) is axes[2]
        and (tmp_path / "here.png").exists()
    )
    assert [len(one.get_lines()) for one in axes] == [3, 1, 1]
    axes[0].set_title("mine")
    assert axes[0].get_title() == "mine" and axes[0].get_title(loc="left") == ""
    for k, line in zip((1, 4, 9), axes[0].get_lines(), strict=True):
        t, x = line.get_data()
        assert line.get_label() == f"k = {k}"
        assert np.allclose(x, np.cos(np.sqrt(k) * np.asarray(t)), atol=1e-6)


def test_axes_are_as_many_as_diagrams() -> None:
    found = answers()["ensemble"]
    figure = Figure()
    with pytest.raises(mechc.UsageMistake, match="the picture has 2 diagrams, and 1 axes are given"):
        found.plot(ax=figure.subplots())
    assert len(found.plot(ax=figure.subplots(2, 1))) == 2


def test_what_cannot_be_drawn_is_refused() -> None:
    found = answers()
    with pytest.raises(mechc.UsageMistake, match="has no ending of a picture"):
        found["modes"].plot("modes.txt")
    with pytest.raises(mechc.UsageMistake, match="style"):
        found["modes"].plot(style="poster")
    with pytest.raises(mechc.UsageMistake, match="what is drawn into given axes has no default"):
        found["run"].plot(ax=Figure().subplots())
    with pytest.raises(SimulationError, match="there is nothing to draw"):
        replace(found["modes"], panels=()).plot()


def test_a_logarithmic_axis_of_few_decades_has_plain_numbers() -> None:
    text = "coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; parameter k = 4 N/m; potential 1/2*k*x^2; damping 0.1 N.s/m on x;"
    drawn = figure(mechc.loads(text).rainflow(stop="20 s"))
    drawn.canvas.draw()
    shown = [label.get_text() for label in drawn.axes[0].get_xticklabels(which="both") if label.get_text()]
    assert "1" in shown and "2" in shown and not any("^" in one or "e" in one for one in shown)


def test_equal_eigenvalues_are_one_point_with_all_names() -> None:
    """A bead on a turning hoop rests at both sides; rounding in the place of the one below is shown as none."""
    found = mechc.load(EXAMPLES / "rotating_hoop.mech").equilibria()
    assert {curve.name for curve in found.panels[0].curves} == {
        "theta = -1.168; theta = 1.168",
        "theta = 0",
        "theta = 3.142",
    }
