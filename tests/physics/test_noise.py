"""``noise(seed, period)``: the numbers of Philox by the inverse of the normal distribution, cubics between them, the same everywhere."""

from __future__ import annotations

import subprocess
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from c_programs import build
from refusals import refused
from scipy.integrate import solve_ivp
from scipy.special import ndtri
from wasm_module import WasmRun, needs_wasmtime

import mechc
from mechc.compiler.graph.scalar_functions import normal
from mechc.compiler.targets.wasm.link import linked
from mechc.fmu.export import FmuOptions, export_fmu
from mechc.fmu.run import run_fmu
from mechc.requests.parse_values import UsageMistake
from mechc.web.kernels import kernel_for, loaded

MASK = 0xFFFFFFFF


def philox(counter: tuple[int, ...], key: tuple[int, ...]) -> tuple[int, ...]:
    """Philox 4x32-10, from the paper: J. Salmon, M. Moraes, R. Dror, D. Shaw, Parallel random numbers, SC 2011, section 3.3."""
    left0, right0, left1, right1 = counter
    for turn in range(10):
        keys = [(k + turn * w) & MASK for k, w in zip(key, (0x9E3779B9, 0xBB67AE85), strict=True)]
        first, second = 0xD2511F53 * left0, 0xCD9E8D57 * left1
        left0, right0, left1, right1 = (
            (second >> 32) ^ right0 ^ keys[0],
            second & MASK,
            (first >> 32) ^ right1 ^ keys[1],
            first & MASK,
        )
    return left0, right0, left1, right1


def test_known_answers_of_philox() -> None:
    """Of Random123, file kat_vectors."""
    assert philox((0, 0, 0, 0), (0, 0)) == (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)
    assert philox((MASK,) * 4, (MASK,) * 2) == (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)
    pi = (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344)
    assert philox(pi, (0xA4093822, 0x299F31D0)) == (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1)


@pytest.mark.parametrize("seed", [0, 1, -7, 2**40 + 3])
def test_numbers_are_those_of_the_normal_distribution(seed: int) -> None:
    """SciPy's inverse is off by 1e-15 itself, in the tails of the distribution."""
    for k in (*range(-300, 300), 2**33, -(2**45)):
        a, b, *_ = philox((k & MASK, k >> 32 & MASK, 0, 0), (seed & MASK, seed >> 32 & MASK))
        wanted = ndtri((((a << 32 | b) >> 12) + 0.5) / 2**52)
        assert normal(float(seed), float(k)) == pytest.approx(float(wanted), rel=4e-15, abs=1e-15)


def test_moments() -> None:
    """Of 40 000 numbers, within four standard deviations of what they may be off by."""
    n = 40_000
    x = np.array([normal(5.0, float(k)) for k in range(n)])
    other = np.array([normal(6.0, float(k)) for k in range(n)])
    bound = 4 / np.sqrt(n)
    assert abs(x.mean()) < bound
    assert abs((x**2).mean() - 1) < np.sqrt(2) * bound
    assert abs((x**3).mean()) < np.sqrt(15) * bound
    assert abs((x**4).mean() - 3) < np.sqrt(96) * bound
    assert abs((x[1:] * x[:-1]).mean()) < bound
    assert abs((x * other).mean()) < bound


def signal(t: float, seed: int, period: float) -> float:
    """The signal by Neville's scheme for the cubic of Catmull and Rom: shares no formula with the compiler."""
    k = np.floor(t / period)
    nodes = [(k + i, normal(float(seed), float(k + i))) for i in (-1, 0, 1, 2)]
    x = t / period

    def line(a: tuple[float, float], b: tuple[float, float]) -> float:
        return a[1] + (x - a[0]) * (b[1] - a[1]) / (b[0] - a[0])

    one, two, three = (line(a, b) for a, b in pairwise(nodes))
    s = x - k
    lower = one + (s + 1) / 2 * (two - one)
    upper = two + s / 2 * (three - two)
    return float(lower + s * (upper - lower))


TEXT = """
model Shaken
  parameter Integer seed = 3;
  coordinate Length x = 0 m;
  kinetic 1/2*1 kg*der(x)^2; potential 1/2*100 N/m*x^2; damping 1 N.s/m on x;
  force 2 N*noise(seed, 50 ms) on x;
  output n = noise(seed, 50 ms);
  experiment(stop = 2 s, tolerance = 1e-10);
end Shaken;
"""


@pytest.fixture(scope="module")
def model() -> mechc.Model:
    return mechc.loads(TEXT)


@pytest.fixture(scope="module")
def native(model: mechc.Model) -> Any:
    return model.simulate(reproducible=True)


def test_the_signal_is_the_cubic(native: Any) -> None:
    wanted = [signal(t, 3, 0.05) for t in native.time]
    assert np.abs(native["n"] - wanted).max() < 1e-12


