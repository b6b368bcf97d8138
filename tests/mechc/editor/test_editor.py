"""What an editor is told about texts that are right, wrong and half written."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path
from random import Random

import pytest
from slow_params import slow_but

from mechc.editor.completion import completions
from mechc.editor.document import Document
from mechc.editor.edits import applied, fixes, formatted, occurrences, renamed
from mechc.editor.folders import documents
from mechc.editor.hover import hover
from mechc.editor.inlays import inlays
from mechc.editor.lenses import COMMANDS, OF_CURVES, lenses
from mechc.editor.names import meaning_at
from mechc.editor.outline import folds, symbols
from mechc.editor.pieces import pieces
from mechc.editor.selections import around
from mechc.editor.signatures import signature
from mechc.editor.tokens import tokens
from mechc.lang.diagnostics import Severity
from mechc.lang.grammar.examples import WORDS
from mechc.lang.grammar.keywords import ACTIONS, DEFINITIONS, STATEMENTS, STEPS
from mechc.lang.source import Span

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
    assert {*STATEMENTS, *STEPS, *DEFINITIONS, *ACTIONS} <= set(WORDS)


@pytest.mark.parametrize(
    "word", [w for w in (*STATEMENTS, *DEFINITIONS, *ACTIONS) if "..." not in WORDS[w][0]]
)
def test_what_is_written_of_a_word_is_of_the_language(word: str) -> None:
    written = WORDS[word][0]
    whole = written if word in DEFINITIONS else f"model M\n{written}\nend M;"
    if word in ACTIONS and word not in STATEMENTS:
        whole = f"model M\nwhen x < 0 then\n{written}\nend when;\nend M;"
    doc = document(whole)
    assert not doc.broken, doc.at_once()
    assert not [d for d in doc.at_once() if d.code == "E0209"], "no unknown functions"


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


def test_nothing_is_said_inside_of_comments_of_several_lines() -> None:
    text = ARM.replace("  let h = 2*l;", "  /* about h\n  the length l\n  ends */ let h = 2*l;")
    doc = document(text)
    assert doc.at_once() == ()
    for place in ("h\n", "length l", "l\n", "ends */"):
        at = text.index(place)
        assert hover(doc, at) is None and completions(doc, at) == []
    found = hover(doc, text.index("2*l;") + 2)
    assert found is not None and "parameter: a length (m)" in found[0]
    unclosed = ARM.replace("  let h", "  /* let h")
    doc.change(unclosed)
    assert hover(doc, unclosed.index("sin")) is None


def test_definitions_lead_into_the_library() -> None:
    doc = document(ARM)
    found = meaning_at(doc, ARM.index("angle)"))
    assert found is not None and found.place is not None and found.place.file.name == "mech/planar.mech"
    found = meaning_at(doc, ARM.index("l = l)"))
    assert found is not None and found.place is not None and found.place.file.name != doc.source.name
    found = meaning_at(doc, ARM.index("l = l)") + 4)
    assert found is not None and found.place is not None and found.place.start == ARM.index("l = 0.5")


def declared(doc: Document, offset: int) -> Span:
    found = meaning_at(doc, offset)
    assert found is not None and found.place is not None
    return found.place


def test_renaming_changes_what_means_the_same_and_nothing_else() -> None:
    doc = document(ARM)
    length = declared(doc, ARM.index("l = 0.5"))
    ((_, edits),) = renamed([doc], length, "length")
    new = applied(ARM, edits)
    assert new == ARM.replace("Length l = 0.5", "Length length = 0.5").replace(
        "l = l)", "l = length)"
    ).replace("2*l;", "2*length;")
    assert renamed([doc], length, "h") == [], "there is an h"
    assert renamed([doc], declared(doc, ARM.index("angle)")), "phi") == [], "declared in the library"
    assert renamed([doc], length, "2x") == []
    assert len(occurrences(doc, declared(doc, ARM.index("bar.a")))) == 2


def test_renaming_goes_through_all_files_of_a_folder(tmp_path: Path) -> None:
    (tmp_path / "parts.mech").write_text("model Rod\n  parameter Length size = 1 m;\nend Rod;\n")
    (tmp_path / "sub").mkdir()
    (tmp_path / ".hidden").mkdir()
    user = "import parts.*;\nmodel Two\n  Rod a(size = 2 m);\n  Rod b;\n  output s = a.size + b.size;\nend Two;\n"
    (tmp_path / "two.mech").write_text(user)
    (tmp_path / "sub" / "other.mech").write_text("model Other\n  parameter Length size = 1 m;\nend Other;\n")
    (tmp_path / ".hidden" / "no.mech").write_text("model Rod\nend Rod;\n")
    texts = list(documents((), [tmp_path], lambda _, text: "size" in text))
    assert [doc.path.name for doc in texts] == ["parts.mech", "other.mech", "two.mech"]
    place = declared(texts[-1], user.index("size + b"))
    assert Path(place.file.name).name == "parts.mech"
    changed = {doc.path.name: applied(doc.text, edits) for doc, edits in renamed(texts, place, "long")}
    assert set(changed) == {"parts.mech", "two.mech"}
    assert changed["two.mech"] == user.replace("size", "long")
    assert "Length long" in changed["parts.mech"]


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
        ("let h = 2*l;", "input Force u(|", {"min", "display", "interpolation", "filter"}, set()),
        ("let h = 2*l;", "parameter Force u(|", {"min", "display"}, {"filter"}),
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


@pytest.mark.parametrize("seed", slow_but(range(15), range(60)))
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
        doc.at_once(), hover(doc, at), completions(doc, at), symbols(doc), folds(doc)
        signature(doc, at), tokens(doc), inlays(doc, 0, len(text)), lenses(doc), around(doc, at)
        if (found := meaning_at(doc, at)) and found.place is not None:
            occurrences(doc, found.place)
        for diagnostic in doc.at_once():
            assert diagnostic.severity in Severity and fixes(doc, diagnostic) is not None


def test_pieces_are_the_whole_text() -> None:
    for path in sorted((ROOT / "examples").glob("*.mech"))[::12]:
        text = path.read_text(encoding="utf-8")
        assert "".join(piece.text for piece in pieces(text)) == text
    assert [p.text for p in pieces("2 m.x") if p.kind != "blank"] == ["2", "m", ".", "x"]


def test_names_are_coloured_by_what_they_mean() -> None:
    doc = document(ARM)
    doc.at_once()
    found = {(t.start, ARM[t.start : t.end]): (t.kind, t.modifiers) for t in tokens(doc)}
    told = {
        ("Arm", "Arm "): ("class", ("declaration",)),
        ("l", "l = 0.5"): ("parameter", ("declaration", "readonly")),
        ("Bar", "Bar bar"): ("class", ()),
        ("bar", "bar("): ("variable", ("declaration",)),
        ("l", "l = l)"): ("property", ()),
        ("l", "l)"): ("parameter", ("readonly",)),
        ("a", "a, angle"): ("property", ()),
        ("angle", "angle = 30"): ("property", ()),
        ("h", "h;"): ("variable", ()),
        ("angle", "angle);"): ("property", ()),
    }
    for (name, at), kind in told.items():
        assert found[ARM.index(at), name] == kind, (name, at)
    assert not any(name in ("sin", "model", "m/s", "comment") for _, name in found)
    half = document(ARM)
    half.change(ARM.replace("2*l;", "2*(l +"))
    assert len(tokens(half)) == len(tokens(doc)), "what stood there before is still known"


def test_what_the_text_does_not_say_is_shown() -> None:
    text = """\
