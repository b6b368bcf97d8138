"""Processes of the C compiler: none outlives what waits for it, as one that is interrupted.

A driver such as ``gcc`` starts processes of its own, which go on without it: where systems know groups of processes, the whole group ends.
"""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

_running: set[subprocess.Popen[str]] = set()


def run(command: Sequence[str], folder: Path) -> tuple[int, str]:
    """Run a command in a folder, and return its exit code with all that it said."""
    with subprocess.Popen(
        command,
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        start_new_session=True,
    ) as process:
        _running.add(process)
        try:
            said, _ = process.communicate()
        except BaseException:
            _end(process)
            raise
        finally:
            _running.discard(process)
    return process.returncode, said


@contextmanager
def ended_with_us() -> Iterator[None]:
    """End what other threads wait for, too, where what stands here is interrupted."""
    try:
        yield
    except BaseException:
        for process in tuple(_running):
            _end(process)
        raise


def _end(process: subprocess.Popen[str]) -> None:
    with suppress(OSError):  # it has ended by itself
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()
