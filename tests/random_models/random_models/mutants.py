"""Mutation testing of the random models: ``python -m random_models.mutants 12-03 --models 300``.

A mutant is a patch in ``tests/mutants`` that makes mechc wrong; ``mutants.csv`` there lists them all. Each is applied to a copy of the
tree, and models are examined there until one disagrees that agrees here.
"""

from __future__ import annotations

import argparse
import csv
import functools
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

from msgspec import Struct

import mechc
from random_models.checks import composed_of, structured_of
from random_models.composing import as_people_compose
from random_models.generator import generate
from random_models.limits import TooLong, limited

ROOT = Path(__file__).resolve().parents[3]
FOLDER = ROOT / "tests/mutants"
_CHUNK = 10


class Mutant(Struct, frozen=True):
    """One row of ``mutants.csv``. ``origin``: ``new``, or ``old`` for an error that mechc once had. ``mode`` and ``model``: what is
    known to catch it, empty if nothing is; ``machines`` is a mode of its own."""

    mutant: str
    origin: str
    mode: str
    model: str
    mutation: str

    @property
    def patch(self) -> str:
        return (FOLDER / f"{self.mutant}.patch").read_text(encoding="utf-8")


def mutants() -> dict[str, Mutant]:
    """Return all mutants by their names."""
    with (FOLDER / "mutants.csv").open(encoding="utf-8", newline="") as file:
        return {row["mutant"]: Mutant(**row) for row in csv.DictReader(file)}


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


def digests(seeds: Sequence[int]) -> dict[str, str]:
    """Return what the compiler makes of each model, as a digest."""
    found = {}
    for seed in seeds:
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
        "MECHC_CACHE": str(ROOT / "build/random_models/mutant_cache"),
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


def changed(tree: Path, seeds: Sequence[int]) -> list[int]:
    """Return the models of which the compiler makes something else in a tree than here."""
    name = hashlib.md5(repr(tuple(seeds)).encode()).hexdigest()
    kept = ROOT / "build/random_models/digests" / _state() / f"{name}.json"
    if not kept.exists():
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(json.dumps(digests(seeds)))
    here: dict[str, str] = json.loads(kept.read_text())
    ran = _run(tree, "random_models.mutants", "digests", *map(str, seeds))
    there: dict[str, str] = json.loads(ran.stdout) if ran.returncode == 0 else {}
    return [int(seed) for seed, digest in here.items() if there.get(seed) != digest]


def texts(seed: int) -> str:
    """Return the text of a model, and of the twins that are written for it."""
    model = generate(seed)
    twins = structured_of(model, seed), composed_of(model, seed), as_people_compose(model, Random(seed))
    return "\n".join((model.text(), *(twin.model.text() for twin in twins if twin is not None)))


def examine(tree: Path, seeds: Sequence[int], mode: str) -> list[dict[str, Any]]:
    """Return what some models show in a tree, or some machines."""
    if mode == "machines":
        said = _run(tree, "random_models.machines", str(seeds[0]), str(seeds[-1] + 1)).stdout
        return [
            {"seed": int(seed), "check": "machine", "key": "", "text": text}
            for seed, text in re.findall(r"^(\d+): (.*)", said, re.M)
        ]
    ran = _run(tree, "random_models.campaign", "seeds", *map(str, seeds), mode)
    if ran.returncode:
        begun = [int(word) for word in ran.stderr.split("\n") if word.isdigit()] or list(seeds)
        died = {"check": "process", "key": str(ran.returncode), "text": ran.stderr[-500:]}
        return [{"seed": begun[-1]} | died]
    told: dict[str, Any] = json.loads(ran.stdout.splitlines()[-1])
    refused = [
        {"seed": int(seed), "check": "refused", "key": codes, "text": ""}
        for seed, codes in told["refused"].items()
    ]
    return [*told["found"], *refused]


def caught(
    patch: str, seeds: Sequence[int], mode: str, *, by_program: bool = False
) -> tuple[int, dict[str, Any] | None]:
    """Return how many models were examined, and the first that catches the mutant.

    ``by_program``: only models are examined of which the compiler makes something else.
    """
    with TemporaryDirectory() as folder:
        tree = copied(Path(folder))
        subprocess.run(["patch", "-p0", "-s"], cwd=tree, input=patch, text=True, check=True)
        done = 0
        for start in range(0, len(seeds), _CHUNK):
            chunk = list(seeds[start : start + _CHUNK])
            chosen = changed(tree, chunk) if by_program else chunk
            for found in examine(tree, chosen, mode) if chosen else []:
                here = examine(ROOT, [found["seed"]], mode)
                if all((h["check"], h["key"]) != (found["check"], found["key"]) for h in here):
                    return done + chosen.index(found["seed"]) + 1, found
            done += len(chosen)
    return done, None


def again(chosen: Sequence[Mutant]) -> int:
    """Examine the model that is known to catch each mutant; return how many survive."""
    survivors = 0
    for one in chosen:
        by = None
        if one.mode:
            try:
                _, by = caught(one.patch, [int(one.model)], one.mode)
            except subprocess.CalledProcessError:
                by = {"check": "the patch does not apply", "key": ""}
                survivors += 1
        survivors += by is None
        shown = f"{by['check']}: {by['key']}" if by else "SURVIVES"
        print(f"{one.mutant}  {one.mutation}: {one.mode} {one.model}: {shown}", flush=True)
    return survivors


def main() -> None:
    """Apply each mutant and say whether it was caught."""
    if sys.argv[1:2] == ["digests"]:
        print(json.dumps(digests([int(seed) for seed in sys.argv[2:]])))
        return
    parser = argparse.ArgumentParser(prog="python -m random_models.mutants", description=__doc__)
    parser.add_argument(
        "names", nargs="*", help="of mutants, as 12-03, or of a whole set, as 12 (default: all)"
    )
    parser.add_argument("--models", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--mode", default="mixed")
    parser.add_argument(
        "--by-program", action="store_true", help="only models whose compiled program changes"
    )
    parser.add_argument("--holding", help="only models whose text, or that of a twin, matches this pattern")
    parser.add_argument(
        "--again", action="store_true", help="only the model that is known to catch the mutant"
    )
    given = parser.parse_args()
    chosen = [
        one
        for name, one in mutants().items()
        if not given.names or name in given.names or name.partition("-")[0] in given.names
    ]
    if given.again:
        sys.exit(again(chosen))
    seeds: Sequence[int] = range(given.first, given.first + given.models)
    if given.holding:
        seeds = [seed for seed in seeds if re.search(given.holding, texts(seed), re.S)]
    for one in chosen:
        begun = time.monotonic()
        try:
            count, by = caught(one.patch, seeds, given.mode, by_program=given.by_program)
        except subprocess.CalledProcessError:
            print(f"{one.mutant}  does not apply  {one.mutation}", flush=True)
            continue
        said = f"{by['check']}: {by['key']} (seed {by['seed']})" if by else "survives"
        print(
            f"{one.mutant}  {count:5d} models  {time.monotonic() - begun:5.0f} s  {one.mutation}: {said}",
            flush=True,
        )


if __name__ == "__main__":
    main()
