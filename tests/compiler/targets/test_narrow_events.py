"""A pulse that ends a rest between the steps of a run, as C programs and FMUs meet it."""

from __future__ import annotations

import subprocess
from pathlib import Path

import fmpy
import pytest
from c_programs import build
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import mechc
from mechc.fmu.export import FmuOptions, export_fmu

TEXT = """
model Kicked
  coordinate Length x = 0 m;
  kinetic 1/2*4 kg*der(x)^2;
  force 200 N/(1 + ((time - 3.3 s)/(4 ms))^4) on x;
  friction 3 N on x;
  experiment(stop = 10 s);
end Kicked;
"""


def pushed(t: float) -> float:
    return 200 / (1 + ((t - 3.3) / 4e-3) ** 4)


@pytest.fixture(scope="module")
def slid() -> float:
    """It slides from where the push is 3 N until friction has taken its speed."""
    begin = float(brentq(lambda t: pushed(t) - 3, 3.2, 3.3))
    late = 3.3 + 0.1
    way = solve_ivp(lambda t, y: [y[1], (pushed(t) - 3) / 4], (begin, late), [0, 0], rtol=1e-12, atol=1e-14, max_step=4e-4)  # fmt: skip
    speed = quad(lambda t: (pushed(t) - 3) / 4, begin, late, points=[3.29, 3.3, 3.31], epsabs=1e-13)[0]
    assert way.y[1, -1] == pytest.approx(speed, abs=1e-10)
    ended = lambda t, y: float(y[1])  # noqa: E731
    ended.terminal = True  # type: ignore[attr-defined]
    rest = solve_ivp(lambda t, y: [y[1], (pushed(t) - 3) / 4], (late, 10), way.y[:, -1], rtol=1e-12, atol=1e-14, max_step=0.01, events=ended)  # fmt: skip
    return float(rest.y_events[0][0][0])


def test_a_c_program(slid: float, tmp_path: Path) -> None:
    mechc.loads(TEXT).compile("c", tmp_path)
    done = subprocess.run([build(tmp_path, tmp_path)], capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    column = [head.split(" ")[0] for head in lines[0].split(",")].index("x")
    assert float(lines[-1].split(",")[column]) == pytest.approx(slid, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("fmi", ["2", "3"])
def test_an_fmu(fmi: str, slid: float, tmp_path: Path) -> None:
    (path,) = export_fmu(mechc.loads(TEXT), tmp_path / "kicked.fmu", FmuOptions(fmi=fmi, kind="cs"))
    found = fmpy.simulate_fmu(str(path), stop_time=10, output_interval=1.0, output=["x"])
    assert found["x"][-1] == pytest.approx(slid, rel=1e-5)
