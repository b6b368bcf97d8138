"""What a program tells the kernel beside its functions: the constant structs of ``model.h``, filled in.

The fields stand here once; ``c_data.py`` writes them as C, ``wasm/structs.py`` as bytes. A field that is left out is 0 or NULL.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Final, Literal

from msgspec import Struct

from mechc.runtime.native.contract import (
    MODEL_VERSION,
    BranchStruct,
    Contract,
    CrowdKindStruct,
    CrowdLineStruct,
    CrowdStruct,
    DelaysStruct,
    HybridStruct,
    ModelStruct,
    RowStruct,
    SeriesStruct,
    ShareRowStruct,
    StartRowStruct,
    StartStruct,
)
from mechc.runtime.start.facts import StartFacts, start_facts

from ..equations.crowd_plan import CrowdPlan, crowd_values
from ..equations.model import DelayPlan, HybridPlan
from ..program import Program, ProgramFunction
from ..program.model import SERIES_NEXT, SERIES_START, Load

MODEL_FUNCTIONS: Final = (
    "rhs",
    "initial",
    "inputs",
    "discretes",
    "outputs",
    "assertions",
    "jacobian",
    "project_position",
    "project_velocity",
    "displace",
    "closeness",
    "momentum",
    "force",
    "mass",
    "constraints",
    "constraint_jacobian",
)
"""Functions that are fields of ``mech_model``; any other is found by its own name, too."""

HYBRID_FUNCTIONS: Final = (
    "indicators",
    "indicator_rates",
    "crossing_times",
    "conditions",
    "row_values",
    "respond",
)
"""Functions that are fields of ``mech_hybrid``."""

EXPAND: Final = "series_expand"
"""Where Taylor series have few slots: the function that takes the place of ``series_next``."""

RATES_OF_ALL: Final = "rhs_of_all"
OUTPUTS_OF_ALL: Final = "outputs_of_all"
"""In the place of rhs and outputs, where contacts are a crowd: with the forces of all of them (``crowd.h``)."""


OF_SHARES: Final = "_of_shares"
"""Behind the name of a function that reads shares of loads: what is called by its name finds them first (``shares.h``)."""


class NamedNumber(Struct, frozen=True):
    """A number that the headers have a name for."""

    name: str
    value: int


class FunctionPointer(Struct, frozen=True):
    """A pointer to a function of the program, or of the kernel."""

    name: str


class ArrayPointer(Struct, frozen=True):
    """A pointer to numbers: NULL where there are none, or, where the kernel wants a place, one 0 that nobody reads."""

    name: str
    kind: Literal["int", "unsigned char", "mech_real"]
    values: Sequence[int | Fraction]
    never_null: bool = False


class StructArray(Struct, frozen=True):
    """A pointer to structs, by their fields in order; NULL where there are none. ``notes``: what readers call them."""

    name: str
    struct: type[Contract]
    rows: Sequence[Sequence[int | float | NamedNumber | FunctionPointer]]
    notes: Sequence[str] = ()


class StructPointer(Struct, frozen=True):
    """A pointer to one struct."""

    name: str
    struct: type[Contract]
    fields: Mapping[str, Value]


Value = int | NamedNumber | FunctionPointer | ArrayPointer | StructArray | StructPointer | None

ROW_KINDS: Final = {
    "contact": NamedNumber("MECH_CONTACT", 0),
    "friction": NamedNumber("MECH_FRICTION", 1),
    "freewheel": NamedNumber("MECH_CONTACT", 0),
    "constraint": NamedNumber("MECH_BILATERAL", 2),
    "step": NamedNumber("MECH_STEP_ROW", 3),
}


SOURCES: Final = "yuzt"
"""Arrays that delays look back at, as enum mech_source numbers them."""

FREEWHEEL: Final = NamedNumber("MECH_FREEWHEEL", -2)
"""In the place of the sign of a friction that never gives way backwards."""


def is_emitted(function: ProgramFunction) -> bool:
    """Tell whether a function is more than NULL: a Jacobian without entries is one, of rates that depend on nothing."""
    return bool(function.n_out) or function.name == "jacobian" or function.name not in MODEL_FUNCTIONS


def model_data(program: Program, expanded: bool) -> StructPointer:
    """Return ``mech_model`` of a program; ``expanded``: its Taylor series are formed by ``EXPAND``."""
    pattern = program.jacobian_pattern
    fields: dict[str, Value] = {
        "version": NamedNumber("MECH_MODEL_VERSION", MODEL_VERSION),
        "nq": program.nq,
        "nv": program.nv,
        "nx": program.nx,
        "nu": program.size("u"),
        "nz": program.size("z"),
        "np": len(program.arrays["p"]),
        "nh": program.nh,
        "n_outputs": program.size("out"),
        "n_assertions": len(program.assertions),
        "n_rotations": len(program.rotations),
        "rotations": _indices("rotations", program.rotations),
        "n_jacobian": len(pattern),
        "jac_row": _indices("jacobian_rows", [row for row, _ in pattern]),
        "jac_col": _indices("jacobian_columns", [column for _, column in pattern]),
        "parameters": FunctionPointer("parameters"),
        "n_position": sum(row.level == "position" for row in program.constraints),
        "n_velocity": len(program.constraints),
        "separable": int(program.separable),
        "n_accounts": sum(entry.kind == "account" for entry in program.arrays["y"]),
    }
    for name in MODEL_FUNCTIONS:
        function = program.function(name)
        fields[name] = FunctionPointer(name) if function and is_emitted(function) else None
    if program.switching is not None:
        if program.switching.crowd is not None:
            fields |= {"rhs": FunctionPointer(RATES_OF_ALL), "outputs": FunctionPointer(OUTPUTS_OF_ALL)}
        fields["hybrid"] = _hybrid(program, program.switching)
    series = program.series
    if series is not None:
        given = (
            {"next": None, "expand": FunctionPointer(EXPAND)}
            if expanded
            else {"next": FunctionPointer(SERIES_NEXT)}
        )
        sizes = {"n_slots": series.n_slots, "n_kept": series.n_kept}
        fields["series"] = StructPointer(
            "series", SeriesStruct, {**sizes, "start": FunctionPointer(SERIES_START), **given}
        )
    facts = start_facts(program)
    if facts is not None:
        fields["start"] = _start(program, facts)
    return StructPointer("model", ModelStruct, fields)


def _start(program: Program, facts: StartFacts) -> StructPointer:
    """Return what an initial state must fulfil."""
    some, dependent = bool(facts.rows), bool(facts.dependent)
    names = [row.name for row in program.assembly]
    rows = [(stage, int(hard), measure) for stage, hard, measure in facts.rows]
    sizes = [Fraction(size) for size in facts.size]
    return StructPointer(
        "start",
        StartStruct,
        {
            "n_rows": len(facts.rows),
            "n_lengths": len(facts.lengths),
            "n_dependent": len(facts.dependent),
            "rows": StructArray("start_rows", StartRowStruct, rows, names),
            "known": ArrayPointer("known", "unsigned char", [*map(int, facts.known)], never_null=True),
            "partner": ArrayPointer("partner", "int", facts.partner, never_null=True),
            "size": ArrayPointer("size", "mech_real", sizes, never_null=True),
            "lengths": _indices("lengths", facts.lengths),
            "dependent": _indices("dependent", facts.dependent),
            "assembly": FunctionPointer("assembly") if some else None,
            "assembly_jacobian": FunctionPointer("assembly_jacobian") if some else None,
            "others": FunctionPointer("initial_of_others") if dependent else None,
            **(_found(program) if program.found else {}),
        },
    )


def _found(program: Program) -> dict[str, Value]:
    """Return the fields of parameters that the start finds."""
    places = _indices("found_parameters", program.found)
    return {"n_found": len(program.found), "found": places, "find": FunctionPointer("found")}


def _hybrid(program: Program, plan: HybridPlan) -> StructPointer:
    """Return what the kernel needs to know of switches, branches and rows."""
    branches = [
        (
            branch.event,
            len(branch.shown.checks),
            int(branch.shown.message is not None),
            FunctionPointer(branch.function),
        )
        for branch in plan.branches
    ]
    rows = [
        (
            *(ROW_KINDS[row.kind], row.normal, row.flag),
            FREEWHEEL if row.kind == "freewheel" else row.sign,
            *(row.impulse, row.enabled),
        )
        for row in plan.rows
    ]
    return StructPointer(
        "hybrid",
        HybridStruct,
        {
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
            "switches": _indices("switches", [s.index for s in plan.switches]),
            "times": _indices("times", [n for s in plan.times for n in (s.index, s.after)]),
            "clocks": _indices("clocks", [n for clock in plan.clocks for n in clock]),
            "branches": StructArray("branches", BranchStruct, branches),
            "rows": StructArray("rows", RowStruct, rows, [row.name for row in plan.rows]),
            **({"slides": _indices("slides", plan.slides)} if plan.slides else {}),
            **{name: FunctionPointer(name) if program.function(name) else None for name in HYBRID_FUNCTIONS},
            **({"delays": _delays(plan.delays)} if plan.delays is not None else {}),
            **({"crowd": _crowd(plan.crowd, program.nq)} if plan.crowd is not None else {}),
            **({"shares": _shares(plan)} if plan.shares else {}),
            **({"narrow": 1} if program.narrow_events else {}),
            **_fields_of_laws(plan),
            **({"n_leading_switches": plan.leading[0]} if plan.leading[0] else {}),
            **({"n_leading_branches": plan.leading[1]} if plan.leading[1] else {}),
        },
    )


def _delays(plan: DelayPlan) -> StructPointer:
    """Return what looks back."""
    sources = [n for array, index in plan.sources for n in (SOURCES.index(array), index)]
    return StructPointer(
        "delays",
        DelaysStruct,
        {
            "n_sources": len(plan.sources),
            "n_delays": len(plan.delays),
            "n_delayed": len(plan.delayed),
            "sources": _indices("delay_sources", sources),
            "delayed": _indices("delayed", [n for row in plan.delayed for n in row]),
            "times": FunctionPointer("delay_times"),
        },
    )


def _fields_of_laws(plan: HybridPlan) -> dict[str, Value]:
    """Return the fields of what laws are told, where they are."""
    place, count = plan.told
    return {"n_told": count, "first_told": place, "told": FunctionPointer("told")} if count else {}


def _shares(plan: HybridPlan) -> StructArray:
    rows = [(share.rests, share.beside, share.sort) for share in plan.shares]
    return StructArray("shares", ShareRowStruct, rows, [row.name for row in plan.rows])


def readers(program: Program) -> dict[str, int]:
    """Return the functions that read what rows carry beside their forces in the modes, with the number of their results: they are
    called with what ``shares.h`` finds."""
    places = {share.beside for share in program.switching.shares} if program.switching is not None else set()
    return {
        function.name: function.n_out
        for function in program.functions
        if places
        and any(type(s) is Load and s.array == "z" and s.index in places for b in function.bodies for s in b)
    }


def _crowd(plan: CrowdPlan, nq: int) -> StructPointer:
    """Return the tables of a crowd of contacts."""
    table: list[int] = []
    kinds = []
    for k in plan.kinds:
        sizes = (k.leaves, k.one, len(k.normal), len(k.slip), len(table), k.friction)
        kinds.append((*sizes, FunctionPointer(k.function)))
        table += (*k.normal, *k.slip)
    at: list[int] = []
    for columns in plan.columns:
        at.append(len(table))
        table += [n for leaves in columns.leaves for n in leaves]
    lines = []
    for line in plan.lines:
        others = at[line.columns] + line.start * len(plan.columns[line.columns].leaves[0])
        lines.append((line.first, line.kind, len(table), others))
        table += line.one
    return StructPointer(
        "crowd",
        CrowdStruct,
        {
            "n": plan.count,
            "n_lines": len(plan.lines),
            "first": plan.first,
            "capacity": plan.capacity,
            "n_asked": len(plan.asked),
            "n_told": plan.told,
            "n_efforts": len(plan.groups) if plan.efforts else 0,
            "nq": nq,
            "stepped": int(plan.stepped),
            "n_values": max(crowd_values(kind) for kind in plan.kinds),
            "n_given": max(
                *(kind.leaves for kind in plan.kinds),
                len(plan.groups) * (2 if plan.efforts else 1) + len(plan.asked),
            ),
            "kinds": StructArray("crowd_kinds", CrowdKindStruct, kinds),
            "lines": StructArray("crowd_lines", CrowdLineStruct, lines),
            "table": _indices("crowd_table", table),
            "group": _indices("crowd_group", plan.groups),
            "asked": _indices("crowd_asked", [n for pair in plan.asked for n in pair]),
            "rhs": FunctionPointer("rhs"),
            "outputs": FunctionPointer("outputs"),
            "push": FunctionPointer("crowd_push"),
            **({"supply": FunctionPointer("crowd_supply")} if plan.supplies else {}),
        },
    )


def _indices(name: str, values: Sequence[int]) -> ArrayPointer:
    return ArrayPointer(name, "int", values)
