"""Members of an ensemble on a device: against vectors of this processor, single runs, and mpmath."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mpmath
import numpy as np
import pytest
from shared_models import BALL, WHIRL

import mechc
from mechc.compiler.graph import operations as ops
from mechc.compiler.lanes import item_text
from mechc.compiler.program.model import Literal, Load, Operate, Store
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.ensembles import device as devices
from mechc.runtime.ensembles import kernel_arguments
from mechc.runtime.ensembles.result import Ensemble
from mechc.runtime.functions import load_functions
from mechc.runtime.outcome import SimulationError

EXAMPLES = Path(__file__).parents[2] / "examples"
SMOOTH = {
    "pendulum": "l",
    "kepler": "e",
    "spherical_pendulum": "l",
    "heavy_symmetric_top": "l",
    "lagrange_top": "l",
    "duffing_free": "s",
    "rotating_hoop": "w",
    "coupled_pendulums": "k",
    "helix": "a",
    "heavy_top_rotation": "m",
}
"""Smooth examples whose motions are not chaotic, with a parameter of each."""
QUICK = ("pendulum",)

DRIVEN = """\
model Driven
  parameter l = 1 m;
  parameter k = 0.2;
  input Torque push = 0.1 N.m*cos(2 rad/s*time);
  input Force steady = 0 N;
  coordinate theta = 60 deg;
  coordinate x = 10 cm;
  kinetic 1/2*1 kg*(l*der(theta))^2 + 1/2*(1 + k*sin(theta)^2)*1 kg*der(x)^2;
  potential -9.81 N*l*cos(theta) + 1/2*40 N/m*x^2*exp(-k*cos(theta));
  damping 0.1 N.s/m on x;
  force push on theta;
  force steady + 0.1*table(theta, {-2, 0, 1, 2}, {1 N, 0 N, 0.5 N, 0.2 N}) on x;
  assert x < 30 cm, "too far";
  experiment(stop = 3 s, tolerance = 1e-9);
end Driven;
"""
WHIRL_ASKED: dict[str, Any] = {
    "vary": "m ~ uniform(0.4, 0.6 kg), a ~ normal(1 rad, 0.2 rad)",
    "keep": "final(a), max(b), min(der(a)), mean(a*b), first(a < 0 rad), a, energy.total",
    "samples": 30,
    "every": "0.25 s",
    "errors": "0.4",
}
CLOSED = """\
model Closed
  coordinate Length x = 1 m;
  coordinate Length y = 0 m;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1 kg*9.81 m/s^2*y;
  constraint x^2 + y^2 = 1 m^2;
  experiment(stop = 1 s);
end Closed;
"""


@pytest.fixture(scope="module")
def there() -> devices.Device:
    """Give a device; where there is none say so."""
    try:
        return devices.find_device(devices.OPENCL)
    except SimulationError as missing:
        pytest.skip(f"{missing.message}; {missing.help}")


@pytest.fixture(scope="module")
def whirl() -> mechc.Model:
    return mechc.loads(WHIRL)


@pytest.fixture(scope="module")
def whirls(whirl: mechc.Model, there: devices.Device) -> Ensemble:
    return whirl.ensemble(**WHIRL_ASKED, device="opencl")


def same_as_vectors(on_device: Ensemble, in_vectors: Ensemble) -> None:
    for name in ("rows", "errors", "steps", "outcomes", "ends"):
        np.testing.assert_array_equal(getattr(on_device, name), getattr(in_vectors, name), err_msg=name)
    # maxima and means are reduced by code that fuses products and sums as its compiler likes
    np.testing.assert_allclose(on_device.numbers, in_vectors.numbers, rtol=4e-15, atol=4e-15)


def test_members_have_the_bits_of_vectors(whirl: mechc.Model, whirls: Ensemble) -> None:
    """Two companions of each kind of step, dense output, what is kept along steps."""
    beside = whirl.ensemble(**WHIRL_ASKED, lanes="on")
    assert whirls.build.startswith("OpenCL, ") and whirls.counts() == {"completed": 30}
    assert 3 < np.isfinite(whirls.errors).sum() < 25
    if "not fused" in beside.build:
        pytest.skip("this processor does not fuse products and sums")
    same_as_vectors(whirls, beside)


@pytest.mark.slow
def test_pieces_and_threads_change_no_bit(
    whirl: mechc.Model, whirls: Ensemble, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of few members at a time, a few steps in each call."""
    monkeypatch.setattr(devices, "ABREAST", 16)
    monkeypatch.setattr(devices, "ATTEMPTS", 12)
    again = whirl.ensemble(**WHIRL_ASKED, device="opencl", threads=2)
    for name in ("numbers", "number_errors", "rows", "errors", "steps", "outcomes", "ends"):
        np.testing.assert_array_equal(getattr(again, name), getattr(whirls, name), err_msg=name)


