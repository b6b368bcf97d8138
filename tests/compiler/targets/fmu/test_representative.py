"""What FMUs of all kinds of models must do: the same motion, exact derivatives, states that resume to the bit."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmu_models import (
    REPRESENTATIVE,
    derivative,
    put,
    references,
    restore,
    save,
    states,
    written,
)
from numpy.typing import NDArray

from mechc.compiler.targets.fmu import driver
from mechc.compiler.targets.fmu.checks import by_another, native_error, native_motion
from mechc.compiler.targets.fmu.rules import check_file
from mechc.runtime.native.build import find_compiler

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler"),
]

POINTS = 31
CVODE = 1e-10
LOOSEST = 1e-4
"""No bound of a model is above: none of them is chaotic over its run."""


@pytest.fixture(
    scope="module", params=[(n, v) for n in REPRESENTATIVE for v in (2, 3)], ids=lambda p: f"{p[0]}-{p[1]}"
)
def made(request: Any, tmp_path_factory: Any) -> tuple[Path, Any, str]:
    name, fmi = request.param
    source, method = REPRESENTATIVE[name]
    path, start = written(tmp_path_factory.mktemp("made"), source, fmi, method)
    return path, start, method


def test_is_valid(made: tuple[Path, Any, str]) -> None:
    assert [problem.text for problem in check_file(made[0])] == []


def test_co_simulation_has_the_bits_of_the_native_run(made: tuple[Path, Any, str]) -> None:
    path, start, method = made
    native = native_motion(start, method, POINTS)
    assert np.array_equal(driver.co_simulation(path, native.times, native.step), native.states)


def test_another_integrator_follows(made: tuple[Path, Any, str]) -> None:
    path, start, method = made
    native = native_motion(start, method, POINTS)
    size, error = native_error(start, method, native)
    found = by_another(path, native, size, error, CVODE)
    assert found.passed, str(found)
    assert found.bound < LOOSEST
    assert found.until >= native.times[-3], "the model may end its run between two points"


def in_continuous_time(fmu: Any, point: NDArray[np.float64], values: dict[int, float]) -> None:
    """Take an instance for Model Exchange to a state, with parameters and inputs that are set beforehand."""
    from ctypes import c_double

    for reference, value in values.items():
        put(fmu, reference, value)
    driver.initialise(fmu, 0.0)
    (fmu.newDiscreteStates if hasattr(fmu, "newDiscreteStates") else fmu.updateDiscreteStates)()
    fmu.enterContinuousTimeMode()
    fmu.setContinuousStates((c_double * len(point))(*point), len(point))


def test_derivatives(made: tuple[Path, Any, str]) -> None:
    """Against differences of fourth order at random states: rounding of 1e-16/h and a truncation of h^4, with h from
    1e-4 to 1e-2; the best of them counts. Seeds of states alone, since parameters change the modes."""
    path, start, _ = made
    at, names = references(path), states(path)
    description = fmpy.read_model_description(str(path))
    unknowns = [u.variable.valueReference for u in description.derivatives]
    unknowns += [
        u.variable.valueReference
        for u in description.outputs
        if _is_real(u.variable) and u.variable.name not in names
    ]
    knowns = [at[n] for n in names]
    generator = np.random.default_rng(7)
    size = np.abs(start.case.y0) + 0.1 * start.nominal
    for _ in range(3):
        point = start.case.y0 + 0.1 * size * generator.uniform(-1, 1, len(names))
        direction = size * generator.uniform(-1, 1, len(names))
        weights = generator.uniform(-1, 1, len(unknowns))

        def values(p: NDArray[np.float64]) -> NDArray[np.float64]:
            with driver.instance(path, "me") as fmu:
                in_continuous_time(fmu, p, {})
                return np.array(driver.numbers(fmu, unknowns))

        with driver.instance(path, "me") as fmu:
            in_continuous_time(fmu, point, {})
            here = np.array(driver.numbers(fmu, unknowns))
            forward = np.array(derivative(fmu, unknowns, knowns, direction.tolist()))
            if hasattr(fmu, "getFloat64"):
                backward = np.array(derivative(fmu, unknowns, knowns, weights.tolist(), adjoint=True))
                total = np.abs(weights) @ np.abs(forward) + np.abs(backward) @ np.abs(direction)
                assert abs(weights @ forward - backward @ direction) <= 1e-13 * total
        errors = [_difference_error(values, point, direction, forward, here, h) for h in (1e-2, 1e-3, 1e-4)]
        assert np.max(np.min(errors, axis=0)) < 1e-9


def _is_real(variable: Any) -> bool:
    return variable.type in ("Real", "Float64") and variable.variability != "discrete"


def _difference_error(
    values: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    point: NDArray[np.float64],
    direction: NDArray[np.float64],
    forward: NDArray[np.float64],
    here: NDArray[np.float64],
    h: float,
) -> NDArray[np.float64]:
    weights = {-3: -1 / 60, -2: 9 / 60, -1: -45 / 60, 1: 45 / 60, 2: -9 / 60, 3: 1 / 60}
    wanted = sum(w * values(point + s * h * direction) for s, w in weights.items()) / h
    error: NDArray[np.float64] = np.abs(forward - wanted) / (
        np.abs(here) + np.abs(forward) + 1e-3 * np.max(np.abs(here)) + 1e-300
    )
    return error


RESUME = """
import sys
from pathlib import Path
from fmu_models import restore, states, references
from mechc.compiler.targets.fmu import driver
path, saved, begin, step, count = Path(sys.argv[1]), Path(sys.argv[2]), float(sys.argv[3]), float(sys.argv[4]), int(sys.argv[5])
at = references(path)
with driver.instance(path, "cs") as fmu:
    restore(fmu, saved.read_bytes())
    for k in range(count):
        driver.do_step(fmu, begin, step)
        begin += step
    print(*(v.hex() for v in driver.numbers(fmu, [at[n] for n in states(path)])))
"""


def test_state_resumes_in_another_process(made: tuple[Path, Any, str], tmp_path: Path) -> None:
    path, start, method = made
    native = native_motion(start, method, POINTS)
    times, step, rows = native.times, native.step, native.states
    last = len(times) - 2
    middle = last // 2
    at = [references(path)[n] for n in states(path)]
    with driver.instance(path, "cs") as fmu, driver.instance(path, "cs") as other:
        driver.initialise(fmu, float(times[0]))
        driver.initialise(other, float(times[0]))
        for k in range(middle):
            driver.do_step(fmu, float(times[k]), step)
            driver.do_step(other, float(times[k]), step)  # instances side by side
        kept = save(fmu)
        driver.do_step(fmu, float(times[middle]), 0.7 * step)
        restore(fmu, kept)
        for k in range(middle, last):
            driver.do_step(fmu, float(times[k]), step)
        assert driver.numbers(fmu, at) == rows[last].tolist()
        assert driver.numbers(other, at) == rows[middle].tolist()
        fmu.reset()
        driver.initialise(fmu, float(times[0]))
        driver.do_step(fmu, float(times[0]), step)
        assert driver.numbers(fmu, at) == rows[1].tolist()
    saved = tmp_path / "state"
    saved.write_bytes(kept)
    support = str(Path(__file__).parents[3] / "support")
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            RESUME,
            path,
            saved,
            repr(float(times[middle])),
            repr(step),
            str(last - middle),
        ],
        env={"PYTHONPATH": ":".join([support, *sys.path])},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert [float.fromhex(v) for v in done.stdout.split()] == rows[last].tolist()
