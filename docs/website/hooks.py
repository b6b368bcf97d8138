"""What MkDocs is told beside its settings: menus that list all pages of a folder, and pages that take the place of workers from the site, not from a server."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mkdocs.utils import get_relative_url

ELSEWHERE = "https://unpkg.com/iframe-worker/shim"
"""Where the theme takes it from."""
SEARCH = (
    'data-md-component="search" role="dialog"',
    'data-md-component="search" role="dialog" aria-label="Search"',
)
"""What the theme does not name, and its name."""


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


def on_post_page(output: str, *, page: Any, config: Any) -> str:
    """Return a page with the site's own script instead of that of a server, and a name of its search for who hears the page."""
    return output.replace(ELSEWHERE, get_relative_url("worker.js", page.url)).replace(*SEARCH)


def on_post_template(output_content: str, *, template_name: str, config: Any) -> str:
    """Return a page without a text of its own, such as that of what is not found, in the same way."""
    return output_content.replace(ELSEWHERE, "worker.js").replace(*SEARCH)
