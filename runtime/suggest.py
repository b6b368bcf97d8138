"""The nearest known name, for messages."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def suggest(name: str, known: Iterable[str]) -> str:
    """Return ``; did you mean '...'?``, or nothing where no name is near."""
    spelt = {word.casefold(): word for word in known}
    close = difflib.get_close_matches(name.casefold(), list(spelt), n=1)
    return f"; did you mean '{spelt[close[0]]}'?" if close else ""
