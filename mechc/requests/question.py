"""From what people write, in names and units, to a study: the question as the runtime knows it, in SI."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

from ..runtime.problem import Problem
from ..runtime.settings import (
    EQUILIBRIUM,
    FORMULAS,
    START,
    Formula,
    FormulaSurface,
    Free,
    Frequencies,
    Place,
    QuestionSetting,
    Range,
    settings_of,
)
from ..runtime.studies.study import Study
from .ensemble_settings import OF_ENSEMBLES
from .input_tables import input_tables
from .parse_values import (
    GivenValue,
    UsageMistake,
    apart,
    elements_of,
    in_momenta,
    is_value,
    output_of,
    plain,
    read_point,
    read_value_of,
    settable_units,
    shown,
    sides,
    tidy,
    unknown_name,
)
from .request import Asked, known_of

if TYPE_CHECKING:
    from ..runtime.fitting.measured import Measured


def study(it: Asked, problem: Problem) -> Study:
    """Return the question in SI, without values of the model that were changed. Raises UsageMistake, SimulationError."""
    kinds = known_of(it.question).settings
    settings: dict[str, Any] = {n: _READ[kinds[n].kind](kinds[n], w, problem) for n, w in it.given.items()}
    return it.question(
        experiment=it.experiment,
        inputs=input_tables(problem, it.inputs, functions=not it.question.of_members),
        progress=it.progress,
        follower=it.to,
        **settings,
    )


def _time(setting: QuestionSetting, given: object, problem: Problem) -> float:
    if not isinstance(given, str):
        return _number(setting, given, problem)
    value = read_value_of(setting.name, given)
    if not value.single:
        raise UsageMistake(f"'{setting.name}' is one time, not a list")
    return value.in_unit(problem.time.unit, setting.name)[0]


def _number(setting: QuestionSetting, given: Any, problem: Problem) -> float:
    try:
        return float(given)
    except (TypeError, ValueError):
        example = "1e-9" if setting.name == "tolerance" else "2.5"
        name = "the tolerance" if setting.name == "tolerance" else f"'{setting.name}'"
        raise UsageMistake(f"{name} is a number such as {example}, not {shown(given)}") from None


def _count(setting: QuestionSetting, given: Any, problem: Problem) -> int:
    try:
        number = float(given)
    except (TypeError, ValueError):
        number = -1.0
    if number < 1 or number != int(number):
        raise UsageMistake(f"'{setting.name}' is a whole number from 1 on, not {shown(given)}")
    return int(number)


def _flag(setting: QuestionSetting, given: object, problem: Problem) -> bool:
    if not isinstance(given, bool):
        raise UsageMistake(f"'{setting.name}' is True or False, not {shown(given)}")
    return given


def _text(setting: QuestionSetting, given: object, problem: Problem) -> str:
    if not isinstance(given, str):
        raise UsageMistake(f"'{setting.name}' is a text, not {shown(given)}")
    return given


def _names(setting: QuestionSetting, given: Any, problem: Problem) -> tuple[str, ...]:
    """Read names of quantities; that of a vector stands for its elements."""
    wanted = names_in(given) if isinstance(given, str) else [tidy(name) for name in given]
    known = [q.name for q in (*problem.states, *problem.outputs, *problem.inputs) if q.kind != "account"]
    for name in wanted:
        if elements_of(name, [q.name for q in problem.discretes]) and not elements_of(name, known):
            raise UsageMistake(
                f"'{name}' is discrete, and '{setting.name}' takes coordinates, states, outputs and inputs",
                f"declare an output of the model: 'output y = {name};'",
            )
    return chosen_names(wanted, known)


def _directions(setting: QuestionSetting, given: Any, problem: Problem) -> tuple[str, ...]:
    """Read names of parameters, initial values and inputs; the name of a vector stands for its elements."""
    wanted = names_in(given) if isinstance(given, str) else [tidy(name) for name in given]
    units = settable_units(problem)
    found: list[str] = []
    for name in wanted:
        if "=" in name or ".." in name:
            raise UsageMistake(
                f"'{setting.name}' takes names alone, not '{name}'",
                f"derivatives are taken at the values of the run: {setting.name} = {name.partition('=')[0].strip()}",
            )
        elements = elements_of(name, units)
        if not elements:
            raise unknown_name("parameter, initial value or input", name, units)
        found += elements
    return tuple(dict.fromkeys(found))


def names_in(text: str) -> list[str]:
    """Take ``x, grid[1, 2].m`` apart: commas between names, not those in indices. Raises UsageMistake for no name."""
    names = [name for name in re.split(r",(?![^\[]*\])", tidy(text)) if name]
    if not names:
        raise UsageMistake(
            f"'{text}' names nothing", "leave the option out, or give names: 'x, grid[1, 2].m'"
        )
    return names


def chosen_names(wanted: Iterable[str], known: Sequence[str]) -> tuple[str, ...]:
    """Return the quantities that are meant; the name of a vector stands for its elements. Raises UsageMistake."""
    names: list[str] = []
    for name in wanted:
        found = elements_of(name, known) or [n for n in known if n.startswith((f"{name}[", f"{name}."))]
        if not found:
            raise unknown_name("coordinate, state, output, input or discrete variable", name, known)
        names += found
    return tuple(dict.fromkeys(names))


def _place(setting: QuestionSetting, given: Any, problem: Problem) -> Place:
    """Read ``start``, ``equilibrium``, or values of coordinates, rates, states, parameters and inputs."""
    from .in_si import settings_in_si

    if isinstance(given, str) and "=" not in given:
        word = given.strip()
        if word not in (START, EQUILIBRIUM):
            raise UsageMistake(
                f"'{setting.name}' is {START}, {EQUILIBRIUM}, or values of the state, not {shown(given)}",
                f'values are given as {setting.name} = "theta = 30 deg, der(theta) = 0"',
            )
        return Place(word)
    values = assignments(setting, given) if isinstance(given, str) else dict(given)
    return Place(START, settings_in_si(values, settable_units(problem), _rotations(problem)))


def _point(setting: QuestionSetting, given: Any, problem: Problem) -> str:
    """Read the coordinates of a point; the text holds them in SI."""
    return ", ".join(map(repr, read_point(setting.name, _text(setting, given, problem))))


def assignments(setting: QuestionSetting, text: str) -> dict[str, str]:
    """Take ``a = 1, b[1, 2] = {1, 2} m`` apart."""
    found: dict[str, str] = {}
    for part in _SEPARATOR.split(text):
        name, sign, value = part.partition("=")
        if not sign or not name.strip() or not value.strip():
            raise UsageMistake(
                f"'{setting.name}' takes values as in 'name = value, ...', not '{part.strip()}'"
            )
        found[tidy(name)] = value.strip()
    return found


_SEPARATOR = re.compile(r",(?=[^=,{}\[\]]*(?:\[[^\]]*\][^=,{}\[\]]*)*=)")
"""The comma before the next name: those within indices and lists separate no assignments."""


def _ranges(setting: QuestionSetting, given: Any, problem: Problem) -> tuple[Range, ...]:
    from .ranges import ranges

    return ranges(setting.name, given, settable_units(problem))


def _free(setting: QuestionSetting, given: Any, problem: Problem) -> tuple[Free, ...]:
    from .ranges import free

    return free(setting.name, given, settable_units(problem))


def _amounts(setting: QuestionSetting, given: Any, problem: Problem) -> dict[str, float]:
    """Read positive amounts of quantities: ``theta = 1 mrad, x = 2 mm``."""
    from .in_si import settings_in_si

    values = assignments(setting, given) if isinstance(given, str) else dict(given)
    units = {q.name: q.unit for q in (*problem.states, *problem.outputs, *problem.inputs)}
    found = settings_in_si(values, units)
    for name, amount in found.items():
        if not amount > 0:
            raise UsageMistake(f"'{setting.name}' of '{name}' is a positive number, not {amount:g}")
    return found


def _data(setting: QuestionSetting, given: Any, problem: Problem) -> tuple[Measured, ...]:
    """Read files, or mappings from names to columns in SI; one or several."""
    from .measured_data import measured_motion

    one = isinstance(given, (str, PathLike, Mapping)) or hasattr(given, "columns")
    return tuple(measured_motion(what, problem) for what in ([given] if one else given))


def _rotations(problem: Problem) -> set[str]:
    return {problem.states[i].name.removesuffix("[1]") for i in problem.rotations}


def formulas(it: Asked, problem_names: Sequence[str], taken: Collection[str] = ()) -> dict[str, str]:
    """Give the formulas of a question that are not plain names or values: texts by the names of their outputs.

    ``taken``: names of parameters and the like, which are not momenta whatever they look like.
    """
    found: dict[str, str] = {}
    for setting in settings_of(it.question):
        given = it.given.get(setting.name)
        if setting.kind not in FORMULAS or not isinstance(given, str):
            continue
        if ";" in given:
            raise UsageMistake(f"'{setting.name}' is one formula, not '{given}'")
        text = given
        if setting.kind == "kept":
            from .kept import written

            for k, item in enumerate(written(setting.name, given), start=1):
                if item.formula and tidy(item.formula) not in problem_names:
                    found[f"{output_of(setting)}_{k}"] = item.formula
            continue
        if setting.kind == "formulas":
            for k, one in enumerate(apart(given), start=1):
                formula = in_momenta(one.rpartition("=")[2], problem_names, taken)
                if tidy(one) not in problem_names:
                    found[f"{output_of(setting)}_{k}"] = formula
            continue
        if setting.kind == "condition":
            text = f"if {given} then 1 else 0"
        if setting.kind == "surface":
            left, right = sides(setting, given)
            text = left if is_value(right) else f"({left}) - ({right})"
        if not (tidy(text) in problem_names or (setting.kind == "interval" and is_value(text))):
            found[output_of(setting)] = text
    return found


def _several(setting: QuestionSetting, given: object, problem: Problem) -> tuple[Formula, ...]:
    """Read formulas, each with or without a name in front; the text keeps it."""
    known = {q.name for q in (*problem.states, *problem.outputs)}
    found = []
    for k, one in enumerate(apart(_text(setting, given, problem)), start=1):
        name = tidy(one) if tidy(one) in known else f"{output_of(setting)}_{k}"
        if name not in known:
            raise UsageMistake(f"'{setting.name}' takes numbers, '{one}' is a vector")
        found.append(Formula(name, one))
    return tuple(found)


def _formula(setting: QuestionSetting, given: object, problem: Problem) -> Formula:
    text = _text(setting, given, problem)
    return Formula(_named(setting, text, problem), text.strip())


def _condition(setting: QuestionSetting, given: object, problem: Problem) -> Formula:
    return Formula(output_of(setting), _text(setting, given, problem).strip())


def _named(setting: QuestionSetting, text: str, problem: Problem) -> str:
    """Return the name of the quantity that a formula is."""
    known = [q.name for q in (*problem.states, *problem.outputs)]
    name = tidy(text) if tidy(text) in known else output_of(setting)
    if name not in known:
        raise UsageMistake(f"'{setting.name}' is one number, '{text}' is a vector")
    return name


def _surface(setting: QuestionSetting, given: object, problem: Problem) -> FormulaSurface:
    text = _text(setting, given, problem)
    left, right = sides(setting, text)
    if not is_value(right):
        return FormulaSurface(_named(setting, f"({left}) - ({right})", problem), 0.0, text)
    name = _named(setting, left, problem)
    (unit,) = {q.unit for q in (*problem.states, *problem.outputs) if q.name == name}
    return FormulaSurface(name, read_value_of(setting.name, right).in_unit(unit, left)[0], text)


def _interval(setting: QuestionSetting, given: object, problem: Problem) -> float | Formula:
    if isinstance(given, str) and not is_value(given):
        return _formula(setting, given, problem)
    return _time(setting, given, problem)


def _energy(setting: QuestionSetting, given: object, problem: Problem) -> float:
    if not isinstance(given, str):
        return _number(setting, given, problem)
    units = [q.unit for q in problem.outputs if q.kind == "energy"]
    if not units:
        raise UsageMistake(f"'{setting.name}' needs a model with energies, and this one has none")
    value = read_value_of(setting.name, given)
    if not value.single:
        raise UsageMistake(f"'{setting.name}' is one energy, not a list")
    return value.in_unit(units[0], setting.name)[0]


def _frequencies(setting: QuestionSetting, given: Any, problem: Problem) -> Frequencies:
    """Read ``1 Hz .. 100 Hz, 50``, ``{1, 2, 5} Hz``, or numbers in rad per unit of time. Cycles are told from radians by ``Hz``."""
    from .ranges import unit_of_the_other

    if not isinstance(given, str):
        several = plain(given)
        listed = several if isinstance(several, Iterable) else (several,)
        return Frequencies(_sorted(setting, (_number(setting, one, problem) for one in listed)), bare=True)
    low, dots, high = (part.strip() for part in given.partition(".."))
    if not dots:
        value = read_value_of(setting.name, given)
        return Frequencies(
            _sorted(setting, _angular(setting, value, problem)), hertz=_cycles(value), bare=value.unit is None
        )
    high, comma, many = (part.strip() for part in high.rpartition(",")) if "," in high else (high, "", "")
    if comma and not (many.isdigit() and int(many) > 1):
        raise UsageMistake(f"the number of '{setting.name}' is a whole number from 2 on, not {many}")
    ends = [read_value_of(setting.name, end) for end in (unit_of_the_other(low, high), high)]
    first, last = (_angular(setting, end, problem)[0] for end in ends)
    if not 0 <= first < last:
        raise UsageMistake(f"'{setting.name}' go from a lower to a higher value, not from {low} to {high}")
    return Frequencies(
        low=first,
        high=last,
        count=int(many) if many else None,
        hertz=_cycles(ends[1]),
        bare=ends[1].unit is None,
    )


def _cycles(value: GivenValue) -> bool:
    return value.unit is not None and value.unit.symbol.endswith("Hz")


def _angular(setting: QuestionSetting, value: GivenValue, problem: Problem) -> tuple[float, ...]:
    per_time = f"1/{problem.time.unit}" if problem.time.unit else ""
    numbers = value.in_unit(per_time, setting.name)
    return tuple(2 * math.pi * number for number in numbers) if _cycles(value) else numbers


def _sorted(setting: QuestionSetting, numbers: Iterable[float]) -> tuple[float, ...]:
    found = tuple(sorted(set(numbers)))
    if not found or not all(number >= 0 and math.isfinite(number) for number in found):
        raise UsageMistake(f"'{setting.name}' are numbers from 0 on, such as \"1 Hz .. 100 Hz\"")
    return found


_READ: Mapping[str, Callable[[QuestionSetting, Any, Problem], object]] = {
    "time": _time,
    "number": _number,
    "count": _count,
    "flag": _flag,
    "text": _text,
    "names": _names,
    "place": _place,
    "ranges": _ranges,
    "directions": _directions,
    "formula": _formula,
    "formulas": _several,
    "condition": _condition,
    "surface": _surface,
    "interval": _interval,
    "energy": _energy,
    "free": _free,
    "amounts": _amounts,
    "data": _data,
    "point": _point,
    "frequencies": _frequencies,
    **OF_ENSEMBLES,
}
"""How each kind of setting (``runtime/settings.py``) is read."""


def chosen_pairs(wanted: Iterable[str], known: Sequence[str]) -> tuple[str, ...]:
    """Return the quantities that are meant, with pairs ``a:b`` of one over another. Raises UsageMistake."""
    names: list[str] = []
    for name in wanted:
        across, colon, up = name.partition(":")
        ends = chosen_names([across], known), chosen_names([up], known) if colon else ()
        if colon and len(ends[0]) != len(ends[1]):
            raise UsageMistake(
                f"'{across}' and '{up}' have different numbers of elements", "name one of each"
            )
        names += [f"{a}:{b}" for a, b in zip(*ends, strict=True)] if colon else ends[0]
    return tuple(dict.fromkeys(names))
