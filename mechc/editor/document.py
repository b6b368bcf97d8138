"""A text that is being written: what it says now, and what the last version of it that could be read said.

Names are looked up in the last tree that could be parsed, by what stands in the present text: so half-written
text gets answers, too. Nothing here raises for a wrong text.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator, Mapping
from pathlib import Path

from ..compiler.flat.model import FlatModel
from ..compiler.flat.names.classes import Class, Classes
from ..compiler.flat.names.files import search_path
from ..compiler.flat.names.namespace import Namespace, SourceLibrary
from ..lang import ast
from ..lang.diagnostics import CompileError, Diagnostic, Reporter
from ..lang.source import SourceFile
from .models import Front, Models, Reading, read

Members = Mapping[str, tuple[ast.Declaration, Namespace]]
"""Declarations by name, with the names that each sees."""

_MODEL = re.compile(r"^[ \t]*(?:partial[ \t]+)?model[ \t]+(\w+)", re.MULTILINE)
_END = re.compile(r"^[ \t]*end[ \t]+(\w+)[ \t]*;", re.MULTILINE)


class Document:
    """One open file. ``tree`` is that of the last text that could be parsed, None before there was one; ``broken``: it is not
    that of the present text, which cannot be read, or was not read yet."""

    def __init__(self, path: Path, text: str | None = None) -> None:
        self.path = path
        self.tree: ast.File | None = None
        self._typed: dict[str, FlatModel] = {}  # the last ones that there were
        self._models = Models((path.parent,))
        self._forget_names()
        self.write(text or "")
        if text is not None:
            self.change(text)

    def change(self, text: str) -> None:
        """Take a new text, and read it."""
        self.write(text)
        self.take(read(self.source))

    def write(self, text: str) -> None:
        """Take a new text that somebody will read: until then names mean what they meant before."""
        self.source = SourceFile(str(self.path), text.replace("\r\n", "\n").replace("\r", "\n"))
        self.reading: Reading | None = None
        self.broken = True
        self._front: Front | None = None

    def take(self, reading: Reading) -> None:
        """Take what was read, unless the text is another one by now."""
        if reading.source is not self.source:
            return
        self.reading = reading
        self.broken = reading.tree is None
        if reading.tree is not None:
            self.tree = reading.tree
            self._forget_names()

    def _forget_names(self) -> None:
        self._namespace: Namespace | None = None
        self._classes: dict[str, Class | None] = {}
        self._members: dict[int, tuple[Class, Members]] = {}
        self._components: dict[int, list[tuple[ast.Component, Namespace]]] = {}
        self._types: dict[tuple[int, str], Class | None] = {}

    @property
    def text(self) -> str:
        return self.source.text

    @property
    def is_looked_at(self) -> bool:
        """Whether it is known what is wrong with the present text."""
        return self._front is not None

    # ------------------------------------------------------------ messages

    def look(self, reading: Reading) -> Front:
        """Say what is wrong with a text that was read, its names, types and units; changes nothing that is asked for."""
        return self._models.look(reading)

    def take_front(self, front: Front) -> None:
        """Take what was found, unless the text is another one by now."""
        if front.source is self.source:
            self._front = front
            self._typed |= {name: looked.flat for name, looked in front.models.items() if looked.flat}

    def front(self) -> Front:
        """Return what is wrong with the present text, and its models."""
        if self.reading is None:
            self.take(read(self.source))
        if self._front is None:
            assert self.reading is not None
            self.take_front(self.look(self.reading))
        assert self._front is not None
        return self._front

    def at_once(self) -> tuple[Diagnostic, ...]:
        """Return what is wrong with the text, its names, types and units."""
        return self.front().diagnostics

    def in_full(self) -> tuple[Diagnostic, ...]:
        """Return what the whole compiler says, of every model that can be run."""
        return self._models.assembled(self.front())

    # ------------------------------------------------------------ what names mean

    def namespace(self) -> Namespace | None:
        """Return what the names of the file mean, from the last tree."""
        if self.tree is None:
            return None
        if self._namespace is None:
            library = SourceLibrary(search_path(self.tree, (self.path.parent,)), Reporter())
            try:
                self._namespace = library.register(self.tree)
                self._namespace.resolve()
            except CompileError:
                return None
        return self._namespace

    def statements(self) -> Iterator[tuple[str, ast.Statement]]:
        """Yield the statements of the last tree, those in blocks too, with the names of their models."""
        pending = [("", item) for item in reversed(self.tree.items if self.tree else ())]
        while pending:
            model, at = pending.pop()
            yield model, at
            inner: tuple[ast.Statement, ...] = ()
            match at:
                case ast.Model():
                    model, inner = at.name, at.body
                case ast.For():
                    inner = at.body
                case ast.If():
                    inner = (*(s for branch in at.branches for s in branch.body), *at.otherwise)
            pending += [(model, one) for s in reversed(inner) for one in reversed(ast.single(s))]

    def regions(self) -> list[tuple[int, int, str]]:
        """Return where the text of each model begins and ends, half-written ones at the end of the file."""
        found = []
        ends = list(_END.finditer(self.text))
        for match in _MODEL.finditer(self.text):
            end = next((e.end() for e in ends if e.start() >= match.end() and e[1] == match[1]), None)
            found.append((match.start(), len(self.text) + 1 if end is None else end, match[1]))
        return found

    def model_at(self, offset: int) -> str:
        """Name the model whose text surrounds a place; "" where the statements stand in no model."""
        return region_of(self.regions(), offset)

    def class_of(self, name: str) -> Class | None:
        """Return a model of this file with what it inherits; "" for the bare statements."""
        if self.tree is None:
            return None
        if name not in self._classes:
            self._classes[name] = self._class_of(name)
        return self._classes[name]

    def _class_of(self, name: str) -> Class | None:
        namespace = self.namespace()
        if namespace is None or self.tree is None:
            return None
        for item in self.tree.items:
            if isinstance(item, ast.Model) and item.name == name:
                return class_of(item, namespace)
        if name:
            return None
        bare = tuple(i for i in self.tree.items if not isinstance(i, ast.Model | ast.Function | ast.Type))
        if not bare:
            return None
        span = bare[0].span
        return class_of(ast.Model(name="", name_span=span, body=bare, span=span), namespace)

    def members(self, cls: Class) -> Members:
        """Return what a model declares or inherits, by name."""
        if id(cls) not in self._members:
            self._members[id(cls)] = (cls, {d.name: (d, n) for d, n in reversed(list(declarations(cls)))})
        return self._members[id(cls)][1]

    def component_at(self, cls: Class, offset: int) -> tuple[ast.Component, Namespace] | None:
        """Return the component of a model whose declaration surrounds a place of this text."""
        if id(cls) not in self._components:
            mine = [
                (d, n)
                for d, n in self.members(cls).values()
                if isinstance(d, ast.Component) and d.span.file is self.source
            ]
            self._components[id(cls)] = sorted(mine, key=lambda found: found[0].span.start)
        mine = self._components[id(cls)]
        before = bisect_right(mine, offset, key=lambda found: found[0].span.start)
        return mine[before - 1] if before and offset < mine[before - 1][0].span.end else None

    def type_of(self, declaration: ast.Declaration, namespace: Namespace) -> Class | None:
        """Return the model that a component is of; None for what is not a component, and for unknown ones."""
        if not isinstance(declaration, ast.Component):
            return None
        key = (id(namespace), declaration.type)
        if key not in self._types:
            found = namespace.look_up(declaration.type, declaration.span)
            self._types[key] = None
            if found is not None and isinstance(found.definition, ast.Model):
                self._types[key] = class_of(found.definition, found.namespace)
        return self._types[key]

    def flat_of(self, name: str) -> FlatModel | None:
        """Return the last flat form of a model that there was."""
        return self._typed.get(name)


def region_of(regions: list[tuple[int, int, str]], offset: int) -> str:
    """Name the model whose region surrounds a place; "" where there is none."""
    before = [region for region in regions if region[0] < offset]
    return before[-1][2] if before and offset < before[-1][1] else ""


def class_of(model: ast.Model, namespace: Namespace) -> Class | None:
    """Return a model with what it inherits; None where that cannot be told."""
    try:
        return Classes(Reporter()).of(model, namespace)
    except CompileError:
        return None


def declarations(cls: Class) -> Iterator[tuple[ast.Declaration, Namespace]]:
    """Yield what a model declares or inherits, with the names that the declaration sees."""
    for stated in cls.declarations.values():
        if isinstance(stated.statement, ast.Declaration):
            yield stated.statement, stated.namespace
    for declaration in cls.conditional.values():
        yield declaration, cls.namespace
