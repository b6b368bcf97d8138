"""What studies draw, and refuse to draw."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

import mechc
from mechc.cli.main import run as run_command
from mechc.presentation.answers import save

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def test_what_has_no_picture_is_told_after_the_answer(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The answer is printed, and no empty file is left."""
    picture = tmp_path / "none.png"
    assert (
        run_command(["study", "kinematics", str(EXAMPLES / "axis_and_angle.mech"), "--plot", str(picture)])
        != 0
    )
    printed = capsys.readouterr()
    assert "quaternion" in printed.out and "nothing to draw" in printed.err and not picture.exists()


def test_a_rotation_alone_has_no_path(tmp_path: Path) -> None:
    found = mechc.load(EXAMPLES / "axis_and_angle.mech").kinematics()
    with pytest.raises(mechc.SimulationError, match="nothing to draw"):
        save(found, tmp_path / "paths.png")


def test_a_gradient_names_what_it_is_by() -> None:
    found = mechc.load(EXAMPLES / "kepler.mech").gradient("x", ["e"], stop=1)
    (panel,) = found.panels
    assert panel.x_names == ("e",) and list(panel.curves[0].x) == [1.0]


def test_no_crossing_has_no_errors() -> None:
    found = mechc.load(EXAMPLES / "kepler.mech").section(where="x = 5", count=2)
    assert found.summary()["count"] == 0 and found.tables == ()


RING = """\
model Ring "an oscillator without damping never settles"
  dimensionless;
  parameter k = 1;
  coordinate x = 1;
  kinetic 1/2*der(x)^2;
  potential 1/2*k*x^2;
end Ring;
"""


def test_motions_that_do_not_settle_are_no_two_branches() -> None:
    found = mechc.loads(RING).hysteresis(over="k = 1 .. 1.5, 3", hold=5)
    assert found.details["hysteresis"] is None and "as far as motions have settled" in found.message


def test_an_optimum_at_a_bound_is_the_bound() -> None:
    """x = cos(sqrt(k)) is greatest for the least k of a range in which it falls."""
    found = mechc.loads(RING).optimum(vary="k = 0.25 .. 4", goal="x", stop=1)
    assert found["k"] == 0.25 and "bound" in found.remarks[0]


@pytest.mark.parametrize(("count", "named"), [(2, True), (24, True), (161, False)])
def test_a_legend_leaves_room_for_the_curves(count: int, named: bool) -> None:
    from matplotlib.figure import Figure

    from mechc.presentation.axes import legend

    drawn = Figure(figsize=(8, 4), layout="constrained")
    axes = drawn.add_subplot()
    for k in range(count):
        axes.plot([0, 1], [0, k], label=f"parameter = {k}")
    legend(axes)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        drawn.canvas.draw()
    assert (axes.get_legend() is not None) is named
    assert named or "161 curves" in axes.get_title(loc="left") + axes.get_title()
    assert axes.get_position().height > 0.5
