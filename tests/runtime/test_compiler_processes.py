"""Compilers that are interrupted: no process of theirs goes on."""

from __future__ import annotations

import os
import signal
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import FrameType

import pytest

from mechc.runtime.native.children import ended_with_us, run

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="asks for signals")
DRIVER = ("sh", "-c", "sleep 60 & echo $! > worker; wait")


class Interrupted(BaseException):
    """Stands for what a signal raises."""


def test_the_processes_of_an_interrupted_compiler_end(tmp_path: Path) -> None:
    with pytest.raises(Interrupted), _interrupted_once(tmp_path / "worker"):
        run(DRIVER, tmp_path)
    _has_ended(tmp_path / "worker")


def test_what_other_threads_wait_for_ends_too(tmp_path: Path) -> None:
    with pytest.raises(Interrupted), ThreadPoolExecutor(1) as pool, ended_with_us():
        waited_for = pool.submit(run, DRIVER, tmp_path)
        with _interrupted_once(tmp_path / "worker"):
            waited_for.result()
    _has_ended(tmp_path / "worker")


class _interrupted_once:
    """Raise ``Interrupted`` as soon as a file is written."""

    def __init__(self, file: Path) -> None:
        self.file = file

    def __enter__(self) -> None:
        self.before = signal.signal(signal.SIGALRM, self.look)
        signal.setitimer(signal.ITIMER_REAL, 0.02, 0.02)

    def look(self, number: int, frame: FrameType | None) -> None:
        if self.file.exists() and self.file.read_text():
            signal.setitimer(signal.ITIMER_REAL, 0)
            raise Interrupted

    def __exit__(self, *_: object) -> None:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, self.before)


def _has_ended(file: Path) -> None:
    worker, until = int(file.read_text()), time.monotonic() + 5
    while _runs(worker):
        assert time.monotonic() < until
        time.sleep(0.01)


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    status = Path(f"/proc/{process}/status")
    return not (status.exists() and "State:\tZ" in status.read_text())
