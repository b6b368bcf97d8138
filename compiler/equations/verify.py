"""What holds for the equations of every model."""

from __future__ import annotations

from collections.abc import Sequence
from math import prod

from mechc.runtime.interface import CurveInterface, Quantity

from ..graph import Node
from ..graph import verify as graphs
from ..graph.operations import LOOKUP, SYMBOL
from ..malformed import Malformed, excerpt
from .model import SOUGHT, Equations, Function, HybridPlan, Slot, results_of

KINDS = {
    "t": ("time",),
    "y": ("coordinate", "rate", "state", "account", "tangent"),
    "u": ("input",),
    "z": ("discrete", "mode", "seed", "tangent"),
    "p": ("parameter", "idle"),
    "g": ("given",),
    "out": ("coordinate", "rate", "output", "exact", "energy", "momentum", "creep", "quadrature", "tangent"),
}
"""What the entries of each array may be, in their order in y and z; prescribed coordinates are outputs."""

READS = {"initial": "puzt", "discretes": "p", "inputs": "pt", "scene_still": "p", "delay_times": "p"}
"""Arrays that functions read which are called before a run; others read all."""


def verify(equations: Equations) -> None:
    """Raise Malformed where equations are not what model.py says.

    Each function has the results that its name promises and reads symbols that have a place at run time, which are
    those of the entries; plans refer to what is there; nothing is there that no fact asks for.
    """
    graphs.verify(equations.graph)
    _Check(equations).run()


