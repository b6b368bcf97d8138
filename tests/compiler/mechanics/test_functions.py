"""The table of what functions mean holds those of the language, and no others."""

from __future__ import annotations

from mechc.compiler.flat.expressions.operators import FUNCTIONS as OPERATORS
from mechc.compiler.mechanics.meaning.functions import FUNCTIONS
from mechc.lang.builtins import BUILTINS, Category

VALUES = (Category.ELEMENTARY, Category.VECTOR, Category.POSE)


def test_the_table_holds_nothing_that_the_language_has_not() -> None:
    assert FUNCTIONS.keys() <= {*BUILTINS, *OPERATORS.values(), "negate", "not"}


def test_every_function_of_values_has_a_meaning() -> None:
    assert {name for name, builtin in BUILTINS.items() if builtin.category in VALUES} <= FUNCTIONS.keys()