@pytest.mark.slow
def test_a_shaken_oscillator(native: Any) -> None:
    """By SciPy from one number to the next."""
    y = np.zeros(2)
    for k in range(40):
        done = solve_ivp(
            lambda t, y: [y[1], 2 * signal(t, 3, 0.05) - 100 * y[0] - y[1]],
            (0.05 * k + 1e-15, 0.05 * (k + 1) - 1e-15),
            y,
            method="DOP853",
            rtol=1e-11,
            atol=1e-13,
        )
        y = done.y[:, -1]
    assert native["x"][-1] == pytest.approx(y[0], abs=1e-9)
    assert native["der(x)"][-1] == pytest.approx(y[1], abs=1e-8)


@pytest.mark.slow
def test_the_c_program_has_the_same_bits(model: mechc.Model, native: Any, tmp_path: Path) -> None:
    model.compile("c", tmp_path)
    done = subprocess.run([build(tmp_path, tmp_path)], capture_output=True, text=True, check=True)
    head, *rows = (line.split(",") for line in done.stdout.splitlines())
    column = next(k for k, name in enumerate(head) if name.split(" ")[0] == "n")
    times, found = ([float(row[k]) for row in rows] for k in (0, column))
    assert len(times) == 501
    assert found == native(times)["n"].tolist()


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 4])
def test_units_have_the_same_bits(units: tuple[Path, ...], model: mechc.Model, seed: int) -> None:
    """Of both versions, in both kinds, also with a seed that the importer sets."""
    native = model.simulate(set={"seed": seed}, every=0.01)
    for unit, kind in product(units, ("me", "cs")):
        found = run_fmu(unit, kind=kind, every=0.01, values={"seed": str(seed)})
        assert found.time.tolist() == native.time.tolist()
        assert found["n"].tolist() == native["n"].tolist()
        assert np.abs(found["x"] - native["x"]).max() < 1e-5, (
            "a step of fmpy's CVode is good to 1e-5 of the values"
        )


@pytest.fixture(scope="module")
def units(model: mechc.Model, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, ...]:
    folder = tmp_path_factory.mktemp("units")
    return export_fmu(model, folder / "shaken.fmu", FmuOptions("both", check=False))


@needs_wasmtime
def test_the_page_has_the_same_bits(model: mechc.Model, native: Any) -> None:
    program = model.compilation.program
    kernel = kernel_for("dop853", events=False)
    machine = WasmRun(linked(program, loaded(kernel), "").module, rows=9)
    status, _ = machine.run(2.0, kernel.methods.index("dop853"), 1e-10)
    assert status == 1
    outs = machine.array(9, 9 * len(program.arrays["out"])).reshape(9, -1)
    names = [entry.name for entry in program.arrays["out"]]
    assert outs[:, names.index("n")].tolist() == native(np.linspace(0, 2, 9))["n"].tolist()


def test_the_python_module_has_the_same_bits(model: mechc.Model, native: Any, tmp_path: Path) -> None:
    (path,) = model.compile("python", tmp_path / "shaken.py")
    namespace: dict[str, Any] = {"__name__": "generated"}
    exec(path.read_text(), namespace)
    assert namespace["normal"](3.0, 17.0) == normal(3.0, 17.0)


def test_seeds_are_members_of_ensembles(model: mechc.Model, native: Any) -> None:
    found = model.ensemble({"seed": [3, 4]}, "final(x)", tolerance=1e-10)
    values = np.asarray(found["final(x)"]).ravel()
    assert values[0] == pytest.approx(native["x"][-1], abs=1e-9)
    assert abs(values[1] - values[0]) > 1e-4


def test_it_is_delayed_and_differentiated() -> None:
    text = "model M\n state s = 0; equation der(s) = 1/(1 s); output a = delay(noise(2, 0.1 s), 0.35 s);\n"
    text += "output r = der(noise(2, 0.1 s)); experiment(stop = 1 s);\nend M;"
    found = mechc.loads(text).simulate()
    then = np.maximum(found.time - 0.35, 0)
    assert np.abs(found["a"] - [signal(t, 2, 0.1) for t in then]).max() < 1e-12
    at, h = 0.537, 1e-6
    slope = (signal(at + h, 2, 0.1) - signal(at - h, 2, 0.1)) / (2 * h)
    assert found(at)["r"] == pytest.approx(slope, abs=1e-6)


@pytest.mark.parametrize(
    ("call", "code"),
    [
        ("noise(1.5, 1 s)", "E0308"),
        ("noise(3, 0 s)", "E0584"),
        ("noise(3, 1 m)", "E0304"),
        ("noise(3, x*1 s/m)", "E0584"),
        ("noise(3)", "E0309"),
    ],
)
def test_wrong_calls(call: str, code: str) -> None:
    text = f"model M\n coordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2; force 1 N*{call} on x;\nend M;\n"
    assert code in {d.code for d in refused(text)}


@pytest.mark.parametrize("target", ["casadi", "jax"])
def test_modules_without_whole_numbers_refuse(model: mechc.Model, target: Any, tmp_path: Path) -> None:
    with pytest.raises(UsageMistake, match="has noise"):
        model.compile(target, tmp_path / "m.py")
