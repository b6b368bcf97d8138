"""The page of what may stand where says what pairs do; a few are tried again."""

from __future__ import annotations

import re
from random import Random

import pytest
from random_models.coverage import FAULTS, PAGE, UNKNOWN, cell
from random_models.probes import CONSTRUCTS, PLACES, probe


def _page() -> dict[tuple[str, str], str]:
    """Read the cells of the page by construct and place."""
    found: dict[tuple[str, str], str] = {}
    places: list[str] = []
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        if line.startswith("**a**"):
            places = [part.split("** ", 1)[1] for part in line.split(", **") if part]
        elif match := re.match(r"\| `(.*?)` \| (.*) \|$", line):
            cells = match[2].split(" | ")
            found |= {(match[1], place): what.strip() for place, what in zip(places, cells, strict=True)}
    return found


PAIRS = [(c, p) for c in CONSTRUCTS for p in PLACES if probe(c, p) is not None]


def test_each_cell_is_compared_or_refused() -> None:
    page = _page()
    left = ("", "run", UNKNOWN, *FAULTS)
    assert [(c.name, p.name) for c, p in PAIRS if page.get((c.name, p.name), "") in left] == []


@pytest.mark.slow
@pytest.mark.parametrize("k", range(60))
def test_cell(k: int) -> None:
    construct, place = Random(k).choice(PAIRS)
    assert cell(construct, place)[0] == _page()[construct.name, place.name]
