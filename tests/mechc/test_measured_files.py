"""Tables from files beside a run: what is read in another unit than it looks like is told."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

import mechc
from mechc.runtime.outcome import SimulationError

FOLLOW = """\
model Follow
  input Angle measured(interpolation = "spline") = 10 deg;
  input Torque push = 0 N.m;
  parameter Angle offset = 0 rad;
  coordinate Angle q;
  coordinate Angle w = 0 rad;
  drive q = measured;
  kinetic 1/2*2 kg.m^2*(der(q)^2 + der(w)^2);
  force push on w;
  output Angle sum = q + w + offset;
  experiment(stop = 1 s);
end Follow;
"""


@pytest.fixture(scope="module")
def model() -> mechc.Model:
    return mechc.loads(FOLLOW)


def table(folder: Path, head: str, rows: Sequence[tuple[float, ...]], name: str = "table.csv") -> Path:
    path = folder / name
    path.write_text(head + "\n" + "".join(",".join(map(str, row)) + "\n" for row in rows))
    return path


RAMP = [(t / 4, 10.0 + 20 * t / 4) for t in range(5)]


def test_degrees_without_a_unit_are_told(model: mechc.Model, tmp_path: Path) -> None:
    """10 to 30 degrees read in rad, once under the name of the input and once under another one."""
    for head in ("time,measured", "time [s],measured", "time [s],knee"):
        run = model.simulate(inputs={"measured": table(tmp_path, head, RAMP)}, estimate_error=False)
        assert run["q"][-1] == pytest.approx(30.0, rel=1e-12)
        (said,) = run.remarks
        assert "'measured'" in said and "no unit" in said and "reaches 30 rad" in said and "[deg]" in said
    run = model.simulate(
        inputs={"measured": table(tmp_path, "time [s],measured [deg]", RAMP)}, estimate_error=False
    )
    assert run["q"][-1] == pytest.approx(30 * 3.141592653589793 / 180, rel=1e-12) and not run.remarks
    small = [(t, value / 10) for t, value in RAMP]
    assert not model.simulate(inputs={"measured": table(tmp_path, "time,measured", small)}).remarks


def test_units_that_only_one_of_two_files_has_are_told(model: mechc.Model, tmp_path: Path) -> None:
    angle = table(tmp_path, "time [ms],measured [deg]", [(1000 * t, v) for t, v in RAMP], "angle.csv")
    push = table(tmp_path, "time,push [N.m]", [(0, 0), (1000, 1)], "push.csv")
    run = model.simulate(inputs={"measured": angle, "push": push}, estimate_error=False)
    (said,) = run.remarks
    assert "'time' is in ms" in said and "angle.csv" in said and "push.csv" in said


def test_members_in_degrees_without_a_unit_are_told(model: mechc.Model, tmp_path: Path) -> None:
    found = model.ensemble(
        vary=str(table(tmp_path, "offset", [(10,), (20,)], "members.csv")), keep="final(sum)"
    )
    assert any("'offset'" in said and "reaches 20 rad" in said for said in found.remarks)
    path = tmp_path / "wrong.csv"
    path.write_text("offset [deg]\n1\n\n1_0\n")
    with pytest.raises(SimulationError, match=r"line 4 of .* holds '1_0'"):
        model.ensemble(vary=str(path), keep="final(sum)")
