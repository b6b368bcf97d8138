"""The reference of the command line is made from the commands, and holds the variables that the code reads."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest

from mechc.cli import failures

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def commands() -> ModuleType:
    spec = importlib.util.spec_from_file_location("commands", ROOT / "docs" / "commands.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_page_is_up_to_date(commands: ModuleType) -> None:
    """docs/commands.md is what ``python docs/commands.py`` writes."""
    kept = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    assert commands.page() == kept, "python docs/commands.py writes it again"


def test_settings_of_studies_are_up_to_date(commands: ModuleType) -> None:
    """The tables in docs/studies.md, too, each at the end of the section of its study."""
    kept = (ROOT / "docs" / "studies.md").read_text(encoding="utf-8")
    assert commands.studies(kept) == kept, "python docs/commands.py writes them again"
    assert kept.count(commands.SETTINGS) > 30
    assert commands.studies(kept.replace("| `--of` `A,B` | Quantities to average", "| other")) == kept


def test_every_variable_is_told(commands: ModuleType) -> None:
    folders = [ROOT / name for name in ("lang", "compiler", "runtime", "stdlib", "mechc")]
    texts = [path.read_text(encoding="utf-8") for folder in folders for path in folder.rglob("*.py")]
    read = {
        name for text in texts for name in re.findall(r"environ(?:\.\w+\(|\[)[\"'](\w+)[\"'](?!\] =)", text)
    }
    assert len(read) > 5
    assert read == set(commands.VARIABLES)


def test_every_exit_code_is_told(commands: ModuleType) -> None:
    codes = {value for name, value in vars(failures).items() if name.isupper() and isinstance(value, int)}
    assert codes == {code for code, _ in commands.CODES}


def test_every_option_says_what_it_does(commands: ModuleType) -> None:
    """A row of the page without words is an option without ``help``."""
    pages = commands.page() + (ROOT / "docs" / "studies.md").read_text(encoding="utf-8")
    empty = [line for line in pages.splitlines() if re.match(r"\| `-.*\|\s*\|$", line)]
    assert empty == []
