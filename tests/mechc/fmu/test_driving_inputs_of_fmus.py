"""FMUs whose inputs drive coordinates: the importer sets these with two derivatives, against SciPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from click.testing import CliRunner
from scipy.integrate import solve_ivp

import mechc
from mechc.cli.main import mechc as program
from mechc.fmu.export import FmuOptions, export_fmu

ROAD = """\
model Road
  input Length road(interpolation = "spline") = 0 m;
  coordinate Length s = 0 m;
  coordinate Length x = 0 m;
  drive s = road;
  kinetic 1/2*(2 kg)*der(x)^2 + 1/2*(1 kg)*der(s)^2;
  potential 1/2*(200 N/m)*(x - s)^2;
  damping 4 N.s/m on x - s;
  output Force push = reaction(s);
  experiment(stop = 1 s);
end Road;
"""
NAMES = ("road", "der(road)", "der(road,2)")
W = 3.0


def told(t: Any) -> tuple[Any, Any, Any]:
    """The road, 0.1 m (1 - cos w t), and its derivatives."""
    return 0.1 * (1 - np.cos(W * t)), 0.1 * W * np.sin(W * t), 0.1 * W * W * np.cos(W * t)


def body(t: float, y: Any) -> list[float]:
    s, v, _ = told(t)
    return [y[1], (-200 * (y[0] - s) - 4 * (y[1] - v)) / 2]


MOTION = solve_ivp(body, (0, 1), [0, 0], rtol=1e-12, atol=1e-14, dense_output=True).sol


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    folder = tmp_path_factory.mktemp("fmus")
    export_fmu(mechc.loads(ROAD), folder / "road.fmu", FmuOptions(fmi="both"))
    return {version: folder / f"fmi{version}" / "road.fmu" for version in (2, 3)}


def signals(names: tuple[str, ...] = NAMES) -> Any:
    times = np.linspace(0, 1, 1001)
    rows = np.zeros(times.size, dtype=[("time", float), *((n, float) for n in names)])
    rows["time"] = times
    for name, values in zip(NAMES, told(times), strict=True):
        if name in names:
            rows[name] = values
    return rows


def simulated(file: Path, kind: str, step: float, rows: Any, **more: Any) -> Any:
    options = {"fmi_type": kind, "stop_time": 1, "output_interval": step, "input": rows}
    return fmpy.simulate_fmu(str(file), output=["x", "s", "push"], **options, **more)


@pytest.mark.parametrize("version", [2, 3])
def test_errors_fall_with_the_third_power_of_the_step(files: dict[int, Path], version: int) -> None:
    """What is left out during a step is s''' h^3/6, 0.45 h^3 at most."""
    for step in (0.02, 0.01):
        found = simulated(files[version], "CoSimulation", step, signals())
        off = np.abs(found["s"] - told(found["time"])[0]).max()
        assert off == pytest.approx(0.1 * W**3 * step**3 / 6, rel=0.01)
        assert np.abs(found["x"] - MOTION(found["time"])[0]).max() < 4 * off


@pytest.mark.parametrize("version", [2, 3])
def test_an_importer_that_integrates_sets_all_three(files: dict[int, Path], version: int) -> None:
    """fmpy holds inputs over a step, so the error falls with the step."""
    off = []
    for step in (0.01, 0.005):
        found = simulated(files[version], "ModelExchange", step, signals(), relative_tolerance=1e-8)
        s, v, a = told(found["time"])
        np.testing.assert_allclose(found["s"], s, atol=1e-15)
        y = MOTION(found["time"])
        off.append(np.abs(found["x"] - y[0]).max())
        pushed = a - 200 * (y[0] - s) - 4 * (y[1] - v)
        assert np.abs(found["push"] - pushed)[1:].max() < 0.15 * np.abs(pushed).max()
    assert off[0] / off[1] == pytest.approx(2, rel=0.1)
    assert off[1] < 2e-3


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
@pytest.mark.parametrize(
    ("names", "words"),
    [
        (NAMES[:1], "the input 'road' moves, though its first derivative is set to 0: connect this, too"),
        (NAMES[:2], "'road' changes its rate, though its second derivative is set to 0"),
    ],
)
def test_derivatives_that_are_left_out_are_missed(
    files: dict[int, Path], kind: str, names: tuple[str, ...], words: str, capfd: pytest.CaptureFixture[str]
) -> None:
    for file in files.values():
        with pytest.raises(Exception, match="failed with status 3"):
            simulated(file, kind, 0.01, signals(names))
        assert words in capfd.readouterr().out


def test_the_command_takes_them_from_the_table(files: dict[int, Path], tmp_path: Path) -> None:
    """A spline through 81 rows, as 'mechc run' has it."""
    times = np.linspace(0, 1, 81)
    table, output = tmp_path / "road.csv", tmp_path / "out.csv"
    rows = zip(times.tolist(), (1000 * told(times)[0]).tolist(), strict=True)
    table.write_text("time [s],road [mm]\n" + "".join(f"{t!r},{s!r}\n" for t, s in rows))
    wanted: Any = mechc.loads(ROAD).simulate(inputs={"road": table}, tolerance=1e-10)
    order = ["fmu", "run", str(files[3]), "--kind", "cs", "--input", f"road={table}", "--every", "0.001"]
    done = CliRunner().invoke(program, [*order, "--stop", "1", "-o", str(output)], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    head, *lines = output.read_text().splitlines()
    columns = [name.split(" [")[0] for name in head.split(",")][:2]
    assert columns == ["time", "x"]
    for line in lines[::10]:
        t, x = (float(v) for v in line.split(",")[:2])
        assert x == pytest.approx(wanted(t)["x"], abs=1e-6)  # straight lines between 16 places of each row


def test_a_saved_state_holds_what_the_fmu_was_told(files: dict[int, Path]) -> None:
    """Back to a saved state and on with the same inputs: the same bits."""
    description: Any = fmpy.read_model_description(str(files[3]))
    known = {v.name: v.valueReference for v in description.modelVariables}
    slave: Any = fmpy.instantiate_fmu(fmpy.extract(str(files[3])), description, "CoSimulation")
    slave.enterInitializationMode()
    slave.exitInitializationMode()

    def stepped(t: float) -> tuple[float, ...]:
        slave.setFloat64([known[n] for n in NAMES], [float(v) for v in told(t)])
        slave.doStep(t, 0.01)
        return tuple(slave.getFloat64([known[n] for n in ("x", "s", "der(x)", "road")]))

    for k in range(20):
        stepped(k / 100)
    state = slave.getFMUState()
    once = [stepped(0.2 + k / 100) for k in range(10)]
    slave.setFMUState(state)
    assert [stepped(0.2 + k / 100) for k in range(10)] == once
    slave.terminate()
    slave.freeInstance()


def test_derivatives_of_inputs_by_their_function(files: dict[int, Path]) -> None:
    """fmi2SetRealInputDerivatives does the same as to set the inputs that hold them; of other variables it is refused."""
    description: Any = fmpy.read_model_description(str(files[2]))
    assert description.coSimulation.canInterpolateInputs
    known = {v.name: v.valueReference for v in description.modelVariables}
    ends = []
    for by_function in (True, False):
        slave: Any = fmpy.instantiate_fmu(fmpy.extract(str(files[2])), description, "CoSimulation")
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        for k in range(20):
            s, v, a = (float(x) for x in told(k / 100))
            slave.setReal([known["road"]], [s])
            if by_function:
                slave.setRealInputDerivatives([known["road"]] * 2, [1, 2], [v, a])
            else:
                slave.setReal([known["der(road)"], known["der(road,2)"]], [v, a])
            slave.doStep(k / 100, 0.01)
        ends.append(slave.getReal([known[n] for n in ("x", "s", "push")]))
        if by_function:
            with pytest.raises(Exception, match="failed with status 3"):
                slave.setRealInputDerivatives([known["road"]], [3], [0.0])
        slave.freeInstance()
    assert ends[0] == ends[1]


@pytest.mark.parametrize("arrays", [False, True])
def test_elements_of_an_array_drive(arrays: bool, tmp_path: Path) -> None:
    text = ROAD.replace(
        'road(interpolation = "spline") = 0 m', 'road[2](interpolation = "spline") = {0 m, 0 m}'
    )
    file = tmp_path / "arrays.fmu"
    model = mechc.loads(text.replace("drive s = road;", "drive s = road[1] + road[2];"))
    export_fmu(model, file, FmuOptions(arrays=arrays))
    description: Any = fmpy.read_model_description(str(file))
    inputs = {v.name for v in description.modelVariables if v.causality == "input"}
    assert {"der(road[1])", "der(road[1],2)", "der(road[2])", "der(road[2],2)"} <= inputs
