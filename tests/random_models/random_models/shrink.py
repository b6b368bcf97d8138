"""Make a failing model small: leave out statements, put simpler expressions, as long as it fails in the same way."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from time import monotonic

from random_models.quantities import quantity
from random_models.tree import E, Model, S, Seq, Slot


def _without(model: Model, gone: set[int]) -> Model:
    """Return the model without the statements of these numbers, counted in the order of a walk."""
    count = -1

    def visit(s: S) -> S | None:
        nonlocal count
        count += 1
        if count in gone:
            _skip(s)
            return None
        parts: list[str | Slot | Seq] = []
        for p in s.parts:
            if isinstance(p, Seq):
                kept = [visit(i) for i in p.items]
                parts.append(Seq(tuple(k for k in kept if k is not None), p.style))
            else:
                parts.append(p)
        return replace(s, parts=tuple(parts))

    def _skip(s: S) -> None:
        nonlocal count
        for p in s.parts:
            if isinstance(p, Seq):
                for i in p.items:
                    count += 1
                    _skip(i)

    items = [visit(item) for item in model.items]
    return Model(tuple(i for i in items if i is not None))


def _simpler(e: E) -> Iterator[E]:
    """Yield what could stand for an expression: its parts of the same kind, numbers."""
    for o in e.operands:
        if o.dim == e.dim and o.shape == e.shape and o.type == e.type:
            yield o
    for inner in e.walk():
        if (
            inner is not e
            and inner not in e.operands
            and (inner.dim, inner.shape, inner.type) == (e.dim, e.shape, e.type)
        ):
            yield inner
    if e.type == "real" and not e.shape and e.kind not in ("number", "quantity"):
        yield quantity(1, e.dim)
    if e.kind == "quantity" and e.data not in (Fraction(1), None):
        yield quantity(1, e.dim)
        if e.data is not None:
            yield quantity(Fraction(f"{float(e.data):.1g}"), e.dim)


def _variants(e: E) -> Iterator[E]:
    """Yield the expression with one of its parts made simpler, the largest parts first."""
    yield from _simpler(e)
    operands = e.operands
    for i, o in enumerate(operands):
        for other in _variants(o):
            yield e.with_operands((*operands[:i], other, *operands[i + 1 :]))


def _with_slot(model: Model, number: int, e: E) -> Model:
    """Exchange the expression of one place, counted in the order of ``rebuilt``."""
    count = -1

    def change(old: E, place: str) -> E:
        nonlocal count
        count += 1
        return e if count == number else old

    return model.rebuilt(change)


def _slots(model: Model) -> list[E]:
    found: list[E] = []

    def look(e: E, place: str) -> E:
        found.append(e)
        return e

    model.rebuilt(look)
    return found


def shrunk(model: Model, fails: Callable[[Model], bool], seconds: float = 60) -> Model:
    """Return a smaller model that still fails; ``fails`` must hold for the model itself."""
    until = monotonic() + seconds
    while monotonic() < until:
        smaller = _fewer_statements(model, fails, until)
        smaller = _smaller_expressions(smaller, fails, until)
        if smaller.text() == model.text():
            return smaller
        model = smaller
    return model


def _fewer_statements(model: Model, fails: Callable[[Model], bool], until: float) -> Model:
    size = max(1, sum(1 for _ in model.statements()) // 2)
    while size and monotonic() < until:
        total = sum(1 for _ in model.statements())
        position = total
        while position > 0 and monotonic() < until:  # from the end: outputs go first
            position -= size
            candidate = _without(model, set(range(max(0, position), position + size)))
            if (
                candidate.items
                and candidate.items[-1].kind == "model"
                and candidate.text() != model.text()
                and fails(candidate)
            ):
                model = candidate
        size //= 2
    return model


def _smaller_expressions(model: Model, fails: Callable[[Model], bool], until: float) -> Model:
    number = 0
    while number < len(slots := _slots(model)) and monotonic() < until:
        for e in _variants(slots[number]):
            if len(str(e)) >= len(str(slots[number])) or monotonic() > until:
                continue
            candidate = _with_slot(model, number, e)
            if fails(candidate):
                model = candidate
                break
        else:
            number += 1
    return model
