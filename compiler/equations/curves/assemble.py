"""From what a model says of its curve to the functions that find it: integrands, conditions, their derivatives, experiments."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from msgspec.structs import replace

from mechc.lang.diagnostics import Reporter
from mechc.lang.units import unit_of
from mechc.runtime import interface
from mechc.runtime.interface import AssertionEntry, CurveRow, Experiment, Quantity, Setting

from ...flat.model import Kind, Literal
from ...graph import Graph, Node
from ...graph.differentiate import gradient, jacobian
from ...graph.evaluate import evaluate
from ...mechanics.meaning.symbols import Scalar
from ...mechanics.system import Curve, MechanicalSystem, WholeNumber
from ..model import EXCHANGED, Equations, Function, Slot, origin, quantity
from ..reported.entries import declared, parameter_rules
from .conditions import Conditions, conditions_of
from .first_integrals import answered, first_integrals
from .forms import Forms, forms_of, independent, kinks, over_a_parameter

Pattern = tuple[tuple[int, int], ...]


def assemble_curve(
    system: MechanicalSystem, curve: Curve, reporter: Reporter, parts: Collection[str]
) -> Equations:
    """Return the functions of a model of a curve; report what no curve can fulfil."""
    graph = system.graph
    exchanged = EXCHANGED in parts
    _check_range(system, curve, reporter)
    forms = forms_of(system, curve, exchanged=exchanged)
    found = conditions_of(system, curve, forms, reporter, exchanged=exchanged)
    reporter.stop_on_errors()
    order = found.order
    n = len(forms.scalars)
    numbers = [*(u.node for u in curve.unknown), *(w.symbol for w in found.numbers)]

    # in s, times the length of the range: integrals over s
    integrands = _over_range(forms, [w.node for w in found.integrals])
    weights: tuple[Node, ...] = ()
    if found.gauge:
        weights = tuple(graph.symbol(f"#weight {s.name}") for s in forms.scalars)
        speed = graph.sum(graph.mul(w, graph.mul(r, r)) for w, r in zip(weights, forms.by_s[1], strict=True))
        integrands[-2:] = [speed, graph.sqrt(speed)]
    lam, mu = found.lam, found.multipliers
    density = graph.sum(graph.mul(m, f) for m, f in zip(lam, integrands, strict=False))
    points = forms.over_s([g for _, g in found.points])
    bent = [*integrands, *points]
    shared = tuple(k for k, s in enumerate(numbers) if s in set(graph.support(*bent)))
    columns = [*(w for row in forms.by_s[: order + 1] for w in row), *(numbers[k] for k in shared)]

    places = found.places
    at = forms.over_s([w.node for w in places])
    at_density = graph.sum(graph.mul(m, e) for m, e in zip(lam[len(integrands) :], at, strict=True))
    point_density = graph.sum(graph.mul(m, g) for m, g in zip(found.densities, points, strict=True))
    wholes = [found.functional, *(g for _, g in found.wholes)]
    whole_density = graph.add(
        found.functional, graph.sum(graph.mul(m, g) for m, (_, g) in zip(mu, found.wholes, strict=True))
    )

    reported = _outputs(system, curve, forms, found, reporter)
    first = first_integrals(system, curve, forms, found)
    further = [w for w in found.further if w.place is None]
    elsewhere = [w for w in found.further if w.place is not None]
    also = _over_range(forms, [w.node for w in further])
    also_at = forms.over_s([w.node for w in elsewhere])
    further_numbers = [w.symbol for w in (*further, *elsewhere)]
    in_s = forms.over_s([node for _, node in first])
    output_nodes = forms.over_s([node for _, node in reported])
    moving = {forms.s, *(w for row in forms.by_s for w in row), *found.densities}
    varying = tuple(bool(moving & set(graph.support(node))) for node in output_nodes)

    bend_at, bends = kinks(
        graph,
        [*(w.node for w in found.numbers), *(g for _, g in found.points)],
        system.symbols.time,
        _fixed(system),
    )
    told, _ = kinks(graph, [w.node for w in found.further], system.symbols.time, _fixed(system))
    bend_at += [n for n in told if n not in bend_at]
    if bend_at and curve.unknown:
        reporter.error(
            "E0563",
            "a formula bends at a known place, and the range is not known",
            curve.origin.shown,
            caption="an end of this is to be found",
            help="elements end at kinks, which would then move: give the range",
        )
    if bends:
        reporter.warning(
            "W0564",
            "what is stationary has a kink whose place depends on the curve; only small elements resolve it",
            curve.origin.shown,
            help="take as independent variable the quantity that decides where the kink is",
        )
    gradients, gradient_pattern = _first(graph, integrands, columns)
    curvature, curvature_pattern = _second(graph, density, columns)
    point_gradients, point_gradient = _first(graph, points, columns)
    point_curvatures, point_curvature = _second(graph, point_density, columns)
    place_gradients, place_gradient = _first(graph, at, columns)
    place_curvatures, place_curvature = _second(graph, at_density, columns)
    whole_gradients, whole_gradient = _first(graph, wholes, numbers)
    whole_curvatures, whole_curvature = _second(graph, whole_density, numbers)
    guesses, guessed = _guesses(system, forms)
    asserted = forms.over_s(
        [answered(system, curve, forms, found, a.condition, reporter) for a in system.assertions]
    )
    depth = _depth(graph, forms, [*bent, *at, *also, *also_at, *output_nodes, *in_s, *asserted], order)

    functions = [
        Function("range", "the ends of the range", (curve.lower, curve.upper)),
        Function("guess", "the guess of each coordinate", tuple(forms.of_guess(guesses))),
        Function("guess_of_ends", "the guess of each end that is to be found", _end_guesses(system, curve)),
        Function("bends", "zero where an integrand bends", tuple(forms.over_s(bend_at))),
        Function("places", "where values are asked for, as a share of the range", tuple(_shares(graph, curve, (*places, *elsewhere)))),
        Function("further_integrands", "what is integrated for reports", tuple(also)),
        Function("further_values", "values at places for reports", tuple(also_at)),
        Function("integrands", "what is integrated over s", tuple(integrands)),
        Function("integrand_gradients", "their derivatives", gradients),
        Function("curvature", "second derivatives of the sum of multiplier * integrand", curvature),
        Function("points", "residuals at every place", tuple(points)),
        Function("point_gradients", "their derivatives", point_gradients),
        Function("point_curvature", "second derivatives of the sum of density * residual", point_curvatures),
        Function("at_places", "values at places", tuple(at)),
        Function("place_gradients", "their derivatives", place_gradients),
        Function("place_curvature", "second derivatives of the sum of multiplier * value", place_curvatures),
        Function("wholes", "what is stationary, then the residuals of conditions on numbers", tuple(wholes)),
        Function("whole_gradients", "their derivatives by the numbers", whole_gradients),
        Function("whole_curvature", "second derivatives of what is stationary and multiplier * residual", whole_curvatures),
        Function("outputs", "everything reported beside the curve", tuple(output_nodes)),
        Function("first_integrals", "what is the same along the curve", tuple(in_s)),
        Function("assertions", "1 where an assertion holds, else 0", tuple(asserted)),
    ]  # fmt: skip
    layout, states, z = _layout(
        system, curve, forms, found, [*numbers, *lam, *mu, *weights, *further_numbers], depth
    )
    plans, plan_functions = curve_experiments(system, layout, forms, reporter)
    reporter.stop_on_errors()
    plan = interface.CurveInterface(
        coordinates=n,
        order=order,
        depth=depth,
        unknown=len(curve.unknown),
        numbers=_number_rows(curve, found)[: len(found.numbers)],
        further=_number_rows(curve, found)[len(found.numbers) :],
        wholes=tuple(row for row, _ in found.wholes),
        points=tuple(row for row, _ in found.points),
        first=tuple(row for row, _ in first),
        shared=shared,
        gradient=gradient_pattern,
        curvature=curvature_pattern,
        point_gradient=point_gradient,
        point_curvature=point_curvature,
        place_gradient=place_gradient,
        place_curvature=place_curvature,
        whole_gradient=whole_gradient,
        whole_curvature=whole_curvature,
        varying=varying,
        unit=curve.unit,
        action=curve.action,
        gauge=found.gauge,
        bends=bends,
        guessed=guessed,
        exchanged=exchanged,
        exchangeable=not (exchanged or found.gauge or curve.action or points or bend_at or bends)
        and order == 1
        and all(w.place in (None, curve.lower, curve.upper) for w in found.numbers),
    )
    return Equations(
        name=system.model.name,
        doc=system.model.doc,
        graph=graph,
        layout=layout,
        nq=n,
        nv=n * depth,
        nx=len(found.densities),
        time=quantity(system.model.independent, "time", _independent_unit(system), span=curve.origin.span),
        states=states,
        parameters=_parameters(system),
        parameter_rules=parameter_rules(system),
        inputs=(),
        discretes=z,
        outputs=tuple(entry for entry, _ in reported),
        known=(False,) * len(states),
        starts=(None,) * len(states),
        functions=(*functions, *plan_functions),
        experiments=plans,
        needs=frozenset(),
        assertions=tuple(AssertionEntry(a.message, origin(a.origin.span)) for a in system.assertions),
        choices=(),
        curve=plan,
    )


def _check_range(system: MechanicalSystem, curve: Curve, reporter: Reporter) -> None:
    """Report a range whose ends are numbers that do not ascend."""
    graph = system.graph
    ends = (curve.lower, curve.upper)
    if graph.support(*ends):
        return
    low, high = evaluate(graph, ends, {})
    if low < high:
        return
    reporter.error(
        "E0551",
        f"the range of '{system.model.independent}' " + ("is empty" if low == high else "descends"),
        curve.origin.shown,
        help="write its lower end first: 'independent x from 0 m to 1 m;'",
    )
    reporter.stop_on_errors()


def _over_range(forms: Forms, nodes: Sequence[Node]) -> list[Node]:
    """Return formulas in x times dx as formulas in s times ds."""
    if forms.exchanged:
        return over_a_parameter(forms, nodes)
    return [forms.graph.mul(forms.length, f) for f in forms.over_s(nodes)]


# ---------------------------------------------------------------- derivatives


def _first(graph: Graph, nodes: Sequence[Node], columns: Sequence[Node]) -> tuple[tuple[Node, ...], Pattern]:
    if not nodes:
        return (), ()
    rows = jacobian(graph, nodes, columns)
    entries = [(i, j, entry) for i, row in enumerate(rows) for j, entry in sorted(row.items())]
    return tuple(e for *_, e in entries), tuple((i, j) for i, j, _ in entries)


def _second(graph: Graph, scalar: Node, columns: Sequence[Node]) -> tuple[tuple[Node, ...], Pattern]:
    """Return the upper triangle of the second derivatives of a formula."""
    first = gradient(graph, scalar, columns)
    rows = jacobian(graph, first, columns)
    entries = [(i, j, e) for i, row in enumerate(rows) for j, e in sorted(row.items()) if j >= i]
    return tuple(e for *_, e in entries), tuple((i, j) for i, j, _ in entries)


# ---------------------------------------------------------------- layout


def _fixed(system: MechanicalSystem) -> frozenset[Node]:
    return frozenset(s.node for s in system.symbols.parameters)


def _depth(graph: Graph, forms: Forms, nodes: Sequence[Node], order: int) -> int:
    support = set(graph.support(*nodes))
    used = [k for k, row in enumerate(forms.by_s) if support.intersection(row)]
    return max([order, *used])


def _layout(
    system: MechanicalSystem,
    curve: Curve,
    forms: Forms,
    found: Conditions,
    z: Sequence[Node],
    depth: int,
) -> tuple[dict[Node, Slot], tuple[Quantity, ...], tuple[Quantity, ...]]:
    y = [w for row in forms.by_s[: depth + 1] for w in row] + list(found.densities)
    entries = [_entry(s, "coordinate") for s in forms.scalars]
    entries += [
        quantity(f"der({s.name}, {k}) by s", "internal", "")
        for k in range(1, depth + 1)
        for s in forms.scalars
    ]
    entries += [quantity(f"multiplier({row.name})", "internal", "") for row, _ in found.points]
    unknown = [_entry(u, "end") for u in curve.unknown]
    names = [system.graph.name(n).lstrip("?#") for n in z[len(unknown) :]]
    numbers = [quantity(f"number {k}: {name}", "internal", "") for k, name in enumerate(names)]
    slots = {forms.s: Slot("t", 0)}
    slots |= {node: Slot("y", k) for k, node in enumerate(y)}
    slots |= {node: Slot("z", k) for k, node in enumerate(z)}
    slots |= {s.node: Slot("p", k) for k, s in enumerate(system.symbols.parameters)}
    return slots, tuple(entries), (*unknown, *numbers)


def _entry(scalar: Scalar, kind: str) -> Quantity:
    return declared(scalar.variable, scalar.name, kind)


def _parameters(system: MechanicalSystem) -> tuple[Quantity, ...]:
    kinds = {Kind.INTEGER: "integer", Kind.BOOLEAN: "boolean"}
    return tuple(
        replace(_entry(s, "parameter"), type=kinds.get(s.variable.type.kind, "real"))
        for s in system.symbols.parameters
    )


def _independent_unit(system: MechanicalSystem) -> str:
    type = independent(system).type
    return unit_of(type.dimension, type.angle)


# ---------------------------------------------------------------- guesses, places, outputs


def _guesses(system: MechanicalSystem, forms: Forms) -> tuple[list[Node], tuple[bool, ...]]:
    starts = {s.node: b for s, b in zip(system.q, system.start_q, strict=True)}
    found = [starts[s.node] for s in forms.scalars if s.node in starts]
    values, given = [b.value for b in found], [b.start is not None for b in found]
    if len(found) < len(forms.scalars):  # x itself, which is passed steadily
        values.append(system.symbols.time)
        given.append(True)
    return values, tuple(given)


def _end_guesses(system: MechanicalSystem, curve: Curve) -> tuple[Node, ...]:
    starts = {s.node: b for s, b in zip(system.q, system.start_q, strict=True)}
    return tuple(starts[s.node].value for s in curve.unknown)


def _shares(graph: Graph, curve: Curve, places: Sequence[WholeNumber]) -> list[Node]:
    length = graph.sub(curve.upper, curve.lower)
    shares = []
    for w in places:
        if w.place == curve.lower:
            shares.append(graph.zero)
        elif w.place == curve.upper:
            shares.append(graph.one)
        elif w.place is not None:
            shares.append(graph.div(graph.sub(w.place, curve.lower), length))
    return shares


def _outputs(
    system: MechanicalSystem, curve: Curve, forms: Forms, found: Conditions, reporter: Reporter
) -> list[tuple[Quantity, Node]]:
    return [
        (
            declared(row.definition, row.name, "output"),
            answered(system, curve, forms, found, row.node, reporter),
        )
        for row in system.outputs
    ]


def _number_rows(curve: Curve, found: Conditions) -> tuple[CurveRow, ...]:
    rows = [CurveRow(w.name, "integral", w.unit, False, origin(w.origin.shown)) for w in found.integrals]
    for w in (*found.places, *found.further):
        kind = (
            {curve.lower: "lower", curve.upper: "upper"}.get(w.place, "inside")
            if w.place is not None
            else "integral"
        )
        rows.append(CurveRow(w.name, kind, w.unit, False, origin(w.origin.shown)))
    return tuple(rows)


def curve_experiments(
    system: MechanicalSystem, layout: Mapping[Node, Slot], forms: Forms, reporter: Reporter
) -> tuple[tuple[Experiment, ...], tuple[Function, ...]]:
    """Return a plan and a function of (s, p) for each experiment."""
    plans, functions = [], []
    lowering, graph = system.lowering, system.graph
    scalars = [*system.symbols.parameters, *system.q]
    for number, experiment in enumerate(system.model.experiments):
        words = {
            name: str(e.value)
            for name, e in experiment.options.items()
            if isinstance(e, Literal) and isinstance(e.value, str)
        }
        numeric = {n: e for n, e in experiment.options.items() if n not in words}
        outputs: list[Node] = [lowering.scalar(e) for e in numeric.values()]
        targets: list[Setting] = []
        for setting in experiment.settings:
            found = [
                layout[s.node]
                for s in scalars
                if s.variable.name == setting.target and s.indices[: len(setting.indices)] == setting.indices
            ]
            if setting.rate or (not setting.guess and any(slot.array != "p" for slot in found)):
                reporter.error(
                    "E0553",
                    f"'{setting.target}' is a curve: an experiment can give another guess of it",
                    setting.origin.span,
                    help=f"write '{setting.target} ~ ..'",
                )
                continue
            values = lowering.numbers(setting.value)
            values = values * len(found) if len(values) == 1 else values
            for slot, value in zip(found, values, strict=True):
                targets.append(Setting(slot.array, slot.index, setting.guess))
                outputs.append(value)
        sweeps = []
        for sweep in experiment.sweeps:
            if sweep.structural:
                continue
            slots = [
                layout[s.node]
                for s in system.symbols.parameters
                if s.variable.name == sweep.target and s.indices[: len(sweep.indices)] == sweep.indices
            ]
            if not slots:
                reporter.error("E0820", f"'{sweep.target}' cannot be swept", sweep.origin.span)
                continue
            constants = tuple(evaluate(graph, [lowering.scalar(v) for v in sweep.values], {}))
            sweeps.append((Setting(slots[0].array, slots[0].index, False), constants))
        name = f"experiment_{number}"
        plans.append(
            Experiment(
                experiment.name, experiment.doc, name, tuple(numeric), words, tuple(targets), tuple(sweeps)
            )
        )
        title = f"experiment '{experiment.name}'" if experiment.name else "the default experiment"
        functions.append(Function(name, f"options and settings of {title}", tuple(forms.of_guess(outputs))))
    return tuple(plans), tuple(functions)
