"""A limit of processor time around what may take too long; limits may stand inside of each other."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


class TooLong(BaseException):
    """Something takes longer than it may; no ``Exception``, so that no check keeps it."""


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise ``TooLong`` once the process has computed for so long."""

    def end(*_: Any) -> None:
        raise TooLong

    begun = time.process_time()
    handler = signal.signal(signal.SIGVTALRM, end)
    left, _ = signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        rest = max(left - (time.process_time() - begun), 0.01) if left else 0.0
        signal.signal(signal.SIGVTALRM, handler)
        signal.setitimer(signal.ITIMER_VIRTUAL, rest)
