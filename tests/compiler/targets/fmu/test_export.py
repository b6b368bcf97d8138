"""FMUs of models: valid, the same motion as the native run, exact derivatives, states that resume to the bit."""

from __future__ import annotations

import hashlib
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmu_models import DRIVEN, EXAMPLES, derivative, packed, put, restore, save

from mechc.api import load, loads
from mechc.compiler.targets.fmu import driver
from mechc.compiler.targets.fmu.checks import check_package, native_motion
from mechc.compiler.targets.fmu.export import Made, Package
from mechc.compiler.targets.fmu.variables import Start
from mechc.fmu.export import FmuOptions, export_fmu
from mechc.runtime.native.build import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")


@pytest.fixture(scope="module", params=[pytest.param(2, marks=pytest.mark.slow), 3])
def driven(request: Any, tmp_path_factory: Any) -> Iterator[tuple[Path, Package, Start, int]]:
    package, start = packed(DRIVEN, request.param)
    path = tmp_path_factory.mktemp("fmu") / "driven.fmu"
    path.write_bytes(package.data)
    yield path, package, start, request.param


def references(path: Path) -> dict[str, int]:
    return {v.name: v.valueReference for v in fmpy.read_model_description(str(path)).modelVariables}


def test_is_valid_and_moves_as_the_native_run(driven: tuple[Path, Package, Start, int]) -> None:
    _, package, start, _ = driven
    check_package(Made(package, start, "dop853", ("me", "cs")))


def test_same_bytes_again(driven: tuple[Path, Package, Start, int]) -> None:
    _, package, _, fmi = driven
    again, _ = packed(DRIVEN, fmi)
    assert hashlib.sha256(again.data).digest() == hashlib.sha256(package.data).digest()


def test_exports_the_functions_of_the_standard_only(
    driven: tuple[Path, Package, Start, int], tmp_path: Path
) -> None:
    _, package, _, fmi = driven
    (name,) = [n for n in package.files if n.startswith("binaries/")]
    library = tmp_path / "library"
    library.write_bytes(package.files[name])
    listed = subprocess.run(
        ["nm", "-D", "--defined-only", library], capture_output=True, text=True, check=True
    ).stdout
    symbols = [line.split()[-1] for line in listed.splitlines()]
    assert len(symbols) == {2: 44, 3: 75}[fmi]
    assert all(s.startswith(f"fmi{fmi}") for s in symbols)
    everything = subprocess.run(["nm", library], capture_output=True, text=True, check=True).stdout
    own = [line.split()[1:] for line in everything.splitlines() if len(line.split()) == 3]
    # the start files of the C compiler have their own
    writable = [n for kind, n in own if kind in "bBD" and n.startswith(("mech", "fmu", "fmi"))]
    assert writable == []


def test_sources_compile_by_one_command(driven: tuple[Path, Package, Start, int], tmp_path: Path) -> None:
    _, package, _, fmi = driven
    for name, data in package.files.items():
        if name.startswith("sources/"):
            (tmp_path / name.removeprefix("sources/")).write_bytes(data)
    headers = Path(fmpy.__file__).parent / "c-code"
    command = ["cc", "-std=c11", "-O0", "-fPIC", "-shared", "-Wall", "-Wextra", "-Werror", f"-I{headers}"]
    files = [p.name for p in sorted(tmp_path.glob("*.c"))]
    subprocess.run([*command, *files, "-o", "model.so", "-lm"], cwd=tmp_path, check=True)
    assert (tmp_path / "fmi3Functions.h").exists() is False
    assert (tmp_path / "fmi2Functions.h").exists() is (fmi == 2)


def test_state_resumes_in_another_instance(driven: tuple[Path, Package, Start, int]) -> None:
    path, *_ = driven
    states = [references(path)[n] for n in ("x", "der(x)")]
    step = 0.125
    with driver.instance(path, "cs") as first:
        driver.initialise(first, 0.0)
        for k in range(8):
            first.doStep(k * step, step)
        kept = save(first)
        for k in range(8, 16):
            first.doStep(k * step, step)
        wanted = driver.numbers(first, states)
        restore(first, kept)  # roll back, and again
        for k in range(8, 16):
            first.doStep(k * step, step)
        assert driver.numbers(first, states) == wanted
        first.reset()
        driver.initialise(first, 0.0)
        for k in range(16):
            first.doStep(k * step, step)
        assert driver.numbers(first, states) == wanted
    with driver.instance(path, "cs") as second:
        restore(second, kept)
        for k in range(8, 16):
            second.doStep(k * step, step)
        assert driver.numbers(second, states) == wanted


def test_a_changed_parameter_and_input_act(driven: tuple[Path, Package, Start, int]) -> None:
    path, *_ = driven
    at = references(path)
    with driver.instance(path, "me") as fmu:
        put(fmu, at["k"], 5.0)
        put(fmu, at["F"], 3.0)
        put(fmu, at["x"], 0.25)
        driver.initialise(fmu, 0.0)
        found = dict(zip(at, driver.numbers(fmu, list(at.values())), strict=True))
    assert found["c"] == pytest.approx(2 * 5.0 * 0.01, rel=1e-15)
    assert found["stretch"] == 5.0 * 0.25
    force = 3.0 * np.cos(0.25) - 5.0 * 0.25 - 0.1 * 0.1
    assert found["der(x,2)"] == pytest.approx(force / 2.0, rel=1e-14)


