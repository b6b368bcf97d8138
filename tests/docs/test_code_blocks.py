"""Every code block of the pages is run by a test, and every command line in one is understood."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import click
import pytest
from page_blocks import blocks

from mechc.cli.main import mechc as commands
from mechc.lang.builtins import BUILTINS

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
RUN = {
    "accuracy.md": "test_accuracy_page.py",
    "events.md": "test_events_page.py",
    "language.md": "test_language_page.py",
    "python-api.md": "test_python_page.py",
    "sensitivity.md": "test_sensitivity_page.py",
    "studies.md": "test_studies_page.py",
    "tutorial.md": "test_tutorial.py",
}
"""Pages with models and programs, and the test that runs them; those of the folders below are followed as a whole."""
FOLLOWED = ("how_to", "explanation")


def test_every_page_with_programs_has_a_test() -> None:
    found = {
        path.name
        for path in DOCS.rglob("*.md")
        if path.parent.name not in FOLLOWED
        and any(b.language in ("mech", "python", "console") for b in blocks(path.read_text(encoding="utf-8")))
    }
    assert found == {*RUN}
    for page, test in RUN.items():
        assert page in (ROOT / "tests" / "docs" / test).read_text(encoding="utf-8")


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_every_block_is_closed(path: Path) -> None:
    """One that is not would be no block, and nothing would run it."""
    text = path.read_text(encoding="utf-8")
    assert len(re.findall(r"^```", text, re.MULTILINE)) == 2 * len(blocks(text))


def _typed(path: Path) -> list[str]:
    text = path.read_text(encoding="utf-8")
    inside = "\n".join(
        re.sub(r"\\\n\s*", " ", block.text)
        for block in blocks(text)
        if block.language in ("", "sh", "console", "bash")
    )
    lines = (line.removeprefix("$ ").strip() for line in inside.splitlines())
    return [line for line in lines if re.match(r"mechc [a-z-]", line) and "[OPTIONS]" not in line]


LINES = [(path, line) for path in PAGES for line in _typed(path)]


@pytest.mark.parametrize("path", sorted({path for path, _ in LINES}), ids=lambda path: path.stem)
def test_every_command_line_is_understood(path: Path) -> None:
    for line in (line for page, line in LINES if page == path):
        misunderstood = _misunderstood(line)
        assert misunderstood is None, f"{line}: {misunderstood}"


def _misunderstood(line: str) -> str | None:
    """Return why a command line is none: a command or an option that there is not."""
    try:
        words = shlex.split(line.partition(" | ")[0], comments=True)[1:]
    except ValueError as error:
        return str(error)
    words = [word for word in words if word not in (">", "&&", "...", "[...]")]
    group: click.Command = commands
    context = click.Context(commands, info_name="mechc")
    while isinstance(group, click.Group) and words and not words[0].startswith("-"):
        try:
            _, inner, words = group.resolve_command(context, words)
        except click.UsageError as error:
            return error.format_message()
        assert inner is not None
        if not isinstance(inner, click.Group) and words[:1] == [inner.name]:
            words = words[1:]
        group = inner
        context = click.Context(group, parent=context, info_name=group.name)
    try:
        group.make_parser(context).parse_args(words)
    except click.UsageError as error:
        return error.format_message()
    return None


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("mechc rnu pendulum.mech", "No such command"),
        ("mechc run pendulum.mech --stopp 2", "No such option"),
        ("mechc study perod pendulum.mech", "There is no study"),
        ("mechc study period pendulum.mech --modes", "No such option"),
        ("mechc run pendulum.mech --stop", "requires an argument"),
    ],
)
def test_what_is_not_understood_is_found(line: str, why: str) -> None:
    assert why in (_misunderstood(line) or "")


def test_every_function_is_on_a_page_of_the_language() -> None:
    text = "".join((DOCS / name).read_text(encoding="utf-8") for name in ("language.md", "events.md"))
    missing = [name for name in BUILTINS if not re.search(rf"`[^`\n]*\b{name}\b", text)]
    assert len(BUILTINS) > 60
    assert missing == []
