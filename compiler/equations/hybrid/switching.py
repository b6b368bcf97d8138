"""The functions of what switches, and the plan that tells the kernel about them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from mechc.lang.diagnostics import Reporter
from mechc.runtime.interface import Quantity
from mechc.runtime.methods import CONTACT_STEPS

from ...graph import Graph, Node
from ...graph.differentiate import jvp, vjp
from ...mechanics.system import MechanicalSystem
from ..model import Function, HybridPlan, Slot, SwitchText, quantity
from ..needs import NEVER
from ..reported.entries import Layout, booked_by_events
from ..rows.constraints import Row
from ..rows.modes import frictions
from ..solve.energies import carried
from ..solve.solved import Solved, velocity_jumps
from .actions import branch_results, check_masses, check_positions
from .crowd import Crowd
from .delays import as_at_the_start, delay_plan
from .energy_jumps import EnergyStep, energy_steps, step_values
from .indicators import RowValues, indicator, row_values
from .plans import branch_plans, impacts_are_simultaneous, impulse_of, one_line, row_plans, share_plans
from .sliding import places_of_modes, sliding, with_sliding
from .switches import Switches, SwitchPlan, find_switches, jumps_of_forces, relations_of_time

if TYPE_CHECKING:
    from .told_laws import ToldLaws

STARTS = ("initial", "initial_of_others", "discretes", "assembly", "assembly_jacobian")
UNSWITCHED = (*STARTS, "inputs", "assertions")
"""Functions in which relations are evaluated as they stand."""


_LEAVING = frozenset({"bends", "phase"})
"""Parts that ask for formulas rather than for motions: jumps of forces of energies stay inside these, on both sides alike."""


class EventEquations(Struct, frozen=True):
    """Layout, functions and plan of a model with events."""

    layout: Layout
    functions: tuple[Function, ...]
    plan: HybridPlan
    jumps: bool
    """Events change velocities otherwise than by forces of constraints, so no momentum need be constant."""


def add_events(
    system: MechanicalSystem,
    solved: Solved,
    layout: Layout,
    functions: Sequence[Function],
    outputs: Sequence[Quantity],
    reporter: Reporter,
    parts: Collection[str],
    crowd: Crowd | None,
    laws: ToldLaws | None,
) -> EventEquations | None:
    """Return the model with its events, or None where nothing switches. ``parts``: see needs.py."""
    graph = system.graph
    check_positions(system, solved, reporter)
    check_masses(system, reporter)
    rows = tuple(row for row in solved.switched if row.constraint.mode and row.constraint.mode.smooth is None)
    rhs = next(f for f in functions if f.name == "rhs")
    conditions = solved.resolve([branch.condition for branch in system.branches])
    normals = {row.constraint.name: row.multiplier for row in solved.switched}
    stepped = CONTACT_STEPS in parts
    values = {row.multiplier: row_values(system, solved, row, normals, stepped=stepped) for row in rows}
    fixed = frozenset(s.node for s in (*system.symbols.discretes, *system.symbols.parameters))
    modes = [*_mode_symbols(system, rows), *(share.rests for share in solved.shared.values())]
    energies = solved.resolve([solved.energies.potential, solved.energies.kinetic, system.lagrangian])
    held = solved.resolve([row.rate for row in solved.rows])
    formulas = (
        *(*rhs.outputs, *conditions, *energies, *held),
        *(n for eight in values.values() for n in eight),
    )
    written = set(map(graph.unsigned, solved.resolve(list(system.lowering.relations))))
    bends = [
        *relations_of_time(system, held, solved.replace),
        *jumps_of_forces(
            system, rhs.outputs, solved.replace, written, of_energies=_LEAVING.isdisjoint(parts)
        ),
    ]
    left = system.lowering.tables.bends if "bends" in parts else {}
    switches = find_switches(system, solved.replace, formulas, bends, fixed | set(modes), solved.sides, left)
    switches, surfaces = with_sliding(system, switches, {s.node for s in system.symbols.states})
    switches = replace(switches, located=tuple(sorted(switches.located, key=lambda s: not s.leads)))
    past = system.lowering.delays.found
    if not (system.branches or rows or switches.located or switches.timed or crowd or past):
        if "events" not in parts:
            return None
        never = SwitchPlan(graph.symbol("switch(never)"), graph.one, graph.zero, graph.one, NEVER)
        switches = replace(switches, located=(never,))
    steps = energy_steps(system, solved, switches, reporter)
    z = _z_symbols(system, switches, modes, steps)
    z += [share.beside for share in solved.shared.values()]
    if laws is not None:
        z += laws.symbols
    if crowd is not None:
        z = _with_crowd(system, steps, z, crowd, reporter)
    layout = _with_z(system, layout, z)
    place = {n: slot.index for n, slot in layout.slots.items() if slot.array == "z"}
    changed = [
        f if f.name in UNSWITCHED else replace(f, outputs=switches.apply(system, f.outputs))
        for f in functions
    ]
    if surfaces:
        changed = [
            replace(f, outputs=sliding(system, surfaces, f.outputs)) if f.name in ("rhs", "outputs") else f
            for f in changed
        ]
    changed = [
        replace(f, outputs=as_at_the_start(system, f.outputs)) if f.name in STARTS else f for f in changed
    ]
    changed = [f for f in changed if f.name != "discretes"]
    start = next((f.outputs for f in functions if f.name == "discretes"), ())
    changed.append(
        Function("discretes", "initial discrete variables", (*start, *_starts(system, z, len(start))))
    )
    delays, delay_times = delay_plan(system, layout.slots)
    made = [
        *delay_times,
        *_functions(system, solved, _Switching(switches, rows, values, steps, conditions)),
        *_branch_functions(system, solved, layout, z),
    ]
    if laws is not None:
        from .told_laws import told_function

        told = told_function(system, solved, laws)
        made.append(replace(told, outputs=switches.apply(system, told.outputs)))
    names = [entry.name for entry in layout.states]
    plan = HybridPlan(
        switches=tuple(SwitchText(place[s.symbol], s.text) for s in switches.located),
        times=tuple(SwitchText(place[s.symbol], s.text, s.after) for s in switches.timed),
        clocks=tuple((place[c.pulse], place[c.count]) for c in system.lowering.clocks.values()),
        initial=-1 if system.lowering.initial is None else place[system.lowering.initial],
        branches=branch_plans(system, solved),
        rows=row_plans(rows, steps, place),
        simultaneous=impacts_are_simultaneous(system, reporter),
        dissipated=_index(names, "energy.dissipated"),
        supplied=_index(names, "energy.supplied"),
        total=_index([entry.name for entry in outputs], "energy.total"),
        carried="energy.supplied" in names
        and (bool(rows) or crowd is not None)
        and carried(system, solved.energies.total, [row.rate for row in solved.rows]),
        slides=places_of_modes(surfaces, switches.located),
        delays=delays,
        crowd=None if crowd is None else replace(crowd.plan, first=len(z) - len(crowd.places)),
        shares=share_plans(rows, steps, solved.shared, place),
        told=(-1, 0) if laws is None else (place[laws.told], len(laws.places)),
        leading=(sum(s.leads for s in switches.located), sum(b.leads for b in system.branches)),
    )
    if (
        crowd is not None
    ):  # forces of the crowd are in no formula, so nothing is known of rates that they change
        made = [_without_rates(f, graph) for f in made]
    jumps = bool(steps) or crowd is not None or "energy.supplied" in booked_by_events(system)
    return EventEquations(layout, (*changed, *made), plan, jumps)


def _with_crowd(
    system: MechanicalSystem, steps: Sequence[EnergyStep], z: Sequence[Node], crowd: Crowd, reporter: Reporter
) -> list[Node]:
    """Return z with the places of a crowd; report what cannot stand beside one."""
    if steps:
        raise reporter.fail(
            "E0722",
            "a potential that jumps is beside too many contacts for formulas",
            system.model.origin.span,
            help="of more than 64 rows the forces are found by numbers, and impulses of jumps are not: let it bend",
        )
    return [*z, *crowd.places]


def _without_rates(function: Function, graph: Graph) -> Function:
    """Return the rates of indicators as unknown; any other function as it is."""
    if function.name != "indicator_rates":
        return function
    return replace(function, outputs=(graph.zero,) * len(function.outputs))


def _index(names: Sequence[str], name: str) -> int:
    return names.index(name) if name in names else -1


# ---------------------------------------------------------------- numbers in z


def _mode_symbols(system: MechanicalSystem, switched: Sequence[Row]) -> list[Node]:
    """Return the modes of rows that switch; those of rows that are identically zero, and dropped, only where formulas ask for them."""
    found: list[Node] = []
    there = {row.constraint.mode.flag for row in switched if row.constraint.mode}
    there |= set(system.lowering.questions.modes)
    for rows in system.constraints:
        mode = rows.mode
        if mode is not None and mode.smooth is None:
            if mode.flag not in there:
                continue
            found += [n for n in (mode.flag, mode.sign, mode.enabled) if n is not None]
            found += mode.impulses
        elif mode is not None and mode.smooth is not None and mode.smooth.slides is not None:
            found.append(mode.smooth.slides)
    clocks = system.lowering.clocks.values()
    found += [n for clock in clocks for n in (clock.pulse, clock.count)]
    if system.lowering.initial is not None:
        found.append(system.lowering.initial)
    return list(dict.fromkeys(found))


def _z_symbols(
    system: MechanicalSystem, switches: Switches, modes: Sequence[Node], steps: Sequence[EnergyStep]
) -> list[Node]:
    return [
        *(s.node for s in system.symbols.discretes),
        *(s.symbol for s in switches.located),
        *(s.symbol for s in switches.timed),
        *modes,
        *(s.impulse for s in steps),
        *system.lowering.delays.found,
    ]


def _with_z(system: MechanicalSystem, layout: Layout, z: Sequence[Node]) -> Layout:
    own = len(layout.discretes)
    entries = (*layout.discretes, *(quantity(system.graph.name(n), "mode", "") for n in z[own:]))
    return replace(
        layout, slots={**layout.slots, **{n: Slot("z", k) for k, n in enumerate(z)}}, discretes=entries
    )


def _starts(system: MechanicalSystem, z: Sequence[Node], known: int) -> list[Node]:
    """Return the initial values after the user's: constraints hold and contacts are enabled that nothing leaves open, the rest is off."""
    graph = system.graph
    on = set()
    for rows in system.constraints:
        if rows.mode is not None and rows.mode.begins:
            on |= {rows.mode.flag} if rows.mode.kind == "constraint" else set()
            on |= {rows.mode.enabled} if rows.mode.enabled is not None else set()
    return [graph.one if n in on else graph.zero for n in z[known:]]


