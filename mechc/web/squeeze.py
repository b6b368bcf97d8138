"""Scripts of pages without what only people need who read them here: comments, indentation, and blanks about signs."""

from __future__ import annotations

import re

_COMMENTS = re.compile(r"^\s*(//.*|/\*\*(.|\n)*?\*/)\n", re.MULTILINE)
_MARGINS = re.compile(r"^ +| +// [^'`\"\n]*$", re.MULTILINE)
_BLANKS = re.compile(r" *([^\w$ \n+'\"`-]) *")
"""A sign and the blanks about it; + and - may stand next to each other, which means something else."""
_WORDS = re.compile(r"'(?:\\.|[^'\\])*'|\"(?:\\.|[^\"\\])*\"")
_PATTERN = re.compile(r"/(?:\\.|\[(?:\\.|[^\]\\])*\]|[^/\\\n\[])+/[a-z]*")
_BEFORE_PATTERN = re.compile(r"(?:^|[(,=:!&|?{};>]|\breturn)\s*$")
"""What stands before a regular expression, and never before a division."""


def squeezed(script: str) -> str:
    """Return a script that means the same."""
    text = _MARGINS.sub("", _COMMENTS.sub("", script))
    found, at = _code(text, 0)
    assert at == len(text), f"a bracket is closed that was not opened: {text[at : at + 40]!r}"
    return found


def _code(text: str, at: int) -> tuple[str, int]:
    """Return squeezed code up to the bracket that closes it, and where that is."""
    found, begun, depth = "", at, 0

    def taken(until: int) -> str:
        return found + _BLANKS.sub(r"\1", text[begun:until])

    while at < len(text):
        sign = text[at]
        if sign in "'\"" or (sign == "/" and _BEFORE_PATTERN.search(text, begun, at)):
            word = (_WORDS if sign != "/" else _PATTERN).match(text, at)
            assert word is not None, f"no end: {text[at : at + 40]!r}"
            found, at = taken(at) + word[0], word.end()
            begun = at
            continue
        if sign == "`":
            found = taken(at)
            template, at = _template(text, at + 1)
            found, begun = found + template, at
            continue
        depth += (sign == "{") - (sign == "}")
        if depth < 0:
            break
        at += 1
    return taken(at), at


def _template(text: str, at: int) -> tuple[str, int]:
    """Return a template from behind its first sign on, with the code in it squeezed, and where it ends."""
    found = "`"
    while text[at] != "`":
        if text.startswith("${", at):
            code, end = _code(text, at + 2)
            found, at = f"{found}${{{code}}}", end + 1
        else:
            size = 2 if text[at] == "\\" else 1
            found, at = found + text[at : at + size], at + size
    return found + "`", at + 1
