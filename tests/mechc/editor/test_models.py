"""Models that an edit cannot concern are not looked at again, and what is told is what a first look tells."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from mechc.editor import models
from mechc.editor.document import Document
from mechc.lang import ast
from mechc.lang.source import SourceFile

TEXT = """\
import mech.planar.*;
import parts.*;
type Stiffness = unit "N/m";
function twice(x) = 2*x;

partial model Base
  parameter Mass m = 1 kg;
  gravity {0, -9.81} m/s^2;
end Base;

model First
  extends Base;
  Bar bar(m = m, l = twice(1 m));
  Revolute pin(world -> bar.a, angle = 30 deg);
end First;

model Second
  parameter Stiffness k = 3 N/m;
  coordinate x = 1 m;
  kinetic 1/2*(2 kg)*der(x)^2;
  potential 1/2*k*x^2;
end Second;

model Third
  Stick rod(size = 2 m);
  coordinate z = 0 m;
  kinetic 1/2*(1 kg)*der(z)^2;
  output y = rod.size;
end Third;
"""
WORDS = [
    "twice",
    "Stiffness",
    "Bar",
    "m",
    "x",
    "k",
    " ",
    ";",
    "2 kg",
    "First",
    "Base",
    "y",
    "\n",
    "(",
    "size",
]


def looked_at(document: Document, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Name the models that a document looks at to say what is wrong."""
    seen: list[str] = []
    look = models._looked

    def noted(tree: ast.File, name: str, search: tuple[Path, ...]) -> models.Looked:
        seen.append(name)
        return look(tree, name, search)

    with monkeypatch.context() as patch:
        patch.setattr(models, "_looked", noted)
        document.at_once()
    return seen


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "parts.mech").write_text("model Stick\n  parameter Length size = 1 m;\nend Stick;\n")
    return tmp_path


def test_what_depends_on_a_change_is_looked_at_and_nothing_else(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    document = Document(folder / "all.mech")

    def seen(text: str) -> list[str]:
        document.change(text)
        return looked_at(document, monkeypatch)

    assert seen(TEXT) == ["First", "Second", "Third"]
    assert seen(TEXT) == []
    assert seen(TEXT.replace("x = 1 m", "x = 2 m")) == ["Second"]
    assert seen(TEXT.replace("m = 1 kg", "m = 2 kg")) == ["First", "Second"], "Second is as it was at first"
    assert seen(TEXT.replace("2*x", "3*x")) == ["First"], "through a function, and its base is as it was"
    assert seen("\n" + TEXT) == ["First"]
    assert seen(TEXT.replace("type Stiff", 'type Other = unit "kg";\ntype Stiff')) == [
        "First",
        "Second",
        "Third",
    ], "a name"
    document.change(TEXT)
    document.at_once()
    (folder / "parts.mech").write_text("model Stick\n  parameter Length long = 1 m;\nend Stick;\n")
    assert seen(TEXT + "\n") == ["First", "Second", "Third"], "a file that all of them import"
    assert {d.code for d in document.at_once()} == {"E0401", "E0202"}


def test_places_are_those_of_the_present_text(folder: Path) -> None:
    """A model that is wrong to the mechanics only is kept; where it stands has moved."""
    text = TEXT.replace("  kinetic 1/2*(2 kg)*der(x)^2;\n", "")
    document = Document(folder / "all.mech", text)
    (before,) = document.in_full()
    document.change("// a line more\n" + text)
    (after,) = document.in_full()
    assert before.span is not None and after.span is not None
    assert after.span.file is document.source and after.span.text == before.span.text


@pytest.mark.parametrize("seed", range(3))
def test_what_is_told_is_what_a_first_look_tells(folder: Path, seed: int) -> None:
    random = Random(seed)
    document = Document(folder / "all.mech", TEXT)
    for _ in range(16):
        text = TEXT if random.random() < 0.3 else document.text
        at = random.randrange(len(text))
        end = at + random.randrange(6)
        document.change(text[:at] + random.choice(WORDS) + text[end:])
        fresh = Document(document.path, document.text)
        assert document.at_once() == fresh.at_once()
        if random.random() < 0.2:
            assert document.in_full() == fresh.in_full()


def test_bodies_that_another_model_of_the_file_joins_to_the_world_are_a_part() -> None:
    leg = "model Leg\n  Bar thigh;\n  Bar shin;\n  Revolute knee(thigh.b -> shin.a, angle = 10 deg);\nend Leg;\n"
    whole = "model Walker\n  Leg leg;\n  Revolute hip(world -> leg.thigh.a, angle = 0 deg);\nend Walker;\n"

    def codes(text: str) -> list[str]:
        looked = models.Models(())
        front = looked.look(models.read(SourceFile("walker.mech", "import mech.planar.*;\n" + text)))
        return [d.code for d in looked.assembled(front) if d.code.startswith("E")]

    assert codes(leg + whole) == []
    assert codes(leg) == ["E0512", "E0512"]
