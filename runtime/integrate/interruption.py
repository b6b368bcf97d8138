"""Ctrl-C during a run: noted, and acted on between two slices, so that no result is left half written."""

from __future__ import annotations

import signal
import threading
from _signal import getsignal as handler_of  # type: ignore[import-not-found]
from _signal import signal as set_handler
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

ENDING = (signal.SIGINT, signal.SIGTERM)
"""Signals that ask for an end (of ``_signal``: the functions of ``signal`` go through enumerations, longer than a short run). The command line lets both raise KeyboardInterrupt; in other programs SIGTERM stays theirs."""


@contextmanager
def noted_interruptions() -> Iterator[Callable[[], bool]]:
    """Yield a function that tells whether Ctrl-C was pressed since; a second Ctrl-C raises at once.

    Raises KeyboardInterrupt at the end where it was pressed and nobody was told: behind the last time of asking. The same for SIGTERM where it raises KeyboardInterrupt. Outside the main thread, or where the program handles a
    signal itself, nothing is changed.
    """
    noted = told = False

    def tell() -> bool:
        nonlocal told
        told = noted
        return noted

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal noted
        if noted:
            raise KeyboardInterrupt
        noted = True

    in_main = threading.current_thread() is threading.main_thread()
    taken = [one for one in ENDING if in_main and handler_of(one) is signal.default_int_handler]
    try:
        for one in taken:
            set_handler(one, note)
        yield tell
    finally:
        for one in taken:
            set_handler(one, signal.default_int_handler)
    if noted and not told:
        raise KeyboardInterrupt
