"""Run many random models, from where the last run stopped: ``python -m random_models.campaign 100000 2 states``."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from mechc.runtime.native import build
from mechc.runtime.native.cache import prune_cache
from random_models.checks import MODES, Disagreement, Report, examined, still
from random_models.definition import LOOKED, SKIPPED
from random_models.generator import generate
from random_models.limits import TooLong, limited
from random_models.shrink import shrunk

FOLDER = Path(__file__).resolve().parents[3] / "build" / "random_models"
_CHUNK = 100
_KEPT = 50_000_000
"""Bytes of libraries that the campaign keeps: the kernel's, and few models', as each build looks at all of them."""
_SECONDS = {"units": 400}
"""Processor time that one model may take, with all its checks; 60 without a line here."""


def results(seeds: Sequence[int], mode: str = "mixed") -> dict[str, Any]:
    """Examine the models of some seeds: counts, and what disagrees."""
    counts: Counter[str] = Counter()
    pairs: Counter[str] = Counter()
    found = []
    refused: dict[int, str] = {}
    SKIPPED.clear()
    LOOKED.clear()
    begun = _processor_time()
    for seed in seeds:
        model = generate(seed)
        print(seed, file=sys.stderr, flush=True)
        try:
            with limited(_SECONDS.get(mode, 60)):
                report = examined(model, seed, mode=mode)
        except TooLong:
            report = Report(disagreements=(Disagreement("time", "too long", ""),))
        counts["models"] += 1
        counts.update(f"refused {c}" for c in set(report.refused))
        refused |= {seed: ",".join(report.refused)} if report.refused else {}
        counts.update(f"check {c}" for c in report.checks)
        if report.checks:
            pairs.update({f"{construct}|{place}" for construct, place in model.pairs()})
        found += [
            {"seed": seed, "check": d.check, "key": d.key, "text": d.text} for d in report.disagreements
        ]
    counts.update({f"state {where}": n for where, n in LOOKED.items()})
    counts.update({f"skipped {reason}": n for reason, n in SKIPPED.items()})
    return {
        "first": min(seeds),
        "last": max(seeds) + 1,
        "seconds": _processor_time() - begun,
        "counts": dict(counts),
        "pairs": dict(pairs),
        "found": found,
        "refused": refused,
    }


def _processor_time() -> float:
    t = os.times()
    return t.user + t.system + t.children_user + t.children_system


def _chunk(first: int, mode: str) -> dict[str, Any]:
    """Examine a range in a process of its own, whose death is a finding."""
    ran = subprocess.run(
        [sys.executable, "-m", "random_models.campaign", "range", str(first), str(first + _CHUNK), mode],
        capture_output=True,
        text=True,
        check=False,
    )
    prune_cache(_KEPT)
    if ran.returncode == 0:
        line: dict[str, Any] = json.loads(ran.stdout.splitlines()[-1])
        return line
    seeds = [int(w) for w in ran.stderr.split("\n") if w.isdigit()]
    died = {"seed": seeds[-1] if seeds else first, "check": "process", "key": str(ran.returncode)}
    found = [died | {"text": ran.stderr[-2000:]}]
    return {
        "first": first,
        "last": first + _CHUNK,
        "seconds": 0.0,
        "counts": {"died": 1},
        "pairs": {},
        "found": found,
    }


def campaign(models: int, jobs: int, mode: str = "mixed", folder: Path = FOLDER) -> Counter[str]:
    """Examine the models that earlier runs have not, and write what is found to a file, a line for each range."""
    folder.mkdir(parents=True, exist_ok=True)
    # thousands of libraries that nobody needs again
    os.environ.setdefault("MECHC_CACHE", str(folder / "cache"))
    path = folder / f"{mode}.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    done = {line["first"] for line in lines}
    todo = [first for first in range(0, models, _CHUNK) if first not in done]
    start = time.monotonic()
    with path.open("a") as file, ThreadPoolExecutor(jobs) as pool:
        for k, line in enumerate(pool.map(lambda first: _chunk(first, mode), todo)):
            file.write(json.dumps(line) + "\n")
            file.flush()
            lines.append(line)
            if k % 10 == 9:
                print(
                    f"{(k + 1) * _CHUNK} models, {(k + 1) * _CHUNK / (time.monotonic() - start):.1f} a second",
                    flush=True,
                )
    return summary(lines)


def summary(lines: list[dict[str, Any]]) -> Counter[str]:
    """Add the counts of all ranges, with the number of disagreements by kind."""
    counts: Counter[str] = Counter()
    for line in lines:
        counts.update(line["counts"])
        counts["seconds of processor time"] += round(line.get("seconds", 0))
        counts.update(f"DISAGREE {f['check']}: {f['key']}" for f in line["found"])
    return counts


def _compile_in_no_time() -> None:
    """Compile models, whose libraries are called a few times, without optimisation, and by tcc where there is one."""
    for name in ("_STRAIGHT", "_LOOPS"):
        setattr(build, name, ("-O0",))
    quick = shutil.which("tcc")
    if quick is None:
        return
    run, gcc = build._run, build.find_compiler()

    def by_tcc(command: Sequence[str], folder: Path) -> None:
        straight = gcc is not None and "-O0" in command
        run([quick, *command[len(gcc.command) :]] if straight and gcc else command, folder)

    build._run = by_tcc


def explain(seed: int, seconds: float = 60, mode: str = "mixed") -> str:
    """Shrink each kind of disagreement of a seed and say what it is."""
    model = generate(seed)
    texts = []
    for d in examined(model, seed, mode=mode).disagreements:
        small = shrunk(model, still(d.check, d.key, seed, mode), seconds)
        only = "" if d.check == "crash" else d.check
        again = [x for x in examined(small, seed, only, mode=mode).disagreements if x.key == d.key]
        texts.append(f"{d.check}: {d.key}\n{small.text()}\n{again[0].text if again else d.text}")
    return "\n".join(texts) or "no disagreement"


def main() -> None:
    """Run, or explain a seed; the last word names a mode."""
    words = sys.argv[1:]
    mode = words.pop() if words and words[-1] in MODES else "mixed"
    if words and words[0] == "explain":
        print(explain(int(words[1]), mode=mode))
    elif words and words[0] == "range":
        if mode in ("states", "sparse"):
            _compile_in_no_time()
        print(json.dumps(results(range(int(words[1]), int(words[2])), mode)))
    elif words and words[0] == "seeds":
        print(json.dumps(results([int(seed) for seed in words[1:]], mode)))
    else:
        models = int(words[0]) if words else 1000
        jobs = int(words[1]) if len(words) > 1 else 1
        for name, n in sorted(campaign(models, jobs, mode).items()):
            print(f"{n:8d}  {name}")


if __name__ == "__main__":
    main()
