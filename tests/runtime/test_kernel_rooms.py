"""The rooms of the kernel: what a file calls stands in its own room or a lower one, and calls go in no circle."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

import pytest

from mechc.compiler.targets.fmu.export import header_folder
from mechc.runtime.native.build import find_compiler
from mechc.runtime.native.kernel import AROUND, KERNEL, KERNEL_ROOMS

Uses = Mapping[str, frozenset[str]]
"""By file (its header and its code are one): what it refers to in others."""

FILES = tuple(file for room in (*KERNEL_ROOMS, *AROUND) for file in sorted((KERNEL / room).glob("*.[ch]")))
ROOM = {file.stem: file.parent.name for file in FILES}
FLOOR = {(KERNEL / room).name: floor for floor, room in enumerate((*KERNEL_ROOMS, *AROUND))}


@cache
def includes() -> Uses:
    """By the text."""
    found: dict[str, set[str]] = {stem: set() for stem in ROOM}
    for file in FILES:
        for name in re.findall(r'^#include "([^"]+)\.h"', file.read_text(encoding="utf-8"), re.M):
            if name in ROOM and name != file.stem:
                found[file.stem].add(name)
    return {stem: frozenset(others) for stem, others in found.items()}


DEFINITION = re.compile(
    r"^(?!static|typedef|return)[A-Za-z][\w *]*?\b((?:mech|fmu)_\w+)(?:\(|(?:\[\w*\])? =)", re.M
)


@cache
def names() -> Uses:
    """By the names of functions and tables in the text without comments: what macros put together does not show."""
    texts = {
        file: re.sub(
            r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"', "", file.read_text(encoding="utf-8"), flags=re.S
        )
        for file in FILES
        if file.suffix == ".c"
    }
    defined: dict[str, str] = {}
    for file, text in texts.items():
        for name in DEFINITION.findall(text):
            assert defined.setdefault(name, file.stem) == file.stem, f"{name} is defined twice"
    assert len(defined) > 100
    return {
        file.stem: frozenset(defined[n] for n in re.findall(r"\b(?:mech|fmu)_\w+", text) if n in defined)
        - {file.stem}
        for file, text in texts.items()
    }


@pytest.fixture(scope="module")
def calls(tmp_path_factory: pytest.TempPathFactory) -> Uses:
    """By the symbols of object files that are not optimised, so that functions in headers count where they are called."""
    compiler, nm = find_compiler(), shutil.which("nm")
    if compiler is None or nm is None:
        pytest.skip("no C compiler with nm")
    folder = tmp_path_factory.mktemp("objects")
    flags = ["-std=c11", "-O0", "-c", *(f"-I{KERNEL / room}" for room in (*KERNEL_ROOMS, *AROUND))]
    code = [str(file) for file in FILES if file.suffix == ".c"]
    subprocess.run([*compiler.command, *flags, f"-I{header_folder()}", *code], cwd=folder, check=True)
    defined: dict[str, str] = {}
    wanted: dict[str, set[str]] = {}
    for stem in (Path(file).stem for file in code):
        done = subprocess.run([nm, f"{stem}.o"], cwd=folder, capture_output=True, text=True, check=True)
        for kind, name in re.findall(r"^[\da-f ]*\b([A-Z]) _?(\w+)$", done.stdout, re.M):
            if kind == "U":
                wanted.setdefault(stem, set()).add(name)
            elif not name.startswith(("fmi2", "fmi3")):
                assert defined.setdefault(name, stem) == stem, f"{name} is defined twice"
    own = [name for names in wanted.values() for name in names if name.startswith(("mech_", "fmu_"))]
    assert {name for name in own if name not in defined} == {"mech_model_get", "mech_fmu_description"}
    return {
        stem: frozenset(defined[name] for name in names if name in defined) - {stem}
        for stem, names in wanted.items()
    }


def circles(uses: Uses) -> Iterator[set[str]]:
    """Yield the groups of nodes that reach each other."""
    reached: dict[str, set[str]] = {}
    for node in uses:
        seen: set[str] = set()
        pending = [node]
        while pending:
            new = uses.get(pending.pop(), frozenset()) - seen
            seen |= new
            pending += new
        reached[node] = seen
    listed: set[str] = set()
    for node in uses:
        group = {other for other in reached[node] if node in reached.get(other, ())}
        if group and node not in listed:
            listed |= group
            yield group


def climbs(uses: Uses) -> list[str]:
    """What goes from a room to a higher one, or from one of those around the kernel to the other."""
    return [
        f"{stem} ({ROOM[stem]}) uses {other} ({ROOM[other]})"
        for stem, others in uses.items()
        for other in others
        if FLOOR[ROOM[other]] > FLOOR[ROOM[stem]] or (ROOM[other] in AROUND and ROOM[other] != ROOM[stem])
    ]


def joined(first: Uses, second: Uses) -> Uses:
    return {stem: first.get(stem, frozenset()) | second.get(stem, frozenset()) for stem in ROOM}


def test_circles_are_found() -> None:
    a, b, c, d = (frozenset(x) for x in "abcd")
    assert list(circles({"a": b, "b": c, "c": d, "d": frozenset()})) == []
    assert list(circles({"a": b, "b": c | d, "c": a, "d": frozenset()})) == [{"a", "b", "c"}]


def test_names_are_unique() -> None:
    twice = [name for name, count in Counter(file.name for file in FILES).items() if count > 1]
    assert not twice, "files of all rooms lie side by side where they are copied"
    assert set(FILES) == set(KERNEL.rglob("*.[ch]")), "a file in no room"


def test_nothing_climbs() -> None:
    assert not climbs(joined(names(), includes()))


def test_no_circles() -> None:
    """A file and its header are one here: a circle of one file with another would show."""
    assert list(circles(joined(names(), includes()))) == []


@pytest.mark.slow
def test_nothing_climbs_in_what_is_compiled(calls: Uses) -> None:
    """There calls show that macros and functions in headers make; no name in the text is missed."""
    assert not climbs(joined(calls, includes()))
    assert list(circles(joined(calls, includes()))) == []
    assert all(others <= calls.get(stem, frozenset()) for stem, others in names().items())


def test_names_tell_the_file() -> None:
    """What a file of events offers begins with its name, in the plural or the singular."""
    for header in sorted((KERNEL / "events").glob("*.h")):
        text = re.sub(r"/\*.*?\*/", "", header.read_text(encoding="utf-8"), flags=re.S)
        offered = re.findall(r"^(?!static)[\w *]*?\bmech_(\w+)\(", text, re.M)
        stem = header.stem
        strange = [name for name in offered if not name.startswith((stem, stem.removesuffix("s")))]
        assert offered or stem == "events"
        assert not strange, f"{header.name} offers {strange}"
