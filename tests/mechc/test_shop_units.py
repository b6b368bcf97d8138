"""Units of workshops and test benches, in texts, values of a command, heads of tables and what is shown."""

from __future__ import annotations

from pathlib import Path

import pytest

import mechc
from mechc.cli.main import run

PRESS = """
parameter bore = 2 inch;
parameter p = 1500 psi;
parameter efficiency = 95 %;
parameter m = 300 lb;
parameter Torque T = 30 Nm;
coordinate x(display = "ft") = 0 ft;
initial der(x) = 3 mph;
kinetic 1/2*m*der(x)^2;
force efficiency*p*pi/4*bore^2 on x;
output share(display = "%") = x/20 ft;
output volume(display = "l") = pi/4*bore^2*x;
output effort(display = "hp") = efficiency*p*pi/4*bore^2*der(x);
output arm(display = "lbf.ft") = T;
experiment(stop = 0.1 s);
"""
AREA = 3.14159265358979 / 4 * (2 * 0.0254) ** 2
FORCE = 0.95 * 1500 * 6894.757293168361 * AREA


def test_a_model_in_units_of_a_workshop_is_that_in_si() -> None:
    solution = mechc.loads(PRESS).simulate()
    t, speed = 0.1, 3 * 0.44704
    x = speed * t + FORCE / (300 * 0.45359237) / 2 * t**2
    assert solution["x"][-1] == pytest.approx(x, rel=1e-9)
    assert solution["share"][-1] == pytest.approx(x / (20 * 0.3048), rel=1e-9)
    assert solution["volume"][-1] == pytest.approx(AREA * x, rel=1e-9)


def test_values_are_given_and_shown_in_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "press.mech"
    file.write_text(PRESS)
    assert (
        run(["run", str(file), "--set", "efficiency=50 %", "--set", "T=40 lbf.ft", "--display", "inch,kNm"])
        == 0
    )
    shown = capsys.readouterr().out
    assert "[%]" in shown or " %" in shown
    assert "hp" in shown and "kNm" in shown and "inch" in shown
    assert f"{40 * 1.3558179483314004 / 1000:.6g}"[:7] in shown


def test_heads_of_tables_name_them(tmp_path: Path) -> None:
    table = tmp_path / "push.csv"
    table.write_text("time [s],push [lbf]\n0,10\n1,10\n")
    text = (
        "input Force push = 0; coordinate x = 0 m; initial der(x) = 0 m/s; kinetic 1/2*1 lb*der(x)^2;\n"
        "force push on x; experiment(stop = 1 s);"
    )
    solution = mechc.loads(text).simulate(inputs={"push": table})
    assert solution["x"][-1] == pytest.approx(10 * 9.80665 / 2, rel=1e-9)


def test_the_formatter_keeps_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "press.mech"
    file.write_text(PRESS)
    assert run(["fmt", str(file)]) == 0
    assert all(
        unit in file.read_text() for unit in ("2 inch", "1500 psi", "95 %", "300 lb", "30 Nm", "3 mph")
    )