@pytest.mark.slow
def test_taylor_series_on_a_device(whirl: mechc.Model, there: devices.Device) -> None:
    found = whirl.ensemble(**WHIRL_ASKED, method="taylor", device="opencl")
    beside = whirl.ensemble(**WHIRL_ASKED, method="taylor", lanes="on")
    assert "OpenCL" in found.build and found.counts() == {"completed": 30}
    if "not fused" not in beside.build:
        same_as_vectors(found, beside)


@pytest.mark.slow
def test_inputs_tables_assertions_and_troubles(there: devices.Device) -> None:
    """Members that a device cannot follow are told as single runs are."""
    model = mechc.loads(DRIVEN)
    asked: dict[str, Any] = {
        "vary": {
            ("l", "x", "steady"): np.array(
                [[1.0, 0.1, 0.0], [1.1, 0.1, 0.3], [1, 0.29, 12], [1, 0.5, 0], [0, 0.1, 0]]
            )
        },
        "keep": "final(x), max(theta), first(theta < 0 rad), x, energy.total",
        "every": "0.5 s",
        "errors": "all",
    }
    on, off = model.ensemble(**asked, device="opencl"), model.ensemble(**asked, lanes="off")
    np.testing.assert_array_equal(on.outcome_words, off.outcome_words)
    assert on.why() == off.why() and on.counts() == {"completed": 2, "failed": 3}
    # steps of 1e-9, some 60 of them
    np.testing.assert_allclose(on.numbers, off.numbers, rtol=2e-7, atol=2e-7)
    np.testing.assert_allclose(on.rows, off.rows, rtol=2e-7, atol=2e-7)
    np.testing.assert_allclose(on.errors, off.errors, rtol=0.5)


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in SMOOTH]
)
def test_smooth_examples_are_within_the_tolerance_of_the_run(name: str, there: devices.Device) -> None:
    model = mechc.load(EXAMPLES / f"{name}.mech")
    run = model.simulate()
    value = float(dict(run.parameters)[SMOOTH[name]])
    asked: dict[str, Any] = {
        "vary": {SMOOTH[name]: [0.99 * value, value, 1.01 * value]},
        "keep": ", ".join(q.name for q in model.problem().states),
        "errors": "none",
    }
    found = model.ensemble(**asked, device="opencl")
    assert found.build == f"OpenCL, {there.name}" and found.counts() == {"completed": 3}
    single = np.array([run[q.name] for q in model.problem().states])
    np.testing.assert_array_equal(found.times, run.time)
    assert (np.abs(found.rows[1] - single) / (1 + np.abs(single))).max() < found.tolerance
    others = model.ensemble(**asked, lanes="off")
    assert (np.abs(found.rows - others.rows) / (1 + np.abs(others.rows))).max() < found.tolerance


def rates(on: devices.Device, model: mechc.Model, states: Any) -> tuple[Any, Any, Any]:
    """Give derivatives [n, ny] at states [n, ny] as a device forms them, with parameters and given inputs."""
    problem = model.problem()
    case = prepare(problem, load_functions(problem), SimulationOptions())
    items = devices.Items(on, item_text(model.program(frozenset()), (), "dop853"), turns=False)
    n, ny = states.shape
    first = devices.SINGLES + 2 * ny
    numbers, marks = np.ones((items.n_numbers, n)), np.zeros((devices.MARKS, n), np.int32)
    numbers[0], numbers[devices.SINGLES : devices.SINGLES + ny] = 0.0, states.T
    fixed = np.repeat(np.concatenate([case.p, np.zeros(items.n_fixed - case.p.size)])[:, None], n, axis=1)
    one, none = np.zeros(1), np.zeros(1, np.int32)
    buffers = [items._filled(a) for a in (np.arange(n, dtype=np.uint32), numbers, marks, fixed, one, one)]
    items._kernel(
        on.queue, (n,), None, np.uint32(n), np.uint32(n), buffers[0], np.int32(0), *buffers[1:], none[0], none[0],
        np.float64(1), np.float64(0), items._filled(none), items._filled(np.zeros(1, np.uint8)), none[0],
    )  # fmt: skip
    return items._read(buffers[1], numbers)[first : first + ny].T, case.p, case.z


