"""Ctrl-C during a run: noted, and acted on between two slices, so that no result is left half written."""

from __future__ import annotations

import signal
import threading
from _signal import getsignal as handler_of  # type: ignore[import-not-found]
from _signal import signal as set_handler
from _thread import get_ident
from collections.abc import Callable, Sequence
from types import FrameType, TracebackType

ENDING = (int(signal.SIGINT), int(signal.SIGTERM))
"""Signals that ask for an end (of ``_signal``: the functions of ``signal`` go through enumerations, longer than a short run). The command line lets both raise KeyboardInterrupt; in other programs SIGTERM stays theirs."""


class NotedInterruptions:
    """Within it Ctrl-C is noted; what it gives tells whether that was pressed since. A second Ctrl-C raises at once.

    ``within``: what another one that lasts longer gave: then it is the same as that. Raises KeyboardInterrupt at the end where it was pressed and nobody was told: after the last time of asking. The same for SIGTERM where it raises KeyboardInterrupt. Outside the main thread, or where the program handles a
    signal itself, nothing is changed.
    """

    _taken: Sequence[int] = ()
    _noted = _told = False

    def __init__(self, within: Callable[[], bool] | None = None) -> None:
        self._within = within

    def __enter__(self) -> Callable[[], bool]:
        if self._within is not None:
            return self._within
        if get_ident() == threading.main_thread().ident:
            for one in ENDING:
                if handler_of(one) is signal.default_int_handler:
                    self._taken = (*self._taken, one)
                    set_handler(one, self._note)
        return self._tell

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for one in self._taken:
            set_handler(one, signal.default_int_handler)
        if kind is None and self._noted and not self._told:
            raise KeyboardInterrupt

    def _tell(self) -> bool:
        self._told = self._noted
        return self._noted

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self._noted:
            raise KeyboardInterrupt
        self._noted = True
