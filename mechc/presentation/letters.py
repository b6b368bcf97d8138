"""Names and units as pictures show them: mathematical letters, dots for rates, raised exponents."""

from __future__ import annotations

import re

from .numbers import as_quotient

_LETTERS = """alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau upsilon phi
chi psi omega Gamma Delta Theta Lambda Xi Pi Sigma Upsilon Phi Psi Omega"""
_GREEK = frozenset(_LETTERS.split())
_SIMPLE = re.compile(r"([A-Za-z]+?)(?:_([A-Za-z]+)|_?(\d+))?(?:\[(\d+(?:,\d+)*),?\])?")
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def letters(name: str) -> str:
    """Return a name as Matplotlib writes it: ``theta[2]`` as a Greek letter with an index; parts of a path as they are."""
    if match := re.fullmatch(r"der\(([^()]+)\)(\[[\d,]+\])?", name):
        parts = _parts(match[1] + (match[2] or ""))
        return rf"$\dot{{{parts[0]}}}{parts[1]}$" if parts and parts[2] else name
    parts = _parts(name)
    if parts is None:
        return name
    head, index, symbol = parts
    return f"${head}{index}$" if symbol else f"{head}${index}$" if index else head


def unit_text(unit: str) -> str:
    """Return a unit with points between its factors, one stroke and raised exponents: ``kg.m^2/s`` as kg·m²/s."""
    raised = re.sub(r"\^(-?\d+)", lambda m: m[1].translate(_RAISED), as_quotient(unit))
    return raised.replace(".", "·")


def axis_label(name: str, unit: str) -> str:
    """Return a name with its unit after it."""
    return f"{letters(name)} {unit_label(unit)}".rstrip()


def unit_label(unit: str) -> str:
    """Return a unit in brackets; nothing for a pure number."""
    return f"[{unit_text(unit)}]" if unit and unit != "1" else ""


def _parts(name: str) -> tuple[str, str, bool] | None:
    """Return letter, index and whether the letter is one of mathematics; None for a path or a call."""
    match = _SIMPLE.fullmatch(name)
    if match is None:
        return None
    head = match[1]
    if len(head) > 1 and head not in _GREEK:
        if match[2] or match[3]:  # a word and its number stay together
            return (name.partition("[")[0], f"_{{{match[4]}}}", False) if match[4] else None
        return head, f"_{{{match[4]}}}" if match[4] else "", False
    lower = ",".join(_word(part) for part in (match[2], match[3], match[4]) if part)
    return (rf"\{head}" if head in _GREEK else head), (f"_{{{lower}}}" if lower else ""), True


def _word(text: str) -> str:
    if text in _GREEK:
        return rf"\{text}"
    return text if len(text) == 1 or not text.isalpha() else rf"\mathrm{{{text}}}"
