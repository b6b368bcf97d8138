"""Ensembles and sweeps of a model beside its single runs: the values that are drawn, and what becomes of each member."""

from __future__ import annotations

import re
import warnings
from itertools import product
from random import Random
from typing import Any

import numpy as np
from scipy import stats

import mechc
from random_models.compiled import Compiled, Refused
from random_models.motions import FLOOR, TOLERANCE, errors, run

SAMPLES = 3
"""Of random values, for each of two starts, where starts are free."""
STOP = 0.4
"""Seconds."""
KEPT = 12
"""States and outputs that are kept, at the most."""
RELATIVE = 100 * FLOOR
"""Steps of a member and of a single run need not be the same ones."""


def members_differ(base: Compiled, seed: int) -> str:
    """Say how an ensemble over a parameter and a start differs from what its distribution says, or from single runs; or nothing."""
    random = Random(f"members of {seed}")
    start = base.start()
    numbers = {n: v for n, v in base.parameters().items() if re.fullmatch(r"p\d+", n) and v > 0}
    places = {} if base.constrained else {n: v for n, v in start.items() if re.fullmatch(r"q\d+", n)}
    if not numbers:
        return ""
    p, q = random.choice(sorted(numbers)), random.choice(sorted(places) or [""])
    spread, quantiles = _spread(random, numbers[p])
    units = {x.name: x.unit for x in (*base.problem.parameters, *base.problem.states)}
    kept = random.sample(base.states, min(KEPT, len(base.states)))
    settings: dict[str, Any] = {
        "samples": SAMPLES,
        "seed": seed + 1,
        "stop": base.case.begin + STOP,
        "tolerance": TOLERANCE,
    }
    vary = f"{p} ~ {spread.format(u=units[p])}".replace(" ,", ",").replace(" )", ")")
    if q:
        vary += f"; {q} = {{{places[q]!r}, {places[q] + 0.02!r}}} {units[q]}".rstrip()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            runs = base.model.ensemble(vary, ", ".join(f"final({n})" for n in kept), **settings)
            even = base.model.ensemble(
                f"{p} ~ uniform(0 {units[p]}, 1 {units[p]})", f"final({kept[0]})", **settings
            )
    except (mechc.SimulationError, mechc.UsageMistake, mechc.CompileError) as error:
        return _refused(base, str(error))
    drawn, expected = np.ravel(runs[p])[:SAMPLES], quantiles(np.ravel(even[p])[:SAMPLES])
    if not np.allclose(drawn, expected, rtol=1e-9):
        return f"of {p} ~ {spread} are drawn {drawn}, {expected} expected"
    k = random.randrange(len(runs))
    values = {n: float(np.ravel(runs[n])[k]) for n in (p, q) if n}
    return _apart(base, runs, k, values, kept)


def sweep_differs(base: Compiled, seed: int) -> str:
    """Say how the runs of an experiment over two values of one or two parameters differ from single runs; or nothing."""
    random = Random(f"sweep of {seed}")
    numbers = {n: v for n, v in base.parameters().items() if re.fullmatch(r"p\d+", n) and v > 0}
    chosen = random.sample(sorted(numbers), min(len(numbers), random.choice((1, 2))))
    units = {q.name: _written(q.unit) for q in base.problem.parameters}
    lists = [f"{p} in {{{1.02 * numbers[p]!r}, {0.97 * numbers[p]!r}}} {units[p]}".rstrip() for p in chosen]
    text, n = re.subn(r"^( *experiment\(.*)\);", rf"\1, {', '.join(lists)});", base.text, count=1, flags=re.M)
    if not chosen or not n:
        return ""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            runs = mechc.loads(text).sweep(stop=base.case.begin + STOP, tolerance=TOLERANCE)
    except (mechc.SimulationError, mechc.UsageMistake, mechc.CompileError) as error:
        return _refused(base, str(error))
    want = [
        dict(zip(chosen, values, strict=True))
        for values in product(*((1.02 * numbers[p], 0.97 * numbers[p]) for p in chosen))
    ]
    points = [dict(p) for p in runs.points]
    if len(points) != len(want) or any(
        not np.isclose(a[n], b[n], rtol=1e-12) for a, b in zip(points, want, strict=True) for n in b
    ):
        return f"{lists}: runs are made at {points}"
    k = random.randrange(len(points))
    single, one = run(base.text, stop=base.case.begin + STOP, values=want[k]), runs.solutions[k]
    if str(one.outcome) != str(single.outcome):
        return f"{want[k]}: {one.outcome}, alone {single.outcome}"
    if str(one.outcome) == "Outcome.FAILED" or max(errors(single).values(), default=0.0) > FLOOR:
        return ""
    if any(abs(float(e.time) - float(single.time[-1])) < 1e-6 for e in single.events):
        return ""
    for name in base.states:
        x, y = (float(np.asarray(s[name])[-1]) for s in (one, single))
        if not abs(x - y) <= RELATIVE * (1 + float(np.max(np.abs(single[name])))):
            return f"{name} ends at {x:.9g} where {want[k]} is swept, at {y:.9g} in a run"
    return ""


