"""Random edits of models that stay close to the language, so that they reach the later stages."""

from __future__ import annotations

import re
from random import Random

_TOKEN = re.compile(r"//[^\n]*|\"[^\"\n]*\"|[A-Za-z_]\w*|\d+(?:\.\d+)?(?:[eE][-+]?\d+)?|->|:=|\s+|.")
_WORD = re.compile(r"[A-Za-z_]\w*")
_NUMBER = re.compile(r"\d")
_NUMBERS = ("0", "1", "2", "3", "0.5", "7.25", "1e-3", "12")
_UNITS = ("m", "s", "kg", "rad", "deg", "N", "J", "m/s", "N.m", "kg.m^2", "m/s^2")
_SIGNS = ("+", "-", "*", "/", "^", "=", "~", "(", ")", "{", "}", "[", "]", ",", ";", ".", ":", "->", "<")
_WORDS = (
    "der", "pre", "if", "then", "else", "for", "in", "loop", "end", "sum", "sin", "sqrt", "norm", "cross", "rot",
    "trans", "world", "time", "pos", "vel", "energy", "momentum", "reaction", "structural", "parameter", "coordinate",
    "Rotation", "drive", "constraint", "frame", "mass", "inertia", "force", "on", "at", "potential", "initial",
)  # fmt: skip


def edited(text: str, random: Random) -> str:
    """Change one to four tokens or statements: replace, delete, repeat, swap."""
    tokens = _TOKEN.findall(text)
    for _ in range(random.choice((1, 1, 1, 2, 4))):
        places = [i for i, token in enumerate(tokens) if not token.isspace()]
        if not places:
            break
        i = random.choice(places)
        match random.randrange(16):
            case 0:
                del tokens[i]
            case 1:
                tokens.insert(i, tokens[i] + " ")
            case 2:
                j = random.choice(places)
                tokens[i], tokens[j] = tokens[j], tokens[i]
            case 3:
                tokens[i] = f"{tokens[i]} {random.choice(_UNITS)}"
            case 4 | 5 | 6 | 7:
                _edit_statement(tokens, i, random)
            case _:
                tokens[i] = _similar(tokens[i], tokens, random)
    return "".join(tokens)


def _similar(token: str, tokens: list[str], random: Random) -> str:
    """Return another token of the same kind: a number for a number, a word for a word, a sign for a sign."""
    if _NUMBER.match(token):
        return random.choice(_NUMBERS)
    if _WORD.match(token):
        words = [other for other in tokens if _WORD.match(other)]
        return random.choice(words) if random.random() < 0.7 else random.choice(_WORDS)
    return random.choice(_SIGNS)


def _edit_statement(tokens: list[str], i: int, random: Random) -> None:
    """Delete the statement around a token, or put it somewhere else too."""
    ends = [k for k, token in enumerate(tokens) if token == ";"]
    before = max((k for k in ends if k < i), default=-1)
    after = min((k for k in ends if k >= i), default=len(tokens) - 1)
    statement = tokens[before + 1 : after + 1]
    if random.random() < 0.5:
        del tokens[before + 1 : after + 1]
    else:
        place = random.choice([-1, *ends]) + 1
        tokens[place:place] = ["\n", *statement]
