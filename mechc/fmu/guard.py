"""Libraries of FMUs in a process of their own, bounded in time and memory: what they do to it, they do to it alone.

This keeps mechc from what goes wrong in a library, not from what one does on purpose: it runs with the user's rights.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeVar

from msgspec import Struct

from ..compiler.targets.fmu.inspect import CheckLine, CheckPart, CheckStage, Report, inspect, perform_stage
from ..watchdog import Crashed, Hung, RaisedThere, Watchdog

Question = TypeVar("Question")
Reply = TypeVar("Reply")

LARGEST_FILE = 4_000_000_000
"""Bytes that a library may write into one file."""


class Limits(Struct, frozen=True):
    """``seconds``: for one stage of a check, or a run. ``memory``: bytes of address space, where systems bound that."""

    seconds: float = 120.0
    memory: int = 8_000_000_000


class LostProcess(Struct, frozen=True):
    """There is no answer, and why."""

    text: str
    help: str = ""


def check_fmu(path: Path, *, run: bool = True, limits: Limits | None = None) -> Report:
    """Check a file as ``inspect`` does, each stage in a process that it can take with it."""
    with guarded(checker, limits or Limits(), path.absolute()) as ask:

        def perform(stage: CheckStage) -> CheckPart:
            reply = ask(stage)
            if isinstance(reply, LostProcess):
                detail = "; ".join(text for text in (reply.text, reply.help) if text)
                return CheckPart((CheckLine(stage.what, False, detail, "process"),))
            return reply

        return inspect(path, run=run, perform=perform)


def checker(path: Path) -> Callable[[CheckStage], CheckPart]:
    """Return what goes through the stages of a check in the process that calls it."""
    return lambda stage: perform_stage(path, stage)


@contextmanager
def guarded(
    make: Callable[..., Callable[[Question], Reply]], limits: Limits, *settings: object
) -> Iterator[Callable[[Question], Reply | LostProcess]]:
    """Give what asks ``make(*settings)``, a function of a module, in another process, begun again where it is lost.

    It works in a folder of its own, which goes with it.
    """
    with tempfile.TemporaryDirectory(prefix="mechc-fmu-", ignore_cleanup_errors=True) as folder:
        dog: Watchdog[Question, Reply] = Watchdog(_confined, make, limits, folder, settings)

        def ask(question: Question) -> Reply | LostProcess:
            try:
                reply = dog.ask(question, limits.seconds)
            except MemoryError:
                return LostProcess(
                    f"it needs more than {limits.memory / 1e9:g} GB of memory", "--memory allows more"
                )
            except RaisedThere as told:  # by fmpy
                return LostProcess(str(told))
            match reply:
                case Crashed(how):
                    return LostProcess(f"the library ended its process {how}")
                case Hung(seconds):
                    return LostProcess(f"no answer in {seconds:g} s", "--seconds allows more")
            return reply

        with dog:
            yield ask


def _confined(
    make: Callable[..., Callable[[Question], Reply]],
    limits: Limits,
    folder: str,
    settings: tuple[object, ...],
) -> Callable[[Question], Reply]:
    """Bound this process, take its output off the results of mechc, and work in ``folder``."""
    os.chdir(folder)
    tempfile.tempdir = folder
    os.environ["TMPDIR"] = folder
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    if sys.platform != "win32":
        import resource

        for kind, wanted in (
            (resource.RLIMIT_CORE, 0),
            (resource.RLIMIT_FSIZE, LARGEST_FILE),
            (resource.RLIMIT_AS, limits.memory),
        ):
            _, most = resource.getrlimit(kind)
            bound = wanted if most == resource.RLIM_INFINITY else min(wanted, most)
            with suppress(OSError, ValueError):  # macOS bounds no address space
                resource.setrlimit(kind, (bound, most))
    return make(*settings)
