"""The equations of motion of a model as text, LaTeX and HTML."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from math import pi

import sympy as sp

from ..equations.constraints import rows_of
from ..equations.energies import energies
from ..equations.residual import residual
from ..equations.solve import prescribed_motion
from ..graph import Node
from ..graph.rewrite import substitute
from ..mechanics.system import MechanicalSystem
from .express import express
from .mathml import mathml
from .names import latex_name, symbols_of
from .trigonometry import shorten

SIMPLIFY_LIMIT = 2000
"""Expressions with more operations than this are shown as the compiler formed them."""

LARGEST_FRACTION = 16
"""Fractions with larger denominators are written as decimals where these end."""

LARGEST_SHARE = 720
"""Numbers are recognised as shares of pi with denominators up to this; other long fractions become decimals."""

EPSILON = 2.0**-52

SHOW_LIMIT = 20_000
"""Expressions with more operations than this are not shown; their size is stated instead."""


@dataclass(frozen=True, slots=True)
class Statement:
    """``left = right``; ``right`` None where the expression is too large to be shown (``operations``)."""

    left: str
    right: sp.Expr | None
    operations: int


@dataclass(frozen=True, slots=True)
class Account:
    """What is written about a model: ``equations`` are residuals that vanish, one for each free velocity."""

    name: str
    doc: str
    lagrangian: Statement
    dissipation: Statement | None
    equations: tuple[Statement, ...]
    constraints: tuple[Statement, ...]
    momenta: tuple[Statement, ...]
    cyclic: tuple[str, ...]


def write_equations(system: MechanicalSystem, layout: str) -> str:
    """Return the equations of a system; ``layout`` is text, latex or html."""
    match layout:
        case "text":
            return _text(account_of(system, latex=False))
        case "latex":
            return _latex(account_of(system, latex=True))
        case "html":
            return _html(account_of(system, latex=True))
        case _:
            raise ValueError(layout)


def account_of(system: MechanicalSystem, *, latex: bool) -> Account:
    """Return what there is to write, with symbols named for text or for LaTeX."""
    graph = system.graph
    symbols = symbols_of(system, latex)
    driven, prescribed = prescribed_motion(system)
    still = {n: graph.zero for moved in system.virtual.values() for n in moved.values}
    replace = {**driven, **still}
    free = [i for i in range(len(system.v)) if i not in prescribed]
    multipliers, titles = _multipliers(system, symbols, latex)
    rows = residual(system, multipliers)
    r = substitute(graph, [rows[i] for i in free], replace) if replace else [rows[i] for i in free]
    energy = energies(system, replace, free, graph.zero, graph.zero)
    lagrangian = graph.add(graph.sub(energy.kinetic, energy.potential), _extra(system, replace))

    def write(left: str, node: Node) -> Statement:
        (expression,) = express(graph, [node], symbols)
        operations = graph.count_operations([node])
        shown = decimals(_tidy(expression, symbols, system)) if operations <= SHOW_LIMIT else None
        return Statement(left, shown, operations)

    constraints = []
    for row, title in zip(rows_of(system, multipliers, replace), titles, strict=True):
        constraints.append(write(title, row.rate if row.position is None else row.position))
    momenta = []
    for i in free:
        name = system.v[i].name.removeprefix("der(").removesuffix(")")
        left = rf"p_{{{latex_name(name)}}}" if latex else f"p[{name}]"
        momentum = energy.momenta[i]
        assert momentum is not None, "free velocities have momenta"
        momenta.append(write(left, momentum))
    cyclic = tuple(system.v[i].name.removeprefix("der(").removesuffix(")") for i in energy.cyclic)
    has_dissipation = not graph.is_constant(system.dissipation)
    return Account(
        system.model.name,
        system.model.doc,
        write("L", lagrangian),
        write("R", system.dissipation) if has_dissipation else None,
        tuple(write("0", n) for n in r),
        tuple(constraints),
        tuple(momenta),
        cyclic,
    )


def _extra(system: MechanicalSystem, replace: dict[Node, Node]) -> Node:
    return substitute(system.graph, [system.lagrangian], replace)[0] if replace else system.lagrangian


def _multipliers(
    system: MechanicalSystem, symbols: dict[Node, sp.Symbol], latex: bool
) -> tuple[list[tuple[Node, ...]], list[str]]:
    """Return a symbol for the multiplier of each constraint row, and the title of each row."""
    multipliers, titles = [], []
    for n, constraint in enumerate(system.constraints):
        nodes = []
        for k in range(len(constraint.residuals)):
            node = system.graph.symbol(f"#shown {n}.{k}")
            title = constraint.name if len(constraint.residuals) == 1 else f"{constraint.name}[{k + 1}]"
            name = rf"\lambda_{{{latex_name(title)}}}" if latex else f"lambda[{title}]"
            symbols[node] = sp.Symbol(name)
            nodes.append(node)
            titles.append(title)
        multipliers.append(tuple(nodes))
    return multipliers, titles


def _tidy(expression: sp.Expr, symbols: dict[Node, sp.Symbol], system: MechanicalSystem) -> sp.Expr:
    """Simplify small expressions and order them by accelerations."""
    if sp.count_ops(expression) > SIMPLIFY_LIMIT:
        return expression
    simple = shorten(sp.nsimplify(expression, rational=True))
    accelerations = [symbols[a] for a in system.a if a in symbols]
    present = [a for a in accelerations if simple.has(a)]
    if not present:
        return simple
    return sp.collect(simple, present, sp.factor_terms)


def decimals(expression: sp.Expr) -> sp.Expr:
    """Write fractions such as 981/200 as the decimal that a reader expects, angles as shares of pi."""
    exchange: dict[sp.Rational, sp.Expr] = {}
    for number in expression.atoms(sp.Rational):
        size = float(abs(number))
        turns = Fraction(size / pi).limit_denominator(LARGEST_SHARE)
        if number.q <= LARGEST_FRACTION:
            continue
        if number.q > LARGEST_SHARE and turns and abs(float(turns) * pi - size) <= 4 * EPSILON * size:
            shown = sp.pi * sp.Rational(turns.numerator, turns.denominator)
        elif set(sp.factorint(number.q, limit=7)) <= {2, 5} or number.q > LARGEST_SHARE:
            shown = sp.Symbol(f"{size:.12g}", positive=True)
        else:
            continue
        exchange[number] = -shown if number < 0 else shown
    return expression.xreplace(exchange)


# ---------------------------------------------------------------- layouts


def _sized(statement: Statement, printer: Callable[[sp.Expr], str]) -> str:
    if statement.right is None:
        return f"... {statement.operations} operations, too long to be shown"
    return printer(statement.right)


def _text(account: Account) -> str:
    lines = [f"{account.name}: {account.doc}" if account.doc else account.name, ""]

    def section(title: str, statements: tuple[Statement, ...]) -> None:
        if statements:
            lines.append(title)
            lines.extend(f"  {s.left} = {_sized(s, sp.sstr)}" for s in statements)
            lines.append("")

    section("Lagrangian", (account.lagrangian,))
    if account.dissipation is not None:
        section("dissipation function", (account.dissipation,))
    section("equations of motion", account.equations)
    section("constraints (each expression vanishes)", account.constraints)
    section("momenta", account.momenta)
    lines.append(f"cyclic coordinates: {', '.join(account.cyclic) if account.cyclic else 'none'}")
    return "\n".join(lines)


def _latex(account: Account) -> str:
    lines = [rf"\section*{{{account.name}}}"]
    if account.doc:
        lines.append(account.doc)

    def section(title: str, statements: tuple[Statement, ...]) -> None:
        if statements:
            lines.append(rf"\subsection*{{{title}}}")
            for s in statements:
                body = rf"\text{{{_sized(s, sp.latex)}}}" if s.right is None else sp.latex(s.right)
                left = s.left if s.left in ("L", "R", "0") or "_" in s.left else rf"\text{{{s.left}:}}\quad 0"
                lines.append(rf"\[ {left} = {body} \]")

    section("Lagrangian", (account.lagrangian,))
    if account.dissipation is not None:
        section("Dissipation function", (account.dissipation,))
    section("Equations of motion", account.equations)
    section("Constraints", account.constraints)
    section("Momenta", account.momenta)
    names = ", ".join(f"${latex_name(n)}$" for n in account.cyclic) or "none"
    lines.append(f"Cyclic coordinates: {names}.")
    return "\n".join(lines)


def _html(account: Account) -> str:
    from html import escape

    parts = [
        "<!DOCTYPE html>",
        f'<html lang="en"><head><meta charset="utf-8"><title>{escape(account.name)}</title>',
        "<style>body{font-family:Georgia,serif;max-width:60em;margin:3em auto;padding:0 1em;color:#222}"
        "h1{font-weight:normal}h2{font-weight:normal;color:#555;border-bottom:1px solid #ddd}"
        "math{font-size:1.15em}.row{margin:1em 0 1em 3em;text-indent:-3em;line-height:2.6}</style></head><body>",
        f"<h1>{escape(account.name)}</h1>",
    ]
    if account.doc:
        parts.append(f"<p>{escape(account.doc)}</p>")

    def section(title: str, statements: tuple[Statement, ...]) -> None:
        if not statements:
            return
        parts.append(f"<h2>{title}</h2>")
        for s in statements:
            if s.right is None:
                parts.append(f'<div class="row">{escape(s.left)}: {_sized(s, str)}</div>')
            else:
                parts.append(f'<div class="row">{mathml(s.left, s.right)}</div>')

    section("Lagrangian", (account.lagrangian,))
    if account.dissipation is not None:
        section("Dissipation function", (account.dissipation,))
    section("Equations of motion", account.equations)
    section("Constraints", account.constraints)
    section("Momenta", account.momenta)
    parts.append(f"<p>Cyclic coordinates: {escape(', '.join(account.cyclic) or 'none')}.</p></body></html>")
    return "\n".join(parts)
