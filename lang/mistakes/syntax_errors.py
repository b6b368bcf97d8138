"""Syntax errors in the words of the language: what is wrong where a token does not fit.

``diagnose`` asks the rules below in order; the first that knows the mistake names it. The last
says what was expected. No rule ever shows the name of a terminal.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise

from mechc.suggest import closest

from ..diagnostics import Label
from ..grammar.keywords import STATEMENTS
from ..grammar.lexer import Token
from ..grammar.tables import END
from ..units import NAMED_TYPES
from .expected import OPERATORS, Finding, behind, error, unexpected
from .functions import function_head, function_not_closed, function_step, step_outside
from .habits import (
    action_outside_when,
    assignment_sign,
    block_in_when,
    braces_around_block,
    choice_behind_value,
    comparison_sign,
    equals_behind_keyword,
    foreign_brackets,
    mechanics,
    missing_operator,
    modelica,
    python,
    reserved_word,
    several_at_once,
    statement_without_keyword,
    unknown_unit,
)
from .recovery import CLOSERS, KIND_OF, OPENERS, Panic, Situation, TokenEdit


def diagnose(s: Situation) -> Finding:
    """Say what is wrong at the token, and how to go on."""
    for rule in _RULES:
        finding = rule(s)
        if finding is not None:
            return finding
    return unexpected(s)


# ---------------------------------------------------------------- rules


def _open_bracket(s: Situation) -> Finding | None:
    """A bracket that is still open where the statement ends, or closed by another kind."""
    bracket = s.bracket
    if bracket is None:
        if s.token.kind in CLOSERS:
            message = f"'{s.token.text}' closes nothing"
            help = f"delete it, or open it with '{CLOSERS[s.token.kind]}'"
            return error("E0117", message, s.span(s.token), help=help), TokenEdit(delete=1)
        return None
    closer = OPENERS[bracket.kind]
    wrong = s.token.kind in CLOSERS and s.token.text != closer
    ends = s.token.kind in ("SEMICOLON", END) or (s.begins_line and s.token.text in (*STATEMENTS, "end"))
    if not wrong and not ends:
        return None
    where = Label(s.span(s.token), f"here it should be closed: '{closer}' is missing")
    if wrong:
        where = Label(s.span(s.token), f"this should be '{closer}'")
    if s.token.kind == END:
        where = Label(behind(s), f"'{closer}' is missing before the end of the file")
    problem = error(
        "E0117",
        f"'{bracket.text}' is not closed",
        s.span(bracket),
        labels=(where,),
        help=f"put '{closer}' where the part in brackets ends",
    )
    if s.accepts(KIND_OF[closer]):
        return problem, TokenEdit(delete=int(wrong), insert=((KIND_OF[closer], closer),))
    return problem, Panic()


def _block_not_closed(s: Situation) -> Finding | None:
    """A block that is open where the file ends, where a model begins, or where another block ends."""
    if s.block is None:
        return None
    word, place = s.block
    text, tokens = s.block_end
    name = s.values[place + 1].text if word.kind in ("MODEL", "FUNCTION") else ""
    what = f"{word.text} '{name}'" if name else f"'{word.text}'"
    opening = s.span(s.values[place + 1]) if name else s.span(word)
    before = s.previous
    if s.at_beginning and s.token.kind == END:
        capital = next((t for t in _beginnings(s) if t.text in ("End", "END")), None)
        labels = (
            (Label(s.span(capital), "words of the language are written small: 'end'"),) if capital else ()
        )
        problem = error(
            "E0115", f"{what} is not closed", opening, labels=labels, help=f"write '{text}' at its end"
        )
        return problem, TokenEdit(insert=tokens)
    if s.at_beginning and s.token.text in ("model", "partial"):
        problem = error(
            "E0115",
            f"{what} is not closed",
            opening,
            labels=(Label(s.span(s.token), "the next model begins here"),),
            help=f"write '{text}' before it",
        )
        return problem, TokenEdit(insert=tokens)
    if s.at_beginning and s.token.text in ("elseif", "elsewhen", "else"):
        expected = {"elsewhen": "when"}.get(s.token.text, "if")
        message = f"'{s.token.text}' belongs to no '{expected}'"
        return error("E0115", message, s.span(s.token), help="the innermost block here is " + what), Panic()
    if before is None or before.text != "end" or not s.accepts(tokens[1][0]):
        return None
    if name and s.token.text in ("for", "if", "when"):
        message = f"this 'end' closes no '{s.token.text}'"
        labels = (Label(opening, f"open here is only {what}"),)
        both = s.span(before).to(s.span(s.token))
        return error("E0115", message, both, labels=labels, help="delete it"), Panic(stray_end=True)
    if s.token.kind == "SEMICOLON":
        message = f"'end' does not say what it closes: {what}"
        labels = (Label(opening, "this begins here"),)
        problem = error("E0115", message, s.span(before), labels=labels, help=f"write '{text}'")
        return problem, TokenEdit(insert=(tokens[1],))
    problem = error(
        "E0115",
        f"{what} is not closed",
        opening,
        labels=(Label(s.span(before).to(s.span(s.token)), f"here '{text}' is missing"),),
        help=f"each '{word.text}' has its own '{text}'",
    )
    if s.token.text in ("for", "if", "when") and not _encloses(s, s.token.text, place):
        return problem, TokenEdit(delete=1, insert=(tokens[1],))
    return problem, TokenEdit(insert=(tokens[1], tokens[2], ("NAME", "end")))


def _beginnings(s: Situation) -> Iterator[Token]:
    """Yield the first token of each statement before this place."""
    for before, token in pairwise(s.tokens[: s.index]):
        if before.kind == "SEMICOLON":
            yield token


def _encloses(s: Situation, word: str, place: int) -> bool:
    return any(isinstance(v, Token) and v.text == word for v in s.values[:place])


def _misspelt(s: Situation) -> Finding | None:
    """A word near to one that could stand here, or at the beginning of this statement."""
    first = s.tokens[s.first]
    if s.first < s.index <= s.first + 4 and first.kind == "NAME" and not s.is_keyword(s.first):
        words = [w for w, kind in s.tables.keywords.items() if s.accepts(kind, s.depth)]
        meant = closest(first.text, words)
        if meant is not None and first.text not in NAMED_TYPES:
            problem = error(
                "E0123", f"unknown word '{first.text}'", s.span(first), help=f"did you mean '{meant}'?"
            )
            return problem, Panic()
    if s.token.kind == "NAME":
        meant = closest(s.token.text, s.expected_words)
        if s.token.text in ("do", "begin"):
            meant = "loop" if "LOOP" in s.expected else "then" if "THEN" in s.expected else meant
        if meant is not None and not s.at_beginning and s.token.text not in s.tables.keywords:
            message = f"unknown word '{s.token.text}'"
            problem = error("E0123", message, s.span(s.token), help=f"did you mean '{meant}'?")
            return problem, TokenEdit(delete=1, insert=(("NAME", meant),))
    return None


def _missing_semicolon(s: Situation) -> Finding | None:
    """The statement could end here, and another one begins."""
    if not s.accepts("SEMICOLON") or s.at_beginning:
        return None
    begins = s.token.text in (*STATEMENTS, "end", "model", "partial", "function", "import", "type")
    if not (s.begins_line or s.token.kind == END or (begins and s.token.kind == "NAME")):
        return None
    if s.token.kind in OPERATORS or s.token.kind in ("EQUAL", "TILDE", "DOT", "COMMA"):
        return None
    problem = error("E0111", "';' is missing", behind(s), caption="a statement ends with ';'")
    return problem, TokenEdit(insert=(("SEMICOLON", ";"),))


def _stray_end(s: Situation) -> Finding | None:
    if s.token.text != "end" or not s.at_beginning:
        return None
    return error("E0115", "this 'end' closes nothing", s.span(s.token), help="delete it"), Panic(
        stray_end=True
    )


def _no_else(s: Situation) -> Finding | None:
    if "ELSE" not in s.expected or "ELSEIF" not in s.expected or s.at_beginning:
        return None
    words = [v for v in s.values[s.depth :] if isinstance(v, Token) and v.kind == "IF"]
    if not words or s.token.kind == "NAME":
        return None
    problem = error(
        "E0110",
        "this 'if' has no 'else'",
        s.span(words[-1]),
        help="an 'if' in an expression has a value in every case: 'if c then a else b'",
    )
    return problem, Panic()


def _third_end(s: Situation) -> Finding | None:
    """An arrow behind ``A -> B`` of a component."""
    if s.token.kind != "ARROW" or s.bracket is None:
        return None
    before = s.source.text[s.bracket.end : s.token.start]
    if "->" not in before.rpartition(",")[2]:
        return None
    help = "an arrow binds two ends; a third one is given by its name, as in 'Pulley p(from = a, over = b, to = c)'"
    return error("E0110", "a second arrow", s.span(s.token), help=help), Panic()


_RULES: tuple[Callable[[Situation], Finding | None], ...] = (
    function_step,
    function_not_closed,
    function_head,
    step_outside,
    python,
    modelica,
    mechanics,
    _block_not_closed,
    _stray_end,
    reserved_word,
    action_outside_when,
    block_in_when,
    assignment_sign,
    equals_behind_keyword,
    comparison_sign,
    unknown_unit,
    _misspelt,
    _no_else,
    braces_around_block,
    foreign_brackets,
    _third_end,
    several_at_once,
    _open_bracket,
    choice_behind_value,
    _missing_semicolon,
    missing_operator,
    statement_without_keyword,
)