class _Check:
    def __init__(self, equations: Equations) -> None:
        self.equations = equations
        self.functions = {f.name: f for f in equations.functions}
        self.arrays: dict[str, tuple[Quantity, ...]] = {
            "t": (equations.time,),
            "y": equations.states,
            "u": equations.inputs,
            "z": equations.discretes,
            "p": equations.parameters,
            "out": equations.outputs,
            "g": equations.given,
        }

    def run(self) -> None:
        if self.equations.curve is not None:
            self.layout()
            self.rules()
            for function in self.equations.functions:
                self.reads(f"function {function.name}", function.outputs, "tyzp")
            self.curve(self.equations.curve)
            return
        self.entries()
        self.layout()
        self.sizes()
        for function in self.equations.functions:
            self.function(function)
        self.rules()
        self.plans()
        if self.equations.switching is not None:
            self.hybrid(self.equations.switching)
        self.facts()

    # ------------------------------------------------------------ what there is

    def entries(self) -> None:
        e = self.equations
        for array, entries in self.arrays.items():
            seen: set[str] = set()
            order = [KINDS[array].index(x.kind) if x.kind in KINDS[array] else -1 for x in entries]
            for k, entry in enumerate(entries):
                if order[k] < 0:
                    self.at_entry(array, k, f"a {entry.kind} has no place in {array}")
                if array in ("y", "z") and k and order[k] < order[k - 1]:
                    self.at_entry(array, k, f"a {entry.kind} follows a {entries[k - 1].kind}")
                if entry.name in seen:
                    self.at_entry(array, k, "another entry has this name")
                seen.add(entry.name)
        kinds = [x.kind for x in e.states]
        counted = (
            kinds.count("coordinate"),
            kinds.count("rate"),
            kinds.count("state") + kinds.count("account") + kinds.count("tangent"),
        )
        if counted != (e.nq, e.nv, e.nx):
            raise Malformed("equations", f"nq, nv, nx are {(e.nq, e.nv, e.nx)}, the states say {counted}")
        for what, sizes in (("known", len(e.known)), ("starts", len(e.starts))):
            if sizes != len(e.states):
                raise Malformed("equations", f"{what} has {sizes} places for {len(e.states)} states")

    def layout(self) -> None:
        """Every number of the arrays has one symbol."""
        graph, taken = self.equations.graph, dict[Slot, Node]()
        for n, slot in self.equations.layout.items():
            size = len(self.arrays.get(slot.array, ())) if slot.array != "out" else 0
            where = f"equations, {slot.array}[{slot.index}]"
            if not 0 <= n < len(graph) or graph.op(n) != SYMBOL:
                raise Malformed(where, f"belongs to node {n}, which is not a symbol")
            if not 0 <= slot.index < size:
                raise Malformed(
                    where, f"is the place of '{graph.name(n)}', but {slot.array} has {size} numbers"
                )
            if slot in taken:
                self.at_entry(
                    slot.array, slot.index, f"belongs to '{graph.name(taken[slot])}' and '{graph.name(n)}'"
                )
            taken[slot] = n
        for array in "tyuzp":
            for k in range(len(self.arrays[array])):
                if Slot(array, k) not in taken:
                    self.at_entry(array, k, "has no symbol")

    # ------------------------------------------------------------ functions

    def promised(self) -> dict[str, int]:
        """Return the number of results of each function that may be there; 0 where it must not."""
        e = self.equations
        ny, nu, nz, np_, n_out = (len(self.arrays[a]) for a in ("y", "u", "z", "p", "out"))
        n_constraints = len(e.constraints)
        n_position = sum(c.level == "position" for c in e.constraints)
        promised = {
            "rhs": ny,
            "initial": ny,
            "initial_of_others": len(e.dependent),
            "found": len(e.found),
            "timed_arguments": 2 * len(e.timed_points),
            "outputs": n_out,
            "inputs": nu,
            "discretes": sum(x.kind != "seed" or bool(e.offers) for x in e.discretes),
            "closeness": 1,
            "project_position": e.nv + n_position,
            "project_velocity": e.nv + n_constraints,
            "constraints": n_position + n_constraints,
            "constraint_jacobian": n_constraints * e.nv,
            "displace": e.nq,
            "assertions": len(e.assertions),
            "assembly": len(e.assembly),
            "assembly_jacobian": len(e.assembly) * e.nv,
            **dict.fromkeys(("momentum", "force", "bias"), e.nv),
            "mass": e.nv**2,
            "jacobian": len(e.jacobian_pattern),
            **{name: len(pattern) for name, pattern in e.patterns.items()},
            **dict.fromkeys(("phase", "phase_rate"), len(e.phase)),
            "matter": e.matter_size,
            "balance": 2 * len(e.balance),
            "phase_gradient": len(e.phase) * (e.nq + e.nv),
            "tangent": ny + n_out,
            "adjoint": ny + nu + 1 + np_,
            "start_tangent": ny,
            "start_adjoint": nu + 1 + np_,
            **{o.function: prod(o.shape) for o in e.offers if not o.later},
            **({SOUGHT: sum(map(results_of, e.sought))} if e.sought else {}),
        }
        if e.scene is not None:
            promised |= {"scene_still": e.scene.n_still, "scene": e.scene.n_moving}
        if (h := e.switching) is not None:
            promised |= {
                **dict.fromkeys(("indicators", "indicator_rates"), len(h.switches) + len(h.rows)),
                "crossing_times": len(h.times) + len(h.clocks),
                "conditions": len(h.branches),
                "delay_times": 0 if h.delays is None else len(h.delays.delays),
                "row_values": 8 * len(h.rows),
                "respond": e.nv + len(h.rows),
                "told": h.told[1],
            }
            promised |= {} if h.crowd is None else h.crowd.results(e.nv)
            promised |= {b.function: ny + nz + len(b.shown.checks) for b in h.branches}
        return promised | {x.function: len(x.options) + len(x.settings) for x in e.experiments}

    def sizes(self) -> None:
        if len(self.functions) != len(self.equations.functions):
            raise Malformed(
                "equations", "two functions have one name", [f.name for f in self.equations.functions]
            )
        promised = self.promised()
        directions = sum(
            x.kind == "tangent" and x.name.startswith("d(time)") for x in self.equations.discretes
        )
        for name, function in self.functions.items():
            if directions and name.startswith(
                "tangent_"
            ):  # derivatives of a function that may not be there itself
                if len(function.outputs) % directions:
                    what = f"has {len(function.outputs)} results for {directions} directions"
                    raise Malformed(f"equations, function {name}", what, [function.doc])
                continue
            if name not in promised:
                raise Malformed(f"equations, function {name}", "nothing asks for it", sorted(promised))
            if len(function.outputs) != promised[name]:
                what = f"has {len(function.outputs)} results instead of {promised[name]}"
                raise Malformed(f"equations, function {name}", what, [function.doc])
        needed = {"rhs", "initial", "outputs", *(x.function for x in self.equations.experiments)}
        optional = (
            "inputs",
            "discretes",
            "initial_of_others",
            "assertions",
            "assembly",
            "conditions",
            "crossing_times",
            "delay_times",
            "jacobian",
            *self.equations.patterns,
            *("phase", "phase_rate", "phase_gradient", "matter", "scene_still", "scene", SOUGHT),
            *(offer.function for offer in self.equations.offers if not offer.later),
        )
        needed |= {name for name in optional if promised.get(name)}
        needed |= (
            {"project_position", "project_velocity", "displace"} if self.equations.constraints else set()
        )
        if missing := needed - self.functions.keys():
            raise Malformed("equations", f"lack {', '.join(sorted(missing))}", sorted(self.functions))

    def function(self, function: Function) -> None:
        once = {x.function: "p" for x in self.equations.experiments}
        given = self.equations.given and function.name.startswith(("outputs", "crowd_", SOUGHT))
        usual = "tyuzpg" if given else "tyuzp"
        self.reads(f"function {function.name}", function.outputs, {**READS, **once}.get(function.name, usual))

    def reads(self, where: str, nodes: Sequence[Node], arrays: str) -> None:
        graph, layout = self.equations.graph, self.equations.layout
        for k, n in enumerate(nodes):
            if not 0 <= n < len(graph):
                raise Malformed(f"equations, {where}, result {k}", f"is node {n} of {len(graph)}")
        for symbol in graph.support(*nodes):
            slot = layout.get(symbol)
            if slot is None or slot.array not in arrays:
                place = "which has no place at run time" if slot is None else f"which lies in {slot.array}"
                k = next(k for k, n in enumerate(nodes) if symbol in graph.support(n))
                raise Malformed(
                    f"equations, {where}, result {k}",
                    f"depends on '{graph.name(symbol)}', {place}",
                    graphs.way(graph, nodes[k], symbol),
                )

    def rules(self) -> None:
        """Parameters follow from parameters, one rule each, and none from itself."""
        e = self.equations
        rules = {rule.index: rule.value for rule in e.parameter_rules}
        if len(rules) != len(e.parameter_rules) or not rules.keys() <= set(range(len(e.parameters))):
            raise Malformed("equations", "parameter_rules name a parameter twice, or one that is not there")
        reads: dict[int, set[int]] = {}
        for index, value in rules.items():
            self.reads(f"the rule of parameter {e.parameters[index].name}", [value], "p")
            reads[index] = {e.layout[s].index for s in e.graph.support(value)}
        waiting = dict(reads)
        while ready := [k for k, found in waiting.items() if not found & waiting.keys()]:
            for k in ready:
                del waiting[k]
        if waiting:
            self.at_entry("p", min(waiting), "follows from itself")

    # ------------------------------------------------------------ curves

    def curve(self, c: CurveInterface) -> None:
        """Functions have the results that the plan promises, and patterns stay inside of their matrices."""
        columns = c.coordinates * (c.order + 1) + len(c.shared)
        numbers = c.unknown + len(c.numbers)
        integrals = sum(row.kind == "integral" for row in c.numbers)
        further = sum(row.kind == "integral" for row in c.further)
        promised = {
            "range": 2,
            "guess": c.coordinates,
            "guess_of_ends": c.unknown,
            "places": len(c.numbers) + len(c.further) - integrals - further,
            "further_integrands": further,
            "further_values": len(c.further) - further,
            "integrands": integrals,
            "integrand_gradients": len(c.gradient),
            "curvature": len(c.curvature),
            "points": len(c.points),
            "point_gradients": len(c.point_gradient),
            "point_curvature": len(c.point_curvature),
            "at_places": len(c.numbers) - integrals,
            "place_gradients": len(c.place_gradient),
            "place_curvature": len(c.place_curvature),
            "wholes": 1 + len(c.wholes),
            "whole_gradients": len(c.whole_gradient),
            "whole_curvature": len(c.whole_curvature),
            "outputs": len(self.equations.outputs),
            "first_integrals": len(c.first),
        }
        for name, size in promised.items():
            found = self.functions.get(name)
            if found is None or len(found.outputs) != size:
                what = (
                    "is not there" if found is None else f"has {len(found.outputs)} results instead of {size}"
                )
                raise Malformed(f"equations, function {name}", what)
        for what, pattern, rows, width in (
            ("gradient", c.gradient, integrals, columns),
            ("curvature", c.curvature, columns, columns),
            ("point_gradient", c.point_gradient, len(c.points), columns),
            ("point_curvature", c.point_curvature, columns, columns),
            ("place_gradient", c.place_gradient, len(c.numbers) - integrals, columns),
            ("place_curvature", c.place_curvature, columns, columns),
            ("whole_gradient", c.whole_gradient, 1 + len(c.wholes), numbers),
            ("whole_curvature", c.whole_curvature, numbers, numbers),
        ):
            self.indices(f"curve, rows of {what}", [i for i, _ in pattern], rows)
            self.indices(f"curve, columns of {what}", [j for _, j in pattern], width)
        self.indices("curve, shared", c.shared, numbers)

    # ------------------------------------------------------------ plans

    def plans(self) -> None:
        e = self.equations
        ny, n_out = len(e.states), len(e.outputs)
        self.indices("rotations", [i + k for i in e.rotations for k in (0, 3)], e.nq)
        self.indices("conserved", e.conserved, n_out)
        self.indices("energy_balance", [i for i in e.energy_balance if i != -1], n_out)
        self.indices("dependent", e.dependent, ny)
        self.indices("jacobian_pattern", [i for place in e.jacobian_pattern for i in place], ny)
        for name, pattern in {"jacobian_pattern": e.jacobian_pattern, **e.patterns}.items():
            if len(set(pattern)) != len(pattern):
                raise Malformed("equations", f"{name} names a place twice")
        for what, ranks in (
            ("constraints", [("position", "velocity").index(c.level) for c in e.constraints]),
            ("assembly", [a.stage for a in e.assembly]),
        ):
            if ranks != sorted(ranks):
                raise Malformed("equations", f"{what} are not in the order of their levels", [str(ranks)])
        for plan in e.experiments:
            for target in (*plan.settings, *(target for target, _ in plan.sweeps)):
                size = len(self.arrays[target.array]) if target.array in ("p", "y", "u", "z") else 0
                self.indices(f"experiment '{plan.name}', {target.array}", [target.index], size)
        rates = set(range(e.nq, e.nq + e.nv))
        forces = self.functions["rhs"].outputs[e.nq : e.nq + e.nv]
        read = [e.layout[s] for s in e.graph.support(*forces)]
        felt = any(slot.array == "y" and slot.index in rates for slot in read)
        if e.separable and (felt or e.nq != e.nv):
            raise Malformed("equations", "are said to be separable, but need other velocities")
        if e.scene is not None:
            size = e.scene.n_still + e.scene.n_moving
            for k, shape in enumerate(e.scene.shapes):
                self.indices(f"scene, shape {k} '{shape.kind}'", shape.numbers, size)

    def hybrid(self, h: HybridPlan) -> None:
        e, nz = self.equations, len(self.equations.discretes)
        switched = [s.index for s in (*h.switches, *h.times)]
        clocks = [i for clock in h.clocks for i in clock]
        held = [i for row in h.rows for i in (row.flag, row.sign, row.impulse, row.enabled) if i != -1]
        held += [i for share in h.shares for i in (share.rests, share.beside) if i != -1]
        if h.shares and len(h.shares) != len(h.rows):
            raise Malformed("equations, hybrid", f"{len(h.shares)} shares of {len(h.rows)} rows")
        initial = [h.initial] if h.initial != -1 else []
        delayed = [] if h.delays is None else [place for place, _, _ in h.delays.delayed]
        numbers = {slot.index: n for n, slot in e.layout.items() if slot.array == "z"}
        acting = [self.functions[b.function].outputs[len(e.states) :] for b in h.branches]
        acted = [i for i in range(nz) if any(outputs[i] != numbers[i] for outputs in acting)]
        used = [
            *delayed,
            *(i for i in acted if e.discretes[i].kind == "mode"),
            *switched,
            *clocks,
            *held,
            *initial,
            *(h.crowd.places if h.crowd is not None else ()),
            *(range(h.told[0], h.told[0] + 1 + h.told[1]) if h.told[1] else ()),
        ]
        self.indices("hybrid, z", used, nz)
        for index in used:
            if e.discretes[index].kind != "mode":
                self.at_entry("z", index, "is switched, but the user's")
        for index, entry in enumerate(e.discretes):
            if entry.kind == "mode" and index not in used:
                self.at_entry("z", index, "is a mode that nothing switches")
        if len(set(switched)) != len(switched):
            raise Malformed("equations, hybrid", "two switches share a number in z", [str(sorted(switched))])
        for k, row in enumerate(h.rows):
            size = len(h.switches) + len(h.times) if row.kind == "step" else len(h.rows)
            self.indices(
                f"hybrid, row {k} '{row.name}', normal", [row.normal] if row.normal != -1 else [], size
            )
        accounts = [i for i in (h.dissipated, h.supplied) if i != -1]
        self.indices("hybrid, accounts", accounts, len(e.states))
        if any(e.states[i].kind != "account" for i in accounts):
            raise Malformed("equations, hybrid", "books energy in a state that is not an account")
        self.indices("hybrid, total", [h.total] if h.total != -1 else [], len(e.outputs))

    def facts(self) -> None:
        """What is there, and what the facts say, agree."""
        e, graph = self.equations, self.equations.graph
        nodes = [n for f in e.functions for n in f.outputs]
        looked_up = {graph.table_of(n)[0] for n in graph.reach(nodes) if graph.op(n) == LOOKUP}
        time = next(n for n, slot in e.layout.items() if slot.array == "t")
        for fact, there in (
            ("tables", bool(looked_up)),
            ("inputs", bool(e.inputs)),
            ("assertions", bool(e.assertions)),
            ("time", time in graph.support(*self.functions["rhs"].outputs)),
            ("states", any(x.kind == "state" for x in e.states)),
        ):
            if (fact in e.needs) != there:
                raise Malformed(
                    "equations", f"need {fact}: {fact in e.needs}, have it: {there}", sorted(e.needs)
                )
        if e.rotations and "rotations" not in e.needs:  # those that are prescribed have no place in y
            raise Malformed("equations", "have rotations, but do not need them", sorted(e.needs))
        if "events" in e.needs and e.switching is None:
            raise Malformed("equations", "need events, but have no plan for them", sorted(e.needs))

    # ------------------------------------------------------------ what surrounds a mistake

    def indices(self, what: str, found: Sequence[int], size: int) -> None:
        for i in found:
            if not 0 <= i < size:
                raise Malformed(f"equations, {what}", f"names number {i} of {size}")

    def at_entry(self, array: str, index: int, what: str) -> None:
        entries = self.arrays[array]

        def show(k: int) -> str:
            return f"{array}[{k}] {entries[k].kind} {entries[k].name} [{entries[k].unit}]"

        raise Malformed(f"equations, {array}[{index}]", what, excerpt(len(entries), index, show))