model M
  structural parameter Integer n = 3;
  parameter Mass m = 2 kg;
  parameter k = 4*m/(2 s)^2;
  parameter Angle turn = 2*(45 deg);
  coordinate Length q[n] = {0, 0, 0} m;
  kinetic 1/2*m*dot(der(q), der(q));
  let p = m*der(q);
  output ratio = q[1]/q[2];
end M;
"""
    doc = document(text)
    assert {d.severity for d in doc.at_once()} <= {Severity.WARNING}
    shown = text
    for inlay in reversed(inlays(doc, 0, len(text))):
        shown = f"{shown[: inlay.offset]}<{inlay.text}>{shown[inlay.offset :]}"
    wanted = text.replace("(2 s)^2", "(2 s)^2< = 2 kg/s^2>").replace("q[n", "q[n< = 3>")
    wanted = wanted.replace("let p", "let p< [kg.m/s]>").replace("(45 deg)", "(45 deg)< = 1.5708 rad>")
    assert shown.replace("< = 2 N/m>", "< = 2 kg/s^2>") == wanted
    some = inlays(doc, text.index("let"), text.index("output") - 1)
    assert [inlay.text for inlay in some] == [" [kg.m/s]"]


@pytest.mark.parametrize(
    ("line", "label", "active"),
    [
        ("output y = atan2(h, |", "atan2(x, y)", "y"),
        ("output y = atan2({h, 2}[1]|", "atan2(x, y)", "x"),
        ("output y = 2*(sin(l) + |", None, None),
        ("Bar rod(|", "Bar rod(m = 1 kg", "m = 1 kg"),
        ("Bar rod(m = 2 kg, l = |", "Bar rod(m = 1 kg", "l"),
        ("Bar rod(m = 2 kg, other = |", "Bar rod(m = 1 kg", None),
        ("extends Bar(l = |", "extends Bar(m = 1 kg", "l"),
        ("output y = square(|", "square(Length x)", "Length x"),
        ("draw disk(|", "draw disk(radius", "radius"),
        ("study s = modes(|", "modes(", None),
        ("experiment(stop = |", "experiment(", "stop"),
        ("experiment c(l ~ normal(|", "normal(mean", "mean"),
        ("output y = sin(l); // sin(|", None, None),
    ],
)
def test_arguments(line: str, label: str | None, active: str | None) -> None:
    whole = ARM.replace("model Arm", "function square(Length x) -> Area = x^2;\n\nmodel Arm")
    doc = document(whole)
    doc.at_once()
    text = whole.replace("let h = 2*l;", f"let h = 2*l;\n  {line}")
    doc.change(text.replace("|", ""))
    found = signature(doc, text.index("|"))
    if label is None:
        assert found is None
        return
    assert found is not None and found.label.startswith(label)
    marked = "" if found.active is None else found.arguments[found.active]
    assert line.startswith("study") or marked.split(" = ")[0] == (active or "").split(" = ")[0]


def test_commands_stand_above_what_can_be_run() -> None:
    doc = document(ARM)
    assert [(lens.title, lens.model) for lens in lenses(doc)] == [(title, "Arm") for title in COMMANDS]
    assert lenses(document(ARM.replace("  experiment(stop = 5 s);\n", ""))) == []
    curve = "model C\n  independent x from 0 m to 1 m;\n  coordinate y ~ x;\n  stationary integral(der(y)^2);\nend C;\n"
    assert {lens.title for lens in lenses(document(curve))} == set(OF_CURVES)


def test_selections_grow_from_a_word_to_the_whole_text() -> None:
    doc = document(ARM)
    found = [ARM[start:end] for start, end in around(doc, ARM.index("pin.angle)") + 5)]
    assert found[:2] == ["angle", "pin.angle"] and found[-1] == ARM
    assert "sin(pin.angle)" in found and "output e = sin(pin.angle);" in found
    assert all(inner in outer for inner, outer in pairwise(found))


ROUTINE = """\
function mean(Length a[n]) -> Length "of all"
  var s = 0;
  for i in 1:n loop
    let part = a[i]/n;
    s := s + part;
  end for;
  return s;
