"""FMUs that are damaged, or whose library misbehaves: messages and exit codes, never a signal, and nothing left behind."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import pytest
from fmu_models import DRIVEN, packed

from mechc.compiler.targets.fmu import archive
from mechc.compiler.targets.fmu.archive import archive_findings
from mechc.compiler.targets.fmu.inspect import FILE, CheckLine, CheckStage
from mechc.fmu.guard import Limits, check_fmu
from mechc.fmu.run import run_fmu
from mechc.runtime.native.build import find_compiler
from mechc.runtime.outcome import SimulationError

pytestmark = pytest.mark.skipif(find_compiler() is None or os.name == "nt", reason="needs a C compiler")

Files = dict[str, bytes]


@pytest.fixture(scope="module")
def sound() -> Files:
    package, _ = packed(DRIVEN, 3)
    return dict(package.files)


def zipped(files: Files) -> bytes:
    memory = BytesIO()
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_DEFLATED) as written:
        for name, data in files.items():
            written.writestr(name, data)
    return memory.getvalue()


def binary_of(files: Files) -> str:
    return next(name for name in files if name.startswith("binaries/") and name.endswith(".so"))


LIBRARIES = {
    "leaves": "exit(0);",
    "leaves at once": "_exit(0);",
    "aborts": "abort();",
    "crashes": "*(volatile int *)0 = 1;",
    "hangs": "for (;;) sleep(1);",
    "eats memory": "for (;;) memset(malloc(1 << 24), 1, 1 << 24);",
    "divides by zero": "volatile int zero = 0; zero = 7/zero;",
    "never returns": "volatile int k = 0; for (;;) k++;",
    "overflows the stack": "volatile char deep[1 << 30]; for (int k = 0; k < 1 << 30; k += 4096) deep[k] = 1;",
}
"""What a library does while it is loaded."""


def library(code: str, folder: Path) -> bytes:
    found = find_compiler()
    assert found is not None
    source, out = folder / "library.c", folder / "library.so"
    heads = "".join(f"#include <{head}.h>\n" for head in ("stdio", "stdlib", "string", "unistd"))
    source.write_text(f"{heads}__attribute__((constructor)) static void loaded(void) {{ {code} }}\n")
    subprocess.run([*found.command, "-w", "-shared", "-fPIC", "-O0", "-o", out, source], check=True)
    return out.read_bytes()


def with_library(files: Files, code: str, folder: Path) -> Path:
    path = folder / "file.fmu"
    path.write_bytes(zipped({**files, binary_of(files): library(code, folder)}))
    return path


FEW = Limits(seconds=20.0, memory=3_000_000_000)


def test_a_library_that_leaves_does_not_pass(sound: Files, tmp_path: Path) -> None:
    report = check_fmu(with_library(sound, "exit(0);", tmp_path), run=False, limits=FEW)
    died = "the library ended its process with exit code 0"
    assert report.lines[-2:] == (
        CheckLine("ModelExchange binary", False, died, "process"),
        CheckLine("CoSimulation binary", False, died, "process"),
    )
    with pytest.raises(
        SimulationError, match="cannot be run: the library ended its process with exit code 0"
    ):
        run_fmu(tmp_path / "file.fmu", limits=FEW)


@pytest.mark.slow
def test_a_library_that_hangs_is_ended(sound: Files, tmp_path: Path) -> None:
    path = with_library(sound, "for (;;) sleep(1);", tmp_path)
    with pytest.raises(SimulationError, match=r"no answer in 4 s; --seconds allows more"):
        run_fmu(path, limits=Limits(seconds=4.0))


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="bounds of memory are those of Linux")
def test_a_library_that_eats_memory_is_ended(sound: Files, tmp_path: Path) -> None:
    path = with_library(sound, LIBRARIES["eats memory"], tmp_path)
    with pytest.raises(SimulationError, match="ended its process by signal SIG"):
        run_fmu(path, limits=FEW)


def test_what_a_library_prints_is_no_result_and_what_it_reads_is_empty(sound: Files, tmp_path: Path) -> None:
    code = 'char c; printf("ok    everything\\n"); fflush(stdout); if (read(0, &c, 1) != 0) exit(9); creat("here", 0600);'
    path = with_library(sound, code, tmp_path)
    command = [sys.executable, "-m", "mechc", "fmu", "check", "--no-run", str(path)]
    done = subprocess.run(command, cwd=tmp_path, input="text", capture_output=True, text=True)
    assert done.returncode == 1 and "everything" not in done.stdout and "exit code 9" not in done.stdout
    assert "ok    everything" in done.stderr
    assert not (tmp_path / "here").exists()


def test_a_sound_file_passes_stage_by_stage_and_nothing_is_left(
    sound: Files, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    path = tmp_path / "sound.fmu"
    path.write_bytes(zipped(sound))
    report = check_fmu(path, run=False)
    assert report.passed
    assert [line.what for line in report.lines[2:]] == ["ModelExchange binary", "CoSimulation binary"]
    assert run_fmu(path)["x"][0] == 0.3
    assert [file.name for file in tmp_path.iterdir()] == ["sound.fmu"]
    assert (FILE.what, CheckStage("run", "me").what) == ("model description", "ModelExchange run")


def renamed(old: str, new: str) -> Callable[[Files], bytes]:
    return lambda files: zipped({new if name == old else name: data for name, data in files.items()})


def described(change: Callable[[bytes], bytes]) -> Callable[[Files], bytes]:
    """Change the model description."""
    return lambda files: zipped({**files, "modelDescription.xml": change(files["modelDescription.xml"])})


def replaced(old: bytes, new: bytes) -> Callable[[Files], bytes]:
    def change(text: bytes) -> bytes:
        assert old in text
        return text.replace(old, new)

    return described(change)


def bound(change: Callable[[bytes], bytes]) -> Callable[[Files], bytes]:
    """Change the library."""
    return lambda files: zipped({**files, binary_of(files): change(files[binary_of(files)])})


def added(name: str, data: bytes = b"x") -> Callable[[Files], bytes]:
    return lambda files: zipped({**files, name: data})


def linked(files: Files) -> bytes:
    memory = BytesIO(zipped(files))
    with zipfile.ZipFile(memory, "a") as written:
        entry = zipfile.ZipInfo("resources/link")
        entry.external_attr = (stat.S_IFLNK | 0o777) << 16
        written.writestr(entry, "/etc/passwd")
    return memory.getvalue()


def twice(files: Files) -> bytes:
    memory = BytesIO(zipped(files))
    with pytest.warns(UserWarning, match="Duplicate name"), zipfile.ZipFile(memory, "a") as written:
        # two alike are taken as one
        written.writestr("modelDescription.xml", files["modelDescription.xml"] + b"\n")
    return memory.getvalue()


def central(files: Files, offset: int, value: bytes) -> bytes:
    """Write into the entry of the description in the directory of the archive."""
    data = bytearray(zipped(files))
    start = data.index(b"PK\x01\x02")
    while data[start + 46 : start + 66] != b"modelDescription.xml":
        start = data.index(b"PK\x01\x02", start + 4)
    data[start + offset : start + offset + len(value)] = value
    return bytes(data)


def flipped(files: Files) -> bytes:
    data = bytearray(zipped(files))
    start = data.index(binary_of(files).encode())
    data[start + 2000] ^= 1
    return bytes(data)


BOMB = (
    b'<?xml version="1.0"?><!DOCTYPE b [<!ENTITY a0 "aaaaaaaaaa">'
    + b"".join(b'<!ENTITY a%d "%s">' % (k, b"&a%d;" % (k - 1) * 10) for k in range(1, 12))
    + b"]><fmiModelDescription>&a11;</fmiModelDescription>"
)
FILE_ENTITY = (
    b'<!DOCTYPE b [<!ENTITY e SYSTEM "file:///etc/passwd">]><fmiModelDescription>&e;</fmiModelDescription>'
)
START = b"<fmiModelDescription"

DAMAGED: dict[str, Callable[[Files], bytes]] = {
    "empty": lambda files: b"",
    "text": lambda files: b"no archive at all",
    "cut to a tenth": lambda files: zipped(files)[: len(zipped(files)) // 10],
    "cut to a half": lambda files: zipped(files)[: len(zipped(files)) // 2],
    "without its last bytes": lambda files: zipped(files)[:-10],
    "without its first bytes": lambda files: zipped(files)[10:],
    "one bit": flipped,
    "an archive without files": lambda files: zipped({}),
    "no description": renamed("modelDescription.xml", "other.xml"),
    "description of no size": described(lambda text: b""),
    "description cut off": described(lambda text: text[:500]),
    "description is not an XML": described(lambda text: b"\x00\xff" * 50),
    "description of an unknown encoding": described(
        lambda text: b'<?xml version="1.0" encoding="klingon"?><a/>'
    ),
    "another root": described(lambda text: b"<html/>"),
    "entities without end": described(lambda text: BOMB),
    "an entity of a file": described(lambda text: FILE_ENTITY),
    "deep elements": described(lambda text: b"<a>" * 200_000 + b"</a>" * 200_000),
    "version of the future": replaced(b'fmiVersion="3.0"', b'fmiVersion="9.9"'),
    "no version": replaced(b'fmiVersion="3.0"', b""),
    "no name": replaced(b"modelName=", b"modelname="),
    "another identifier": replaced(b'modelIdentifier="', b'modelIdentifier="../../../x'),
    "value reference is not a number": replaced(b'valueReference="1"', b'valueReference="one"'),
    "start is not a number": replaced(b'start="2.0"', b'start="two"'),
    "path to above": added("../above.txt"),
    "path to above in between": added("resources/../../above.txt"),
    "absolute path": added("/tmp/above.txt"),
    "path of a drive": added("C:/above.txt"),
    "path with backslashes": added("..\\above.txt"),
    "a link": linked,
    "two descriptions": twice,
    "names that differ in case": added("MODELDESCRIPTION.XML"),
    "encrypted": lambda files: central(files, 8, b"\x01\x00"),
    "unknown compression": lambda files: central(files, 10, b"\x63\x00"),
    "said to be huge": lambda files: central(files, 24, b"\xff\xff\xff\xf0"),
    "said to lie elsewhere": lambda files: central(files, 42, b"\xff\xff\xff\x0f"),
    "many files": lambda files: zipped({**files, **{f"resources/{k}": b"" for k in range(20_000)}}),
    "library of no size": bound(lambda data: b""),
    "library is text": bound(lambda data: b"no library"),
    "library cut off": bound(lambda data: data[: len(data) // 2]),
    "library of zeros": bound(lambda data: bytes(len(data))),
    "library without sections": bound(lambda data: data[:64] + bytes(4000) + data[4064:]),
    "library of another machine": bound(lambda data: data[:18] + b"\xb7\x00" + data[20:]),
    "reference is binary": added("documentation/reference.csv", b"\xff\xfe\x00"),
    "reference of no size": added("documentation/reference.csv", b""),
}


def answer(path: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "mechc", "fmu", *words, str(path)]
    return subprocess.run(command, cwd=path.parent, capture_output=True, text=True, timeout=300)


@pytest.mark.slow
@pytest.mark.parametrize("name", DAMAGED)
def test_damaged_files_give_messages_and_exit_codes(name: str, sound: Files, tmp_path: Path) -> None:
    path = tmp_path / "inner" / "damaged.fmu"
    path.parent.mkdir()
    path.write_bytes(DAMAGED[name](sound))
    checked = answer(path, "check")
    assert checked.returncode == 1 and "FAIL" in checked.stdout, checked
    ran = answer(path, "run")
    fine_without = ("reference", "start is not a number", "names that differ", "no name")
    assert ran.returncode in (0, 1, 2)
    assert ran.returncode == 0 or ran.stderr.startswith("error: "), ran
    assert ran.returncode != 0 or name.startswith(fine_without), ran
    for said in (checked, ran):
        assert "Traceback" not in said.stderr and "bug in mechc" not in said.stderr
    assert sorted(file.name for file in tmp_path.rglob("*")) == ["damaged.fmu", "inner"]


@pytest.mark.slow
@pytest.mark.parametrize("name", LIBRARIES)
def test_libraries_that_misbehave_give_messages_and_exit_codes(
    name: str, sound: Files, tmp_path: Path
) -> None:
    path = with_library(sound, LIBRARIES[name], tmp_path)
    for words in (("check",), ("check", "--no-run"), ("run",)):
        done = answer(path, *words, "--seconds", "6", "--memory", "3")
        assert done.returncode == 1, done
        said = done.stdout + done.stderr
        assert "the library ended its process" in said or "no answer in 6 s" in said
        assert "Traceback" not in said


@pytest.mark.parametrize("name", [name for name in DAMAGED if name != "many files"])
def test_an_archive_that_is_unfit_is_told_before_it_is_unpacked(
    name: str, sound: Files, tmp_path: Path
) -> None:
    """In this process: nothing of it is unpacked, and none of its libraries is loaded."""
    path = tmp_path / "damaged.fmu"
    path.write_bytes(DAMAGED[name](sound))
    found = archive_findings(path)
    inside: tuple[str, ...] = (
        "description",
        "another",
        "version",
        "no version",
        "no name",
        "value",
        "start",
        "library",
        "entit",
    )
    inside += ("an entity", "deep", "reference")
    assert bool(found) is not name.startswith(inside) or name == "no description", found


def test_the_bounds_of_an_archive(sound: Files, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "file.fmu"
    path.write_bytes(zipped(sound))
    assert archive_findings(path) == []
    monkeypatch.setattr(archive, "MOST_FILES", len(sound) - 1)
    assert "files, of which at most" in archive_findings(path)[0].text
    monkeypatch.setattr(archive, "MOST_FILES", len(sound))
    monkeypatch.setattr(archive, "LARGEST", sum(map(len, sound.values())) - 1)
    assert archive_findings(path)[0].text.startswith("unpacked it would take 0.0 GB")
    monkeypatch.setattr(archive, "LARGEST", sum(map(len, sound.values())))
    assert archive_findings(path) == []
