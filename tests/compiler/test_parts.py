"""Files of parts: what a check tells of models that only others can use."""

from __future__ import annotations

from pathlib import Path

import pytest

from mechc.compiler.parts import Parts, parts_of
from mechc.lang.read import read_source
from mechc.lang.source import SourceFile

STDLIB = Path(__file__).parents[2] / "stdlib"
ROPE = "model Rope frame from;frame to;parameter k = 1 N/m;potential 1/2*k*dot(pos(to) - pos(from), pos(to) - pos(from));end Rope;"


def looked_at(text: str) -> Parts | None:
    return parts_of(SourceFile("parts.mech", text), ())


@pytest.mark.parametrize("name", sorted(path.stem for path in STDLIB.glob("*.mech")))
def test_the_library_checks_alone(name: str) -> None:
    """Every model of it that is not partial is counted, and none is wrong."""
    path = STDLIB / f"{name}.mech"
    found = parts_of(read_source(path), (STDLIB,))
    assert found is not None
    text = path.read_text(encoding="utf-8")
    assert len(found.parts) == sum(line.startswith("model ") for line in text.splitlines())
    assert [part.name for part in found.parts if part.wrong] == []
    assert len(found.parts) + len(found.completed) > 5


def test_what_is_wrong_in_any_part_is_told_in_either_space() -> None:
    wrong = "model Wire frame from;frame to;force 2 m*(pos(to) - pos(from)) on to;end Wire;"
    found = looked_at(wrong + ROPE)
    assert found is not None
    wire, rope = found.parts
    assert (wire.name, wire.wrong, [d.code for d in wire.diagnostics]) == ("Wire", True, ["E0322"])
    assert (rope.name, rope.wrong, rope.free) == ("Rope", False, ("from", "to"))


@pytest.mark.parametrize(
    "text",
    [
        ROPE + "model Ball frame b;mass 1 kg at b;experiment(stop = 1 s);end Ball;",
        ROPE + "model Slide coordinate x = 0 m;kinetic 1/2*1 kg*der(x)^2;force 1 N/s on x;end Slide;",
        "frame b;mass 1 kg at b;",
        "model Broken",
    ],
)
def test_whole_models_are_no_parts(text: str) -> None:
    assert looked_at(text) is None
