"""Bring links of the repository's pages to where the site has what they name."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Mapping
from pathlib import PurePosixPath

_IMAGE = re.compile(r"(?P<image>!)\[(?P<text>[^\[\]]*)\]\((?P<target>[^()\s]+)\)")
_LINK = re.compile(r"(?P<image>)(?<!!)\[(?P<text>(?:[^\[\]]|\[[^\]]*\])*)\]\((?P<target>[^()\s]+)\)")
_FENCE = re.compile(r"^(?P<indent> *)(?P<marks>`{3,})(?P<info>[^`\n]*)$")
_CODE = re.compile(r"`+[^`\n]*`+")
_TITLED = re.compile(r"^(?P<language>\w[\w-]*) +file=(?P<file>\S+)$")


def moved(text: str, source: str, places: Mapping[str, str]) -> str:
    """Return a page with its links as they are on the site.

    ``source`` is the page's path in the repository; ``places`` gives the path on the site for each path in the
    repository that is there. What the site does not have (tests, programs) keeps its name and loses its link.
    """
    here = PurePosixPath(source).parent.as_posix()
    start = PurePosixPath(places[source]).parent.as_posix()

    def link(match: re.Match[str]) -> str:
        target = match["target"]
        if re.match(r"[a-z]+:|#", target):
            return match[0]
        path, mark, part = target.partition("#")
        named = posixpath.normpath(posixpath.join(here, path)).rstrip("/")
        place = places.get(named) or places.get(f"{named}/README.md")
        if place is None:
            return "" if match["image"] else match["text"]
        return f"{match['image']}[{match['text']}]({posixpath.relpath(place, start)}{mark}{part})"

    return outside_code(text, lambda line: _LINK.sub(link, _IMAGE.sub(link, line)))


def outside_code(text: str, change: Callable[[str], str]) -> str:
    """Return a text with each line outside code changed; blocks that name a file get it as their title."""
    lines: list[str] = []
    closing = ""
    for line in text.split("\n"):
        fence = _FENCE.match(line)
        if closing:
            closing = "" if fence and fence["marks"] == closing and not fence["info"] else closing
            lines.append(line)
        elif fence:
            closing = fence["marks"]
            lines.append(f"{fence['indent']}{fence['marks']}{_info(fence['info'].strip())}")
        else:
            lines.append(_between_code(line, change))
    return "\n".join(lines)


def _between_code(line: str, change: Callable[[str], str]) -> str:
    """Change a line but for the code in it, which stays code inside the texts of links."""
    kept: list[str] = []

    def keep(match: re.Match[str]) -> str:
        kept.append(match[0])
        return f"\x00{len(kept) - 1}\x00"

    changed = change(_CODE.sub(keep, line))
    return re.sub("\x00(\\d+)\x00", lambda m: kept[int(m[1])], changed)


def _info(info: str) -> str:
    titled = _TITLED.match(info)
    if titled:
        return f'{titled["language"]} title="{titled["file"]}"'
    return {"modelica": "mech"}.get(info, info)
