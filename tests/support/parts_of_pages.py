"""What a page holds: its scripts and facts as they are, what else as bytes."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from typing import Any

from mechc.web.packed import packed, unpacked

BEGIN = re.compile(r"\nbegin\((.*)\);\n")


def changed(page: str, change: Callable[[str], str]) -> str:
    """Return a page whose scripts and facts, as one text, are changed."""
    parts = json.loads(_found(page))
    names = ("scripts", "info")
    texts = change("\n".join(unpacked(parts[name]).decode() for name in names))
    for name, text in zip(names, texts.split("\n"), strict=True):
        parts[name] = packed(text.encode())
    return page.replace(_found(page), json.dumps(parts))


def _found(page: str) -> str:
    found = BEGIN.search(page)
    assert found is not None
    return found[1]


def parts_of(page: str) -> dict[str, Any]:
    parts = {name: unpacked(part) for name, part in json.loads(_found(page)).items()}
    return parts | {name: json.loads(parts[name]) for name in ("scripts", "info")}
