"""Quantities of a picture as people name them: some over time, pairs over each other."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from .parse_values import UsageMistake
from .question import chosen_names


def chosen_pairs(wanted: Iterable[str], known: Sequence[str]) -> tuple[str, ...]:
    """Return the quantities that are meant, with pairs ``a:b`` of one over another. Raises UsageMistake."""
    names: list[str] = []
    for name in wanted:
        across, colon, up = name.partition(":")
        ends = chosen_names([across], known), chosen_names([up], known) if colon else ()
        if colon and len(ends[0]) != len(ends[1]):
            raise UsageMistake(
                f"'{across}' and '{up}' have different numbers of elements", "name one of each"
            )
        names += [f"{a}:{b}" for a, b in zip(*ends, strict=True)] if colon else ends[0]
    return tuple(dict.fromkeys(names))
