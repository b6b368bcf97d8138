"""Settings of ensembles as people write them: members, what is kept, shares and matrices."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from ..runtime.problem import Problem
from ..runtime.settings import QuestionSetting
from .parse_values import UsageMistake, apart, output_of, read_value_of, settable_units, shown

if TYPE_CHECKING:
    from ..runtime.ensembles.kept import Kept
    from .members import Varying


def _varying(setting: QuestionSetting, given: Any, problem: Problem) -> tuple[Varying, ...]:
    from .members import varying

    return varying(setting.name, given, settable_units(problem))


def _kept(setting: QuestionSetting, given: Any, problem: Problem) -> tuple[Kept, ...]:
    if not isinstance(given, str):
        raise UsageMistake(
            f"'{setting.name}' is a text, not {shown(given)}", f'as in {setting.name} = "max(theta)"'
        )
    from .kept import kept

    names = {q.name for q in (*problem.states, *problem.outputs)}
    return kept(setting.name, given, names, output_of(setting))


def _share(setting: QuestionSetting, given: Any, problem: Problem) -> float:
    """Read ``all``, ``none`` or a number from 0 to 1."""
    words = {"all": 1.0, "none": 0.0}
    try:
        share = words[given.strip()] if isinstance(given, str) and given.strip() in words else float(given)
    except (TypeError, ValueError):
        share = -1.0
    if not 0 <= share <= 1:
        raise UsageMistake(f"'{setting.name}' is all, none or a share from 0 to 1, not {shown(given)}")
    return share


def _matrix(setting: QuestionSetting, given: Any, problem: Problem) -> tuple[tuple[float, ...], ...]:
    """Read rows of numbers: ``{{1e-4, 0}, {0, 1e-4}}``, or nested lists."""
    rows: tuple[tuple[float, ...], ...] = ()
    if isinstance(given, str):
        inside = given.strip().removeprefix("{").removesuffix("}")
        given = [row.strip().strip("{}").split(",") for row in apart(inside)]
    with suppress(TypeError, ValueError):
        rows = tuple(tuple(float(number) for number in row) for row in given)
    if not rows or len({len(row) for row in rows}) != 1:
        raise UsageMistake(
            f"'{setting.name}' is a matrix of numbers in SI, not {shown(given)}", "as in {{4, 1}, {1, 9}}"
        )
    return rows


def _seconds(setting: QuestionSetting, given: Any, problem: Problem) -> float:
    """Read a time of the clock, whatever the unit of the model's time."""
    value = (
        read_value_of(setting.name, given).in_unit("s", setting.name) if isinstance(given, str) else (given,)
    )
    try:
        (seconds,) = (float(one) for one in value)
    except (TypeError, ValueError):
        seconds = -1.0
    if not 0 < seconds < math.inf:
        raise UsageMistake(
            f"'{setting.name}' is a positive time, not {shown(given)}", f'as in {setting.name} = "10 s"'
        )
    return seconds


def _cluster(setting: QuestionSetting, given: Any, problem: Problem) -> Any:
    """Take an address, or what Dask knows a cluster by (runtime/ensembles/cluster.py)."""
    if isinstance(given, str) and not given.strip():
        raise UsageMistake(f"'{setting.name}' is empty", "as in tcp://10.0.0.1:8786")
    return given


OF_ENSEMBLES: Mapping[str, Callable[[QuestionSetting, Any, Problem], object]] = {
    "varying": _varying,
    "kept": _kept,
    "share": _share,
    "matrix": _matrix,
    "seconds": _seconds,
    "cluster": _cluster,
}
"""How these kinds of settings (``runtime/settings.py``) are read."""
