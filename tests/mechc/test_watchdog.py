"""Work in a process of its own: answers, exceptions, a crash, a hang."""

from __future__ import annotations

import os
import pickle
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import mechc
from mechc.runtime.native.build import BuildError
from mechc.watchdog import Crashed, Hung, Watchdog


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


def _compile_error() -> Exception:
    try:
        mechc.loads("coordinate x = 0 m;")
    except mechc.CompileError as error:
        return error
    raise AssertionError("a coordinate without inertia compiles")


@pytest.mark.parametrize(
    "error",
    [
        _compile_error(),
        BuildError(["cc", "model.c"], "no such file", Path("build")),
        mechc.SimulationError("the start is empty", code="E0604", notes=("a", "b"), help="give it"),
        mechc.UsageMistake("no such unit", "did you mean 'm'?"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_what_is_raised_in_another_process_arrives_whole(error: Exception) -> None:
    arrived = pickle.loads(pickle.dumps(error))
    assert type(arrived) is type(error) and str(arrived) == str(error)
    assert vars(arrived) == vars(error)
