"""Names of a file: its models, functions and types, and what its imports bring in."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path

from msgspec import Struct, field

from mechc.lang import ast
from mechc.lang.builtins import BUILTINS, CONSTANTS, PREDEFINED
from mechc.lang.diagnostics import Label, Reporter
from mechc.lang.source import Span
from mechc.lang.units import NAMED_TYPES, parse_unit
from mechc.suggest import closest

from .files import SHAPE, Definition, LibraryFile, find, importable, load


def key_of(definition: Definition) -> str:
    """Return under which word a namespace knows a definition."""
    shape = isinstance(definition, ast.Model) and definition.shape
    return f"{SHAPE}{definition.name}" if shape else definition.name


class FoundDefinition(Struct, frozen=True):
    """A definition together with the names that its own text sees."""

    definition: Definition
    namespace: Namespace


class SourceLibrary(Struct):
    """The files of one compilation, each loaded once."""

    folders: tuple[Path, ...]
    reporter: Reporter
    _namespaces: dict[Path, Namespace] = field(default_factory=dict)

    def namespace(self, path: Path) -> Namespace:
        key = path.resolve()
        found = self._namespaces.get(key)
        if found is None:
            file = load(path, self.reporter)
            if isinstance(file, LibraryFile):
                found = Namespace(file.imports, self, own=file)
            else:
                _check_loose(file.items, self.reporter)
                found = Namespace(file.items, self)
            self._namespaces[key] = found
        return found

    def register(self, file: ast.File) -> Namespace:
        """Return the namespace of a file that is parsed already."""
        _check_loose(file.items, self.reporter)
        namespace = Namespace(file.items, self)
        self._namespaces[Path(file.source.name).resolve()] = namespace
        return namespace


class Namespace:
    """What the names of models, functions and types mean in one file, or in one model inside it."""

    def __init__(
        self,
        items: tuple[ast.Statement, ...],
        library: SourceLibrary,
        parent: Namespace | None = None,
        own: Mapping[str, Definition] | None = None,
    ):
        self._library = library
        self._parent = parent
        self._imports = tuple(item for item in items if isinstance(item, ast.Import))
        defined: dict[str, Definition] = {}
        self._own = defined if own is None else own
        self._explicit: dict[str, FoundDefinition | Namespace] | None = None
        self._paths: dict[str, Namespace] = {}
        self._open: list[tuple[Namespace, ast.Import]] = []
        self._broken = False
        self._ambiguous: set[str] = set()
        for item in items:
            if isinstance(item, ast.Model | ast.Function | ast.Type):
                self._define(item, defined)

    def _define(self, item: Definition, defined: dict[str, Definition]) -> None:
        reporter = self._library.reporter
        first = defined.get(item.name) or defined.get(f"{SHAPE}{item.name}")
        if first is not None:
            reporter.error(
                "E0204",
                f"'{item.name}' is defined twice",
                item.name_span,
                caption="again here",
                labels=(Label(first.name_span, "first here"),),
            )
            return
        known = _predefined(item)
        if known:
            reporter.error(
                "E0211",
                f"'{item.name}' is the name of {known}",
                item.name_span,
                help="choose another name",
            )
        defined[key_of(item)] = item

    def inside(self, items: tuple[ast.Statement, ...]) -> Namespace:
        """Return the namespace of a model's body, which may import and define too."""
        if any(isinstance(item, ast.Import | ast.Function | ast.Type) for item in items):
            return Namespace(items, self._library, self)
        return self

    @property
    def models(self) -> tuple[ast.Model, ...]:
        """The models that this file defines itself, in order; shape models are apart."""
        return tuple(item for item in self._own.values() if isinstance(item, ast.Model) and not item.shape)

    def imported_models(self) -> Iterator[ast.Model]:
        """Yield the models that imports bring into reach by their names alone."""
        explicit = self._resolve_imports()
        for namespace, _ in self._open:
            yield from namespace.models
        for found in explicit.values():
            model = found.definition if isinstance(found, FoundDefinition) else None
            if isinstance(model, ast.Model) and not model.shape:
                yield model

    def _models_mentioning(self, words: Sequence[Collection[str]]) -> Iterator[ast.Model]:
        """Yield the models of this file that may use a word of each of these: those of the library whose text has them, all others."""
        own = self._own
        names = own.mentioning(words) if isinstance(own, LibraryFile) else iter(own)
        for name in names:
            if not name.startswith(SHAPE) and isinstance(item := own[name], ast.Model):
                yield item

    def models_in_reach(self, words: Sequence[Collection[str]]) -> Iterator[tuple[int, ast.Model, Namespace]]:
        """Yield the models that this text may use and that may use a word of each of ``words``, with what they see: its own (0), those
        imported by name (1), all others that imports bring (2)."""
        explicit = self._resolve_imports()
        yield from ((0, model, self) for model in self._models_mentioning(words))
        for found in explicit.values():
            if isinstance(found, FoundDefinition) and isinstance(found.definition, ast.Model):
                yield 1, found.definition, found.namespace
        for namespace, _ in self._open:
            yield from ((2, model, namespace) for model in namespace._models_mentioning(words))
        if self._parent is not None:
            yield from self._parent.models_in_reach(words)

    @property
    def broken(self) -> bool:
        """True where an import failed or two give one name, so that an unknown name may be no further mistake."""
        self._resolve_imports()
        return self._broken or (self._parent is not None and self._parent.broken)

    # ------------------------------------------------------------ looking up

    def look_up(self, name: str, span: Span) -> FoundDefinition | None:
        """Return what a dotted name means; None if nothing. Reports a name that two imports give."""
        first, _, rest = name.partition(".")
        found = self._first(first, span)
        if rest:
            if isinstance(found, Namespace):
                return found.exported(rest)
            self._resolve_imports()
            path, _, last = name.rpartition(".")
            namespace = self._paths.get(path)
            if namespace is not None:
                return namespace.exported(last)
            return self._parent.look_up(name, span) if self._parent else None
        if isinstance(found, FoundDefinition):
            return found
        return self._parent.look_up(name, span) if self._parent else None

    def look_up_shape(self, name: str, span: Span) -> FoundDefinition | None:
        """Return the shape model that a dotted name means; None if none."""
        path, dot, last = name.rpartition(".")
        return self.look_up(f"{path}{dot}{SHAPE}{last}", span)

    def shapes(self) -> Iterator[str]:
        """Yield the names of the shape models in reach."""
        yield from (name.removeprefix(SHAPE) for name in self._all_names() if name.startswith(SHAPE))

    def exported(self, name: str) -> FoundDefinition | None:
        """Return what a name of this file's own definitions means."""
        definition = self._own.get(name)
        return None if definition is None else FoundDefinition(definition, self)

    def _first(self, name: str, span: Span) -> FoundDefinition | Namespace | None:
        own = self._own.get(name)
        if own is not None:
            return FoundDefinition(own, self)
        explicit = self._resolve_imports()
        if name in explicit:
            return explicit[name]
        found: FoundDefinition | None = None
        by: ast.Import | None = None
        for namespace, statement in self._open:
            other = namespace.exported(name)
            if other is None or (found is not None and other.definition is found.definition):
                continue
            if found is not None and by is not None:
                self._broken = True  # what it means is open, and all that follows from either
                if name in self._ambiguous:
                    return None
                self._ambiguous.add(name)
                plain = name.removeprefix(SHAPE)
                self._library.reporter.error(
                    "E0208",
                    f"'{plain}' comes from two imports",
                    span,
                    caption="which one is meant?",
                    labels=(Label(by.span, "from here"), Label(statement.span, "and from here")),
                    help=f"import the one that is meant by name, as in 'import {by.path}.{{{plain}}};'; for both give one of the packages a "
                    f"name: 'import P = {statement.path};' and 'P.{plain}'",
                )
                return None
            found, by = other, statement
        return found

    def names(self) -> Iterator[str]:
        """Yield every name that means something here, for "did you mean"."""
        yield from (name for name in self._all_names() if not name.startswith(SHAPE))

    def _all_names(self) -> Iterator[str]:
        yield from self._own
        yield from self._resolve_imports()
        for namespace, _ in self._open:
            yield from namespace._own
        if self._parent is not None:
            yield from self._parent._all_names()

    # ------------------------------------------------------------ imports

    def resolve(self) -> None:
        """Follow the imports now, so that wrong ones are reported even if nothing uses them."""
        self._resolve_imports()

    def _resolve_imports(self) -> dict[str, FoundDefinition | Namespace]:
        if self._explicit is None:
            self._explicit = {}
            for statement in self._imports:
                self._resolve(statement, self._explicit)
        return self._explicit

    def _resolve(self, statement: ast.Import, explicit: dict[str, FoundDefinition | Namespace]) -> None:
        library = self._library
        path = find(statement.path, library.folders)
        names = statement.names
        if path is None and not names:
            parent, _, last = statement.path.rpartition(".")
            path = find(parent, library.folders) if parent else None
            names = (last,)
        if path is None:
            self._broken = True
            near = closest(statement.path, importable(library.folders))
            library.reporter.error(
                "E0205",
                f"there is no file for '{statement.path}'",
                statement.span,
                help=f"did you mean '{near}'?"
                if near
                else "the folders searched are the model's own, those of MECHPATH and the standard library",
            )
            return
        namespace = library.namespace(path)
        if names == ("*",):
            self._open.append((namespace, statement))
            return
        if not names:
            if statement.alias:
                explicit[statement.alias] = namespace
            else:
                self._paths[statement.path] = namespace
            return
        for name in names:
            found = {
                kind: one for kind in ("", SHAPE) if (one := namespace.exported(f"{kind}{name}")) is not None
            }
            if not found:
                self._broken = True
                near = closest(name, (own.removeprefix(SHAPE) for own in namespace._own))
                library.reporter.error(
                    "E0206",
                    f"'{path.name}' defines no '{name}'",
                    statement.span,
                    help=f"did you mean '{near}'?" if near else "",
                )
                continue
            for kind, one in found.items():
                explicit[f"{kind}{statement.alias or name}"] = one


