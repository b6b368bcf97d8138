"""The pages of mechc/errors as data: models that fail, and the words they fail with."""

from __future__ import annotations

import re
from pathlib import Path

from msgspec import Struct

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "mechc" / "errors"
CODE = re.compile(r"[EWN]\d{4}")

_BLOCK = re.compile(r"^```(?P<info>[^\n]*)\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)
_COMMAND = re.compile(r"^(?P<command>run|compile):(?P<options>.*)$", re.MULTILINE)
_CIRCUMSTANCE = re.compile(r"^(?P<what>without|machine): (?P<name>\S+)$", re.MULTILINE)


class Page(Struct, frozen=True):
    """``files`` by name, ``model.mech`` first; ``command`` with its options, empty where compiling fails.

    ``circumstances``: (without, compiler), (without, ziglang) or (machine, name): what the message depends on.
    """

    path: Path
    title: str
    files: dict[str, str]
    expected: str | None
    command: tuple[str, ...]
    circumstances: tuple[tuple[str, str], ...]

    @property
    def code(self) -> str:
        return self.path.stem


def codes_with_a_page() -> list[str]:
    return sorted(path.stem for path in FOLDER.glob("*.md"))


def read_page(code: str) -> Page:
    """Read one page. An opening fence ``mech file=NAME`` makes a further file beside the model."""
    path = FOLDER / f"{code}.md"
    text = path.read_text(encoding="utf-8")
    files: dict[str, str] = {}
    expected = None
    for block in _BLOCK.finditer(text):
        language, *rest = block["info"].split()
        if language == "mech":
            name = rest[0].removeprefix("file=") if rest else "model.mech"
            files.setdefault(name, block["text"])
        elif language == "text" and expected is None:
            expected = block["text"].removesuffix("\n")
    found = _COMMAND.search(text)
    command = (found["command"], "model.mech", *found["options"].split()) if found else ()
    circumstances = tuple((c["what"], c["name"]) for c in _CIRCUMSTANCE.finditer(text))
    return Page(path, text.split("\n", 1)[0], files, expected, command, circumstances)


def write_expected(page: Page, shown: str) -> None:
    """Put the words that the compiler says into the text block of the page."""
    text = page.path.read_text(encoding="utf-8")
    block = f"```text\n{shown}\n```"
    if page.expected is None:
        text = f"{text.rstrip()}\n\n{block}\n"
    else:
        old = next(b for b in _BLOCK.finditer(text) if b["info"].split()[:1] == ["text"])
        text = text[: old.start()] + block + text[old.end() :]
    page.path.write_text(text, encoding="utf-8")


INDEX = ROOT / "docs" / "errors.md"

FAMILIES = {
    "01": "Text and syntax",
    "02": "Names and imports",
    "03": "Types, shapes and units",
    "04": "Components and modifications",
    "05": "Mechanics",
    "06": "Initial values",
    "07": "Events, contact and friction",
    "08": "Experiments and structural parameters",
    "09": "Export",
    "10": "What is drawn",
}
"""Titles by the first two digits of the codes."""


def index() -> str:
    """Return the text of docs/errors.md: all pages by family."""
    rows = [
        "# Messages",
        "",
        "`mechc explain E0301` prints a page. E are errors, W warnings, N notes.",
    ]
    unknown = {code[1:3] for code in codes_with_a_page()} - set(FAMILIES)
    assert not unknown, f"families without a title: {unknown}"
    for family, title in FAMILIES.items():
        codes = [code for code in codes_with_a_page() if code[1:3] == family]
        if codes:
            rows += ["", f"## {title}", "", "| code | |", "|---|---|"]
            for code in codes:
                words = read_page(code).title.removeprefix(f"# {code}: ")
                rows.append(f"| [{code}](../mechc/errors/{code}.md) | {words} |")
    return "\n".join(rows) + "\n"


def codes_in_the_sources() -> dict[str, str]:
    """Map each code that a source file mentions in a string to that file."""
    found: dict[str, str] = {}
    for folder in ("lang", "compiler", "runtime", "mechc"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            if "mechc" in path.relative_to(ROOT).parts and path.is_relative_to(ROOT / "mechc" / "lang"):
                continue
            for match in re.finditer(r"[\"']([EWN]\d{4})[\"']", path.read_text(encoding="utf-8")):
                found.setdefault(match[1], str(path.relative_to(ROOT)))
    return found