# ---------------------------------------------------------------- functions


class _Switching(Struct, frozen=True):
    """What switches: relations, rows with their ``values``, steps of the potential, ``conditions`` of branches."""

    switches: Switches
    rows: Sequence[Row]
    values: RowValues
    steps: Sequence[EnergyStep]
    conditions: Sequence[Node]


def _functions(system: MechanicalSystem, solved: Solved, switching: _Switching) -> list[Function]:
    """Return the functions that the search for events calls; those without results are left out."""
    graph, switches, rows, steps = system.graph, switching.switches, switching.rows, switching.steps
    functions: list[Function] = []

    def add(name: str, doc: str, nodes: Sequence[Node]) -> None:
        if nodes:
            functions.append(Function(name, doc, switches.apply(system, nodes)))

    surfaces = frictions(rows)
    tests = [indicator(system, row, surfaces[row.multiplier], switching.values) for row in rows]
    idle = [graph.one] * len(steps)
    add(
        "indicators",
        "indicators of events",
        [*(s.indicator for s in switches.located), *(t for t, _ in tests), *idle],
    )
    add(
        "indicator_rates",
        "time derivatives of the indicators, 0 where unknown",
        [*(s.rate for s in switches.located), *(r for _, r in tests), *(graph.zero for _ in steps)],
    )
    ticks = [
        graph.add(clock.start, graph.mul(clock.count, clock.period))
        for clock in system.lowering.clocks.values()
    ]
    add(
        "crossing_times",
        "times of events that are known before",
        [*(s.crossing for s in switches.timed), *solved.resolve(ticks)],
    )
    add("conditions", "1 where the condition of a branch holds", switching.conditions)
    jumps = step_values(system, solved, steps)
    add(
        "row_values",
        "gap, rate, drift, second derivative, force, limit, coefficients of each row",
        [*(n for eight in switching.values.values() for n in eight), *jumps],
    )
    if rows or steps:
        add(
            "respond",
            "jumps of the velocities and of the rates of rows by unit impulses",
            _respond(system, solved, rows, steps),
        )
    return functions


