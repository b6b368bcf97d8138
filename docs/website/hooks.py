"""What MkDocs is told beside its settings: pages take the place of workers from the site, not from a server."""

from __future__ import annotations

from typing import Any

from mkdocs.utils import get_relative_url

ELSEWHERE = "https://unpkg.com/iframe-worker/shim"
"""Where the theme takes it from."""


def on_post_page(output: str, *, page: Any, config: Any) -> str:
    """Return a page with the site's own script in the place of that of a server."""
    return output.replace(ELSEWHERE, get_relative_url("worker.js", page.url))


def on_post_template(output_content: str, *, template_name: str, config: Any) -> str:
    """Return a page without a text of its own, such as that of what is not found, in the same way."""
    return output_content.replace(ELSEWHERE, "worker.js")
