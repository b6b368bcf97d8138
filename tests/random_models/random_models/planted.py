"""How many planted faults random models catch: ``python -m random_models.planted FAULTS.md --models 300``.

The file holds faults as patches: ``## NUMBER. TITLE``, some words, and a block of diff. Each is put into a copy of the
tree, and models are examined there until one disagrees that agrees here.
"""

from __future__ import annotations

import argparse
import functools
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import mechc
from random_models.generator import generate
from random_models.limits import TooLong, limited

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


def digests(first: int, last: int) -> dict[str, str]:
    """Return what the compiler makes of each model, as a digest."""
    found = {}
    for seed in range(first, last):
        try:
            with limited(20):
                made = str(mechc.loads(generate(seed).text()).compilation.program)
        except (Exception, TooLong) as error:
            made = repr(error)
        found[str(seed)] = hashlib.md5(made.encode()).hexdigest()
    return found


def _run(tree: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run a module in a tree, in a process of its own."""
    tests = [tree, tree / "tests/random_models", tree / "tests/oracle"]
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(map(str, tests)),
        "MECHC_CACHE": str(ROOT / "build/random_models/planted_cache"),
    }
    return subprocess.run(
        [sys.executable, "-m", *words], cwd=tree, env=environment, capture_output=True, text=True, check=False
    )


@functools.cache
def _state() -> str:
    """Return a digest of the tree as it is now."""
    asked = (["git", "rev-parse", "HEAD"], ["git", "diff", "HEAD"])
    said = [subprocess.run(words, cwd=ROOT, capture_output=True, check=True).stdout for words in asked]
    return hashlib.md5(b"".join(said)).hexdigest()


def changed(tree: Path, first: int, last: int) -> list[int]:
    """Return the models of which the compiler makes something else in a tree than here."""
    kept = ROOT / "build/random_models/digests" / _state() / f"{first}_{last}.json"
    if not kept.exists():
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(json.dumps(digests(first, last)))
    here: dict[str, str] = json.loads(kept.read_text())
    ran = _run(tree, "random_models.planted", "digests", str(first), str(last))
    there: dict[str, str] = json.loads(ran.stdout) if ran.returncode == 0 else {}
    return [int(seed) for seed, digest in here.items() if there.get(seed) != digest]


def examine(tree: Path, first: int, last: int, mode: str) -> list[dict[str, Any]]:
    """Return what a range of models shows in a tree."""
    ran = _run(tree, "random_models.campaign", "range", str(first), str(last), mode)
    if ran.returncode:
        return [{"seed": first, "check": "process", "key": str(ran.returncode), "text": ran.stderr[-500:]}]
    found: list[dict[str, Any]] = json.loads(ran.stdout.splitlines()[-1])["found"]
    return found


def caught(
    patch: str, models: int, mode: str, first: int = 0, *, by_program: bool = False
) -> tuple[int, dict[str, Any] | None]:
    """Return how many models were examined, and the first that shows the fault.

    ``by_program``: only models are examined of which the compiler makes something else, the others count as they are.
    """
    with TemporaryDirectory() as folder:
        tree = copied(Path(folder))
        subprocess.run(["patch", "-p1", "-s"], cwd=tree, input=patch, text=True, check=True)
        ranges: Iterable[tuple[int, int]] = [
            (start, start + _CHUNK) for start in range(first, first + models, _CHUNK)
        ]
        if by_program:
            wide = range(first, first + models, 4 * _CHUNK)
            ranges = ((n, n + 1) for start in wide for n in changed(tree, start, start + 4 * _CHUNK))
        for start, stop in ranges:
            for found in examine(tree, start, stop, mode):
                here = examine(ROOT, found["seed"], found["seed"] + 1, mode)
                if all((h["check"], h["key"]) != (found["check"], found["key"]) for h in here):
                    return found["seed"] + 1 - first, found
    return models, None


def main() -> None:
    """Plant each fault and say whether it was caught."""
    if sys.argv[1] == "digests":
        print(json.dumps(digests(int(sys.argv[2]), int(sys.argv[3]))))
        return
    parser = argparse.ArgumentParser()
    parser.add_argument("file", type=Path)
    parser.add_argument("--models", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--mode", default="mixed")
    parser.add_argument("--only", type=int, nargs="*")
    parser.add_argument("--by-program", action="store_true")
    given = parser.parse_args()
    for number, (title, patch) in faults(given.file.read_text()).items():
        if given.only and number not in given.only:
            continue
        begun = time.monotonic()
        try:
            count, by = caught(patch, given.models, given.mode, given.first, by_program=given.by_program)
        except subprocess.CalledProcessError:
            print(f"{number:3d}  does not fit  {title}", flush=True)
            continue
        said = f"{by['check']}: {by['key']} (seed {by['seed']})" if by else "not caught"
        print(
            f"{number:3d}  {count:5d} models  {time.monotonic() - begun:5.0f} s  {title}: {said}", flush=True
        )


if __name__ == "__main__":
    main()
