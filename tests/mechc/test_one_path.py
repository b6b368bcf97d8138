"""Every command and every option on fourteen small models, in processes of their own: right, or refused in words.

What the command line gives is what Python gives, as far as there is a number. No call shows a traceback, ends by a signal, or says
that it is a bug in mechc.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_cells import TOGETHER, Cell, cells, spelled, unsaid
from slow_params import slow_among
from small_models import MODELS, Small, whole

import mechc
from mechc.requests.parse_values import UsageMistake
from mechc.runtime.outcome import SimulationError

NONE = Small("")
SECONDS = 300
EXIT_CODES = {0, 1, 2, 3}
"""Done, wrong, wrong usage, doubtful: docs/commands.md."""

ALL = cells()
FAST = [
    *(Cell("run", ("MODEL", *several), list(MODELS)[k]) for k, several in enumerate(TOGETHER)),
    *(
        Cell("run", ("MODEL", "--sensitivity", "PARAMETER"), name)
        for name in ("contact", "when", "sample", "loop")
    ),
    *(Cell("run", ("MODEL",), name) for name in MODELS),
    Cell("study linearize", ("MODEL",), "driven"),
    Cell("study modes", ("MODEL",), "smooth"),
    Cell("study equilibria", ("MODEL", "--guesses", "3"), "smooth"),
]
LONG = [
    *FAST[1 : len(TOGETHER)],
    *(Cell("run", ("MODEL", "--sensitivity", "PARAMETER"), name) for name in ("sample", "when", "loop")),
]
"""Of these, what is slow and has a brother: several questions at once, and derivatives through further kinds of events."""


def test_every_command_and_option_is_tried() -> None:
    """A new one has its words in tests/support/command_cells.py."""
    assert unsaid() == []


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder for each model, with data to fit and a table for an input."""
    made = tmp_path_factory.mktemp("cells")
    for name in MODELS:
        _write(made / name, name)
    (made / "nothing").mkdir()
    yield made


def _write(folder: Path, name: str) -> None:
    folder.mkdir()
    small = MODELS[name]
    (folder / "model.mech").write_text(whole(name))
    (folder / "table.csv").write_text("time,u\n0,0\n0.2,0.01\n0.6,0.05\n")
    t = np.linspace(0, 0.4, 9)
    rows = "\n".join(f"{x:.17g},{0.1 + 0.2 * x:.17g}" for x in t)
    (folder / "data.csv").write_text(f"time,{small.coordinate}\n{rows}\n")


def called(folder: Path, command: str, words: list[str]) -> subprocess.CompletedProcess[str]:
    own = {"MECHC_CACHE": str(folder)} if command.startswith("cache") else {}
    return subprocess.run(
        [sys.executable, "-m", "mechc", *command.split(), *words],
        cwd=folder,
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        timeout=SECONDS,
        env={**os.environ, "NO_COLOR": "1", "MPLBACKEND": "agg"} | own,
    )


def wrong(cell: Cell, folders: Path) -> str:
    """Say what is wrong with what a call gives; nothing where it is right, or refused in words."""
    small = MODELS.get(cell.model, NONE)
    folder = folders / (cell.model or "nothing")
    words = spelled(cell.words, small, cell.model)
    if cell.command.startswith("fmu ") and not (folder / "unit.fmu").exists():
        made = called(
            folders / "smooth", "compile", ["model.mech", "--target", "fmu", "-o", "../nothing/unit.fmu"]
        )
        assert made.returncode == 0, made.stderr
    if cell.command == "import":
        (folder / "robot.urdf").write_text(
            '<robot name="r"><link name="a"><inertial><mass value="1"/></inertial></link></robot>'
        )
    compared = cell.command == "run" or cell.command.startswith("study ")
    if compared and not {"--json", "--quiet"} & {*words}:
        words.append("--json")
    try:
        done = called(folder, cell.command, words)
    except subprocess.TimeoutExpired:
        return f"takes longer than {SECONDS} s"
    said = f"{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    for sign in ("bug in mechc", "Traceback"):
        if sign in said:
            return said
    if done.returncode not in EXIT_CODES:
        return f"ends with {done.returncode}: {said}"
    if done.returncode in (1, 2) and not said.strip():
        return f"ends with {done.returncode} and says nothing"
    if compared and done.returncode in (0, 3) and "--quiet" not in words:
        return _unlike_python(cell, small, folder, json.loads(done.stdout))
    return ""


