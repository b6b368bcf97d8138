"""A text that is being written: what it says now, and what the last version of it that could be read said.

Names are looked up in the last tree that could be parsed, by what stands in the present text: so half-written
text gets answers, too. Nothing here raises for a wrong text.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path

from ..compiler.equations.assemble import assemble
from ..compiler.flat.model import FlatModel
from ..compiler.flat.names.classes import Class, Classes
from ..compiler.flat.names.files import search_path
from ..compiler.flat.names.namespace import Library, Namespace
from ..compiler.mechanics.build import build
from ..compiler.parts import is_part, looked_at
from ..compiler.recursion import deep_recursion
from ..compiler.uncollected import uncollected
from ..lang import ast
from ..lang.diagnostics import CompileError, Diagnostic, Reporter
from ..lang.parser import parse
from ..lang.source import SourceFile

Members = Mapping[str, tuple[ast.Declaration, Namespace]]
"""Declarations by name, with the names that each sees."""

_MODEL = re.compile(r"^[ \t]*(?:partial[ \t]+)?model[ \t]+(\w+)", re.MULTILINE)
_END = re.compile(r"^[ \t]*end[ \t]+(\w+)[ \t]*;", re.MULTILINE)


class Document:
    """One open file. ``tree`` is that of the last text that could be parsed, None before there was one."""

    def __init__(self, path: Path, text: str) -> None:
        self.path = path
        self.tree: ast.File | None = None
        self._flat: dict[str, FlatModel] = {}  # of the present text
        self._typed: dict[str, FlatModel] = {}  # the last ones that there were
        self._parts: set[str] = set()  # models that others use
        self.change(text)

    def change(self, text: str) -> None:
        """Take a new text."""
        self.source = SourceFile(str(self.path), text.replace("\r\n", "\n").replace("\r", "\n"))
        self._front: tuple[Diagnostic, ...] | None = None
        reporter = Reporter()
        try:
            with uncollected():
                self.tree = parse(self.source, reporter)
            self.broken = False
        except CompileError:
            self.broken = True
        self._syntax = reporter.diagnostics
        if not self.broken:
            self._library = (
                Library(search_path(self.tree, (self.path.parent,)), Reporter()) if self.tree else None
            )
            self._namespace: Namespace | None = None
            self._classes: dict[str, Class | None] = {}
            self._members: dict[int, tuple[Class, Members]] = {}
            self._components: dict[int, list[tuple[ast.Component, Namespace]]] = {}
            self._types: dict[tuple[int, str], Class | None] = {}

    @property
    def text(self) -> str:
        return self.source.text

    # ------------------------------------------------------------ messages

    def at_once(self) -> tuple[Diagnostic, ...]:
        """Return what is wrong with the text, its names, types and units."""
        if self.broken:
            return self._syntax
        if self._front is None:
            found = dict.fromkeys(self._syntax)
            for name in self.models():
                found.update(dict.fromkeys(self._flattened(name)))
            self._front = tuple(found)
        return self._front

    def in_full(self) -> tuple[Diagnostic, ...]:
        """Return what the whole compiler says, of every model that can be run."""
        found = dict.fromkeys(self.at_once())
        if self.broken or self.tree is None:
            return tuple(found)
        for name in self.models():
            flat = self._flat.get(name or "")
            if flat is None or name in self._parts:
                continue
            reporter = Reporter()
            with suppress(CompileError, RecursionError), deep_recursion():
                assemble(build(flat, reporter), reporter, ())
            found.update(dict.fromkeys(reporter.diagnostics))
        return tuple(found)

    def models(self) -> list[str | None]:
        """Name the models that can be run; None stands for the bare statements of a file."""
        if self.tree is None:
            return []
        items = self.tree.items
        named: list[str | None] = [m.name for m in items if isinstance(m, ast.Model) and not m.partial]
        bare = any(not isinstance(i, ast.Import | ast.Model | ast.Function | ast.Type) for i in items)
        return [*named, *([None] if bare and not named else [])]

    def _flattened(self, name: str | None) -> tuple[Diagnostic, ...]:
        assert self.tree is not None
        self._flat.pop(name or "", None)
        self._parts.discard(name or "")
        with suppress(RecursionError):
            part, flat = looked_at(self.tree, name, (self.path.parent,))
            if any(
                is_part(m, part, flat) for m in self.tree.items if isinstance(m, ast.Model) and m.name == name
            ):
                self._parts.add(name or "")
            if flat is not None:
                self._flat[name or ""] = self._typed[name or ""] = flat
            return part.diagnostics
        return ()

    # ------------------------------------------------------------ what names mean

    def namespace(self) -> Namespace | None:
        """Return what the names of the file mean, from the last tree."""
        if self.tree is None:
            return None
        if self._namespace is None:
            library = Library(search_path(self.tree, (self.path.parent,)), Reporter())
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
            pending += [(model, s) for s in reversed(inner)]

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
        before = [region for region in self.regions() if region[0] < offset]
        return before[-1][2] if before and offset < before[-1][1] else ""

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
        """Return the model that a component is of; None for what is no component, and for unknown ones."""
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
