"""Binaries for other platforms: their formats, what they export, and the same motion where they can be run."""

from __future__ import annotations

import importlib.util
import re
import shutil
import struct
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest

from mechc.api import loads
from mechc.compiler.targets.fmu import driver
from mechc.compiler.targets.fmu.export import make_package, start_of
from mechc.compiler.targets.fmu.platforms import PLATFORMS, chosen_platforms, universal, without_time
from mechc.lang.diagnostics import CompileError
from mechc.runtime.native.build import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")
needs_zig = pytest.mark.skipif(importlib.util.find_spec("ziglang") is None, reason="needs ziglang")

PENDULUM = """
model Pendulum
  parameter l = 1 m;
  coordinate Angle theta = 1 rad;
  kinetic 1/2*1 kg*l^2*der(theta)^2;
  potential -1 kg*9.81 m/s^2*l*cos(theta);
  experiment(stop = 2 s);
end Pendulum;
"""

ELF_MACHINE = {"x86_64-linux": 62, "aarch64-linux": 183}
PE_MACHINE = {"x86_64-windows": 0x8664, "aarch64-windows": 0xAA64}
MACH_CPU = {"x86_64-darwin": 0x01000007, "aarch64-darwin": 0x0100000C}
FOLDERS_2 = {"linux64", "aarch64-linux", "win64", "aarch64-windows", "darwin64", "aarch64-darwin"}


def made(fmi: int, platforms: tuple[str, ...]) -> tuple[dict[str, bytes], str, bytes]:
    model = loads(PENDULUM)
    start = start_of(model.problem(reproducible=True))
    package = make_package(
        model.compilation.equations, start, fmi=fmi, method="dop853", platforms=chosen_platforms(platforms)
    )
    return dict(package.files), package.token, package.data


def header_functions(fmi: int) -> set[str]:
    """The functions that the headers of the standard declare."""
    text = (Path(fmpy.__file__).parent / "c-code" / f"fmi{fmi}Functions.h").read_text(encoding="utf-8")
    return set(re.findall(rf"FMI{fmi}_Export fmi{fmi}\w+TYPE\s+(fmi{fmi}\w+)", text))


def names_in(data: bytes, fmi: int) -> set[str]:
    """Whole names of functions of the standard in the tables of strings of a library."""
    return {n.decode().removeprefix("_") for n in re.findall(rb"(?<=\0)_?fmi%d\w+(?=\0)" % fmi, data)}


def test_the_platforms_of_the_standard_are_known() -> None:
    assert chosen_platforms(("host",)) == ("host",)
    with pytest.raises(CompileError, match=r"E0904.*linux64"):
        chosen_platforms(("linux64",))
    assert {p.folder(2) for p in PLATFORMS.values()} == FOLDERS_2
    assert {p.folder(3) for p in PLATFORMS.values()} == set(PLATFORMS)


def test_a_universal_library_holds_its_slices() -> None:
    slices = {"x86_64-darwin": b"one" * 7000, "aarch64-darwin": b"two"}
    data = universal(slices)
    magic, count = struct.unpack_from(">II", data)
    assert (magic, count) == (0xCAFEBABE, 2)
    for i, (name, body) in enumerate(slices.items()):
        cpu, _, offset, size, alignment = struct.unpack_from(">IIIII", data, 8 + 20 * i)
        assert cpu == MACH_CPU[name]
        assert offset % (1 << alignment) == 0
        assert data[offset : offset + size] == body


def test_the_time_of_the_build_is_cleared() -> None:
    library = bytearray(b"MZ" + bytes(200))
    struct.pack_into("<I", library, 0x3C, 0x80)
    library[0x80:0x84] = b"PE\0\0"
    struct.pack_into("<HHI", library, 0x84, 0x8664, 6, 1_700_000_000)
    wanted = bytearray(library)
    wanted[0x88:0x8C] = bytes(4)
    assert without_time(bytes(library)) == bytes(wanted)
    with pytest.raises(ValueError, match="no format of Windows"):
        without_time(bytes(200))


