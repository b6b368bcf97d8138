"""Every stage is verified where that is asked for, and in all tests; nowhere else."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from compiled import compiled
from msgspec.structs import replace

from mechc.cli.main import run
from mechc.compiler import pipeline, verification
from mechc.compiler.malformed import Malformed
from mechc.compiler.verification import verifying

TEXT = "coordinate x = 1 m; kinetic 1/2*2 kg*der(x)^2; potential 3 N*x; experiment(stop = 1 s);"


def short_body(program: Any) -> Any:
    first, *others = program.functions
    (body,) = first.bodies
    return replace(program, functions=(replace(first, bodies=(body[:-1],)), *others))


BREAKS: dict[str, tuple[Callable[[Any], Any], str]] = {
    "flat_model_of": (lambda both: (both[0], replace(both[1], variables=())), "flat model, energies"),
    "build": (lambda system: replace(system, start_v=()), "system, start_v"),
    "assemble": (lambda equations: replace(equations, known=()), "equations: known"),
    "lower": (short_body, "program, function rhs"),
}


@pytest.fixture(params=BREAKS)
def message(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """What is said of a stage that returns what it must not."""
    made, (spoil, said) = getattr(pipeline, request.param), BREAKS[request.param]
    monkeypatch.setattr(pipeline, request.param, lambda *given, **options: spoil(made(*given, **options)))
    return said


def test_tests_verify_every_stage(message: str) -> None:
    with pytest.raises(Malformed, match=message):
        compiled(TEXT)


def test_nothing_is_verified_unasked(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(value: object) -> None:
        raise AssertionError

    monkeypatch.setattr(verification, "_asked", 0)
    monkeypatch.setattr(verification, "_verify", refuse)
    compiled(TEXT)
    with verifying(), pytest.raises(AssertionError):
        compiled(TEXT)
    compiled(TEXT)


@pytest.mark.parametrize(
    "command",
    [
        ["check"],
        ["show", "flat"],
        ["run", "--quiet"],
        ["compile", "--target", "python", "-o", "m.py"],
    ],
)
def test_commands_verify_where_they_are_asked(
    command: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A broken stage is said to be a bug; without the option what follows from it is another story."""
    made = getattr(pipeline, "build")  # noqa: B009, imported there, not exported
    monkeypatch.setattr(verification, "_asked", 0)
    monkeypatch.setattr(
        pipeline, "build", lambda *given, **options: replace(made(*given, **options), start_v=())
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    Path("m.mech").write_text(TEXT, encoding="utf-8")
    said = (
        "this is a bug in mechc, in building the mechanical system: Malformed: system, start_v: has 0 numbers"
    )
    assert run([*command, "m.mech", "--verify"]) == 1
    assert said in capsys.readouterr().err
    run([*command, "m.mech"])
    assert "Malformed" not in capsys.readouterr().err
    assert verification._asked == 0
