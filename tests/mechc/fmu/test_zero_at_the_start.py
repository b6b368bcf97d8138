"""Model Exchange where a condition begins exactly at its zero: importers see a change of sign, none from zero itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mechc
from mechc.fmu.export import FmuOptions, export_fmu
from mechc.runtime.native.build import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")

AT_ZERO = """
parameter wait = 0 s;
coordinate x = 0 m "pulled away from its place at rest, by a law that is stronger after it";
coordinate y = 0 m "moves as it passes";
initial der(y) = -1 m/s;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
force if time >= wait then -1 N else 0 N on x;
force if x < 0 m then -1 N else 0 N on x;
force if y < 0 m then -1 N else 1 N on y;
experiment(stop = 1 s);
"""


@pytest.mark.parametrize("fmi", ["3", pytest.param("2", marks=pytest.mark.slow)])
def test_a_condition_that_begins_at_its_zero(fmi: str, tmp_path: Path) -> None:
    """Nothing is known of its size then. x = -(t - wait)^2 and y = -t - t^2/2; without its events x is a half of that."""
    fmpy = pytest.importorskip("fmpy")
    (unit,) = export_fmu(
        mechc.loads(AT_ZERO), tmp_path / "u.fmu", FmuOptions(fmi, "me", None, False, False, ("host",), False)
    )
    for wait in (0.0, 0.4):
        found = fmpy.simulate_fmu(
            str(unit),
            fmi_type="ModelExchange",
            solver="CVode",
            relative_tolerance=1e-9,
            stop_time=1,
            output_interval=0.1,
            start_values={"wait": wait},
            output=["x", "y"],
        )
        t = found["time"]
        assert np.abs(found["x"] + np.maximum(0, t - wait) ** 2).max() < 1e-6
        assert np.abs(found["y"] + t + t**2 / 2).max() < 1e-6
