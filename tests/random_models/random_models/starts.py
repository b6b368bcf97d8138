"""Starts of coordinates that are numbers, some of which others follow, and texts that say another one."""

from __future__ import annotations

import re
from random import Random

_START = re.compile(r"(coordinate Length (q\d+) =) (-?[\d.]+(?:e-?\d+)?) m;")
_FOLLOWS = re.compile(r"coordinate Length q\d+ = [^;]*\b(q\d+)\b[^;]*;")


def followed(text: str) -> set[str]:
    """Return the coordinates with whose starts others begin."""
    return set(_FOLLOWS.findall(text))


def begun(text: str, random: Random) -> tuple[dict[str, float], str]:
    """Choose the start of a coordinate, one that others follow if there is any; return it, and the text that says it itself."""
    there = {m[2]: m for m in _START.finditer(text)}
    names = sorted(there.keys() & followed(text)) or sorted(there)
    if not names:
        return {}, text
    start = there[random.choice(names)]
    value = float(start[3]) + random.uniform(0.05, 0.3)
    return {start[2]: value}, text[: start.start()] + f"{start[1]} {value!r} m;" + text[start.end() :]
