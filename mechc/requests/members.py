"""The members of an ensemble, as people write them: ``l = 0.5 m .. 2 m, 200; theta ~ normal(1 rad, 0.01 rad)``."""

from __future__ import annotations

import itertools
import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..runtime.ensembles.members import NUMBERS, Axis, Listed, Spread
from ..suggest import closest
from .in_si import settings_in_si
from .input_tables import bare_angle, factor_of
from .parse_values import UsageMistake, read_value_of, shown, tidy, unknown_name
from .tables import TableFile, sheet_of_file

_SIGN = re.compile(r"[=~]")
_CALL = re.compile(r"(\w+)\s*\((.*)\)", re.S)
_COUNT = re.compile(r"\d+(?:[eE]\+?\d+)?")

Varying = Axis | Spread | Listed


def varying(setting: str, given: Any, units: Mapping[str, str]) -> tuple[Varying, ...]:
    """Read what differs between members. ``given``: a text, the path of a CSV file, or a mapping from names to texts, to
    numbers in SI or to lists of these; of several names, ``("a", "b")``, to rows [n, names] that belong together. ``units``: SI units of what may vary. Raises UsageMistake and SimulationError."""
    if isinstance(given, (Path, TableFile)) or (
        isinstance(given, str) and given.strip().lower().endswith(".csv")
    ):
        return (_of_file(given, units),)
    if isinstance(given, str):
        return tuple(_of_text(setting, name, what, units) for name, what in _items(setting, given))
    if not isinstance(given, Mapping):
        raise UsageMistake(
            f"'{setting}' is a text, a CSV file, or values by their names, not {shown(given)}",
            f'{setting} = "l = 0.5 m .. 2 m, 200"',
        )
    found: list[Varying] = []
    for name, what in given.items():
        if isinstance(name, tuple):
            found.append(_side_by_side([_known(tidy(one), units) for one in name], what, units))
            continue
        key = _known(tidy(name), units)
        if isinstance(what, str):
            text = what.strip()
            found.append(_of_text(setting, key, text if text[:1] == "~" else f"={text}", units))
        else:
            found.append(Axis(key, units[key], _numbers(key, list(what), units[key])))
    return tuple(found)


def refuse_structural(given: Any, structural: Collection[str]) -> None:
    """Raise UsageMistake where what is to vary names a structural parameter."""
    names: list[Any] = []
    if isinstance(given, Mapping):
        names = [one for key in given for one in (key if isinstance(key, tuple) else (key,))]
    elif isinstance(given, str) and not given.strip().lower().endswith(".csv"):
        names = [_SIGN.split(part)[0] for part in re.split("[,;]", given) if _SIGN.search(part)]
    for name in (tidy(one) for one in names if isinstance(one, str)):
        if name in structural:
            raise UsageMistake(
                f"'{name}' is structural: each of its values is a model of its own, and an ensemble is of one model",
                f"set it, --set {name}=2, in an ensemble for each value; or sweep it in an experiment, "
                f"experiment sizes({name} in {{2, 3}})",
            )


def _items(setting: str, text: str) -> list[tuple[str, str]]:
    """Take ``a = 0 .. 1, 20, b ~ normal(0, 1)`` apart: names, and what follows them with its sign."""
    parts, depth = [""], 0
    for letter in text:
        depth += (letter in "([{") - (letter in ")]}")
        if letter in ",;" and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    found: list[tuple[str, str]] = []
    for part in (one.strip() for one in parts):
        if not part:
            continue
        sign = _SIGN.search(part)
        if sign is not None and sign.start() > 0:
            found.append((tidy(part[: sign.start()]), part[sign.start() :]))
        elif found and _COUNT.fullmatch(part) and ".." in found[-1][1] and "," not in found[-1][1]:
            found[-1] = (found[-1][0], f"{found[-1][1]}, {part}")
        else:
            raise UsageMistake(
                f"'{setting}' takes names with ranges, values or distributions, not '{part}'",
                f'as in {setting} = "l = 0.5 m .. 2 m, 200" or {setting} = "theta ~ normal(1 rad, 0.01 rad)"',
            )
    if not found:
        raise UsageMistake(f"'{setting}' names nothing", f'as in {setting} = "l = 0.5 m .. 2 m, 200"')
    return found


def _known(name: str, units: Mapping[str, str]) -> str:
    if name not in units:
        raise unknown_name("parameter, initial value or input", name, units)
    return name


