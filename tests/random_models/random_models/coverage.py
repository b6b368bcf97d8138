"""What may stand where: every construct at every place, compared, or refused in words: ``python -m random_models.coverage``."""

from __future__ import annotations

import json
import signal
import sys
import warnings
from collections import defaultdict
from multiprocessing import Pool
from pathlib import Path
from typing import Any

from random_models.compiled import Refused, compiled
from random_models.definition import OracleFails, along, undone
from random_models.motions import run
from random_models.probes import CONSTRUCTS, LATER, PLACES, Construct, Place, probe

PAGE = Path(__file__).resolve().parents[3] / "docs" / "what_may_stand_where.md"
WORKS = "·"
UNKNOWN = "?"
SECONDS = 3
FAULTS = ("WRONG", "CRASH", "FAILS")
KEPT = PAGE.parents[1] / "build" / "random_models" / "cells.jsonl"


def cell(construct: Construct, place: Place) -> tuple[str, str]:
    """Return what a pair does, and what is to be known about it: works, a code, or a fault in capitals."""
    text = probe(construct, place)
    if text is None:
        return "", ""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            base = compiled(text)
            if base.switches:
                motion: Any = run(text, stop=LATER)
                if str(motion.outcome) == "Outcome.FAILED":
                    return "FAILS", motion.message
                wrong = along(base, motion, _ignored(place))
            else:
                wrong = undone(base, 1, 1, _ignored(place))
    except Refused as refused:
        return refused.codes[0], refused.text
    except OracleFails as error:
        return UNKNOWN, f"the oracle: {error}"
    except Exception as error:
        return "CRASH", repr(error)[:300]
    return ("WRONG", wrong[0][1] + text) if wrong else (WORKS, "")


def table(jobs: int = 1) -> dict[tuple[str, str], tuple[str, str]]:
    """Return all cells; those that an earlier run of the same sources has found are read."""
    KEPT.parent.mkdir(parents=True, exist_ok=True)
    lines = [json.loads(line) for line in KEPT.read_text().splitlines()] if KEPT.exists() else []
    kept = {line["text"]: (line["what"], line["said"]) for line in lines}
    pairs = [(c, p, probe(c, p)) for p in PLACES for c in CONSTRUCTS]
    todo = [(c, p) for c, p, text in pairs if text is not None and text not in kept]
    with KEPT.open("a") as file, Pool(jobs) as pool:
        for (c, p), (what, said) in zip(todo, pool.imap(_cell, todo, chunksize=2), strict=True):
            text = probe(c, p) or ""
            kept[text] = (what, said)
            file.write(json.dumps({"text": text, "what": what, "said": said}) + "\n")
            file.flush()
    return {(c.name, p.name): kept[text] if text is not None else ("", "") for c, p, text in pairs}


def _ignored(place: Place) -> tuple[str, ...]:
    """Return outputs whose meaning pages leave open: as in ``definition.ignored``."""
    return ("energy.potential", "energy.kinetic") if place.name in ("potential", "lagrangian") else ()


class TooLong(BaseException):
    """A cell takes longer than its share."""


def _cell(pair: tuple[Construct, Place]) -> tuple[str, str]:
    """Find a cell within its share of processor time."""

    def stop(number: int, frame: object) -> None:
        raise TooLong

    signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, SECONDS)
    try:
        return cell(*pair)
    except TooLong:
        return UNKNOWN, f"takes longer than {SECONDS} s to compare"
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)


_HEAD = """\
# What may stand where

Each construct of the language at each place where an expression may stand. `·` is computed, and compared with the
definition of the language; a code is the message with which mechc refuses it (`mechc explain CODE`). A blank is a number
where a truth value belongs, or the other way round. What is refused only when the motion starts (`run`), is not compared (`?`) or
wrong (`WRONG`, `CRASH`, `FAILS`) would be shown, too; a test holds that no cell is. Made by `python -m random_models.coverage`.
"""


def page(cells: dict[tuple[str, str], tuple[str, str]]) -> str:
    """Write the page: a table for each group of places."""
    text = [_HEAD]
    groups: dict[str, list[Place]] = defaultdict(list)
    for p in PLACES:
        groups[p.group].append(p)
    for group, places in groups.items():
        text.append(f"\n## Places: {group}\n")
        letters = [chr(ord("a") + k) for k in range(len(places))]
        text += [
            ", ".join(f"**{letter}** {p.name}" for letter, p in zip(letters, places, strict=True)) + "\n"
        ]
        text.append("| | " + " | ".join(letters) + " |")
        text.append("|---|" + "---|" * len(places))
        for c in CONSTRUCTS:
            row = [cells[c.name, p.name][0] for p in places]
            if any(row):
                name = c.name.replace("|", "\\|")
                text.append(f"| `{name}` | " + " | ".join(row) + " |")
    return "\n".join(text) + "\n"


def main() -> None:
    """Write the page; what is wrong is said."""
    cells = table(int(sys.argv[1]) if len(sys.argv) > 1 else 1)
    PAGE.write_text(page(cells), encoding="utf-8")
    for (construct, place), (what, text) in cells.items():
        if what in FAULTS:
            print(f"{what}: {construct} in {place}: {text}\n")


if __name__ == "__main__":
    main()
