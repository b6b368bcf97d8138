"""Initial values stated elsewhere: in declarations, in `initial`, in the parentheses of components."""

from __future__ import annotations

from random import Random

from msgspec.structs import replace

from mechc.lang import ast
from mechc.lang.printing.printer import print_expression

from ..flat.model import FlatModel
from .texts import Body, retold
from .twin import NotApplicable, Seen, Twin


def starts_elsewhere(model: FlatModel, seen: Seen | None, random: Random) -> Twin:
    """State each initial value that stands in the file where it does not stand now."""
    moved = 0

    def change(body: Body, file: ast.File) -> Body:
        nonlocal moved
        declared = {s.name: s for s in body if isinstance(s, (ast.Coordinate, ast.State, ast.Component))}
        said = {_key(s.target): s for s in body if isinstance(s, ast.Initial)}
        added: list[ast.Statement] = []
        found: list[ast.Statement] = []
        for s in body:
            match s:
                case ast.Coordinate() | ast.State() if s.name in said:  # what `initial` says goes before
                    found.append(replace(s, start=said[s.name].start))
                    moved += 1
                case ast.Coordinate() | ast.State() if s.start is not None and s.type:
                    if any(k.startswith(f"{s.name}[") for k in said):
                        found.append(s)
                        continue
                    found.append(replace(s, start=None))
                    added.append(ast.Initial(span=s.span, target=_reference(s), start=s.start))
                    moved += 1
                case ast.Component():
                    inner = {
                        k: i for k, i in said.items() if _component(i.target) == s.name and not s.dimensions
                    }
                    there = {_key(m.target) for m in s.modifications}
                    given = [_inside(i) for i in inner.values() if _key(_inside(i).target) not in there]
                    moved += len(given)
                    found.append(replace(s, modifications=(*s.modifications, *given)))
                case ast.Initial():
                    name = _key(s.target)
                    if isinstance(declared.get(name), (ast.Coordinate, ast.State)):
                        continue
                    part = declared.get(_component(s.target))
                    if isinstance(part, ast.Component) and not part.dimensions:
                        there = {_key(m.target) for m in part.modifications}
                        if _key(_inside(s).target) not in there:
                            continue
                    found.append(s)
                case _:
                    found.append(s)
        return (*found, *added)

    made = retold(model, change, others=True)
    if not moved:
        raise NotApplicable("its file states no initial values")
    return Twin("starts elsewhere", f"{moved} initial values stated elsewhere", made)


def _key(target: ast.Expression) -> str:
    """Return what tells a target: its text."""
    return print_expression(target)


def _reference(s: ast.Declaration) -> ast.Reference:
    return ast.Reference(span=s.name_span, parts=(ast.Part(span=s.name_span, name=s.name),))


def _component(target: ast.Expression) -> str:
    """Return the component, of this model, whose own coordinate a target is; "" for others."""
    inner = target.operand if isinstance(target, ast.Derivative) else target
    if isinstance(inner, ast.Reference) and len(inner.parts) == 2 and not inner.parts[0].indices:
        return inner.parts[0].name
    return ""


def _inside(s: ast.Initial) -> ast.Modification:
    """Return an initial value as it stands in the parentheses of its component."""
    inner = s.target.operand if isinstance(s.target, ast.Derivative) else s.target
    assert isinstance(inner, ast.Reference)
    own: ast.Expression = replace(inner, parts=inner.parts[1:])
    if isinstance(s.target, ast.Derivative):
        own = replace(s.target, operand=own)
    return ast.Modification(span=s.span, target=own, kind="~" if s.start.guess else "=", value=s.start.value)
