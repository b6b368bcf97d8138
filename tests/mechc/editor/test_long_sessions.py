"""Long sessions: random edits through the server, each with a question; nothing raises, nothing is kept, no answer lets wait."""

from __future__ import annotations

import os
import re
import sys
import time
from pathlib import Path
from random import Random
from statistics import median
from typing import Any

import pytest
from editor_client import editor

ROOT = Path(__file__).resolve().parents[3]
EXAMPLES = sorted((ROOT / "examples").glob("*.mech"))
PIECES = [
    *(
        "",
        "(",
        ")",
        "x.",
        " = ",
        "model ",
        '"',
        "//",
        "/*",
        "*/",
        "2 k",
        ";",
        "\n",
        "end ",
        "der(",
        "]",
        "[",
        "{",
    ),
    "\U0001d465",
]
WORD = re.compile(r"\w+")
QUESTIONS = (
    *(
        "hover",
        "completion",
        "signatureHelp",
        "definition",
        "references",
        "documentHighlight",
        "documentSymbol",
    ),
    *(
        "foldingRange",
        "selectionRange",
        "semanticTokens/full",
        "inlayHint",
        "codeLens",
        "formatting",
        "rename",
    ),
    "codeAction",
)
LONGEST = 2.0
"""Seconds of processor time of the server that an answer may take."""


def asked(question: str, line: int, column: int) -> dict[str, Any]:
    """What is asked with a question, at some place."""
    here = {"line": line, "character": column}
    what: dict[str, Any] = {"position": here}
    match question:
        case "references":
            what["context"] = {"includeDeclaration": True}
        case "rename":
            what["newName"] = "other"
        case "selectionRange":
            what = {"positions": [here]}
        case "inlayHint":
            what = {"range": {"start": {"line": 0, "character": 0}, "end": {"line": 999, "character": 0}}}
        case "codeAction":
            what = {
                "range": {"start": {"line": 0, "character": 0}, "end": {"line": line + 9, "character": 0}},
                "context": {"diagnostics": []},
            }
        case "formatting":
            what = {"options": {"tabSize": 2, "insertSpaces": True}}
    return what


def edited(text: str, whole: str, random: Random) -> str:
    """Write something somewhere: half of the time a word for a word, which often can be read and means something else."""
    words = list(WORD.finditer(text))
    if words and random.random() < 0.5:
        old = random.choice(words)
        new: str = random.choice(WORD.findall(whole))
        return text[: old.start()] + new + text[old.end() :]
    at = random.randrange(len(text) + 1)
    word = random.choice([random.choice(PIECES), random.choice(whole.split())])
    return text[:at] + word + text[at + random.choice((0, 0, 1, 3, 12)) :]


def session(folder: Path, edits: int, seed: int) -> tuple[list[float], list[int]]:
    """Edit examples at random; return the processor time of each answer, and memory after each hundred edits."""
    random = Random(seed)
    taken: list[float] = []
    memory: list[int] = []
    log = folder / "log"
    with log.open("w") as told, editor(log=told) as client:
        uri = text = whole = ""
        for k in range(edits):
            if k % 40 == 0:
                if uri:
                    client.send("textDocument/didClose", {"textDocument": {"uri": uri}}, asks=False)
                path = random.choice(EXAMPLES)
                uri, text = (folder / path.name).as_uri(), path.read_text(encoding="utf-8")
                whole = text
                client.open(uri, text)
            else:
                text = edited(whole if random.random() < 0.5 else text, whole, random)
                client.change(uri, text)
            question = random.choice(QUESTIONS)
            line = random.randrange(text.count("\n") + 2)
            what = asked(question, line, random.randrange(60))
            before, begun = client.processor_time(), time.perf_counter()
            client.send(f"textDocument/{question}", {"textDocument": {"uri": uri}, **what})
            taken.append(min(client.processor_time() - before, time.perf_counter() - begun))
            if k % 100 == 37:
                time.sleep(0.5)  # a moment in which the whole compiler is asked
            client.notes.clear()
            if k % 100 == 99:
                memory.append(client.memory())
    assert "Traceback" not in log.read_text() and "rror" not in log.read_text(), log.read_text()[-4000:]
    return taken, memory


def check(folder: Path, edits: int, seed: int) -> str:
    """Hold a session; say what was measured."""
    taken, memory = session(folder, edits, seed)
    assert max(taken) < LONGEST
    quarter = len(memory) // 4
    if quarter > 2:  # the largest example may come late
        third, last = median(memory[2 * quarter : 3 * quarter]), median(memory[-quarter:])
        assert last < 1.1 * third, [round(m / 1e6, 1) for m in memory]
    ordered = sorted(taken)
    return (
        f"{edits} edits: answers in {ordered[len(ordered) * 95 // 100]:.3f} s (95 of 100), {ordered[-1]:.3f} s at most; "
        f"memory {', '.join(f'{m / 1e6:.0f}' for m in memory[:: max(1, len(memory) // 10)])} MB"
    )


needs_proc = pytest.mark.skipif(
    not Path("/proc/self/stat").exists(), reason="needs /proc to measure processes"
)


@pytest.mark.slow
@needs_proc
def test_a_short_session(tmp_path: Path) -> None:
    check(tmp_path, 40, seed=1)


@needs_proc
@pytest.mark.slow
def test_a_long_session(tmp_path: Path) -> None:
    """``MECHC_EDITS=20000`` for the longest one."""
    print(check(tmp_path, int(os.environ.get("MECHC_EDITS", "2000")), seed=2), file=sys.stderr)
