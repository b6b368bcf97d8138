"""Formulas as people write them in settings: several in one text, momenta by short names, sides of a surface."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from ..runtime.problem import Problem
from ..runtime.settings import QuestionSetting
from .parse_values import UsageMistake, read_value


def apart(text: str) -> list[str]:
    """Take formulas apart at the commas between them, not at those within brackets."""
    found, depth = [""], 0
    for letter in text:
        depth += (letter in "([{") - (letter in ")]}")
        if letter == "," and depth == 0:
            found.append("")
        else:
            found[-1] += letter
    return [one.strip() for one in found if one.strip()]


def in_momenta(text: str, names: Sequence[str], taken: Collection[str]) -> str:
    """Write momentum(x) for p_x, and for p where there is one coordinate alone."""
    rates = [name[4:-1] for name in names if name.startswith("der(") and name.endswith(")")]
    known = {f"p_{name}": name for name in rates} | ({"p": rates[0]} if len(rates) == 1 else {})
    for short in {*names, *taken} & known.keys():
        del known[short]

    def written(match: re.Match[str]) -> str:
        name = "".join(match[0].split())
        return f"momentum({known[name]})" if name in known else match[0]

    part = r"[A-Za-z_]\w*(?:\[[\d, ]+\])?"
    return re.sub(rf"(?<![\w.]){part}(?:\.{part})*", written, text)


def is_value(text: str) -> bool:
    """Tell whether a text is a value with or without a unit, not a formula."""
    try:
        read_value(text)
    except UsageMistake:
        return False
    return True


def sides(setting: QuestionSetting, text: str) -> tuple[str, str]:
    """Take ``a = b`` apart."""
    left, sign, right = text.replace("==", "=").partition("=")
    if not sign or not left.strip() or not right.strip() or any(c in text for c in "<>~") or "=" in right:
        raise UsageMistake(f"'{setting.name}' is a surface such as 'x = 0', not '{text}'")
    return left.strip(), right.strip()


def output_of(setting: QuestionSetting) -> str:
    """Return the name of the output that the formula of a setting becomes."""
    return f"asked_{setting.name}"


def settable_units(problem: Problem) -> dict[str, str]:
    """Return the SI unit of everything that a state consists of and a run can be given."""
    quantities = (*problem.parameters, *problem.states, *problem.inputs)
    return {q.name: q.unit for q in quantities if q.kind not in ("account", "tangent")}
