"""What the units allow: the product of powers that a quantity can be, and the dimensionless groups (Buckingham 1914).

Exponents are exact fractions; nothing is integrated.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Annotated

from msgspec import Struct
from msgspec.structs import replace

from ...case import find_experiment, prepare
from ...functions import load_functions
from ...interface import BASE_UNITS, Quantity
from ...outcome import Outcome
from ...problem import Problem
from ...settings import Formula, settable
from ..findings import Findings, Table
from ..formulas.combination import stop_of
from ..study import OF_A_MOTION, Study

MOST_BASES = 2000
"""Choices of repeating quantities that are compared; of more, the simplest of the first is taken."""

EXACT = "exact: exponents are fractions"

Powers = Mapping[int, Fraction]
"""Exponents of quantities by their places; none is zero."""


class Given(Struct, frozen=True):
    """A quantity on which the answer may depend."""

    name: str
    unit: str
    exponents: tuple[Fraction, ...]


class Dimensions(Study, frozen=True, kw_only=True):
    """The products of powers that the units allow for a quantity, and the dimensionless groups on which it depends."""

    unused = OF_A_MOTION
    of_past = True

    of: Annotated[
        Formula | None, settable("Quantity whose dimension to form (default: a time).", "formula")
    ] = None
    among: Annotated[
        tuple[str, ...],
        settable(
            "Parameters, inputs and initial values to use (default: all except initial values of zero).",
            "directions",
        ),
    ] = ()

    def solve(self, problem: Problem) -> Findings:
        """Solve for the exponents. Raises SimulationError where the model has no start."""
        text, asked = _asked(problem, self.of)
        given = _given(problem, self)
        columns = [one.exponents for one in given]
        basis, product = _simplest(columns, asked)
        groups = []
        for k, column in enumerate(columns):
            if k not in basis:
                powers = _solved(basis, columns, column)
                assert powers is not None
                groups.append({k: Fraction(1), **{j: -e for j, e in powers.items()}})
        return _findings(problem, text, asked, given, product, groups)


def _asked(problem: Problem, of: Formula | None) -> tuple[str, tuple[Fraction, ...]]:
    if of is None:
        return problem.time.name, _exponents(problem.time)
    known = (*problem.outputs, *problem.states, *problem.parameters, *problem.inputs, *problem.discretes)
    return of.text, _exponents(next(one for one in known if one.name == of.name))


def _exponents(quantity: Quantity) -> tuple[Fraction, ...]:
    return tuple(Fraction(one) for one in quantity.exponents) or (Fraction(0),) * len(BASE_UNITS)


def _given(problem: Problem, study: Dimensions) -> list[Given]:
    """Return what decides: what ``among`` names, else all parameters, inputs and initial values that are not zero."""
    parameters = [(q.name, q) for q in (*problem.parameters, *problem.inputs) if q.type == "real"]
    starts = [(f"{q.name}(0)", q) for q in problem.states if q.kind != "account"]
    if study.among:
        known = {q.name: (name, q) for name, q in (*starts, *parameters)}
        chosen = [known[name] for name in study.among]
    else:
        functions = load_functions(problem)
        says = stop_of(find_experiment(problem, study.experiment), study)
        case = prepare(problem, functions, study if says else replace(study, stop=study.start or 0.0))
        zero = {name for (name, _), value in zip(starts, case.y0, strict=False) if value == 0}
        chosen = [*parameters, *((name, q) for name, q in starts if name not in zero)]
    return [Given(name, q.measure, _exponents(q)) for name, q in chosen]


def _solved(
    basis: Sequence[int], columns: Sequence[Sequence[Fraction]], wanted: Sequence[Fraction]
) -> Powers | None:
    """Return the exponents by which independent columns make another; None where they do not."""
    rows = [[*(columns[j][i] for j in basis), wanted[i]] for i in range(len(wanted))]
    done = 0
    for k in range(len(basis)):
        pivot = next(i for i in range(done, len(rows)) if rows[i][k])
        rows[done], rows[pivot] = rows[pivot], rows[done]
        head = rows[done][k]
        rows[done] = [value / head for value in rows[done]]
        for i, row in enumerate(rows):
            if i != done and row[k]:
                rows[i] = [a - row[k] * b for a, b in zip(row, rows[done], strict=True)]
        done += 1
    if any(row[-1] for row in rows[done:]):
        return None
    return {j: rows[i][-1] for i, j in enumerate(basis) if rows[i][-1]}


def _rank(columns: Sequence[Sequence[Fraction]]) -> int:
    rows, rank = [list(column) for column in columns], 0
    for k in range(len(BASE_UNITS)):
        pivot = next((i for i in range(rank, len(rows)) if rows[i][k]), None)
        if pivot is None:
            continue
        rows[rank], rows[pivot] = rows[pivot], rows[rank]
        for i in range(rank + 1, len(rows)):
            factor = rows[i][k] / rows[rank][k]
            rows[i] = [a - factor * b for a, b in zip(rows[i], rows[rank], strict=True)]
        rank += 1
    return rank


def _simplest(
    columns: Sequence[tuple[Fraction, ...]], asked: Sequence[Fraction]
) -> tuple[tuple[int, ...], Powers | None]:
    """Return the repeating quantities for which all products are simplest, and the product that is asked, None where there is none."""
    rank = _rank(columns)

    first = [k for k, column in enumerate(columns) if any(column) and column not in columns[:k]]

    def bases() -> Iterator[tuple[int, ...]]:
        for chosen in itertools.combinations(first, rank):
            if _rank([columns[j] for j in chosen]) == rank:
                yield chosen

    best: tuple[tuple[int, int], tuple[int, ...], Powers | None] | None = None
    for basis in itertools.islice(bases(), MOST_BASES):
        product = _solved(basis, columns, asked)
        groups = [_solved(basis, columns, column) for column in columns]
        weight = (_weight([product or {}]), _weight([group or {} for group in groups]))
        if best is None or weight < best[0]:
            best = weight, basis, product
    assert best is not None  # the empty basis, if nothing else
    return best[1], best[2]


def _weight(products: Sequence[Powers]) -> int:
    """Count quantities, and more for higher and broken powers."""
    return sum(1 + abs(e.numerator) + 2 * (e.denominator - 1) for p in products for e in p.values())


def written(powers: Powers, given: Sequence[Given]) -> str:
    """Write a product of powers: ``l^(1/2)/g^(1/2)``."""

    def power(k: int, e: Fraction) -> str:
        name = given[k].name
        if e == 1:
            return name
        return f"{name}^{e}" if e.denominator == 1 else f"{name}^({e})"

    above = [power(k, e) for k, e in sorted(powers.items()) if e > 0]
    below = [power(k, -e) for k, e in sorted(powers.items()) if e < 0]
    divisor = below[0] if len(below) == 1 else f"({'*'.join(below)})"
    return ("*".join(above) or "1") + (f"/{divisor}" if below else "")


def _findings(
    problem: Problem,
    text: str,
    asked: Sequence[Fraction],
    given: Sequence[Given],
    product: Powers | None,
    groups: Sequence[Powers],
) -> Findings:
    used = {k for powers in (*groups, product or {}) for k in powers}
    alone = [one.name for k, one in enumerate(given) if k not in used]
    names = [f"Pi{k + 1}" for k in range(len(groups))]
    if product is None:
        message = f"no product of {', '.join(one.name for one in given) or 'nothing'} has the unit of {text}"
    else:
        function = f"f({', '.join(names)})" if names else "C"
        message = f"{text} = {f'{written(product, given)}*' if product else ''}{function}"
        if not names:
            message += ", where C is a number"
    remarks = []
    if alone:
        remarks.append(
            f"{', '.join(alone)}: {'enters' if len(alone) == 1 else 'enter'} nothing, as no product frees it of its unit; "
            "numbers with units in the text, as 9.81 m/s^2, take no part unless they have names"
        )
    shown = [i for i in range(len(BASE_UNITS)) if any(one.exponents[i] for one in given) or asked[i]]
    rows = [
        (text, *(str(asked[i]) for i in shown)),
        *((one.name, *(str(one.exponents[i]) for i in shown)) for one in given),
    ]
    tables = [Table("exponents of units", (("", ""), *((BASE_UNITS[i], "") for i in shown)), tuple(rows))]
    if groups:
        pairs = [(name, written(powers, given)) for name, powers in zip(names, groups, strict=True)]
        tables.insert(0, Table("dimensionless groups", (("", ""), ("product", "")), tuple(pairs)))
    return Findings(
        study="dimensions",
        model=problem.name,
        outcome=Outcome.COMPLETED,
        message=message,
        errors_from=EXACT,
        remarks=tuple(remarks),
        tables=tuple(tables),
        details={
            "of": text,
            "product": None if product is None else _plain(product, given),
            "groups": [_plain(powers, given) for powers in groups],
            "alone": alone,
        },
    )


def _plain(powers: Powers, given: Sequence[Given]) -> dict[str, str]:
    return {given[k].name: str(e) for k, e in sorted(powers.items())}
