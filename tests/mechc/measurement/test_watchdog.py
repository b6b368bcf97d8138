"""Work in a process of its own: answers, exceptions, a crash, a hang."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable

import pytest

from mechc.measurement.watchdog import Crashed, Hung, Watchdog


def maker(base: int) -> Callable[[str], int]:
    def answer(question: str) -> int:
        match question:
            case "crash":
                os.kill(os.getpid(), signal.SIGSEGV)
            case "leave":
                os._exit(3)
            case "hang":
                time.sleep(60)
            case "raise":
                raise ValueError("no such question")
        return base + len(question)

    return answer


def test_what_dies_or_hangs_is_told_and_begun_anew() -> None:
    with Watchdog(maker, 10) as dog:
        assert dog.ask("four", 60) == 14
        assert dog.ask("crash", 60) == Crashed("by signal SIGSEGV")
        assert dog.ask("leave", 60) == Crashed("with exit code 3")
        assert dog.ask("hang", 0.2) == Hung(0.2)
        with pytest.raises(ValueError, match="no such question"):
            dog.ask("raise", 60)
        assert dog.ask("seven", 60) == 15
