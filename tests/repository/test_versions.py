"""One version everywhere: the package, its description, the citation, the extension of an editor, the list of changes."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import mechc

ROOT = Path(__file__).resolve().parents[2]


def test_all_say_the_same() -> None:
    told = {
        "pyproject.toml": tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"][
            "version"
        ],
        "package.json": json.loads(
            (ROOT / "editors" / "vscode" / "package.json").read_text(encoding="utf-8")
        )["version"],
        "CITATION.cff": stated(r"^version: (\S+)$", "CITATION.cff"),
        "CHANGELOG.md": stated(r"^## \[(\d\S*)\]", "CHANGELOG.md"),
    }
    assert told == dict.fromkeys(told, mechc.__version__)


def stated(pattern: str, file: str) -> str:
    found = re.search(pattern, (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE)
    assert found is not None, file
    return found[1]
