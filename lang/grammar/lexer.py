"""Text to tokens.

Keywords come out as NAME; the parser knows where they are reserved. What users of other languages
write by habit is reported and then read as what was meant, so that one slip gives one message.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from typing import NamedTuple

from ..ast import Comment
from ..diagnostics import CompileError, Reporter
from ..source import SourceFile, Span
from ..units import unit_end
from .tables import END, ParserTables


class Token(NamedTuple):
    """``kind`` is a terminal of the grammar; ``text`` is what was written, or what it was mended to."""

    kind: str
    text: str
    start: int
    end: int


_made = tuple.__new__  # half the time of Token(...), which every word of a text pays

MOST_ERRORS = 5
"""Reading a file stops after so many errors."""

# What stands in other languages for a sign or word of this one: ((kind, text) ..., what to write).
_FOREIGN: Mapping[str, tuple[tuple[tuple[str, str], ...], str]] = {
    "**": ((("CARET", "^"),), "a power is written '^', as in 'x^2'"),
    "!=": ((("RELATION", "<>"),), "'not equal' is written '<>'"),
    "~=": ((("RELATION", "<>"),), "'not equal' is written '<>'"),
    "&&": ((("NAME", "and"),), "write 'and'"),
    "||": ((("NAME", "or"),), "write 'or'"),
    "!": ((("NAME", "not"),), "write 'not'"),
    "\u2212": ((("MINUS", "-"),), "write the minus sign of the keyboard, '-'"),
    "\u2013": ((("MINUS", "-"),), "write the minus sign of the keyboard, '-'"),
    "\u00b7": ((("STAR", "*"),), "a product is written '*'"),
    "\u22c5": ((("STAR", "*"),), "a product is written '*'"),
    "\u00d7": ((("STAR", "*"),), "a product is written '*', a vector product 'cross(a, b)'"),
    "\u00b2": ((("CARET", "^"), ("NUMBER", "2")), "write '^2'"),
    "\u00b3": ((("CARET", "^"), ("NUMBER", "3")), "write '^3'"),
    "\u2264": ((("RELATION", "<="),), "write '<='"),
    "\u2265": ((("RELATION", ">="),), "write '>='"),
    "\u2260": ((("RELATION", "<>"),), "'not equal' is written '<>'"),
    "\u2192": ((("ARROW", "->"),), "write '->'"),
}
_FOREIGN_SIGN = re.compile("|".join(re.escape(s) for s in sorted(_FOREIGN, key=len, reverse=True)))

_MEANT: Mapping[str, str] = {
    "|": "an absolute value is written 'abs(x)', a length 'norm(v)', 'or' in words",
    "&": "write 'and'",
    "%": "a remainder is written 'mod(x, y)', five percent '5 %', a comment begins with '//'",
    "?": "a choice is written 'if c then a else b'",
    "'": "a derivative is written 'der(x)', a text \"...\"",
}

_REORDERING = re.compile("[\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]")
"""The bidirectional control characters of Unicode: with them a text is shown in another order than it is read."""

_BLANKS = re.compile(r"[ \t]+")
_STRANGE_NAME = re.compile(r"[^\W\d\u00b2\u00b3][^\W\u00b2\u00b3]*")
_GLUED = re.compile(r"((?:[0-9]+(?:\.[0-9]+)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)([A-Za-z_\u00b0]\w*|%)")
_MALFORMED = re.compile(r"0[xX][0-9A-Fa-f]+|[0-9][0-9_.]*(?:[eE][+-]?(?![0-9]))?")
_PRIMES = re.compile(r"'+")
_QUOTED = re.compile(r"'[^'\n]*'|[\u201c\u201d\u201e][^\u201c\u201d\u201e\"\n]*[\u201c\u201d\u201e]")


def tokenise(
    source: SourceFile, tables: ParserTables, reporter: Reporter, piece: tuple[int, int] | None = None
) -> tuple[list[Token], tuple[Comment, ...]]:
    """Return the tokens of a text, or of a piece from one offset to another, with one of kind ``$END`` last, and the comments.

    Slips are recorded in ``reporter`` and mended. Raises CompileError for characters that reorder what is shown.
    """
    piece = piece or (0, len(source.text))
    if not source.text.isascii():
        _refuse_reordering(source, piece, reporter)
    lexer = _Lexer(source, tables, reporter)
    lexer.run(*piece)
    return lexer.tokens, tuple(lexer.comments)


def _refuse_reordering(source: SourceFile, piece: tuple[int, int], reporter: Reporter) -> None:
    found = [*_REORDERING.finditer(source.text, *piece)][:MOST_ERRORS]
    for match in found:
        name = unicodedata.name(match[0])
        reporter.error(
            "E0131",
            f"an invisible character changes the order in which the text is shown: U+{ord(match[0]):04X} {name.lower()}",
            Span(source, *match.span()),
            help="delete it: an editor shows this text in another order than it is compiled",
        )
    if found:
        raise CompileError(reporter.diagnostics)


def _pattern(tables: ParserTables) -> re.Pattern[str]:
    patterns = tables.patterns
    signs = sorted(tables.punctuation, key=lambda s: (-len(s), s))
    groups = [f"(?P<{name}>{patterns[name]})" for name in ("COMMENT", "NAME", "NUMBER", "STRING")]
    groups.append(r"(?P<FOREIGN>\*\*|~=)")
    groups.append("(?P<ARROW>->)")
    groups.append(f"(?P<RELATION>{patterns['RELATION']})")
    groups.append("(?P<SIGN>" + "|".join(re.escape(s) for s in signs) + ")")
    return re.compile(r"[ \t\n]*(?:" + "|".join(groups) + ")")


class _Lexer:
    def __init__(self, source: SourceFile, tables: ParserTables, reporter: Reporter) -> None:
        self.source = source
        self.text = source.text
        self.reporter = reporter
        self.punctuation = tables.punctuation
        self.match = _pattern(tables).match
        self.tokens: list[Token] = []
        self.comments: list[Comment] = []
        self.reported: set[str] = set()  # names and signs, once each

    def run(self, position: int, length: int) -> None:
        text = self.text
        taken = self.tokens.append
        while position < length:
            match = self.match(text, position, length)
            if match is None:
                position = length - len(text[position:length].lstrip(" \t\n"))
                if position < length:
                    position = self.mend(position)
                if len(self.reporter.diagnostics) >= MOST_ERRORS:
                    break
                continue
            kind = match.lastgroup
            assert kind is not None
            start, position = match.span(kind)
            value = text[start:position]
            if value == "/" and text.startswith("*", position):
                position = self.mend(start)
            elif kind == "SIGN":
                kind = self.punctuation[value]
                taken(_made(Token, (kind, value, start, position)))
                if kind == "RPAR" or kind == "RBRACE":
                    position = self.unit(position)
            elif kind == "NAME":
                if position < length and text[position] > "\x7f" and _STRANGE_NAME.match(text, position):
                    position = self.mend(start)
                else:
                    taken(_made(Token, (kind, value, start, position)))
            elif kind == "NUMBER":
                position = self.number(start, position)
            elif kind == "COMMENT":
                self.comments.append(Comment(value, span=Span(self.source, start, position)))
            elif kind == "FOREIGN":
                position = self.foreign(start, position)
            else:
                taken(_made(Token, (kind, value, start, position)))
        self.tokens.append(Token(END, "", length, length))

    def unit(self, position: int) -> int:
        """Take a unit after a closing brace or parenthesis on the same line."""
        blanks = _BLANKS.match(self.text, position)
        if blanks is None:
            return position
        end = unit_end(self.text, blanks.end())
        if end == blanks.end() or self.text.startswith("^", end):
            return position
        self.tokens.append(Token("UNITTAG", self.text[blanks.end() : end], blanks.end(), end))
        return end

    def number(self, start: int, position: int) -> int:
        """Take a number and, after blanks on the same line, its unit."""
        text = self.text
        if text.startswith((".", "\u00b0", "%"), position):
            return self.mend(start)
        blanks = _BLANKS.match(text, position)
        if blanks is not None:
            end = unit_end(text, blanks.end())
            if end > blanks.end() and not text.startswith("^", end):
                self.tokens.append(Token("QUANTITY", text[start:end], start, end))
                return end
        self.tokens.append(Token("NUMBER", text[start:position], start, position))
        return position

    def error(self, code: str, message: str, start: int, end: int, caption: str = "", help: str = "") -> None:
        self.reporter.error(code, message, Span(self.source, start, end), caption=caption, help=help)

    def foreign(self, start: int, end: int) -> int:
        sign = self.text[start:end]
        replacement, help = _FOREIGN[sign]
        self.error("E0121", f"'{sign}' is not a symbol of this language", start, end, help=help)
        last = self.tokens[-1] if self.tokens else None
        if sign in "\u00b2\u00b3" and last and last.kind in ("QUANTITY", "UNITTAG") and last.end == start:
            power = "".join(text for _, text in replacement)
            self.tokens[-1] = Token(last.kind, last.text + power, last.start, end)  # a power of the unit
            return end
        self.tokens.extend(Token(kind, text, start, end) for kind, text in replacement)
        return end

    def mend(self, start: int) -> int:
        """Report what is not a token, read it as what was probably meant, and return where to go on."""
        text = self.text
        if text.startswith('"', start):
            return self.unclosed_string(start)
        if text.startswith("/*", start):
            self.error("E0108", "a comment is not closed", start, start + 2, help="close it with '*/'")
            return len(text)
        if match := _GLUED.match(text, start):
            return self.glued(start, match[1], match[2])
        if match := _MALFORMED.match(text, start):
            return self.malformed(start, match[0], match.end())
        if match := _FOREIGN_SIGN.match(text, start):
            return self.foreign(start, match.end())
        if match := _STRANGE_NAME.match(text, start):
            return self.strange_name(start, match[0], match.end())
        last = self.tokens[-1] if self.tokens else None
        if last and last.end == start and last.kind in ("NAME", "RPAR", "RSQB") and text[start] == "'":
            return self.primes(start, last)
        if match := _QUOTED.match(text, start):
            help = 'write "..." with the straight double quotes of the keyboard'
            self.error("E0122", "a text stands in double quotes", start, match.end(), help=help)
            self.tokens.append(Token("STRING", f'"{match[0][1:-1]}"', start, match.end()))
            return match.end()
        if text.startswith("#", start):
            end = text.find("\n", start)
            end = len(text) if end < 0 else end
            self.error("E0122", "a comment begins with '//'", start, start + 1, help="write '//' for '#'")
            return end
        self.unexpected(start)
        return start + 1

    def primes(self, start: int, last: Token) -> int:
        """Leave out the primes of ``x'`` and ``x''``."""
        match = _PRIMES.match(self.text, start)
        assert match is not None
        order, name = len(match[0]), last.text if last.kind == "NAME" else ".."
        help = f"write 'der({name})'" if order == 1 else f"write 'der({name}, {order})'"
        if order == 1 and last.kind == "NAME":
            help += f"; a transposed matrix is 'transpose({name})'"
        self.error("E0121", "a derivative is not written by primes", start, match.end(), help=help)
        return match.end()

    def unclosed_string(self, start: int) -> int:
        """Take the text up to the end of the line, or to the semicolon there."""
        end = self.text.find("\n", start)
        end = len(self.text) if end < 0 else end
        content = self.text[start + 1 : end].rstrip()
        if content.endswith(";"):
            content = content[:-1].rstrip()
        end = start + 1 + len(content)
        help = "a text begins and ends with '\"' on one line"
        self.error(
            "E0107", "a text is not closed", start, end, caption="no closing '\"' on this line", help=help
        )
        self.tokens.append(Token("STRING", '"' + content.replace("\\", "") + '"', start, end))
        return end

    def glued(self, start: int, number: str, word: str) -> int:
        """Take a number that runs into a word: a unit or a name."""
        begin = start + len(number)
        end = unit_end(self.text, begin)
        if word == "\u00b0" or end >= begin + len(word):
            unit = "deg" if word == "\u00b0" else self.text[begin:end]
            end = max(end, begin + 1)
            help = f"write '{number} {unit}'"
            if len(word) == 1 and word.isalpha() and unit == word:
                help += f"; a product is written '{number}*{word}'"
            message = f"a blank is missing between the number and the unit '{unit}'"
            if word == "\u00b0":
                message = "the unit of degrees is 'deg'"
            self.error("E0113", message, start, end, help=help)
            self.tokens.append(Token("QUANTITY", f"{number} {unit}", start, end))
            return end
        if word in ("e", "E") or word.startswith("_") or (number == "0" and word[0] in "xX"):
            match = _MALFORMED.match(self.text, start)
            end = max(match.end() if match else 0, begin + len(word))
            return self.malformed(start, self.text[start:end], end)
        end = begin + len(word)
        help = f"a product is written '{number}*{word}', a quantity '9.81 m/s^2' with a blank"
        self.error("E0113", f"the number '{number}' runs into the name '{word}'", start, end, help=help)
        self.tokens.append(Token("NUMBER", number, start, begin))
        self.tokens.append(Token("STAR", "*", begin, begin))
        self.tokens.append(Token("NAME", word, begin, end))
        return end

    def malformed(self, start: int, number: str, end: int) -> int:
        help = "numbers look like '2', '0.5' or '1.5e-3'"
        if number.endswith(".") and number[:-1].isdigit():
            help = f"write '{number}0' or '{number[:-1]}'"
        elif ".." in number:
            help = "a range is written '1:3'"
        self.error("E0109", f"'{number}' is not a number", start, end, help=help)
        self.tokens.append(Token("NUMBER", "1", start, end))
        return end

    def strange_name(self, start: int, name: str, end: int) -> int:
        unit = (
            name.replace("\u00b5", "u")
            .replace("\u03bc", "u")
            .replace("\u2126", "Ohm")
            .replace("\u03a9", "Ohm")
        )
        before = self.tokens[-1] if self.tokens else None
        if before and before.kind == "NUMBER" and unit.isascii() and unit_end(unit) == len(unit):
            help = f"write '{before.text} {unit}'"
            self.error("E0112", f"the unit '{name}' is written '{unit}'", start, end, help=help)
            self.tokens[-1] = Token("QUANTITY", f"{before.text} {unit}", before.start, end)
            return end
        plain = "".join(_plain(letter) for letter in name)
        if name not in self.reported:
            self.reported.add(name)
            strange = next(letter for letter in name if letter > "\x7f")
            help = f"write '{plain}'" if plain.isascii() and plain.isidentifier() else ""
            self.error(
                "E0106",
                f"'{strange}' cannot be part of a name",
                start,
                end,
                caption="names are made of the letters a to z, A to Z, digits and '_'",
                help=help,
            )
        self.tokens.append(Token("NAME", plain if plain.isascii() else f"_{start}", start, end))
        return end

    def unexpected(self, start: int) -> None:
        sign = self.text[start]
        if sign in self.reported:
            return
        self.reported.add(sign)
        name = unicodedata.name(sign, "").casefold()
        if sign == "\u00b0":
            self.error("E0105", "'\u00b0' cannot stand here", start, start + 1, help="write '30 deg'")
        elif sign.isprintable() and not sign.isspace():
            self.error("E0105", f"'{sign}' cannot stand here", start, start + 1, help=_MEANT.get(sign, ""))
        else:
            what = name or f"control character {ord(sign):#04x}"
            self.error("E0105", f"an invisible {what} cannot stand here", start, start + 1, help="delete it")


def _plain(letter: str) -> str:
    """Spell a letter in a to z: the name of a Greek one, the base of one with an accent."""
    if letter <= "\x7f":
        return letter
    base = unicodedata.normalize("NFKD", letter)[0]
    if base <= "\x7f":
        return base
    words = unicodedata.name(base, "").split()
    if words[:1] == ["GREEK"] and "LETTER" in words:
        greek = words[words.index("LETTER") + 1].casefold().replace("lamda", "lambda")
        return greek if "SMALL" in words else greek.capitalize()
    return letter
