"""Files of parts: what a check tells of models that only others can use."""

from __future__ import annotations

import re
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
    models = re.findall(r"^(?:shape )?model (\w+)", text, re.MULTILINE)
    # blocks have the dimension of what they are given
    left = {"spatial": ["Solid"], "control": models}.get(name, [])
    assert list(found.completed[: len(left)]) == left
    assert len(found.parts) + len(left) == len(models)
    assert not [part.name for part in found.parts if part.wrong]
    assert len(found.parts) + len(found.completed) >= 3


def test_what_is_wrong_in_any_part_is_told_in_either_space() -> None:
    wrong = "model Wire frame from;frame to;force 2 m*(pos(to) - pos(from)) on to;end Wire;"
    found = looked_at(wrong + ROPE)
    assert found is not None
    wire, rope = found.parts
    assert (wire.name, wire.wrong, [d.code for d in wire.diagnostics]) == ("Wire", True, ["E0322"])
    assert (rope.name, rope.wrong, rope.free) == ("Rope", False, ("from", "to"))


COUNT = "model Row frame from;structural parameter Integer n{value};parameter k[n] = {{i*{unit} for i in 1:n}};end Row;"


def test_a_structural_parameter_may_be_left_to_what_uses_the_part() -> None:
    """Its own value only: that of a part inside it is missing, and with a value all is looked at."""
    found = looked_at(COUNT.format(value="", unit="1 m") + ROPE)
    assert found is not None
    assert (found.completed, [part.name for part in found.parts]) == (("Row",), ["Rope"])
    inside = looked_at(
        COUNT.format(value="", unit="1 m") + "model Shelf frame to;Row row(from = to);end Shelf;"
    )
    assert inside is not None and inside.completed == ("Row",)
    assert [(p.name, p.wrong, [d.code for d in p.diagnostics]) for p in inside.parts] == [
        ("Shelf", True, ["E0411"])
    ]
    told = looked_at(COUNT.format(value=" = 2", unit="(1 m + 1 s)") + ROPE)
    assert told is not None and told.completed == () and told.parts[0].wrong


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
