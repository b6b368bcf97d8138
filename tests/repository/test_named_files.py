"""Files that docstrings and ARCHITECTURE.md name are there."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ("lang", "compiler", "runtime", "stdlib")
KEPT = (*SOURCES, "mechc", "tests", "docs", "bench", "examples", "editors")
QUOTED = re.compile(r"``([\w/-]+\.(?:py|c|h|js))``|\(([\w/-]+\.py)\)|\(((?:[\w-]+/)+[\w-]+\.[ch])\)")
"""A file in double backticks, or alone in parentheses."""
ELSEWHERE = {"mach/machine.h", "mach-o/fat.h", "setup.py", "names.h"}
"""Files of systems, of other programs and of exported FMUs."""


def known(*tops: str) -> set[str]:
    return {
        f"/{path.relative_to(ROOT).as_posix()}{'/' if path.is_dir() else ''}"
        for top in tops
        for path in (ROOT / top, *(ROOT / top).rglob("*"))
    }


def missing(names: Iterable[str], files: set[str]) -> set[str]:
    """Return the names that end no path."""
    return {name for name in names if not any(path.endswith(f"/{name}") for path in files)}


def test_files_that_docstrings_name_are_there() -> None:
    files = known(*KEPT)
    named: dict[str, set[str]] = {}
    for top in (*SOURCES, "mechc"):
        for path in (ROOT / top).rglob("*.py"):
            for found in QUOTED.findall(path.read_text(encoding="utf-8")):
                named.setdefault("".join(found), set()).add(path.relative_to(ROOT).as_posix())
    assert len(named) > 100
    assert {name: sorted(named[name]) for name in missing(named.keys() - ELSEWHERE, files)} == {}


def test_files_that_the_architecture_names_are_there() -> None:
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`((?:[\w.-]+/)+[\w.-]*|[\w-]+\.(?:py|c|h|js|mech))`", text))
    assert len(named) > 50
    assert missing(named, known(*KEPT)) == set()
