"""The repository keeps the form that ARCHITECTURE.md states."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ("mechc", "lang", "compiler", "runtime", "stdlib")
LINKS = ("lang", "compiler", "runtime", "stdlib")
LONGEST_ARCHITECTURE = 1500
"""Words."""


def project() -> dict[str, object]:
    tools = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]
    assert isinstance(tools, dict)
    return tools


def python_files(*folders: str) -> list[Path]:
    """All Python files below the folders, without those seen through the links in ``mechc``."""
    files: list[Path] = []
    for folder in folders:
        for path in sorted((ROOT / folder).rglob("*.py")):
            parts = path.relative_to(ROOT).parts
            if not (parts[0] == "mechc" and parts[1] in LINKS):
                files.append(path)
    return files


def package_of(folder: Path) -> str:
    dotted = ".".join(folder.relative_to(ROOT).parts)
    return dotted if dotted.startswith("mechc") else f"mechc.{dotted}"


def folder_of(package: str) -> Path:
    parts = package.split(".")
    return ROOT.joinpath(*(parts[1:] if len(parts) > 1 and parts[1] in LINKS else parts))


def test_packages_are_the_folders_with_an_init() -> None:
    folders = {package_of(p.parent) for p in python_files(*SOURCES) if p.name == "__init__.py"}
    packages = project()["packages"]
    assert isinstance(packages, list)
    assert folders == set(packages)


def test_every_python_file_lies_in_a_package() -> None:
    lost = [p for p in python_files(*SOURCES) if not (p.parent / "__init__.py").exists()]
    assert lost == []


def test_links_in_mechc_are_relative_and_complete() -> None:
    for name in LINKS:
        link = ROOT / "mechc" / name
        if link.is_symlink():
            assert link.readlink() == Path("..") / name
        else:  # git writes where a link leads as a text if the system has no links
            assert link.read_text(encoding="utf-8") == f"../{name}"


def test_no_import_by_bare_name() -> None:
    bare = re.compile(r"^\s*(?:from|import)\s+(?:lang|compiler|runtime|stdlib)\b", re.MULTILINE)
    offenders = [p for p in python_files(*SOURCES, "tests") if bare.search(p.read_text(encoding="utf-8"))]
    assert offenders == []


def test_the_architecture_is_read_in_ten_minutes() -> None:
    words = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8").split()
    assert len(words) <= LONGEST_ARCHITECTURE


def test_no_module_without_a_subject() -> None:
    vague = {"utils", "util", "helpers", "common", "misc", "core", "manager"}
    assert [p for p in python_files(*SOURCES) if p.stem in vague] == []


def test_no_marks_of_unfinished_work() -> None:
    marks = re.compile(r"\b(?:TODO|FIXME|XXX|HACK)\b")
    assert [p for p in python_files(*SOURCES) if marks.search(p.read_text(encoding="utf-8"))] == []


def test_types_of_the_flat_model_are_made_in_one_place() -> None:
    """Type rules are cached by the identity of types, which ``types.make`` alone keeps alive."""
    made = re.compile(r"(?<![\w.])(?<!class )Type\(")
    found = [p for p in python_files("compiler") if made.search(p.read_text(encoding="utf-8"))]
    assert [p.relative_to(ROOT).as_posix() for p in found] == ["compiler/flat/types.py"]


def test_package_data_covers_every_other_file() -> None:
    data = project()["package-data"]
    assert isinstance(data, dict)
    packed = {
        path for package, globs in data.items() for glob in globs for path in folder_of(package).glob(glob)
    }
    other = {
        path
        for folder in SOURCES
        for path in (ROOT / folder).rglob("*")
        if path.is_file()
        and path.suffix not in (".py", ".pyc")
        and not (folder == "mechc" and path.relative_to(ROOT).parts[1] in LINKS)
    }
    assert {path.relative_to(ROOT).as_posix() for path in other - packed} == set()


def test_the_floors_name_every_module_that_shows_something() -> None:
    """The contract against importing upwards lists the modules and packages of the top package, but for its lowest."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    shown = next(c for c in contracts["contracts"] if c["name"].startswith("nothing below"))
    modules = {f"mechc.{p.stem}" for p in (ROOT / "mechc").glob("*.py") if not p.stem.startswith("__")}
    packages = {f"mechc.{p.parent.name}" for p in (ROOT / "mechc").glob("*/__init__.py")}
    packages -= {f"mechc.{name}" for name in LINKS}
    assert modules | packages == set(shown["forbidden_modules"]) | {"mechc.suggest"}
