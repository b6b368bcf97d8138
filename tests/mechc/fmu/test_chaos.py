"""Two runs of an importer that go different ways: chaos where the motion magnifies errors, else an error of the unit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.compiler.targets.fmu import driver
from mechc.fmu.export import FmuOptions, export_fmu
from mechc.lang.diagnostics import CompileError
from mechc.runtime.native.build import find_compiler
from mechc.runtime.problem import Array

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")

STEADY = "coordinate x = 1 m;kinetic 1/2*1 kg*der(x)^2;potential 1/2*4 N/m*x^2;experiment(stop = 5 s);"
UNSTABLE = "coordinate x = 1e-9 m;kinetic 1/2*1 kg*der(x)^2;potential -1/2*16 N/m*x^2 + 1 N/m^3*x^4;experiment(stop = 20 s);"


@pytest.mark.parametrize(
    ("text", "refused"), [pytest.param(STEADY, True, marks=pytest.mark.slow), (UNSTABLE, False)]
)
def test_runs_that_part_are_chaos_only_where_errors_grow(
    text: str, refused: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("fmpy")
    kept = driver.by_cvode

    def parting(path: Path, times: Array, tolerance: float, *, may_fail: bool = False, **more: Any) -> Array:
        """The run, which a looser tolerance takes elsewhere after the middle."""
        rows = kept(path, times, tolerance, may_fail=may_fail, **more)
        late = np.asarray(times)[: len(rows)] > times[-1] / 2
        moved: Array = rows + (0.5 if may_fail else 0.4) * late[:, None]
        return moved

    monkeypatch.setattr(driver, "by_cvode", parting)
    options = FmuOptions("3", "me", None, False, True, ("host",), False)
    if refused:
        with pytest.raises(CompileError, match="the motion is not chaotic"):
            export_fmu(mechc.loads(text), tmp_path / "unit.fmu", options)
    else:
        export_fmu(mechc.loads(text), tmp_path / "unit.fmu", options)


@pytest.mark.parametrize(("off_from", "refused"), [(1e-9, False), (0.0, True)])
def test_what_a_companion_shares_is_an_error_of_the_importer_only_if_it_goes(
    off_from: float, refused: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Runs from a tolerance on are off by 5e-7, and so are their companions."""
    pytest.importorskip("fmpy")
    kept = driver.by_cvode

    def off(path: Path, times: Array, tolerance: float, *, may_fail: bool = False, **more: Any) -> Array:
        moved: Array = kept(path, times, 1e-12, may_fail=may_fail, **more) + (
            5e-7 if tolerance > off_from else 0
        )
        return moved

    monkeypatch.setattr(driver, "by_cvode", off)
    options = FmuOptions("3", "me", None, False, True, ("host",), False)
    if refused:
        with pytest.raises(CompileError, match="Model Exchange differs"):
            export_fmu(mechc.loads(STEADY), tmp_path / "unit.fmu", options)
    else:
        export_fmu(mechc.loads(STEADY), tmp_path / "unit.fmu", options)
