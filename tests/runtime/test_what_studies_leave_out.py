"""Studies whose answer leaves something of the model out say so; those of which nothing is left out do not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from mechc import loads
from mechc.cli.study import command

PLANE = """model Plane
  parameter c = 0 N.s/m;
  coordinate Length x = 1 m;
  coordinate Length y = 0 m;
  kinetic 0.5*1 kg*(der(x)^2 + der(y)^2);
  potential 0.5*2 N/m*(x^2 + y^2);
  damping c on x;
  FORCES
end Plane;
"""
RUB = PLANE.replace("FORCES", "friction rub: 0.3 N on x;")
SMOOTH = PLANE.replace("FORCES", "")


def remarks(text: str, kind: str, **settings: Any) -> list[str]:
    found: list[str] = loads(text).study(kind, **settings).summary()["remarks"]
    return found


@pytest.mark.parametrize(
    ("kind", "settings", "word"),
    [
        ("field", {}, "without friction 'rub'"),
        ("linearize", {"at": {"x": 1.0}}, "'rub' begins to slide"),
        ("action", {"stop": 1.0}, "not part of L, take"),
    ],
)
def test_friction_is_told_where_it_is_no_part_of_the_answer(kind: str, settings: Any, word: str) -> None:
    assert any(word in remark for remark in remarks(RUB, kind, **settings))
    assert not any(word in remark for remark in remarks(SMOOTH, kind, **settings))


def test_the_action_of_a_damped_motion_names_what_damping_took() -> None:
    """Of x'' + 2 x + c x' = 0 the work is known by the energies at both ends."""
    model = loads(SMOOTH.replace("c = 0 ", "c = 0.5 "))
    run = model.simulate(stop=1.0)
    x, v = run["x"][-1], run["der(x)"][-1]
    lost = 1.0 - (0.5 * v**2 + x**2)
    (told,) = model.study("action", stop=1.0).summary()["remarks"]
    assert f"take {lost:.4g} J" in told


def test_a_study_shows_the_warnings_of_its_model(tmp_path: Any) -> None:
    file = tmp_path / "bare.mech"
    file.write_text("model Bare\n  coordinate Angle phi = 30;\n  kinetic 1 kg.m^2*der(phi)^2;\nend Bare;\n")
    shown = CliRunner().invoke(command, ["energy", str(file)])
    assert "W0303" in shown.stderr
    assert "W0303" not in CliRunner().invoke(command, ["energy", str(file), "--json"]).stderr


WELL = """model Well
  coordinate Length x = 0.1 m;
  kinetic 0.5 kg*der(x)^2;
  potential POTENTIAL;
end Well;
"""


def test_the_region_of_an_energy_ends_at_its_borders_alone() -> None:
    """-x^2/2 + x^4/4 is as large at sqrt(2 - 0.1^2) as at 0.1, far beyond where looking begins."""
    text = WELL.replace("POTENTIAL", "-0.5*1 N/m*x^2 + 0.25 N/m^3*x^4")
    found = loads(text).study("energy").summary()
    assert found["bounded"] and np.allclose(
        np.abs(found["region"]), [[np.sqrt(1.99), 0.1], [0.1, np.sqrt(1.99)]]
    )
    found = loads(WELL.replace("POTENTIAL", "-1 N*x")).study("energy").summary()
    assert not found["bounded"] and found["region"][0][0] == pytest.approx(0.1, rel=1e-12)
    assert any("where looking ended" in remark for remark in found["remarks"])


@pytest.mark.parametrize(("rate", "told"), [(8, "turns over"), (1, "are one")])
def test_an_angle_has_no_border_at_half_a_turn(rate: float, told: str) -> None:
    text = WELL.replace("Length x = 0.1 m", "Angle x = 3.14159 rad").replace("0.5 kg", "0.5 kg.m^2")
    text = text.replace("POTENTIAL", "9.81 J*cos(x)").replace(
        "end Well", f"initial der(x) = {rate} rad/s;\nend Well"
    )
    assert any(told in remark for remark in loads(text).study("energy").summary()["remarks"])
