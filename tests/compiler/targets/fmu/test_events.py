"""Models with events: the native motion to the bit in Co-Simulation, event mode, and an integrator of its own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Model
from fmpy.fmi3 import FMU3Model, FMU3Slave
from fmu_models import DRIVEN, packed, put, references, restore, save, states, written
from msgspec.structs import replace

from mechc.compiler.targets.fmu import driver
from mechc.compiler.targets.fmu.checks import native_motion
from mechc.compiler.targets.fmu.rules import check_file
from mechc.runtime.inputs import constant
from mechc.runtime.integrate.solver import Solver
from mechc.runtime.native import kernel as native
from mechc.runtime.native.build import find_compiler
from mechc.runtime.native.status import Status

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")

MIXED = """
model Mixed "a ball that bounces and is kicked now and then, until it has been kicked often enough"
  parameter g = 9.81 m/s^2;
  parameter e = 0.7;
  parameter kick = 0.5 m/s;
  coordinate h = 1 m;
  kinetic 1/2*(0.1 kg)*der(h)^2;
  potential 0.1 kg*g*h;
  discrete Integer kicks = 0;
  discrete Boolean high = true;
  discrete Length top = 0 m;
  contact floor: h restitution e;
  when h > 0.5 m then high := true; elsewhen h < 0.5 m then high := false; end when;
  when sample(0.3 s) then reinit(der(h), der(h) + kick); kicks := kicks + 1; top := h; end when;
  when kicks > 6 then terminate("kicked often enough"); end when;
  output force = multiplier(floor);
  experiment(stop = 3 s, tolerance = 1e-8);
end Mixed;
"""

SLIDING = """
model Sliding "a block on a rough floor, pulled to and fro"
  parameter m = 1 kg;
  coordinate x = 0 m;
  initial der(x) = 1 m/s;
  input Force F = 0 N;
  kinetic 1/2*m*der(x)^2;
  friction 2 N static 3 N on x, law = "stick";
  force F on x;
  experiment(stop = 2 s, tolerance = 1e-8);
end Sliding;
"""

BREAKS = """
model Breaks "ends where its root does, or where an assertion of its event is wrong"
  parameter limit = 2 m;
  coordinate x = 0 m;
  initial der(x) = 1 m/s;
  kinetic 1/2*(1 kg)*der(x)^2;
  force 1e-9 N*sqrt(1 - x/(1 m)) on x;
  when x > 0.5 m then assert limit > 1 m, "the limit is too low"; end when;
  experiment(stop = 0.9 s, tolerance = 1e-8);
