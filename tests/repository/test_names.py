"""One meaning for a name: classes that share a name are listed, and the list only shrinks."""

from __future__ import annotations

import ast
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LIST = Path(__file__).with_name("names_used_twice.txt")
STAGES = {"lang/ast.py", "compiler/flat/model.py"}
"""A statement has the same name as syntax and as a part of the flat model."""


def classes(root: Path) -> dict[str, set[str]]:
    """Return the files of each public class, by its name."""
    found: dict[str, set[str]] = defaultdict(set)
    for top in ("lang", "compiler", "runtime", "mechc"):
        for path in (root / top).rglob("*.py"):
            name = path.relative_to(root).as_posix()
            if any((root / part).is_symlink() for part in path.relative_to(root).parents):
                continue
            for item in ast.parse(path.read_text(encoding="utf-8")).body:
                if isinstance(item, ast.ClassDef) and not item.name.startswith("_"):
                    found[item.name].add(name)
    return found


def test_no_further_name_has_two_meanings() -> None:
    doubled = {
        name for name, files in classes(ROOT).items() if len(files - STAGES) + bool(files & STAGES) > 1
    }
    listed = set(LIST.read_text(encoding="utf-8").split())
    assert not doubled - listed, f"give them names of their own: {sorted(doubled - listed)}"
    assert not listed - doubled, f"take them from {LIST.name}: {sorted(listed - doubled)}"
