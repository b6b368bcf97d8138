"""What stands in the pages after no test of their own: every ``mechc ...`` line is typed, in a folder with the files of its page.

``test_code_blocks.py`` looks at the words of the lines; here they run. The how-tos, the explanations and the tutorial are followed
as a whole by other tests, and so is the first command of each section of the studies.
"""

from __future__ import annotations

import contextlib
import importlib.util
import io
import re
import shlex
import webbrowser
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from msgspec import Struct
from page_blocks import Block, blocks, steps, unlike

import mechc
from mechc.cli.main import run

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
NOT_TYPED = {
    "mechc run ball.mech --vary members.csv --keep 'reach = final(x)' --cluster tcp://10.0.0.1:8786 -o reach.zarr": (
        "needs a cluster; test_pages_to_follow.py types the lines before it with workers of this machine"
    ),
    "mechc fmu run cart.fmu --input push=push.csv --every 0.001": (
        "needs an FMU with an input, which no command of the page writes; tests/mechc/fmu run such"
    ),
    "mechc view cart.mech --input push=measured.csv": (
        "needs a model and a table of the reader's own; tests/mechc/web/test_tables_on_pages.py gives pages such"
    ),
}
"""Lines that cannot be typed here, with the reason: they install, wait for editors, or need other machines."""

TAKEN = re.compile(r" +[\d.]+ [um]?s$", re.MULTILINE)
"""Processor times at the ends of rows."""
NEEDS_ZIG = re.compile(r"--platform")


class Typed(Struct, frozen=True):
    """The commands of a section in order, each with lines that it prints, and the models that stand before it."""

    page: Path
    section: str
    lines: tuple[tuple[str, tuple[str, ...], tuple[str, ...]], ...]


def sections(page: Path) -> Iterator[Typed]:
    """Yield the sections of a page in which something is typed."""
    for part in re.split(r"^## ", page.read_text(encoding="utf-8"), flags=re.MULTILINE):
        found = tuple(_lines(blocks(part)))
        if found:
            yield Typed(page, part.partition("\n")[0] if page.name != "README.md" else "README", found)


def _lines(found: tuple[Block, ...]) -> Iterator[tuple[str, tuple[str, ...], tuple[str, ...]]]:
    models: list[str] = []
    later = [block.text for block in found if block.language == "mech"]
    for block in found:
        if block.language in ("mech", "modelica"):
            models.append(block.text)
        if block.language not in ("", "sh", "bash"):
            continue
        text = re.sub(r"\\\n\s*", " ", block.text)
        if text.startswith("$ "):
            typed = [(step.command, step.shown) for step in steps(text)]
        else:
            typed = [(line.strip(), ()) for line in text.splitlines()]
        for line, shown in typed:
            if re.match(r"mechc [a-z-]", line) and "[OPTIONS]" not in line:
                yield line, shown, tuple(models or later)


SECTIONS = [section for page in PAGES for section in sections(page)]


def words_of(line: str) -> list[str]:
    return shlex.split(line, comments=True)[1:]


def _measured(folder: Path) -> None:
    """Make the measurement of a swing that a reader would bring."""
    motion = mechc.load(folder / "pendulum.mech").simulate(stop=5, every=0.05)
    rows = zip(motion.time, motion["theta"], strict=True)
    text = "time,theta\n" + "".join(f"{t:.9g},{theta:.9g}\n" for t, theta in rows)
    (folder / "swing.csv").write_text(text, encoding="utf-8")


def _exported(folder: Path) -> None:
    assert run(["compile", str(folder / "pendulum.mech"), "--target", "fmu", "-o", "pendulum.fmu"]) == 0


def _members(folder: Path) -> None:
    (folder / "members.csv").write_text("l [m],theta [deg]\n0.8,20\n1,30\n1.2,40\n", encoding="utf-8")


def _asking(folder: Path) -> None:
    """Make a model that states a study, of the new one."""
    assert run(["new", "swing"]) == 0
    path = folder / "swing.mech"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("\nend ", "\n  study small = modes();\nend "), encoding="utf-8")


BROUGHT: dict[str, Callable[[Path], None]] = {
    "swing.csv": _measured,
    "members.csv": _members,
    "pendulum.fmu": _exported,
    "swing.mech": _asking,
}
"""Files that a page calls the reader's own, or that another section of it has made."""


def _write(words: list[str], models: tuple[str, ...], folder: Path) -> None:
    """Write the files that a command reads: the model before it, else the example or the new model of that name."""
    reads = words if words[0] in ("study", "fit") else words[: 3 if words[0] == "fmu" else 2]
    for word in sorted(reads, key=lambda word: not word.endswith(".mech")):
        path = folder / word
        if path.exists() or words[0] == "new":
            continue
        if word in BROUGHT and not (models and word.endswith(".mech")):
            _write(["study", "pendulum.mech"], models, folder)
            BROUGHT[word](folder)
        elif word.endswith(".mech"):
            example = ROOT / "examples" / word
            if models:
                path.write_text(models[-1], encoding="utf-8")
            elif example.exists() and word != "pendulum.mech":
                path.write_text(example.read_text(encoding="utf-8"), encoding="utf-8")
            else:
                assert run(["new", path.stem]) == 0
    if "members.csv" in words and not (folder / "members.csv").exists():
        _members(folder)


def test_what_is_not_typed_is_there() -> None:
    """The table holds lines of the pages only."""
    lines = {shlex.join(["mechc", *words_of(line)]) for s in SECTIONS for line, _, _ in s.lines}
    assert {shlex.join(shlex.split(line)) for line in NOT_TYPED} <= lines


@pytest.mark.slow
@pytest.mark.parametrize("typed", SECTIONS, ids=lambda typed: f"{typed.page.stem}-{typed.section}")
def test_the_commands_of_a_section_run(typed: Typed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(webbrowser, "open", lambda *_, **__: True)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    for line, shown, models in typed.lines:
        words = words_of(line)
        if shlex.join(["mechc", *words]) in {shlex.join(shlex.split(line)) for line in NOT_TYPED}:
            continue
        if NEEDS_ZIG.search(line) and importlib.util.find_spec("ziglang") is None:
            continue
        _write(words, models, tmp_path)
        terminal = io.StringIO()
        with contextlib.redirect_stdout(terminal), contextlib.redirect_stderr(terminal):
            code = run(words)
        assert code == 0, f"{line}\n{terminal.getvalue()}"
        untimed = tuple(TAKEN.sub("", row) for row in shown)
        missing = unlike(untimed, TAKEN.sub("", terminal.getvalue()))
        assert missing is None, f"{line}\ndoes not print\n{missing}\nbut\n{terminal.getvalue()}"
