"""Syntax errors in the words of the language: what is wrong where a token does not fit.

``diagnose`` asks the rules below in order; the first that knows the mistake names it. The last
says what was expected. No rule ever shows the name of a terminal.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from .builtins import BUILTINS
from .diagnostics import Diagnostic, Label, Severity
from .keywords import ACTIONS, KEYWORDS, RESERVED, STATEMENTS
from .lexer import Token
from .recovery import CLOSERS, KIND_OF, OPENERS, Edit, Panic, Repair, Situation
from .source import Span
from .suggest import closest
from .tables import END
from .units import NAMED_TYPES, suggest_unit, unit_end

Finding = tuple[Diagnostic, Repair]

STRAY = "delete it"
"""The help for an 'end' too many, which is often the consequence of an earlier mistake."""

_OPERATORS = frozenset(("PLUS", "MINUS", "STAR", "SLASH", "CARET", "RELATION", "AND", "OR"))
_CONDITIONS = ("IF", "ELSEIF", "WHEN", "ELSEWHEN", "ASSERT", "AND", "OR", "NOT", "LPAR")
_SIGNS = {
    "ARROW": "'->'", "ASSIGN": "':='", "EQUAL": "'='", "TILDE": "'~'", "DOT": "'.'", "COMMA": "','",
    "COLON": "':'", "SEMICOLON": "';'", "LPAR": "'('", "RPAR": "')'", "LSQB": "'['", "RSQB": "']'",
    "LBRACE": "'{'", "RBRACE": "'}'", "NAME": "a name", "STRING": "a text in quotes",
    "NUMBER": "a number", "QUANTITY": "a quantity", "UNITTAG": "a unit", "PLUS": "'+'", "MINUS": "'-'",
    "STAR": "'*'", "SLASH": "'/'", "CARET": "'^'", "RELATION": "a comparison", END: "the end of the file",
}  # fmt: skip

# Words that Modelica has and this language has not, with what to write.
_MODELICA: Mapping[str, str] = {
    "connect": "bodies are joined by a joint: 'Revolute pin(world -> bar.a);'",
    "algorithm": "order is free: write 'let', 'equation der(x) = ..;' or 'when' statements",
    "annotation": "write 'experiment(stop = 10 s);' for the run; there are no other annotations",
    "constant": "write 'parameter g = 9.81 m/s^2;'",
    "replaceable": "models cannot be exchanged from outside; use a structural parameter and 'if'",
    "redeclare": "models cannot be exchanged from outside; use a structural parameter and 'if'",
    "inner": "gravity is a statement, and the frame 'world' is always there",
    "outer": "gravity is a statement, and the frame 'world' is always there",
    "connector": "there are no connectors: a joint binds two frames, 'Revolute pin(a -> b);'",
    "flow": "forces come from energies, or from 'force F on P;'",
    "stream": "there are no streams",
    "block": "write 'model'",
    "class": "write 'model'",
    "record": "write 'model'",
    "package": "one file is one name space: write the models one after another",
    "within": "a file's place in the folders is its path; nothing to write",
    "protected": "everything is visible; leave the word out",
    "public": "everything is visible; leave the word out",
    "each": "a scalar goes to every element by itself: leave 'each' out",
    "start": "write 'coordinate x = 1 m;' (known) or 'coordinate x ~ 1 m;' (guess)",
}


def diagnose(s: Situation) -> Finding:
    """Say what is wrong at the token, and how to go on."""
    for rule in _RULES:
        finding = rule(s)
        if finding is not None:
            return finding
    return _unexpected(s)


def _error(
    code: str,
    message: str,
    span: Span,
    *,
    caption: str = "",
    labels: tuple[Label, ...] = (),
    help: str = "",
) -> Diagnostic:
    return Diagnostic(Severity.ERROR, code, message, span, caption, labels, help)


def _behind(s: Situation) -> Span:
    """Return the place just behind the previous token."""
    end = s.previous.end if s.previous else 0
    return Span(s.source, max(end - 1, 0), end) if end else Span(s.source, 0, 0)


def _found(token: Token) -> str:
    match token.kind:
        case "$END":
            return "the end of the file"
        case "STRING":
            return "a text in quotes"
        case _:
            return f"'{token.text}'"


# ---------------------------------------------------------------- rules


def _modelica(s: Situation) -> Finding | None:
    """Words of Modelica at the beginning of a statement, or before a modification."""
    first = s.tokens[s.first]
    word = None
    if first.text in _MODELICA and s.index - s.first <= 3:
        word = first
    elif s.previous and s.bracket and s.previous.text in ("each", "redeclare", "replaceable", "final"):
        word = s.previous
    elif s.token.text == "annotation":
        word = s.token
    elif s.previous and s.previous.text == "annotation":
        word = s.previous
    if first.text == "initial" and s.tokens[s.first + 1].text == "equation":
        message = "there is no 'initial equation' section"
        help = "write 'initial' before each: 'initial der(x) = 1 m/s;'"
        return _error("E0120", message, s.span(first).to(s.span(s.tokens[s.first + 1])), help=help), Panic()
    if word is None:
        return None
    help = _MODELICA.get(word.text, "leave the word out")
    return _error("E0120", f"'{word.text}' is Modelica", s.span(word), help=help), Panic()


def _open_bracket(s: Situation) -> Finding | None:
    """A bracket that is still open where the statement ends, or closed by another kind."""
    bracket = s.bracket
    if bracket is None:
        if s.token.kind in CLOSERS:
            message = f"'{s.token.text}' closes nothing"
            help = f"delete it, or open it with '{CLOSERS[s.token.kind]}'"
            return _error("E0117", message, s.span(s.token), help=help), Edit(delete=1)
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
        where = Label(_behind(s), f"'{closer}' is missing before the end of the file")
    problem = _error(
        "E0117",
        f"'{bracket.text}' is not closed",
        s.span(bracket),
        labels=(where,),
        help=f"put '{closer}' where the part in brackets ends",
    )
    if s.accepts(KIND_OF[closer]):
        return problem, Edit(delete=int(wrong), insert=((KIND_OF[closer], closer),))
    return problem, Panic()


def _block_not_closed(s: Situation) -> Finding | None:
    """A block that is open where the file ends, where a model begins, or where another block ends."""
    if s.block is None:
        return None
    word, place = s.block
    text, tokens = s.block_end
    name = s.values[place + 1].text if word.kind == "MODEL" else ""
    what = f"model '{name}'" if name else f"'{word.text}'"
    opening = s.span(s.values[place + 1]) if name else s.span(word)
    before = s.previous
    if s.at_beginning and s.token.kind == END:
        problem = _error("E0115", f"{what} is not closed", opening, help=f"write '{text}' at its end")
        return problem, Edit(insert=tokens)
    if s.at_beginning and s.token.text in ("model", "partial"):
        problem = _error(
            "E0115",
            f"{what} is not closed",
            opening,
            labels=(Label(s.span(s.token), "the next model begins here"),),
            help=f"write '{text}' before it",
        )
        return problem, Edit(insert=tokens)
    if s.at_beginning and s.token.text in ("elseif", "elsewhen", "else"):
        expected = {"elsewhen": "when"}.get(s.token.text, "if")
        message = f"'{s.token.text}' belongs to no '{expected}'"
        return _error("E0115", message, s.span(s.token), help="the innermost block here is " + what), Panic()
    if before is None or before.text != "end" or not s.accepts(tokens[1][0]):
        return None
    if name and s.token.text in ("for", "if", "when"):
        message = f"this 'end' closes no '{s.token.text}'"
        labels = (Label(opening, f"open here is only {what}"),)
        both = s.span(before).to(s.span(s.token))
        return _error("E0115", message, both, labels=labels, help=STRAY), Panic()
    if s.token.kind == "SEMICOLON":
        message = f"'end' does not say what it closes: {what}"
        labels = (Label(opening, "this begins here"),)
        problem = _error("E0115", message, s.span(before), labels=labels, help=f"write '{text}'")
        return problem, Edit(insert=(tokens[1],))
    problem = _error(
        "E0115",
        f"{what} is not closed",
        opening,
        labels=(Label(s.span(before).to(s.span(s.token)), f"here '{text}' is missing"),),
        help=f"each '{word.text}' has its own '{text}'",
    )
    if s.token.text in ("for", "if", "when") and not _encloses(s, s.token.text, place):
        return problem, Edit(delete=1, insert=(tokens[1],))
    return problem, Edit(insert=(tokens[1], tokens[2], ("NAME", "end")))


def _encloses(s: Situation, word: str, place: int) -> bool:
    return any(isinstance(v, Token) and v.text == word for v in s.values[:place])


def _assign_sign(s: Situation) -> Finding | None:
    """':=' for '=' and the reverse."""
    if s.token.kind == "ASSIGN":
        problem = _error(
            "E0118",
            "':=' stands only in 'when'",
            s.span(s.token),
            help="write '=': everything outside 'when' holds at all times",
        )
        if s.accepts("EQUAL"):
            return problem, Edit(delete=1, insert=(("EQUAL", "="),))
        target = s.source.text[s.tokens[s.first].start : s.tokens[s.index - 1].end] if s.index else "n"
        help = f"for an abbreviation write 'let {target} = ..;', for a jump 'when .. then {target} := ..;'"
        return _error("E0118", problem.message, s.span(s.token), help=help), Panic()
    if s.token.kind == "EQUAL" and s.accepts("ASSIGN"):
        problem = _error(
            "E0118",
            "an action of 'when' sets a value by ':='",
            s.span(s.token),
            help="write ':=' for a discrete variable, 'reinit(x, ..)' for a coordinate or rate",
        )
        return problem, Edit(delete=1, insert=(("ASSIGN", ":="),))
    return None


def _comparison_sign(s: Situation) -> Finding | None:
    """'=' in a condition and '==' in an equation."""
    if s.token.kind == "EQUAL" and s.accepts("RELATION"):
        words = [v for v in s.values[s.depth :] if isinstance(v, Token) and v.kind in (*_CONDITIONS, "EQUAL")]
        if words and words[-1].kind in _CONDITIONS:
            problem = _error(
                "E0119", "'=' does not compare", s.span(s.token), help="a comparison is written '=='"
            )
            return problem, Edit(delete=1, insert=(("RELATION", "=="),))
    if s.token.text == "==" and s.accepts("EQUAL"):
        problem = _error("E0119", "'==' gives no value", s.span(s.token), help="write '='")
        return problem, Edit(delete=1, insert=(("EQUAL", "="),))
    if s.token.kind in ("SEMICOLON", "STRING", "RPAR") and s.accepts("EQUAL"):
        signs = [t for t in s.tokens[s.first : s.index] if t.text == "=="]
        if len(signs) == 1:
            help = "write '=': '==' is for conditions"
            return _error("E0119", "an equation is written with '='", s.span(signs[0]), help=help), Panic()
    return None


def _unknown_unit(s: Situation) -> Finding | None:
    """A word behind a number, a brace or a parenthesis that is no unit."""
    before, token = s.previous, s.token
    if before is None or token.kind != "NAME" or s.begins_line or token.text in KEYWORDS:
        return None
    if before.kind not in ("NUMBER", "RPAR", "RBRACE") or not s.accepts("STAR"):
        return None
    if token.text == "do" or (closest(token.text, _words(s.expected)) and not suggest_unit(token.text)):
        return None
    text = s.source.text
    if unit_end(text, token.start) > token.start:
        power = text.find("^", token.start)
        help = f"write '({before.text} {token.text})^..' for the power of the quantity"
        if before.kind != "NUMBER":
            help = "a unit has powers of whole numbers only, such as 'm^2'"
        message = f"the power of the unit '{token.text}' must be a number"
        return _error("E0128", message, Span(s.source, token.start, power + 1), help=help), Panic()
    index = s.index
    while index + 2 < len(s.tokens) and s.tokens[index + 1].kind in ("SLASH", "DOT", "CARET"):
        after = s.tokens[index + 2]
        if after.start != s.tokens[index].end + 1 or after.kind not in ("NAME", "NUMBER"):
            break
        index += 2
    meant = suggest_unit(token.text)
    if not meant and (s.following.kind == "LPAR" or before.kind == "RPAR"):
        return None
    help = f"did you mean '{meant}'?" if meant else ""
    if before.kind == "NUMBER" and not meant:
        help = f"a product with a variable is written '{before.text}*{token.text}'"
    problem = _error("E0112", f"unknown unit '{token.text}'", s.span(token), help=help)
    return problem, Edit(delete=index - s.index + 1)


def _misspelt(s: Situation) -> Finding | None:
    """A word near to one that could stand here, or at the beginning of this statement."""
    first = s.tokens[s.first]
    if s.first < s.index <= s.first + 4 and first.kind == "NAME" and not _is_keyword(s, s.first):
        words = [w for w, kind in s.tables.keywords.items() if s.accepts(kind, s.depth)]
        meant = closest(first.text, words)
        if meant is not None and first.text not in NAMED_TYPES:
            problem = _error(
                "E0123", f"unknown word '{first.text}'", s.span(first), help=f"did you mean '{meant}'?"
            )
            return problem, Panic()
    if s.token.kind == "NAME":
        meant = closest(s.token.text, _words(s.expected))
        if s.token.text in ("do", "begin"):
            meant = "loop" if "LOOP" in s.expected else "then" if "THEN" in s.expected else meant
        if meant is not None and not s.at_beginning:
            message = f"unknown word '{s.token.text}'"
            problem = _error("E0123", message, s.span(s.token), help=f"did you mean '{meant}'?")
            return problem, Edit(delete=1, insert=(("NAME", meant),))
    return None


def _is_keyword(s: Situation, index: int) -> bool:
    """True where the token was taken as a keyword."""
    start = s.tokens[index].start
    return any(isinstance(v, Token) and v.start == start and v.kind != "NAME" for v in s.values[s.depth :])


def _words(kinds: frozenset[str]) -> list[str]:
    return sorted(k.casefold() for k in kinds if k.casefold() in KEYWORDS)


def _missing_semicolon(s: Situation) -> Finding | None:
    """The statement could end here, and another one begins."""
    if not s.accepts("SEMICOLON") or s.at_beginning:
        return None
    begins = s.token.text in (*STATEMENTS, "end", "model", "partial", "function", "import", "type")
    if not (s.begins_line or s.token.kind == END or (begins and s.token.kind == "NAME")):
        return None
    if s.token.kind in _OPERATORS or s.token.kind in ("EQUAL", "TILDE", "DOT", "COMMA"):
        return None
    problem = _error("E0111", "';' is missing", _behind(s), caption="a statement ends with ';'")
    return problem, Edit(insert=(("SEMICOLON", ";"),))


def _no_keyword(s: Situation) -> Finding | None:
    """An equation or expression where a statement should begin."""
    first = s.tokens[s.first]
    if first.text not in ("der", "pre") and (s.index == s.first or _is_keyword(s, s.first)):
        return None
    if s.token.kind == "EQUAL" and s.index == s.first + 2 and s.previous:
        name = s.previous.text
        if first.text in NAMED_TYPES:
            help = (
                f"say what '{name}' is: 'parameter {first.text} {name} = ..;', "
                f"'coordinate ..', 'state ..' or 'let ..'"
            )
            message = f"a declaration begins with a keyword, not with the type '{first.text}'"
            return _error("E0125", message, s.span(first), help=help), Panic()
    if s.at_beginning and first.kind == "NAME":
        help = "write 'equation der(x) = ..;' for a state, 'initial der(q) = ..;' for a rate at the start"
        return _error("E0125", "a statement begins with a keyword", s.span(first), help=help), Panic()
    if s.token.kind not in ("EQUAL", "TILDE", "LPAR", "LSQB", "DOT", *_OPERATORS):
        return None
    if s.token.kind != "LPAR" and s.index > s.first + 1 and s.tokens[s.index - 2].kind != "DOT":
        return None
    left = s.source.text[first.start : s.tokens[s.index - 1].end]
    help = f"write 'let {left} = ..;', 'initial {left} = ..;' or 'constraint {left} = ..;'"
    return _error("E0125", "a statement begins with a keyword", s.span(first), help=help), Panic()


def _stray_end(s: Situation) -> Finding | None:
    if s.token.text != "end" or not s.at_beginning:
        return None
    return _error("E0115", "this 'end' closes nothing", s.span(s.token), help=STRAY), Panic()


def _reserved(s: Situation) -> Finding | None:
    """A word of the language where a name should stand."""
    word = s.token.text
    if word not in RESERVED or not s.accepts("NAME") or s.at_beginning or s.begins_line:
        return None
    message = f"'{word}' is a word of the language and cannot be a name"
    problem = _error("E0126", message, s.span(s.token), help=f"choose another name, for example '{word}_'")
    return problem, Edit(delete=1, insert=(("NAME", f"{word}_"),))


def _outside_when(s: Situation) -> Finding | None:
    first = s.tokens[s.first]
    if first.text not in ACTIONS or first.text in STATEMENTS or _is_keyword(s, s.first):
        return None
    message = f"'{first.text}' stands only in 'when'"
    help = f"write 'when .. then {first.text} ..; end when;'"
    return _error("E0110", message, s.span(first), help=help), Panic()


def _missing_operator(s: Situation) -> Finding | None:
    """An operand directly behind an operand."""
    before, token = s.previous, s.token
    if before is None or token.kind not in ("NAME", "NUMBER", "QUANTITY", "LPAR", "LBRACE"):
        return None
    if not s.accepts("STAR") or token.text in KEYWORDS or s.begins_line:
        return None
    help = f"a product is written '{before.text}*{token.text}'"
    if token.kind in ("LPAR", "LBRACE"):
        help = "a product is written with '*'"
    if before.text in BUILTINS:
        help = f"the argument of a function stands in parentheses: '{before.text}({token.text})'"
    message = f"an operator is missing between '{before.text}' and '{token.text}'"
    return _error("E0110", message, s.span(token), help=help), Edit(insert=(("STAR", "*"),))


def _brackets_of_others(s: Situation) -> Finding | None:
    """Vectors, units and decimals as other languages write them."""
    before, token, after = s.previous, s.token, s.following
    help = ""
    if token.kind == "LSQB" and "LBRACE" in s.expected:
        help = "a vector is written '{1, 2, 3}'"
    elif token.kind == "LSQB" and before and before.kind == "NUMBER" and after.kind == "NAME":
        help = f"a unit has no brackets: '{before.text} {after.text}'"
    elif token.kind == "COMMA" and before and before.kind == "NUMBER" and before.end == after.start - 1:
        help = (
            f"a decimal point is written '.': '{before.text}.{after.text}'" if after.text[0].isdigit() else ""
        )
    elif token.kind == "COMMA" and s.bracket and s.bracket.kind == "LPAR" and s.accepts("RPAR"):
        help = "a vector is written '{1, 2, 3}'"
    if not help:
        return None
    problem, repair = _unexpected(s)
    return _error(problem.code, problem.message, s.span(token), help=help), repair


def _no_else(s: Situation) -> Finding | None:
    if "ELSE" not in s.expected or "ELSEIF" not in s.expected or s.at_beginning:
        return None
    words = [v for v in s.values[s.depth :] if isinstance(v, Token) and v.kind == "IF"]
    if not words or s.token.kind == "NAME":
        return None
    problem = _error(
        "E0110",
        "this 'if' has no 'else'",
        s.span(words[-1]),
        help="an 'if' in an expression has a value in every case: 'if c then a else b'",
    )
    return problem, Panic()


_RULES: tuple[Callable[[Situation], Finding | None], ...] = (
    _modelica,
    _block_not_closed,
    _stray_end,
    _reserved,
    _outside_when,
    _assign_sign,
    _comparison_sign,
    _unknown_unit,
    _misspelt,
    _no_else,
    _brackets_of_others,
    _open_bracket,
    _missing_semicolon,
    _missing_operator,
    _no_keyword,
)


def _unexpected(s: Situation) -> Finding:
    """Say what could stand here."""
    expected = _in_words(s)
    found = _found(s.token)
    message = f"expected {expected}, found {found}" if expected else f"{found} cannot stand here"
    span = _behind(s) if s.token.kind == END else s.span(s.token)
    return _error("E0110", message, span), Panic()


def _in_words(s: Situation) -> str:
    kinds = s.expected
    if s.at_beginning:
        return "an action such as 'reinit(..)' or 'n := ..'" if "REINIT" in kinds else "a statement"
    words: list[str] = []
    if s.bracket is None or s.bracket.kind != "LSQB":
        kinds = kinds - {"COLON"} or kinds
    if kinds & {"NAME", "SEMICOLON"}:
        kinds = kinds - {"DOT", "STRING"}
    if {"NUMBER", "LPAR", "MINUS"} <= kinds:
        words.append("an expression")
        kinds = kinds & {"RPAR", "SEMICOLON", "RBRACE", "RSQB"}
    elif kinds & _OPERATORS:
        kinds = kinds - _OPERATORS - {"DOT", "LPAR", "LSQB", "UNITTAG", "FOR"}
    words += sorted(_SIGNS[k] for k in kinds if k in _SIGNS)
    words += [f"'{w}'" for w in _words(kinds)]
    if len(words) > 6:
        words = [w for w in words if w[0] != "'" or not w[1].isalpha()]
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " or " + words[-1] if words else ""
