"""A twin in pure numbers: every quantity in SI without its unit, every type of a quantity left out."""

from __future__ import annotations

import re
from random import Random

from random_models.tree import Model, statement
from random_models.twins import Twin, plain_units

_NUMBER = r"\d+\.?\d*(?:e[+-]?\d+)?"
_UNIT = r"(?:kg|m|s|A|K|mol|cd|rad|N|J|W|Pa|Hz|C|V|Ohm|F|Wb|H|T)(?:\^-?\d+(?:\.\d+)?|\^\(-?\d+/\d+\))?"
_UNITS = rf"(?:1/)?{_UNIT}(?:[./]{_UNIT})*"
_QUANTITY = re.compile(rf"(?<![\w.])({_NUMBER}) {_UNITS}(?![\w.(\"^/])")
_BEHIND = re.compile(rf"(?<=[)}}]) {_UNITS}(?=[);,\s*/+-])")
_LEFT = re.compile(rf"(?<![\w.])(?:{_NUMBER}|[)}}]) (?!loop|then|and|or|else|elseif|if|on|at|from|in|to|for|end|static|along|"
                   r"restitution|friction\b)[A-Za-z]")  # fmt: skip
_TYPED = re.compile(r"\b(parameter|coordinate|state|input|output|discrete|let|\(|,) ?(?!Integer|Boolean|Real|Rotation)[A-Z][A-Za-z]+ "
                    r"(?=[a-z]\w*\d)")  # fmt: skip
_RESULT = re.compile(r"-> (?!Integer|Boolean|Real)[A-Z]\w+")


def dimensionless(model: Model, random: Random) -> Twin | None:
    """Say a model of formulas alone in pure numbers."""
    if any(s.kind in ("import", "class", "component") for s in model.statements()):
        return None
    plain = plain_units(model, random)
    text = plain.model.text() if plain is not None else model.text()
    if "display" in text or "unit " in text:
        return None
    text = _QUANTITY.sub(r"\1", text)
    text = _BEHIND.sub("", text)
    if _LEFT.search(re.sub(r'"[^"]*"|//.*', "", text)):
        return None  # a unit that is none of SI
    text = _TYPED.sub(lambda m: m[1] + ("" if m[1] == "(" else " ") + ("Real " if m[1] in "(," else ""), text)
    text = _RESULT.sub("-> Real", text)
    text = re.sub(r"^(model \w+)", r"\1 dimensionless;", text, flags=re.M)
    return Twin("dimensionless", Model((statement("text", text),)))
