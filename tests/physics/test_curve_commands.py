"""What commands say of curves: their equations, each stage of the compiler, and how they converge."""

from __future__ import annotations

import json
from importlib import import_module
from pathlib import Path

import pytest
from click import UsageError
from click.testing import CliRunner

CURVES = Path(__file__).parents[2] / "examples" / "curves"

ENDS = """
model Ends
  dimensionless;
  parameter k = 3;
  parameter a = 0.4;
  independent x from 0 to b;
  coordinate b ~ 1;
  coordinate y ~ 1 - x;
  {lower}
  {upper}
  stationary integral(1/2*der(y)^2 + y) {more};
end Ends;
"""

LOADED = """
model Loaded
  dimensionless;
  parameter k = 3;
  parameter a = 0.4;
  independent x from 0 to 1;
  coordinate y ~ 1 - x;
  initial y = 1;
  stationary integral(1/2*der(y)^2 + y) + k*at(y, a)^2;
end Loaded;
"""

TOGETHER = """
model Together
  dimensionless;
  independent x from c - 1 to 2*c + 1;
  coordinate c ~ 0.1;
  coordinate y ~ 0;
  initial y = 1;
  final y = 1;
  stationary integral((1 + x^2)*der(y)^2 + 1) + c^2;
end Together;
"""


def told(command: str, *arguments: str) -> str:
    ran = CliRunner().invoke(import_module(f"mechc.cli.{command}").command, arguments)
    assert ran.exit_code == 0, ran.output
    return ran.output


@pytest.mark.parametrize(
    ("text", "section", "lines"),
    [
        # F = y'^2/2 + y: p = y', F - y' p = y - y'^2/2
        (
            ENDS.format(lower="initial y = 1;", upper="final y = 0;", more=""),
            "natural conditions at the upper end",
            ["0 = y - y'^2/2"],
        ),
        (
            ENDS.format(lower="initial y = 1;", upper="", more="+ k*at(y, b)^2"),
            "natural conditions at the upper end",
            ["0 = 2*(at(y, b))*k + y'", "0 = y - y'^2/2"],
        ),
        (
            ENDS.format(lower="", upper="final y = b^2;", more="+ k*at(y, 0)"),
            "natural conditions at the lower end",
            ["0 = k - y'"],
        ),
        (LOADED, "corner conditions", ["leap of p[y] at x = a = 2*(at(y, a))*k"]),
        (
            TOGETHER,
            "ends that move together",
            ["0 = (energy at the lower end) - 2*(energy at the upper end) + 2*c"],
        ),
    ],
)
def test_conditions_at_ends_and_places(text: str, section: str, lines: list[str], tmp_path: Path) -> None:
    (tmp_path / "m.mech").write_text(text)
    rows = told("equations", str(tmp_path / "m.mech")).splitlines()
    start = next(k for k, row in enumerate(rows) if row.startswith(section))
    found = [row.strip() for row in rows[start + 1 : rows.index("", start)]]
    assert found == lines


def test_an_end_on_a_line_has_one_multiplier_for_two_conditions(tmp_path: Path) -> None:
    (tmp_path / "m.mech").write_text(ENDS.format(lower="initial y = 1;", upper="final y = b^2;", more=""))
    rows = told("equations", str(tmp_path / "m.mech"))
    assert "0 = lambda[final y] + y'\n" in rows
    assert "0 = -2*b*lambda[final y] + y - y'^2/2\n" in rows


def test_every_stage_shows_the_curve() -> None:
    file = str(CURVES / "to_a_line.mech")
    flat = told("show", "flat", file)
    for line in ("independent depth from 0 to b", "to be found: b", "initial x = 0", "final x = 1"):
        assert f"  {line}\n" in flat
    assert "  stationary integral(sqrt(" in flat
    system = told("show", "system", file)
    assert "upper end of the range = b\n" in system
    assert "condition at an end, final x = x - 1\n" in system
    assert "inequality constraint c: z >= 0.5 - 2*time^2\n" in told("show", "flat", str(CURVES / "hump.mech"))
    assert "model: ToLine, a curve of 1 coordinate" in told("explain", file)


def test_ends_of_components_are_named_with_them(tmp_path: Path) -> None:
    (tmp_path / "m.mech").write_text("""
        model Strand
          dimensionless;
          parameter low = 0;
          coordinate y ~ 0;
          initial y = low;
          lagrangian 1/2*der(y)^2 - y^2;
        end Strand;
        model Strands
          dimensionless;
          independent t from 0 to 1;
          Strand s[2](low = {1, 2});
          structural parameter Boolean coupled = true;
          if coupled then
            potential 1/2*(s[1].y - s[2].y)^2;
          end if;
        end Strands;
    """)
    row = json.loads(told("run", str(tmp_path / "m.mech"), "--json"))
    assert row["remarks"] == [
        "the guess does not meet 'initial s[1].y' and 'initial s[2].y': it was bent to do so"
    ]


@pytest.mark.slow
def test_convergence_over_unknowns(tmp_path: Path) -> None:
    """Values converge with twice the degree of the elements."""
    rows = json.loads(told("bench", str(CURVES / "half_plane_geodesic.mech"), "--json", "-"))["meshes"]
    four = [r for r in rows if r["degree"] == 4]
    assert [r["elements"] for r in four] == [1, 2, 4, 8, 16, 32]
    assert four[4]["order"] == pytest.approx(8, abs=0.8)
    assert four[4]["error"] < 1e-11 < four[2]["error"] < 1e-6
    assert max(r["error"] for r in rows if r["degree"] == 10 and r["elements"] > 2) < 1e-14
    picture = tmp_path / "order.png"
    text = told("bench", str(CURVES / "half_plane_geodesic.mech"), "--plot", str(picture))
    assert "HalfPlane: error over unknowns" in text
    assert picture.stat().st_size > 10_000


def test_convergence_takes_no_option_of_motions() -> None:
    command = import_module("mechc.cli.bench").command
    with pytest.raises(UsageError, match="--stop belongs to a motion"):
        CliRunner().invoke(
            command,
            [str(CURVES / "sphere.mech"), "--stop", "1"],
            catch_exceptions=False,
            standalone_mode=False,
        )


def test_a_value_that_is_infinite_at_an_end_leaves_the_others_as_they_are(tmp_path: Path) -> None:
    text = LOADED.replace("end Loaded", "output z = 1/x; end Loaded")
    path = tmp_path / "m.mech"
    path.write_text(text, encoding="utf-8")
    (row,) = (line.split() for line in told("run", str(path)).splitlines() if line.startswith("  z "))
    assert row[:4] == ["z", "-", "1", "1"] and "(not finite at 1 of " in " ".join(row)