def _of_text(setting: str, name: str, text: str, units: Mapping[str, str]) -> Varying:
    unit = units[_known(name, units)]
    sign, what = text[0], text[1:].strip()
    call = _CALL.fullmatch(what)
    if call is not None and call[1] != "linspace":
        return _spread(setting, name, call[1], call[2], unit)
    if sign == "~":
        raise UsageMistake(
            f"'{name} ~ {what}' is not a distribution",
            f"there are {', '.join(f'{kind}(...)' for kind in NUMBERS)}",
        )
    if what.startswith("{") and not what.partition("}")[0].strip("{ "):
        raise UsageMistake(f"'{name}' has no values: there would be no members", f'"{name} = {{A, B, C}}"')
    if what.startswith("{"):
        return Axis(name, unit, np.array(read_value_of(name, what).in_unit(unit, name)))
    if call is not None:
        ends = [one.strip() for one in call[2].split(",")]
        if len(ends) != 3:
            raise UsageMistake(f"'linspace' takes a first and a last value and a number, not '{what}'")
        what = f"{ends[0]} .. {ends[1]}, {ends[2]}"
    low, dots, rest = (piece.strip() for piece in what.partition(".."))
    high, _, count = (piece.strip() for piece in rest.partition(","))
    if not (dots and low and high):
        raise UsageMistake(
            f"the values of '{name}' are a range, a list or a distribution, not '{what}'",
            f'"{name} = LOW .. HIGH, COUNT", "{name} = {{A, B, C}}" or "{name} ~ normal(MEAN, DEVIATION)"',
        )
    if not count:
        raise UsageMistake(f"the number of values of '{name}' is missing", f'"{name} = {low} .. {high}, 20"')
    if not _COUNT.fullmatch(count) or int(float(count)) < 1:
        raise UsageMistake(f"the number of values of '{name}' is a whole number from 1 on, not {count}")
    first, last = _pair(name, [low, high], unit)
    n = int(float(count))
    if n > 1 and first == last:
        raise UsageMistake(f"the range of '{name}' begins where it ends: {n} values would be the same")
    return Axis(name, unit, np.linspace(first, last, n) if n > 1 else np.array([first]))


def _pair(name: str, texts: Sequence[str], unit: str) -> list[float]:
    """Return values in SI; the unit of the last serves bare ones before it, as in ``0 .. 1 rad``."""
    tail = texts[-1].lstrip("+-.0123456789eE ").strip()
    whole = [f"{one} {tail}" if tail and not one.strip("+-.0123456789eE ") else one for one in texts]
    return [settings_in_si({name: one}, {name: unit})[name] for one in whole]


def _spread(setting: str, name: str, kind: str, inside: str, unit: str) -> Spread:
    if kind not in NUMBERS:
        near = closest(kind, list(NUMBERS))
        raise UsageMistake(
            f"there is no distribution '{kind}'",
            f"did you mean '{near}'?" if near else f"there are {', '.join(NUMBERS)}",
        )
    given = [one.strip() for one in inside.split(",") if one.strip()]
    least, most = NUMBERS[kind]
    if not least <= len(given) <= most:
        wanted = {"normal": "a mean and a standard deviation", "uniform": "a lower and an upper end"}
        wanted |= {
            "lognormal": "a median and the deviation of the logarithm",
            "triangular": "low, mode and high",
        }
        raise UsageMistake(
            f"'{kind}' takes {wanted[kind]}, not {len(given)} values: '{name} ~ {kind}({inside})'"
        )
    if kind == "lognormal":
        numbers = [*_pair(name, given[:1], unit), *_pair(f"deviation of {name}", given[1:], "1")]
    else:
        numbers = _pair(name, given, unit)
    if kind in ("normal", "lognormal") and len(numbers) == 2 and not numbers[1] > 0:
        raise UsageMistake(f"the deviation of '{name}' is positive, not {given[1]}")
    if kind == "lognormal" and not numbers[0] > 0:
        raise UsageMistake(f"the median of '{name}' is positive, not {given[0]}")
    rising = all(a <= b for a, b in itertools.pairwise(numbers)) and numbers[0] < numbers[-1]
    if kind in ("uniform", "triangular") and not rising:
        raise UsageMistake(f"'{name} ~ {kind}({inside})' does not go from a lower to a higher value")
    return Spread(name, unit, kind, tuple(numbers))


def _numbers(name: str, given: list[Any], unit: str) -> Any:
    return np.array([settings_in_si({name: one}, {name: unit})[name] for one in given], dtype=np.float64)


def _side_by_side(names: Sequence[str], given: Any, units: Mapping[str, str]) -> Listed:
    """Return members as they are listed: rows [n, names] in SI."""
    rows = np.asarray(given, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != len(names) or not np.isfinite(rows).all():
        raise UsageMistake(
            f"the members of {', '.join(names)} are rows of {len(names)} finite numbers, not an array {rows.shape}"
        )
    return Listed(tuple(names), tuple(units[name] for name in names), rows)


def _of_file(file: str | Path | TableFile, units: Mapping[str, str]) -> Listed:
    """Read members from a CSV file with the header ``l [m],theta [deg]``."""
    sheet = sheet_of_file(file)
    path = sheet.path
    names: list[str] = []
    columns: list[Any] = []
    remarks = list(sheet.remarks)
    for k, (head, unit) in enumerate(sheet.heads):
        name = _known(head, units)
        factor = factor_of(path.name, name, units[name], unit)
        names.append(name)
        columns.append(np.array(sheet.complete(k, name)) * factor)
        remarks += bare_angle(path.name, name, units[name], unit, columns[-1])
    return Listed(
        tuple(names), tuple(units[name] for name in names), np.column_stack(columns), tuple(remarks)
    )
