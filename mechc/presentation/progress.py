"""Progress on standard error, of what takes longer than a second: a bar for runs, a line for what is compiled."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from types import TracebackType
from typing import TextIO

DELAY = 1.0
"""Seconds before the bar appears."""
INTERVAL = 0.1
CELLS = 30


class Progress:
    """A bar that is called with the fraction done; silent where standard error is not a terminal."""

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


BUILD_DELAY = 1.0
"""Seconds of silence before the line appears."""
WORDS = {
    "kernel": "compiling the solver, once for models like this one: about 10 s",
    "ensemble": "compiling the solver for many runs, once for this installation: about 20 s",
    "high-precision": "compiling the solver in higher precision, once for this installation",
    "adjoint": "compiling the solver for gradients, once for this installation",
    "model": "compiling the model",
    "lanes": "compiling the model for many runs",
    "reference-model": "compiling the model in higher precision",
    "web": "compiling the page; this may take a minute",
    "fmu": "compiling the FMU; this may take a minute",
}
"""What is said of a library, by its name."""


def building(*, quiet: bool = False, stream: TextIO | None = None) -> AbstractContextManager[None]:
    """Say within this context what is compiled; nothing where it is quiet or standard error is not a terminal."""
    stream = stream or sys.stderr
    if quiet or not stream.isatty():
        return nullcontext()
    from ..runtime.native.build import around_builds

    return around_builds(_line_on(stream))


def _line_on(stream: TextIO) -> Callable[[str], AbstractContextManager[None]]:
    @contextmanager
    def line(name: str) -> Iterator[None]:
        """Write the line after a second, and take it away at the end."""
        lock, over, visible = threading.Lock(), False, False

        def write() -> None:
            nonlocal visible
            with lock:
                if not over:
                    visible = True
                    stream.write(f"\r{WORDS.get(name, 'compiling')} ...\x1b[K")
                    stream.flush()

        timer = threading.Timer(BUILD_DELAY, write)
        timer.daemon = True
        timer.start()
        try:
            yield
        finally:
            timer.cancel()
            with lock:
                over = True
            if visible:
                stream.write("\r\x1b[K")
                stream.flush()

    return line
