"""Formulas as MathML, which browsers show without a script or a network."""

from __future__ import annotations

import re
import unicodedata
from functools import lru_cache
from html import escape
from typing import Any

import sympy as sp
from sympy.printing.mathml import MathMLPresentationPrinter

from .names import GREEK

_UNICODE = {"lambda": "LAMDA"}
"""Names of letters that Unicode spells otherwise."""


def _letter(name: str) -> str:
    case = "SMALL" if name.islower() else "CAPITAL"
    return unicodedata.lookup(f"GREEK {case} LETTER {_UNICODE.get(name.lower(), name)}")


def mathml(left: str, right: sp.Basic) -> str:
    """Return ``left = right``; names are in the LaTeX of ``names.py``; the right side may be a condition.

    Each term of a sum is a formula of its own, so that a browser breaks long sums between them.
    """
    parts = [f"<math><mrow>{symbol(left)}<mo>=</mo></mrow></math>"]
    if not isinstance(right, sp.Expr):
        return f"{parts[0]} <math><mrow>{_body(right)}</mrow></math>"
    for k, term in enumerate(right.as_ordered_terms()):
        negative = term.could_extract_minus_sign()
        sign = "\u2212" if negative else ("+" if k else "")
        body = _body(-term if negative else term)
        operator = f"<mo>{sign}</mo>" if sign else ""
        parts.append(f"<math><mrow>{operator}{body}</mrow></math>")
    return " ".join(parts)


def _body(e: sp.Basic) -> str:
    """Print an expression; SymPy leaves signs of comparison as they are."""
    text: str = _Printer().doprint(e)
    return text.replace("<mo><</mo>", "<mo>&lt;</mo>").replace("<mo>></mo>", "<mo>&gt;</mo>")


def symbol(latex: str) -> str:
    r"""Return a name such as ``\dot{\theta}_{1}`` as MathML."""
    dotted = re.fullmatch(r"\\(d+)ot\{(.*?)\}(_\{.*\})?", latex)
    if dotted:
        dots, base, index = dotted.groups()
        mark = "˙" if len(dots) == 1 else "¨"
        over = f'<mover accent="true">{symbol(base)}<mo>{mark}</mo></mover>'
        return f"<msub>{over}{symbol(index[2:-1])}</msub>" if index else over
    indexed = re.fullmatch(r"(.+?)_\{(.*)\}", latex)
    if indexed:
        return f"<msub>{symbol(indexed[1])}<mrow>{symbol(indexed[2])}</mrow></msub>"
    upright = re.fullmatch(r"\\(?:mathrm|text)\{(.*)\}", latex)
    if upright:
        return f'<mi mathvariant="normal">{escape(_plain(upright[1]))}</mi>'
    if "," in latex:
        return "<mo>,</mo>".join(symbol(part) for part in latex.split(","))
    if latex.startswith("\\") and latex[1:] in GREEK:
        return f"<mi>{_letter(latex[1:])}</mi>"
    if re.fullmatch(r"[\d.e+-]+", latex):
        return f"<mn>{latex}</mn>"
    return f"<mi>{escape(_plain(latex))}</mi>"


def _plain(text: str) -> str:
    return text.replace(r"\_", "_").replace(r"\,", " ").replace("\\", "").replace("{", "").replace("}", "")


class _Printer(MathMLPresentationPrinter):  # type: ignore[misc]
    """SymPy's printer with our names."""

    def _print_Symbol(self, sym: sp.Symbol, style: str = "plain") -> object:
        return _element(sym.name).cloneNode(deep=True)

    def _print_Piecewise(self, e: sp.Piecewise) -> object:
        """Write a value and its condition on each line, after a brace."""
        cases = list(e.args)
        while cases[-1].cond == True and isinstance(cases[-1].expr, sp.Piecewise):  # noqa: E712
            cases += cases.pop().expr.args
        lines = [
            self._made("mtr", *(self._made("mtd", *part, style="text-align: left") for part in line))
            for line in ([[self._print(case.expr)], self._when(case.cond)] for case in cases)
        ]
        return self._made("mrow", self._made("mo", "{"), self._made("mtable", *lines))

    def _when(self, condition: sp.Basic) -> list[object]:
        if condition == True:  # noqa: E712
            return [self._made("mtext", "otherwise")]
        return [self._made("mtext", "if\xa0"), self._print(condition)]

    def _print_ITE(self, e: sp.ITE) -> object:
        """Write a condition that is one where a second holds, and elsewhere another."""
        condition, yes, no = e.args
        here, there = sp.And(condition, yes), sp.And(sp.Not(condition), no)
        return self._print(sp.Or(here, there) if yes != True else sp.Or(condition, no))  # noqa: E712

    def _print_sign(self, e: sp.sign) -> object:
        return self._print(sp.Function("sgn")(*e.args))

    def _print_atan2(self, e: sp.atan2) -> object:
        y, x = map(self._print, e.args)
        opened, between, closed = (self._made("mo", sign) for sign in "(,)")
        sides = self._made("mrow", opened, y, between, x, closed)
        return self._made("mrow", self._made("mi", "atan2"), sides)

    def _made(self, name: str, *parts: Any, **attributes: str) -> Any:
        found = self.dom.createElement(name)
        for key, value in attributes.items():
            found.setAttribute(key, value)
        for part in parts:
            found.appendChild(self.dom.createTextNode(part) if isinstance(part, str) else part)
        return found


@lru_cache(1000)
def _element(name: str) -> Any:
    from xml.dom.minidom import parseString

    return parseString(symbol(name).replace("˙", "&#x2D9;").replace("¨", "&#xA8;")).documentElement
