"""What the runtime needs to know of a program besides its code."""

from __future__ import annotations

from typing import Any

from msgspec import to_builtins

from mechc.lang.source import Span
from mechc.lang.units import UnitError, parse_unit, preferred_unit
from mechc.runtime.functions import with_code
from mechc.runtime.problem import (
    PURE,
    AssemblyRow,
    Assertion,
    Branch,
    Constraint,
    Curve,
    CurveRow,
    Description,
    Experiment,
    Hybrid,
    Offer,
    Origin,
    Problem,
    Quantity,
    Scene,
    Setting,
    Shape,
    SoughtOutputs,
    SwitchedRow,
)

from ..equations.crowd_plan import CrowdRow
from ..equations.model import CurvePlan, Entry, ExperimentPlan, HybridPlan, ScenePlan, SettingTarget
from ..program import Program


def make_problem(program: Program, **code: Any) -> Problem:
    """Return the problem of a program: its description, with either Python functions or a shared library (``code``)."""
    return with_code(described(program), **code)


def described(program: Program) -> Description:
    """Return what is known of a program besides its code."""
    return Description(
        name=program.name,
        doc=program.doc,
        nq=program.nq,
        nv=program.nv,
        nx=program.nx,
        nh=program.n_hoisted,
        time=_quantity(program.arrays["t"][0]),
        states=_quantities(program, "y"),
        parameters=_quantities(program, "p"),
        inputs=_quantities(program, "u"),
        discretes=_quantities(program, "z"),
        outputs=_quantities(program, "out"),
        known=program.known,
        starts=tuple(origin(span) for span in program.start_spans),
        rotations=program.rotations,
        assertions=tuple(Assertion(a.message, origin(a.span)) for a in program.assertions),
        held_inputs=program.held_inputs,
        found_states=program.found_states,
        found=program.found,
        dependent=program.dependent,
        constraints=tuple(Constraint(c.name, c.level, c.unit, origin(c.span)) for c in program.constraints),
        assembly=tuple(
            AssemblyRow(a.name, a.stage, a.kind, a.known, a.unit, origin(a.span)) for a in program.assembly
        ),
        experiments=tuple(_experiment(e) for e in program.experiments),
        conserved=program.conserved,
        energy_balance=program.energy_balance,
        phase=tuple(_quantity(entry) for entry in program.phase),
        matter=tuple(_quantity(entry) for entry in program.matter),
        matter_size=program.matter_size,
        balance=tuple(_quantity(entry) for entry in program.balance),
        offers=tuple(
            Offer(o.name, o.function, o.doc, o.shape, o.rows, o.columns, o.given, o.kind)
            for o in program.offers
        ),
        sought=tuple(SoughtOutputs(s.outputs, s.rows) for s in program.sought),
        groups=program.groups,
        followers=program.followers,
        narrow=program.narrow,
        bent=program.bent,
        no_series=program.series.refusal if program.series is not None else "",
        hybrid=_hybrid(program.hybrid),
        scene=_scene(program.scene),
        patterns=program.patterns,
        curve=_curve(program.curve),
    )


def describe(program: Program) -> dict[str, object]:
    """Return the description as plain data for JSON, without what only those who work on further parts read."""
    fields: dict[str, object] = to_builtins(described(program))
    for name in ("patterns", "offers", "sought", "balance"):
        del fields[name]
    if not program.followers:
        del fields["followers"]
    return fields


def origin(span: Span | None) -> Origin | None:
    """Return a place in the source as plain data, with the text of its line."""
    if span is None:
        return None
    line, column = span.file.position(span.start)
    return Origin(span.file.name, line, column, span.file.line(line))


def _hybrid(plan: HybridPlan | None) -> Hybrid | None:
    if plan is None:
        return None
    return Hybrid(
        tuple(s.text for s in plan.switches),
        tuple(
            Branch(
                b.text,
                tuple(Assertion(c.message, origin(c.span)) for c in b.checks),
                b.message,
                origin(b.span),
                b.sampled,
            )
            for b in plan.branches
        ),
        (
            *(SwitchedRow(row.name, row.kind, origin(row.span)) for row in plan.rows),
            *((r for row in plan.crowd.rows for r in _of_crowd(row)) if plan.crowd else ()),
        ),
    )


def _of_crowd(row: CrowdRow) -> tuple[SwitchedRow, SwitchedRow]:
    """Return the rows of a contact of a crowd: that of its gap, that of its slip."""
    place = origin(row.span)
    return SwitchedRow(row.name, "contact", place), SwitchedRow(row.name, "friction", place)


def _scene(plan: ScenePlan | None) -> Scene | None:
    if plan is None:
        return None
    shapes = (Shape(s.kind, s.numbers, s.name, s.colour, s.text, s.relative, s.grid) for s in plan.shapes)
    return Scene(plan.size, tuple(shapes), plan.n_still, plan.n_moving, plan.by_rule)


def _curve(plan: CurvePlan | None) -> Curve | None:
    if plan is None:
        return None
    fields = {name: getattr(plan, name) for name in plan.__struct_fields__}
    for name in ("numbers", "further", "wholes", "points", "first"):
        fields[name] = tuple(
            CurveRow(row.name, row.kind, row.unit, row.bound, origin(row.span)) for row in fields[name]
        )
    return Curve(**fields)


def _quantities(program: Program, array: str) -> tuple[Quantity, ...]:
    return tuple(_quantity(entry) for entry in program.arrays[array])


def _quantity(entry: Entry) -> Quantity:
    return Quantity(
        name=entry.name,
        kind=entry.kind,
        unit=entry.unit,
        display=entry.display,
        nominal=entry.nominal,
        minimum=entry.minimum,
        maximum=entry.maximum,
        doc=entry.doc,
        origin=origin(entry.span),
        interpolation=entry.interpolation,
        usual=_usual(entry.unit),
    )


def _usual(unit: str) -> str:
    """Return how a unit is usually written, or nothing where it is."""
    if unit in PURE or "rad" in unit:
        return ""
    try:
        usual = preferred_unit(parse_unit(unit).dimension)
    except UnitError:  # a quotient that is made for a reader
        return ""
    return "" if usual == unit else usual


def _experiment(plan: ExperimentPlan) -> Experiment:
    return Experiment(
        name=plan.name,
        doc=plan.doc,
        function=plan.function,
        options=plan.options,
        words=dict(plan.words),
        settings=tuple(_setting(s) for s in plan.settings),
        sweeps=tuple((_setting(s), values) for s, values in plan.sweeps),
    )


def _setting(target: SettingTarget) -> Setting:
    return Setting(target.array, target.index, target.guess)