end Breaks;
"""


@pytest.fixture(scope="module", params=[pytest.param(2, marks=pytest.mark.slow), 3])
def mixed(request: Any, tmp_path_factory: Any) -> tuple[Path, Any, int]:
    path, start = written(tmp_path_factory.mktemp("mixed"), MIXED, request.param)
    return path, start, request.param


def test_is_valid_with_indicators_and_typed_variables(mixed: tuple[Path, Any, int]) -> None:
    path, _, fmi = mixed
    assert [problem.text for problem in check_file(path)] == []
    description = fmpy.read_model_description(str(path))
    assert int(description.numberOfEventIndicators) == 3  # two comparisons, and the floor
    kinds = {v.name: (v.type, v.variability, v.causality) for v in description.modelVariables}
    integer, real = ("Integer", "Real") if fmi == 2 else ("Int32", "Float64")
    assert kinds["kicks"] == (integer, "discrete", "output")
    assert kinds["high"] == ("Boolean", "discrete", "output")
    assert kinds["top"] == (real, "discrete", "output")


def test_co_simulation_has_the_bits_of_the_native_run(mixed: tuple[Path, Any, int]) -> None:
    path, start, _ = mixed
    native = native_motion(start, "dop853", 31)
    assert native.times[-1] == 6 * 0.3  # the seventh kick, the first at the start
    assert np.array_equal(driver.co_simulation(path, native.times, native.step), native.states)


def test_another_integrator_follows_through_all_events(mixed: tuple[Path, Any, int]) -> None:
    """Measured: 4e-8 with either version at a tolerance of CVode of 1e-10."""
    path, start, _ = mixed
    native = native_motion(start, "dop853", 31)
    times, rows = native.times, native.states
    found = driver.by_cvode(path, times[:-1], 1e-10)
    assert np.max(np.abs(found - rows[:-1]) / (start.nominal + np.max(np.abs(rows), axis=0))) < 1e-6


def discrete_values(fmu: Any, at: dict[str, int]) -> tuple[int, bool, float]:
    if hasattr(fmu, "getInteger"):
        kicks, high = fmu.getInteger([at["kicks"]])[0], fmu.getBoolean([at["high"]])[0]
    else:
        kicks, high = fmu.getInt32([at["kicks"]])[0], fmu.getBoolean([at["high"]])[0]
    return int(kicks), bool(high), driver.numbers(fmu, [at["top"]])[0]


def update(fmu: Any) -> tuple[Any, ...]:
    """One pass of event mode: (again, ends, nominals, values, next defined, next)."""
    return tuple(fmu.newDiscreteStates() if hasattr(fmu, "newDiscreteStates") else fmu.updateDiscreteStates())


def test_event_mode_tells_what_has_changed(mixed: tuple[Path, Any, int]) -> None:
    path, _, _ = mixed
    at = references(path)
    with driver.instance(path, "me") as fmu:
        driver.initialise(fmu, 0.0)
        assert discrete_values(fmu, at) == (0, True, 0.0)
        # the tick at the start kicks
        assert update(fmu)[:5] == (False, False, False, True, True)
        assert update(fmu)[3:] == (False, True, 0.3)
        assert discrete_values(fmu, at) == (1, True, 1.0)
        assert driver.numbers(fmu, [at["der(h)"]]) == [0.5]
        fmu.enterContinuousTimeMode()
        # an importer that is late, and has passed the comparison meanwhile
        fmu.setTime(0.3 + 2e-12)
        set_states(fmu, [0.4, -2.0, 0.0, 0.0])
        fmu.enterEventMode()
        again, ends, _, values, defined, following = update(fmu)
        assert (again, ends, values, defined, following) == (False, False, True, True, 0.6)
        assert discrete_values(fmu, at) == (2, False, 0.4)
        assert driver.numbers(fmu, [at["der(h)"]]) == [-1.5]
        # one that has slept for long gets one tick with each pass
        fmu.enterContinuousTimeMode()
        fmu.setTime(1.3)
        fmu.enterEventMode()
        assert [update(fmu)[0] for _ in range(3)] == [True, True, False]
        assert discrete_values(fmu, at)[0] == 5


def set_states(fmu: FMU2Model | FMU3Model, values: list[float]) -> None:
    from ctypes import c_double

    fmu.setContinuousStates((c_double * len(values))(*values), len(values))


def test_state_in_the_middle_of_events(mixed: tuple[Path, Any, int]) -> None:
    """Another instance goes on to the bit; a step that is taken back leaves no trace; reset gives a fresh unit."""
    path, *_ = mixed
    shown = [references(path)[n] for n in ("h", "der(h)", "top", "energy.dissipated")]
    step = 0.0625
    with driver.instance(path, "cs") as first, driver.instance(path, "cs") as second:
        driver.initialise(first, 0.0)
        for k in range(10):
            driver.do_step(first, k * step, step)
        kept = save(first)
        for k in range(10, 20):
            driver.do_step(first, k * step, step)
        wanted = driver.numbers(first, shown)
        restore(second, kept)
        for k in range(10, 20):
            driver.do_step(second, k * step, step)
        assert driver.numbers(second, shown) == wanted
        restore(first, kept)
        driver.do_step(first, 10 * step, 3 * step)
        restore(first, kept)
        for k in range(10, 20):
            driver.do_step(first, k * step, step)
        assert driver.numbers(first, shown) == wanted
        first.reset()
        driver.initialise(first, 0.0)
        for k in range(20):
            driver.do_step(first, k * step, step)
        assert driver.numbers(first, shown) == wanted


def test_an_assertion_of_an_event_is_told_and_the_step_undone(tmp_path: Path) -> None:
    path, _ = written(tmp_path, BREAKS, 3)
    at = references(path)
    with driver.instance(path, "cs") as fmu:
        put(fmu, at["limit"], 0.5)
        driver.initialise(fmu, 0.0)
        driver.do_step(fmu, 0.0, 0.25)
        before = save(fmu)
        with pytest.raises(Exception, match="status 3"):
            driver.do_step(fmu, 0.25, 0.5)
        assert driver.numbers(fmu, [0]) == [0.25]
        restore(fmu, before)
        driver.do_step(fmu, 0.25, 0.125)


@pytest.mark.parametrize("fmi", [pytest.param(2, marks=pytest.mark.slow), 3])
def test_what_is_undefined_discards_the_step(fmi: int, tmp_path: Path) -> None:
    path, _ = written(tmp_path, BREAKS, fmi)
    at = references(path)
    shown = [at["x"], at["der(x)"]]
    with driver.instance(path, "cs") as fmu:
        driver.initialise(fmu, 0.0)
        driver.do_step(fmu, 0.0, 0.75)
        before, kept = driver.numbers(fmu, shown), save(fmu)
        with pytest.raises(Exception, match="status 2"):  # Discard
            driver.do_step(fmu, 0.75, 0.5)
        assert driver.numbers(fmu, [0, *shown]) == [0.75, *before]
        restore(fmu, kept)  # FMI 2 asks for it
        driver.do_step(fmu, 0.75, 0.125)
    with driver.instance(path, "me") as fmu:
        driver.initialise(fmu, 0.0)
        update(fmu)
        fmu.enterContinuousTimeMode()
        set_states(fmu, [2.0, 1.0, 0.0])
        with pytest.raises(Exception, match="status 2"):
            driver.numbers(fmu, [at["der(x,2)"]])
        set_states(fmu, [0.0, 1.0, 0.0])
        assert driver.numbers(fmu, [at["der(x,2)"]]) == [1e-9]


def slave(path: Path, **options: Any) -> FMU3Slave:
    """Load an FMU 3 for Co-Simulation with options of the instance."""
    description = fmpy.read_model_description(str(path))
    fmu = FMU3Slave(
        guid=description.guid,
        unzipDirectory=fmpy.extract(str(path)),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="tested",
    )
    fmu.instantiate(**options)
    return fmu


def test_event_mode_of_co_simulation_stops_at_each_event(tmp_path: Path) -> None:
    """Steps end early at events, which wait for event mode; the motion keeps the bits of the native run."""
    path, start = written(tmp_path, MIXED, 3)
    native = native_motion(start, "dop853", 31)
    times, rows = native.times, native.states
    at = references(path)
    shown = [at[n] for n in ("h", "der(h)")]
    fmu = slave(path, eventModeUsed=True, earlyReturnAllowed=True)
    driver.initialise(fmu, 0.0)
    fmu.updateDiscreteStates()
    fmu.enterStepMode()
    found, stops = [driver.numbers(fmu, shown)], []
    for goal in times[1:-1]:
        time = float(driver.numbers(fmu, [0])[0])
        while time < goal:
            event, _, early, time = fmu.doStep(time, goal - time)
            assert early == (time < goal)
            if event:
                speed = driver.numbers(fmu, shown)[1]
                fmu.enterEventMode()
                changed = fmu.updateDiscreteStates()[3]
                stops.append((time, changed, speed != driver.numbers(fmu, shown)[1]))
                fmu.enterStepMode()
        found.append(driver.numbers(fmu, shown))
    fmu.terminate()
    fmu.freeInstance()
    assert np.array_equal(np.array(found), rows[:-1, :2])
    assert [t for t, _, _ in stops if abs(t / 0.3 - round(t / 0.3)) < 1e-9] == [0.3 * k for k in range(1, 6)]
    assert all(changed == jumped for _, changed, jumped in stops)
    assert any(jumped for t, _, jumped in stops if abs(t / 0.3 - round(t / 0.3)) > 1e-3)  # impacts


def test_intermediate_updates_see_the_motion_and_may_stop_it(tmp_path: Path) -> None:
    path, _ = written(tmp_path, SLIDING, 3)
    at = references(path)
    seen: list[tuple[float, float]] = []
    holder: list[Any] = []

    def told(
        _: Any,
        time: float,
        set_requested: bool,
        get_allowed: bool,
        finished: bool,
        may_return: bool,
        *out: Any,
    ) -> None:
        assert (set_requested, get_allowed, finished, may_return) == (False, True, True, True)
        seen.append((time, driver.numbers(holder[0], [at["x"]])[0]))
        if len(seen) == 2:
            out[0][0], out[1][0] = True, time

    fmu = slave(path, earlyReturnAllowed=True, intermediateUpdate=told)
    holder.append(fmu)
    driver.initialise(fmu, 0.0)
    _, _, early, last = fmu.doStep(0.0, 0.4)
    assert early and last == seen[1][0] < 0.4
    assert [x for _, x in seen] == pytest.approx([t - t * t for t, _ in seen], rel=1e-12)
    _, _, early, last = fmu.doStep(last, 0.4 - last)
    assert not early and last == 0.4
    assert [t for t, _ in seen] == sorted({t for t, _ in seen})
    fmu.terminate()
    fmu.freeInstance()


@pytest.mark.parametrize("fmi", [pytest.param(2, marks=pytest.mark.slow), 3])
def test_output_derivatives(fmi: int, tmp_path: Path) -> None:
    """Fourth-order differences of the states over steps of 1/256 s: an error of h^4 = 2e-10."""
    path, _ = written(tmp_path, DRIVEN, fmi)
    at = references(path)
    shown = [at["stretch"], at["energy.total"]]
    h, rows, told = 1 / 256, [], []
    with driver.instance(path, "cs") as fmu:
        driver.initialise(fmu, 0.0)
        for k in range(5):
            rows.append(driver.numbers(fmu, shown))
            told.append(output_derivatives(fmu, shown))
            driver.do_step(fmu, k * h, h)
    table = np.array(rows)
    wanted = (table[0] - 8 * table[1] + 8 * table[3] - table[4]) / (12 * h)
    assert told[2] == pytest.approx(wanted, rel=1e-8, abs=1e-9)


def output_derivatives(fmu: Any, shown: list[int]) -> list[float]:
    from ctypes import c_double, c_int, c_size_t, c_uint

    n = len(shown)
    out = (c_double * n)()
    if hasattr(fmu, "fmi2GetRealOutputDerivatives"):
        fmu.fmi2GetRealOutputDerivatives(
            fmu.component, (c_uint * n)(*shown), c_size_t(n), (c_int * n)(*[1] * n), out
        )
    else:
        fmu.fmi3GetOutputDerivatives(
            fmu.component, (c_uint * n)(*shown), c_size_t(n), (c_int * n)(*[1] * n), out, c_size_t(n)
        )
    return list(out)


def pull(t: float) -> float:
    return 5.0 if 0.5 < t < 1.0 else -2.5


@pytest.mark.parametrize("fmi", [pytest.param(2, marks=pytest.mark.slow), 3])
def test_inputs_make_a_block_slip_and_stick(fmi: int, tmp_path: Path) -> None:
    """It slides with -2 N to rest at 0.5 s, is pulled over its grip, and let go within it."""
    path, _ = written(tmp_path, SLIDING, fmi)
    at = references(path)

    def run(step: float, force: Callable[[float], float]) -> list[float]:
        found = []
        with driver.instance(path, "cs") as fmu:
            driver.initialise(fmu, 0.0)
            for k in range(round(2 / step)):
                put(fmu, at["F"], force((k + 0.5) * step))
                driver.do_step(fmu, k * step, step)
                found.append(driver.numbers(fmu, [at["der(x)"]])[0])
        return found

    speeds = run(0.25, lambda t: 0.0 if t < 0.5 else pull(t))
    # 3 m/s^2 for half a second, then -2 - 2.5 N: at rest after a third of a second
    assert speeds == pytest.approx([0.5, 0, 0.75, 1.5, 0.375, 0, 0, 0], abs=1e-12)


def test_a_table_of_inputs_has_the_bits_of_the_native_run(tmp_path: Path) -> None:
    """Values that are given at the communication points, to both."""
    path, start = written(tmp_path, DRIVEN, 3)
    at, step = references(path), 0.25
    forces = [float(f) for f in np.sin(np.arange(1, 21))]
    case = replace(start.case, tables={0: constant(forces[0])})
    kernel = native.load_kernel(True)
    rows, found = [], []
    with Solver(kernel, case, "dop853", case.tolerance, case.tolerance * start.nominal) as solver:
        for k, force in enumerate(forces):
            if k:
                solver.set_constant(0, force)
            assert solver.advance((k + 1) * step, 10000) == Status.REACHED
            rows.append(solver.report()[1].tolist())
    with driver.instance(path, "cs") as fmu:
        put(fmu, at["F"], forces[0])
        driver.initialise(fmu, 0.0)
        for k, force in enumerate(forces):
            put(fmu, at["F"], force)
            driver.do_step(fmu, k * step, step)
            found.append(driver.numbers(fmu, [at[n] for n in states(path)]))
    assert found == rows


def test_lean_sources(tmp_path: Path) -> None:
    """A model without events carries none of their files."""
    plain, _ = packed(MIXED[: MIXED.index("  discrete")] + "end Mixed;\n", 3)
    whole, _ = packed(MIXED, 3)
    more = {name for name in whole.files if name.startswith("sources/")} - set(plain.files)
    assert {
        f"sources/{n}.c" for n in ("hybrid", "instant", "impacts", "contact_modes", "locate", "fmi_events")
    } <= more
