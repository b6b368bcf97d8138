"""Circles of linear signals between parts, and outputs that keep equations of coordinates: against NumPy, SciPy and closed forms."""

from __future__ import annotations

import subprocess
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mechc
from mechc.lang.diagnostics import CompileError

GAIN = """\
model Gain
  input Real u;
  parameter Real k = 1;
  output Real y = k*u;
end Gain;
"""


def run(text: str, **options: Any) -> Any:
    found: Any = mechc.loads(text).simulate(**{"estimate_error": False, "tolerance": 1e-11, **options})
    assert found.outcome.value == "completed", found.message
    return found


def test_a_loop_of_two_gains() -> None:
    """y = (1 - y)/2."""
    text = "model L\n  Gain a(u = 1 - b.y, k = 0.5);\n  Gain b(u = a.y);\n  state Real x = 0;\n"
    text += "  equation der(x) = a.y/1 s;\n  experiment(stop = 1 s);\nend L;"
    found = run(GAIN + text)
    assert found["a.y"][-1] == pytest.approx(1 / 3, abs=1e-15)
    assert found["x"][-1] == pytest.approx(1 / 3, abs=1e-14)


@pytest.mark.parametrize("seed", range(4))
def test_random_nets_of_gains(seed: int) -> None:
    """Gains that all read each other, a coordinate and the time: y = A y + b x + c t by NumPy, the motion by SciPy."""
    random = Random(seed)
    n = 2 + seed
    matrix = np.array([[random.uniform(-0.9, 0.9) if i != j else 0.0 for j in range(n)] for i in range(n)])
    by, ct = (np.array([random.uniform(-1, 1) for _ in range(n)]) for _ in range(2))
    lines = []
    for i in range(n):
        terms = " + ".join(f"{float(matrix[i, j])!r}*g{j}.y" for j in range(n) if j != i)
        lines.append(f"  Gain g{i}(u = {terms} + {float(by[i])!r}*x/(1 m) + {float(ct[i])!r}*time/(1 s));")
    text = GAIN + "model Net\n  coordinate Length x = 1 m;\n  kinetic (1 kg)/2*der(x)^2;\n" + "\n".join(lines)
    text += "\n  force -1 N*g0.y on x;\n  output rate = der(g1.y);\n  experiment(stop = 2 s);\nend Net;"
    solved = np.linalg.inv(np.eye(n) - matrix)
    px, pt = solved @ by, solved @ ct
    motion = solve_ivp(
        lambda t, s: [s[1], -(px[0] * s[0] + pt[0] * t)],
        (0, 2),
        [1, 0],
        rtol=1e-12,
        atol=1e-13,
        dense_output=True,
    ).sol
    found = run(text)
    for t in (0.5, 1.3, 2.0):
        x, v = motion(t)
        now = found(t)
        assert now["x"] == pytest.approx(x, abs=1e-9)
        for i in range(n):
            assert now[f"g{i}.y"] == pytest.approx(px[i] * x + pt[i] * t, abs=1e-9)
        assert now["rate"] == pytest.approx(px[1] * v + pt[1], abs=1e-8)


def test_a_loop_in_a_branch_of_a_law() -> None:
    """The gain changes at a time: y = k (1 - y) before and after it."""
    text = (
        GAIN
        + "model L\n  Gain a(u = if time < 0.4 s then 1 - b.y else 2 - 3*b.y, k = 0.5);\n  Gain b(u = a.y);\n"
    )
    text += "  state Real x = 0;\n  equation der(x) = a.y/1 s;\n  experiment(stop = 1 s);\nend L;"
    assert run(text)["x"][-1] == pytest.approx(0.4 / 3 + 0.6 * 0.4, abs=1e-12)


def test_the_c_program_finds_the_same(tmp_path: Path) -> None:
    text = GAIN + "model L\n  Gain a(u = 1 - b.y, k = 0.5);\n  Gain b(u = a.y);\n  state Real x = 0;\n"
    text += "  equation der(x) = a.y/1 s;\n  experiment(stop = 1 s, every = 0.5 s);\nend L;"
    mechc.loads(text).compile("c", tmp_path)
    build = ["cc", "-O1", "-o", str(tmp_path / "L"), *map(str, tmp_path.glob("*.c")), "-lm"]
    subprocess.run(build, check=True)
    rows = subprocess.run([tmp_path / "L"], capture_output=True, text=True, check=True).stdout.splitlines()
    assert float(rows[-1].split(",")[1]) == pytest.approx(1 / 3, abs=1e-14)


def test_a_singular_loop_is_told() -> None:
    """y = 1 + y."""
    text = GAIN + "model L\n  Gain a(u = 1 + b.y);\n  Gain b(u = a.y);\n  state Real x = 0;\n"
    text += "  equation der(x) = a.y/1 s;\n  experiment(stop = 1 s);\nend L;"
    found: Any = mechc.loads(text).simulate()
    assert found.outcome.value == "failed"
    assert "no solution for 'b.y' is found" in found.message


