"""Bounces that shrink to rest: an importer sees another number of them, and the same motion."""

from __future__ import annotations

import subprocess
import zipfile
from io import BytesIO
from pathlib import Path

import fmpy
import numpy as np
import pytest
from msgspec.structs import replace

from mechc.api import loads
from mechc.compiler.targets.fmu import driver
from mechc.compiler.targets.fmu.checks import check_package, native_motion
from mechc.compiler.targets.fmu.export import Made
from mechc.fmu.export import FmuOptions, fmu_packages
from mechc.lang.diagnostics import CompileError
from mechc.runtime.native.build import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")

BALL = """
model Ball
  coordinate Length y = 1 m;
  kinetic 0.5*1 kg*der(y)^2;
  potential 1 kg*9.81 m/s^2*y;
  contact floor: y restitution 0.5;
  experiment(stop = 3 s);
end Ball;
"""
TWO = """
model Two
  coordinate Length y[2] = {1 m, 1.3 m};
  kinetic 0.5*1 kg*der(y[1])^2 + 0.5*0.4 kg*der(y[2])^2;
  potential 1 kg*9.81 m/s^2*y[1] + 0.4 kg*9.81 m/s^2*y[2];
  contact floor: y[1] - 0.1 m restitution 0.6;
  contact ball: y[2] - y[1] - 0.2 m restitution 0.5;
  experiment(stop = 4 s);
end Two;
"""
SLOPE = """
model Slope
  parameter a = 20 deg;
  gravity {9.81 m/s^2*sin(a), -9.81 m/s^2*cos(a)};
  coordinate Length x = 0 m;
  coordinate Length y = 1 m;
  initial der(x) = 1 m/s;
  mass 1 kg at world*{x, y};
  contact floor: y restitution 0.5 friction 0.3 along der(x);
  experiment(stop = 3 s);
end Slope;
"""


def ball(restitution: float) -> str:
    """A ball, and a fifth of the time until it rests, sqrt(2 h/g) (1 + e)/(1 - e), afterwards."""
    rest = np.sqrt(2 / 9.81) * (1 + restitution) / (1 - restitution)
    return BALL.replace("0.5;", f"{restitution};").replace("3 s", f"{1.2 * rest:.3f} s")


MODELS = {
    "0.3": ball(0.3),
    "0.4": ball(0.4),
    "0.5": BALL,
    "0.6": ball(0.6),
    "0.7": ball(0.7),
    "0.8": ball(0.8),
    "0.9": ball(0.9),
    "0.95": ball(0.95),
    "two balls": TWO,
    "slope, slides": SLOPE,
    "slope, sticks": SLOPE.replace("friction 0.3", "friction 0.6"),
    "table that carries": BALL.replace("floor: y", "floor: y - 1 cm*sin(6 rad/s*time)"),
    "table that throws": BALL.replace("floor: y", "floor: y - 2 cm*sin(30 rad/s*time)"),
    "stop amid the bounces": BALL.replace("stop = 3", "stop = 1.35"),
    "points far apart": BALL.replace("stop = 3", "stop = 300"),
    "millimetres": BALL.replace("1 m;", "1 mm;").replace("stop = 3", "stop = 0.1"),
    "slow ones rest": BALL.replace("0.5;", "0.7, rest = 1 cm/s;"),
}


def made(text: str, fmi: str = "3") -> Made:
    return fmu_packages(loads(text), FmuOptions(fmi=fmi))[0]


def passes_to_the_end(unit: Made) -> None:
    checked = check_package(unit)
    assert checked is not None and checked.me is not None
    assert checked.me.passed and not checked.me.parted
    assert checked.me.until == checked.times[-1]


@pytest.fixture(scope="module")
def sound() -> Made:
    return made(BALL)


def test_a_ball_is_exported(sound: Made) -> None:
    passes_to_the_end(sound)


@pytest.mark.slow
@pytest.mark.parametrize("fmi", ["2", "3"])
@pytest.mark.parametrize("name", list(MODELS))
def test_what_comes_to_rest_is_exported(name: str, fmi: str) -> None:
    passes_to_the_end(made(MODELS[name], fmi))


@pytest.mark.slow
def test_errors_of_the_importer_that_add_up_over_hundreds_of_bounces_are_told_from_those_of_the_unit() -> (
    None
):
    passes_to_the_end(made(ball(0.98)))


def test_the_unit_comes_to_rest_where_the_sum_of_its_flights_ends(sound: Made, tmp_path: Path) -> None:
    """Within 1e-5 of sqrt(2 h/g) (1 + e)/(1 - e), CVode at 1e-10: a gap off by 1e-10 m ends bounces below 1e-5 s."""
    path = tmp_path / "ball.fmu"
    path.write_bytes(sound.package.data)
    rest = np.sqrt(2 / 9.81) * 3
    y, speed, lost = driver.by_cvode(path, np.array([0.0, rest - 1e-2, rest + 1e-5, 3.0]), 1e-10).T
    assert abs(y[1]) + abs(speed[1]) > 1e-3
    assert not y[2:].any() and not speed[2:].any()
    assert lost[3] == pytest.approx(9.81, rel=1e-7)
    native = native_motion(sound.start, sound.method, 47)
    assert native.states[-1].tolist() == pytest.approx([0, 0, 9.81], rel=1e-12)


def test_a_wrong_restitution_is_refused(sound: Made) -> None:
    wrong = replace(made(BALL.replace("0.5;", "0.50005;")), start=sound.start)
    with pytest.raises(CompileError, match="Model Exchange differs from the native run by"):
        check_package(replace(wrong, kinds=("me",)))
    with pytest.raises(CompileError, match="Co-Simulation does not give the same motion"):
        check_package(wrong)


@pytest.mark.slow
@pytest.mark.parametrize("text", [BALL, SLOPE], ids=["ball", "slope"])
def test_a_unit_that_never_rests_is_refused(text: str, tmp_path: Path) -> None:
    unit = replace(made(text, "2"), kinds=("me",))
    head = "int mech_row_may_rest(const mech_solver *s, int i)\n{"
    data = rebuilt(unit.package.data, "rows.c", head, head + "\n    return 0;", tmp_path)
    with pytest.raises(CompileError, match="Model Exchange differs from the native run by"):
        check_package(replace(unit, package=replace(unit.package, data=data)))


def files_of(data: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(BytesIO(data)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def rebuilt(data: bytes, file: str, old: str, new: str, folder: Path) -> bytes:
    """A unit of FMI 2 whose library was compiled from changed sources."""
    files = files_of(data)
    for name, content in files.items():
        place = folder / name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(content)
    text = (folder / "sources" / file).read_text()
    assert text.count(old) == 1
    (folder / "sources" / file).write_text(text.replace(old, new))
    (library,) = [
        name for name in files if name.startswith("binaries/") and name.endswith(fmpy.sharedLibraryExtension)
    ]
    sources = sorted(map(str, (folder / "sources").glob("*.c")))
    subprocess.run(
        [
            "cc",
            "-std=c11",
            "-O2",
            "-fPIC",
            "-shared",
            "-I",
            str(folder / "sources"),
            *sources,
            "-o",
            str(folder / library),
            "-lm",
        ],
        check=True,
    )
    out = BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name in files:
            archive.writestr(name, (folder / name).read_bytes())
    return out.getvalue()
