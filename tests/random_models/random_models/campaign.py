"""Run many random models, from where the last run stopped: ``python -m random_models.campaign 100000``."""

from __future__ import annotations

import json
import sys
import time
from collections import Counter
from multiprocessing import Pool
from pathlib import Path
from typing import Any

from random_models.checks import examined, still
from random_models.generator import generate
from random_models.shrink import shrunk

FOLDER = Path(__file__).resolve().parents[3] / "build" / "random_models"
_CHUNK = 50


def results(first: int, last: int) -> dict[str, Any]:
    """Examine the models of a range of seeds: counts, and what disagrees."""
    counts: Counter[str] = Counter()
    pairs: Counter[str] = Counter()
    found = []
    for seed in range(first, last):
        model = generate(seed)
        report = examined(model, seed)
        counts["models"] += 1
        counts.update(f"refused {c}" for c in set(report.refused))
        counts.update(f"check {c}" for c in report.checks)
        if report.checks:
            pairs.update({f"{construct}|{place}" for construct, place in model.pairs()})
        found += [
            {"seed": seed, "check": d.check, "key": d.key, "text": d.text} for d in report.disagreements
        ]
    return {"first": first, "last": last, "counts": dict(counts), "pairs": dict(pairs), "found": found}


def _chunk(first: int) -> dict[str, Any]:
    return results(first, first + _CHUNK)


def campaign(models: int, jobs: int, folder: Path = FOLDER) -> Counter[str]:
    """Examine the models that earlier runs have not, and write what is found to a file, a line for each range."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "results.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    done = {line["first"] for line in lines}
    todo = [first for first in range(0, models, _CHUNK) if first not in done]
    start = time.monotonic()
    with path.open("a") as file, Pool(jobs) as pool:
        for k, line in enumerate(pool.imap_unordered(_chunk, todo)):
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
        counts.update(f"DISAGREE {f['check']}: {f['key']}" for f in line["found"])
    return counts


def explain(seed: int, seconds: float = 60) -> str:
    """Shrink each kind of disagreement of a seed and say what it is."""
    model = generate(seed)
    texts = []
    for d in examined(model, seed).disagreements:
        small = shrunk(model, still(d.check, d.key, seed), seconds)
        again = [
            x
            for x in examined(small, seed, "" if d.check == "crash" else d.check).disagreements
            if x.key == d.key
        ]
        texts.append(f"{d.check}: {d.key}\n{small.text()}\n{again[0].text if again else d.text}")
    return "\n".join(texts) or "no disagreement"


def main() -> None:
    """Run, or explain a seed."""
    words = sys.argv[1:]
    if words and words[0] == "explain":
        print(explain(int(words[1])))
        return
    models = int(words[0]) if words else 1000
    jobs = int(words[1]) if len(words) > 1 else 1
    for name, n in sorted(campaign(models, jobs).items()):
        print(f"{n:8d}  {name}")


if __name__ == "__main__":
    main()
