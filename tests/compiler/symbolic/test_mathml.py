"""Formulas in MathML: nothing is written as Python or SymPy call it."""

from __future__ import annotations

import re
from xml.dom.minidom import parseString

import pytest
import sympy as sp

from mechc.compiler.graph.operations import LOOKUP, OPERATIONS
from mechc.compiler.symbolic.express import SYMPY
from mechc.compiler.symbolic.mathml import mathml

ENTITIES = {"&InvisibleTimes;": "", "&pi;": "π", "&ExponentialE;": "e"}


def words(e: sp.Basic) -> str:
    """Return what a formula shows, without its layout; lines of a table end with a semicolon."""
    text = mathml("y", e).replace("</mtr>", "<mo>;</mo></mtr>")
    for entity, sign in ENTITIES.items():
        text = text.replace(entity, sign)
    shown = parseString(f"<p>{text}</p>").documentElement
    assert shown is not None
    found = "".join(
        node.data
        for element in shown.getElementsByTagName("*")
        for node in element.childNodes
        if node.nodeType == 3
    )
    return re.sub(r"\s+", " ", found).strip()


@pytest.mark.parametrize(
    "row", [row for row in OPERATIONS if row.arity and row.code != LOOKUP], ids=lambda row: row.name
)
def test_operations_are_not_named_as_in_python(row: object) -> None:
    a, b = sp.symbols("a b", real=True)
    arguments = [a > b, a, b][-row.arity :] if row.arity < 3 else [a > b, a, b]  # type: ignore[attr-defined]
    if row.name in ("and", "or", "not"):  # type: ignore[attr-defined]
        arguments = [a > 0, b > 0][: row.arity]  # type: ignore[attr-defined]
    shown = words(sp.sympify(SYMPY.functions[row.code](*arguments)))  # type: ignore[attr-defined]
    assert not re.search(r"[A-Z]|_|\bsign\b|\bTrue\b|\*", shown), shown
    assert not re.search(r"piecewise|\bite\b", shown)


def test_choices_are_lines_after_a_brace() -> None:
    a, b = sp.symbols("a b", real=True)
    inner = sp.Piecewise((b, b > 2), (0, True))
    assert words(a * sp.Piecewise((a**2, a > 1), (inner, True))) == "y=a{a2if a>1;bif b>2;0otherwise;"


def test_conditions_that_are_chosen_are_conditions() -> None:
    a, b = sp.symbols("a b", real=True)
    assert words(sp.ITE(a > 0, b > 0, sp.false)) == "y=a>0∧b>0"
    assert words(sp.ITE(a > 0, sp.true, b > 0)) == "y=a>0∨b>0"


def test_the_angle_of_two_sides_has_a_name_of_its_own() -> None:
    assert words(sp.atan2(*sp.symbols("a b"))) == "y=atan2(a,b)"
