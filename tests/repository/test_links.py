"""A checkout in which git could make no symbolic links can be checked as any other."""

from __future__ import annotations

import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = runpy.run_path(str(ROOT / ".ci" / "linked.py"))
LINKS = ("lang", "compiler", "runtime", "stdlib")


@pytest.fixture(scope="module")
def without_links(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clone as git makes it on Windows, with the files as they are here."""
    if not (ROOT / ".git").exists() or shutil.which("git") is None:
        pytest.skip("not a checkout of git")
    clone = tmp_path_factory.mktemp("clone") / "mechc"
    subprocess.run(
        ["git", "clone", "-q", "--no-hardlinks", "-c", "core.symlinks=false", str(ROOT), str(clone)],
        check=True,
    )
    shutil.copytree(ROOT / ".ci", clone / ".ci", dirs_exist_ok=True)
    return clone


def test_git_writes_texts_in_the_place_of_links(without_links: Path) -> None:
    for name in LINKS:
        assert (without_links / "mechc" / name).read_text(encoding="utf-8") == f"../{name}"
    assert not SCRIPT["is_linked"](without_links)


def test_the_copy_holds_every_package_in_its_place(without_links: Path) -> None:
    whole = SCRIPT["linked"](without_links)
    assert whole != without_links
    for name in LINKS:
        sources = {p.relative_to(without_links / name) for p in (without_links / name).rglob("*.py")}
        copied = {p.relative_to(whole / "mechc" / name) for p in (whole / "mechc" / name).rglob("*.py")}
        assert sources and copied == sources
    stale = whole / "mechc" / "lang" / "stale.py"
    stale.touch()
    SCRIPT["linked"](without_links)
    assert not stale.exists()


def test_a_checkout_with_links_is_checked_itself() -> None:
    if not all((ROOT / "mechc" / name).is_symlink() for name in LINKS):
        pytest.skip("this one has none")
    assert SCRIPT["linked"](ROOT) == ROOT


def run(without_links: Path, *command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, ".ci/linked.py", *command], cwd=without_links, capture_output=True, text=True
    )


@pytest.mark.slow
def test_a_command_runs_in_the_copy(without_links: Path) -> None:
    ran = run(without_links, sys.executable, "-c", "import mechc.lang.parser as p; print(p.__file__)")
    assert Path(ran.stdout.strip()) == without_links / "build" / "linked" / "mechc" / "lang" / "parser.py"
    assert run(without_links, sys.executable, "-c", "raise SystemExit(3)").returncode == 3
    assert run(without_links, "no-such-checker").returncode == 2


@pytest.mark.slow
@pytest.mark.parametrize("checker", ["mypy", "lint-imports"])
def test_checkers_find_everything(without_links: Path, checker: str) -> None:
    ran = run(without_links, str(Path(sys.executable).parent / checker))
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "Success" in ran.stdout or "0 broken" in ran.stdout


@pytest.mark.slow
def test_checkers_find_mistakes(without_links: Path) -> None:
    wrong = without_links / "lang" / "wrong.py"
    wrong.write_text("from ..compiler import pipeline\n\nanswer: int = 'text'\n", encoding="utf-8")
    try:
        typed = run(without_links, str(Path(sys.executable).parent / "mypy"))
        assert "mechc/lang/wrong.py:3: error" in typed.stdout
        floors = run(without_links, str(Path(sys.executable).parent / "lint-imports"))
        assert "mechc.lang is not allowed to import mechc.compiler" in floors.stdout
    finally:
        wrong.unlink()
