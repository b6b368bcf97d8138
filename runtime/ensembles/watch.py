"""A call into C watched from another thread: it can be ended, and told that nothing in it goes on."""

from __future__ import annotations

import ctypes
import threading
import time
from collections.abc import Callable
from typing import TypeVar

INTERVAL = 0.05
"""Seconds between two looks."""

Made = TypeVar("Made")


class Watch:
    """What a call of the kernel reads and counts up: ``done`` members, and whether it is ``stopped``.

    ``limit``: seconds after which a call is stopped in which no member has ended: then each one under way has run as long.
    """

    def __init__(self, limit: float | None = None) -> None:
        self.limit = limit
        self.done, self.stopped = ctypes.c_long(0), ctypes.c_int(0)
        self.ended = False
        self.late = False
        self._lock = threading.Lock()
        self._seen, self._since = -1, time.monotonic()

    def begin(self) -> None:
        """Begin a call: whether it is late is counted from here."""
        with self._lock:
            self.late, self.stopped.value = False, int(self.ended)
            self._seen, self._since = self.done.value, time.monotonic()

    def look(self) -> None:
        """Stop the call if no member has ended for too long."""
        with self._lock:
            if self.done.value != self._seen:
                self._seen, self._since = self.done.value, time.monotonic()
            elif self.limit is not None and time.monotonic() - self._since > self.limit:
                self.late, self.stopped.value = True, 1

    def end(self) -> None:
        """Let this call and all later ones end soon."""
        with self._lock:
            self.ended, self.stopped.value = True, 1

    def over(self, work: Callable[[], Made], now_and_then: Callable[[], None]) -> Made:
        """Do some work in a thread of its own while this one looks after it, and give what it gives or raises."""
        found: list[Made] = []
        trouble: list[BaseException] = []

        def guarded() -> None:
            try:
                found.append(work())
            except BaseException as error:  # raised again below, in the thread that waits
                trouble.append(error)

        worker = threading.Thread(target=guarded)
        worker.start()
        try:
            while worker.is_alive():
                worker.join(INTERVAL)
                self.look()
                now_and_then()
        finally:
            if worker.is_alive():  # Ctrl-C was pressed again
                self.end()
                worker.join()
        if trouble:
            raise trouble[0]
        return found[0]
