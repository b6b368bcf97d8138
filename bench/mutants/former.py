"""Faults that mechc once had, put back: each is what a mend took away, said in the code as it is now."""

from __future__ import annotations

from . import former_models as models
from .fault import Edit, Fault, edit

CONTACTS = "compiler/mechanics/contacts.py"
ENERGIES = "compiler/equations/solve/energies.py"
EVENTS = "runtime/kernel/events"
RUNS = "runtime/studies/runs"
PLAIN_GAP = edit(CONTACTS, "(gap,) = lowering.switching((part,))", "gap = part")
PLAIN_SLIP = edit(
    CONTACTS,
    "slips = lowering.switching(rate_of(lowering, friction.on, symbols))",
    "slips = tuple(rate_of(lowering, friction.on, symbols))",
)
UNSEEN = (
    Edit(
        f"{RUNS}/missed_feature_scan.py",
        "    if not case.problem.narrow or plan.method.fixed_step or main.failure is not None or main.interrupted:\n",
        "    if case is not None:\n",
    ),
    Edit(f"{RUNS}/wakeup_scan.py", "    if main.t.size < 2 or span <= 0:\n", "    if main is not None:\n"),
)
ZERO_QUESTIONS = (
    Edit(
        "compiler/mechanics/forces.py",
        "    settled = lowering.questions.settle([n for pair in pairs for n in pair])\n"
        "    return list(zip(settled[::2], settled[1::2], strict=True))",
        "    nodes, questions = [n for pair in pairs for n in pair], lowering.questions\n"
        "    zeros = dict.fromkeys(questions.symbols_in(nodes), lowering.graph.zero)\n"
        "    from ..graph.rewrite import substitute\n"
        "    settled = substitute(lowering.graph, nodes, zeros)\n"
        "    return list(zip(settled[::2], settled[1::2], strict=True))",
    ),
    Edit(
        "compiler/mechanics/forces.py",
        "    values = lowering.numbers(load.value)\n    values = values * len(rates)",
        "    values = lowering.reported(load.value)\n    values = values * len(rates)",
    ),
)