@needs_zig
@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
def test_all_platforms_in_one_file(fmi: int) -> None:
    files, _, _ = made(fmi, ("all",))
    functions = header_functions(fmi)
    assert len(functions) == {2: 44, 3: 75}[fmi]
    found = {name.split("/")[1]: data for name, data in files.items() if name.startswith("binaries/")}
    assert set(found) == {p.folder(fmi) for p in PLATFORMS.values()}
    for platform in PLATFORMS.values():
        data = found[platform.folder(fmi)]
        assert functions <= names_in(data, fmi), platform.name
        if platform.name in ELF_MACHINE:
            assert data[:5] == b"\x7fELF\x02"
            assert struct.unpack_from("<H", data, 18)[0] == ELF_MACHINE[platform.name]
        elif platform.name in PE_MACHINE:
            (at,) = struct.unpack_from("<I", data, 0x3C)
            machine, _, time = struct.unpack_from("<HHI", data, at + 4)
            assert (data[at : at + 4], machine, time) == (b"PE\0\0", PE_MACHINE[platform.name], 0)
        elif fmi == 2 and platform.name == "x86_64-darwin":
            assert data[:4] == b"\xca\xfe\xba\xbe"
        else:
            magic, cpu = struct.unpack_from("<II", data)
            assert (magic, cpu) == (0xFEEDFACF, MACH_CPU[platform.name])


def wine() -> str | None:
    return (
        shutil.which("wine64") or shutil.which("wine") or next(iter(_existing("/usr/lib/wine/wine64")), None)
    )


def _existing(path: str) -> list[str]:
    return [path] if Path(path).is_file() else []


def emulated(platform: str) -> list[str] | None:
    """The command that runs a program of another platform here; None if there is none."""
    if platform == "x86_64-windows" and wine():
        return [str(wine())]
    root = Path("/usr/aarch64-linux-gnu")
    if platform == "aarch64-linux" and shutil.which("qemu-aarch64") and root.is_dir():
        return ["qemu-aarch64", "-L", str(root)]
    return None


@needs_zig
@pytest.mark.slow
@pytest.mark.parametrize("platform", ["aarch64-linux", "x86_64-windows"])
def test_a_binary_of_another_platform_moves_alike(platform: str, tmp_path: Path) -> None:
    command = emulated(platform)
    if command is None:
        pytest.skip(f"nothing here runs programs of {platform}")
    files, token, data = made(3, ("host", platform))
    (name,) = [n for n in files if n.startswith(f"binaries/{platform}/")]
    library = tmp_path / Path(name).name
    library.write_bytes(files[name])
    program = tmp_path / ("run.exe" if "windows" in platform else "run")
    here = Path(__file__).parent / "run_library.c"
    headers = Path(fmpy.__file__).parent / "c-code"
    triple = PLATFORMS[platform].triple
    flags = ["-target", triple, "-O1", f"-I{headers}", str(here), "-o", str(program)]
    subprocess.run([sys.executable, "-m", "ziglang", "cc", *flags], check=True)
    references = ["1", "2"]
    environment = {"PATH": "/usr/bin:/bin", "HOME": str(tmp_path), "WINEDEBUG": "-all"}
    done = subprocess.run(
        [*command, str(program), f"./{library.name}", token, "0.125", "16", *references],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    there = [float(line) for line in done.stdout.split()]
    path = tmp_path / "m.fmu"
    path.write_bytes(data)
    here_found = driver.co_simulation(path, np.linspace(0.0, 2.0, 17), 0.125)[-1]
    # the same operations in the same order; only sin and cos are of another C library, to a unit in the last place,
    # which the steps of the method may carry on to a few hundred of them
    assert there == pytest.approx(here_found.tolist(), rel=1e-12)


def test_the_archive_names_its_host(tmp_path: Path) -> None:
    files, _, data = made(2, ("host",))
    path = tmp_path / "m.fmu"
    path.write_bytes(data)
    with zipfile.ZipFile(path) as archive:
        assert archive.namelist() == sorted(files, key=lambda n: (n != "modelDescription.xml", n))
    assert fmpy.platform in fmpy.supported_platforms(str(path))
