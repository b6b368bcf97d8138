"""Equilibria, their stability, and branches over a parameter, against closed forms and the sources."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from slow_params import slow_but

import mechc
from mechc.cli.main import run as run_command
from mechc.runtime.outcome import SimulationError
from mechc.runtime.studies.kinds.equilibria import FoundEquilibria

ROOT = Path(__file__).resolve().parents[2]
HOOP = ROOT / "examples" / "rotating_hoop.mech"


def equilibria(model: mechc.Model, **settings: Any) -> FoundEquilibria:
    found = model.study("equilibria", **settings)
    assert isinstance(found, FoundEquilibria)
    return found


def values(found: FoundEquilibria, name: str) -> list[float]:
    return sorted(e["values"][name] for e in found.equilibria)


def one(text: str, **settings: Any) -> FoundEquilibria:
    return equilibria(mechc.loads(text), **settings)


WELL = "model W dimensionless; {more} coordinate x{bounds} = 0.1; kinetic 1/2*der(x)^2; potential {v}; end W;"


def test_all_equilibria_of_pendulums() -> None:
    found = equilibria(mechc.load(ROOT / "examples" / "double_pendulum_points.mech"))
    assert [(e["values"]["th1"] > 1, e["values"]["th2"] > 1) for e in found.equilibria] == [
        (False, False), (False, True), (True, False), (True, True),
    ]  # fmt: skip
    assert [e["stable"] for e in found.equilibria] == [True, False, False, False]
    for e in found.equilibria:
        for name in ("th1", "th2"):
            value, error = e["values"][name], e["errors"][name]
            assert min(abs(value), abs(value - math.pi)) <= error < 1e-13


def test_henon_and_heiles_have_one_minimum_and_three_saddles() -> None:
    found = equilibria(mechc.load(ROOT / "examples" / "henon_heiles.mech"))
    places = sorted((round(e["values"]["q1"], 12), round(e["values"]["q2"], 12)) for e in found.equilibria)
    root = round(math.sqrt(3) / 2, 12)
    assert places == sorted([(0.0, 0.0), (0.0, 1.0), (-root, -0.5), (root, -0.5)])
    assert sum(e["stable"] is True for e in found.equilibria) == 1


@pytest.mark.slow
def test_the_sources() -> None:
    """U15: the minimum of a/r^12 - b/r^6 at (2a/b)^(1/6). U16: the saddle. U109: cos(theta) = g/(R w^2)."""
    jones = equilibria(mechc.load(ROOT / "examples" / "lennard_jones.mech", set={"r": 1.1}))
    assert max(values(jones, "r")) == pytest.approx(2 ** (1 / 6), rel=1e-15)
    assert all(e["stable"] is True for e in jones.equilibria)
    saddle = equilibria(mechc.load(ROOT / "examples" / "saddle.mech"))
    assert [e["stable"] for e in saddle.equilibria] == [False]
    hoop = equilibria(mechc.load(HOOP))
    leaning = math.acos(9.81 / 25)
    assert np.abs(np.array(values(hoop, "theta")) - [-leaning, 0, leaning, math.pi]).max() < 1e-14
    stable = {round(e["values"]["theta"], 6): e["stable"] for e in hoop.equilibria}
    assert list(stable.values()) == [True, False, True, False]
    swing = next(e for e in hoop.equilibria if e["stable"])
    assert abs(abs(complex(*swing["eigenvalues"][0]).imag) - 5 * math.sin(leaning)) < 1e-13


CHARGED = """\
model Bead "a charged bead on a hoop over a charge at its bottom (U72)"
  dimensionless;
  parameter lambda = 1;
  coordinate th(min = 0.1, max = 6.2) = 1;
  kinetic 1/2*der(th)^2;
  potential -cos(th) + lambda/(2*sin(th/2));
