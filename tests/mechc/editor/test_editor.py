"""What an editor is told about texts that are right, wrong and half written."""

from __future__ import annotations

import re
from pathlib import Path
from random import Random

import pytest

from mechc.editor.completion import completions
from mechc.editor.document import Document
from mechc.editor.edits import applied, fixes, formatted, occurrences, renamed
from mechc.editor.hover import hover
from mechc.editor.names import meaning_at
from mechc.editor.outline import folds, symbols
from mechc.editor.words import WORDS
from mechc.lang.diagnostics import Severity
from mechc.lang.grammar.keywords import ACTIONS, DEFINITIONS, STATEMENTS

ROOT = Path(__file__).resolve().parents[3]
PAGES = sorted((ROOT / "mechc" / "errors").glob("[EWN]*.md"))

ARM = """\
import mech.planar.*;

model Arm "an arm"
  parameter Length l = 0.5 m "how long";
  gravity {0, -9.81} m/s^2;
  Bar bar(m = 1 kg, l = l);
  Revolute pin(world -> bar.a, angle = 30 deg);
  let h = 2*l;  // l in a comment
  output high = h;
  output e = sin(pin.angle);
  experiment(stop = 5 s);
end Arm;
"""


def document(text: str) -> Document:
    return Document(Path("arm.mech"), text)


def test_every_word_is_explained() -> None:
    assert {*STATEMENTS, *DEFINITIONS, *ACTIONS} <= set(WORDS)


def test_messages_come_with_their_places() -> None:
    assert document(ARM).in_full() == ()
    (unit,) = document(ARM.replace("l = 0.5 m", "l = 0.5 kg")).at_once()
    assert unit.code == "E0303" and unit.span is not None and unit.span.text == "0.5 kg"
    (late,) = document("coordinate x = 0 m;\npotential 1 N*x;\n").in_full()
    assert late.code.startswith("E05"), "told by the mechanics, not by the names"


@pytest.mark.parametrize(
    ("word", "told"),
    [
        ("l = 0.5", ["parameter: a length (m)", "how long"]),
        ("h;", ["let: a length (m)"]),
        ("bar.a", ["component of Bar"]),
        ("angle)", ["coordinate: an angle", "counter-clockwise"]),
        ("sin(", ["sine of an angle"]),
        ("Bar bar", ["model Bar", "parameter Mass m = 1 kg"]),
        ("gravity", ["the field in which masses fall"]),
        ("l = l", ["length"]),
    ],
)
def test_hover(word: str, told: list[str]) -> None:
    doc = document(ARM)
    assert doc.at_once() == ()
    found = hover(doc, ARM.index(word))
    assert found is not None and all(text in found[0] for text in told), found


def test_nothing_is_said_about_comments_strings_and_numbers() -> None:
    doc = document(ARM)
    for place in ("l in a comment", "how long", "0.5 m"):
        assert hover(doc, ARM.index(place)) is None


def test_definitions_lead_into_the_library() -> None:
    doc = document(ARM)
    found = meaning_at(doc, ARM.index("angle)"))
    assert found is not None and found.place is not None and found.place.file.name == "mech/planar.mech"
    found = meaning_at(doc, ARM.index("l = l)"))
    assert found is not None and found.place is not None and found.place.file.name != doc.source.name
    found = meaning_at(doc, ARM.index("l = l)") + 4)
    assert found is not None and found.place is not None and found.place.start == ARM.index("l = 0.5")


def test_renaming_changes_what_means_the_same_and_nothing_else() -> None:
    doc = document(ARM)
    edits = renamed(doc, ARM.index("l = 0.5"), "length")
    new = applied(ARM, edits)
    assert new == ARM.replace("Length l = 0.5", "Length length = 0.5").replace(
        "l = l)", "l = length)"
    ).replace("2*l;", "2*length;")
    assert renamed(doc, ARM.index("l = 0.5"), "h") == [], "there is an h"
    assert renamed(doc, ARM.index("angle)"), "phi") == [], "declared in the library"
    assert renamed(doc, ARM.index("l = 0.5"), "2x") == []
    assert len(occurrences(doc, ARM.index("bar.a"))) == 2


@pytest.mark.parametrize(
    ("old", "new", "offered", "not_offered"),
    [
        ("2*l", "bar.|", {"m", "l", "a", "b", "c"}, {"high", "sin"}),
        ("2*l", "b|", {"bar", "high", "sin", "time"}, set()),
        ("m = 1 kg", "|", {"m", "l"}, set()),
        ("m = 1 kg", "m = 1 k|", {"kg", "N.m", "km"}, {"pin", "sin"}),
        ("stop = 5 s", "|", {"stop", "tolerance", "method"}, set()),
        ("let h = 2*l;", "pot|", {"potential", "kinetic", "Bar"}, set()),
        ('"how long"', '"how |"', set(), {"l"}),
    ],
)
def test_completion_in_half_written_text(
    old: str, new: str, offered: set[str], not_offered: set[str]
) -> None:
    doc = document(ARM)
    text = ARM.replace(old, new, 1)
    doc.change(text.replace("|", "", 1))
    labels = {offer.label for offer in completions(doc, text.index("|"))}
    assert offered <= labels and not (not_offered & labels)


def test_the_outline_of_the_last_text_that_could_be_read() -> None:
    doc = document(ARM)
    doc.change(ARM + "model (")
    (model,) = symbols(doc)
    assert [s.name for s in model.children] == ["l", "bar", "pin", "h", "high", "e", "experiment"]
    assert folds(doc) == [(3, 12)]


def test_layout_is_that_of_the_command() -> None:
    edit = formatted(document("coordinate   x=0 m ;\n"))
    assert edit is not None and edit.text == "coordinate x = 0 m;\n"
    assert formatted(document(edit.text)) is None and formatted(document("coordinate x = ;")) is None


def wrong_models() -> list[tuple[str, str]]:
    """The wrong model of every page of messages, with the code that it gives."""
    found = []
    for page in PAGES:
        if match := re.search(r"```mech\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL):
            found.append((page.stem, match[1]))
    return found


def test_quick_fixes_mend_what_they_are_for() -> None:
    """Applying one to the model of a page gives a model without that message at that place."""
    mended = set()
    for code, text in wrong_models():
        doc = document(text)
        for diagnostic in doc.in_full():
            for fix in fixes(doc, diagnostic):
                after = document(applied(text, fix.edits)).in_full()
                left = [d for d in after if d.code == diagnostic.code and d.message == diagnostic.message]
                assert not left, f"{code}: {fix.title} leaves {diagnostic.message}"
                mended.add(code)
    assert len(mended) >= 40


@pytest.mark.parametrize("seed", range(60))
def test_no_edit_is_too_wild(seed: int) -> None:
    """Random edits of examples: every question has an answer, none raises."""
    random = Random(seed)
    text = random.choice(sorted((ROOT / "examples").glob("*.mech"))).read_text(encoding="utf-8")
    doc = document(text)
    for _ in range(8):
        place = random.randrange(len(text))
        cut = random.randrange(0, 12)
        text = (
            text[:place]
            + random.choice(["", "(", "x.", " = ", "model ", '"', "//", "2 k", ";"])
            + text[place + cut :]
        )
        doc.change(text)
        at = min(place, len(text))
        doc.at_once(), hover(doc, at), completions(doc, at), occurrences(doc, at), symbols(doc), folds(doc)
        for diagnostic in doc.at_once():
            assert diagnostic.severity in Severity and fixes(doc, diagnostic) is not None
