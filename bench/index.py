"""The first page of bench/report: what there is, when and on what it was measured."""

from __future__ import annotations

from .machine import MADE, REPORT

BEST = ("work_precision.md", "work_precision_double_pendulum.svg")


def main() -> None:
    seconds = 0.0
    lines = ["# Measurements", "", "`make bench` makes these pages; `python -m bench NAME` makes one.", ""]
    for page in sorted(REPORT.glob("*.md")):
        if page.name == "README.md":
            continue
        rows = [row for row in page.read_text(encoding="utf-8").splitlines() if row.strip()]
        title = rows[0].removeprefix("# ")
        made = next((row for row in reversed(rows) if row.startswith("Measured on:")), "")
        took = next((row for row in reversed(rows) if row.startswith(MADE)), "")
        seconds += float(took.removeprefix(MADE).removesuffix(" s.") or 0)
        line = f"- [{title}]({page.name}). {made.removeprefix('Measured on: ')}".rstrip(". ") + f". {took}"
        lines.append(line.rstrip())
    lines += ["", f"All pages together took {seconds / 60:.0f} minutes."]
    page_name, picture = BEST
    if (REPORT / picture).is_file():
        lines += ["", f"[![error over run time of the double pendulum]({picture})]({page_name})"]
    (REPORT / "README.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
