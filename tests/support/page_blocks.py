"""Follow a page as a reader does: write its files, type its commands, compare what they print.

Blocks of a page: ```` ```mech file=NAME ```` (or ``csv``, ``c``, ``python`` with ``file=``) is a file; ```` ```console ````
holds commands after ``$``, each with lines that it prints (``...`` stands for lines left out; one that prints an
``error`` ends with exit code 1); ```` ```python ```` goes on in one session; ```` ```mech ```` without a file has to compile.
"""

from __future__ import annotations

import contextlib
import io
import math
import re
import shlex
import subprocess
from collections.abc import Iterator
from glob import glob
from pathlib import Path

from msgspec import Struct

import mechc
from mechc.cli.main import run

FENCE = re.compile(r"^```(\w*)(?: file=(\S+))?\n(.*?)^```$", re.MULTILINE | re.DOTALL)
ERROR = re.compile(r"error(\[|:)")
NUMBER = re.compile(r"[-+]?\d+(?: \d{3})*(?:\.\d+)?(?:e[-+]?\d+)?")
VARIES = ("steps", "run time", "evaluations")
"""Words of lines whose numbers depend on the machine."""
NOISE = 1e-6
"""Numbers below are estimated errors, drifts and roundings, which differ from machine to machine."""


class Block(Struct, frozen=True):
    """A block of a page: its language, the file that it is, and its text."""

    language: str
    file: str
    text: str


class Step(Struct, frozen=True):
    """A command, the lines that the page shows of its output, and its exit code."""

    command: str
    shown: tuple[str, ...]
    code: int


def blocks(page: str) -> tuple[Block, ...]:
    """Return all blocks of a page."""
    return tuple(Block(*(part or "" for part in found)) for found in FENCE.findall(page))


def steps(text: str) -> Iterator[Step]:
    """Take a console block apart into its commands."""
    for part in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
        command, _, printed = part.partition("\n")
        shown = tuple(printed.rstrip().splitlines())
        yield Step(command, shown, int(any(ERROR.match(line) for line in shown)))


def follow(page: str) -> int:
    """Do all that a page says in the current folder; return how many commands were typed."""
    session: dict[str, object] = {}
    typed = 0
    for block in blocks(page):
        match block:
            case Block(file=file) if file:
                Path(file).write_text(block.text, encoding="utf-8")
            case Block(language="console"):
                for step in steps(block.text):
                    _type(step)
                    typed += 1
            case Block(language="python"):
                exec(compile(block.text, "<page>", "exec"), session)
            case Block(language="mech"):
                assert not mechc.loads(block.text).diagnostics, block.text
            case _:
                pass  # excerpts of what another program shows
    return typed


def _type(step: Step) -> None:
    words = shlex.split(step.command)
    if words[0] == "mechc":
        terminal = io.StringIO()
        with contextlib.redirect_stdout(terminal), contextlib.redirect_stderr(terminal):
            code = run(words[1:])
        printed = terminal.getvalue()
    else:
        words = [name for word in words for name in (sorted(glob(word)) if "*" in word else [word])]
        done = subprocess.run(words, capture_output=True, text=True, timeout=300)
        code, printed = done.returncode, done.stdout + done.stderr
    assert code == step.code, f"$ {step.command}\nends with {code}, not {step.code}:\n{printed}"
    missing = unlike(step.shown, printed)
    assert missing is None, f"$ {step.command}\ndoes not print\n{missing}\nbut\n{printed}"


def unlike(shown: tuple[str, ...], printed: str) -> str | None:
    """Return the first lines that are shown and were not printed, in this order; None if all were."""
    rest = [line for line in printed.splitlines() if line.strip()]
    together: list[str] = []
    for line in (*shown, "..."):
        if line.strip() != "...":
            together += [line] if line.strip() else []
            continue
        size = len(together)
        place = next(
            (i for i in range(len(rest) - size + 1) if all(map(alike, together, rest[i : i + size]))), None
        )
        if place is None:
            return "\n".join(together)
        rest, together = rest[place + size :], []
    return None


def alike(shown: str, printed: str) -> bool:
    """Compare two lines: words as they are, numbers to five digits, those of the machine not at all."""
    if "".join(NUMBER.sub("#", shown).split()) != "".join(NUMBER.sub("#", printed).split()):
        return any(word in shown and word in printed for word in VARIES)
    if any(word in shown for word in VARIES):
        return True
    pairs = zip(NUMBER.findall(shown), NUMBER.findall(printed), strict=True)
    return all(
        math.isclose(float(a.replace(" ", "")), float(b.replace(" ", "")), rel_tol=1e-5, abs_tol=NOISE)
        for a, b in pairs
    )