def exactly(model: mechc.Model, y: Any, p: Any, z: Any) -> tuple[list[Any], list[Any]]:
    """Give derivatives by mpmath, and of each the largest term: what a relative change of a value on the way to it changes."""
    (body,) = model.program(frozenset()).function("rhs").bodies  # type: ignore[union-attr]
    given = {"y": y, "p": p, "z": z}

    def values(changed: int = -1) -> tuple[list[Any], dict[int, Any]]:
        found: list[Any] = []
        out: dict[int, Any] = {}
        for k, statement in enumerate(body):
            match statement:
                case Load(array, index):
                    found.append(mpmath.mpf(0) if array == "t" else mpmath.mpf(float(given[array][index])))
                case Literal(number):
                    found.append(mpmath.mpf(float(number)))
                case Operate(code, operands):
                    row = ops.OPERATIONS[code]
                    form = row.digits(mpmath.mp) if row.digits else row.value
                    assert form is not None
                    found.append(
                        form(*(found[a] for a in operands)) * (1 + (k == changed) * mpmath.mpf(10) ** -25)
                    )
                case Store(_, index, value):
                    out[index] = found[value]
                    found.append(None)
                case _:
                    raise AssertionError(statement)
        return found, out

    with mpmath.workdps(60):
        _, exact = values()
        largest = {i: abs(value) for i, value in exact.items()}
        for k in (k for k, s in enumerate(body) if type(s) is Operate):
            for i, value in values(k)[1].items():
                largest[i] = max(largest[i], abs(value - exact[i]) * mpmath.mpf(10) ** 25)
    return [exact[i] for i in range(len(exact))], [largest[i] for i in range(len(exact))]


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in SMOOTH]
)
def test_derivatives_are_within_four_units_of_their_largest_term(name: str, there: devices.Device) -> None:
    model = mechc.load(EXAMPLES / f"{name}.mech")
    run = model.simulate()
    states = np.array([run[q.name][:: max(1, run.time.size // 5)] for q in model.problem().states]).T
    found, p, z = rates(there, model, states)
    for row, y in zip(found, states, strict=True):
        exact, largest = exactly(model, y, p, z)
        for one, value, term in zip(row, exact, largest, strict=True):
            assert abs(mpmath.mpf(float(one)) - value) <= 4 * np.spacing(float(term)), (one, value, term)


@pytest.mark.parametrize(
    ("text", "settings", "said"),
    [
        (BALL, {"vary": "y = 1 m .. 2 m, 3"}, "events, contacts and switches"),
        (CLOSED, {"vary": "x = 1 m .. 1 m, 1"}, "projected onto constraints"),
        (WHIRL, {"method": "radau5"}, "'radau5' takes no steps side by side"),
        (WHIRL, {"reproducible": True}, "the scalar kernel"),
        (WHIRL, {"lanes": "on"}, "'lanes' does not go with members on a device"),
        (WHIRL, {"workers": 2}, "'workers' does not go with members on a device"),
        (WHIRL, {"time_limit": "3 s"}, "'time_limit' does not go with members on a device"),
        (WHIRL, {"device": "cuda"}, "'device' is opencl, or opencl:NAME"),
        (DRIVEN, {"vary": "l = 1 m .. 2 m, 3", "inputs": {"steady": "push.csv"}}, "follow tables over time"),
    ],
)
def test_what_a_device_cannot_do_is_said(
    text: str, settings: dict[str, Any], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("push.csv").write_text("time,steady\n0,0\n1,1\n", encoding="utf-8")
    with pytest.raises(mechc.SimulationError, match=said):
        mechc.loads(text).ensemble(**{"vary": "m = 1 kg .. 2 kg, 3", "device": "opencl", **settings})


class OtherDevices:
    """Stands for pyopencl where there are devices of some kinds."""

    class Error(Exception):
        pass

    device_type = SimpleNamespace(GPU=4)

    def __init__(self, *kinds: SimpleNamespace) -> None:
        self._kinds = kinds

    def get_platforms(self) -> list[Any]:
        if not self._kinds:
            raise self.Error("PLATFORM_NOT_FOUND_KHR")
        return [SimpleNamespace(get_devices=lambda: self._kinds)]

    def Context(self, chosen: Any) -> None:
        raise self.Error("BUILD_PROGRAM_FAILURE\nerror: unknown target CPU 'generic'\n")


def of_kind(name: str, double: int) -> SimpleNamespace:
    about = {"platform": SimpleNamespace(name="Some"), "version": "OpenCL 1.2", "type": 4}
    return SimpleNamespace(name=name, double_fp_config=double, **about)


@pytest.mark.parametrize(
    ("asked", "kinds", "said", "helped"),
    [
        ("opencl", None, "pyopencl, which is not installed", r"mechc\[gpu\]"),
        ("opencl", (), "there is no OpenCL device on this machine", "pocl"),
        ("opencl:big", (of_kind("small", 63),), "no OpenCL device is called 'big'", "small"),
        (
            "opencl",
            (of_kind("small", 0),),
            r"small \(Some\): it has no double precision",
            "double",
        ),
        ("opencl", (of_kind("new", 63),), "unknown target CPU 'generic'", "knows the processor"),
    ],
)
def test_devices_that_are_not_there_are_told(
    asked: str, kinds: tuple[Any, ...] | None, said: str, helped: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def imported(name: str) -> Any:
        if kinds is None:
            raise ImportError(name)
        return OtherDevices(*kinds)

    monkeypatch.setattr(devices, "importlib", SimpleNamespace(import_module=imported))
    monkeypatch.setattr(kernel_arguments, "find_device", devices.find_device.__wrapped__)
    with pytest.raises(mechc.SimulationError, match=said) as told:
        mechc.loads(WHIRL).ensemble("m = 1 kg .. 2 kg, 3", device=asked)
    assert told.value.help and helped.replace("\\", "") in told.value.help


def test_one_of_several_is_named(there: devices.Device) -> None:
    part = there.name.split("(")[0].strip()[:12]
    assert devices.find_device(f"opencl:{part.upper()}").name == there.name
    assert importlib.import_module("pyopencl")
