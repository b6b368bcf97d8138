"""Models that look back, as every target runs them: the same motion, or a refusal."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from c_programs import build
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmu_models import put, references, restore, save
from wasm_module import WasmRun, needs_wasmtime

import mechc
from mechc.compiler.targets.wasm.link import linked
from mechc.fmu.export import FmuOptions, export_fmu
from mechc.requests.parse_values import UsageMistake
from mechc.runtime.outcome import SimulationError
from mechc.web.kernels import kernel_for, loaded

TEXT = """
model Regulator
  input Real wanted = 1;
  coordinate Length x = 0.2 m;
  discrete Real n = 0;
  kinetic 1/2*1 kg*der(x)^2; potential 1/2*4 N/m*x^2;
  force 1 N*delay(wanted, 0.35 s) - 3 N/m*delay(x, 0.2 s) - 1 N.s/m*delay(der(x), 0.2 s) + 0.1 N*delay(n, 0.15 s) on x;
  when sample(0.1 s) then n := n + 1; end when;
  output w = delay(x, 0.2 s);
  experiment(stop = 2 s, tolerance = 1e-10);
end Regulator;
"""


@pytest.fixture(scope="module")
def model() -> mechc.Model:
    return mechc.loads(TEXT)


@pytest.fixture(scope="module")
def native(model: mechc.Model) -> Any:
    return model.simulate(reproducible=True)


def test_the_c_program_has_the_same_motion(model: mechc.Model, native: Any, tmp_path: Path) -> None:
    model.compile("c", tmp_path)
    done = subprocess.run([build(tmp_path, tmp_path)], capture_output=True, text=True, check=True)
    *_, last = done.stdout.splitlines()
    head = done.stdout.splitlines()[0].split(",")
    row = dict(zip((h.split(" ")[0] for h in head), map(float, last.split(",")), strict=True))
    assert row["x"] == pytest.approx(native["x"][-1], abs=1e-11)
    assert row["w"] == pytest.approx(native["w"][-1], abs=1e-11)


@needs_wasmtime
def test_the_page_has_the_same_motion(model: mechc.Model, native: Any) -> None:
    program = model.compilation.program
    kernel = kernel_for("dop853", events=True)
    machine = WasmRun(linked(program, loaded(kernel), "").module, rows=21)
    status, rows = machine.run(2.0, kernel.methods.index("dop853"), 1e-10)
    assert status == 1
    between = native(np.linspace(0, 2, 21))
    assert np.abs(rows[:, 0] - between["x"]).max() < 1e-9
    outs = machine.array(9, 21 * len(program.arrays["out"])).reshape(21, -1)
    names = [entry.name for entry in program.arrays["out"]]
    assert np.abs(outs[:, names.index("w")] - between["w"]).max() < 1e-9


@pytest.fixture(scope="module", params=[2, 3])
def slave(
    request: pytest.FixtureRequest, model: mechc.Model, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Any]:
    folder = tmp_path_factory.mktemp("fmu")
    options = FmuOptions(fmi=str(request.param), kind="cs")
    (path,) = export_fmu(model, folder / "regulator.fmu", options)
    description = fmpy.read_model_description(str(path))
    kind = FMU2Slave if request.param == 2 else FMU3Slave
    fmu = kind(
        guid=description.guid,
        unzipDirectory=fmpy.extract(str(path), str(folder / "unzipped")),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="one",
    )
    fmu.instantiate()
    yield fmu, references(path)
    fmu.freeInstance()


def begin(fmu: Any) -> None:
    if hasattr(fmu, "setupExperiment"):
        fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()


def get(fmu: Any, reference: int) -> float:
    return float((fmu.getReal if hasattr(fmu, "getReal") else fmu.getFloat64)([reference])[0])


def step(fmu: Any, at: float, length: float) -> None:
    fmu.doStep(currentCommunicationPoint=at, communicationStepSize=length)


@pytest.mark.slow
def test_an_fmu_looks_back_at_inputs_and_goes_back(slave: Any, model: mechc.Model) -> None:
    """Inputs of the importer are kept; a state that is saved has its past, and goes on bit for bit."""
    fmu, named = slave
    begin(fmu)
    times, values = np.array([0, 0.5, 0.5, 1.0, 1.0, 2.0]), np.array([1.0, 1.0, 2.0, 2.0, -1.0, -1.0])
    native = model.simulate(inputs={"wanted": (times, values)})
    kept = b""
    for k in range(20):
        at = 0.1 * k
        if k == 5:
            put(fmu, named["wanted"], 2.0)
        if k == 8:
            kept = save(fmu)
        if k == 10:
            put(fmu, named["wanted"], -1.0)
        step(fmu, at, 0.1)
        assert get(fmu, named["x"]) == pytest.approx(float(native(at + 0.1)["x"]), abs=1e-7), at
        assert get(fmu, named["w"]) == pytest.approx(float(native(at + 0.1)["w"]), abs=1e-7), at
    first = get(fmu, named["x"])
    restore(fmu, kept)
    put(fmu, named["wanted"], 2.0)
    for k in range(8, 20):
        if k == 10:
            put(fmu, named["wanted"], -1.0)
        step(fmu, 0.1 * k, 0.1)
    assert get(fmu, named["x"]) == first


def test_members_of_an_ensemble_are_runs() -> None:
    text = "model M\n parameter T = 1 s; state x = 1; equation der(x) = -delay(x, T)/(1 s); experiment(stop = 5 s);\nend M;"
    model = mechc.loads(text)
    found = model.ensemble({"T": [0.3, 0.7, 1.2]}, "final(x)")
    single = [
        float(model.simulate(set={"T": delay}, estimate_error=False)["x"][-1]) for delay in (0.3, 0.7, 1.2)
    ]
    assert np.abs(np.asarray(found["final(x)"]) - single).max() < 1e-8


@pytest.mark.parametrize("target", ["python", "casadi", "jax"])
def test_modules_of_functions_refuse(model: mechc.Model, target: Any, tmp_path: Path) -> None:
    with pytest.raises(UsageMistake, match="has delays"):
        model.compile(target, tmp_path / "m.py")


@pytest.mark.parametrize("kind", ["me", "both"])
def test_model_exchange_refuses(model: mechc.Model, kind: str, tmp_path: Path) -> None:
    with pytest.raises(UsageMistake, match="Model Exchange"):
        export_fmu(model, tmp_path / "m.fmu", FmuOptions(kind=kind))


def test_taylor_refuses(model: mechc.Model) -> None:
    free = mechc.loads(
        "model M\n state x = 1; equation der(x) = -delay(x, 1 s)/(1 s); experiment(stop = 1 s);\nend M;"
    )
    with pytest.raises(SimulationError, match="it has delays"):
        free.simulate(method="taylor")


@pytest.mark.parametrize(
    "study",
    ["modes", "equilibria", "floquet", "orbit", "lyapunov", "period", "steady", "volume"],
)
def test_studies_of_states_refuse(model: mechc.Model, study: str) -> None:
    with pytest.raises(SimulationError, match="looks back"):
        model.study(study)


def test_derivatives_refuse(model: mechc.Model) -> None:
    with pytest.raises(SimulationError, match="looks back"):
        model.simulate(sensitivity=["wanted"])
    with pytest.raises(SimulationError, match="looks back"):
        _ = model.functions


def test_a_delay_that_is_not_positive_fails() -> None:
    model = mechc.loads(
        "model M\n parameter T = 1 s; state x = 1; equation der(x) = -delay(x, T)/(1 s); experiment(stop = 1 s);\nend M;"
    )
    found = model.simulate(set={"T": 0.0})
    assert found.outcome.value == "failed"
    assert "the delay of 'delay(x, T)' is 0 s: a delay is positive" in found.message
