"""The page of mutants: a row for each, and whether all is as it must be."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from ..machine import table, write
from . import energy, former
from .fault import changed
from .judged import FACTOR, Found, Judge, Run, Stressed

HEAD = ("fault", "balance off by", "estimated error", "times", "run", "stress")
WORDS = {
    "same": "",
    "none": "",
    "right": "",
    "open": "",
    "long": "",
    "rough": "inaccurate",
    "tied": "",
    "parted": "not determined by its start",
    "other": "another motion",
}
"""Of the rows of stress; those that find nothing are not listed."""
IMPOSSIBLE = """\
Of what was found under these headings no row stands here for 10 (outputs that were dropped, warnings that were missing), 11 (an
importer's method, not a run), 14 and 15 (exported programs and their tables) and 16 (mechanisms, settings and units that
were refused): `mechc run` and `mechc stress` moved these models rightly or not at all, so that there is no run to doubt."""


def main(quick: bool = False, only: str = "") -> int:
    """Plant the faults whose words hold ``only``; write the page if these are all. The exit code is 1 unless all is well."""
    wanted = {
        "Faults that move energy": [f for f in energy.FAULTS if only in f.text],
        "Faults that mechc once had": [f for f in former.FAULTS if only in f.text],
    }
    if quick:
        wanted = {title: faults[::6] for title, faults in wanted.items()}
    for faults in wanted.values():
        for fault in faults:
            changed(fault.edits)  # what does not fit is told before anything is run
    with TemporaryDirectory(prefix="mechc-mutant-") as work:
        judge = Judge(Path(work).resolve())
        found = {title: [_shown(judge(f)) for f in faults] for title, faults in wanted.items()}
    every = [one for made in found.values() for one in made]
    print(_sum(every))
    if not only:
        write("mutants", "Mutants", _parts(found))
    return int(not all(one.good for one in every))


def _shown(one: Found) -> Found:
    print(("" if one.good else "NOT AS IT MUST BE  ") + " | ".join(row(one)), flush=True)
    return one


def _parts(found: dict[str, list[Found]]) -> Sequence[str]:
    every = [one for made in found.values() for one in made]
    parts = [
        "Each fault is put into a copy of mechc, where a model that reaches it is run and put under stress (the run "
        f"as stated, and its twins). {_sum(every)} Times: what the balance is off by, as a share of the largest energy, over the "
        f"largest estimated error; from {FACTOR:g} on the run must be doubtful. `python -m bench.mutants` ends with exit code 1 if "
        "one is not, if a model is doubtful without its fault, or if stress calls right what it must not. Where an old fault moves less, "
        "it leads to another motion that keeps its own balance, which no run can see."
    ]
    for title, made in found.items():
        parts += [f"## {title}", table(HEAD, [row(one) for one in made])]
    return [*parts, IMPOSSIBLE]


def _sum(every: Sequence[Found]) -> str:
    owed = [one for one in every if one.owed]
    once = [one for one in every if one.fault.point]
    told = sum(one.good and one.owed for one in every)
    right = sum(one.stressed.right for one in once)
    return (
        f"{len(every)} faults; {len(owed)} of them move energy by more than {FACTOR:g} times the estimated error, and "
        f"{told} of these runs are doubtful. Of {len(once)} faults that mechc once had stress calls {right} right."
    )


def row(one: Found) -> list[str]:
    """Return the cells of a fault."""
    fault = one.fault
    point = f" ({fault.point})" if fault.point else ""
    return [
        f"{fault.text}{point}",
        _number(one.mutant.off),
        _number(one.mutant.estimate),
        _number(one.moved),
        _ended(one.mutant, one.sound),
        _stressed(one.stressed, one.sound_stressed),
    ]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.1e}"


def _ended(run: Run, sound: Run) -> str:
    without = "" if sound.code == 0 else f"; without the fault {sound.outcome}, exit code {sound.code}"
    return f"{run.outcome}, exit code {run.code}{without}"


def _stressed(made: Stressed, sound: Stressed) -> str:
    told = [f"{name or 'the run'}: {WORDS.get(k, k)}" for name, k in made.kinds.items() if WORDS.get(k, k)]
    without = "" if sound.code == 0 else f"; without the fault exit code {sound.code}"
    verdict = "right" if made.right else f"exit code {made.code}"
    return verdict + (f" ({', '.join(told)})" if told else "") + without
