"""A file of parts: models that stand alone in no motion, each looked at as far as it can be told without what uses it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from msgspec import Struct

from mechc.lang import ast
from mechc.lang.diagnostics import CompileError, Diagnostic, Reporter
from mechc.lang.parser import parse
from mechc.lang.source import SourceFile

from .flat.flatten import flatten
from .flat.model import DefinitionRole, FlatModel, Role
from .interpreter import compiling

_SPACES = (0, 2, 3)
"""Dimensions in which a part is looked at: its own, the plane, space."""
_UNTOLD, _VALUE_MISSING = "E0307", "E0411"
"""Nothing tells the dimension; a structural parameter has no value."""


class CodePart(Struct, frozen=True):
    """A model of the file, and what is wrong with it. ``free``: its frames that something else has to place."""

    name: str
    free: tuple[str, ...]
    diagnostics: tuple[Diagnostic, ...]
    wrong: bool


class Parts(Struct, frozen=True):
    """What a file without a whole model holds. ``completed``: partial models, functions, and models that leave the value
    of a structural parameter or the type of an input to what uses them; they are checked there."""

    parts: tuple[CodePart, ...]
    completed: tuple[str, ...]


def parts_of(source: SourceFile, search: tuple[Path, ...]) -> Parts | None:
    """Look at the models of a file one by one, or return None: its last model is a whole one, or it does not read."""
    with compiling():
        try:
            tree = parse(source, Reporter())
        except CompileError:
            return None
        models = [item for item in tree.items if isinstance(item, ast.Model)]
        named = (ast.Model, ast.Function, ast.Type, ast.Import)
        if any(not isinstance(item, named) for item in tree.items):
            return None
        whole = [m for m in models if not m.partial]
        completed = tuple(m.name for m in models if m.partial)
        completed += tuple(item.name for item in tree.items if isinstance(item, ast.Function))
        if not whole:
            return Parts((), completed) if completed else None
        last = next((m for m in reversed(whole) if not m.shape), whole[-1])
        part, flat = looked_at(tree, last.name, search)
        if not is_part(last, part, flat, tree):
            return None
        found = [(m, looked_at(tree, m.name, search)[0]) for m in whole]
        left = tuple(m.name for m, part in found if _left_open(m, part))
        return Parts(tuple(part for _, part in found if part.name not in left), left + completed)


def _left_open(model: ast.Model, part: CodePart) -> bool:
    """Whether a model lacks nothing but values of structural parameters of its own, or the types of its inputs."""
    if any(isinstance(s, ast.Input) and not s.type and s.value is None for s in model.body):
        return True
    own = [
        s.name_span for s in model.body if isinstance(s, ast.Parameter) and s.structural and s.value is None
    ]
    return part.wrong and all(d.code == _VALUE_MISSING and d.span in own for d in part.diagnostics)


def is_part(model: ast.Model, part: CodePart, flat: FlatModel | None, tree: ast.File) -> bool:
    """Whether nothing but other models can use it: it states no run, and lacks what places it or what moves in it, be it
    that another model of the file, of which it is a component, joins one of its bodies to the world."""
    if any(isinstance(s, ast.Experiment) for s in model.body):
        return False
    if model.shape or any(isinstance(s, ast.Shape) and s.on is None for s in model.body):
        return True
    if flat is None:
        free = [s for s in model.body if isinstance(s, (ast.Frame, ast.Input)) and s.value is None]
        return any(isinstance(s, ast.Frame) or not s.type for s in free)
    if any(isinstance(s, ast.Input) and s.name == "from" for s in model.body):  # what ``A -> B`` binds
        return True
    moving = {Role.COORDINATE, Role.STATE}
    still = not any(v.role in moving for v in flat.variables)
    if part.free or (still and any(v.role is Role.INPUT for v in flat.variables)):
        return True
    return _hangs_nowhere(flat) and _is_component(model.name, tree)


def _hangs_nowhere(flat: FlatModel) -> bool:
    """Whether a model has bodies, none of which a joint leads to from the world."""
    return bool(flat.joints and flat.masses) and all(
        joint.source not in ("", "world") for joint in flat.joints
    )


def _is_component(name: str, tree: ast.File) -> bool:
    """Whether another model of the file has a component of this one."""
    models = (m for m in tree.items if isinstance(m, ast.Model) and m.name != name)
    return any(isinstance(s, ast.Component) and s.type == name for m in models for s in m.body)


def looked_at(
    tree: ast.File, name: str | None, search: tuple[Path, ...]
) -> tuple[CodePart, FlatModel | None]:
    """Flatten one model of a file; one that nothing tells to be planar or spatial is right if it is in one of both."""
    found: list[tuple[CodePart, FlatModel | None]] = []
    for space in _SPACES:
        reporter = Reporter()
        flat = None
        try:
            flat = flatten(tree, reporter, model=name, search=search, space=space)
        except CompileError as error:
            diagnostics: Mapping[Diagnostic, None] = dict.fromkeys(
                (*reporter.diagnostics, *error.diagnostics)
            )
            found.append((CodePart(name or "", (), tuple(diagnostics), True), None))
            if space == 0 and not any(d.code == _UNTOLD for d in diagnostics):
                break
            continue
        return CodePart(name or "", tuple(_free(flat)), reporter.diagnostics, False), flat
    return min(found, key=lambda f: (any(d.code == _UNTOLD for d in f[0].diagnostics), len(f[0].diagnostics)))


def _free(flat: FlatModel) -> Iterator[str]:
    """Give the frames of a model itself that no joint in it places."""
    placed = {joint.target for joint in flat.joints}
    for definition in flat.definitions:
        own = definition.role is DefinitionRole.FRAME and "." not in definition.name
        if own and definition.value is None and definition.name not in placed:
            yield definition.name
