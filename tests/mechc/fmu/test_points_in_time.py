"""Units do not end their steps at points of tables, nor at kinks, of the time: their check compares them with a run that does not either."""

from __future__ import annotations

from pathlib import Path

import pytest

import mechc
from mechc.fmu.export import FmuOptions, export_fmu
from mechc.runtime.native.build import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")


@pytest.mark.parametrize(
    "law", ["table(time/(1 s), {0, 1, 2, 3, 4, 5}, {0, 1, 0, 2, 0, 1})", "max(0, time/(1 s) - 2.3)"]
)
def test_a_unit_is_written(law: str, tmp_path: Path) -> None:
    pytest.importorskip("fmpy")
    text = f"coordinate Length x = 1 cm;kinetic 1/2*1 kg*der(x)^2;potential 1/2*1 N/m*x^2;force 1 N*{law} on x;experiment(stop = 5 s);"
    options = FmuOptions("3", "cs", None, False, True, ("host",), False)
    export_fmu(mechc.loads(text), tmp_path / "unit.fmu", options)
    assert (tmp_path / "unit.fmu").exists()
