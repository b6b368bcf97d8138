"""What a C text tells the kernel of starts and of what switches: constant structs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Final

from mechc.runtime.start.facts import StartFacts

from ..equations.crowd_plan import CrowdPlan, crowd_values
from ..equations.model import HybridPlan
from ..program import Program
from .c_forms import literal
from .c_header import comment

HYBRID_FUNCTIONS: Final = (
    "indicators",
    "indicator_rates",
    "crossing_times",
    "conditions",
    "row_values",
    "respond",
)
"""Functions that are fields of ``mech_hybrid``, exported as well."""

CROWD_INCLUDED: Final = '#include "crowd.h"\n'

CROWD_FUNCTIONS: Final = """\
static const mech_model model;

/* Time derivative of the state, with the forces of all contacts. */
static void rhs_of_all(mech_real t, const mech_real *y, const mech_real *u, const mech_real *z,
                       const mech_real *p, mech_real *restrict out)
{
    mech_crowd_rates(&model, t, y, u, z, p, out);
}

/* Everything reported beside the state, with the forces of all contacts. */
static void outputs_of_all(mech_real t, const mech_real *y, const mech_real *u, const mech_real *z,
                           const mech_real *p, mech_real *restrict out)
{
    mech_crowd_outputs(&model, t, y, u, z, p, out);
}
"""

ROW_KINDS: Final = {
    "contact": "MECH_CONTACT",
    "friction": "MECH_FRICTION",
    "constraint": "MECH_BILATERAL",
    "step": "MECH_STEP_ROW",
}


def start_text(program: Program, facts: StartFacts) -> Iterator[str]:
    """Yield what an initial state must fulfil."""
    names = [row.name for row in program.assembly]
    if facts.rows:
        yield "static const mech_start_row start_rows[] = {"
        for (stage, hard, measure), name in zip(facts.rows, names, strict=True):
            yield f"    {{{stage}, {int(hard)}, {measure}}}, /* {comment(name)} */"
        yield "};\n"
    yield _numbers("unsigned char", "known", [str(int(known)) for known in facts.known])
    yield _numbers("int", "partner", list(map(str, facts.partner)))
    yield _numbers("mech_real", "size", [literal(Fraction(size))[0] for size in facts.size])
    yield from indices("lengths", facts.lengths)
    yield from indices("dependent", facts.dependent)
    fields: dict[str, object] = {
        "n_rows": len(facts.rows),
        "n_lengths": len(facts.lengths),
        "n_dependent": len(facts.dependent),
        "rows": "start_rows" if facts.rows else "NULL",
        "known": "known",
        "partner": "partner",
        "size": "size",
        "lengths": "lengths" if facts.lengths else "NULL",
        "dependent": "dependent" if facts.dependent else "NULL",
        "assembly": "assembly" if facts.rows else "NULL",
        "assembly_jacobian": "assembly_jacobian" if facts.rows else "NULL",
        "others": "initial_of_others" if facts.dependent else "NULL",
    }
    yield "static const mech_start start = {"
    for name, value in fields.items():
        yield f"    .{name} = {value},"
    yield "};\n"


def hybrid_text(program: Program, plan: HybridPlan) -> Iterator[str]:
    """Yield what the kernel needs to know of switches, branches and rows."""
    if plan.branches:
        yield "static const mech_branch branches[] = {"
        for branch in plan.branches:
            ends = int(branch.message is not None)
            yield f"    {{{branch.event}, {len(branch.checks)}, {ends}, {branch.function}}},"
        yield "};\n"
    if plan.rows:
        yield "static const mech_row rows[] = {"
        for row in plan.rows:
            numbers = (row.normal, row.flag, row.sign, row.impulse, row.enabled)
            yield f"    {{{ROW_KINDS[row.kind]}, {', '.join(map(str, numbers))}}}, /* {comment(row.name)} */"
        yield "};\n"
    yield from indices("switches", [s.index for s in plan.switches])
    yield from indices("times", [n for s in plan.times for n in (s.index, s.after)])
    yield from indices("clocks", [n for clock in plan.clocks for n in clock])
    fields: dict[str, object] = {
        "n_switches": len(plan.switches),
        "n_times": len(plan.times),
        "n_clocks": len(plan.clocks),
        "n_branches": len(plan.branches),
        "n_rows": len(plan.rows),
        "initial": plan.initial,
        "simultaneous": int(plan.simultaneous),
        "dissipated": plan.dissipated,
        "supplied": plan.supplied,
        "total": plan.total,
        **({"carried": 1} if plan.carried else {}),
        "switches": "switches" if plan.switches else "NULL",
        "times": "times" if plan.times else "NULL",
        "clocks": "clocks" if plan.clocks else "NULL",
        "branches": "branches" if plan.branches else "NULL",
        "rows": "rows" if plan.rows else "NULL",
        **({"slides": "slides"} if plan.slides else {}),
    }
    yield from indices("slides", plan.slides)
    for name in HYBRID_FUNCTIONS:
        fields[name] = name if program.function(name) else "NULL"
    if plan.crowd is not None:
        yield from _crowd_text(plan.crowd)
        fields["crowd"] = "&crowd"
    yield "static const mech_hybrid hybrid = {"
    for name, value in fields.items():
        yield f"    .{name} = {value},"
    yield "};\n"


def _crowd_text(plan: CrowdPlan) -> Iterator[str]:
    """Yield the tables of a crowd of contacts."""
    yield "static const mech_crowd_kind crowd_kinds[] = {"
    for kind in plan.kinds:
        yield f"    {{{kind.leaves}, {kind.normal}, {kind.slip}, {int(kind.friction)}, {kind.function}}},"
    yield "};\n"
    table: list[int] = []
    at: list[int] = []
    for row in plan.rows:
        at.append(len(table))
        table += (*row.leaves, *row.normal, *row.slip)
    yield from indices("crowd_kind", [row.kind for row in plan.rows])
    yield from indices("crowd_at", at)
    yield from indices("crowd_table", table)
    yield from indices("crowd_group", plan.groups)
    yield from indices("crowd_asked", [n for pair in plan.asked for n in pair])
    asked = "crowd_asked" if plan.asked else "NULL"
    values = max(crowd_values(kind) for kind in plan.kinds)
    given = max(*(kind.leaves for kind in plan.kinds), len(plan.groups) + len(plan.asked))
    numbers = f"{len(plan.rows)}, {plan.first}, {plan.capacity}, {len(plan.asked)}, {values}, {given}"
    yield f"static const mech_crowd crowd = {{{numbers}, crowd_kinds, crowd_kind, crowd_at, crowd_table,"
    yield f"                                  crowd_group, {asked}, rhs, outputs, crowd_push}};\n"


def indices(name: str, values: Sequence[int]) -> Iterator[str]:
    if values:
        yield f"static const int {name}[] = {{{', '.join(map(str, values))}}};\n"


def _numbers(kind: str, name: str, values: Sequence[str]) -> str:
    """Return a constant array; a model of nothing has one entry that nobody reads."""
    return f"static const {kind} {name}[] = {{{', '.join(values) or '0'}}};\n"
