"""Ctrl-C in the middle of each kind of study, and of an export: what is done is told, or one line, and the exit code 130; never a traceback."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import pytest
from studied_models import model_of, settings_of_kind, write_measured

import mechc.runtime
from mechc.cli.main import run as run_command
from mechc.runtime.integrate.solver import Solver
from mechc.runtime.native.build import find_compiler
from mechc.runtime.studies.study import Study
from mechc.runtime.studies.table import STUDIES

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="needs a C compiler")

RUNTIME = str(Path(mechc.runtime.__file__).parent)
LONGER: dict[str, dict[str, Any]] = {
    "simulate": {"stop": 30_000},
    "sweep": {"stop": 30_000},
    "virial": {"stop": 3_000},
    "spectrum": {"stop": 30_000},
    "rainflow": {"stop": 3_000},
    "hysteresis": {"over": "u = 0 .. 1, 30", "hold": 30},
    "diagram": {"over": "u = 0 .. 1, 30", "hold": 30},
}
"""Settings with which the kernel is at work for a moment at least."""


class Calls:
    """Counts the calls of functions of the runtime while a question is answered, and raises a signal at one of them."""

    def __init__(self, at: int | None, number: signal.Signals) -> None:
        self.at, self.number, self.count = at, number, 0

    def __call__(self, frame: FrameType, event: str, _: object) -> None:
        ours = frame.f_code.co_filename.startswith(RUNTIME) and frame.f_code.co_name.isidentifier()
        if event == "call" and ours:
            self.count += 1
            if self.count == self.at:
                sys.setprofile(None)
                signal.raise_signal(self.number)


def command_of(name: str, folder: Path) -> list[str]:
    unused = STUDIES[name].question().unused
    given = {**settings_of_kind(name, unused), **LONGER.get(name, {})}
    file, data = folder / "model.mech", write_measured(folder)
    file.write_text(model_of(name), encoding="utf-8")
    words = ["study", name, str(file), *([str(data)] if name == "fit" else [])]
    for setting, value in given.items():
        words += [] if setting == "data" else [f"--{setting}", str(value)]
    return words


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> Callable[[Calls], None]:
    """Let the calls of answering be counted: not those of reading and compiling before, nor of printing after."""

    def install(calls: Calls) -> None:
        import mechc.session

        solve: Callable[[Any, Study], Any] = vars(mechc.session)["solve"]

        def profiled(problem: Any, study: Study) -> Any:
            sys.setprofile(calls)
            try:
                return solve(problem, study)
            finally:
                sys.setprofile(None)

        monkeypatch.setattr(mechc.session, "solve", profiled)

    return install


QUICK = ("simulate", "fit", "section")
"""Kinds that are tried with every change; the others with the slow tests."""


@pytest.mark.parametrize(
    "name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in STUDIES]
)
def test_an_interrupted_study_ends_in_words(
    name: str, tmp_path: Path, counted: Callable[[Calls], None], capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    words = command_of(name, tmp_path)
    assert run_command(words) == 0  # built and imported
    capsys.readouterr()
    whole = Calls(None, signal.SIGINT)
    counted(whole)
    assert run_command(words) == 0
    complete = capsys.readouterr().out
    monkeypatch.undo()
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)  # as the command does
    try:
        for number, share in ((signal.SIGINT, 0.2), (signal.SIGTERM, 0.5), (signal.SIGINT, 0.8)):
            cut = Calls(max(int(share * whole.count), 1), number)
            counted(cut)
            code = run_command(words)
            said = capsys.readouterr()
            monkeypatch.undo()
            assert cut.count >= (cut.at or 0), "nothing was interrupted"
            assert "bug" not in said.err and "Traceback" not in said.err
            assert code == 130, (name, share, code, said)
            assert said.err.strip() == "interrupted" or "interrupted" in said.out, (name, share, said)
            assert said.out != complete
    finally:
        signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize(("target", "name"), [("fmu", "made.fmu"), ("python", "made.py"), ("c", "made")])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_export_writes_nothing(
    target: str, name: str, number: signal.Signals, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    """The export rests on a run; what that comes to by half is not what is asked for."""
    file, made = tmp_path / "model.mech", tmp_path / name
    file.write_text(model_of("simulate"), encoding="utf-8")
    advance = Solver.advance
    raised: list[int] = []

    def interrupted(self: Solver, stop: float, max_steps: int) -> Any:
        if not raised:
            raised.append(1)
            signal.raise_signal(number)
            return advance(self, stop, 3)
        return advance(self, stop, max_steps)

    monkeypatch.setattr(Solver, "advance", interrupted)
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)  # as the command does
    try:
        code = run_command(["compile", str(file), "--target", target, "-o", str(made)])
    finally:
        signal.signal(signal.SIGTERM, before)
    assert raised and code == 130, capsys.readouterr()
    assert capsys.readouterr().err.strip() == "interrupted" and not made.exists()