def test_directional_derivatives(driven: tuple[Path, Package, Start, int]) -> None:
    path, _, _, fmi = driven
    at = references(path)
    knowns = [at[n] for n in ("x", "der(x)", "F", "k", "m")]
    unknowns = [at[n] for n in ("der(x,2)", "stretch", "energy.total")]
    point = {"x": 0.4, "der(x)": -0.2, "F": 1.5, "k": 7.0, "m": 1.25}

    def values(shift: dict[str, float]) -> np.ndarray[Any, Any]:
        with driver.instance(path, "me") as fmu:
            for name, value in point.items():
                put(fmu, at[name], value + shift.get(name, 0.0))
            driver.initialise(fmu, 0.0)
            return np.array(driver.numbers(fmu, unknowns))

    with driver.instance(path, "me") as fmu:
        for name, value in point.items():
            put(fmu, at[name], value)
        driver.initialise(fmu, 0.0)
        generator = np.random.default_rng(1)
        v, w = generator.normal(size=len(knowns)), generator.normal(size=len(unknowns))
        forward = np.array(derivative(fmu, unknowns, knowns, v.tolist()))
        if fmi == 3:
            backward = np.array(derivative(fmu, unknowns, knowns, w.tolist(), adjoint=True))
            assert w @ forward == pytest.approx(backward @ v, rel=1e-13)
    # central differences of fourth order: rounding of 1e-16 / h and a truncation of h^4
    h = 1e-3
    direction = dict(zip(point, v, strict=True))
    weights = {-2: 1 / 12, -1: -8 / 12, 1: 8 / 12, 2: -1 / 12}
    wanted = sum(w * values({n: s * h * d for n, d in direction.items()}) for s, w in weights.items()) / h
    assert forward == pytest.approx(wanted, rel=1e-9, abs=1e-9)


def test_wrong_token_and_wrong_calls_are_refused(driven: tuple[Path, Package, Start, int]) -> None:
    path, *_ = driven
    at = references(path)
    with driver.instance(path, "cs") as fmu:
        with pytest.raises(Exception, match="status"):
            fmu.doStep(0.0, 0.1)
        driver.initialise(fmu, 0.0)
        with pytest.raises(Exception, match="status"):
            put(fmu, at["x"], 1.0)
        with pytest.raises(Exception, match="status"):
            fmu.doStep(0.5, 0.1)


def test_times_and_tolerances_that_are_no_numbers_are_errors(
    driven: tuple[Path, Package, Start, int],
) -> None:
    """A step to infinity would never end; a stop at infinity is none."""
    path, _, _, _ = driven
    inf, nan = float("inf"), float("nan")
    with driver.instance(path, "cs") as fmu:
        for start, stop, tolerance in (
            (nan, None, None),
            (inf, None, None),
            (0.0, nan, None),
            (0.0, -1.0, None),
            (0.0, None, nan),
            (0.0, None, inf),
            (0.0, None, -1e-6),
        ):
            with pytest.raises(FMICallException):
                driver.initialise(fmu, start, stop, tolerance)
            fmu.reset()
        driver.initialise(fmu, 0.0, inf)
        for begin, step in (
            (inf, 0.1),
            (-inf, 0.1),
            (nan, 0.1),
            (0.0, inf),
            (0.0, nan),
            (0.0, 0.0),
            (0.0, -0.1),
        ):
            with pytest.raises(FMICallException):
                driver.do_step(fmu, begin, step)
    with driver.instance(path, "cs") as fmu:
        driver.initialise(fmu, 0.0, inf)
        driver.do_step(fmu, 0.0, 0.1)
    with driver.instance(path, "me") as fmu:
        driver.initialise(fmu, 0.0)
        fmu.enterContinuousTimeMode()
        for time in (inf, -inf, nan):
            with pytest.raises(FMICallException):
                fmu.setTime(time)


def test_nothing_is_written_after_a_failure(tmp_path: Path) -> None:
    model = loads(DRIVEN.replace("1/2*k*x^2", "1/2*k*x^2 + 1 J*log(0.5 - time/(4 s))*x/(1 m)"))
    with pytest.raises(Exception, match=r"fails|finite"):
        export_fmu(model, tmp_path / "m.fmu", FmuOptions())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize(
    "name",
    ["lagrange_top", "driven_pendulum", "kepler", "particle_on_sphere", "hanging_chain"],
)
def test_export_with_all_checks(name: str, fmi: int, tmp_path: Path) -> None:
    path = EXAMPLES / f"{name}.mech"
    written = export_fmu(load(path), tmp_path / "m.fmu", FmuOptions(fmi=str(fmi)))
    assert written == (tmp_path / "m.fmu",)
    assert os.path.getsize(written[0]) > 0


def test_native_points_end_at_the_stop(driven: tuple[Path, Package, Start, int]) -> None:
    _, _, start, _ = driven
    native = native_motion(start, "dop853", 10)
    assert native.step == 0.5
    assert native.times[-1] == 5.0
    assert native.states.shape == (11, len(start.problem.states))
