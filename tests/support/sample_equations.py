"""Equations built by hand or from mechanisms, for the tests of programs and targets."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from mechanisms import Mechanism, chain_parents, planar_tree

from mechc.compiler.equations.model import Equations, Function, ParameterRule, Slot
from mechc.compiler.graph import Graph, Node, Samples, monotone_table
from mechc.compiler.graph.elimination.eliminate import solve
from mechc.runtime.interface import AssertionEntry, Experiment, Quantity, Setting

TIME = Quantity("t", "time", "s")


def equations(
    graph: Graph,
    functions: Sequence[Function],
    *,
    name: str = "sample",
    states: Sequence[tuple[Node, Quantity]] = (),
    nv: int = 0,
    nx: int = 0,
    parameters: Sequence[tuple[Node, Quantity, Node]] = (),
    inputs: Sequence[tuple[Node, Quantity]] = (),
    discretes: Sequence[tuple[Node, Quantity]] = (),
    outputs: Sequence[Quantity] = (),
    experiments: Sequence[Experiment] = (),
    assertions: Sequence[AssertionEntry] = (),
    time: Node | None = None,
    doc: str = "",
) -> Equations:
    """Lay out symbols in the order given; a parameter comes with its rule."""
    layout = {} if time is None else {time: Slot("t", 0)}
    for array, symbols in (
        ("y", [s for s, _ in states]),
        ("u", [s for s, _ in inputs]),
        ("z", [s for s, _ in discretes]),
        ("p", [s for s, _, _ in parameters]),
    ):
        layout.update({s: Slot(array, i) for i, s in enumerate(symbols)})
    return Equations(
        name=name,
        doc=doc,
        graph=graph,
        layout=layout,
        nq=len(states) - nv - nx,
        nv=nv,
        nx=nx,
        time=TIME,
        states=tuple(e for _, e in states),
        parameters=tuple(e for _, e, _ in parameters),
        parameter_rules=tuple(ParameterRule(i, rule) for i, (_, _, rule) in enumerate(parameters)),
        inputs=tuple(e for _, e in inputs),
        discretes=tuple(e for _, e in discretes),
        outputs=tuple(outputs),
        known=(True,) * len(states),
        functions=tuple(functions),
        experiments=tuple(experiments),
        needs=frozenset(),
        choices=(),
        assertions=tuple(assertions),
    )


def pendulum() -> Equations:
    """A damped pendulum with a driving torque: every kind of array, an experiment, an assertion."""
    g = Graph()
    t, theta, omega, torque, mode = (g.symbol(n) for n in ("t", "theta", "omega", "torque", "mode"))
    m, length, gravity, damping, inertia = (g.symbol(n) for n in ("m", "l", "g", "b", "J"))
    number = g.constant
    weight = g.mul(g.mul(m, gravity), length)
    moment = g.sub(g.sub(torque, g.mul(damping, omega)), g.mul(weight, g.sin(theta)))
    acceleration = g.div(moment, inertia)
    kinetic = g.mul(g.half, g.mul(inertia, g.mul(omega, omega)))
    energy = g.sub(kinetic, g.mul(weight, g.cos(theta)))
    return equations(
        g,
        [
            Function("rhs", "Rates of the state.", (omega, acceleration)),
            Function("initial", "State at the start.", (number(Fraction(1, 2)), g.zero)),
            Function("inputs", "Default inputs.", (g.mul(number(Fraction(1, 10)), g.sin(t)),)),
            Function("discretes", "Discrete variables at the start.", (g.zero,)),
            Function("outputs", "What is reported.", (energy, g.mul(length, g.sin(theta)), mode)),
            Function("assertions", "What must hold.", (g.less(g.abs(theta), number(3)),)),
            Function(
                "experiment_swing",
                "Options and settings of swing.",
                (number(10), number(Fraction(6, 5)), length),
            ),
        ],
        name="Pendulum",
        doc="A point mass on a rod, with damping\nand a driving torque.",
        time=t,
        states=[
            (theta, Quantity("theta", "coordinate", "rad", display="deg", doc="from the vertical")),
            (omega, Quantity("der(theta)", "rate", "rad/s")),
        ],
        nv=1,
        inputs=[(torque, Quantity("torque", "input", "N.m"))],
        discretes=[(mode, Quantity("mode", "discrete", ""))],
        parameters=[
            (m, Quantity("m", "parameter", "kg"), number(2)),
            (length, Quantity("l", "parameter", "m"), number(Fraction(4, 5))),
            (gravity, Quantity("g", "parameter", "m/s2"), number(Fraction(980665, 100000))),
            (damping, Quantity("b", "parameter", "N.m.s"), number(Fraction(1, 20))),
            (inertia, Quantity("J", "parameter", "kg.m2"), g.mul(m, g.mul(length, length))),
        ],
        outputs=[
            Quantity("energy", "energy", "J"),
            Quantity("x", "output", "m"),
            Quantity("mode", "output", ""),
        ],
        assertions=[AssertionEntry("theta stays below 3 rad", None)],
        experiments=[
            Experiment(
                "swing",
                "Let it swing.",
                "experiment_swing",
                ("stop",),
                {},
                (Setting("y", 0, False), Setting("p", 1, False)),
                (),
            )
        ],
    )


def from_mechanism(mechanism: Mechanism, name: str) -> Equations:
    """Return the equations of a tree: its accelerations by elimination."""
    g = mechanism.graph
    accelerations = solve(g, mechanism.residuals, mechanism.a).solutions
    rates = (*mechanism.u, *accelerations)
    known = {*mechanism.q, *mechanism.u}
    parameters = [s for s in g.support(*rates) if s not in known]
    return equations(
        g,
        [
            Function("rhs", "Rates of the state.", rates),
            Function("initial", "State at the start.", tuple(g.constant(1) for _ in rates)),
        ],
        name=name,
        states=[
            *((s, Quantity(g.name(s), "coordinate", "rad")) for s in mechanism.q),
            *(
                (s, Quantity(f"der({g.name(q)})", "rate", "rad/s"))
                for q, s in zip(mechanism.q, mechanism.u, strict=True)
            ),
        ],
        nv=len(mechanism.u),
        parameters=[
            (s, Quantity(g.name(s), "parameter", ""), g.constant(Fraction(10 + i, 10)))
            for i, s in enumerate(parameters)
        ],
    )


def chain(links: int, *, joint_angles: bool = False) -> Equations:
    """Return the planar pendulum of point masses, in absolute angles unless said otherwise."""
    mechanism = planar_tree(Graph(), chain_parents(links), joint_angles=joint_angles, rigid=False)
    return from_mechanism(mechanism, f"chain of {links}")


def every_operation() -> Equations:
    """One function whose outputs are every operation of the graph, of two states and a parameter."""
    g = Graph()
    a, b, c, t = (g.symbol(n) for n in ("a", "b", "c", "t"))
    index = g.add_table(monotone_table((-2.0, -0.5, 0.1, 3.0), (0.0, 1.5, 1.75, -1.0)))
    value = g.lookup(index, a)
    samples = g.add_table(Samples((-2.0, -0.5, 0.1, 0.2, 3.0)))
    slope = g.lookup_slope(value)
    curvature = g.lookup_slope(slope)
    less, less_equal, equal = g.less(a, b), g.less_equal(a, g.floor(a)), g.equal(g.floor(a), a)
    unary = (
        *(g.sin, g.cos, g.tan, g.asin, g.acos, g.atan, g.sinh, g.cosh, g.tanh, g.asinh, g.acosh, g.atanh),
        *(g.exp, g.log, g.sqrt, g.abs, g.sign, g.floor, g.neg),
    )
    binary = (g.add, g.sub, g.mul, g.div, g.atan2, g.minimum, g.maximum, g.modulo, g.pow)
    number = g.constant
    outputs = (
        *(f(a) for f in unary),
        *(f(a, b) for f in binary),
        *(f(b, a) for f in (g.div, g.modulo, g.pow, g.minimum, g.maximum)),
        *(less, less_equal, equal, g.logical_not(less)),
        g.logical_and(less, g.logical_not(equal)),
        g.logical_or(g.logical_and(a, less_equal), equal),
        g.select(less, g.sqrt(a), g.div(b, a)),
        g.mul(number(3), g.select(g.logical_or(less, equal), b, g.select(equal, a, c))),
        *(g.mul(less, a), g.neg(less), g.add(less, equal), g.select(a, b, c)),
        *(value, slope, curvature, g.lookup_slope(curvature)),
        *(g.cell(samples, a), g.element(samples, g.floor(b)), g.element(samples, g.cell(samples, b))),
        *(g.power(a, 3), g.power(a, Fraction(1, 3)), g.power(a, -2), g.power(b, Fraction(5, 2))),
        *(
            g.mul(number(Fraction(1, 3)), a),
            g.add(number(Fraction(1, 10)), a),
            g.sub(a, number(Fraction(7, 2))),
        ),
        g.mul(number(Fraction(22, 7 * 10**20)), a),
        *(
            g.sub(g.mul(a, g.sub(b, c)), g.sub(a, g.sub(b, t))),
            g.div(a, g.div(b, c)),
            g.neg(g.mul(a, g.add(b, c))),
        ),
        *(g.mul(g.sin(c), b), g.add(g.sqrt(g.mul(c, number(2))), a), g.mul(g.exp(number(Fraction(1, 2))), a)),
        *(g.zero, c, a, g.constant(Fraction(-5, 4)), g.exp(number(1))),
    )
    return equations(
        g,
        [Function("everything", "Every operation once.", outputs)],
        name="everything",
        time=t,
        states=[(a, Quantity("a", "state", "")), (b, Quantity("b", "state", ""))],
        nx=2,
        parameters=[(c, Quantity("c", "parameter", ""), g.constant(Fraction(5, 4)))],
    )
