"""What MkDocs is told beside its settings: menus that list all pages of a folder, and pages that take the place of workers from the site, not from a server."""

from __future__ import annotations

import gc
import re
from functools import cache
from pathlib import Path
from typing import Any

from mkdocs.plugins import CombinedEvent, event_priority
from mkdocs.utils import get_relative_url
from pymdownx import highlight

ELSEWHERE = "https://unpkg.com/iframe-worker/shim"
"""Where the theme takes it from."""
SEARCH = (
    'data-md-component="search" role="dialog"',
    'data-md-component="search" role="dialog" aria-label="Search"',
)
"""What the theme does not name, and its name."""
INDENTATION = re.compile(r"\n\s+")
COLOURS = re.compile(r"</?span\b[^>]*>")


def on_startup(**_: object) -> None:
    """Search for no cyclic garbage: the build ends soon, and the search is a tenth of it. Search once for each lexer."""
    gc.disable()
    # for each text again, among all languages
    highlight.get_lexer_by_name = cache(highlight.get_lexer_by_name)


def on_config(config: Any) -> Any:
    """Put all pages of a folder instead of ``folder/*.md`` in the menu."""
    for entry in config.nav:
        for title, pages in entry.items() if isinstance(entry, dict) else ():
            entry[title] = [named for page in pages for named in _named(page, Path(config.docs_dir), pages)]
    return config


def _named(page: str, folder: Path, stated: list[str]) -> list[str]:
    if "*" not in page:
        return [page]
    found = sorted(p.relative_to(folder).as_posix() for p in folder.glob(page))
    return [name for name in found if name not in stated]


coloured: list[str] = []


def _before_search(context: Any, /, *, page: Any, **_: object) -> None:
    """Give the search a page without the colours of its texts, which it takes as long to read past as all else."""
    coloured.append(page.content)
    page.content = COLOURS.sub("", page.content)


def _after_search(context: Any, /, *, page: Any, **_: object) -> None:
    page.content = coloured.pop()


on_page_context = CombinedEvent(event_priority(50)(_before_search), event_priority(-50)(_after_search))


def on_post_page(output: str, *, page: Any, config: Any) -> str:
    """Return a page with the site's own script instead of that of a server, and a name of its search for who hears the page; and
    without the indentation of its menus, which is a third of a short page."""
    menus, article, text = output.partition("<article")
    output = INDENTATION.sub("\n", menus) + article + text
    return output.replace(ELSEWHERE, get_relative_url("worker.js", page.url)).replace(*SEARCH)


def on_post_template(output_content: str, *, template_name: str, config: Any) -> str:
    """Return a page without a text of its own, such as that of what is not found, in the same way."""
    return output_content.replace(ELSEWHERE, "worker.js").replace(*SEARCH)
