"""Work in a process of its own, so that what crashes or hangs takes nothing else with it."""

from __future__ import annotations

import multiprocessing
import pickle
import signal
import sys
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from types import TracebackType
from typing import Generic, TypeVar

from msgspec import Struct

Question = TypeVar("Question")
Reply = TypeVar("Reply")

PATIENCE = 5.0
"""Seconds that a process is given to end by itself."""


class Crashed(Struct, frozen=True):
    """The process died; ``how`` names the signal or the exit code."""

    how: str


class Hung(Struct, frozen=True):
    """No answer came within ``seconds``; the process was ended."""

    seconds: float


class RaisedThere(Exception):
    """What an exception of the process says that cannot be made again here."""


class Watchdog(Generic[Question, Reply]):
    """Asks ``make(*settings)``, which returns a function, in a process that is begun again where it dies.

    ``make`` is a function of a module, so that it can be found there. Use as a context.
    """

    def __init__(self, make: Callable[..., Callable[[Question], Reply]], *settings: object) -> None:
        self._make = make
        self._settings = settings
        self._process: multiprocessing.process.BaseProcess | None = None
        self._pipe: Connection | None = None

    def __enter__(self) -> Watchdog[Question, Reply]:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end()

    def ask(self, question: Question, seconds: float) -> Reply | Crashed | Hung:
        """Return the answer, or how the process failed to give it. An exception in it is raised here, or RaisedThere says what it says."""
        if self._process is None or self._pipe is None:
            self._begin()
        assert self._process is not None and self._pipe is not None
        try:
            self._pipe.send(question)
            if not self._pipe.poll(seconds):
                self._end()
                return Hung(seconds)
            reply = self._pipe.recv()
        except (EOFError, BrokenPipeError, ConnectionResetError):
            self._process.join(PATIENCE)
            code = self._process.exitcode
            self._end()
            return Crashed(_how(code))
        except BaseException:
            self._end()
            raise
        if isinstance(reply, _Raised):
            raise reply.again() from _Traceback(reply.trace)
        answer: Reply = reply
        return answer

    def _begin(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, other = context.Pipe()
        self._process = context.Process(target=_serve, args=(other, self._make, self._settings), daemon=True)
        self._process.start()
        other.close()

    def _end(self) -> None:
        if self._pipe is not None:
            self._pipe.close()
        if self._process is not None:
            self._process.join(0.2)
            if self._process.is_alive():
                self._process.kill()
                self._process.join(PATIENCE)
        self._pipe = self._process = None


class _Raised(Struct, frozen=True):
    """An exception on its way: ``pickled`` where it bears that, and what is left where it is not the same again."""

    pickled: bytes
    kind: str
    text: str
    trace: str

    @classmethod
    def of(cls, error: Exception) -> _Raised:
        try:
            pickled = pickle.dumps(error)
        except Exception:
            pickled = b""
        return cls(pickled, type(error).__name__, str(error), "".join(traceback.format_exception(error)))

    def again(self) -> Exception:
        """Return the exception; those of other packages may not be made again from what they keep, or then say something else."""
        try:
            error = pickle.loads(self.pickled)
        except Exception:
            error = None
        if isinstance(error, Exception) and str(error) == self.text:
            return error
        return RaisedThere(f"{self.kind}: {self.text}")


class _Traceback(Exception):
    """Where an exception was raised in its process."""

    def __str__(self) -> str:
        return f"\n{self.args[0]}"


def _serve(
    pipe: Connection, make: Callable[..., Callable[[object], object]], settings: tuple[object, ...]
) -> None:
    """Answer until the pipe is closed. Ctrl-C is left to the process that asks."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    answer: Callable[[object], object] | None = None
    while True:
        try:
            question = pipe.recv()
        except EOFError:
            return
        try:
            if answer is None:
                answer = make(*settings)
            reply = answer(question)
            packed = ForkingPickler.dumps(reply)
        except Exception as error:
            packed = ForkingPickler.dumps(_Raised.of(error))
        try:
            pipe.send_bytes(packed)
        except BrokenPipeError:
            return


def _how(code: int | None) -> str:
    if code is None:
        return "without an exit code"
    if code < 0:
        return f"by signal {signal.Signals(-code).name}" if sys.platform != "win32" else f"by signal {-code}"
    return f"with exit code {code}"
