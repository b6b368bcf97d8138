"""Dry friction on coordinates without mass: Coulomb's law in a balance of forces without inertia.

The balance r0(q, v) = c lam decides between sticking and sliding where a damper or a spring opposes the friction force lam
along s, with c = ds/d(der z). A freewheel is a friction whose limit backwards is infinite.

Damped: the balance solved for the rates gives the slip s = s0 + d lam with d > 0, so lam = -clamp(s0/d, -b, a) for the limits a forwards and b
backwards: an explicit formula. Without mass, sliding begins and ends at the rate zero.

Not damped, a single coordinate (Jenkins' element): lam = r0/c is known. While it sticks the slip is zero; while it slides lam = -a, and
the total derivative of that gives the rate. It begins to slide where lam leaves the limits, and sticks again where its slip turns round;
a number ``slides`` in z is 1, -1 or 0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from msgspec import Struct
from msgspec.structs import replace

from mechc.lang.diagnostics import Reporter

from ...graph import Graph, Node
from ...graph.differentiate import jacobian
from ...graph.evaluate import evaluate
from ...graph.rewrite import substitute
from ...mechanics.modes import BranchRow, Mode, Regularized, SetAction
from ...mechanics.system import AssertionRow, ConstraintRows, DriveRow, MechanicalSystem
from .residual import constraint_rates

ROUNDING = 1e-12
"""Share of a limit by which another formula of it may differ."""

EXCEEDED = 1000
"""A force beyond its limit by more than one over this has jumped."""


class Rub(Struct, frozen=True):
    """A friction that may act on what has no mass: its rows, the rate of its slip, the symbol of its force."""

    rows: ConstraintRows
    slip: Node
    lam: Node

    @property
    def mode(self) -> Mode:
        assert self.rows.mode is not None
        return self.rows.mode

    @property
    def limits(self) -> tuple[Node, Node | None]:
        """Limits of the force against a slip forwards and backwards; None is infinite."""
        mode = self.mode
        assert mode.kinetic is not None
        if mode.kind == "freewheel":
            return mode.kinetic, None
        return mode.kinetic, mode.backward if mode.backward is not None else mode.kinetic

    @property
    def formulas(self) -> tuple[Node, ...]:
        """The limits that are finite."""
        return tuple(n for n in self.limits if n is not None)


class MasslessFriction(Struct):
    """What is known of frictions on coordinates without mass: their modes, and what is added to the system."""

    modes: dict[str, Mode]
    drives: list[DriveRow]
    branches: list[BranchRow]
    assertions: list[AssertionRow]


def frictions_alone(system: MechanicalSystem, multipliers: Sequence[Sequence[Node]]) -> list[Rub]:
    """Return the frictions along one slip that are no contact's, by Coulomb's law."""
    found = []
    for rows, symbols in zip(system.constraints, multipliers, strict=True):
        mode = rows.mode
        frictional = mode is not None and mode.kind in ("friction", "freewheel")
        if mode is not None and frictional and not mode.contact and mode.smooth is None:
            (slip,), (lam,) = constraint_rates(system, rows), symbols
            found.append(Rub(rows, slip, lam))
    return found


def refuse_laws(
    system: MechanicalSystem,
    rub: Rub,
    rates: Sequence[Node],
    places: Sequence[Mapping[Node, float]],
    found: MasslessFriction,
    reporter: Reporter,
) -> None:
    """Report a law that the balance of forces of what has no mass does not decide.

    A static limit that is another formula, as ``peak*limit``, has to be the limit of sliding at the ``places``, and in every run.
    """
    mode, graph = rub.mode, system.graph
    for static, kinetic in ((mode.static, mode.kinetic), (mode.static_backward, mode.backward)):
        if static is None or kinetic is None or static == kinetic:
            continue
        least = graph.mul(graph.constant(ROUNDING), graph.abs(kinetic))
        same = graph.logical_not(graph.less(least, graph.abs(graph.sub(static, kinetic))))
        if not all(evaluate(graph, [same], dict(place))[0] for place in places):
            raise _refused(
                reporter,
                rub,
                "it acts on a massless coordinate, and its sticking limit exceeds its sliding limit",
                "without mass, the coordinate would jump when sliding begins; leave 'static' out, or give it a mass",
            )
        message = f"the friction '{rub.rows.name}' acts on a massless coordinate, and its sticking limit differs from its sliding limit"
        found.assertions.append(AssertionRow(same, message, rub.rows.origin))
    known = {*(s.node for s in system.q), *(s.node for s in system.v), system.symbols.time}
    known |= {s.node for group in (system.symbols.parameters, system.symbols.states) for s in group}
    known |= {s.node for group in (system.symbols.inputs, system.symbols.discretes) for s in group}
    if not (known - set(rates)).issuperset(graph.support(*rub.formulas)):
        raise _refused(
            reporter,
            rub,
            "it acts on a massless coordinate, and its limit depends on that motion or on a force",
            "there may be several rates or none that fit: give a mass to what it moves",
        )


def refuse_several(rubs: Sequence[Rub], reporter: Reporter) -> None:
    """Report several frictions on one coordinate that nothing else resists."""
    raise _refused(
        reporter,
        rubs[1],
        f"the friction '{rubs[0].rows.name}' acts on the same coordinate, and no damping resists it",
        "add the limits of both, or let a damping act too",
    )


def _refused(reporter: Reporter, rub: Rub, caption: str, help: str) -> Exception:
    return reporter.fail(
        "E0541",
        f"the friction '{rub.rows.name}' does not determine the motion of a massless coordinate",
        rub.rows.origin.shown,
        caption=caption,
        help=help,
    )


def damped(
    system: MechanicalSystem,
    rubs: Sequence[Rub],
    drives: Sequence[DriveRow],
    known: MasslessFriction,
    reporter: Reporter,
) -> list[DriveRow]:
    """Return the drives of coordinates, which hold forces of frictions, with formulas of these."""
    graph = system.graph
    if any(rub.lam in graph.support(*(n for d in drives for n in d.values)) for rub in rubs):
        raise _refused(
            reporter,
            rubs[0],
            "it acts on several coordinates without mass that no damping resists",
            "let a damping act on them, or give them masses; a single coordinate needs none",
        )
    rates = {system.v[i].node: rate for d in drives for i, rate in zip(d.v, d.rates, strict=True)}
    slips = substitute(graph, [rub.slip for rub in rubs], rates)
    symbols = [rub.lam for rub in rubs]
    found = list(drives)
    for k, (rub, slip, row) in enumerate(zip(rubs, slips, jacobian(graph, slips, symbols), strict=True)):
        if set(row) != {k} or not set(symbols).isdisjoint(graph.support(row[k])):
            raise _refused(
                reporter,
                rub,
                "the slips of several frictions depend on each other where nothing has mass"
                if len(row) > 1
                else "no rate depends on it in proportion",
                "separate them by a mass, or let linear dampings resist them",
            )
        (free,) = substitute(graph, [slip], {rub.lam: graph.zero})
        wanted = graph.div(free, row[k])
        forward, backward = rub.limits
        limit = f"limit of friction {rub.rows.name}"
        cases = {_relation(system, graph.less(forward, wanted), limit): graph.neg(forward)}
        if backward is not None:
            cases[_relation(system, graph.less(wanted, graph.neg(backward)), limit)] = backward
        force, sticks = graph.neg(wanted), graph.one
        for case, most in reversed(cases.items()):
            force, sticks = graph.select(case, most, force), graph.select(case, graph.zero, sticks)
        law = Regularized(graph.zero, None, "", sticks, force)
        known.modes[rub.rows.name] = replace(rub.mode, smooth=law)
        found = [
            replace(d, rates=_by_cases(graph, d.rates, rub.lam, cases, graph.neg(wanted))) for d in found
        ]
    return found


def _by_cases(
    graph: Graph, rates: Sequence[Node], lam: Node, cases: Mapping[Node, Node], otherwise: Node
) -> tuple[Node, ...]:
    """Return rates with the force ``lam`` of each case, so that they are exactly zero where nothing slips. Places hold no forces."""
    chosen = substitute(graph, rates, {lam: otherwise})
    for case, force in reversed(list(cases.items())):
        there = substitute(graph, rates, {lam: force})
        chosen = [graph.select(case, a, b) for a, b in zip(there, chosen, strict=True)]
    return tuple(chosen)


def sprung(
    system: MechanicalSystem,
    rub: Rub,
    place: int,
    row: Node,
    state_rates: Mapping[Node, Node],
    known: MasslessFriction,
    reporter: Reporter,
) -> None:
    """Add the drive of a single coordinate that no damping resists, with the events between sticking and sliding."""
    graph: Graph = system.graph
    scalar = system.v[place]
    rate, name = scalar.node, rub.rows.name
    (by_rate,), (by_force,) = jacobian(graph, [rub.slip], [rate]), jacobian(graph, [row], [rub.lam])
    along = by_rate.get(0)
    if along is None or not graph.is_constant(along):
        raise _refused(
            reporter,
            rub,
            "its slip is not a fixed multiple of the rate of this coordinate",
            "let it act on the coordinate itself",
        )
    assert set(by_force) == {0}, "virtual work puts the force of a friction into the rows of what it moves"
    (free,) = substitute(graph, [row], {rub.lam: graph.zero})
    force = graph.neg(graph.div(free, by_force[0]))
    forward, backward = rub.limits
    if backward is None:
        raise _refused(
            reporter,
            rub,
            "it is a freewheel on a massless coordinate, and no damping answers it",
            "let a damping act on this coordinate too, give it a mass, or a large limit in place of 'infinite'",
        )
    slides = graph.symbol(f"slides({name})")

    def sliding(limit: Node, sign: int) -> Node:
        """Return the rate at which the force stays at a limit."""
        stays = graph.add(force, limit) if sign > 0 else graph.sub(force, limit)
        (moved,) = substitute(graph, [system.rate(stays)], state_rates)
        (entries,) = jacobian(graph, [moved], [rate])
        if 0 not in entries:
            raise _refused(
                reporter,
                rub,
                "neither a spring nor a damping answers it, so that nothing decides where it stops",
                "connect what it moves by a spring or a damping, or give it a mass",
            )
        (rest,) = substitute(graph, [moved], {rate: graph.zero})
        return graph.neg(graph.div(rest, entries[0]))

    ahead, behind = sliding(forward, 1), sliding(backward, -1)
    (held,) = substitute(graph, [rub.slip], {rate: graph.zero})
    stuck = graph.neg(graph.div(held, along))
    is_ahead, is_behind = graph.less(graph.zero, slides), graph.less(slides, graph.zero)
    moving = graph.select(is_ahead, ahead, graph.select(is_behind, behind, stuck))
    origin = scalar.variable.origin
    known.drives.append(DriveRow((scalar.of,), (), (place,), (), (moving,), origin, True))
    sticks = graph.select(is_ahead, graph.zero, graph.select(is_behind, graph.zero, graph.one))
    law = Regularized(graph.zero, None, "", sticks, force, slides)
    known.modes[name] = replace(rub.mode, smooth=law)
    forwards = substitute(graph, [rub.slip], {rate: ahead})[0]
    backwards = substitute(graph, [rub.slip], {rate: behind})[0]
    none = graph.logical_not(graph.logical_or(is_ahead, is_behind))
    both, no = graph.logical_and, graph.logical_not
    limit, slip = f"limit of friction {name}", f"slip of friction {name}"
    over = _relation(system, graph.less(forward, graph.neg(force)), limit)
    under = _relation(system, graph.less(backward, force), limit)
    # one relation for the slip that ends and for the one that begins: where it is zero it is one of both
    turned = _relation(system, graph.less(forwards, graph.zero), slip)
    returned = _relation(system, graph.less(graph.zero, backwards), slip)
    events: list[tuple[Node, Node, str]] = [
        (both(none, both(over, no(turned))), graph.one, "slides"),
        (both(none, both(under, no(returned))), graph.minus_one, "slides"),
        (both(is_ahead, turned), graph.zero, "sticks"),
        (both(is_behind, returned), graph.zero, "sticks"),
    ]
    first = 1 + max((b.event for b in (*system.branches, *known.branches)), default=-1)
    for k, (condition, value, word) in enumerate(events):
        action = SetAction((slides,), (value,), False, rub.rows.origin)
        known.branches.append(
            BranchRow(first + k, condition, (action,), f"{name} {word}", rub.rows.origin, True)
        )
    beyond = graph.maximum(graph.sub(graph.neg(force), forward), graph.sub(force, backward))
    room = graph.div(graph.add(graph.abs(forward), graph.abs(backward)), graph.constant(EXCEEDED))
    message = f"the force on '{scalar.of}' is beyond its friction '{name}': without mass and damping it would jump there"
    known.assertions.append(
        AssertionRow(_relation(system, graph.less_equal(beyond, room), limit), message, origin)
    )


def _relation(system: MechanicalSystem, relation: Node, text: str) -> Node:
    """Let the search for events know a relation that decides whether a friction sticks, and what to call it if the model has none like
    it."""
    known = relation in system.lowering.relations
    system.lowering.relations[relation] = None
    system.lowering.leading.setdefault(relation, "" if known else text)
    return relation


def with_massless_friction(system: MechanicalSystem, known: MasslessFriction) -> MechanicalSystem:
    """Return the system with what is known of frictions on coordinates without mass."""
    if not known.modes:
        return system
    return replace(
        system,
        constraints=tuple(
            replace(rows, mode=known.modes.get(rows.name, rows.mode)) for rows in system.constraints
        ),
        branches=(*known.branches, *system.branches),
        assertions=(*system.assertions, *known.assertions),
    )
