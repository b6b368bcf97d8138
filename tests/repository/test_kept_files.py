"""What is kept in the repository, and what goes into a source distribution."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest

from mechc.lang.grammar import tables

ROOT = Path(__file__).resolve().parents[2]
REPORTS = ("bench/report", "docs/gallery")
LINKS = ("lang", "compiler", "runtime", "stdlib")


def tracked(*folders: str) -> list[str]:
    """The files of the repository; skips where it is not one."""
    if not (ROOT / ".git").exists() or shutil.which("git") is None:
        pytest.skip("not a checkout of git")
    listed = subprocess.run(
        ["git", "ls-files", "-z", *folders], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return [name for name in listed.stdout.split("\0") if name]


def test_reports_are_kept_as_far_as_pages_show_them() -> None:
    """The rest of them ``make bench`` and ``make gallery`` write again."""
    kept = set(tracked(*REPORTS))
    shown = {"bench/report/README.md"}
    for name in tracked():
        if name.endswith(".md"):
            page = ROOT / name
            for target in re.findall(r"!\[[^]]*\]\(([^)]+)\)", page.read_text(encoding="utf-8")):
                place = (page.parent / target).resolve()
                shown.add(place.relative_to(ROOT).as_posix())
    assert kept == {name for name in shown if name.startswith(REPORTS)}


def test_nothing_large_is_kept() -> None:
    """The largest is the kernel of pages with all methods, contacts among them."""
    assert [
        name for name in tracked() if (ROOT / name).is_file() and (ROOT / name).stat().st_size > 330_000
    ] == []


def built(kind: str, names: list[str], folder: Path) -> Path:
    """Return the distribution that is built of some files."""
    if int(version("setuptools").partition(".")[0]) < 77:
        pytest.skip("needs setuptools 77, as the build does")
    here = folder / "mechc"
    for name in names:
        (here / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, here / name, follow_symlinks=False)
    build = f"from setuptools import build_meta; build_meta.build_{kind}('dist')"
    subprocess.run([sys.executable, "-c", build], cwd=here, check=True, capture_output=True)
    (archive,) = (here / "dist").iterdir()
    return archive


def installed_files() -> list[str]:
    return [name for name in tracked() if not name.startswith(("tests/", "docs/", "bench/", "examples/"))]


@pytest.mark.slow
def test_wheels_hold_the_tables_of_the_parser(tmp_path: Path) -> None:
    """So that the first run makes none, and what pages hold."""
    with zipfile.ZipFile(built("wheel", installed_files(), tmp_path)) as file:
        held = file.namelist()
    assert f"mechc/lang/grammar/{tables._file_name()}" in held
    assert "mechc/web/kernel/plain.wasm" in held


@pytest.mark.slow
def test_source_distributions_hold_no_tests(tmp_path: Path) -> None:
    """And all that an installation needs, as it was tracked."""
    names = [*installed_files(), "tests/test_examples.py"]
    archive = built("sdist", names, tmp_path)
    with tarfile.open(archive) as file:
        held = {name.partition("/")[2] for name in file.getnames()}
    assert not [name for name in held if name.startswith("tests")]
    needed = [name for name in names if name.startswith(("lang/", "compiler/", "runtime/", "stdlib/"))]
    needed += [name for name in names if name.startswith("mechc/") and name.partition("/")[2] not in LINKS]
    assert set(needed) - held == set()
