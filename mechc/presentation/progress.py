"""A progress bar on standard error, for runs that take longer than a second."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import TextIO

DELAY = 1.0
"""Seconds before the bar appears."""
INTERVAL = 0.1
CELLS = 30


class Progress:
    """A bar that is called with the fraction done; silent where standard error is no terminal."""

    def __init__(self, label: str, *, quiet: bool = False, stream: TextIO | None = None) -> None:
        self._label = label
        self._stream = stream or sys.stderr
        self._wanted = not quiet and self._stream.isatty()
        self._begun = self._shown = time.monotonic()
        self._visible = False

    def __call__(self, fraction: float) -> None:
        now = time.monotonic()
        if not self._wanted or now - self._begun < DELAY or now - self._shown < INTERVAL:
            return
        self._shown, self._visible = now, True
        filled = round(CELLS * min(max(fraction, 0.0), 1.0))
        left = (now - self._begun) * (1 / fraction - 1) if fraction > 0 else 0.0
        bar = "#" * filled + "." * (CELLS - filled)
        self._stream.write(f"\r{self._label} [{bar}] {100 * fraction:3.0f} %, {left:.0f} s left \x1b[K")
        self._stream.flush()

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove the bar."""
        if self._visible:
            self._stream.write("\r\x1b[K")
            self._stream.flush()
