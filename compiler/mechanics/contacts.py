"""Contacts and dry friction as rows that can be switched: a gap or a slip rate with a multiplier of its own.

Limits of frictions that ask which way these slip are limits of two sides: `if M*der(a) > 0 then f else g` of a friction on a is
at rest neither f nor g. Where the numbers that a relation compares differ by h s, with the slip s, it stands for h > 0 of a slip
forwards, and for h < 0 of one backwards.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from collections.abc import Set as AbstractSet

from msgspec.structs import replace

from mechc.lang.diagnostics import Label, Reporter
from mechc.lang.units import preferred_unit

from ..flat.model import Apply, Contact, Expression, FlatModel, Friction, Literal, Switch, friction_name
from ..flat.types import POWER
from ..graph import Graph, Node
from ..graph import operations as ops
from ..graph.differentiate import is_affine, jacobian, vjp
from ..graph.rewrite import substitute
from .forces import rate_of
from .kinematics.reactions import undisplaced
from .meaning.lower import Lowering
from .meaning.symbols import Symbols, base_unit, unit_text
from .modes import Mode, Regularized
from .system import ConstraintRows

REGULARIZED = "regularized"

TOUCHING = 1e-9
"""Overlap, in SI, that counts as rounding where no coordinate changes it."""


def switched_names(model: FlatModel) -> frozenset[str]:
    """Return the names of all that events release or engage."""
    return frozenset[str]().union(*(event.switched for event in model.events))


def open_at_start(model: FlatModel) -> dict[str, tuple[Expression, ...]]:
    """Return the names of what ``when initial() [and c] then release …`` leaves open, with the further conditions: no state need
    fulfil it until it is engaged."""
    found: dict[str, tuple[Expression, ...]] = {}
    for event in model.events:
        branch = event.branches[0]
        parts = _parts(branch.condition)
        further = tuple(p for p in parts if not (isinstance(p, Apply) and p.function == "initial"))
        if len(further) == len(parts):
            continue
        for action in branch.actions:
            if isinstance(action, Switch) and not action.engage:
                found[action.target] = further
    return found


def _parts(condition: Expression) -> tuple[Expression, ...]:
    """Return what has to hold at once."""
    if isinstance(condition, Apply) and condition.function == "and":
        return tuple(p for argument in condition.arguments for p in _parts(argument))
    return (condition,)


def switchable(
    lowering: Lowering, model: FlatModel, constraints: tuple[ConstraintRows, ...]
) -> tuple[ConstraintRows, ...]:
    """Give a mode to the constraints that are released or engaged; they hold at the start if nothing leaves them open."""
    switched, left = switched_names(model), open_at_start(model)
    stated = {constraint.name for constraint in model.constraints}
    result = []
    for k, rows in enumerate(constraints):
        if rows.name in switched:
            impulses = tuple(
                lowering.graph.symbol(f"#impulse {rows.name} {k}.{i}") for i in range(len(rows.residuals))
            )
            begins = rows.name not in left or not (rows.joint or rows.name in stated)
            unless = None
            if not begins and left[rows.name]:
                unless = _together(lowering, left[rows.name])
            flag = lowering.graph.symbol(f"closed({rows.name})")
            rows = replace(rows, mode=Mode("constraint", flag, impulses, begins=begins, unless=unless))
        result.append(rows)
    return tuple(result)


def _together(lowering: Lowering, conditions: Sequence[Expression]) -> Node:
    found = lowering.graph.one
    for condition in conditions:
        found = lowering.graph.logical_and(found, lowering.scalar(condition))
    return found


def contact_rows(
    lowering: Lowering, model: FlatModel, symbols: Symbols, driven: AbstractSet[Node], reporter: Reporter
) -> tuple[ConstraintRows, ...]:
    """Return the rows of contacts, each followed by its friction, then those of other frictions. ``driven``: what drives prescribe."""
    switched, moving, left = switched_names(model), symbols.moving - driven, open_at_start(model)
    rows: list[ConstraintRows] = []
    for contact in model.contacts:
        rows += _contact(
            lowering, contact, symbols, moving, contact.name in switched, left.get(contact.name), reporter
        )
    for friction in model.frictions:
        rows.append(_friction(lowering, friction, symbols, reporter))
    return tuple(rows)


def gap_parts(lowering: Lowering, contact: Contact, positions: AbstractSet[Node]) -> tuple[Node, ...]:
    """Return the gaps of which the stated one is the least, as of a groove min(l, r): each is a contact of its own, as a body
    in the corner touches both. A gap that is no least, of which a part does not move, or whose parts have one normal, is one."""
    from ..graph.kinks import hollow_parts

    graph = lowering.graph
    (gap,) = lowering.numbers(contact.gap)
    parts = hollow_parts(graph, gap)
    if len(parts) == 1 or any(positions.isdisjoint(graph.support(undisplaced(graph, p))) for p in parts):
        return (gap,)
    normals = {tuple(vjp(graph, [(part, graph.one)], sorted(positions))) for part in parts}
    return parts if len(normals) > 1 else (gap,)


def keeps_distance(lowering: Lowering, contact: Contact, moving: AbstractSet[Node]) -> bool:
    """Tell whether nothing of what moves freely changes the distance of two shapes, as of what turns about a vertical axis
    above a floor."""
    if not contact.pair:
        return False
    (gap,) = lowering.numbers(contact.gap)
    return moving.isdisjoint(lowering.graph.support(undisplaced(lowering.graph, gap)))


def part_names(name: str, count: int) -> tuple[str, ...]:
    """Return the names of the rows of a contact, one for each part of its gap."""
    return (name,) if count == 1 else tuple(f"{name}[{k + 1}]" for k in range(count))


def directions(count: int) -> tuple[str, ...]:
    """Return what tells the frictions of a contact apart, one for each direction of slip."""
    return ("",) if count == 1 else tuple(f"[{k + 1}]" for k in range(count))


def _contact(
    lowering: Lowering,
    contact: Contact,
    symbols: Symbols,
    moving: AbstractSet[Node],
    switched: bool,
    left: Sequence[Expression] | None,
    reporter: Reporter,
) -> list[ConstraintRows]:
    """Return the row of the gap, then those of the friction; so for each part of a gap that is the least of several. ``left``: on what
    further conditions the start leaves it open, None where it does not."""
    graph, name = lowering.graph, contact.name
    parts = gap_parts(lowering, contact, symbols.positions)
    names = part_names(name, len(parts))
    restitution = _coefficient(lowering, symbols, contact.restitution, "restitution", reporter, most=1)
    rest = contact.options.get("rest")
    rows: list[ConstraintRows] = []
    for own, part in zip(names, parts, strict=True):
        (gap,) = lowering.switching((part,))
        lowering.questions.refuse((gap,), "a gap", contact.gap, "write the distance of what touches")
        support = set(graph.support(undisplaced(graph, gap)))
        if contact.pair and not switched and moving.isdisjoint(support):
            limit = graph.constant(-TOUCHING)
            what = f"the shapes of the contact '{name}' overlap, and nothing that moves freely can part them"
            lowering.apart[name] = (graph.less_equal(limit, gap), what, contact.origin)
            return []
        if support & symbols.velocities or not support & symbols.positions & moving:
            prescribed = not support & symbols.velocities and bool(support & symbols.positions)
            reporter.error(
                "E0702",
                f"the gap of contact '{name}' must depend on coordinates" + " that move freely" * prescribed,
                contact.gap.span,
                caption="only what is driven moves here, and no force of a contact holds that"
                if prescribed
                else "this contains velocities"
                if support & symbols.velocities
                else "nothing here can move",
                help="to end the run there, write 'assert .. > 0 m, \"..\";'"
                if prescribed
                else "write the distance that stays positive or zero",
            )
            return []
        mode = Mode(
            "contact",
            graph.symbol(f"closed({own})"),
            (graph.symbol(f"#impulse {own}"),),
            enabled=graph.symbol(f"enabled({name})") if switched else None,
            restitution=restitution,
            rest=graph.minus_one if rest is None else lowering.scalar(rest),
            whole=name,
            begins=left is None,
            unless=_together(lowering, left) if left else None,
        )
        row = ConstraintRows(own, "position", (gap,), (base_unit(contact.gap),), "", "", contact.origin, mode)
        rows += [row, *_contact_friction(lowering, symbols, contact, own, reporter)]
    return rows


def _contact_friction(
    lowering: Lowering, symbols: Symbols, contact: Contact, name: str, reporter: Reporter
) -> list[ConstraintRows]:
    """Return a row for each component of the slip; none where the contact is smooth. ``name``: of the row of the gap."""
    graph = lowering.graph
    if contact.friction is None:
        return []
    if contact.along is None:
        reporter.error(
            "E0703",
            f"contact '{contact.name}' has friction, but does not say along what it slides",
            contact.origin.span,
            help="add 'along s' with the slip velocity s",
        )
        return []
    slips = lowering.switching(lowering.numbers(contact.along))
    lowering.questions.refuse(slips, "a slip", contact.along, "write the velocity of what slides")
    kinetic = _coefficient(lowering, symbols, contact.friction, "coefficient of friction", reporter)
    static = kinetic
    if contact.static is not None:
        static = _coefficient(lowering, symbols, contact.static, "coefficient of friction", reporter)
        _check_static(lowering, kinetic, static, contact.static, contact.friction, reporter)
    smooth = _smooth(lowering, contact.options, slips, name, reporter)
    if smooth:
        reporter.warning(
            "W0723",
            f"impacts of the contact '{name}' are without friction",
            contact.options["law"].span,
            caption="a smooth force is finite and does nothing during an impact",
            help="leave 'law' out to get an impulse of friction in impacts, or accept that only closed contacts are braked",
        )
    unit = base_unit(contact.along)
    rows = []
    for k, (slip, component) in enumerate(zip(slips, directions(len(slips)), strict=True)):
        own = f"{friction_name(name)}{component}"
        friction = Mode(
            "friction",
            graph.symbol(f"sticks({name}){component}"),
            (graph.symbol(f"#impulse {own}"),),
            sign=graph.symbol(f"slip({name}){component}"),
            contact=name,
            kinetic=kinetic,
            static=static,
            smooth=smooth[k] if smooth else None,
            whole=f"{friction_name(contact.name)}{component}",
        )
        rows.append(ConstraintRows(own, "velocity", (slip,), (unit,), "", "", contact.origin, friction))
    return rows


def _friction(lowering: Lowering, friction: Friction, symbols: Symbols, reporter: Reporter) -> ConstraintRows:
    graph, name = lowering.graph, friction.name
    slips = lowering.switching(rate_of(lowering, friction.on, symbols))
    stated = [friction.kinetic, friction.static or friction.kinetic]
    kinetic, static = map(lowering.scalar, stated)
    backward = static_backward = None
    if friction.backward is not None:
        stated += [friction.backward, friction.static_backward or friction.backward]
        backward, static_backward = map(lowering.scalar, stated[2:])
    elif (
        not friction.one_way
        and not friction.options
        and (sides := sides_of(lowering, kinetic, slips[0], symbols.velocities))
    ):
        same = static if friction.static is not None else None
        (kinetic, backward), stated = sides, [stated[0], stated[1], stated[0], stated[1]]
        static, static_backward = (kinetic, backward) if same is None else (same, same)
    limits = [n for n in (kinetic, static, backward, static_backward) if n is not None]
    for value, expression in zip(limits, stated, strict=True):
        if not is_affine(graph, (value,), symbols.accelerations.intersection(graph.support(value))):
            raise _inertia_in_a_law(
                lowering, f"the limit of friction '{name}'", "is not affine in", expression
            )
        if graph.is_constant(value) and graph.value(value) < 0:
            reporter.error(
                "E0706",
                f"the limit of friction '{name}' is negative",
                expression.span,
                caption="this is a size: zero or positive",
                help="write how large the force may be, without a sign: friction acts against the motion by itself",
            )
    if friction.static is not None:
        _check_static(lowering, kinetic, static, friction.static, friction.kinetic, reporter)
    if backward is not None and static_backward is not None and friction.static_backward is not None:
        _check_static(lowering, backward, static_backward, stated[3], stated[2], reporter)
    smooth = _smooth(lowering, friction.options, slips, name, reporter)
    unit = unit_text(POWER / friction.kinetic.type.dimension)
    if friction.one_way:
        mode = Mode(
            "freewheel",
            graph.symbol(f"sticks({name})"),
            (graph.symbol(f"#impulse {name}"),),
            kinetic=kinetic,
            static=static,
            restitution=graph.zero,
            rest=graph.minus_one,
        )
        return ConstraintRows(name, "velocity", slips, (unit,), "", "", friction.origin, mode)
    mode = Mode(
        "friction",
        graph.symbol(f"sticks({name})"),
        (graph.symbol(f"#impulse {name}"),),
        sign=graph.symbol(f"slip({name})"),
        kinetic=kinetic,
        static=static,
        backward=backward,
        static_backward=static_backward,
        smooth=smooth[0] if smooth else None,
    )
    return ConstraintRows(name, "velocity", slips, (unit,), "", "", friction.origin, mode)


def _inertia_in_a_law(lowering: Lowering, what: str, must: str, expression: Expression) -> Exception:
    return lowering.reporter.fail(
        "E0519",
        f"{what} {must} accelerations",
        expression.span,
        caption="this contains a second derivative",
        help="forces and accelerations are found together, from equations that are linear in the latter",
    )


def _check_static(
    lowering: Lowering, kinetic: Node, static: Node, own: Expression, other: Expression, reporter: Reporter
) -> None:
    """Report a limit of sticking below that of sliding: at rest it would slip and be held in turn."""
    graph = lowering.graph
    if not (graph.is_constant(kinetic) and graph.is_constant(static)):
        return
    if 0 <= graph.value(static) < graph.value(kinetic):
        reporter.error(
            "E0706",
            "the limit while sticking is less than that while sliding",
            own.span,
            caption=f"this is {float(graph.value(static)):g}",
            labels=(Label(other.span, f"and this {float(graph.value(kinetic)):g}"),),
            help="'friction f static fs': fs is at least f",
        )


def _smooth(
    lowering: Lowering,
    options: Mapping[str, Expression],
    slips: Sequence[Node],
    name: str,
    reporter: Reporter,
) -> tuple[Regularized, ...]:
    """Return the smooth law with tanh(|s|/v_stick) s/|s| for a regularized friction, or nothing."""
    law = options.get("law")
    if not isinstance(law, Literal) or law.value != REGULARIZED:
        return ()
    speed = options.get("v_stick")
    if speed is None:
        reporter.error(
            "E0707",
            f"the regularized friction '{name}' does not say below which speed it creeps",
            law.span,
            help="add 'v_stick = 1 mm/s'; below this speed the force grows with the speed",
        )
        return ()
    graph, limit = lowering.graph, lowering.scalar(speed)
    square = graph.zero
    for slip in slips:
        square = graph.add(square, graph.mul(slip, slip))
    size = graph.abs(slips[0]) if len(slips) == 1 else graph.sqrt(square)
    creep = graph.select(graph.less(size, limit), size, graph.zero)
    unit = preferred_unit(speed.type.dimension, speed.type.angle)
    if len(slips) == 1:
        return (Regularized(graph.tanh(graph.div(slips[0], limit)), creep, unit),)
    share = graph.div(graph.tanh(graph.div(size, limit)), size)
    share = graph.select(graph.less(graph.zero, square), share, graph.div(graph.one, limit))
    first, second = (graph.mul(share, slip) for slip in slips)
    return Regularized(first, creep, unit), Regularized(second, None, unit)


def _coefficient(
    lowering: Lowering,
    symbols: Symbols,
    expression: Expression | None,
    what: str,
    reporter: Reporter,
    *,
    most: int | None = None,
) -> Node:
    """Return a number that is not negative; zero where none is given."""
    graph = lowering.graph
    if expression is None:
        return graph.zero
    value = lowering.scalar(expression)
    if symbols.accelerations.intersection(graph.support(value)):
        raise _inertia_in_a_law(lowering, f"a {what}", "must not depend on", expression)
    if graph.is_constant(value):
        number = graph.value(value)
        if number < 0 or (most is not None and number > most):
            reporter.error(
                "E0701",
                f"a {what} lies between 0 and 1" if most else f"a {what} is zero or positive",
                expression.span,
                caption=f"this is {float(number):g}",
            )
    return value


def sides_of(
    lowering: Lowering, limit: Node, slip: Node, velocities: Collection[Node]
) -> tuple[Node, Node] | None:
    """Return the limits of slips forwards and backwards; None where the limit does not ask for the direction."""
    graph = lowering.graph
    asked = [n for n in graph.reach([limit]) if graph.op(n) in (ops.LESS, ops.LESS_EQUAL, ops.SIGN)]
    moving = sorted(set(velocities).intersection(graph.support(slip)))
    asked = [n for n in asked if not set(moving).isdisjoint(graph.support(n))]
    if not asked:
        return None  # before a node is made, whose number would reorder formulas
    forward: dict[Node, Node] = {}
    backward: dict[Node, Node] = {}
    for n in asked:
        arguments = graph.args(n)
        tested = arguments[0] if graph.op(n) == ops.SIGN else graph.sub(arguments[1], arguments[0])
        factor = _factor(graph, tested, slip, moving)
        if factor is None:
            continue
        if graph.op(n) == ops.SIGN:
            forward[n] = graph.sign(factor)
            backward[n] = graph.neg(forward[n])
        else:
            forward[n], backward[n] = graph.less(graph.zero, factor), graph.less(factor, graph.zero)
    if not forward:
        return None
    for n in (*forward.values(), *backward.values()):
        if graph.op(n) in (ops.LESS, ops.SIGN):
            lowering.relations[n] = None
    ahead, behind = substitute(graph, [limit], forward)[0], substitute(graph, [limit], backward)[0]
    return ahead, behind


def _factor(graph: Graph, tested: Node, slip: Node, moving: Sequence[Node]) -> Node | None:
    """Return h of tested = h slip; None where it is nothing like that."""
    (shares,) = jacobian(graph, [slip], moving)
    (rates,) = jacobian(graph, [tested], moving)
    for k, share in shares.items():
        if not graph.is_constant(share):
            continue
        factor = graph.div(rates.get(k, graph.zero), share)
        rest = graph.sub(tested, graph.mul(factor, slip))
        return factor if factor != graph.zero and graph.is_zero(rest) else None
    return None
