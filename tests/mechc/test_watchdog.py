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
from mechc.watchdog import Crashed, Hung, RaisedThere, Watchdog


class Refused(Exception):
    """Of two arguments of which it keeps none, as those of other packages: it is not made again from what it keeps."""

    def __init__(self, function: str, status: int) -> None:
        super().__init__(f"{function} failed with status {status}")


class Reworded(Exception):
    """Made again from what it keeps, it says something else."""

    def __init__(self, function: str) -> None:
        super().__init__(f"{function} failed")


class Closed(Exception):
    """It holds what no other process can have."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.answer = lambda: text


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
            case "refuse":
                raise Refused("step", 3)
            case "reword":
                raise Reworded("step")
            case "close":
                raise Closed("step")
            case "return":
                return Closed("step")  # type: ignore[return-value]
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


@pytest.mark.parametrize(
    ("question", "text"),
    [
        ("refuse", "Refused: step failed with status 3"),
        ("reword", "Reworded: step failed"),
        ("close", "Closed: step"),
    ],
)
def test_what_cannot_be_sent_arrives_as_its_text(question: str, text: str) -> None:
    with Watchdog(maker, 10) as dog:
        with pytest.raises(RaisedThere, match=text) as told:
            dog.ask(question, 60)
        assert "in answer" in str(told.value.__cause__)
        assert dog.ask("four", 60) == 14


def test_an_answer_that_cannot_be_sent_is_told() -> None:
    with Watchdog(maker, 10) as dog:
        with pytest.raises(Exception, match="pickle"):
            dog.ask("return", 60)
        assert dog.ask("four", 60) == 14


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
