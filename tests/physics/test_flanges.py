"""Parts between two angles or lengths: `A -> B`, sides that are left at rest, names such as `from`.

Judges: closed forms, and SciPy's integration of equations written by hand.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from scipy.integrate import solve_ivp

import mechc
from mechc.runtime.outcome import SimulationError

PARTS = """
model SpringDamper
  input Angle from;
  input Angle to = 0 rad;
  parameter RotationalStiffness k = 1 N.m/rad;
  parameter RotationalDamping c = 0 N.m.s;
  potential 1/2*k*(to - from)^2;
  damping c on to - from;
end SpringDamper;
model Gear
  input Angle from;
  input Angle to;
  input Angle support = 0 rad;
  parameter ratio = 2;
  constraint mesh: from - support = ratio*(to - support);
end Gear;
model Rotor
  parameter Inertia J = 1 kg.m^2;
  coordinate Angle angle ~ 0 rad;
  kinetic 1/2*J*der(angle)^2;
end Rotor;
"""
TRAIN = (
    PARTS
    + """
model Train
  Rotor a(J = 1 kg.m^2, angle = 1 rad);
  Rotor b(J = 2 kg.m^2);
  Rotor c(J = 3 kg.m^2);
  Gear g(a.angle -> b.angle);
  SpringDamper s[2](b.angle -> c.angle, k = 5 N.m/rad, c = {0.4, 0.6} N.m.s);
  SpringDamper housing(from = c.angle, k = 4 N.m/rad, c = 0.5 N.m.s);
  initial der(a.angle) = 0; initial der(c.angle) = 0; initial c.angle = 0;
  experiment(stop = 3 s, tolerance = 1e-11);
end Train;
"""
)


def test_a_train_of_rotors() -> None:
    """a = 2 b, so b has the inertia 2 + 4."""

    def rates(_: float, y: np.ndarray) -> list[float]:
        b, c, vb, vc = y
        torque = 10 * (c - b) + (vc - vb)
        return [vb, vc, torque / 6, (-torque - 4 * c - 0.5 * vc) / 3]

    run = solve_ivp(rates, (0, 3), [0.5, 0, 0, 0], rtol=1e-12, atol=1e-13, dense_output=True, method="DOP853")
    solution = mechc.loads(TRAIN).simulate(estimate_error=False)
    for t in np.linspace(0.1, 3, 20):
        mine = solution(t)
        assert [mine["b.angle"], mine["c.angle"]] == pytest.approx(run.sol(t)[:2], abs=1e-9)
    total = solution["energy.total"] + solution["energy.dissipated"]
    assert np.ptp(total) < 1e-9


def test_the_long_form_is_the_same() -> None:
    long = TRAIN.replace("a.angle -> b.angle", "from = a.angle, to = b.angle")
    ends = [mechc.loads(text).simulate(estimate_error=False)["c.angle"][-1] for text in (TRAIN, long)]
    assert ends[0] == ends[1]


def test_joints_of_the_library_have_such_sides() -> None:
    text = PARTS + (
        "model M\n import mech.planar.*; Bar bar(m = 3 kg, l = 2 m); Revolute hinge(world -> bar.a, angle = 0.2 rad, der(angle) = 0 rad/s);\n"
        " Rotor wheel(J = 5 kg.m^2); SpringDamper s(hinge.angle -> wheel.angle, k = 8 N.m/rad); initial wheel.angle = 0;\n"
        " initial der(wheel.angle) = 0; experiment(stop = 1 s);\nend M;"
    )
    J = 3 * 4 / 3
    w = math.sqrt(8 * (1 / J + 1 / 5))
    found = mechc.loads(text).simulate(estimate_error=False)
    twist = found["hinge.angle"] - found["wheel.angle"]
    assert twist == pytest.approx(0.2 * np.cos(w * found.time), abs=1e-8)


def test_a_housing_is_at_rest() -> None:
    text = (
        "model Damper\n input Angle a; input Angle support = 0 rad; parameter RotationalDamping c = 1 N.m.s; damping c on a - support; end Damper;\n"
        "model M\n coordinate Angle a = 0 rad; initial der(a) = 1 rad/s; kinetic 1/2*1 kg.m^2*der(a)^2; Damper d(a = a);\n"
        " output w = der(a); experiment(stop = 1 s);\nend M;"
    )
    model = mechc.loads(text)
    found = model.simulate(estimate_error=False)
    assert found["a"][-1] == pytest.approx(1 - math.exp(-1), rel=1e-9)
    assert model.simulate(set={"d.support": 2.0}, estimate_error=False)["a"][-1] == pytest.approx(
        1 - math.exp(-1), rel=1e-9
    )
    for moving in (([0, 1], [0, 1]), lambda t: t):
        with pytest.raises(SimulationError, match="take to be zero"):
            model.simulate(inputs={"d.support": moving})
    with model.start() as sim, pytest.raises(SimulationError, match="stays as it is"):
        sim["d.support"] = 1.0


def test_an_input_whose_rate_nobody_needs_is_free() -> None:
    text = (
        "model Spring\n input Length from; input Length to = 0 m; potential 1/2*4 N/m*(to - from)^2; end Spring;\n"
        "model M\n coordinate Length x = 0 m; initial der(x) = 0 m/s; kinetic 1/2*1 kg*der(x)^2; Spring s(from = x); experiment(stop = 1 s);\nend M;"
    )
    found = mechc.loads(text).simulate(inputs={"s.to": ([0, 1], [0, 1])}, estimate_error=False)
    assert found["x"][-1] == pytest.approx(1 - math.sin(2) / 2, rel=1e-8)


def test_in_an_fmu_it_is_a_parameter(tmp_path: Path) -> None:
    import zipfile

    from mechc.cli.main import run

    file = tmp_path / "t.mech"
    file.write_text(TRAIN)
    assert (
        run(["compile", str(file), "--target", "fmu", "--sources-only", "-o", str(tmp_path / "t.fmu")]) == 0
    )
    text = zipfile.ZipFile(tmp_path / "t.fmu").read("modelDescription.xml").decode()
    line = next(row for row in text.split("<") if 'name="housing.to"' in row)
    assert 'causality="parameter"' in line and 'variability="fixed"' in line


def test_words_of_the_language_are_names_where_they_can_be() -> None:
    text = (
        "model Part\n input Angle from; input Angle to; parameter Length start = 1 m; parameter stop = 2; parameter Real to_ = stop;\n"
        " force -1 N.m/rad*(from - to)*stop*start/1 m*to_/2 on from; end Part;\n"
        "model M\n coordinate Angle a = 1 rad; initial der(a) = 0 rad/s; kinetic 1/2*2 kg.m^2*der(a)^2; Part p(a -> 0 rad, start = 1 m);\n"
        " coordinate Length to = 1 m; kinetic 1/2*1 kg*der(to)^2; experiment(stop = 1 s);\nend M;"
    )
    assert mechc.loads(text).simulate(estimate_error=False)["a"][-1] == pytest.approx(math.cos(1), rel=1e-8)


@pytest.mark.parametrize(
    ("declaration", "code"),
    [
        ("Gear g(a.angle);", "E0127"),
        ("Rotor r(a.angle -> b.angle);", "E0408"),
        ("Gear g(a.angle -> 1 m);", "E0303"),
        ("Gear g(a.angle -> b.angle, to = b.angle);", "E0409"),
        ("Gear g(1, 2);", "E0127"),
    ],
)
def test_wrong_links(declaration: str, code: str) -> None:
    caught = refused(PARTS + f"model M\n Rotor a; Rotor b; {declaration}\nend M;")
    assert caught[0].code == code, caught[0].message
