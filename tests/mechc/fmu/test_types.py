"""Parameters and inputs that are whole numbers or truth values keep their types in FMUs, and importers set them."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import fmpy
import numpy as np
import pytest

import mechc
from mechc.fmu.export import FmuOptions, export_fmu
from mechc.fmu.run import run_fmu

TEXT = """
model Typed
  parameter Integer n[2](min = 1, max = 9) = {1, 2};
  parameter Boolean on = true;
  input Integer k = 2;
  input Boolean held = false;
  coordinate Length x = 0 m;
  kinetic 1/2*1 kg*der(x)^2; potential 1/2*100 N/m*x^2;
  force (if on then 1 N else 0 N) + k*1 N + (if held then 1 N else 0 N) + n[2]*1 N on x;
  experiment(stop = 0.3 s);
end Typed;
"""


@pytest.mark.slow
def test_types_are_kept_and_set(tmp_path: Path) -> None:
    model = mechc.loads(TEXT)
    paths = export_fmu(model, tmp_path / "typed.fmu", FmuOptions("both"))
    names = {"Real": "Float64", "Integer": "Int32"}
    for path in paths:
        types = {v.name: names.get(v.type, v.type) for v in fmpy.read_model_description(path).modelVariables}
        wanted = {"n[1]": "Int32", "n[2]": "Int32", "on": "Boolean", "k": "Int32", "held": "Boolean"}
        assert {name: types[name] for name in wanted} == wanted and types["x"] == "Float64"
    native = model.simulate(set={"n[2]": 3, "on": 0, "k": 4, "held": 1}, every=0.01)
    for path, kind in product(paths, ("me", "cs")):
        given = {"n[2]": "3", "on": "false", "k": "4", "held": "true"}
        found = run_fmu(path, kind=kind, every=0.01, values=given)
        assert np.abs(found["x"] - native["x"]).max() < 1e-5
        assert native["x"].max() > 0.1
