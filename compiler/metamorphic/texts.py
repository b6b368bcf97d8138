"""Twins of the text: the same statements elsewhere, so that reading, inheritance and what goes before what come in."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from msgspec.structs import replace

from mechc.lang import ast
from mechc.lang.diagnostics import CompileError, Reporter
from mechc.lang.parser import parse

from ..flat.flatten import flatten
from ..flat.model import FlatModel
from .rewriting import undrawn
from .twin import NotApplicable

Body = tuple[ast.Statement, ...]


def retold(model: FlatModel, change: Callable[[Body, ast.File], Body], others: bool = False) -> FlatModel:
    """Return the flat model of the text that a model stands in, with other statements of the model itself, or also of the
    ``others`` in its file."""
    source = model.origin.span.file
    try:
        tree = parse(source, Reporter())
    except CompileError:
        raise NotApplicable("its text is not at hand") from None
    own = next((m for m in tree.items if isinstance(m, ast.Model) and m.name == model.name), None)
    if own is None:
        outside = tuple(
            i for i in tree.items if isinstance(i, (ast.Import, ast.Model, ast.Function, ast.Type))
        )
        bare = tuple(i for i in tree.items if i not in outside)
        if not bare:
            raise NotApplicable("its text is not at hand")
        inner = tuple(_changed(i, None, others, tree, change) for i in outside)
        items: tuple[ast.Statement, ...] = (*inner, *change(bare, tree))
    else:
        items = tuple(_changed(m, own, others, tree, change) for m in tree.items)
    folder = Path(source.name).parent
    try:
        made = flatten(
            replace(tree, items=items),
            Reporter(),
            model=model.name if own is not None else None,
            structural=model.structural,
            search=(folder,),
        )
    except CompileError as error:
        first = next(d for d in error.diagnostics if d.code.startswith("E"))
        raise NotApplicable(f"said otherwise it is refused: {first.code}: {first.message}") from None
    return undrawn(made)


def _changed(
    item: ast.Statement,
    own: ast.Model | None,
    others: bool,
    tree: ast.File,
    change: Callable[[Body, ast.File], Body],
) -> ast.Statement:
    if not isinstance(item, ast.Model) or not (others or item is own):
        return item
    return replace(item, body=change(item.body, tree))
