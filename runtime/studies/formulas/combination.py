"""A combination of terms that is constant along the motion: its formula, and how far it drifts on a run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from msgspec import Struct

from ...case import Case, SimulationOptions, find_experiment, inputs_at
from ...outcome import Outcome, SimulationError
from ...problem import Array, Problem
from ...results.solution import Solution
from ...settings import settings_of
from ..findings import Curve, Panel
from ..runs.simulate import is_as_stated, run
from .coefficients import digits, fraction, recognised, shown
from .null_space import CONFIRMED, null_space, sizes_of, support
from .polynomial import cleared, read
from .polynomial import shown as shown_sum
from .relations import Chance, Relation, needed
from .sampling import Sampler

POINTS = 2000
"""Times at which a combination is looked at along a run."""

SMALL = 1e-3
"""Of the size of a quantity at random states: what is less along a run counts as zero there."""

SAME = 0.02
"""Relative difference of a rate from differences over two points of a run."""

MOST_PARAMETERS = 8
"""Of more than so many that a coefficient depends on, it is given as a number."""


class CombinationDrift(Struct, frozen=True, eq=False):
    """``largest`` change relative to the ``size`` of the terms; over ``time`` [n] the ``change`` [n]."""

    largest: float
    size: float
    time: Array
    change: Array


class Track(Struct, frozen=True, eq=False):
    """A run looked at: ``time`` [n], states [n, ny], quantities [n, k]; ``pieces``: (first, last) between events
    while what switches is as at the start."""

    solution: Solution
    time: Array
    y: Array
    phase: Array
    pieces: tuple[tuple[int, int], ...]


def stop_of(problem_experiment: object, options: SimulationOptions) -> bool:
    """Tell whether a question says when to stop, by itself or by its experiment."""
    return options.stop is not None or "stop" in getattr(problem_experiment, "options", ())


def tracked(case: Case, options: SimulationOptions) -> Track | None:
    """Run a case and look at all quantities along it; None where nothing says when to stop."""
    problem = case.problem
    if not stop_of(find_experiment(problem, options.experiment), options):
        return None
    fields = {s.name: getattr(options, s.name) for s in settings_of(SimulationOptions)}
    asked = SimulationOptions(
        **fields,
        experiment=options.experiment,
        values=options.values,
        inputs=options.inputs,
        progress=options.progress,
        max_steps=options.max_steps,
        stiff_after=options.stiff_after,
    )
    solution = run(problem, asked, as_stated=is_as_stated(problem, options))
    return along(case, solution)


def ended_early(track: Track | None) -> list[str]:
    """Say why the run that a track looks at ends before its stop, or says nothing of a drift; nothing where it does not."""
    if track is not None and not track.pieces:
        return ["no drift: in no part of the run all that switches is as it is taken here"]
    if track is None or track.solution.outcome in (Outcome.COMPLETED, Outcome.DOUBTFUL):
        return []
    return [f"the run along which this is told ends before its stop: {track.solution.message}"]


def along(case: Case, solution: Solution) -> Track:
    """Look at all quantities along a run of a case."""
    problem, functions = case.problem, case.functions
    begin, end = float(solution.time[0]), float(solution.time[-1])
    times = np.linspace(begin, end, POINTS) if end > begin else np.array([begin])
    breaks = sorted({float(event.time) for event in solution.events if begin < event.time < end})
    columns = solution(times)
    y = np.array([columns[state.name] for state in problem.states]).T
    assert functions.phase is not None
    phase = np.array(
        [
            functions.phase(float(t), state, inputs_at(case, float(t)), case.z, case.p)
            for t, state in zip(times, y, strict=True)
        ]
    )
    edges = [0, *(int(np.searchsorted(times, b, side="right")) for b in breaks), len(times)]
    pieces = tuple((a, b) for a, b in pairwise(edges) if b - a > 1 and _as_at_start(case, times[a:b], y[a:b]))
    return Track(solution, times, y, phase, pieces)


def _as_at_start(case: Case, times: Array, y: Array) -> bool:
    """Tell whether a piece of a motion obeys the equations with all that switches as it is at the start."""
    problem = case.problem
    if problem.hybrid is None or len(times) < 3:
        return problem.hybrid is None
    nq, nv = problem.nq, problem.nv
    middle = len(times) // 2
    t, dt = float(times[middle]), float(times[middle + 1] - times[middle - 1])
    rate = case.functions.rhs(t, y[middle], inputs_at(case, t), case.z, case.p)[nq : nq + nv]
    change = (y[middle + 1] - y[middle - 1])[nq : nq + nv] / dt
    return bool(np.abs(rate - change).max() <= SAME * max(np.abs(rate).max(), np.abs(change).max()))


def drift_of(track: Track, values: Array, typical: float) -> CombinationDrift | None:
    """Return the drift of the sum of ``values`` [n, number of terms], between events; None where no part of the run is as at the start.

    ``typical``: their size at random states, for what happens to vanish along the run.
    """
    if not track.pieces:
        return None
    total = values.sum(axis=1)
    size = max(float(np.abs(values).sum(axis=1).max(initial=0.0)), SMALL * typical)
    change = np.zeros_like(total)
    for first, last in track.pieces:
        change[first:last] = total[first:last] - total[first]
    largest = float(np.abs(change).max(initial=0.0))
    return CombinationDrift(largest / size if size > 0 else largest, size, track.time, change / (size or 1.0))


def drift_panel(drifts: Sequence[tuple[str, CombinationDrift]], unit: str) -> Panel:
    """Draw the relative changes of what was found over the time of a run."""
    curves = [
        Curve(name, one.time, np.maximum(np.abs(one.change), 1e-18), colour=k)
        for k, (name, one) in enumerate(drifts)
    ]
    return Panel(
        "what is constant: its change along a run",
        "time",
        unit,
        "change / size of its terms",
        "",
        tuple(curves),
        logarithmic="y",
    )


# ---------------------------------------------------------------- coefficients

Columns = Callable[[Sampler, int, Array | None], tuple[Array, Array]]
"""(where states are taken from, how many, other parameters) -> values and rates of all terms, [n, k] each."""


class Coefficients:
    """The coefficients of sparse combinations as formulas of parameters: by the same supports at other parameters."""

    def __init__(self, case: Case, columns: Columns, chance: Chance) -> None:
        self.case = case
        self.columns = columns
        self.chance = chance

    def texts(self, vector: Array, held: Sequence[Relation] = ()) -> list[str]:
        """Return a text for each term of a combination whose first coefficient is made 1, or a number that fits.

        ``held``: what must hold of the parameters for it.
        """
        places = [int(k) for k in support(vector)]
        base = vector[places] / vector[places[0]]
        plain = [number_text(float(c)) for c in base]
        free = [k for k in self.chance.free if all(k != relation.follower for relation in held)]
        if not free or len(places) == 1:
            return plain
        relevant = []
        for k in free:
            other = self._at(places, self.chance.values({k}, held))
            if other is None or np.abs(other - base).max() > 1e-7 * np.abs(base).max():
                relevant.append(k)
        if not relevant or len(relevant) > MOST_PARAMETERS:
            return plain
        names = [self.case.problem.parameters[k].name for k in relevant]
        wanted = 1 + len(relevant) + len(relevant) * (3 * len(relevant) - 1) // 2 + 6
        rows: list[Array] = []
        settings: list[Array] = []
        for _ in range(2 * wanted):
            p = self.chance.values(set(relevant), held)
            found = self._at(places, p)
            if found is not None:
                rows.append(found)
                settings.append(p[relevant])
            if len(rows) == wanted:
                break
        if len(rows) < len(relevant) + 4:
            return plain
        values, given = np.array(rows), np.array(settings)
        best: list[str] = plain
        fewest = len(places)
        for lead in range(len(places)):  # what is a quotient against one term, is a product against another
            if (values[:, lead] == 0).any():
                continue
            told = [recognised(values[:, j] / values[:, lead], given, names) for j in range(len(places))]
            strange = sum(text is None or "(" in text for text in told)
            if strange < fewest:
                own = base / base[lead]
                best = [text or number_text(float(c)) for text, c in zip(told, own, strict=True)]
                fewest = strange
            if fewest == 0:
                break
        return best

    def numbers(self, vector: Array) -> list[str]:
        """Return the coefficients as they are, relative to the first."""
        places = support(vector)
        return [number_text(float(c)) for c in vector[places] / vector[places[0]]]

    def holds(self, vector: Array, held: Sequence[Relation]) -> bool:
        """Tell whether there is a combination of the same terms at other parameters with these relations."""
        places = [int(k) for k in support(vector)]
        return self._at(places, self.chance.values(set(self.chance.free), held)) is not None

    def _at(self, places: Sequence[int], p: Array) -> Array | None:
        """Return the coefficients on the same support at other parameters; None where there are none."""
        sampler = Sampler(self.case, seed=self.chance.seed())
        try:
            values, rates = self.columns(sampler, 2 * len(places) + 8, p)
        except SimulationError:
            return None
        values, rates = values[:, places], rates[:, places]
        sizes = sizes_of(values, rates, sampler.time)
        if len(places) == 1:  # alone it has nothing to be told from: its rate is rounding or it is not
            return np.ones(1) if np.abs(rates / sizes).max() < CONFIRMED else None
        null = null_space(rates, sizes)
        if len(null.vectors) != 1 or null.vectors[0][0] == 0:
            return None
        found: Array = null.vectors[0] / null.vectors[0][0]
        return found


def condition(
    coefficients: Coefficients, vector: Array, relations: Sequence[Relation]
) -> CombinationCondition:
    """Return what must hold of the parameters for a combination to be constant."""
    if coefficients.holds(vector, []):
        return CombinationCondition("", ())

    def holds(held: Sequence[Relation]) -> bool:
        return coefficients.holds(vector, held)

    kept = needed(relations, holds)
    if kept is None:
        return CombinationCondition("the parameters have these values", None)
    return CombinationCondition(" and ".join(relation.text for relation in kept), tuple(kept))


class CombinationCondition(Struct, frozen=True):
    """What must hold for a combination: in words (nothing: no condition), and as relations, None if these do not tell."""

    words: str
    held: tuple[Relation, ...] | None


def number_text(value: float) -> str:
    """Return a number as the fraction or root that it is, else its digits."""
    number = fraction(value)
    return shown(number) if number is not None else digits(value)


def sum_text(coefficients: Sequence[str], terms: Sequence[str]) -> str:
    """Return the text of a sum of products; what has the same coefficient is drawn together."""
    groups: dict[str, list[tuple[str, str]]] = {}
    for coefficient, term in zip(coefficients, terms, strict=True):
        negative = coefficient.startswith("-")
        size = coefficient[1:] if negative and not _is_sum(coefficient[1:]) else coefficient
        sign = "-" if negative and size != coefficient else "+"
        groups.setdefault(size, []).append((sign, term))
    text = ""
    for size, members in groups.items():
        if len(members) > 1 and size != "1":
            flip = members[0][0] == "-"
            inner = joined([(("-" if s == "+" else "+") if flip else s, term) for s, term in members])
            parts = [("-" if flip else "+", f"{_factor(size)}*({inner})")]
        else:
            parts = [(s, term if size == "1" else times(size, term)) for s, term in members]
        for sign, part in parts:
            text = joined([("+", text), (sign, part)]) if text else joined([(sign, part)])
    return text


def tidy(text: str, problem: Problem, *, whole: bool = False) -> str:
    """Return a formula as a sum of products, like terms drawn together: parameters first, rates last.

    ``whole``: it may be multiplied by numbers and parameters, so that it has no fractions, and by -1.
    """
    found = read(text)
    if found is None or not found:
        return text
    kinds = {state.name: 3 if state.kind == "rate" else 2 for state in problem.states}
    parameters = {quantity.name for quantity in problem.parameters}

    def order(name: str) -> tuple[object, ...]:
        return kinds.get(name, 0 if name in parameters else 1 if name == problem.time.name else 4), name

    if whole:
        found = cleared(
            found, parameters, lambda m: any(kinds.get(n) == 3 or n.startswith("momentum(") for n, _ in m)
        )
        return shown_sum(found, order)
    tidied = shown_sum(found, order)
    return tidied if len(tidied) <= 1.2 * len(text) else text


def joined(parts: Sequence[tuple[str, str]]) -> str:
    """Return a sum of texts with their signs."""
    text = ""
    for sign, part in parts:
        if sign == "-" and (_is_sum(part) or part.startswith("-")):
            part = f"({part})"
        elif sign == "+" and part.startswith("-"):
            sign, part = "-", part[1:]  # -a + b goes on as it is
        text += f" {sign} {part}" if text else (f"-{part}" if sign == "-" else part)
    return text


def times(factor: str, term: str) -> str:
    """Return the product of two texts; the first one is 1, a number or a product."""
    if factor == "1":
        return term
    if term == "1":
        return factor
    return f"{_factor(factor)}*{_factor(term)}"


def _factor(text: str) -> str:
    return f"({text})" if _is_sum(text) or text.startswith("-") else text


def _is_sum(text: str) -> bool:
    depth = 0
    for k, letter in enumerate(text):
        depth += (letter in "([{") - (letter in ")]}")
        if depth == 0 and k > 0 and letter in "+-" and text[k - 1] == " ":
            return True
    return False
