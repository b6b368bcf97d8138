"""The site: every page is in it, links lead to pages that are there, MkDocs builds it without a warning."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from pygments.lexers import get_lexer_by_name
from pygments.token import Keyword, Name, Token

from mechc.editor.highlighting import MechLexer
from mechc.lang.diagnostics import Reporter
from mechc.lang.grammar.lexer import tokenise
from mechc.lang.grammar.tables import load_tables
from mechc.lang.source import SourceFile

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "docs"))

from website import build  # noqa: E402
from website.links import moved  # noqa: E402

PAGES = [p for p in build.places().values() if p.endswith(".md")]
EXAMPLES = sorted((ROOT / "examples").rglob("*.mech"))


def links(text: str) -> Iterator[str]:
    outside = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    outside = re.sub(r"`[^`\n]*`", "", outside)
    yield from re.findall(r"\]\(([^)#\s]+)", outside)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(build, "PAGES", tmp_path_factory.mktemp("site") / "pages")
        build.write_pages({})
        return build.PAGES


def test_links_lead_to_pages_of_the_site(written: Path) -> None:
    found = 0
    for page in written.rglob("*.md"):
        for target in links(page.read_text(encoding="utf-8")):
            if not re.match(r"[a-z]+:", target):
                assert (page.parent / target).exists(), f"{page.relative_to(written)}: {target}"
                found += 1
    assert found > 500


def test_every_message_and_every_example_has_its_page(written: Path) -> None:
    assert len(list((written / "errors").glob("*.md"))) == len(build.errors())
    assert len(list((written / "gallery").glob("*.md"))) == len(EXAMPLES)


def test_every_page_of_the_documentation_is_in_the_menu() -> None:
    menu = (ROOT / "docs" / "website" / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:")[2]
    own = [
        p for p in PAGES if not p.startswith(("gallery/", "errors/", "decisions/", "how_to/", "explanation/"))
    ]
    missing = [p for p in own if f"- {p}\n" not in f"{menu}\n"]
    assert "- how_to/*.md\n" in menu and "- explanation/*.md\n" in menu
    assert not missing and len(own) > 15


def test_links_to_what_the_site_lacks_keep_their_words() -> None:
    known = {"docs/a.md": "a.md", "mechc/errors/E0301.md": "errors/E0301.md"}
    text = (
        "see [`E0301`](../mechc/errors/E0301.md#why), [a test](../tests/test_x.py)\n```\n[no](../link)\n```"
    )
    assert (
        moved(text, "docs/a.md", known)
        == "see [`E0301`](errors/E0301.md#why), a test\n```\n[no](../link)\n```"
    )


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_colours_keep_the_text_and_know_its_units(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    coloured = list(MechLexer(stripnl=False, ensurenl=False).get_tokens(text))
    assert "".join(value for _, value in coloured) == text
    assert not any(kind is Token.Error for kind, _ in coloured)
    tokens, _ = tokenise(SourceFile(str(path), text), load_tables(), Reporter())
    units = [t.text.split(maxsplit=1)[-1] for t in tokens if t.kind in ("QUANTITY", "UNITTAG")]
    assert [v for k, v in coloured if k is Keyword.Type] == units


def test_words_of_the_language_are_coloured() -> None:
    kinds = {v: k for k, v in MechLexer().get_tokens("coordinate x = sin(1) m; parameter Length sin_x = pi;")}
    assert kinds["coordinate"] is Keyword and kinds["sin"] is Name.Builtin and kinds["pi"] is Name.Constant
    assert kinds["Length"] is Name.Class and kinds["sin_x"] is Name


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("mkdocs") is None, reason="needs the extra 'docs'")
def test_mkdocs_builds_it_without_a_warning() -> None:
    get_lexer_by_name("mech")
    done = subprocess.run(
        [sys.executable, str(ROOT / "docs/website/build.py"), "--no-live"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert (build.BUILD / "site" / "index.html").exists()


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("mkdocs") is None, reason="needs the extra 'docs'")
def test_no_page_asks_a_server_for_anything() -> None:
    subprocess.run([sys.executable, str(ROOT / "docs/website/build.py"), "--no-live"], check=True)
    asking = re.compile(r"""<(?:script|link|img|iframe)[^>]*(?:src|href)=["']?(?:https?:)?//""")
    pages = list((build.BUILD / "site").rglob("*.html"))
    assert len(pages) > 300
    assert not [str(p) for p in pages if asking.search(p.read_text(encoding="utf-8"))]
