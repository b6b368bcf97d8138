"""The library is parsed piece by piece: only what a model names, and as a whole it is the same."""

from __future__ import annotations

from pathlib import Path

import pytest
from refusals import refused

import mechc
from mechc.compiler.flat.names import files
from mechc.compiler.parts import parts_of
from mechc.lang.diagnostics import CompileError, Reporter
from mechc.lang.parser import parse
from mechc.lang.read import read_source

LIBRARY = sorted(files.library_folder().glob("*.mech"))


@pytest.mark.parametrize("path", LIBRARY, ids=lambda path: path.stem)
def test_the_pieces_are_the_file(path: Path) -> None:
    """In order, and each with its place in the text: messages show it."""
    whole = parse(read_source(path), Reporter()).items
    pieces = files.LibraryFile(read_source(path))
    items = (*pieces.imports, *pieces.values())
    assert items == whole
    assert [(i.span.start, i.span.end) for i in items] == [(i.span.start, i.span.end) for i in whole]


@pytest.mark.parametrize("path", LIBRARY, ids=lambda path: path.stem)
def test_each_part_of_the_library_is_right_alone(path: Path) -> None:
    looked = parts_of(read_source(path), (path.parent,))
    assert looked is not None and looked.parts + looked.completed
    assert [(part.name, part.diagnostics) for part in looked.parts if part.wrong] == []


def test_only_what_a_model_names_is_parsed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "_parsed", {})
    mechc.loads("""
import mech.planar.*;
model Pendulum
  Bar rod;
  Revolute hinge(world -> rod.a);
  gravity {0, -9.81} m/s^2;
end Pendulum;
""")
    (pieces,) = (file for _, file in files._parsed.values() if isinstance(file, files.LibraryFile))
    assert {*pieces._read} == {"Bar", "Revolute", "TurningSettings"}


def test_contacts_of_shapes_parse_what_may_be_their_part(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the library in reach only what names both kinds of shapes, and the bases of the part that is taken."""
    monkeypatch.setattr(files, "_parsed", {})
    mechc.loads("""
import mech.planar.*;
import mech.shapes.*;
model Falls
  gravity {0, -9.81} m/s^2;
  Disk disk(m = 1 kg, r = 0.1 m);
  Planar free(world -> disk.a, y = 1 m);
  shape Sphere(r = 0.1 m) on disk.a;
  shape Plane() on world;
  contact disk with world;
end Falls;
""")
    pieces = {path.stem: file for path, (_, file) in files._parsed.items()}
    planar, shapes, contact = pieces["planar"], pieces["shapes"], pieces["contact"]
    assert isinstance(planar, files.LibraryFile) and isinstance(shapes, files.LibraryFile)
    assert isinstance(contact, files.LibraryFile)
    assert {*planar._read} == {"Disk", "Planar", "SlidesSettings", "TurningTooSettings"}
    assert {*shapes._read} == {"shape Sphere", "shape Plane", "SphereMeetsPlane"}
    assert {*contact._read} == {"BallOnPlane", "FeetOnPlane", "Contacts"}


def test_a_wrong_piece_is_told_where_it_is_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And where it is not used, by ``mechc check`` of the file."""
    text = 'model Good\n  coordinate Length x;\nend Good;\n\nmodel Bad "wrong"\n  coordinate Length x = ;\nend Bad;\n'
    (tmp_path / "own.mech").write_text(text, encoding="utf-8")
    monkeypatch.setattr(files, "library_folder", lambda: tmp_path)
    use = "import mech.own.*;\nmodel M\n  {} part;\n  kinetic 1/2*1 kg*der(part.x)^2;\nend M;\n"
    mechc.loads(use.format("Good"))
    (found,) = refused(use.format("Bad"))
    assert found.span is not None
    assert (found.span.file.name, found.span.file.position(found.span.start)[0]) == ("mech/own.mech", 6)
    with pytest.raises(CompileError):
        mechc.load(tmp_path / "own.mech", model="Good")