end Bead;
"""


@pytest.mark.parametrize("strength", slow_but([4.0, 9.0], [0.5, 1.0, 4.0, 7.9, 9.0, 16.0]))
def test_a_charged_bead_on_a_hoop(strength: float) -> None:
    """U72 with the charge at the bottom: sin^3(th/2) = lambda/8 up to lambda = 8, the far side above; at lambda = 1 it
    rests 60 degrees from the charge, and swings with w^2 = 2.25 g/a, at 4 105.0654 degrees and 1.110118, at 16 1."""
    found = one(CHARGED.replace("lambda = 1;", f"lambda = {strength};"))
    wanted = [math.pi]
    if strength < 8:
        half = math.asin((strength / 8) ** (1 / 3))
        wanted = [2 * half, math.pi, 2 * math.pi - 2 * half]
    found_values = values(found, "th")
    assert len(found_values) == len(wanted)
    assert np.abs(np.array(found_values) - wanted).max() < 1e-12
    assert [e["stable"] for e in found.equilibria] == ([True, False, True] if strength < 8 else [True])
    if strength == 4.0:
        assert math.degrees(found_values[0]) == pytest.approx(105.0654, abs=5e-5)
    squares = {1.0: (0, 2.25, 1e-12), 4.0: (0, 1.110118, 5e-7), 16.0: (0, 1.0, 1e-12)}
    if strength in squares:
        k, square, digits = squares[strength]
        swing = complex(*found.equilibria[k]["eigenvalues"][0])
        assert abs(swing.imag) ** 2 == pytest.approx(square, abs=digits)
    if strength == 1.0:
        assert abs(found_values[0] - math.pi / 3) < 1e-14
        assert abs(complex(*found.equilibria[0]["eigenvalues"][0]).imag ** 2 - 2.25) < 1e-13


def test_the_far_side_of_the_charge_forks() -> None:
    """U72: the branches sin^3(th/2) = lambda/8 meet th = pi in a fork at lambda = 8."""
    found = one(CHARGED, over="lambda = 0.5 .. 12")
    ((kind, at),) = special(found)
    assert kind == "fork" and at == pytest.approx(8, abs=1e-10)
    assert found.special[0]["values"]["th"] == pytest.approx(math.pi, abs=1e-8)


@pytest.mark.slow
def test_what_neither_eigenvalues_nor_the_second_variation_tell() -> None:
    quartic = one(WELL.format(more="", bounds="", v="x^4"))
    assert [e["stable"] for e in quartic.equilibria] == [None]
    damped = one(WELL.format(more="", bounds="", v="x^2/2").replace("end W", "damping 0.3 on x; end W"))
    assert [e["stable"] for e in damped.equilibria] == [True]
    fed = one(WELL.format(more="", bounds="", v="x^2/2").replace("end W", "force 0.3*der(x) on x; end W"))
    assert [e["stable"] for e in fed.equilibria] == [False]
    spun = """\
model Gyro "a saddle that spin holds: linear terms do not tell"
  dimensionless;
  coordinate x = 0; coordinate y = 0;
  kinetic 1/2*(der(x)^2 + der(y)^2) + 2*(x*der(y) - y*der(x));
  potential -1/2*(x^2 + 1.1*y^2);
end Gyro;
"""
    (gyro,) = one(spun).equilibria
    assert gyro["stable"] is None and max(abs(z[0]) for z in gyro["eigenvalues"]) < 1e-12


@pytest.mark.slow
def test_constraints_rotations_and_idle_coordinates() -> None:
    loop = equilibria(mechc.load(ROOT / "examples" / "pendulum_cartesian.mech"))
    assert [round(e["values"]["y"], 12) for e in loop.equilibria] in ([-1.0, 1.0], [1.0, -1.0])
    assert {round(e["values"]["y"]): e["stable"] for e in loop.equilibria} == {-1: True, 1: False}
    rail = "model R dimensionless; coordinate s = 0.4; coordinate x = 1; kinetic 1/2*(der(s)^2 + der(x)^2); potential x^2; end R;"
    found = one(rail)
    assert [e["stable"] for e in found.equilibria] == [True]
    assert found.equilibria[0]["values"]["s"] == 0.4 and any(
        "nothing depends on s" in r for r in found.remarks
    )


def special(found: FoundEquilibria) -> list[tuple[str, float]]:
    return [(s["kind"], next(iter(s["parameter"].values()))) for s in found.special]


@pytest.mark.slow
def test_the_fork_of_the_hoop_and_what_tilting_makes_of_it() -> None:
    """U109: a fork at w^2 = g/R. A tilt makes it a fold, where both derivatives of the potential vanish."""
    found = equilibria(mechc.load(HOOP), over="w = 0 .. 10 rad/s")
    ((kind, at),) = special(found)
    assert kind == "fork" and abs(at - math.sqrt(9.81)) < 1e-10
    upper = [e for e in found.equilibria if e["values"]["theta"] > 1e-3 and e["values"]["theta"] < 3]
    assert len(upper) > 10 and all(e["stable"] is True for e in upper)
    for e in upper:
        assert abs(math.cos(e["values"]["theta"]) - 9.81 / e["parameter"]["w"] ** 2) < 1e-10
    tilted = (
        "model T dimensionless; parameter w = 1; coordinate th = 0.1; kinetic 1/2*der(th)^2;"
        " potential -cos(th) - 1/2*w^2*sin(th)^2 - 0.01*sin(th); end T;"
    )
    found = one(tilted, over="w = 0 .. 3")
    ((kind, at),) = special(found)
    # V' = sin - w^2 sin cos - b cos, V'' = cos - w^2 (cos^2 - sin^2) + b sin: tan^3 = -b, w^2 = (1 + b^(2/3))^(3/2)
    assert kind == "fold" and abs(at - (1 + 0.01 ** (2 / 3)) ** 0.75) < 1e-10
    assert abs(found.special[0]["values"]["th"] + math.atan(0.01 ** (1 / 3))) < 1e-8


@pytest.mark.slow
def test_a_branch_through_ten_folds() -> None:
    """V' = 0.02 x + sin(x) - f: folds where cos(x) = -0.02."""
    text = WELL.format(more="parameter f = 0;", bounds="(min = -20, max = 20)", v="0.01*x^2 - cos(x) - f*x")
    found = one(text, over="f = -2 .. 2")
    x = math.acos(-0.02)
    wanted = [s * (x + 2 * math.pi * k) for k in range(-4, 5) for s in (1, -1)]
    wanted = sorted({round(v, 9) for v in wanted if abs(v) < 20})
    folds = sorted(s["values"]["x"] for s in found.special)
    assert len(folds) == len(wanted) >= 10 and all(s["kind"] == "fold" for s in found.special)
    assert np.abs(np.array(folds) - wanted).max() < 1e-7
    for s in found.special:
        assert abs(s["parameter"]["f"] - 0.02 * s["values"]["x"] - math.sin(s["values"]["x"])) < 1e-10


