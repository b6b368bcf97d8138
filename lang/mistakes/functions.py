"""Rules for what is written in the body of a function by habit, and for steps of functions outside of one."""

from __future__ import annotations

from itertools import pairwise

from ..grammar.keywords import DEFINITIONS, STATEMENTS, STEPS
from .expected import Finding, error
from .recovery import Panic, Situation, TokenEdit

_STEPS = "a function holds 'let', 'var', ':=', 'for', 'if' and 'return'"

_INSTEAD = {
    "while": "a loop of a function runs over a range, 'for i in 1:n loop .. end for;': how often must be known when compiling",
    "repeat": "a loop of a function runs over a range: 'for i in 1:n loop .. end for;'",
    "break": "every turn of a loop is taken: put the steps under 'if', or leave the function by 'return'",
    "continue": "put the rest of the steps under 'if'",
    "algorithm": "leave it out: the steps follow the arguments",
    "begin": "leave it out: the steps follow the arguments",
    "protected": "leave it out: a variable is declared by 'var s = 0;' where it is first needed",
    "input": "arguments stand in parentheses: 'function f(Real x) -> Real'",
    "output": "the result follows '->', and 'return e;' gives it",
}


def function_step(s: Situation) -> Finding | None:
    """A step that is none, inside of a function."""
    if s.function is None:
        return None
    first = s.tokens[s.first]
    if first.text == "while" and s.at_beginning is False:
        problem = error("E0133", "a function has no 'while'", s.span(first), help=_INSTEAD["while"])
        return problem, _without_loop(s)
    if first.text in _INSTEAD and not s.is_keyword(s.first):
        if first.text in ("input", "output") and not _ends_later(s):
            return None
        return error(
            "E0133", f"a function has no '{first.text}'", s.span(first), help=_INSTEAD[first.text]
        ), Panic()
    if s.token.kind == "EQUAL" and s.accepts("ASSIGN"):
        help = "write ':='; a name for a value that stays is declared by 'let'"
        problem = error("E0118", "a variable gets a new value by ':='", s.span(s.token), help=help)
        return problem, TokenEdit(delete=1, insert=(("ASSIGN", ":="),))
    name = s.source.text[first.start : s.tokens[s.index - 1].end] if s.index > s.first else ""
    if (
        s.following.kind == "EQUAL"
        and s.token.kind in ("PLUS", "MINUS", "STAR", "SLASH")
        and s.accepts("ASSIGN")
    ):
        sign = s.token.text
        help = f"write '{name} := {name} {sign} ..;'"
        return error(
            "E0118", f"there is no '{sign}='", s.span(s.token).to(s.span(s.following)), help=help
        ), Panic()
    if first.text in (*STATEMENTS, *DEFINITIONS) and first.text not in STEPS and not s.is_keyword(s.first):
        if not _ends_later(s):
            return None
        return error("E0133", f"a function has no '{first.text}'", s.span(first), help=_STEPS), Panic()
    value = s.accepts("ASSIGN") or s.token.kind not in ("NAME", "ASSIGN", "EQUAL")
    if s.index > s.first and not s.is_keyword(s.first) and value and s.bracket is None:
        if first.text == "end":
            return None
        help = "'return e;' gives it back, 'let a = e;' gives it a name"
        return error("E0133", "this value is used for nothing", s.span(first), help=help), Panic()
    return None


def function_not_closed(s: Situation) -> Finding | None:
    """A function without its end, where a statement of a model or another definition begins."""
    name, first = s.function, s.tokens[s.first]
    if name is None or first.text not in (*STATEMENTS, *DEFINITIONS) or first.text in STEPS:
        return None
    problem = error(
        "E0115",
        f"function '{name.text}' is not closed",
        s.span(name),
        help=f"write 'end {name.text};' after its last step",
    )
    return problem, Panic()


def step_outside(s: Situation) -> Finding | None:
    """``var`` and ``return`` in a model."""
    first = s.tokens[s.first]
    if s.function is not None or first.text not in ("var", "return") or s.is_keyword(s.first):
        return None
    if first.text == "var" and s.index == s.first:
        return None
    help = {
        "var": "a formula has a name by 'let', a value that jumps is 'discrete', one with a rate is a 'state'",
        "return": "a model reports by 'output y = ..;'",
    }[first.text]
    return error("E0133", f"'{first.text}' is allowed only in a function", s.span(first), help=help), Panic()


def function_head(s: Situation) -> Finding | None:
    """A function whose arguments follow its name without parentheses, or several results as a formula."""
    first = s.tokens[s.first]
    if first.text != "function" or not s.is_keyword(s.first):
        return None
    if s.index == s.first + 2 and s.token.kind != "LPAR":
        help = _INSTEAD["input"] + "; one without arguments has '()'"
        return error(
            "E0133", "the arguments of the function are missing", s.span(s.tokens[s.first + 1]), help=help
        ), Panic()
    bracket = s.bracket
    if (
        s.token.kind == "COMMA"
        and bracket is not None
        and s.tokens[s.tokens.index(bracket) - 1].kind == "EQUAL"
    ):
        help = "write a body, 'return (a, b); end f;', or a vector '{a, b}' of one kind"
        return error("E0133", "several results need a body", s.span(bracket), help=help), Panic()
    return None


def _ends_later(s: Situation) -> bool:
    """Whether the function is closed after this place, so that what stands here was meant to be inside."""
    name = s.function
    assert name is not None
    tokens = s.tokens[s.first :]
    return any(a.text == "end" and b.text == name.text for a, b in pairwise(tokens))


def _without_loop(s: Situation) -> TokenEdit | Panic:
    """Read on after ``end while;``."""
    kinds = [t.text for t in s.tokens[s.index : s.index + 400]]
    for k in range(len(kinds) - 2):
        if kinds[k : k + 3] == ["end", "while", ";"]:
            return TokenEdit(delete=k + 3, insert=(("ASSIGN", ":="), ("NUMBER", "0"), ("SEMICOLON", ";")))
    return Panic()
