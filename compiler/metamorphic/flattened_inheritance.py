"""Inheritance written out: what a model has from those that it extends stands in the model itself."""

from __future__ import annotations

from random import Random

from msgspec.structs import replace

from mechc.lang import ast

from ..flat.model import FlatModel
from .texts import Body, retold
from .twin import NotApplicable, Seen, Twin


def inheritance_expanded(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """Put the statements of each base of the same file instead of `extends`, with what the heir says of them."""
    done = 0

    def change(body: Body, file: ast.File) -> Body:
        nonlocal done
        bases = {m.name: m for m in file.items if isinstance(m, ast.Model)}
        while True:
            heir = next((s for s in body if isinstance(s, ast.Extends) and s.base in bases), None)
            if heir is None:
                return body
            base = bases[heir.base].body
            body = _joined(base, heir, tuple(s for s in body if s is not heir))
            done += 1

    made = retold(model, change)
    if not done:
        raise NotApplicable("it extends no model of its own file")
    return Twin("inheritance expanded", f"{done} 'extends' written out", made)


def _joined(base: Body, heir: ast.Extends, own: Body) -> Body:
    """Return the statements of a base as the heir changes them, then its own."""
    if any(isinstance(s, (ast.Import, ast.Function, ast.Type)) for s in base):
        raise NotApplicable(f"'{heir.base}' has names of its own")
    for said in heir.modifications:
        base = _said(base, said, heir.base)
    if any(isinstance(s, ast.Gravity) for s in own):
        base = tuple(s for s in base if not isinstance(s, ast.Gravity))
    runs = {s.name for s in own if isinstance(s, (ast.Experiment, ast.Study))}
    base = tuple(s for s in base if not (isinstance(s, (ast.Experiment, ast.Study)) and s.name in runs))
    stated = [s.target for s in own if isinstance(s, ast.Initial)]
    base = tuple(s for s in base if not (isinstance(s, ast.Initial) and s.target in stated))
    once = [s for s in base if s not in own or not isinstance(s, ast.Declaration)]
    return (*once, *own)


def _said(base: Body, said: ast.Modification, name: str) -> Body:
    """Put one modification where it belongs: into the declaration, or into that of the component that has it."""
    target = said.target.operand if isinstance(said.target, ast.Derivative) else said.target
    if not isinstance(target, ast.Reference) or any(p.indices for p in target.parts):
        raise NotApplicable(f"what 'extends {name}' changes cannot be written inside")
    head, *rest = target.parts
    place = next(
        (k for k, s in enumerate(base) if isinstance(s, ast.Declaration) and s.name == head.name), None
    )
    if place is None:
        raise NotApplicable(f"'{head.name}' of '{name}' is declared elsewhere")
    there = base[place]
    if rest and isinstance(there, ast.Component):
        inner: ast.Expression = replace(target, parts=tuple(rest))
        if isinstance(said.target, ast.Derivative):
            inner = replace(said.target, operand=inner)
        kept = tuple(m for m in there.modifications if m.target != inner)
        changed: ast.Statement = replace(there, modifications=(*kept, replace(said, target=inner)))
        base = tuple(s for s in base if not (isinstance(s, ast.Initial) and s.target == said.target))
        return tuple(changed if s is there else s for s in base)
    start = ast.Start(span=said.span, value=said.value, guess=said.kind == "~")
    if rest:
        raise NotApplicable(f"'{head.name}' of '{name}' is not a component")
    if isinstance(said.target, ast.Derivative) or any(
        isinstance(s, ast.Initial) and s.target == said.target for s in base
    ):
        base = tuple(s for s in base if not (isinstance(s, ast.Initial) and s.target == said.target))
        return (*base, ast.Initial(span=said.span, target=said.target, start=start))
    match there:
        case ast.Coordinate() | ast.State():
            changed = replace(there, start=start)
        case ast.Parameter() | ast.Input() | ast.Discrete():
            changed = replace(there, value=said.value)
        case _:
            raise NotApplicable(f"what 'extends {name}' changes cannot be written inside")
    return tuple(changed if s is there else s for s in base)
