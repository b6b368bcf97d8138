"""Names of symmetries and their generators as vector fields: what each does to coordinates and time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..formulas.combination import joined, sum_text, times

if TYPE_CHECKING:
    from .symmetries import Term, TermSpan

WORLD = {"spin": "rotation", "linear": "translation of the world", "angular": "rotation of the world"}


def generator_of(span: TermSpan, terms: Sequence[Term], coefficients: Sequence[str]) -> tuple[str, str]:
    """Return the name of a symmetry and its generator, with the gauge term where it has one.

    The signs are those of I = xi p - tau h - F.
    """
    fields: dict[str, list[tuple[str, str]]] = {}
    for term, coefficient in zip(terms, coefficients, strict=True):
        if term.kind in ("xi", "tau"):
            along = "d/dt" if term.kind == "tau" else f"d/d{_coordinate(span, term.index)}"
            size = negative(coefficient) if term.kind == "tau" and len(terms) > 1 else coefficient
            fields.setdefault(along, []).append((size, _bare(span, term)))
    parts = []
    for along, pieces in fields.items():
        factor = sum_text([c for c, _ in pieces], [t for _, t in pieces])
        sign = "-" if factor.startswith("-") and len(pieces) == 1 else "+"
        factor = factor.removeprefix("-") if sign == "-" else factor
        parts.append((sign, times(factor, along)))
    text = joined(parts)
    world = [(c, t) for c, t in zip(coefficients, terms, strict=True) if t.kind in WORLD]
    for coefficient, term in world:
        move = _move(span, term)
        one = move if coefficient == "1" else times(coefficient, f"({move})")
        text = joined([("+", text), ("+", one)]) if text else one
    gauge = [(c, t) for c, t in zip(coefficients, terms, strict=True) if t.kind in ("F", "moment")]
    if gauge:
        text += ", F = " + sum_text([negative(c) for c, _ in gauge], [span.text(t) for _, t in gauge])
    return _name(span, terms, coefficients), text


def _name(span: TermSpan, terms: Sequence[Term], coefficients: Sequence[str]) -> str:
    moves = [(t, c) for t, c in zip(terms, coefficients, strict=True) if t.kind in ("xi", "tau", *WORLD)]
    gauge = [t for t in terms if t.kind == "F"]
    clocks = [t for t, _ in moves if t.kind == "tau"]
    shifts = [t for t, _ in moves if t.kind == "xi"]
    if not moves:
        return "function of coordinates and time"
    if not shifts and len(clocks) == len(moves):
        return "translation in time" if all(t.time == 0 for t in clocks) else "change of the clock"
    if any(t.time == 2 for t in clocks):
        return "conformal transformation"
    if any(t.time == 1 for t in clocks):
        return "dilation"
    if not clocks and shifts and len(shifts) == len(moves):
        return _shift(span, moves, gauge)
    if len(moves) == 1 and not gauge and moves[0][0].kind in WORLD and not moves[0][0].time:
        return _move(span, moves[0][0])
    if any(t.kind == "linear" and t.time for t, _ in moves):
        return "boost of the world"
    if clocks:
        return "screw in time" if shifts else "transformation of the world and time"
    return "combined transformation"


def _shift(span: TermSpan, moves: Sequence[tuple[Term, str]], gauge: Sequence[Term]) -> str:
    shifts = [t for t, _ in moves]
    names = list(dict.fromkeys(_coordinate(span, t.index) for t in shifts))
    listed = ", ".join(names)
    if all(not t.of and t.time == 0 for t in shifts):
        other = {span.problem.states[k].name for t in gauge for k in t.of} - set(names)
        if other:
            return f"magnetic translation along {listed}"
        angles = all(_unit(span, t.index) == "rad" for t in shifts)
        turning = "[" in listed and angles
        return (
            f"rotation by {listed}"
            if angles and not turning
            else (f"rotation about the body's axis {listed}" if turning else f"translation along {listed}")
        )
    if all(not t.of and t.time <= 1 for t in shifts) and any(t.time == 1 for t in shifts):
        return f"boost along {listed}"
    if all(len(t.of) == 1 and t.time == 0 for t in shifts):
        entries = {(_coordinate(span, t.index), span.problem.states[t.of[0]].name): c for t, c in moves}
        if all(negative(entries.get((b, a), "?")) == c and a != b for (a, b), c in entries.items()):
            return f"rotation in {listed}"
        if all(entries.get((b, a)) == c and a != b for (a, b), c in entries.items()):
            return f"hyperbolic rotation in {listed}"
        return f"linear transformation of {listed}"
    if any(t.time for t in shifts):
        return f"moving transformation of {listed}"
    return f"affine transformation of {listed}"


def negative(text: str) -> str:
    """Return a product with the other sign."""
    return text[1:] if text.startswith("-") else f"-{text}"


def _bare(span: TermSpan, term: Term) -> str:
    names = [span.problem.states[k].name for k in term.of]
    clock = span.problem.time.name
    powers = [] if term.time == 0 else [clock if term.time == 1 else f"{clock}^{term.time}"]
    return "*".join([*powers, *names]) or "1"


def _move(span: TermSpan, term: Term) -> str:
    """Return what a momentum of the world moves, in words."""
    if term.kind == "spin":
        return f"rotation {span.problem.phase[term.index].doc.removeprefix('angular momentum ')}"
    what = "boost of the world" if term.time else WORLD[term.kind]
    return f"{what} {'about' if term.kind == 'angular' else 'along'} {_axis(span, term)}"


def _axis(span: TermSpan, term: Term) -> str:
    members = span.world[term.kind]
    axes = "xyz" if term.kind == "linear" or len(members) == 3 else "z"
    return axes[members.index(term.index)]


def _coordinate(span: TermSpan, index: int) -> str:
    """Return the coordinate that belongs to a momentum: its rate is named der(x), or der(R)[3]."""
    rate = span.problem.states[span.problem.nq + span.momenta.index(index)].name
    return rate.removeprefix("der(").replace(")", "", 1)


def _unit(span: TermSpan, index: int) -> str:
    unit = span.problem.states[span.problem.nq + span.momenta.index(index)].unit
    return "rad" if unit == "rad/s" else unit