end mean;

model Both
  function polar(Length p[2]) -> (Length r, Angle phi)
    return (norm(p), atan2(p[2], p[1]));
  end polar;
  coordinate x = 1 m;
  let (radius, angle) = polar({x, mean({1, 2} m)});
  kinetic 1/2*1 kg*der(x)^2;
  output u = radius;
end Both;
"""


def test_what_a_function_declares_is_known_in_its_body() -> None:
    made = document(ROUTINE)
    assert made.at_once() == ()
    place = ROUTINE.index("s + part")
    assert {"a", "s", "part"} <= {offer.label for offer in completions(made, place)}
    assert "radius" not in {offer.label for offer in completions(made, place)}
    told = hover(made, place)
    assert told is not None and "var s = 0;" in told[0]
    of_argument = hover(made, ROUTINE.index("a[i]"))
    assert of_argument is not None and "Length a[n]" in of_argument[0]
    meant = meaning_at(made, ROUTINE.index("part;"))
    assert meant is not None and meant.place is not None
    assert meant.place.start == ROUTINE.index("part = ")
    head = hover(made, ROUTINE.index("mean({"))
    assert head is not None and "function mean(Length a[n]) -> Length\n" in head[0]
    assert "var s" not in head[0]
    begins = {offer.label for offer in completions(document(ROUTINE), ROUTINE.index("return s;"))}
    assert {"let", "var", "return"} <= begins and "coordinate" not in begins


def test_names_for_several_results_are_in_the_outline() -> None:
    (_, both) = symbols(document(ROUTINE))
    assert {"radius", "angle", "polar"} <= {child.name for child in both.children}
    assert (1, 8) in folds(document(ROUTINE))


def test_shapes_are_offered_and_explained_where_they_are_set() -> None:
    text = "import mech.planar.*;\nimport mech.shapes.*;\nmodel M\n  Sphere ball;\n  shape skin: Sphere(r = 1 m) on ball;\nend M;\n"
    doc = document(text)
    body, shape = hover(doc, text.index("Sphere ball") + 1), hover(doc, text.index("Sphere(r") + 1)
    assert body is not None and "hollow" in str(body)
    assert shape is not None and "shape model Sphere" in str(shape)
    begun = text.replace("Sphere(r = 1 m) on ball", "Sph")
    assert "Capsule" in {o.label for o in completions(document(begun), begun.index("Sph;") + 3)}
    assert "Revolute" not in {o.label for o in completions(document(begun), begun.index("Sph;") + 3)}
