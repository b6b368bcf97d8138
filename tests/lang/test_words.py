"""Suggestions for misspelt words, and the table of built-in functions."""

from __future__ import annotations

import pytest

from mechc.lang.builtins import BUILTINS, CONSTANTS, PREDEFINED
from mechc.lang.grammar.keywords import KEYWORDS
from mechc.lang.units import NAMED_TYPES
from mechc.suggest import closest, edit_distance


@pytest.mark.parametrize(
    ("a", "b", "distance"),
    [
        ("", "", 0),
        ("abc", "abc", 0),
        ("kitten", "sitting", 3),
        ("ab", "ba", 1),
        ("", "abc", 3),
        ("ca", "abc", 3),
    ],
)
def test_edit_distance(a: str, b: str, distance: int) -> None:
    assert edit_distance(a, b) == distance
    assert edit_distance(b, a) == distance


def test_closest() -> None:
    assert closest("potental", ["parameter", "potential"]) == "potential"
    assert closest("Theta", ["beta", "theta"]) == "theta"  # case first
    assert closest("lenght", ["length", "light"]) == "length"  # a swap is one edit
    assert closest("x", ["y"]) is None  # one letter is not a hint
    assert closest("abc", ["xyz"]) is None
    assert closest("mass", ["mass"]) is None  # the word itself is not a suggestion
    assert closest("bars", ["cars", "bar"]) == "bar"  # the same first letter wins


def test_builtin_words_do_not_collide() -> None:
    assert set(BUILTINS).isdisjoint(CONSTANTS)
    assert set(BUILTINS).isdisjoint(NAMED_TYPES)
    assert set(BUILTINS) & KEYWORDS == {"at", "initial"}  # keywords only where no name can stand
    assert "world" in PREDEFINED
    for builtin in BUILTINS.values():
        assert builtin.most is None or 0 <= builtin.least <= builtin.most
        assert builtin.doc[0].islower() or builtin.doc[0] in "-xn0"


def test_numbers_of_arguments_in_words() -> None:
    assert BUILTINS["sin"].arity == "1 argument"
    assert BUILTINS["energy"].arity == "no arguments"
    assert BUILTINS["vel"].arity == "1 or 2 arguments"
    assert BUILTINS["quat"].arity == "1 to 4 arguments"
    assert BUILTINS["max"].arity == "at least 1 argument"