def _written(unit: str) -> str:
    """Write a unit as a text has it behind numbers: 1/m/s as m^-1.s^-1."""
    below = unit.removeprefix("1/")
    if below == unit:
        return unit.removeprefix("1")
    return re.sub(
        r"([A-Za-z]+)(?:\^(\d+))?", lambda m: f"{m[1]}^-{m[2] or 1}", below.strip("()").replace("/", ".")
    )


def _spread(random: Random, v: float) -> tuple[str, Any]:
    """Choose a distribution near a value: as mechc writes it, and its quantiles."""
    a, m, b = sorted(v * (1 + random.uniform(-0.1, 0.15)) for _ in range(3))
    match random.choice(("triangular", "uniform", "normal", "lognormal")):
        case "triangular":
            return f"triangular({a!r} {{u}}, {m!r} {{u}}, {b!r} {{u}})", stats.triang(
                (m - a) / (b - a), a, b - a
            ).ppf
        case "uniform":
            return f"uniform({a!r} {{u}}, {b!r} {{u}})", stats.uniform(a, b - a).ppf
        case "normal":
            return f"normal({m!r} {{u}}, {(b - a) / 10!r} {{u}})", stats.norm(m, (b - a) / 10).ppf
        case _:
            return f"lognormal({m!r} {{u}}, 0.01)", stats.lognorm(0.01, 0, m).ppf


def _refused(base: Compiled, why: str) -> str:
    """Say that an ensemble is refused where a run is not."""
    try:
        run(base.text, stop=base.case.begin + STOP)
    except Refused:
        return ""
    return f"refused: {why}"


def _apart(base: Compiled, runs: Any, k: int, values: dict[str, float], kept: list[str]) -> str:
    """Say how a member differs from a run that is given its values."""
    word = np.ravel(runs.outcome_words)[k]
    try:
        single = run(base.text, stop=base.case.begin + STOP, values=values)
    except Refused as refused:
        return "" if word in ("failed", "not made") else f"{values}: {word}, alone: {refused.text}"
    if str(single.outcome) not in ("Outcome.COMPLETED", "Outcome.TERMINATED"):
        return "" if word in ("failed", "doubtful") else f"{values}: {word}, alone {single.outcome}"
    if word == "doubtful" or max(errors(single).values(), default=0.0) > FLOOR:
        return ""
    if word not in ("completed", "terminated"):
        return f"{values}: {word}, alone {single.outcome}"
    if any(abs(float(e.time) - float(single.time[-1])) < 1e-6 for e in single.events):
        return ""  # the end is on one side of an event
    for name in kept:
        x, y = float(np.ravel(runs[f"final({name})"])[k]), float(np.asarray(single[name])[-1])
        if np.isfinite(y) and not abs(x - y) <= RELATIVE * (1 + float(np.max(np.abs(single[name])))):
            return f"final({name}) is {x:.9g} of the member {values}, {y:.9g} of a run"
    return ""
