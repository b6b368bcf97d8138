"""What the measurements were made on, and how tables are written."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from mechc.runtime.native.build import find_compiler

REPORT = Path(__file__).parent / "report"
MADE = "Made in "
"""How the last line of a page begins."""


def described() -> str:
    """Say date, processor, system, C compiler and Python in one line."""
    cpu = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.is_file():
        names = [
            r.partition(":")[2].strip() for r in info.read_text().splitlines() if r.startswith("model name")
        ]
        cpu = f"{len(names)} x {names[0]}" if names else cpu
    compiler = find_compiler()
    cc = compiler.version.splitlines()[0] if compiler else "no C compiler"
    date = datetime.now().astimezone().date().isoformat()
    return f"{date}; {cpu}; {platform.system()}; {cc}; Python {platform.python_version()}"


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
