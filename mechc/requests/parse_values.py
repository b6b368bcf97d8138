"""Values that are given outside a model: ``l=80 cm``, ``theta=30 deg``, ``closed=false``, ``r={1, 2} m``."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Sequence
from reprlib import Repr
from typing import Any, Protocol, runtime_checkable

from msgspec import Struct

from ..lang.units import Unit, UnitError, may_count_turns, parse_unit
from ..runtime.problem import Problem
from ..runtime.settings import QuestionSetting
from ..suggest import closest

Scalar = float | int | bool | str

_SHORT = Repr()
_SHORT.maxstring = _SHORT.maxother = 80
shown = _SHORT.repr
"""A given value in a message, with its beginning and end where it is long."""


@runtime_checkable
class Numeric(Protocol):
    """A number or an array of NumPy."""

    def tolist(self) -> Any: ...


Given = Scalar | Iterable[float] | Numeric
"""What the Python API takes: a number in SI, a text with a unit, or several numbers; NumPy's too."""


class UsageMistake(ValueError):
    """What was asked for does not fit the model; ``help`` says what would."""

    def __init__(self, message: str, help: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.help = help

    def __str__(self) -> str:
        return f"{self.message}; {self.help}" if self.help else self.message


class GivenValue(Struct, frozen=True):
    """Numbers as given, one or several, with their unit (None for bare numbers, which are SI)."""

    numbers: tuple[float, ...]
    unit: Unit | None
    single: bool = True

    def in_unit(self, unit: str, name: str) -> tuple[float, ...]:
        """Return the numbers in SI. Raises UsageMistake where the dimension is not that of ``unit``."""
        if self.unit is None:
            return self.numbers
        wanted = parse_unit(unit or "1")
        if self.unit.dimension != wanted.dimension:
            raise UsageMistake(
                f"'{name}' is given in {self.unit.symbol}; "
                + (f"it has the unit {unit}" if unit not in ("", "1") else "it is a pure number")
            )
        if may_count_turns(self.unit, wanted):
            raise UsageMistake(
                f"'{name}' is given in {self.unit.symbol}, and its unit {unit} is of an angle: a turn is 2 pi rad",
                "turns are counted in rev/s or rpm; rad/s is the unit of angular frequencies",
            )
        factor = float(self.unit.factor)
        return tuple(number * factor for number in self.numbers)


_DIGITS = r"(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_NUMBER = re.compile(rf"\s*([-+]?)\s*(?:({_DIGITS})(?:\s*\*\s*(pi)\b)?|(pi)\b)(?:\s*/\s*({_DIGITS}))?")


def split_assignment(text: str) -> tuple[str, str]:
    """Take ``name=value`` apart. Raises UsageMistake where there is no ``=``."""
    name, sign, value = text.partition("=")
    if not sign or not name.strip() or not value.strip():
        raise UsageMistake(f"'{text}' is not of the form name=value")
    return tidy(name), value.strip()


def read_value(text: str) -> GivenValue:
    """Read ``1.5``, ``80 cm``, ``pi/3``, ``{1, 2, 3} mm``. Raises UsageMistake."""
    text = text.strip()
    if text.startswith("{"):
        inside, brace, rest = text[1:].partition("}")
        if not brace:
            raise UsageMistake(f"'{text}' has no closing brace")
        parts = [_number(part) for part in inside.split(",")]
        if any(tail for _, tail in parts):
            raise UsageMistake(
                f"'{text}' is not a list of numbers", "the unit stands after the brace: {1, 2} mm"
            )
        return GivenValue(tuple(number for number, _ in parts), _unit(rest.strip()), single=False)
    number, tail = _number(text)
    return GivenValue((number,), _unit(tail, text))


def read_value_of(name: str, text: str) -> GivenValue:
    """Read the value that is given for ``name``. Raises UsageMistake, which names it."""
    try:
        return read_value(text)
    except UsageMistake as mistake:
        raise UsageMistake(f"'{name}': {mistake.message}", mistake.help) from None


def read_point(name: str, text: str) -> list[float]:
    """Read the coordinates of a point in SI: ``10 cm, 0``, ``{1, 2} cm``; bare numbers are SI. Raises UsageMistake."""
    inside, _, unit = text.strip().removeprefix("{").partition("}")
    parts = [part for part in inside.split(",") if part.strip()]
    return [read_value_of(name, f"{part} {unit}").in_unit("m", name)[0] for part in parts]


def _number(text: str) -> tuple[float, str]:
    """Return the leading number of a text (``2.5``, ``1/3``, ``2*pi``, ``pi/4``) and what follows."""
    match = _NUMBER.match(text)
    if match is None:
        raise UsageMistake(
            f"'{text.strip()}' is not a number", 'a number with its unit, as in "80 cm" or "30 deg"'
        )
    sign, digits, times_pi, only_pi, divisor = match.groups()
    number = float(f"{sign}{digits or 1}") * (math.pi if times_pi or only_pi else 1.0)
    return number / float(divisor or 1), text[match.end() :].strip()


def _unit(text: str, whole: str = "") -> Unit | None:
    """Read a unit; ``whole``: with the number before it."""
    if not text:
        return None
    try:
        return parse_unit(text)
    except UnitError as error:
        help = f"did you mean '{error.suggestion}'?" if error.suggestion else ""
        if re.match(r",\s*\d", text):
            help = f"a decimal point is written '.': {whole.replace(',', '.', 1)}"
        if text == "°":
            help = f"write '{whole.removesuffix('°').strip()} deg'"
        raise UsageMistake(str(error), help) from None


def structural_value(text: Scalar) -> int | float | bool | str:
    """Read the value of a structural parameter: true, false, an integer, a number, or a word."""
    if not isinstance(text, str):
        return text
    if text in ("true", "false"):
        return text == "true"
    for kind in (int, float) if "_" not in text else ():  # Python reads 1_0 as ten
        try:
            return kind(text)
        except ValueError:
            continue
    return text.strip("\"'")


def one_of(word: object, known: Collection[str], what: str) -> None:
    """Raise UsageMistake where a word is none of those that are known."""
    if word not in known:
        near = closest(word, known) if isinstance(word, str) else None
        help = f"did you mean '{near}'?" if near else f"there are {', '.join(known)}"
        raise UsageMistake(f"there is no {what} {word!r}", help)


_INDEX = re.compile(r"\[[0-9,]+\]")


def unknown_name(kind: str, name: str, known: Iterable[str]) -> UsageMistake:
    """Return the exception for a name that the model has not, with the nearest one it has."""
    names = sorted(known)
    inside = [one for one in names if one.startswith(f"{name}.")]
    near = inside[0] if len(inside) == 1 else closest(name, names)
    if name.endswith("'") and f"der({name[:-1]})" in names:
        return UsageMistake(f"the model has no {kind} '{name}'", f"a rate is written 'der({name[:-1]})'")
    if several := [one for one in names if _INDEX.sub("", one) == name]:
        some = ", ".join(several[:3]) + (", ..." if len(several) > 3 else "")
        return UsageMistake(
            f"'{name}' is not a single {kind}, it is {some}", f"name one of them: {several[0]}"
        )
    if near:
        return UsageMistake(f"the model has no {kind} '{name}'", f"did you mean '{near}'?")
    some = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    return UsageMistake(
        f"the model has no {kind} '{name}'", f"it has: {some}" if names else f"it has no {kind} at all"
    )


def plain(what: Given) -> Scalar | Iterable[float]:
    """Return a number or an array of NumPy as plain numbers, everything else as it is."""
    if isinstance(what, (str, int)) or type(what) is float:  # a protocol is slow to ask
        return what
    if isinstance(what, Numeric):
        converted: Scalar | list[float] = what.tolist()
        return converted
    return what


def tidy(name: str) -> str:
    """Return a name as results have it: ``grid[2, 1].m`` is ``grid[2,1].m``."""
    return "".join(name.split())


def elements_of(name: str, names: Collection[str]) -> list[str]:
    """Return what a name stands for, in order: itself, or all elements, as ``grid.m`` and ``der(x)`` have them."""
    if name in names:
        return [name]
    match = _RATE.fullmatch(name)
    inner, index = (match[1], match[2]) if match else (name, "")
    every = r"\.".join(re.escape(p) + ("" if p.endswith("]") else _ANY) for p in inner.split("."))
    if not match:
        return [known for known in names if re.fullmatch(every, known)]
    if index:
        return [known for known in (f"der({inner}{index})",) if known in names]
    rates = re.compile(rf"der\({every}\){_ANY}")
    return [known for known in names if rates.fullmatch(known)]


_ANY = r"(?:\[[0-9,]+\])?"
_RATE = re.compile(r"der\((.+)\)(\[[0-9,]+\])?")


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
