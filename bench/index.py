"""The first page of bench/report, which alone is kept: what there is, short tables, when and on what it was measured."""

from __future__ import annotations

import re

from .machine import MADE, REPORT

MEASURED = "Measured on: "
SHORT = 14
"""Rows of a table that the first page takes over."""
PICTURE = "work_precision_double_pendulum.svg"

HEAD = f"""# Measurements

The short tables of all pages. `make bench` makes the pages with the rest and with diagrams in this folder,
`python -m bench NAME` one of them.

![error over run time of the double pendulum]({PICTURE})
"""


def main() -> None:
    first = REPORT / "README.md"
    kept = sections(first.read_text(encoding="utf-8")) if first.is_file() else {}
    made = {
        page.name: section(page.name, page.read_text(encoding="utf-8"))
        for page in REPORT.glob("*.md")
        if page != first
    }
    first.write_text(index({**kept, **made}), encoding="utf-8")


def index(parts: dict[str, str]) -> str:
    """Return the first page with its sections, in the order of their pages."""
    seconds = sum(int(s) for text in parts.values() for s in re.findall(rf"{MADE}(\d+) s\.$", text))
    last = f"All pages together took {seconds / 60:.0f} minutes.\n"
    return "\n".join([HEAD, *(f"{parts[name]}\n" for name in sorted(parts)), last])


def sections(text: str) -> dict[str, str]:
    """Return the sections of a first page by the files they are of: a page that is not made again keeps its own."""
    found = {}
    for part in re.split(r"^(?=## )", text, flags=re.MULTILINE)[1:]:
        end = re.search(r"^In `(\S+)`\..*$", part, re.MULTILINE)
        assert end is not None, part
        found[end[1]] = part[: end.end()]
    return found


def section(name: str, text: str) -> str:
    """Return what the first page says of another: its title, its first words, its short tables."""
    blocks = text.strip().split("\n\n")
    made = next((b.removeprefix(MEASURED) for b in reversed(blocks) if b.startswith(MEASURED)), "")
    took = next((b for b in reversed(blocks) if b.startswith(MADE)), "")
    tables = [b for b in blocks[2:] if b.startswith("|") and b.count("\n") <= SHORT + 1 and "](" not in b]
    title = blocks[0].removeprefix("# ")
    return "\n\n".join([f"## {title}", blocks[1], *tables, f"In `{name}`. {made} {took}".rstrip()])


if __name__ == "__main__":
    main()