FAULTS = (
    Fault(
        "questions about the state count as 0 in a force", ZERO_QUESTIONS, models.PUMP, point="1"
    ),
    Fault("forces asked for count as 0 in a force", ZERO_QUESTIONS, models.CREEP, point="1"),
    Fault(
        "questions count as 0 in the equation of a state",
        edit(
            "compiler/mechanics/build.py",
            "        values = lowering.numbers(equation.value)\n",
            "        from ..graph.rewrite import substitute\n"
            "        values = lowering.reported(equation.value)\n"
            "        zeros = dict.fromkeys(lowering.questions.symbols_in(values), lowering.graph.zero)\n"
            "        values = tuple(substitute(lowering.graph, values, zeros))\n",
        ),
        models.FOLLOW,
        point="1",
    ),
    Fault(
        "reactions of joints of the tree leave out what is written as energies",
        edit(
            "compiler/equations/solve/queries.py",
            "efforts = [graph.add(next(found), share) for share in energy_efforts(system, moved)]",
            "efforts = [graph.add(next(found), share if name in closing else graph.zero) "
            "for share in energy_efforts(system, moved)]",
        ),
        models.HINGE,
        point="2",
    ),
    Fault("kinks of a closed gap are not events: over the edge of a table", PLAIN_GAP, models.TABLE, point="3"),
    Fault("kinks of a closed gap are not events: over a roof", PLAIN_GAP, models.ROOF, point="3"),
    Fault("kinks of a closed gap are not events: a plate that starts", PLAIN_GAP, models.PLATE, point="3"),
    Fault("kinks of what friction acts on are not events: a belt that starts", PLAIN_SLIP, models.BELT, point="3"),
    Fault(
        "a gap that is the least of several is one",
        edit(CONTACTS, "    parts = hollow_parts(graph, gap)\n", "    parts = (gap,)\n"),
        models.GROOVE,
        point="3",
    ),
    Fault(
        "ticks that belong together are two instants",
        edit(f"{EVENTS}/schedule.c", "if (mech_abs(e->times[h->n_times + k] - t) <= rounding(t)) {",
             "if (e->times[h->n_times + k] == t) {"),
        models.CLOCKS,
        point="4",
    ),
    Fault(
        "'when time > 0 s' never fires",
        edit(f"{EVENTS}/begin.c", "const int before = mech_schedule_begin_before(s);", "const int before = 0;"),
        models.BEGUN,
        point="4",
    ),
    Fault(
        "a rough contact with two solutions takes one of them",
        edit(f"{EVENTS}/contact_modes.c",
             "    if (shared ? 0 : are_several(s) ? moves_otherwise(s, ends) : fits_open(s, &contact)) {",
             "    if (!shared && 0 && (are_several(s) ? moves_otherwise(s, ends) : fits_open(s, &contact))) {"),
        models.ROD,
        point="5",
    ),
    Fault(
        "of contacts that hit at once the first one in the text hits first",
        edit(f"{EVENTS}/impulses.c", "const mech_real least = -*mech_row_rate(s, contact) * (1 - MECH_C(1e-9));",
             "const mech_real least = -*mech_row_rate(s, contact) * (1 + MECH_C(1e-9));"),
        models.BOX,
        point="5",
    ),
    Fault(
        "velocities jump where constraints of velocities lose their rank",
        edit("runtime/kernel/stepping/step.c", "if (adaptive && jumps(s)) return", "if (0 && jumps(s)) return"),
        models.CART,
        point="6",
    ),
    *(
        Fault(
            f"definite integrals have 48 fixed points in one piece, and no known error: {of}",
            (
                Edit("compiler/mechanics/meaning/integrals.py",
                     "from .quadrature import BENT, Points, Rule\n",
                     "from .quadrature import BENT, Points, Rule, rules\n"),
                Edit("compiler/mechanics/meaning/integrals.py",
                     "            most = self._places_left(integrand, s)\n"
                     "            self._rules[name], error = chosen_rule(graph, integrand, s, lower, upper, self.settled, most)\n"
                     "            tell(self._reporter, expression.span, error, self._rules[name])\n",
                     "            self._rules[name] = rules()[0]\n"),
                Edit("compiler/mechanics/meaning/integrals.py",
                     "        pieces, bent = pieces_of(graph, integrand, s, lower, upper)\n",
                     "        pieces, bent = [lower, upper], False\n"),
                Edit("compiler/mechanics/meaning/integrals.py",
                     "            found = self._known(expression, integrand, pieces, bent)\n",
                     "            found: dict[str, list[Integral]] = {}\n"),
            ),
            model,
            point="7",
        )
        for of, model in (("that of a wave", models.WAVES), ("that of a kink", models.CORNER))
    ),
    Fault(
        "errors of small lengths are measured by those of large ones",
        edit(f"{RUNS}/own_size.py", "    if main.failure is not None or main.interrupted or sizeless is None or not main.y.size:\n",
             "    if main is not None:\n"),
        models.FAR,
        point="8",
    ),
    Fault(
        "what is narrow and lies between steps is not looked for",
        UNSEEN,
        models.HUMP,
        point="9",
    ),
    Fault(
        "what begins after a rest is not looked for",
        UNSEEN,
        models.PUSH,
        point="9",
    ),
    Fault(
        "the companion of fixed steps over a kink takes half of each step",
        edit("runtime/results/accuracy.py", "HALVES, APART, FARTHER = 2.0, 2.618, 3.303", "HALVES, APART, FARTHER = 2.0, 2.0, 2.0"),
        models.KINK,
        point="12",
    ),
    Fault(
        "'extends Base(part.m = e)' loses to what Base says of the part",
        (
            Edit("compiler/flat/names/instance.py", "DECLARED, STATED, EXTENDED = range(3)", "DECLARED, EXTENDED, STATED = range(3)"),
            Edit("compiler/flat/names/instance.py", "    return (-depth, -scope.level, stage)", "    return (-depth, stage, -scope.level)"),
        ),
        models.HEIR,
        point="13",
    ),
    Fault(
        "'initial part.x = e' loses to 'initial x' inside the part",
        edit("compiler/flat/statements/initial_values.py", "    rank = rank_of(scope, STATED)\n    stated",
             "    rank = (0 if scope.instance is None else scope.instance.depth, -scope.level, STATED)\n    stated"),
        models.INNER,
        point="13",
    ),
)  # fmt: skip
