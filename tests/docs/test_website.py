"""The site: every page is in it, links lead to pages that are there, MkDocs builds it without a warning."""

from __future__ import annotations

import importlib.util
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from browsers import needs_browser, running_browser, waited
from firefox import needs_firefox, running_firefox
from PIL import Image
from pygments.lexers import get_lexer_by_name
from pygments.token import Keyword, Name, Token

import mechc
from mechc.compiler import pipeline
from mechc.editor.highlighting import MechLexer
from mechc.lang.diagnostics import Reporter
from mechc.lang.grammar.lexer import tokenise
from mechc.lang.grammar.tables import load_tables
from mechc.lang.source import SourceFile
from mechc.web.page import module_of, page_of, program_of, run_for_page
from mechc.web.run_facts import facts_of

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "docs"))

import figures  # noqa: E402
from website import build  # noqa: E402
from website.links import moved  # noqa: E402
from website.shared import taken_apart, write_live  # noqa: E402
from website.thumbnails import FRAMES, write_thumbnail  # noqa: E402

PAGES = [p for p in build.places().values() if p.endswith(".md")]
EXAMPLES = sorted((ROOT / "examples").rglob("*.mech"))


def links(text: str) -> Iterator[str]:
    outside = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    outside = re.sub(r"`[^`\n]*`", "", outside)
    yield from re.findall(r"\]\(([^)#\s]+)", outside)


@pytest.fixture(scope="module")
def built() -> Path:
    """The site without its moving pages, made by the command."""
    get_lexer_by_name("mech")
    done = subprocess.run(
        [sys.executable, str(ROOT / "docs/website/build.py"), "--no-live"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return build.BUILD / "site"


def searched(site: Path) -> list[dict[str, str]]:
    """What the search of the site looks through."""
    found: list[dict[str, str]] = json.loads((site / "search" / "search_index.json").read_text("utf-8"))[
        "docs"
    ]
    return found


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("site")
        patch.setattr(build, "PAGES", folder / "pages")
        drawn = folder / "drawn.svg"
        drawn.write_text("<svg/>", encoding="utf-8")
        build.write_pages({}, {"planar.Revolute": drawn})
        return build.PAGES


def test_links_lead_to_pages_of_the_site(written: Path) -> None:
    found = 0
    for page in written.rglob("*.md"):
        for target in links(page.read_text(encoding="utf-8")):
            if not re.match(r"[a-z]+:", target):
                assert (page.parent / target).exists(), f"{page.relative_to(written)}: {target}"
                found += 1
    assert found > 500


def test_parts_have_their_diagrams(written: Path) -> None:
    library = (written / "library.md").read_text(encoding="utf-8")
    assert re.findall(r"!\[[^]]*\]\((.+)\)", library) == ["diagrams/planar.Revolute.svg"]
    assert (written / "diagrams" / "planar.Revolute.svg").read_text(encoding="utf-8") == "<svg/>"


def test_the_gallery_shows_all_examples_by_subject(tmp_path: Path) -> None:
    """Each once, most under a subject; with a picture that moves unless the reader wants none that does."""
    page = tmp_path / "cone-1.html"
    for ending in (".html", ".webp", ".png"):
        page.with_suffix(ending).write_bytes(b"")
    text = build.gallery({"cone": page})
    shown = re.findall(r'href="gallery/(\w+)\.html"', text)
    assert sorted(shown) == sorted(row.example.replace("/", "_") for row in figures.ROWS)
    further = text.partition(f"## {figures.FURTHER}\n")[2]
    assert text.count("\n## ") > 10 and further.count('class="card"') < len(figures.ROWS) / 10
    assert '(prefers-reduced-motion: reduce)" srcset="live/cone.png"><img src="live/cone.webp"' in text
    assert build.thumbnails(page.with_suffix(".png")) == [], "of a curve, whose picture is all there is"


def test_a_thumbnail_moves(tmp_path: Path) -> None:
    model = mechc.load(ROOT / "examples" / "lagrange_top.mech", keep={"scene"})
    solution = model.simulate()
    assert isinstance(solution, mechc.Solution)
    write_thumbnail(solution, tmp_path / "top.webp")
    with Image.open(tmp_path / "top.webp") as moving, Image.open(tmp_path / "top.png") as still:
        assert moving.n_frames == FRAMES and moving.size == still.size == (240, 180)  # type: ignore[attr-defined]
        assert np.asarray(still.convert("L")).min() < 150, "it shows something"


def test_a_curve_is_compiled_once_for_its_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    formed: list[object] = []
    form = pipeline.form

    def counted(*arguments: Any, **options: Any) -> Any:
        formed.append(arguments)
        return form(*arguments, **options)

    monkeypatch.setattr(pipeline, "form", counted)
    monkeypatch.setenv("MECHC_CACHE", str(tmp_path / "cache"))
    asked = ROOT / "examples" / "curves" / "fermat.mech", tmp_path / "fermat.html"
    assert build._made(asked) == (tmp_path / "fermat.png", "") and len(formed) == 1


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


NESTED = """<html>
  <nav>

      <a href="../index.html">
        mechc
      </a>
  </nav>
  <article>
    <pre>model A
  coordinate x;
</pre>
  </article>
</html>
"""


@pytest.mark.skipif(importlib.util.find_spec("mkdocs") is None, reason="needs the extra docs")
def test_menus_lose_their_indentation_and_texts_keep_it() -> None:
    from website import hooks

    found = hooks.on_post_page(NESTED, page=SimpleNamespace(url="errors/E0301.html"), config=None)
    text = NESTED.partition("<article")[2]
    assert found == '<html>\n<nav>\n<a href="../index.html">\nmechc\n</a>\n</nav>\n<article' + text


@pytest.mark.skipif(importlib.util.find_spec("mkdocs") is None, reason="needs the extra docs")
def test_the_search_reads_texts_without_colours_and_pages_keep_them() -> None:
    from website import hooks

    first, last = hooks.on_page_context.methods
    page = SimpleNamespace(content='<p><span class="k">model</span> A</p>')
    first({}, page=page)
    assert page.content == "<p>model A</p>"
    last({}, page=page)
    assert page.content == '<p><span class="k">model</span> A</p>'


def test_the_names_are_read_from_modules_that_hold_all_their_bases(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(build, "NAMED", tmp_path)
    build.write_named()
    for of in (
        mechc.api.Model,
        mechc.Solution,
        mechc.UsageMistake,
        mechc.CompileError,
        mechc.SimulationError,
    ):
        for one in of.__mro__:
            if one.__module__.startswith("mechc"):
                path = tmp_path / f"{one.__module__.replace('.', '/')}.py"
                assert f"class {one.__name__}" in path.read_text(encoding="utf-8")
                assert (path.parent / "__init__.py").exists()


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
def test_mkdocs_builds_it_without_a_warning(built: Path) -> None:
    assert (built / "index.html").exists()


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("mkdocs") is None, reason="needs the extra 'docs'")
def test_a_search_finds_a_part_by_its_name_elsewhere(built: Path) -> None:
    parts = [entry for entry in searched(built) if entry["location"].startswith("library.html#")]
    for name, part in (("IdealGearR2T", "Rack"), ("Leadscrew", "LeadScrew"), ("AKISPL", None)):
        found = {entry["title"] for entry in parts if name in entry["text"]}
        assert (part in found) if part else not found


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("mkdocs") is None, reason="needs the extra 'docs'")
@pytest.mark.parametrize("words", ["period doubling", "Poincaré section", "gyroscope", "stick-slip"])
def test_a_search_finds_an_exercise_with_its_solution(words: str, built: Path) -> None:
    found = [entry for entry in searched(built) if words.lower() in entry["title"].lower()]
    (exercise,) = (entry for entry in found if entry["location"].startswith("how_to/exercises.html#"))
    before, solution = exercise["text"].split("Solution.")
    assert "?" in before and "$ mechc " in solution


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("mkdocs") is None, reason="needs the extra 'docs'")
def test_no_page_asks_a_server_for_anything(built: Path) -> None:
    asking = re.compile(r"""<(?:script|link|img|iframe)[^>]*(?:src|href)=["']?(?:https?:)?//""")
    pages = list(built.rglob("*.html"))
    assert len(pages) > 300
    assert not [str(p) for p in pages if asking.search(p.read_text(encoding="utf-8"))]


