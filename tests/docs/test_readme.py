"""What README.md promises is so: its models run, its report looks like that, its links lead somewhere."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import mechc
from mechc.cli.main import COMMANDS
from mechc.presentation.report import report

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
MODELS = re.findall(r"^```modelica\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
PAGES = [
    "README.md",
    "ARCHITECTURE.md",
    "CONTRIBUTING.md",
    *(f"docs/{p.name}" for p in (ROOT / "docs").glob("*.md")),
]


@pytest.mark.parametrize("number", range(len(MODELS)))
def test_models_run(number: int) -> None:
    solution = mechc.loads(MODELS[number]).simulate()
    assert solution.outcome.value == "completed"
    assert solution.accuracy.error is not None and solution.accuracy.error.largest < 1e-6


def test_the_report_has_the_form_that_is_shown() -> None:
    """All words are equal; numbers and times of this run may differ."""

    def words(text: str) -> list[str]:
        without_numbers = re.sub(r"[-+]?\d[\d ]*\.?\d*(e[-+]\d+)?", "#", text)
        return [
            " ".join(row.split())
            for row in re.sub(r"# ?(us|ms|s)$", "# us", without_numbers, flags=re.M).splitlines()
        ]

    shown = re.search(r"ends with:\n\n```\n(.*?)\n```", README, re.DOTALL)
    assert shown is not None
    solution = mechc.load(ROOT / "examples" / "double_pendulum.mech").simulate()
    assert words(shown[1]) == words(report(solution))


def test_commands_exist() -> None:
    assert set(re.findall(r"^mechc (\w+)", README, re.MULTILINE)) <= set(COMMANDS)


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    text = re.sub(r"^```.*?^```$|`[^`\n]*`", "", text, flags=re.MULTILINE | re.DOTALL)
    targets = re.findall(r"\]\((?!https?:)([^)#]+)[^)]*\)", text)
    missing = [target for target in targets if not ((ROOT / page).parent / target).exists()]
    assert missing == []


def test_the_error_message_is_the_one_of_the_page() -> None:
    page = (ROOT / "mechc" / "errors" / "E0301.md").read_text(encoding="utf-8")
    headline = next(row for row in README.splitlines() if row.startswith("error[E0301]"))
    assert headline in page


@pytest.mark.parametrize("page", ["ARCHITECTURE.md", "CONTRIBUTING.md"])
def test_files_that_are_named_exist(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    named = re.findall(r"`((?:[a-z_]+/)+[\w.*-]*)`", text)
    assert named
    folders = [ROOT / folder for folder in ("lang", "compiler", "runtime", "mechc")]
    homes = [
        ROOT,
        *folders,
        ROOT / "runtime" / "kernel",
        *(package.parent for top in folders for package in top.rglob("__init__.py")),
    ]
    found = {name for name in named for home in homes if list(home.glob(name.rstrip("/")))}
    assert [name for name in named if name not in found and "CODE" not in name] == []