def _unlike_python(cell: Cell, small: Small, folder: Path, told: Any) -> str:
    """Compare what the command line told with Python's answer to the same question."""
    given = _as_keywords(spelled(cell.words, small, cell.model))
    if given is None or not isinstance(told, dict):
        return ""
    try:
        model = mechc.load(folder / "model.mech", set=given.pop("set", {}))
        if cell.command == "run" and "vary" in given:
            found: Mapping[str, Any] = model.study("ensemble", **given).summary()
        elif cell.command == "run":
            found = model.simulate(**given).summary()
        else:
            found = model.study(cell.command.removeprefix("study "), **given).summary()
    except (UsageMistake, SimulationError, mechc.CompileError) as error:
        return f"Python refuses: {error}"
    ours, theirs = _numbers(told), _numbers(json.loads(json.dumps(found)))
    if ours.keys() != theirs.keys():
        return f"Python tells other things: {sorted(ours.keys() ^ theirs.keys())[:6]}"
    off = [n for n in ours if not np.isclose(ours[n], theirs[n], rtol=1e-9, atol=1e-9, equal_nan=True)]
    return f"Python finds {[(n, ours[n], theirs[n]) for n in off[:4]]}" if off else ""


FLAGS = {
    "--condition": ("condition", True),
    "--constants": ("constants", True),
    "--reproducible": ("reproducible", True),
    "--no-error-estimate": ("estimate_error", False),
    "--no-estimate-error": ("estimate_error", False),
    "--integral": ("integral", True),
    "--least": ("least", True),
}
SETTINGS = {
    *("start", "stop", "every", "step", "tolerance", "method", "sensitivity", "experiment"),
    *(
        "guesses",
        "vary",
        "keep",
        "goal",
        "to",
        "over",
        "hold",
        "reaches",
        "time",
        "where",
        "degree",
        "of",
        "at",
    ),
    *("period", "energy", "paths"),
}
NUMBERS = {"tolerance": float, "guesses": int, "degree": int, "paths": int}
SHOWN_ONLY = {"--json", "--verify"}


def _as_keywords(words: list[str]) -> dict[str, Any] | None:
    """Give the keywords of the same question in Python; None where it is said otherwise there, or is only about files."""
    given: dict[str, Any] = {}
    k = 1
    while k < len(words):
        word, value = words[k], words[k + 1] if k + 1 < len(words) else ""
        if word in FLAGS:
            name, meant = FLAGS[word]
            given[name] = meant
            k += 1
        elif word in SHOWN_ONLY:
            k += 1
        elif word == "--set" and "{" not in value:
            name, _, number = value.partition("=")
            given.setdefault("set", {})[name] = number
            k += 2
        elif word == "--input":
            name, _, path = value.partition("=")
            given.setdefault("inputs", {})[name] = path
            k += 2
        elif word.removeprefix("--") in SETTINGS and "--keep" not in words:
            name = word.removeprefix("--")
            given[name] = NUMBERS.get(name, str)(value)
            k += 2
        else:
            return None
    return given


TIMED = ("run_time", "seconds", "study")


def _numbers(told: Any, at: str = "") -> dict[str, float]:
    """List the numbers of an answer by where they stand, without those of clocks."""
    if isinstance(told, bool) or told is None or isinstance(told, str):
        return {}
    if isinstance(told, (int, float)):
        return {at: float(told)}
    pairs = told.items() if isinstance(told, Mapping) else enumerate(told)
    found: dict[str, float] = {}
    for name, value in pairs:
        if not str(name).endswith(TIMED):
            found |= _numbers(value, f"{at}.{name}")
    return found


@pytest.mark.parametrize("cell", slow_among(LONG, FAST), ids=str)
def test_a_call_is_right_or_refused(cell: Cell, folders: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folders / (cell.model or "nothing"))
    assert wrong(cell, folders) == ""


@pytest.mark.slow
@pytest.mark.matrix
@pytest.mark.parametrize("command", sorted({cell.command for cell in ALL}))
def test_all_calls_of_a_command(command: str, folders: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = {}
    for cell in ALL:
        if cell.command == command:
            monkeypatch.chdir(folders / (cell.model or "nothing"))
            if said := wrong(cell, folders):
                found[str(cell)] = said
    assert not found, "\n\n".join(f"{cell}: {said}" for cell, said in found.items())
