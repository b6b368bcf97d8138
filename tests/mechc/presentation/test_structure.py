"""``mechc check --structure``: degrees of freedom, also where a count of joints is wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from mechc.api import load, loads
from mechc.presentation.structure import structure

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


def rows(text: str) -> dict[str, str]:
    return {
        row[: row.index("  ", 2)].strip(): row[row.index("  ", 2) :].strip() for row in text.split("\n")[1:]
    }


@pytest.mark.parametrize(
    ("example", "freedoms"),
    [
        ("slider_crank", "1"),
        ("four_bar", "0"),
        ("bricard", "1"),
        ("peaucellier", "1"),
        ("n_four_bar", "1"),
        ("squeezing_mechanism", "1"),
        pytest.param("stewart_platform", "6", marks=pytest.mark.slow),
        ("double_pendulum", "2"),
        ("chaplygin_sleigh", "2, 3 of positions"),
        ("ball_on_turntable", "3, 5 of positions"),
        ("jointed_chain", "11"),
        ("watt_linkage", "1"),
        ("five_bar", "0"),
        ("universal_joint_shaft", "0"),
        ("fekete", "40"),
        ("rolling_coin", "3, 5 of positions"),
    ],
)
def test_degrees_of_freedom(example: str, freedoms: str) -> None:
    assert rows(structure(load(EXAMPLES / f"{example}.mech")))["degrees of freedom"] == freedoms


def test_words() -> None:
    found = rows(structure(load(EXAMPLES / "bricard.mech")))
    assert found["bodies"].startswith("5: bar[1], bar[2]")
    assert found["joint pin3"] == "1 freedom"
    assert found["loop closed by pin6"] == "5 equations, 4 independent"
    assert found["equations"] == "5, rank 4"
    found = rows(structure(load(EXAMPLES / "four_bar.mech")))
    assert found["joint a"] == "1 freedom, 1 prescribed"
    assert found["prescribed"] == "1 motion"


def test_rigid_bodies_in_space() -> None:
    """Three points with fixed distances: 9 coordinates, 3 equations, the 6 freedoms of a rigid body (U42)."""
    text = (
        "coordinate Length r[3, 3] ~ {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}} m;"
        "for i in 1:3 loop mass 1 kg at world * r[i];"
        "constraint rod[i]: norm(r[i] - r[mod(i, 3) + 1]) = 1 m; end for;"
    )
    found = rows(structure(loads(text)))
    assert found["degrees of freedom"] == "6"
    assert found["constraint rod[1]"] == "1 equation"


@pytest.mark.parametrize(("library", "size"), [("planar", 2), ("spatial", 3)])
@pytest.mark.parametrize("n", [2, 5])
def test_freely_jointed_chain(library: str, size: int, n: int) -> None:
    """n points joined by n - 1 rods: n + 1 freedoms in the plane, 2 n + 1 in space (U42)."""
    text = (
        f"import mech.{library}.*; import mech.couplings.*; structural parameter Integer n = {n};"
        "Particle bead[n](m = 1 kg); Translation at[i in 1:n](world -> bead[i].a, position ~ "
        + ("{i, 0.2*i*i} m" if size == 2 else "{i, 0.2*i*i, 0.1*i} m")
        + "); Distance rod[i in 1:n - 1](bead[i].a -> bead[i + 1].a);"
    )
    assert rows(structure(loads(text)))["degrees of freedom"] == str(n + 1 if size == 2 else 2 * n + 1)


def test_contacts_and_friction_take_no_freedom() -> None:
    text = """
    coordinate x = 1 m; coordinate y = 1 m;
    kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
    constraint slope: x = y;
    contact floor: y;
    friction 0.1 N on x;
    """
    lines = rows(structure(loads(text)))
    assert lines["contact floor"] == "counted as open"
    assert lines["equations"] == "1, rank 1" and lines["degrees of freedom"] == "1"