def _branch_functions(
    system: MechanicalSystem, solved: Solved, layout: Layout, z: Sequence[Node]
) -> list[Function]:
    """Return what each branch does."""
    y = [n for n, slot in sorted(layout.slots.items(), key=lambda item: item[1].index) if slot.array == "y"]
    told = {share.beside for share in solved.shared.values()}  # these are not kept
    left = [system.graph.zero if n in told else n for n in z]
    return [
        Function(
            f"act_{number + 1}",
            f"when {one_line(branch.text)}",
            branch_results(system, solved, branch, y, left),
        )
        for number, branch in enumerate(system.branches)
    ]


def _respond(
    system: MechanicalSystem, solved: Solved, rows: Sequence[Row], steps: Sequence[EnergyStep]
) -> tuple[Node, ...]:
    """Return the jumps of v, then of the rate of each row, by the impulses in z."""
    graph = system.graph
    velocities = [system.v[i].node for i in solved.free]
    rates = [*(row.rate for row in rows), *(s.rate for s in steps)]
    places = [*(impulse_of(row) for row in rows), *(s.impulse for s in steps)]
    impulses = vjp(graph, list(zip(rates, places, strict=True)), velocities)
    jumps = velocity_jumps(system, solved, impulses)
    changes = jvp(graph, rates, dict(zip(velocities, jumps, strict=True)))
    return solved.resolve([*jumps, *changes])
