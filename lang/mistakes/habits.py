"""Rules for what comes from other languages and from notation on paper.

Each rule looks at the place where a token does not fit, and returns the error and a repair, or
None where it knows nothing. ``syntax_errors.py`` asks them in order.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from mechc.suggest import closest

from ..builtins import BUILTINS
from ..grammar.keywords import ACTIONS, KEYWORDS, RESERVED, STATEMENTS
from ..grammar.lexer import Token
from ..grammar.tables import END
from ..source import Span
from ..units import NAMED_TYPES, TEMPERATURES, suggest_unit, unit_end
from .expected import OPERATORS, Finding, error, unexpected
from .recovery import Panic, Situation, TokenEdit

_SUMMED = ("kinetic", "potential", "lagrangian", "dissipation", "gravity")
_NAMED = ("force", "torque", "contact", "friction")
_DECLARED = ("parameter", "coordinate", "state", "discrete", "input", "output", "let")

_CONDITIONS = ("IF", "ELSEIF", "WHEN", "ELSEWHEN", "ASSERT", "AND", "OR", "NOT", "LPAR")

# Words that Modelica has and this language has not, with what to write.
_MODELICA: Mapping[str, str] = {
    "connect": "connect a part where you declare it: a joint to frames, 'Revolute pin(world -> bar.a);', a part of one dimension to angles "
    "or lengths, 'Gear g(motor.angle -> load.angle);'",
    "algorithm": "a model has no steps: write 'let', 'equation der(x) = ..;' or 'when', steps in a 'function'",
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


# Words of Python at the beginning of a statement, with what to write.
_PYTHON: Mapping[str, str] = {
    "class": "write 'model {name} .. end {name};'",
    "def": "write 'function {name}(Real x) = x^2;', or with steps 'function {name}(Real x) -> Real .. end {name};'",
    "from": "write 'import mech.planar.*;' or 'import mech.planar.{{Bar, Spring}};'",
    "import": "an import names a file of models, 'import mech.planar.*;'; functions such as 'sin' are always there",
    "print": "write 'output name = ..;': outputs are reported at all times",
    "while": "what happens at instants is written 'when condition then .. end when;'",
    "elif": "write 'elseif'",
}


# Words of mechanics that begin no statement, with what to write.
_MECHANICS: Mapping[str, str] = {
    "spring": "write its energy, 'potential 1/2*k*x^2;', or a part, 'Spring s(world -> bar.a, k = 3 N/m);' from 'mech.planar'",
    "damper": "write 'damping c on x;', or a part, 'Damper d(world -> bar.a, c = 3 N.s/m);' from 'mech.planar'",
    "rod": "write 'mass' and 'inertia' on a frame, or a part, 'Bar bar(length = 1 m, m = 1 kg);' from 'mech.planar'",
    "joint": "a joint is a part: 'Revolute pin(world -> bar.a);' from 'mech.planar' or 'mech.spatial'",
    "motor": "write 'torque 3 N.m on th;', or 'drive th = ..;' for a given motion",
    "velocity": "write 'initial der(x) = 1 m/s;'",
    "energy": "write 'kinetic ..;' and 'potential ..;'",
}


def mechanics(s: Situation) -> Finding | None:
    """A word of mechanics with a value, as if it were a statement: ``spring 3 N/m on x;``."""
    first = s.tokens[s.first]
    help = _MECHANICS.get(first.text)
    if help is None or s.index != s.first + 1 or s.token.kind in ("NAME", "DOT"):
        return None
    return error("E0120", f"no statement begins with '{first.text}'", s.span(first), help=help), Panic()


def python(s: Situation) -> Finding | None:
    """Words of Python at the beginning of a statement."""
    first, second = s.tokens[s.first], s.tokens[min(s.first + 1, len(s.tokens) - 1)]
    if first.text not in _PYTHON:
        return None
    third = s.tokens[min(s.first + 2, len(s.tokens) - 1)]
    if first.text == "class" and third.kind not in ("COLON", "LPAR"):
        return None
    if first.text == "import" and s.token.text != "as":
        return None
    help = _PYTHON[first.text].format(name=second.text)
    return error("E0120", f"'{first.text}' is Python", s.span(first), help=help), Panic()


def modelica(s: Situation) -> Finding | None:
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
        return error("E0120", message, s.span(first).to(s.span(s.tokens[s.first + 1])), help=help), Panic()
    if word is None:
        return None
    help = _MODELICA.get(word.text, "leave the word out")
    return error("E0120", f"'{word.text}' is Modelica", s.span(word), help=help), Panic()


def assignment_sign(s: Situation) -> Finding | None:
    """':=' for '=' and the reverse."""
    if s.token.kind == "ASSIGN":
        problem = error(
            "E0118",
            "':=' is allowed only in 'when' and in functions",
            s.span(s.token),
            help="write '=': what a model states holds at all times",
        )
        if s.accepts("EQUAL"):
            return problem, TokenEdit(delete=1, insert=(("EQUAL", "="),))
        target = s.source.text[s.tokens[s.first].start : s.tokens[s.index - 1].end] if s.index else "n"
        help = f"for an abbreviation write 'let {target} = ..;', for a jump 'when .. then {target} := ..;'"
        return error("E0118", problem.message, s.span(s.token), help=help), Panic()
    if s.token.kind == "EQUAL" and s.accepts("ASSIGN"):
        problem = error(
            "E0118",
            "an action of 'when' sets a value by ':='",
            s.span(s.token),
            help="write ':=' for a discrete variable, 'reinit(x, ..)' for a coordinate or rate",
        )
        return problem, TokenEdit(delete=1, insert=(("ASSIGN", ":="),))
    return None


def equals_behind_keyword(s: Situation) -> Finding | None:
    """``potential V = e``, ``force F = f on q``: what is added up has no name, and names stand before ':'."""
    first, between = s.tokens[s.first], s.index - s.first - 1
    if s.token.kind != "EQUAL" or not s.is_keyword(s.first):
        return None
    if first.text in _SUMMED and between <= 1:
        help = f"write '{first.text} ..;'"
        if between:
            help += f"; for an abbreviation 'let {s.tokens[s.first + 1].text} = ..;'"
        problem = error(
            "E0110", f"'{first.text}' takes a value, no name and no '='", s.span(s.token), help=help
        )
        return problem, Panic() if between else TokenEdit(delete=1)
    if first.text in _NAMED and between == 1:
        help = f"a name stands before ':', as in '{first.text} {s.tokens[s.first + 1].text}: ..;'"
        return error("E0110", f"'{first.text}' takes no '='", s.span(s.token), help=help), Panic()
    return None


def several_at_once(s: Situation) -> Finding | None:
    """``coordinate x = 1 m, y = 2 m;``"""
    first = s.tokens[s.first]
    if (
        s.token.kind != "COMMA"
        or s.bracket is not None
        or first.text not in _DECLARED
        or not s.accepts("SEMICOLON")
    ):
        return None
    problem, repair = unexpected(s)
    help = f"each has a statement of its own: '{first.text} ..; {first.text} ..;'"
    if s.following.text == "der" and s.index + 1 < len(s.tokens):
        help = "a rate at the start has a statement of its own: 'initial der(..) = ..;'"
    return error(problem.code, problem.message, problem.span or s.span(s.token), help=help), repair


def choice_behind_value(s: Situation) -> Finding | None:
    """``a if c else b``"""
    if s.token.text != "if" or s.at_beginning or s.begins_line or not s.accepts("STAR"):
        return None
    help = "write 'if c then a else b'"
    return error("E0110", "a choice begins with its condition", s.span(s.token), help=help), Panic()


def comparison_sign(s: Situation) -> Finding | None:
    """'=' in a condition and '==' in an equation."""
    if s.token.kind == "EQUAL" and s.accepts("RELATION"):
        words = [v for v in s.values[s.depth :] if isinstance(v, Token) and v.kind in (*_CONDITIONS, "EQUAL")]
        if words and words[-1].kind in _CONDITIONS:
            problem = error(
                "E0119", "'=' does not compare", s.span(s.token), help="a comparison is written '=='"
            )
            return problem, TokenEdit(delete=1, insert=(("RELATION", "=="),))
    if s.token.text == "==" and s.accepts("EQUAL"):
        problem = error("E0119", "'==' gives no value", s.span(s.token), help="write '='")
        return problem, TokenEdit(delete=1, insert=(("EQUAL", "="),))
    if s.token.kind in ("SEMICOLON", "STRING", "RPAR") and s.accepts("EQUAL"):
        signs = [t for t in s.tokens[s.first : s.index] if t.text == "=="]
        if len(signs) == 1:
            help = "write '=': '==' is for conditions"
            return error("E0119", "an equation is written with '='", s.span(signs[0]), help=help), Panic()
    return None


def statement_without_keyword(s: Situation) -> Finding | None:
    """An equation or expression where a statement should begin."""
    first = s.tokens[s.first]
    if s.token.kind == "LSQB" and s.at_beginning:
        return _several_results(s)
    if first.text not in ("der", "pre") and (s.index == s.first or s.is_keyword(s.first)):
        return None
    if s.token.kind == "EQUAL" and s.index == s.first + 2 and s.previous:
        name = s.previous.text
        if first.text in NAMED_TYPES:
            help = (
                f"say what '{name}' is: 'parameter {first.text} {name} = ..;', "
                f"'coordinate ..', 'state ..' or 'let ..'"
            )
            message = f"a declaration begins with a keyword, not with the type '{first.text}'"
            return error("E0125", message, s.span(first), help=help), Panic()
    if s.at_beginning and first.kind == "NAME":
        help = "write 'equation der(x) = ..;' for a state, 'initial der(q) = ..;' for a rate at the start"
        if "REINIT" in s.expected:
            help = f"write 'reinit({first.text}(x), ..);' for a new value"
        return error("E0125", "a statement begins with a keyword", s.span(first), help=help), Panic()
    if (rate := _rate_in(s)) is not None:
        return rate
    if s.token.kind not in ("EQUAL", "TILDE", "LPAR", "LSQB", "DOT", *OPERATORS):
        return None
    if s.token.kind != "LPAR" and s.index > s.first + 1 and s.tokens[s.index - 2].kind != "DOT":
        return None
    left = s.source.text[first.start : s.tokens[s.index - 1].end]
    whole, _, attribute = left.rpartition(".")
    if whole and attribute == "start":
        help = f"write 'initial {whole} = ..;' for a known value, 'initial {whole} ~ ..;' for a guess"
        return error("E0125", "a statement begins with a keyword", s.span(first), help=help), Panic()
    help = f"write 'let {left} = ..;', 'initial {left} = ..;' or 'constraint {left} = ..;'"
    return error("E0125", "a statement begins with a keyword", s.span(first), help=help), Panic()


def _several_results(s: Situation) -> Finding:
    """``[t, x] = ode45(..)``"""
    end = next((t.start for t in s.tokens[s.index :] if t.kind in ("SEMICOLON", END)), s.token.end)
    help = "a function has one value; a vector is written '{1, 2, 3}'"
    if re.search(r"\b(ode\d+\w*|odeint|solve_ivp)\b", s.source.text[s.token.start : end]):
        help = "a run integrates by itself: write energies and forces, and 'experiment(stop = 10 s);'"
    return error("E0125", "a statement begins with a keyword", s.span(s.token), help=help), Panic()


def _rate_in(s: Situation) -> Finding | None:
    """An equation in which a rate has a factor or a term beside it: ``L*der(i) = u - R*i``, ``m*der(der(x)) = F``."""
    first = s.tokens[s.first]
    ends = (t.start for t in s.tokens[s.first :] if t.kind in ("SEMICOLON", END) or t.text == "=")
    left = s.source.text[first.start : next(ends, first.end)].strip()
    rate = re.search(r"\bder\s*\(\s*(der\s*\(\s*)?([\w.\[\]]+)\s*(,\s*2\s*)?\)", left)
    if rate is None or (first.text in ("der", "pre") and rate.end() == len(left)):
        return None
    help = f"write 'equation der({rate[2]}) = ..;', solved for the rate"
    if rate[1] or rate[3]:
        help = f"accelerations follow from energies and forces: 'kinetic 1/2*m*der({rate[2]})^2;' and 'force .. on {rate[2]};'"
    return error("E0125", "a statement begins with a keyword", s.span(first), help=help), Panic()


def action_outside_when(s: Situation) -> Finding | None:
    first = s.tokens[s.first]
    if first.text not in ACTIONS or first.text in STATEMENTS or s.is_keyword(s.first):
        return None
    message = f"'{first.text}' is allowed only in 'when'"
    help = f"write 'when .. then {first.text} ..; end when;'"
    return error("E0110", message, s.span(first), help=help), Panic()


def block_in_when(s: Situation) -> Finding | None:
    """``if`` and ``for`` among the actions of a ``when``; the whole block is passed over."""
    word = s.token.text
    if word not in ("if", "for") or not s.at_beginning or "REINIT" not in s.expected:
        return None
    help = "put the choice into the value, 'n := if c then a else n;', or into a 'when' of its own"
    if word == "for":
        help = "put the 'for' around the 'when'"
    problem = error("E0110", f"'{word}' is not an action of a 'when'", s.span(s.token), help=help)
    open_blocks = 0
    for index in range(s.index, len(s.tokens) - 2):
        if s.tokens[index].text == word and s.tokens[index - 1].text in (";", "then", "else", "loop"):
            open_blocks += 1
        if s.tokens[index].text == "end" and s.tokens[index + 1].text == word:
            open_blocks -= 1
            if not open_blocks:
                return problem, TokenEdit(delete=index + 3 - s.index)
    return problem, Panic()


def braces_around_block(s: Situation) -> Finding | None:
    """``model a { .. }`` as in C: blocks begin with their own words and end with 'end'."""
    ends = s.token.kind == "RBRACE" and s.at_beginning and s.bracket is None and s.block is not None
    if not ends and (
        s.token.kind != "LBRACE" or s.line(s.following) == s.line(s.token) or s.accepts("LBRACE")
    ):
        return None
    begins = next((k for k in ("THEN", "LOOP") if s.accepts(k)), None)
    if not ends and not begins and not s.at_beginning:
        return None
    if s.block is None:
        return None
    text, tokens = s.block_end
    where = s.span(s.token)
    if ends and s.following.text in ("else", "elseif", "elsewhen"):
        return error("E0117", "blocks have no braces", where, help="leave it out"), TokenEdit(delete=1)
    if ends:
        return error(
            "E0117", "a block ends with a word, not with '}'", where, help=f"write '{text}'"
        ), TokenEdit(delete=1, insert=tokens)
    if begins:
        help = f"write '{begins.casefold()}' here, and 'end' with the word of the block at its end"
        repair = TokenEdit(delete=1, insert=((begins, begins.casefold()),))
        return error("E0117", "blocks have no braces", where, help=help), repair
    help = f"leave it out; the block ends with '{text}'"
    return error("E0117", "blocks have no braces", where, help=help), TokenEdit(delete=1)


def foreign_brackets(s: Situation) -> Finding | None:
    """Vectors, units and decimals as other languages write them."""
    before, token, after = s.previous, s.token, s.following
    help = ""
    if token.kind == "LSQB" and before and before.kind == "RSQB":
        help = (
            "indices stand together, as in 'x[1, 2]'; each bracket of components has its name: 'part[1].x[2]'"
        )
    elif token.kind == "COLON" and s.bracket and s.bracket.kind == "LPAR" and "LBRACE" in s.expected:
        help = "elements stand in brackets, as in 'A[:, 1]'; parentheses are those of functions"
    elif token.kind == "LSQB" and "LBRACE" in s.expected:
        help = "a vector is written '{1, 2, 3}'"
    elif token.kind == "LSQB" and before and before.kind == "NUMBER" and after.kind == "NAME":
        help = f"a unit has no brackets: '{before.text} {after.text}'"
    elif token.kind == "COMMA" and before and before.kind == "NUMBER" and before.end == after.start - 1:
        help = (
            f"a decimal point is written '.': '{before.text}.{after.text}'" if after.text[0].isdigit() else ""
        )
    elif token.kind == "COMMA" and s.tokens[s.first].text == "assert" and after.kind == "STRING":
        help = f"an assertion has no parentheses: 'assert .., {after.text};'"
    elif token.kind == "COMMA" and s.bracket and s.bracket.kind == "LPAR" and s.accepts("RPAR"):
        help = "a vector is written '{1, 2, 3}'"
    if not help:
        return None
    problem, repair = unexpected(s)
    return error(problem.code, problem.message, s.span(token), help=help), repair


def reserved_word(s: Situation) -> Finding | None:
    """A word of the language where a name should stand."""
    word = s.token.text
    if word not in RESERVED or not s.accepts("NAME") or s.at_beginning or s.begins_line:
        return None
    message = f"'{word}' is a reserved word and cannot be a name"
    problem = error("E0126", message, s.span(s.token), help=f"choose another name, for example '{word}_'")
    return problem, TokenEdit(delete=1, insert=(("NAME", f"{word}_"),))


def missing_operator(s: Situation) -> Finding | None:
    """An operand directly after an operand."""
    before, token = s.previous, s.token
    if before is None or token.kind not in ("NAME", "NUMBER", "QUANTITY", "LPAR", "LBRACE"):
        return None
    if not s.accepts("STAR") or token.text in KEYWORDS or s.begins_line:
        return None
    if s.bracket is None and not s.accepts("SEMICOLON"):
        return None  # a word such as 'on' or 'then' is missing as well
    help = f"a product is written '{before.text}*{token.text}'"
    first = s.tokens[s.first]
    end = unit_end(s.source.text, token.start)
    if before.kind == "QUANTITY" and end > token.start:
        help = f"a unit is written in one piece: '{before.text}.{s.source.text[token.start : end]}'"
    elif first.text in _NAMED and s.index == s.first + 2 and token.kind != "LPAR" and before.kind == "NAME":
        help = f"a name is followed by ':', as in '{first.text} {before.text}: ..'"
    if token.kind in ("LPAR", "LBRACE"):
        help = "a product is written with '*'"
    inverse = _inverse_unit(s, before, token)
    if inverse:
        help = f"a unit with nothing above its fraction is written with a power: '{before.text} {inverse}'"
    if before.text in BUILTINS:
        help = f"the argument of a function stands in parentheses: '{before.text}({token.text})'"
    if before.text.endswith("%"):
        divided = before.text.removesuffix("%").strip() or ".."
        help = f"a remainder is written 'mod({divided}, {token.text})'"
    message = f"an operator is missing between '{before.text}' and '{token.text}'"
    return error("E0110", message, s.span(token), help=help), TokenEdit(insert=(("STAR", "*"),))


def _inverse_unit(s: Situation, before: Token, token: Token) -> str:
    """Return ``m^-1`` for a number followed by ``1/m``; empty for anything else."""
    slash = s.tokens[s.index + 1] if s.index + 1 < len(s.tokens) else None
    if before.kind != "NUMBER" or token.text != "1" or slash is None or slash.text != "/":
        return ""
    unit = s.source.text[slash.end : unit_end(s.source.text, slash.end)]
    found = re.fullmatch(r"([^\W\d_]+)(?:\^(\d+))?([./].*)?", unit)
    return f"{found[1]}^-{found[2] or 1}{found[3] or ''}" if found else ""


def unknown_unit(s: Situation) -> Finding | None:
    """A word after a number, a brace or a parenthesis that is not a unit."""
    before, token = s.previous, s.token
    if before and before.kind == "NUMBER" and token.text == "in" and not s.accepts("IN"):
        help = f"write '{before.text} inch'"
        return error("E0112", "the unit of inches is 'inch'", s.span(token), help=help), TokenEdit(delete=1)
    if before is None or token.kind != "NAME" or s.begins_line or token.text in KEYWORDS:
        return None
    if before.kind not in ("NUMBER", "RPAR", "RBRACE") or not s.accepts("STAR"):
        return None
    if token.text == "do" or (closest(token.text, s.expected_words) and not suggest_unit(token.text)):
        return None
    text = s.source.text
    end = unit_end(text, token.start)
    if end > token.start and before.end == token.start:
        message = f"a blank is missing between '{before.text}' and the unit '{token.text}'"
        problem = error("E0113", message, s.span(token), help=f"write '{before.text} {token.text}'")
        return problem, TokenEdit(delete=1, insert=(("UNITTAG", token.text),))
    if end > token.start and text.startswith("^", end):
        help = f"write '({before.text} {token.text})^..' for the power of the quantity"
        if before.kind != "NUMBER":
            help = "a unit has powers of whole numbers only, such as 'm^2'"
        message = f"the power of the unit '{text[token.start : end]}' must be a number"
        return error("E0128", message, Span(s.source, token.start, end + 1), help=help), Panic()
    if end > token.start:
        return None
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
    if token.text.casefold() in TEMPERATURES:
        help = "temperatures are written in K"
        if before.kind == "NUMBER" and "c" in token.text.casefold():
            help += f": {float(before.text) + 273.15:.10g} K, and a difference is {before.text} K"
    problem = error("E0112", f"unknown unit '{token.text}'", s.span(token), help=help)
    return problem, TokenEdit(delete=index - s.index + 1)
