"""Arrays of FMI 3: scalars that are alike make one variable, with the same motion, values and derivatives."""

from __future__ import annotations

import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest

from mechc.api import loads
from mechc.cli.main import run as main
from mechc.compiler.targets.fmu import driver
from mechc.compiler.targets.fmu.arrays import element_names
from mechc.compiler.targets.fmu.inspect import inspect
from mechc.compiler.targets.fmu.rules import check_description
from mechc.fmu.export import FmuOptions, export_fmu
from mechc.runtime.native.build import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")

GRID = """
model Grid "four masses on springs, in two rows"
  parameter k[2] = {8, 2} N/m;
  parameter m = 2 kg;
  input Force pull[2] = {0.5, 0.1} N;
  coordinate x[2,2] = {{0.1, 0.2}, {0.3, 0.4}} m;
  coordinate y = 0.1 m;
  kinetic 1/2*m*(der(x[1,1])^2 + der(x[1,2])^2 + der(x[2,1])^2 + der(x[2,2])^2 + der(y)^2);
  potential 1/2*k[1]*(x[1,1]^2 + x[2,1]^2 + (y - x[1,1])^2) + 1/2*k[2]*(x[1,2]^2 + x[2,2]^2);
  force pull[1] on x[1,2];
  force pull[2] on y;
  output Length ends[2] = {x[2,2], y};
  experiment(stop = 2 s);
end Grid;
"""


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The same model with arrays and without."""
    folder = tmp_path_factory.mktemp("arrays")
    model = loads(GRID)
    export_fmu(model, folder / "arrays.fmu", FmuOptions(arrays=True))
    export_fmu(model, folder / "scalars.fmu", FmuOptions(check=False))
    return folder / "arrays.fmu", folder / "scalars.fmu"


def references(path: Path) -> dict[str, int]:
    return {v.name: v.valueReference for v in fmpy.read_model_description(str(path)).modelVariables}


def test_the_variables(files: tuple[Path, Path]) -> None:
    description = fmpy.read_model_description(str(files[0]))
    shapes = {v.name: v.shape for v in description.modelVariables if v.shape}
    assert shapes == {
        "x": (2, 2),
        "der(x)": (2, 2),
        "der(x,2)": (2, 2),
        "k": (2,),
        "pull": (2,),
        "ends": (2,),
    }
    by_name = {v.name: v for v in description.modelVariables}
    assert by_name["x"].start == "0.1 0.2 0.3 0.4"
    assert by_name["der(x,2)"].derivative is by_name["der(x)"]
    assert "ends" in [u.variable.name for u in description.outputs]
    assert "y" in by_name and not by_name["y"].shape
    assert not any("[" in name for name in by_name)
    with zipfile.ZipFile(files[0]) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    assert check_description(root) == []


def test_it_passes_its_check(files: tuple[Path, Path]) -> None:
    report = inspect(files[0])
    assert report.passed, report
    assert sum("reference" in line.what for line in report.lines) == 2


def test_the_motion_is_the_same(files: tuple[Path, Path]) -> None:
    times = np.linspace(0.0, 2.0, 9)
    arrays, scalars = (driver.co_simulation(path, times, 0.25) for path in files)
    assert arrays.shape[1] >= 10
    assert np.array_equal(arrays, scalars)


def test_values_are_set_and_got_by_elements(files: tuple[Path, Path]) -> None:
    at = references(files[0])
    with driver.instance(files[0], "me") as fmu:
        fmu.setFloat64([at["k"], at["m"]], [4.0, 16.0, 1.0])
        fmu.setFloat64([at["x"]], [1.0, 2.0, 3.0, 4.0])
        driver.initialise(fmu, 0.0)
        found = fmu.getFloat64([at["ends"], at["y"], at["der(x,2)"]], nValues=7)
        # the accelerations -k x, with the pull 0.5 on x[1,2] and the spring from y on x[1,1]
        wanted = [4.0, 0.1, 0.1, -4.0 + 4.0 * (0.1 - 1.0), -32.0 + 0.5, -12.0, -64.0]
        assert list(found) == pytest.approx(wanted, rel=1e-14)
        for references_, count in (([at["x"]], 3), ([at["x"]], 5), ([at["x"] + 1], 1), ([10_000], 1)):
            with pytest.raises(Exception, match="status"):
                fmu.getFloat64(references_, nValues=count)


def test_derivatives_by_elements(files: tuple[Path, Path]) -> None:
    at = references(files[0])
    with driver.instance(files[0], "me") as fmu:
        driver.initialise(fmu, 0.0)
        unknowns, knowns = [at["der(x,2)"], at["ends"]], [at["x"], at["pull"]]
        seed = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
        forward = fmu.getDirectionalDerivative(unknowns, knowns, seed, nSensitivity=6)
        # (-(k1 + k1) x11, -k2 x12 + pull1, -k1 x21, -k2 x22) / m; ends are x22 and y
        wanted = [-16.0 / 2, (-4.0 + 5.0) / 2, -24.0 / 2, -8.0 / 2, 4.0, 0.0]
        assert list(forward) == pytest.approx(wanted, rel=1e-14)
        weights = [0.5, -1.0, 2.0, 0.25, 3.0, 7.0]
        backward = fmu.getAdjointDerivative(unknowns, knowns, weights, nSensitivity=6)
        assert np.dot(weights, forward) == pytest.approx(np.dot(backward, seed), rel=1e-14)
        with pytest.raises(Exception, match="status"):
            fmu.getDirectionalDerivative(unknowns, knowns, seed[:5], nSensitivity=6)


def test_names_of_elements() -> None:
    assert element_names("r", ()) == ["r"]
    assert element_names("a.r", (2,)) == ["a.r[1]", "a.r[2]"]
    assert element_names("der(r,2)", (1, 2)) == ["der(r[1,1],2)", "der(r[1,2],2)"]
    assert element_names("der(r)", (2,)) == ["der(r[1])", "der(r[2])"]


def test_a_run_shows_the_elements(files: tuple[Path, Path], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fmu", "run", str(files[0]), "--stop", "0.5"]) == 0
    assert "x[1,1] [m]" in capsys.readouterr().out
