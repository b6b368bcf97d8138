"""Files: reading them, and finding those that an import means."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path

import mechc.stdlib
from mechc.lang import ast
from mechc.lang.diagnostics import Reporter
from mechc.lang.parser import parse
from mechc.lang.read import read_source
from mechc.lang.source import SourceFile

from .file_dependencies import note

LIBRARY = "mech"
"""First word of the names of the standard library: ``mech.planar``."""

SUFFIX = ".mech"

Definition = ast.Model | ast.Function | ast.Type

SHAPE = "shape "
"""Before the names of shape models: only statements ``shape`` use them, so that a body may have the name of a shape."""

_DEFINED = re.compile(r"\n((?:partial |shape )*)(?:model|function|type) (\w+)")
"""A definition at the begin of a line. A search for ``^`` would look at every character, and take three times as long."""

_parsed: dict[Path, tuple[tuple[int, int], ast.File | LibraryFile]] = {}
"""Files with what tells whether they have changed."""


class LibraryFile(Mapping[str, Definition]):
    """The definitions of a file of the standard library, each parsed when it is first looked up."""

    def __init__(self, source: SourceFile) -> None:
        found = [*_DEFINED.finditer("\n" + source.text)]
        ends = [*(match.start() for match in found[1:]), len(source.text)]
        self._source = source
        self._places = {
            f"{SHAPE if SHAPE in match[1] else ''}{match[2]}": (match.start(), end)
            for match, end in zip(found, ends, strict=True)
        }
        self._read: dict[str, Definition] = {}
        self.imports = parse(source, Reporter(), (0, found[0].start())).items

    def __getitem__(self, name: str) -> Definition:
        if name not in self._read:
            (definition,) = parse(self._source, Reporter(), self._places[name]).items
            assert isinstance(definition, Definition)
            self._read[name] = definition
        return self._read[name]

    def mentioning(self, words: Sequence[Collection[str]]) -> Iterator[str]:
        """Yield the names of the definitions whose text has a word of each of these; none is parsed for it."""
        sought = [re.compile(rf"\b(?:{'|'.join(map(re.escape, some))})\b") for some in words]
        text = self._source.text
        return (
            name for name, place in self._places.items() if all(one.search(text, *place) for one in sought)
        )

    def __contains__(self, name: object) -> bool:
        return name in self._places

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)


def load(path: Path | str, reporter: Reporter) -> ast.File | LibraryFile:
    """Read and parse one file; a file that has not changed since is not parsed again.

    Raises CompileError where it cannot be read or is not of the language.
    """
    path = note(Path(path))
    try:
        status = path.stat()
    except OSError:
        return parse(read_source(path, reporter), reporter)
    state = (status.st_mtime_ns, status.st_size)
    known = _parsed.get(path)
    if known is not None and known[0] == state:
        return known[1]
    before = len(reporter.diagnostics)
    file: ast.File | LibraryFile
    if path.is_relative_to(library_folder()):
        name = Path(LIBRARY, path.relative_to(library_folder())).as_posix()  # wherever it is installed
        file = LibraryFile(SourceFile(name, read_source(path, reporter).text))
    else:
        file = parse(read_source(path, reporter), reporter)
    if len(reporter.diagnostics) == before:
        _parsed[path] = (state, file)
    return file


@cache
def library_folder() -> Path:
    """Return the folder of the standard library."""
    return Path(next(iter(mechc.stdlib.__path__)))


def search_path(file: ast.File, further: tuple[Path, ...]) -> tuple[Path, ...]:
    """Return the folders to look in: the file's own, those given, and those of ``MECHPATH``."""
    own = Path(file.source.name).parent
    listed = os.environ.get("MECHPATH", "")
    return (own, *further, *(Path(p) for p in listed.split(os.pathsep) if p))


def find(name: str, folders: tuple[Path, ...]) -> Path | None:
    """Return the file that the dotted name of an import means."""
    for candidate in _candidates(name, folders):
        if note(candidate).is_file():
            return candidate
    return None


def _candidates(name: str, folders: tuple[Path, ...]) -> Iterator[Path]:
    first, _, rest = name.partition(".")
    if first == LIBRARY and rest:
        yield library_folder().joinpath(*rest.split(".")).with_suffix(SUFFIX)
    for folder in folders:
        yield folder.joinpath(*name.split(".")).with_suffix(SUFFIX)


def packages_with(name: str, kind: str = "model") -> list[str]:
    """Return the packages of the standard library that define a model, or what else ``kind`` says, of this name."""
    defined = re.compile(rf"^(?:partial |shape )*{kind} {re.escape(name)}\b", re.MULTILINE)
    texts = (
        (path.stem, path.read_text(encoding="utf-8")) for path in sorted(library_folder().glob("*" + SUFFIX))
    )
    return [f"{LIBRARY}.{package}" for package, text in texts if defined.search(text)]


def importable(folders: tuple[Path, ...]) -> list[str]:
    """Return the names of all files next to hand, for "did you mean"."""
    names = [f"{LIBRARY}.{path.stem}" for path in sorted(library_folder().glob("*" + SUFFIX))]
    for folder in folders:
        if folder.is_dir():
            names += [path.stem for path in sorted(folder.glob("*" + SUFFIX))]
    return names
