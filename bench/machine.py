"""What the measurements were made on, and how tables are written."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mechc.measurement.machine import described

REPORT = Path(__file__).parent / "report"
MADE = "Made in "
"""How the last line of a page begins."""


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Lay out a Markdown table."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])


def page(title: str, parts: Sequence[str]) -> str:
    """Return the text of a page, with what it was measured on."""
    return f"# {title}\n\n" + "\n\n".join([*parts, f"Measured on: {described()}."]) + "\n"


def write(name: str, title: str, parts: Sequence[str]) -> None:
    """Write one page of the report and print it."""
    text = page(title, parts)
    REPORT.mkdir(exist_ok=True)
    (REPORT / f"{name}.md").write_text(text, encoding="utf-8")
    print(text)


def note_time(name: str, seconds: float) -> None:
    """Add to a page how long it took to make."""
    file = REPORT / f"{name}.md"
    with file.open("a", encoding="utf-8") as page:
        page.write(f"\n{MADE}{seconds:.0f} s.\n")
