"""The page docs/stability.md, and the lines that are printed while the suite runs."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path
from tempfile import gettempdir

from mechc.measurement.machine import described

from ..machine import table
from .case import Row
from .faults import FAULTS

PAGE = Path(__file__).parents[2] / "docs" / "stability.md"
LEAD = """\
# Stiff and extreme cases

Each case states what is expected of it: an answer that is known within a bound, or a refusal that names time, state
and cause. `python -m bench.stability --quick` runs them and writes this page, `--full` adds the long ones;
`--mutated` runs every case in a mutant of mechc in which its expectation must fail (column *fails if*). *Error* is the true one in the measure of the expectation, *estimated* what
the run itself reports for the same states, relative to nominal + |value|. A run is *silent* if it is wrong and
does not say so; a case that hangs or crashes is ended by a watchdog and shown as such. Run time is that of the main
run in the kernel. `mechc stress MODEL` makes such cases out of any model.
"""


def line(row: Row) -> str:
    error = "" if row.error is None else f" error {row.error:.1e}"
    claim = "" if row.claim is None else f" estimated {row.claim:.1e}"
    mark = "ok  " if row.kind == "met" else row.kind.upper()
    tail = f"  <- {_short(row.reason)}" if row.reason else ""
    made = f" {row.method} {row.steps} steps {row.seconds * 1e3:.3g} ms" if row.method else ""
    return f"{mark} {row.group:>2} {row.name}:{error}{claim}{made} | {_short(row.outcome)}{tail}"


def write(rows: list[Row], titles: dict[int, str], *, full: bool, seconds: float) -> None:
    """Write the page: a summary, then a table for each group."""
    kinds = Counter(row.kind for row in rows)
    counts = ", ".join(
        f"{kinds[k]} {words}" for k, words in KINDS.items() if kinds[k] or k in ("met", "silent")
    )
    parts = [LEAD.rstrip(), f"{len(rows)} cases ({'all' if full else 'without the long ones'}): {counts}."]
    for number, title in sorted(titles.items()):
        own = [row for row in rows if row.group == number]
        if own:
            parts += [f"## {number} {title}", table(HEAD, [_cells(row) for row in own])]
    parts.append(f"Measured in {seconds:.0f} s on: {described()}.")
    PAGE.write_text("\n\n".join(parts) + "\n", encoding="utf-8")


KINDS = {
    "met": "as expected",
    "not met": "not as expected",
    "silent": "silently wrong",
    "crashed": "crashed",
    "hung": "hung",
}
HEAD = (
    "case",
    "extreme",
    "expected",
    "method",
    "outcome",
    "error",
    "estimated",
    "steps",
    "run time",
    "fails if",
    "",
)


def _cells(row: Row) -> list[str]:
    number = ["-" if x is None else f"{x:.0e}" for x in (row.error, row.claim)]
    time = f"{row.seconds * 1e3:.3g} ms" if row.method else "-"
    verdict = KINDS[row.kind] + (f": {_short(row.reason)}" if row.reason else "")
    cells = [row.name, row.extreme, row.expects, row.method or "-", _short(row.outcome), *number]
    cells += [str(row.steps) if row.method else "-", time, FAULTS[row.fault].text, verdict]
    return [cell.replace("|", "\\|").replace("\n", " ") for cell in cells]


def _short(text: str) -> str:
    text = text.splitlines()[0].replace(gettempdir() + os.sep, "") if text else ""
    return text if len(text) <= 160 else text[:157] + "..."