def test_a_hopf_point() -> None:
    text = WELL.format(more="parameter mu = -0.3;", bounds="", v="x^2/2").replace(
        "end W", "force (mu - 0.25 - x^2)*der(x) on x; end W"
    )
    found = one(text, over="mu = -1 .. 1")
    ((kind, at),) = special(found)
    assert kind == "hopf" and abs(at - 0.25) < 1e-10
    assert {e["stable"] for e in found.equilibria if e["parameter"]["mu"] < 0.2} == {True}
    assert {e["stable"] for e in found.equilibria if e["parameter"]["mu"] > 0.3} == {False}


def test_mistakes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    hoop = mechc.load(HOOP)
    with pytest.raises(SimulationError, match="'theta' is not a parameter"):
        equilibria(hoop, over="theta = 0 .. 1")
    with pytest.raises(mechc.UsageMistake, match="input 'ww'"):
        equilibria(hoop, over="ww = 0 .. 1")
    with pytest.raises(SimulationError, match="over one parameter"):
        equilibria(hoop, over="w = 0 .. 1, R = 1 .. 2")
    with pytest.raises(SimulationError, match="depends on time"):
        equilibria(mechc.load(ROOT / "examples" / "forced_pendulum.mech"))
    assert run_command(["study", "equilibria", str(HOOP), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert len(found["equilibria"]) == 4 and found["special"] == []
    assert set(found["equilibria"][0]) >= {"values", "parameter", "stable", "eigenvalues"}
    assert run_command(["study", "equilibria", str(tmp_path / "none.mech")]) != 0


@pytest.mark.slow
def test_a_family_of_equilibria_says_so() -> None:
    """A top rests upright and hanging whatever its turn about the axis."""
    top = equilibria(mechc.load(ROOT / "examples" / "heavy_top_rotation.mech"))
    assert any("not isolated" in remark for remark in top.remarks)


BLADES = """\
import mech.planar.*;
model Blades "a hub with three blades, whose weights balance but for rounding"
  gravity {{0, -9.81}} m/s^2;
  Bar one(m = 1 kg, l = 1 m);
  Bar two(m = 1 kg, l = 1 m);
  Bar three(m = {mass} kg, l = 1 m);
  Revolute pin(world -> one.a, angle = 20 deg);
  Weld second(one.a * rot(120 deg) -> two.a);
  Weld third(one.a * rot(240 deg) -> three.a);
end Blades;
"""


def test_a_rotor_that_is_balanced_but_for_rounding_rests_anywhere() -> None:
    found = one(BLADES.format(mass=1))
    assert found.message == "1 equilibrium, not isolated, may be incomplete"
    assert (
        "the rates of 'der(pin.angle)' are rounding wherever it is looked at, and count as zero"
        in found.remarks
    )
    with pytest.raises(SimulationError, match="not isolated: no list of them can be proven"):
        one(BLADES.format(mass=1), prove=True)
    heavier = one(BLADES.format(mass=1 + 1e-9))  # the third blade hangs down, or stands
    angles = [math.radians(30), math.radians(30) - math.pi]
    assert values(heavier, "pin.angle") == pytest.approx(sorted(angles), abs=1e-6)
    assert [e["stable"] for e in heavier.equilibria] == [False, True]


@pytest.mark.parametrize("names", ["xy", "xyz"])
def test_a_circle_and_a_sphere_of_equilibria_are_one(names: str) -> None:
    """With the hilltop in their middle there are two."""
    square = " + ".join(f"{n}^2" for n in names)
    text = "\n".join(f"coordinate {n} = {0.3 - 0.1 * k:g};" for k, n in enumerate(names))
    kinetic = " + ".join(f"1/2*der({n})^2" for n in names)
    found = one(f"model Hat dimensionless; {text} kinetic {kinetic}; potential ({square} - 1)^2; end Hat;")
    assert found.message == "2 equilibria, 1 of them not isolated, may be incomplete"
    radii = [math.hypot(*(e["values"][n] for n in names)) for e in found.equilibria]
    assert sorted(radii) == pytest.approx([0, 1], abs=1e-7)


def test_a_flat_bottom_is_isolated() -> None:
    found = one(WELL.format(more="", bounds="", v="x^4"))
    assert found.message == "1 equilibrium"