SHARED = ("double_pendulum", "bouncing_ball", "cart_pendulum")


@pytest.mark.parametrize("name", [*SHARED, "van_der_pol"])
def test_a_module_is_its_kernel_and_a_few_bytes(name: str) -> None:
    facts = facts_of(mechc.load(ROOT / "examples" / f"{name}.mech", keep={"scene"}), {}, None, {})
    module = module_of(facts, program_of(facts)).module
    own, pieces = taken_apart(module, facts.kernel)
    of = (facts.kernel.file.read_bytes(), own)
    assert b"".join(of[which][begin:end] for which, begin, end in pieces) == module
    assert len(own) < len(module) / 4


@pytest.mark.slow
@pytest.mark.parametrize(
    "running",
    [
        pytest.param(running_browser, id="chromium", marks=needs_browser),
        pytest.param(running_firefox, id="firefox", marks=needs_firefox),
    ],
)
def test_pages_of_the_site_move_as_whole_ones_do(running: Any, tmp_path: Path) -> None:
    """They share their code and their kernels; from the file system, too."""
    whole, live = tmp_path / "whole", tmp_path / "live"
    whole.mkdir()
    live.mkdir()
    browser = running()
    tab = next(browser).new_page()
    for name in SHARED:
        model = mechc.load(ROOT / "examples" / f"{name}.mech")
        facts = run_for_page(model, {}, None, {"estimate_error": False})
        (whole / f"{name}.html").write_text(page_of(facts), encoding="utf-8")
        write_live(facts, live / f"{name}.html")
        rows = []
        for folder in (whole, live):
            tab.goto((folder / f"{name}.html").as_uri())
            waited(tab, "window.page && window.page.ready")
            rows.append(tab.evaluate("[...page.run.y, ...page.run.out, ...page.run.events.map(e => e.t)]"))
        assert rows[0] == rows[1] and len(rows[0]) > 1000
        assert (live / f"{name}.html").stat().st_size < 25_000
    assert sorted(p.name.partition("-")[0] for p in live.glob("*.js")) == ["code", "kernel", "kernel"]
    next(browser, None)
