"""Contacts that are told by what they read (families) move as those do that are each formed from the text."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.compiler.flat.instances import pair_loops
from mechc.compiler.flat.statements import contacts_of_shapes
from mechc.runtime.outcome import Outcome

ALONE: dict[str, Any] = {"estimate_error": False}

LOOPS = """
structural parameter Integer n = 16;
parameter r[n] = {18 mm + 0.2 mm*mod(i, 5) for i in 1:n};
parameter mu = 0.3;
EXTRA
coordinate Length x[n] = {4.5 cm*(0.5 + mod(i - 1, 4)) + 2 mm*sin(7*i) for i in 1:n};
coordinate Length y[n] = {4.5 cm*(0.5 + floor((i - 1)/4)) + 2 mm*sin(5*i) for i in 1:n};
for i in 1:n loop
  initial der(y[i]) = -2 m/s;
  kinetic 1/2*0.1 kg*(der(x[i])^2 + der(y[i])^2);
  potential 0.1 kg*9.81 m/s^2*y[i];
  contact floor[i]: y[i] - r[i] restitution 0.5 friction mu along der(x[i]);
  for j in i+1:n loop
    contact hit[i,j]: norm({x[i] - x[j], y[i] - y[j]}) - r[i] - r[j] GAP restitution 0.5 friction mu
      along ((x[i] - x[j])*(der(y[i]) - der(y[j])) - (y[i] - y[j])*(der(x[i]) - der(x[j])))
        /norm({x[i] - x[j], y[i] - y[j]});
  end for;
end for;
experiment(stop = 60 ms, method = "moreau", step = 1 ms, tolerance = 1e-12);
"""

SHAPES = """
import mech.planar.*;
import mech.shapes.*;
parameter d = 4.5 cm;
gravity {0, -9.81} m/s^2;
Disk ball[16](r = 2 cm, m = 0.1 kg);
Free free[i in 1:16](world -> ball[i].a, x = d*(0.5 + mod(i - 1, 4)) + 2 mm*sin(7*i),
  y = d*(0.5 + floor((i - 1)/4)) + 2 mm*sin(5*i));
for i in 1:16 loop
  initial der(free[i].y) = -2 m/s;
