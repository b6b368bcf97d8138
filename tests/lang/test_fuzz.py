"""Random edits of the samples: every text is parsed or refused, quickly, and never with another error."""

from __future__ import annotations

import time
from random import Random

import pytest
from syntax import parse_text, sample_files

from mechc.lang.diagnostics import CompileError
from mechc.lang.grammar.keywords import KEYWORDS
from mechc.lang.grammar.lexer import MOST_ERRORS
from mechc.lang.printing.printer import format_file
from mechc.presentation.render import render

_PIECES = (
    *sorted(KEYWORDS), *'()[]{};,.:=~^*/+-<>"\\\n\t #@\u03b8\u00b0', "->", ":=", "==", "//", "/*", "*/",
    "1", "1.5e3", "2 m", "x", "1/2 m", "end ", "end for;", "model A", "m/s^2", "'", "\x00", "\U0001f600",
)  # fmt: skip
_SECONDS = 2.0


def edited(text: str, random: Random) -> str:
    """Delete, repeat, swap or insert pieces, up to five times."""
    for _ in range(random.randint(1, 5)):
        a, b = sorted(random.randint(0, len(text)) for _ in range(2))
        b = min(b, a + random.choice([1, 1, 3, 10, 200]))
        match random.randrange(5):
            case 0:
                text = text[:a] + text[b:]
            case 1:
                text = text[:b] + text[a:b] + text[b:]
            case 2:
                text = text[:a] + random.choice(_PIECES) + text[b:]
            case 3:
                text = text[:a] + random.choice(_PIECES) + text[a:]
            case _:
                c = random.randint(0, len(text))
                text = text[:a] + text[c : c + b - a] + text[b:]
    return text


def check(text: str) -> bool:
    """Parse one text under the promises that hold for all; True if it was accepted."""
    began = time.process_time()
    try:
        tree = parse_text(text)
    except CompileError as error:
        assert time.process_time() - began < _SECONDS
        assert 1 <= len(error.diagnostics) <= MOST_ERRORS
        for d in error.diagnostics:
            assert d.span is not None and 0 <= d.span.start <= d.span.end <= len(text)
            assert d.code.startswith("E01")
        assert render(error.diagnostics)
        return False
    assert time.process_time() - began < _SECONDS
    printed = format_file(tree)
    assert parse_text(printed) == tree
    assert format_file(parse_text(printed)) == printed
    assert len(parse_text(printed).comments) == len(tree.comments)
    return True


def edits(count: int, seed: int) -> tuple[int, int]:
    """Check so many edits and return how many were accepted and refused."""
    random = Random(seed)
    samples = [path.read_text(encoding="utf-8") for path in sample_files()]
    accepted = 0
    for _ in range(count):
        text = edited(random.choice(samples), random)
        try:
            accepted += check(text)
        except Exception as error:
            raise AssertionError(f"{error!r} with the text:\n{text}") from error
    return accepted, count - accepted


def test_a_few_edits() -> None:
    accepted, refused = edits(60, seed=1)
    assert accepted and refused


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_many_edits(seed: int) -> None:
    accepted, refused = edits(2_000, seed=100 + seed)
    assert accepted > 100 and refused > 100