@pytest.mark.parametrize("law", ["u^2", "clamp(u, -1, 1)", "1/(2 + u)", "if u > 0 then u else 0"])
def test_loops_that_are_not_linear_ask_for_a_guess(law: str) -> None:
    text = f"model Law\n  input Real u;\n  output Real y = {law};\nend Law;\n" + GAIN
    text += "model L\n  Gain a(u = 1 - b.y, k = 0.5);\n  Law b(u = a.y);\n  state Real x = 0;\n  equation der(x) = a.y/1 s;\nend L;"
    with pytest.raises(CompileError) as raised:
        mechc.loads(text).compilation  # noqa: B018
    (told,) = raised.value.diagnostics
    assert told.code == "E0207"
    assert "let an equation determine one of them: 'output y ~ 0;'" in told.help


CRANE = """
import mech.planar.*;
model Servo
  gravity {0, -9.81} m/s^2;
  Particle crab(m = 1 kg);
  Body load(m = 0.5 kg, J = 0.1 kg.m^2, com = {0, 1} m);
  Prismatic rail(world -> crab.a, position = 0 m, der(position) = 0 m/s);
  Revolute pivot(crab.a -> load.a, angle ~ -0.5 rad);
  KEPT
  experiment(stop = 3 s);
end Servo;
"""


def test_an_output_keeps_a_wanted_angle() -> None:
    """An inverted crane crab: the force on the crab by Newton's equations for the wanted angle."""
    text = "output Force F ~ 0 N; equation pivot.angle = -0.5 rad*exp(-time/1 s); force F on rail.position;"
    found = run(CRANE.replace("KEPT", text))
    m, big, length, inertia, g = 0.5, 1.0, 1.0, 0.1, 9.81

    def wanted(t: float) -> tuple[float, float, float]:
        a = -0.5 * np.exp(-t)
        return a, -a, a

    def crab(t: float) -> float:
        """From the moment about the pivot: (J + m l^2) a'' - m g l sin a = m l cos a x''."""
        a, _, second = wanted(t)
        return float(
            ((inertia + m * length**2) * second - m * g * length * np.sin(a)) / (m * length * np.cos(a))
        )

    motion = solve_ivp(
        lambda t, y: [y[1], crab(t)], (0, 3), [0, 0], rtol=1e-12, atol=1e-13, dense_output=True
    ).sol
    for t in (0.0, 0.7, 3.0):
        a, first, second = wanted(t)
        now = found(t)
        assert now["rail.position"] == pytest.approx(motion(t)[0], abs=1e-8)
        pushed = (big + m) * crab(t) - m * length * (np.cos(a) * second - np.sin(a) * first**2)
        assert now["F"] == pytest.approx(pushed, abs=1e-8)


def test_it_is_the_servo_constraint() -> None:
    """Two forces for two equations, in any order: the same as constraints by inputs."""
    body = "dimensionless; coordinate x = 0; coordinate z = 1; kinetic (der(x)^2 + 2*der(z)^2)/2 + 0.3*der(x)*der(z);\n"
    body += "potential (x - z)^2/2; experiment(stop = 1);\n"
    start = "initial der(x) = 1; initial der(z) = 0;\n"
    ways = [
        "output F ~ 0; output G ~ 0; equation x = sin(time); equation z = cos(time); force F on x; force G on z;",
        "output F ~ 0; output G ~ 0; equation z = cos(time); equation x = sin(time); force F on x; force G on z;",
        "input F; input G; constraint h: x = sin(time) by F; constraint k: z = cos(time) by G; force F on x; force G on z; output H = F;",
    ]
    found = [run(body + start + way) for way in ways]
    t = found[0].time
    force = -np.sin(t) - 0.3 * np.cos(t) + np.sin(t) - np.cos(t)
    for one, name in zip(found, ("F", "F", "H"), strict=True):
        np.testing.assert_allclose(one[name], force, atol=1e-9)


@pytest.mark.parametrize(
    "text",
    [
        "output F ~ 0; output G ~ 0; equation x = sin(time); force F on x;",
        "output F ~ 0; equation x = sin(time); equation z = cos(time); force F on x;",
        "output F ~ 0; equation F = 1; equation x = sin(time); force F on x;",
    ],
)
def test_equations_and_forces_must_be_as_many(text: str) -> None:
    body = "dimensionless; coordinate x = 0; coordinate z = 1; kinetic (der(x)^2 + der(z)^2)/2;\n"
    with pytest.raises(CompileError) as raised:
        mechc.loads(body + text).compilation  # noqa: B018
    assert raised.value.diagnostics[0].code in ("E0421", "E0339")
