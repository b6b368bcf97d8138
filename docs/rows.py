"""Make docs/sources.md, all rows of the source texts, from docs/sources.txt: ``python docs/rows.py``.

A line of sources.txt is ``row | asked | answered | examples | tests | remark``: examples below examples/, tests below tests/ as
``file::function``, each with blanks between.
"""

from __future__ import annotations

from pathlib import Path

from msgspec import Struct

HERE = Path(__file__).resolve().parent
COUNTS = {"U": 155, "K": 6, "T": 26, "V": 11, "P": 18}
"""Rows of each source."""

HEAD = """# What the sources ask

Every row of five texts: what it asks, what the answer is, a file that a reader can run, and the tests that compare the answer of mechc with
it. U are lecture notes (Physics 206), K a thesis on the double pendulum, T questions of advanced mechanics, V a text on variation
principles, P a chapter of classical mechanics. `mechc run FILE`, and `mechc study FILE` where the file states studies, print the
numbers; where a formula is the answer, they print its value for the numbers of the file, and `--set` asks for others. Experiments with
names are run by `--experiment NAME`. Where the answer is a Lagrangian, an equation of motion or a momentum, `mechc equations FILE` prints it. `python docs/rows.py` makes this page from `docs/sources.txt`.

| row | asked | answered | file | tests | remark |
|---|---|---|---|---|---|
"""


class Row(Struct, frozen=True):
    name: str
    asked: str
    answered: str
    examples: tuple[str, ...]
    tests: tuple[str, ...]
    remark: str


def ids() -> list[str]:
    """Return the names of all rows in the order of the sources."""
    return [f"{letter}{k}" for letter, count in COUNTS.items() for k in range(1, count + 1)]


def read() -> list[Row]:
    """Return the rows of sources.txt."""
    found = []
    for line in (HERE / "sources.txt").read_text(encoding="utf-8").splitlines():
        name, asked, answered, examples, tests, *remark = line.split(" | ")
        found.append(
            Row(name, asked, answered, tuple(examples.split()), tuple(tests.split()), " ".join(remark))
        )
    return found


def page() -> str:
    """Return the text of sources.md."""
    lines = []
    for row in read():
        files = ", ".join(f"[{name.rpartition('/')[2]}](../examples/{name}.mech)" for name in row.examples)
        tests = ", ".join(_test(test) for test in row.tests)
        lines.append(f"| {row.name} | {row.asked} | {row.answered} | {files} | {tests} | {row.remark} |\n")
    return HEAD + "".join(lines)


def _test(test: str) -> str:
    file, _, function = test.partition("::")
    return f"[{function}](../tests/{file})"


if __name__ == "__main__":
    (HERE / "sources.md").write_text(page(), encoding="utf-8")
