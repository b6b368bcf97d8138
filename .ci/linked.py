"""Run a checker where ``mechc`` holds all its packages: ``python .ci/linked.py COMMAND ...``.

A checkout has links ``mechc/lang -> ../lang`` and so on for type checkers. Where git could not make them (Windows without
developer mode, ``core.symlinks=false``), it wrote text files; the command then runs in a copy of the checkout in
``build/linked`` in which the packages stand inside ``mechc``, so that it works and names files in the same way.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LINKS = ("lang", "compiler", "runtime", "stdlib")
CHECKED = ("mechc", "tests", "docs", "bench", "examples", "pyproject.toml")
"""What checkers read; the packages come inside ``mechc``."""


def is_linked(root: Path) -> bool:
    return all((root / "mechc" / name).is_dir() for name in LINKS)


def linked(root: Path) -> Path:
    """Return the checkout, or a copy of it with its packages inside ``mechc`` where there are no links."""
    if is_linked(root):
        return root
    whole = root / "build" / "linked"
    shutil.rmtree(whole, ignore_errors=True)
    ignored = shutil.ignore_patterns("__pycache__")
    for name in CHECKED:
        if (root / name).is_dir():
            shutil.copytree(root / name, whole / name, ignore=ignored)
        else:
            shutil.copy2(root / name, whole / name)
    for name in LINKS:
        (whole / "mechc" / name).unlink()
        shutil.copytree(root / name, whole / "mechc" / name, ignore=ignored)
    return whole


def main(command: list[str]) -> int:
    where = linked(ROOT)
    if where != ROOT:
        print(
            f"mechc/lang and its like are not links here: checking the copy in {where.relative_to(ROOT)}",
            file=sys.stderr,
        )
    program = shutil.which(command[0])
    if program is None:
        print(f"there is no {command[0]}", file=sys.stderr)
        return 2
    return subprocess.run([str(Path(program).absolute()), *command[1:]], cwd=where).returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