_LOOSE = (
    ast.Dimensionless,
    ast.Independent,
    ast.Experiment,
    ast.Study,
    ast.Gravity,
    ast.Parameter,
    ast.Input,
    ast.Let,
    ast.Assert,
)
"""Statements that make no model of their own."""


def _check_loose(items: tuple[ast.Statement, ...], reporter: Reporter) -> None:
    """Report statements beside models that were meant for one of them: a file has no settings that all share."""
    models = [item for item in items if isinstance(item, ast.Model)]
    bare = [item for item in items if not isinstance(item, ast.Import | ast.Model | ast.Function | ast.Type)]
    if not models or not bare or not all(isinstance(item, _LOOSE) for item in bare):
        return
    near = next((m for m in models if m.span.start > bare[0].span.start), models[-1])
    reporter.error(
        "E0217",
        f"this stands outside of every model, and '{near.name}' does not see it",
        bare[0].span,
        labels=(Label(near.name_span, f"{near.name} is defined here"),),
        help=f"write it inside: 'model {near.name} {bare[0].span.text} ... end {near.name};'",
    )


def _predefined(item: Definition) -> str:
    """Say what the language itself means by a name, or nothing."""
    name = item.name
    if isinstance(item, ast.Type):
        named = NAMED_TYPES.get(name)
        same = named is not None and named.dimension == parse_unit(item.unit).dimension
        return "" if same or (named is None and name != "Rotation") else "a type of the language"
    if isinstance(item, ast.Function) and name in BUILTINS:
        return f"a function of the language: {BUILTINS[name].doc}"
    if name in CONSTANTS or name in PREDEFINED:
        return "something that every model has"
    return ""
