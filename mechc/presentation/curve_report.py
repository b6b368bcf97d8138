"""The report of a curve: what is stationary, what kind of extremum it is, and how accurate that is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from numpy import inf, isfinite

from ..display import Display, factor
from .numbers import count, duration, number, plural, unit_in_brackets, with_unit
from .style import PLAIN, Style, pad, width

if TYPE_CHECKING:
    from ..compiler.equations.model import Equations
    from ..runtime.curves.found import CurveSolution
    from ..runtime.problem import Array
    from ..runtime.studies.kinds.stationary import Curves

ROUNDING = 1e-15
WORDS = {
    "minimum": "a minimum: no direction leads down",
    "maximum": "a maximum: every direction leads down",
    "degenerate": "neither minimum nor saddle can be told: some direction leads nowhere",
}


def curve_report(found: Curves, display: Display | None = None, style: Style = PLAIN) -> str:
    """Return the report of one curve, or one row for each of several, without an end of line."""
    shown = display or Display()
    if len(found.points) > 1:
        return _sweep(found, shown, style)
    (solutions,) = found.solutions
    return "\n\n".join(_one(s, shown, style, k + 1, len(solutions)) for k, s in enumerate(solutions))


def _one(s: CurveSolution, display: Display, style: Style, index: int, of: int) -> str:
    word = s.outcome.value
    head = f"{style.bold(s.model)}: {style.green(word) if word == 'completed' else style.red(word)}"
    if of > 1:
        head += f", curve {index} of {of}"
    statistics = s.statistics()
    unit = s.summary()["unit"]
    a, b = s.interval
    over = s.problem.time
    over_unit, over_factor = _shown(over.unit, over.display, display)
    rows = [
        head,
        "",
        f"  stationary   {number_long(s.stationary, s.error)}{with_unit(unit)}, error {s.error:.1e}",
        f"  it is        {_kind(s)}",
        f"  range        {number(a * over_factor)} to {number(b * over_factor)}{with_unit(over_unit)} of {over.name}",
        f"  elements     {statistics['elements']} of degree {statistics['degree']}, "
        f"{count(statistics['unknowns'])} unknowns, {plural(statistics['newton_steps'], 'Newton step')}",
        f"  time         {duration(s.seconds)}",
    ]
    if s.conjugate_points:
        places = ", ".join(number(x * over_factor) for x in s.conjugate_points)
        rows.append(f"  conjugate    to the lower end: {over.name} = {places}{with_unit(over_unit)}")
    rows += _values(s, display)
    rows += _along(s, display)
    if s.first_integrals:
        rows += ["", "  the same along the curve   value        drift"]
        rows += [f"  {pad(n, 25)}  {number(v):<11}  {d:.1e}" for n, (v, d) in s.first_integrals.items()]
    rows += [f"  note: {remark}" for remark in s.remarks]
    return "\n".join(rows)


def number_long(value: float, error: float) -> str:
    """Return a number with as many digits as its error leaves, at least seven and at most thirteen."""
    if error <= 0 or value == 0:
        return f"{value:.13g}"
    import math

    digits = round(math.log10(abs(value) / error)) if math.isfinite(error) else 7
    return f"{value:.{min(13, max(7, digits))}g}"


def _kind(s: CurveSolution) -> str:
    if s.kind == "saddle":
        return f"a saddle: {plural(s.negative_directions, 'direction')} {'leads' if s.negative_directions == 1 else 'lead'} down"
    return WORDS[s.kind]


def _shown(si: str, declared: str, display: Display) -> tuple[str, float]:
    unit = display.unit(si, declared)
    return unit, factor(si) / factor(unit)


def _values(s: CurveSolution, display: Display) -> list[str]:
    table = []
    unknown = s.summary()["unknown"]
    for q in s.problem.discretes:
        if q.name in unknown:
            unit, by = _shown(q.unit, q.display, display)
            table.append(
                [q.name, number(unknown[q.name] * by) + with_unit(unit), "", "the end that was to be found"]
            )
    for q in s.problem.outputs:
        if q.name in s.outputs:
            unit, by = _shown(q.unit, q.display, display)
            error = s.output_errors[q.name]
            value = number(s.outputs[q.name] * by) + with_unit(unit)
            table.append([q.name, value, f"{error * by:.1e}", q.doc.splitlines()[0] if q.doc else ""])
    table += [[f"multiplier({n})", number(v), "", ""] for n, v in s.multipliers.items()]
    if not table:
        return []
    table.insert(0, ["", "value", "error", ""])
    widths = [max(width(row[i]) for row in table) for i in range(3)]
    return [
        "",
        *("  " + "  ".join([*(pad(row[i], widths[i]) for i in range(3)), row[3]]).rstrip() for row in table),
    ]


def _along(s: CurveSolution, display: Display) -> list[str]:
    names = [*s.coordinates, *(q.name for q in s.problem.outputs if q.name in s)]
    names += [n for n in s if n.startswith("multiplier(")]
    table = [["", "first", "last", "least", "most"]]
    for name in names:
        quantity = s.quantity(name)
        unit, by = _shown(s.unit(name), quantity.display if quantity else "", display)
        label = name + (f" [{unit}]" if with_unit(unit) else "")
        table.append([label, *_ends(s[name] * by)])
    widths = [max(width(row[i]) for row in table) for i in range(5)]
    return [
        "",
        *(
            "  " + "  ".join([*(pad(row[i], widths[i]) for i in range(5)), *row[5:]]).rstrip()
            for row in table
        ),
    ]


def _ends(values: Array) -> list[str]:
    """Return the first, last, least and largest value; of infinite and undefined ones how many there are."""
    known = values[isfinite(values)]
    size = float(abs(known).max(initial=0.0))
    four = (values[0], values[-1], known.min(initial=inf), known.max(initial=-inf))
    cells = [number(_rounded(float(x), size)) if isfinite(x) else "-" for x in four]
    if (left := len(values) - len(known)) > 0:
        cells.append(f"(not finite at {left} of {len(values)} places)")
    return cells


def _rounded(value: float, size: float) -> float:
    """Return zero for what is rounding beside the largest value."""
    return 0.0 if abs(value) < ROUNDING * size else value


def _sweep(found: Curves, display: Display, style: Style) -> str:
    first = found.solutions[0][0]
    outputs = [q for q in first.problem.outputs if q.name in first.outputs]
    units = [_shown(q.unit, q.display, display) for q in outputs]
    names = [q.name + unit_in_brackets(unit) for q, (unit, _) in zip(outputs, units, strict=True)]
    table = [[*found.points[0], "outcome", "stationary", "error", "kind", *names]]
    for point, solutions in zip(found.points, found.solutions, strict=True):
        for s in solutions:
            row = [
                *(number(v) for v in point.values()),
                s.outcome.value,
                number(s.stationary),
                f"{s.error:.1e}",
            ]
            row += [s.kind]
            row += [number(s.outputs[q.name] * by) for q, (_, by) in zip(outputs, units, strict=True)]
            table.append(row)
    widths = [max(width(row[i]) for row in table) for i in range(len(table[0]))]
    rows = ["  " + "  ".join(pad(c, w) for c, w in zip(row, widths, strict=True)).rstrip() for row in table]
    return "\n".join(
        [f"{style.bold(first.model)}: {len(table) - 1} curves", "", style.dim(rows[0]), *rows[1:]]
    )


def curve_explained(name: str, equations: Equations) -> dict[str, str]:
    """Return what was chosen for a model of a curve, and why, by topic."""
    plan = equations.curve
    assert plan is not None
    integrals = [
        row.name for row in plan.numbers if row.kind == "integral" and not row.name.startswith("gauge")
    ]
    wholes = [row.name for row in plan.wholes]
    return {
        "model": f"{name}, a curve of {plural(plan.coordinates, 'coordinate')}",
        "elements": f"polynomials with {plan.order - 1} continuous derivatives"
        if plan.order > 1
        else "continuous polynomials",
        "integrals": ", ".join(integrals) or "none",
        "conditions on the whole": ", ".join(wholes) or "none",
        "conditions at every place": ", ".join(row.name for row in plan.points) or "none",
        "ends to be found": str(plan.unknown),
        "parameter": "the integrals do not know it, so that the speed is kept constant"
        if plan.gauge
        else "the integrals know it",
        "first integrals": ", ".join(row.name for row in plan.first) or "none",
        "second derivatives": f"{len(plan.curvature)} of the integrand, exact",
        "method": "Newton's on elements of degree 10 and 12, in Python; nothing is integrated in time",
    }
