"""The equations of a model as text, LaTeX and HTML."""

from __future__ import annotations

import re
from collections.abc import Callable
from html import escape

import sympy as sp

from ..mechanics.system import MechanicalSystem
from .curves import curve_account
from .equations import EquationLine, EquationList, account_of
from .mathml import mathml
from .names import latex_name

HEAD = (
    "<style>body{font-family:Georgia,serif;max-width:60em;margin:3em auto;padding:0 1em;color:#222}"
    "h1{font-weight:normal}h2{font-weight:normal;color:#555;border-bottom:1px solid #ddd}"
    "math{font-size:1.15em}.row{margin:1em 0 1em 3em;text-indent:-3em;line-height:2.6}</style>"
)

STYLE = (
    "<style>.mechc-equations{overflow-x:auto}.mechc-equations h4{font-weight:normal;margin:1em 0 0}"
    ".mechc-equations .row{margin:.5em 0 .5em 3em;text-indent:-2em;line-height:2.4}</style>"
)

_LATEX = str.maketrans(
    {sign: rf"\{sign}" for sign in "#$%&_{}"}
    | {"\\": r"\textbackslash{}", "^": r"\textasciicircum{}", "~": r"\textasciitilde{}"}
)

LINE = 90
"""Signs in a line of LaTeX, about."""

_SIGNS = re.compile(r"\\(?:left|right|,| )|\\[A-Za-z]+|[{}_^]")
"""What one sign takes in LaTeX, or none."""


def write_equations(system: MechanicalSystem, layout: str) -> str:
    """Return the equations of a system; ``layout`` is text, latex or html."""
    match layout:
        case "text":
            return _text(_account(system, latex=False))
        case "latex":
            return _latex(_account(system, latex=True))
        case "html":
            return _html(_account(system, latex=True))
        case _:
            raise ValueError(layout)


def _account(system: MechanicalSystem, *, latex: bool) -> EquationList:
    if system.curve is not None:
        return curve_account(system, system.curve, latex=latex)
    return account_of(system, latex=latex)


def _sized(statement: EquationLine, printer: Callable[[sp.Expr], str]) -> str:
    if statement.right is None:
        return f"... {statement.operations} operations, too long to be shown"
    return printer(statement.right)


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def _not_written(account: EquationList) -> str:
    """Say what else happens, or that nothing does; empty if all is written."""
    if not account.events:
        return "" if account.sections() else "nothing moves: there are no equations of motion"
    branches = "one branch" if account.events == 1 else f"{account.events} branches"
    return f"this holds between events: {branches} of 'when' not written here"


def _text(account: EquationList) -> str:
    lines = [f"{account.name}: {account.doc}" if account.doc else account.name, ""]
    for section in account.sections():
        title = section.title if section.title == "Lagrangian" else section.title.lower()
        lines.append(title + (f" ({section.meaning})" if section.meaning else ""))
        lines.extend(f"  {s.left} = {_sized(s, _plain)}" for s in section.statements)
        lines.append("")
    if account.equations:
        lines.append(f"cyclic coordinates: {', '.join(account.cyclic) or 'none'}")
    if events := _not_written(account):
        lines.append(events)
    return "\n".join(lines)


def _plain(expression: sp.Expr) -> str:
    """Write a formula with the signs of the language, so that it can be copied into a model."""
    return str(sp.sstr(expression)).replace("**", "^")


def _escaped(text: str) -> str:
    return text.translate(_LATEX)


def _latex(account: EquationList) -> str:
    lines = [rf"\section*{{{_escaped(account.name)}}}"]
    if account.doc:
        lines.append(_escaped(account.doc))
    for section in account.sections():
        lines.append(rf"\subsection*{{{section.title}}}")
        if section.meaning:
            lines.append(_sentence(section.meaning))
        for s in section.statements:
            body = rf"\text{{{_sized(s, sp.latex)}}}" if s.right is None else latex_lines(s.right)
            left = rf"\text{{{_escaped(s.left)}}}" if section.meaning else s.left
            lines.append(rf"\[ {left} = {body} \]")
    if account.equations:
        names = ", ".join(f"${latex_name(n)}$" for n in account.cyclic) or "none"
        lines.append(f"Cyclic coordinates: {names}.")
    if events := _not_written(account):
        lines.append(_sentence(events))
    return "\n".join(lines)


def latex_lines(expression: sp.Expr) -> str:
    """Return a formula in LaTeX, a long sum in several lines."""
    lines = [""]
    size = 0
    for term in expression.as_ordered_terms():
        text = sp.latex(term)
        shown = len(_SIGNS.sub("x", text))
        if size and size + shown > LINE:
            lines.append("")
            size = 0
        sign = "" if not size and len(lines) == 1 else "- " if text.startswith("-") else "+ "
        lines[-1] += sign + text.removeprefix("-").lstrip() + " " if sign else text + " "
        size += shown
    if len(lines) == 1:
        return str(sp.latex(expression))
    rows = r" \\ & \quad ".join(line.rstrip() for line in lines)
    return rf"\begin{{aligned}}[t] & {rows} \end{{aligned}}"


def equations_html(system: MechanicalSystem) -> str:
    """Return the equations of a system as a part of a page."""
    sections = "\n".join(_sections(_account(system, latex=True), heading="h4"))
    return f'<div class="mechc-equations">{STYLE}\n{sections}</div>'


def sections_html(system: MechanicalSystem, heading: str = "h2") -> str:
    """Return the equations of a system as sections of a page."""
    return "".join(f"{line}\n" for line in _sections(_account(system, latex=True), heading))


def _html(account: EquationList) -> str:
    parts = [
        "<!DOCTYPE html>",
        f'<html lang="en"><head><meta charset="utf-8"><title>{escape(account.name)}</title>',
        f"{HEAD}</head><body>",
        f"<h1>{escape(account.name)}</h1>",
    ]
    if account.doc:
        parts.append(f"<p>{escape(account.doc)}</p>")
    parts.extend(_sections(account))
    return "\n".join([*parts, "</body></html>"])


def _sections(account: EquationList, heading: str = "h2") -> list[str]:
    parts: list[str] = []
    for section in account.sections():
        parts.append(f"<{heading}>{section.title}</{heading}>")
        if section.meaning:
            parts.append(f"<p>{_sentence(section.meaning)}</p>")
        for s in section.statements:
            if s.right is None:
                parts.append(f'<div class="row">{escape(s.left)}: {_sized(s, str)}</div>')
            else:
                parts.append(f'<div class="row">{mathml(s.left, s.right)}</div>')
    if account.equations:
        parts.append(f"<p>Cyclic coordinates: {escape(', '.join(account.cyclic) or 'none')}.</p>")
    if events := _not_written(account):
        parts.append(f"<p>{escape(_sentence(events))}</p>")
    return parts
