"""How many planted faults random models catch: ``python -m random_models.planted FAULTS.md --models 300``.

The file holds faults as patches: ``## NUMBER. TITLE``, some words, and a block of diff. Each is put into a copy of the
tree, and models are examined there until one disagrees that agrees here.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

ROOT = Path(__file__).resolve().parents[3]
_CHUNK = 25


def faults(text: str) -> dict[int, tuple[str, str]]:
    """Return title and patch of each fault by its number."""
    found = {}
    for section in re.split(r"^## ", text, flags=re.M)[1:]:
        head = re.match(r"(\d+)\. *(.*)", section)
        patches = re.findall(r"^```diff\n(.*?)^```", section, re.M | re.S)
        if head and patches:
            found[int(head[1])] = head[2], "".join(patches)
    return found


def copied(folder: Path) -> Path:
    """Copy what git knows of the tree, with the changes that it does not know yet."""
    names = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.splitlines()
    for name in names:
        there = folder / name
        there.parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).exists():
            shutil.copy2(ROOT / name, there, follow_symlinks=False)
    return folder


def examine(tree: Path, first: int, last: int, mode: str) -> list[dict[str, Any]]:
    """Return what a range of models shows in a tree, in a process of its own."""
    tests = [tree, tree / "tests/random_models", tree / "tests/oracle"]
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(map(str, tests)),
        "MECHC_CACHE": str(ROOT / "build/random_models/planted_cache"),
    }
    ran = subprocess.run(
        [sys.executable, "-m", "random_models.campaign", "range", str(first), str(last), mode],
        cwd=tree,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    if ran.returncode:
        return [{"seed": first, "check": "process", "key": str(ran.returncode), "text": ran.stderr[-500:]}]
    found: list[dict[str, Any]] = json.loads(ran.stdout.splitlines()[-1])["found"]
    return found


def caught(patch: str, models: int, mode: str, first: int = 0) -> tuple[int, dict[str, Any] | None]:
    """Return how many models were examined, and the first that shows the fault."""
    with TemporaryDirectory() as folder:
        tree = copied(Path(folder))
        subprocess.run(["patch", "-p1", "-s"], cwd=tree, input=patch, text=True, check=True)
        for start in range(first, first + models, _CHUNK):
            for found in examine(tree, start, start + _CHUNK, mode):
                here = examine(ROOT, found["seed"], found["seed"] + 1, mode)
                if all((h["check"], h["key"]) != (found["check"], found["key"]) for h in here):
                    return found["seed"] + 1 - first, found
    return models, None


def main() -> None:
    """Plant each fault and say whether it was caught."""
    parser = argparse.ArgumentParser()
    parser.add_argument("file", type=Path)
    parser.add_argument("--models", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--mode", default="mixed")
    parser.add_argument("--only", type=int, nargs="*")
    given = parser.parse_args()
    for number, (title, patch) in faults(given.file.read_text()).items():
        if given.only and number not in given.only:
            continue
        begun = time.monotonic()
        try:
            count, by = caught(patch, given.models, given.mode, given.first)
        except subprocess.CalledProcessError:
            print(f"{number:3d}  does not fit  {title}", flush=True)
            continue
        said = f"{by['check']}: {by['key']} (seed {by['seed']})" if by else "not caught"
        print(
            f"{number:3d}  {count:5d} models  {time.monotonic() - begun:5.0f} s  {title}: {said}", flush=True
        )


if __name__ == "__main__":
    main()
