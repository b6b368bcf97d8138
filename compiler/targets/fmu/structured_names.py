"""Names that fit the structured convention of FMI."""

from __future__ import annotations

import re

_NAME = r"[A-Za-z_][A-Za-z0-9_]*(?:\[\d+(?:,\d+)*\])?"
_STRUCTURED = re.compile(rf"(?:{_NAME}(?:\.{_NAME})*|der\({_NAME}(?:\.{_NAME})*(?:,\d+)?\))")
_RATE = re.compile(r"der\((?P<of>.*?)(?:,(?P<order>\d+))?\)")


class Names:
    """Gives each name once."""

    def __init__(self) -> None:
        self.used: set[str] = set()

    def new(self, name: str) -> str:
        if not _STRUCTURED.fullmatch(name):
            escaped = name.replace("\\", "\\\\").replace("'", "\\'")
            name = f"'{escaped}'"
        while name in self.used:
            name = f"'{name.strip(chr(39))} '"
        self.used.add(name)
        return name

    def rate(self, of: str) -> str:
        """Name the derivative of a state: of ``der(a)`` it is ``der(a,2)``."""
        found = _RATE.fullmatch(of)
        if found:
            order = int(found["order"] or 1) + 1
            return self.new(f"der({found['of']},{order})")
        return self.new(f"der({of})")
