"""Sampled controllers behind filters, in an array of parts: a run, a C program, an FMU and a page have the same bits.

The signals are polynomials and tables: sines of a page come from another library than those of the machine and may end by one bit
otherwise.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browsers import Opened, needs_browser
from c_programs import check_rows
from fmu_models import written
from wasm_module import WasmRun, needs_wasmtime

import mechc
from mechc.compiler.targets.fmu import driver
from mechc.compiler.targets.fmu.checks import native_motion
from mechc.compiler.targets.wasm.link import linked
from mechc.runtime.native.build import find_compiler
from mechc.web.kernels import KERNELS, loaded
from mechc.web.page import page

needs_compiler = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")
pytestmark = pytest.mark.slow

AXES = """
import mech.control.*;
model Axis
  input Length target;
  parameter Mass m = 2 kg;
  coordinate Length x = 0 m;
  kinetic 1/2*m*der(x)^2;
  Filter measured(u = x, order = 2, cutoff = 40 Hz);
  SampledPID c(target = target, measured = measured.y, k = 400 N/m, period = 4 ms, Ti = 0.2 s, Td = 80 ms,
               Tf = 4 ms, Tt = 50 ms, low = -6 N, high = 6 N, weight = 0.8);
  let Force help = table(der(x), {-1, -0.1, 0, 0.1, 1} m/s, {-0.6, -0.4, 0, 0.4, 0.6} N, "linear", "hold");
  force c.y + help - 0.5 N.s/m*der(x) on x;
end Axis;

model Axes
  let Real s = time/(1 s);
  let Length way = 0.1 m*table(time, {0, 0.3, 0.6, 1} s, {0, 1, 1, -1}, "linear", "hold") - 0.05 m*step(time, 0.7 s);
  Axis axis[3](target = {0.1 m, 0.2 m*(3*s^2 - 2*s^3) + 0.05 m*step(time, 0.2 s), way}, m = {1, 2, 4} kg);
  output Force push[3] = axis.c.y;
  experiment(stop = 1 s, every = 10 ms, tolerance = 1e-8, method = "dop853");
end Axes;
"""
ROWS = 101


@pytest.fixture(scope="module")
def native() -> mechc.Solution:
    """A reproducible run: 250 samples of each controller, and each is at a limit for a while."""
    solution = mechc.loads(AXES, model="Axes").simulate(reproducible=True, estimate_error=False)
    for k in (1, 2, 3):
        push = np.abs(solution[f"push[{k}]"])
        assert 5 < np.count_nonzero(push == 6) < 0.9 * len(push)
    assert len(solution.events) >= 3 * 250
    return solution


def check(native: mechc.Solution, names: list[str], rows: np.ndarray[Any, Any]) -> None:
    """Rows at equal times have the bits of a side of the run."""
    ours = np.column_stack([native[name] for name in names])
    assert len(rows) == ROWS
    for k, row in enumerate(rows):
        sides = ours[np.abs(np.asarray(native.time) - k / 100) < 1e-12]
        assert any(np.array_equal(row, side) for side in sides), (k, row - sides[-1])


@needs_compiler
def test_a_program_in_c(tmp_path: Path) -> None:
    (tmp_path / "objects").mkdir()
    check_rows(mechc.loads(AXES, model="Axes"), tmp_path / "program", tmp_path / "objects")


@needs_compiler
@pytest.mark.parametrize("fmi", [2, 3])
def test_an_fmu(tmp_path: Path, fmi: int) -> None:
    path, start = written(tmp_path, AXES, fmi)
    motion = native_motion(start, "dop853", 31)
    assert np.array_equal(driver.co_simulation(path, motion.times, motion.step), motion.states)


@needs_wasmtime
def test_the_code_of_a_page(native: mechc.Solution) -> None:
    program = mechc.loads(AXES, model="Axes", keep={"scene"}).compilation.program
    kernel = KERNELS[2]
    module = linked(program, loaded(kernel), program.experiments[0].name).module
    run = WasmRun(module, ROWS)
    _, rows = run.run(1.0, kernel.methods.index("dop853"), 1e-8)
    check(native, [q.name for q in native.problem.states], rows)
    assert run.instance.call("web_n_events") == len(native.events)


@needs_browser
def test_a_page_in_a_browser(native: mechc.Solution, browser: Any, tmp_path: Path) -> None:
    """All digits of the table that it gives: states and pushes at all times of the run's rows and events."""
    path = tmp_path / "axes.html"
    path.write_text(page(mechc.loads(AXES, model="Axes")), encoding="utf-8")
    shown = Opened(browser, path)
    found = shown.columns()
    names = [name for name in found if name in native.quantities and name != "time"]
    assert {"axis[1].x", "der(axis[3].x)", "axis[2].measured.chain.x[2]", "push[3]"} <= set(names)
    ours = np.column_stack([native[name] for name in ("time", *names)])
    theirs = np.column_stack([found[name] for name in ("time", *names)])
    shown_rows = {row.tobytes() for row in theirs}  # it has more rows than the run
    lost = [row for row in ours if row.tobytes() not in shown_rows]
    assert len(ours) > 3 * ROWS and not lost, lost[0]
    assert shown.said == []
