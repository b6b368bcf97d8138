"""The table of a stress run: a row for each extreme and each twin, and what it comes to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

from msgspec import Struct, to_builtins

WORDS = {
    "right": "right within its claim",
    "rough": "inaccurate, says so",
    "refused": "refused",
    "doubtful": "doubtful, and says so",
    "open": "not checked",
    "long": "stopped, too long",
    "same": "the same motion",
    "none": "not applicable",
    "tied": "decided by a tie",
    "parted": "NOT DETERMINED",
    "other": "ANOTHER MOTION",
    "unlike": "ANOTHER OUTCOME",
    "wrong": "WRONG SILENTLY",
    "hung": "HUNG",
    "crashed": "CRASHED",
}
BAD = ("wrong", "unlike", "hung", "crashed")
DOUBTED = ("parted", "other")
STATED, TWIN = "as stated", "twin"
"""Groups: the run that the model states, and its twins."""


class StressRow(Struct, frozen=True):
    """One run. ``kind``: a key of WORDS; ``error`` the true one, ``claim`` what the run reports, both the largest over the
    states relative to nominal + |value|; ``against`` what it was compared with."""

    group: str
    text: str
    kind: str
    method: str = ""
    error: float | None = None
    claim: float | None = None
    against: str = ""
    seconds: float = 0.0
    steps: int = 0
    reason: str = ""


class Stress(Struct, frozen=True):
    """All runs of one model."""

    model: str
    experiment: str
    rows: tuple[StressRow, ...]
    left_out: tuple[str, ...]

    @property
    def silent(self) -> bool:
        """Say whether a run was wrong without saying so, hung or crashed."""
        return any(row.kind in BAD for row in self.rows)

    @property
    def doubtful(self) -> bool:
        """Say whether a twin moves otherwise, or the start does not determine the motion, or the run as stated doubts itself."""
        return any(
            row.kind in DOUBTED or (row.kind == "doubtful" and row.group == STATED) for row in self.rows
        )

    def summary(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return {**to_builtins(self), "silent": self.silent, "doubtful": self.doubtful}


def report(made: Stress) -> str:
    """Return the table and what it comes to."""
    title = f"{made.model}{', ' + made.experiment if made.experiment else ''} under stress"
    counts = Counter(row.kind for row in made.rows)
    rows = [title, "", line_of(None), *(line_of(row) for row in made.rows), ""]
    rows.append(
        f"{len(made.rows)} runs: " + ", ".join(f"{counts[k]} {w}" for k, w in WORDS.items() if counts[k])
    )
    rows += [f"left out: {words}" for words in made.left_out]
    others = [row.text.partition(":")[0] for row in made.rows if row.kind == "other"]
    if others:
        rows.append(
            f"no row can be trusted: the same mechanics said otherwise moves otherwise ({', '.join(others)})"
        )
    rows += [
        f"the run as stated is one of several: {row.reason}" for row in made.rows if row.kind == "parted"
    ]
    return "\n".join(rows)


def line_of(row: StressRow | None) -> str:
    """Lay out one line of the table, or its head."""
    if row is None:
        cells: Sequence[str] = (
            "extreme",
            "",
            "method",
            "outcome",
            "error",
            "claimed",
            "checked by",
            "run time",
        )
        reason = ""
    else:
        error, claim = ("-" if x is None else f"{x:.0e}" for x in (row.error, row.claim))
        duration = f"{row.seconds * 1e3:.3g} ms" if row.method and row.seconds else "-"
        cells = (
            row.group,
            row.text,
            row.method or "-",
            WORDS[row.kind],
            error,
            claim,
            row.against or "-",
            duration,
        )
        reason = "  " + row.reason.splitlines()[0] if row.reason else ""
    widths = (9, 41, 7, 21, 6, 7, 15, 10)
    return ("".join(f"{cell:<{width}} " for cell, width in zip(cells, widths, strict=True)) + reason).rstrip()
