"""What the compiler says of the models of a text, said again without looking where nothing that it depends on has changed.

A model depends on its own text, on those definitions of its file whose names are among its words, and so on, on the names of
all definitions (a message may propose one), on the imports of the file, and on the files that were read or looked for.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from msgspec import Struct

from ..compiler.equations.assemble import assemble
from ..compiler.flat.model import FlatModel
from ..compiler.flat.names.file_dependencies import collected
from ..compiler.interpreter import compiling
from ..compiler.mechanics.build import build
from ..compiler.parts import is_part, looked_at
from ..lang import ast
from ..lang.diagnostics import CompileError, Diagnostic, Reporter
from ..lang.parser import parse
from ..lang.source import SourceFile

_WORD = re.compile(r"[^\W\d]\w*")
_NAMED = (ast.Model, ast.Function, ast.Type)


class Reading(Struct, frozen=True):
    """A text after the parser: its tree, None where it cannot be read, and what the parser says."""

    source: SourceFile
    tree: ast.File | None
    diagnostics: tuple[Diagnostic, ...]


class Looked(Struct, frozen=True):
    """A model after names, types and units: ``part`` where only other models can use it."""

    diagnostics: tuple[Diagnostic, ...]
    flat: FlatModel | None
    part: bool


class Front(Struct, frozen=True):
    """What is wrong with a text before its mechanics, and its models; "" is that of bare statements."""

    source: SourceFile
    tree: ast.File | None
    diagnostics: tuple[Diagnostic, ...]
    models: Mapping[str, Looked]


class _Kept(Struct, frozen=True):
    """A model that nothing was said of; ``files``: what it depends on, as they were."""

    looked: Looked
    depends: object
    files: Mapping[Path, object]


def read(source: SourceFile) -> Reading:
    """Parse a text."""
    reporter = Reporter()
    tree = None
    with suppress(CompileError), compiling():
        tree = parse(source, reporter)
    return Reading(source, tree, reporter.diagnostics)


def models_of(tree: ast.File) -> list[str]:
    """Name the models of a file that can be run; "" stands for its bare statements."""
    named = [m.name for m in tree.items if isinstance(m, ast.Model) and not m.partial]
    bare = any(not isinstance(i, ast.Import | ast.Model | ast.Function | ast.Type) for i in tree.items)
    return named or ([""] if bare else [])


class Models:
    """The models of one file that is being written. ``search``: further folders of imports."""

    def __init__(self, search: tuple[Path, ...]) -> None:
        self._search = search
        self._kept: dict[str, _Kept] = {}
        self._right: dict[str, Looked] = {}  # those of which the whole compiler says nothing

    def look(self, reading: Reading) -> Front:
        """Say what is wrong with a text, its names, types and units."""
        tree, models = reading.tree, {}
        if tree is not None:
            depends = _dependencies(tree)
            states: dict[Path, object] = {}
            with compiling():
                for name in models_of(tree):
                    models[name] = self._look(tree, name, depends.get(name), states)
            self._kept = {name: kept for name, kept in self._kept.items() if name in models}
        said = dict.fromkeys((*reading.diagnostics, *(d for m in models.values() for d in m.diagnostics)))
        return Front(reading.source, tree, tuple(said), models)

    def assembled(self, front: Front) -> tuple[Diagnostic, ...]:
        """Return what the whole compiler says of every model that can be run."""
        found = dict.fromkeys(front.diagnostics)
        for name, looked in front.models.items():
            if looked.flat is None or looked.part or self._right.get(name) is looked:
                continue
            said = _assembled(looked.flat)
            if said and front.tree is not None and looked.flat.origin.span.file is not front.source:
                # it was kept: its places are those of another text
                again = _looked(front.tree, name, self._search)
                said = () if again.flat is None else _assembled(again.flat)
            if not said:
                self._right[name] = looked
            found.update(dict.fromkeys(said))
        self._right = {name: looked for name, looked in self._right.items() if name in front.models}
        return tuple(found)

    def _look(self, tree: ast.File, name: str, depends: object, states: dict[Path, object]) -> Looked:
        kept = self._kept.get(name)
        if (
            kept is not None
            and kept.depends == depends
            and all(_state(path, states) == state for path, state in kept.files.items())
        ):
            return kept.looked
        self._kept.pop(name, None)
        with collected() as files:
            looked = _looked(tree, name, self._search)
        if depends is not None and looked.flat is not None and not looked.diagnostics:
            self._kept[name] = _Kept(looked, depends, {path: _state(path, states) for path in files})
        return looked


def _assembled(flat: FlatModel) -> tuple[Diagnostic, ...]:
    reporter = Reporter()
    with suppress(CompileError, RecursionError), compiling():
        assemble(build(flat, reporter), reporter, ())
    return reporter.diagnostics


def _looked(tree: ast.File, name: str, search: tuple[Path, ...]) -> Looked:
    with suppress(RecursionError):
        part, flat = looked_at(tree, name or None, search)
        model = next((m for m in tree.items if isinstance(m, ast.Model) and m.name == name), None)
        return Looked(part.diagnostics, flat, model is not None and is_part(model, part, flat, tree))
    return Looked((), None, False)


def _dependencies(tree: ast.File) -> Mapping[str, object]:
    """Return what each model depends on in its file; nothing for files with statements that stand in no model."""
    items = tree.items
    if not all(isinstance(item, (*_NAMED, ast.Import)) for item in items):
        return {}
    texts = {item.name: item.span.text for item in items if isinstance(item, _NAMED)}
    shared = (
        tuple(item.name for item in items if isinstance(item, _NAMED)),
        tuple(item.span.text for item in items if isinstance(item, ast.Import)),
    )
    alone = len(texts) == 1  # it can use nothing but itself
    uses = {name: set() if alone else set(_WORD.findall(text)) & texts.keys() for name, text in texts.items()}
    return {name: (shared, {used: texts[used] for used in _reached(name, uses)}) for name in texts}


def _reached(name: str, uses: Mapping[str, set[str]]) -> set[str]:
    """Return what a definition uses, what that uses, and so on, with itself."""
    found, pending = {name}, [name]
    while pending:
        new = uses[pending.pop()] - found
        found |= new
        pending += new
    return found


def _state(path: Path, known: dict[Path, object]) -> object:
    """Return what tells whether a file has changed; None where there is none."""
    if path not in known:
        try:
            status = path.stat()
            known[path] = (status.st_mtime_ns, status.st_size)
        except OSError:
            known[path] = None
    return known[path]