end for;
shape Sphere(r = RADIUS) on ball;
shape floor: Plane on world;
frame slope = world * trans({4*d, 0 m}) * rot(80 deg);
shape wall: Plane on slope;
contact ball[*] with ball[*], floor, wall friction 0.3 restitution 0.5;
experiment(stop = 60 ms, method = "moreau", step = 1 ms, tolerance = 1e-12);
"""


def loops(extra: str = "", gap: str = "") -> str:
    return LOOPS.replace("EXTRA", extra).replace("GAP", gap)


def formed(text: str, monkeypatch: pytest.MonkeyPatch, *, each: bool) -> mechc.Model:
    """Compile with families, or with each contact from the text."""
    with monkeypatch.context() as patch:
        if each:
            patch.setattr(pair_loops, "FEW", 10**9)
            patch.setattr(contacts_of_shapes, "FEW", 10**9)
        return mechc.loads(text + ("// each" if each else ""))


def both(text: str, monkeypatch: pytest.MonkeyPatch) -> tuple[mechc.Model, mechc.Model]:
    return formed(text, monkeypatch, each=False), formed(text, monkeypatch, each=True)


def check_same(one: mechc.Model, other: mechc.Model) -> None:
    """The order of the contacts is another, so what 1e-12 leaves grows by impacts: 3e-10 m were seen."""
    mine, theirs = one.simulate(**ALONE), other.simulate(**ALONE)
    assert mine.outcome is theirs.outcome is Outcome.COMPLETED, mine.message
    assert mine["energy.dissipated"][-1] > 0.05 * mine["energy.total"][0]
    for state in mine.problem.states:
        assert np.abs(mine[state.name] - theirs[state.name]).max() < 1e-6, state.name


def crowd(model: mechc.Model) -> Any:
    switching = model.compilation.equations.switching
    assert switching is not None
    return switching.crowd


def test_pairs_of_loops(monkeypatch: pytest.MonkeyPatch) -> None:
    one, each = both(loops(), monkeypatch)
    assert len(one.compilation.flat.contacts) == 17 and len(each.compilation.flat.contacts) == 16 + 120
    assert crowd(one).count == crowd(each).count == 16 + 120
    check_same(one, each)


def test_pairs_of_shapes(monkeypatch: pytest.MonkeyPatch) -> None:
    one, each = both(SHAPES.replace("RADIUS", "2 cm"), monkeypatch)
    assert crowd(one).count == crowd(each).count == 120 + 32
    assert len(one.compilation.flat.contacts) == 1 + 32 and len(each.compilation.flat.contacts) == 152
    check_same(one, each)


def test_few_shapes_of_an_array_differ_in_numbers() -> None:
    """The four walls of a bin: each is told by itself, and the balls are not formed one by one."""
    text = SHAPES.replace("RADIUS", "2 cm").replace(
        "frame slope = world * trans({4*d, 0 m}) * rot(80 deg);\nshape wall: Plane on slope;",
        "frame side[k in 1:2] = world * trans({if k == 1 then 0 m else 4*d, 0 m}) * rot(90 deg*(2*k - 3));\n"
        "shape Plane on side;",
    )
    text = text.replace("floor, wall", "floor, side")
    model = mechc.loads(text.replace("16", "80"))
    assert len(model.compilation.flat.contacts) < 10
    assert model.simulate(**ALONE).outcome is Outcome.COMPLETED


@pytest.mark.parametrize(
    ("extra", "gap"),
    [
        (
            "drive x[7] = 4.5 cm*2.5 + 2 mm*sin(49) + 1 mm*sin(100*time/(1 s));",
            "",
        ),  # one is a formula of time
        (
            "let off[n] = {if i == 2 then 1 mm else 0 mm for i in 1:n};",
            "+ off[i]*off[j]/(1 m)",
        ),  # zero at both ends
        ("let L[n] = {if i == 1 then r[16] else r[i] for i in 1:n};", "+ L[i] - L[j] + r[j] - r[i]"),
        ("parameter R = 1 mm; let L[n] = {if i == 1 then R else r[i] for i in 1:n};", "+ 1e-3*(L[i] - R)"),
        ("", "- (if i == 3 and j == 4 then 0.1 mm else 0 mm)"),
        ("", "- 1 um*(i - 1)*(16 - j)"),
    ],
    ids=["driven", "products", "same_symbol", "common_symbol", "condition", "indices"],
)
@pytest.mark.slow
def test_what_differs_in_more_than_symbols_is_formed_each(
    extra: str, gap: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = loops(extra, gap)
    if "drive" in extra:  # a slip that is prescribed has no force that could be known
        text = text.replace("restitution 0.5 friction mu along der(x[i]);", "restitution 0.5;")
    one, each = both(text, monkeypatch)
    assert len(one.compilation.flat.contacts) == 16 + 120
    check_same(one, each)


def test_numbers_of_the_ends_do_not_speak_for_the_others() -> None:
    """One formula of the first and the last, 0, would leave out what is between."""
    text = loops("let off[n] = {if i == 2 then 1 mm else 0 mm for i in 1:n};", "+ off[i]*off[j]/(1 m)")
    assert len(mechc.loads(text).compilation.flat.contacts) == 16 + 120


def test_a_contact_that_is_asked_about_is_formed() -> None:
    model = mechc.loads(loops("output push = multiplier(hit[3,7]);"))
    assert len(model.compilation.flat.contacts) == 16 + 120
    few = model.simulate(stop=2e-3, **ALONE)
    assert few["push"][-1] == 0


def test_names_are_those_of_the_text() -> None:
    text = loops().replace(
        "4.5 cm*(0.5 + mod(i - 1, 4)) +", "(if i == 11 then 14 cm else 4.5 cm*(0.5 + mod(i - 1, 4))) +"
    )
    solution = mechc.loads(text).simulate(**ALONE)
    assert solution.outcome is Outcome.FAILED and "'hit[11,12]' is penetrated" in solution.message
    shifted = SHAPES.replace("RADIUS", "2 cm").replace("x = d*", "x = (if i == 11 then -4 mm else 0 mm) + d*")
    far = shifted.replace("-4 mm", "-60 mm")
    solution = mechc.loads(far).simulate(**ALONE)
    assert solution.outcome is Outcome.FAILED and "'ball[9]-ball[11].touch'" in solution.message, (
        solution.message
    )


def test_states_that_gaps_read_have_their_own_rates() -> None:
    """A floor for each ball that rises at its own speed: at rest each ball goes up with it."""
    text = """
    structural parameter Integer n = 70;
    parameter Velocity w[n] = {1 mm/s*i for i in 1:n};
    state Length h[n] = {0 m for i in 1:n};
    coordinate Length y[n] = {0 m for i in 1:n};
    for i in 1:n loop
      equation der(h[i]) = w[i];
      initial der(y[i]) = w[i];
      kinetic 1/2*1 kg*der(y[i])^2;
      potential 1 kg*9.81 m/s^2*y[i];
      contact floor[i]: y[i] - h[i];
    end for;
    experiment(stop = 50 ms, method = "moreau", step = 1 ms);
    """
    solution = mechc.loads(text).simulate(**ALONE)
    for i in range(1, 71):
        assert solution[f"y[{i}]"][-1] == pytest.approx(50e-6 * i, abs=1e-9)


def test_a_contact_that_a_part_asks_for_by_its_name_in_a_file_of_its_own(tmp_path: Path) -> None:
    """The part that has the contacts and the model that is run stand in other files: then each contact is formed."""
    (tmp_path / "pucks.mech").write_text(
        """model Pucks
  parameter Mass m[14] = {0.1 kg + 0.01 kg*i for i in 1:14};
  coordinate Length x[14] = {3 cm*i for i in 1:14};
  kinetic sum(1/2*m[i]*der(x[i])^2 for i in 1:14);
  for i in 1:14 loop
    for j in i+1:14 loop
      contact hit[i, j]: x[j] - x[i] - 2 cm*(j - i);
    end for;
  end for;
end Pucks;
"""
    )
    (tmp_path / "table.mech").write_text(
        "import pucks.Pucks; model Table Pucks row; output Force load = multiplier(row.hit[1, 2]); end Table;"
    )
    (tmp_path / "main.mech").write_text(
        "import table.Table; model Main Table a; force 1 N on a.row.x[1]; experiment(stop = 50 ms); end Main;"
    )
    run = mechc.load(tmp_path / "main.mech").simulate()
    first = next(e for e in run.events if e.name == "a.row.hit[1,2]")
    assert first.time == pytest.approx(np.sqrt(2 * 0.01 * 0.11), rel=1e-9)
    assert run["a.load"][0] == 0
