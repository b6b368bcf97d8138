"""A motion with one change of it: how its direction turns, and the logarithm of what its size has grown by.

Of a change w of the state, w' = (df/dy) w, in sizes s that the model states (1 without): u = w/s divided by its norm, and
l = ln(norm), are states of first order with

    u' = A u - g u          l' = g = u.A u / u.u          A = (df/dy) s[j]/s[i]

so that nothing grows however long the motion is, and l over the time is a Lyapunov exponent (Benettin and others 1980). All that
runs models runs these: threads, lanes, devices. Accounts and states that only follow the motion are left out, and of the change of
a rotation the part that would change the norm of its quaternion.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

from msgspec.structs import replace

from mechc.runtime.interface import GROWTH

from ..graph import Node
from ..graph.differentiate import jvp
from .followers import followers
from .model import Equations, Function, Slot, quantity
from .tangents import TANGENT

PART = "growth"
"""The part of the equations."""


def growth_equations(equations: Equations) -> Equations:
    """Return the equations with the change and its growth behind the states; the same equations where ``equations`` switch or have
    constraints, across which changes are not carried by formulas."""
    if equations.switching is not None or equations.constraints or equations.curve is not None:
        return equations
    return _Growth(equations).equations()


class _Growth:
    def __init__(self, equations: Equations) -> None:
        self.base, self.graph = equations, equations.graph
        following = set(followers(equations))
        states = enumerate(equations.states)
        self.own = [k for k, e in states if e.kind != "account" and k not in following]
        self.place = {k: n for n, slot in equations.layout.items() if slot.array == "y" for k in [slot.index]}
        self.u = {k: self.graph.symbol(f"change of {equations.states[k].name}") for k in self.own}
        self.log = self.graph.symbol("logarithm of growth")
        self.rotations = [[first + k for k in range(4)] for first in equations.rotations]

    def equations(self) -> Equations:
        base, graph = self.base, self.graph
        functions = {f.name: f for f in base.functions}
        rates = functions["rhs"].outputs
        u, sizes = self.allowed(), self.sizes()
        changes = {self.place[k]: graph.mul(sizes[k], u[k]) for k in self.own}
        moved = jvp(graph, [rates[k] for k in self.own], changes)
        turned = {k: graph.div(n, sizes[k]) for k, n in zip(self.own, moved, strict=True)}
        growth = graph.div(
            self.total(graph.mul(u[k], turned[k]) for k in self.own),
            self.total(graph.mul(u[k], u[k]) for k in self.own),
        )
        further = (*(graph.sub(turned[k], graph.mul(growth, u[k])) for k in self.own), growth)
        starts = functions["initial"].outputs + self.start()
        functions["rhs"] = replace(functions["rhs"], outputs=rates + further)
        functions["initial"] = replace(functions["initial"], outputs=starts)
        ny, count = len(base.states), len(self.own)
        pattern = base.jacobian_pattern
        if "jacobian" in functions:
            behind = {k: ny + i for i, k in enumerate(self.own)}
            kept = [e for e, (i, j) in enumerate(pattern) if i in behind and j in behind]
            values = functions["jacobian"].outputs
            pattern += tuple((behind[pattern[e][0]], behind[pattern[e][1]]) for e in kept)
            functions["jacobian"] = Function(
                "jacobian", "the Jacobian of the model, for the state and for its change",
                (*values, *(values[e] for e in kept)),
            )  # fmt: skip
        names = [f"change of {base.states[k].name}" for k in self.own]
        entries = [quantity(name, TANGENT, "", nominal=1.0) for name in (*names, GROWTH)]
        slots = {n: Slot("y", ny + i) for i, n in enumerate((*self.u.values(), self.log))}
        return replace(
            base,
            layout={**base.layout, **slots},
            nx=base.nx + count + 1,
            states=(*base.states, *entries),
            known=(*base.known, *[True] * (count + 1)),
            starts=(*base.starts, *[None] * (count + 1)) if base.starts else (),
            functions=tuple(functions.values()),
            jacobian_pattern=pattern,
            separable=False,
        )

    def total(self, nodes: Iterable[Node]) -> Node:
        return self.graph.sum(nodes)

    def sizes(self) -> dict[int, Node]:
        """Return the sizes in which changes are measured."""
        stated = {k: self.base.states[k].nominal or 1.0 for k in self.own}
        return {k: self.graph.constant(Fraction(abs(size))) for k, size in stated.items()}

    def allowed(self) -> dict[int, Node]:
        """Return the change without what would change the norm of a quaternion."""
        graph, found = self.graph, dict(self.u)
        for entries in self.rotations:
            q, u = [self.place[k] for k in entries], [self.u[k] for k in entries]
            along = graph.div(
                self.total(graph.mul(a, b) for a, b in zip(q, u, strict=True)),
                self.total(graph.mul(a, a) for a in q),
            )
            found |= {k: graph.sub(b, graph.mul(along, a)) for k, a, b in zip(entries, q, u, strict=True)}
        return found

    def start(self) -> tuple[Node, ...]:
        """Return a change that is special in no way, of length 1, and no growth. Rotations begin unchanged and are changed at once
        by their rates."""
        turning = {k for entries in self.rotations for k in entries}
        free = [k for k in self.own if k not in turning]
        shares = {k: 0.5 + (GOLDEN * (i + 1)) % 1.0 for i, k in enumerate(free)}
        length = sum(share**2 for share in shares.values()) ** 0.5
        constant = self.graph.constant
        return (
            *(constant(Fraction(shares.get(k, 0.0) / (length or 1.0))) for k in self.own),
            self.graph.zero,
        )


GOLDEN = (5**0.5 - 1) / 2
