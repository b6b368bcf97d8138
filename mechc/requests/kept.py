"""What is kept of each member of an ensemble, as people write it: ``max(theta), period = first(theta < 0 rad), energy.total``."""

from __future__ import annotations

import re
from collections.abc import Collection

from msgspec import Struct

from ..runtime.ensembles.kept import GROWN, REDUCTIONS, SERIES, Kept
from .parse_values import UsageMistake, apart, tidy
from .request import Asked, known_of

_CALL = re.compile(r"(\w+)\s*\((.*)\)\s*", re.S)
_NAMED = re.compile(r"\s*([A-Za-z_]\w*)\s*=(?!=)\s*(.*)", re.S)
_RELATION = re.compile(r"<=|>=|==|!=|<|>")


class KeptText(Struct, frozen=True):
    """One thing to keep: its label, how it is reduced, and the formula of which number; of events a kind and a row."""

    label: str
    kind: str
    formula: str = ""
    event: str = ""
    row: str = ""


def written(setting: str, given: str) -> list[KeptText]:
    """Take a list of what is kept apart. Raises UsageMistake."""
    text = given.strip()
    if text.startswith("{") and text.endswith("}"):
        text = text[1:-1]
    found = [_one(setting, item) for item in apart(text)]
    if not found:
        raise UsageMistake(f"'{setting}' names nothing", f'as in {setting} = "max(theta), final(x)"')
    return found


def kept(setting: str, given: str, names: Collection[str], output_of: str) -> tuple[Kept, ...]:
    """Return what is kept with the names of its quantities: those of the model, else the outputs made for formulas."""
    found = []
    for k, one in enumerate(written(setting, given), start=1):
        quantity = tidy(one.formula)
        if quantity and quantity not in names:
            quantity = f"{output_of}_{k}"
            if quantity not in names:
                raise UsageMistake(f"'{setting}' takes numbers, '{one.formula}' is a vector")
        found.append(Kept(one.label, one.kind, quantity, one.event, one.row))
    return tuple(found)


def parts_of_kept(it: Asked) -> frozenset[str]:
    """Return the parts of the equations that what is kept is formed of."""
    asked = ((name, it.given.get(name)) for name in known_of(it.question).lists)
    kinds = {one.kind for name, text in asked if isinstance(text, str) for one in written(name, text)}
    return frozenset({"growth"} if kinds.intersection(GROWN) else ())


def _one(setting: str, item: str) -> KeptText:
    named = _NAMED.fullmatch(item)
    label, text = (named[1], named[2].strip()) if named else ("", item)
    label = label or " ".join(text.split())
    call = _call(text)
    if call is not None and call[0] in GROWN:
        if call[1].strip() != "time":
            raise UsageMistake(
                f"'{call[0]}' is of the whole run, not of '{call[1]}'", f"it is written {call[0]}(time)"
            )
        return KeptText(label, call[0])
    if call is not None and call[0] == "rms":  # a mean up to the end is none over time
        return KeptText(label, "final", text)
    if call is None or call[0] not in REDUCTIONS:
        return KeptText(label, SERIES, text)
    word, inside = call
    parts = apart(inside)
    if word == "events":
        if len(parts) > 2:
            raise UsageMistake(f"'{text}' counts a kind of events of one row: events(impact, floor)")
        event, row = [*parts, "", ""][:2]
        return KeptText(label, word, "", event.strip("\"' "), tidy(row))
    if word in ("max", "min") and len(parts) > 1:  # of several formulas, at each time
        return KeptText(label, SERIES, text)
    if len(parts) != 1:
        raise UsageMistake(f"'{word}' is of one formula: '{text}'")
    return KeptText(label, word, _difference(text, inside) if word == "first" else inside.strip())


def _call(text: str) -> tuple[str, str] | None:
    """Return name and inside of a text that is one call as a whole."""
    match = _CALL.fullmatch(text)
    if match is None:
        return None
    depth = 0
    for letter in match[2]:
        depth += (letter in "([{") - (letter in ")]}")
        if depth < 0:
            return None  # as in max(a) - min(b)
    return match[1], match[2]


def _difference(text: str, condition: str) -> str:
    """Return a formula that becomes positive where a condition becomes true."""
    signs = list(_RELATION.finditer(condition))
    words = re.search(r"\b(and|or|not)\b", condition)
    if len(signs) != 1 or signs[0][0] in ("==", "!=") or words:
        raise UsageMistake(f"'{text}' takes one comparison by <, <=, > or >=", "as in first(theta < 0 rad)")
    left, right = condition[: signs[0].start()].strip(), condition[signs[0].end() :].strip()
    if not left or not right:
        raise UsageMistake(f"'{text}' compares nothing", "as in first(theta < 0 rad)")
    return f"({left}) - ({right})" if signs[0][0][0] == ">" else f"({right}) - ({left})"
