"""A line on standard error that says what is compiled, where that takes longer than a second."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import TextIO

DELAY = 1.0
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
    """Say within this context what is compiled; nothing where it is quiet or standard error is no terminal."""
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

        timer = threading.Timer(DELAY, write)
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
