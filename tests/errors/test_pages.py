"""Each error page shows a wrong model and the exact words the compiler has for it."""

from __future__ import annotations

import platform
import sys
from pathlib import Path

import pytest
from error_pages import (
    CODE,
    INDEX,
    Page,
    codes_in_the_sources,
    codes_with_a_page,
    index,
    read_page,
    write_expected,
)

from mechc.api import load
from mechc.cli.main import run
from mechc.lang.diagnostics import CompileError
from mechc.presentation.render import render


def words_for(page: Page, capsys: pytest.CaptureFixture[str]) -> str:
    """Compile (or run, or export) ``model.mech`` of the current folder and return all that is said about it."""
    for name, text in page.files.items():
        Path(name).write_text(text, encoding="utf-8")
    if page.command:
        run([*page.command, *(["--quiet"] if page.command[0] == "run" else [])])
        return capsys.readouterr().err.rstrip("\n")
    try:
        return render(load("model.mech").diagnostics)
    except CompileError as error:
        return render(error.diagnostics)


def arrange(page: Page, patch: pytest.MonkeyPatch, folder: Path) -> None:
    """Give the process the circumstances that a page speaks of."""
    for what, name in page.circumstances:
        match what, name:
            case "without", "compiler":
                patch.delenv("CC", raising=False)
                patch.setenv("PATH", str(folder))
                patch.setitem(sys.modules, "ziglang", None)
            case "without", module:
                patch.setitem(sys.modules, module, None)
            case "machine", machine:
                patch.setattr(platform, "machine", lambda machine=machine: machine)


@pytest.mark.parametrize("code", codes_with_a_page())
def test_page(
    code: str,
    update_golden: bool,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    page = read_page(code)
    assert page.title.startswith(f"# {code}: "), "a page begins with '# CODE: short title'"
    assert "model.mech" in page.files, "a page has a ```mech block"
    monkeypatch.chdir(tmp_path)
    arrange(page, monkeypatch, tmp_path)
    shown = words_for(page, capsys)
    assert page.command[:1] == ("run",) or f"[{code}]" in shown, (
        f"the model of this page does not lead to {code} but to:\n{shown}"
    )
    if update_golden:
        write_expected(page, shown)
    else:
        assert shown == page.expected


def test_every_code_has_a_page_and_every_page_a_code() -> None:
    sources = codes_in_the_sources()
    pages = set(codes_with_a_page())
    assert {c: where for c, where in sources.items() if c not in pages} == {}
    assert pages - set(sources) == set()
    assert all(CODE.fullmatch(page) for page in pages)


def test_the_index_lists_all_pages(update_golden: bool) -> None:
    if update_golden:
        INDEX.write_text(index(), encoding="utf-8")
    assert INDEX.read_text(encoding="utf-8") == index()
