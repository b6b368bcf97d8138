"""Faults that move energy: in forces, in what books them, in generated code, at events, in a step."""

from __future__ import annotations

from . import models
from .fault import Fault, edit

ENERGIES = "compiler/equations/solve/energies.py"
SOLVED = "compiler/equations/solve/solved.py"
RESIDUAL = "compiler/equations/rows/residual.py"
MODES = "compiler/equations/rows/modes.py"
OPERATIONS = "compiler/graph/operations.py"
ASSEMBLE = "compiler/equations/assemble.py"
EVENTS = "runtime/kernel/events"
ACCELERATIONS = "    s->model->rhs(t, y, s->u, s->o.z, s->o.p, out);\n"
"""Where steps ask for the rates of the state."""


def _pushed(by: str) -> tuple[str, str]:
    """Return text that adds to every acceleration, and what it replaces."""
    loop = f"    for (int i = s->model->nq; i < s->model->nq + s->model->nv; i++) out[i] += {by};\n"
    return ACCELERATIONS, ACCELERATIONS + loop


FORCES = (
    Fault(
        "forces: the sign of every 'force' is the other one in the equations, and right in the books",
        edit(RESIDUAL, "[(rate, system.graph.neg(effort))", "[(rate, effort)"),
        models.PUSHED,
    ),
    Fault(
        "forces: potentials push with 1.000001 times their gradient",
        edit(
            RESIDUAL,
            "gradient(graph, system.potential, [s.node for s in system.q])",
            "gradient(graph, graph.mul(graph.constant(1 + 1e-6), system.potential), [s.node for s in system.q])",
        ),
        models.PENDULUM,
    ),
    Fault(
        "forces: a kinetic energy whose inertia changes with place lacks the force dT/dq",
        edit(
            RESIDUAL,
            "combined(graph, graph.sub(system.rate(p), g))",
            "combined(graph, system.rate(p))",
        ),
        models.DOUBLE,
    ),
    Fault(
        "forces: the gyroscopic moment of bodies in space is left out",
        edit(
            RESIDUAL,
            "            moment = add(graph, moment, cross(graph, spin, matvec(graph, body.inertia, spin)))\n",
            "            pass\n",
        ),
        models.TOP,
    ),
    Fault(
        "forces: a 'dissipation' brakes with half of its derivative",
        edit(
            RESIDUAL,
            "parts.append(vjp(graph, [(system.dissipation, graph.one)], velocities))",
            "parts.append(vjp(graph, [(system.dissipation, graph.half)], velocities))",
        ),
        models.RAYLEIGH,
    ),
    Fault(
        "derivatives: of cos x it is -sin x, of a cosine of a difference +sin x",
        edit(
            OPERATIONS,
            "(lambda g, x, n: g.neg(g.sin(x[0])),)",
            "(lambda g, x, n: g.sin(x[0]) if g.op(x[0]) == SUB else g.neg(g.sin(x[0])),)",
        ),
        models.DOUBLE,
    ),
    Fault(
        "derivatives: that of max(a, b) by b is that of min",
        edit(
            OPERATIONS,
            "(lambda g, x, n: _less(g, x[1], x[0]), lambda g, x, n: g.select(g.less(x[1], x[0]), g.zero, g.one)),\n"
            "        value=scalar_functions.maximum",
            "(lambda g, x, n: _less(g, x[1], x[0]), lambda g, x, n: g.select(g.less(x[0], x[1]), g.zero, g.one)),\n"
            "        value=scalar_functions.maximum",
        ),
        models.WALL,
    ),
    Fault(
        "energies: of heights of weights a thousandth is lost",
        edit(
            "compiler/mechanics/energies.py",
            "graph.mul(mass.mass, kinematics.potential(mass.point, mass.field))",
            "graph.mul(graph.constant(0.999), graph.mul(mass.mass, kinematics.potential(mass.point, mass.field)))",
        ),
        models.SWING,
    ),
    Fault(
        "energies: that of a lagrangian whose kinetic energy contains a given rate is T + V",
        edit(
            ENERGIES,
            "return None if graph.equal_up_to_sign(total, plain) else total",
            "return None if plain is not None else total",
        ),
        models.HOOP,
    ),
    Fault(
        "energies: that of a model whose coordinates are driven is -L",
        edit(
            ENERGIES,
            "    total = plain_total if total is None else substitute(graph, [total], driven)[0]\n",
            "    total = graph.neg(lagrangian) if system.drives else plain_total\n",
        ),
        models.DRIVEN,
    ),
    Fault(
        "generated C: the second derivative of a 'table' has 3 in the place of 6",
        edit("compiler/targets/c_tables.py", "return 2 * c2 + 6 * c3 * s;", "return 2 * c2 + 3 * c3 * s;"),
        models.WIRE,
    ),
)
"""What forces do is not what energies say."""

BOOKS = (
    Fault(
        "books: what a damper takes counts half",
        edit(ENERGIES, "        (work,) = substitute(graph, jvp(graph, resistance, along), driven)\n"
             "        dissipated = graph.add(dissipated, work)",
             "        (work,) = substitute(graph, jvp(graph, resistance, along), driven)\n"
             "        dissipated = graph.add(dissipated, graph.mul(graph.half, work))"),
        models.DAMPED,
    ),
    Fault(
        "books: what forces take that brake whatever the motion has the wrong sign",
        edit(ENERGIES, "dissipated = graph.sub(graph.add(dissipated, carried), power)",
             "dissipated = graph.add(graph.add(dissipated, carried), power)"),
        models.BRAKED,
    ),
    Fault(
        "books: the work of forces that depend on time is left out",
        edit(ENERGIES, "            supplied = graph.add(supplied, power)\n", "            pass\n"),
        models.PUSHED,
    ),
    Fault(
        "books: what a potential changes by with time is left out",
        edit(ENERGIES, "graph.add(graph.sub(outer_power, drift), graph.dot", "graph.add(outer_power, graph.dot"),
        models.WEAKER,
    ),
    Fault(
        "books: the flow of mass brings no energy",
        edit(ENERGIES, "graph.dot(moved, [brought for _, brought in joining])", "graph.zero"),
        models.TRAY,
    ),
    Fault(
        "books: the work of a drive is left out",
        edit(SOLVED, "            power = graph.add(power, graph.mul(raw[i], driven[system.v[i].node]))\n",
             "            pass\n"),
        models.CRANE,
    ),
    Fault(
        "books: the power of constraints that move has the wrong sign",
        edit(SOLVED, "power = graph.sub(power, graph.mul(row.multiplier, graph.sub(rate, part)))",
             "power = graph.add(power, graph.mul(row.multiplier, graph.sub(rate, part)))"),
        models.MOVED,
    ),
    Fault(
        "books: the heat of friction is left out",
        edit(MODES, "total = graph.sub(total, graph.mul(row.multiplier, row.rate))", "pass"),
        models.BLOCK,
    ),
    Fault(
        "books: the integral of every power is larger by a millionth",
        edit(ASSEMBLE, "        *(accounts[name] for name in layout.accounts),\n",
             "        *(system.graph.mul(system.graph.constant(1 + 1e-6), accounts[name]) for name in layout.accounts),\n"),
        models.DAMPED,
    ),
)  # fmt: skip
"""What is dissipated or supplied is booked otherwise."""

AT_EVENTS = (
    Fault(
        "events: the loss of an impact is not booked",
        edit(f"{EVENTS}/rows.c", "if (h->dissipated >= 0) s->y[h->dissipated] += lost;", ""),
        models.BOUNCE,
    ),
    Fault(
        "events: after an impact velocities change by a thousandth more",
        edit(
            f"{EVENTS}/rows.c",
            "s->y[m->nq + i] += e->change[i];",
            "s->y[m->nq + i] += MECH_C(1.001) * e->change[i];",
        ),
        models.BOUNCE,
    ),
    Fault(
        "events: an impulse at a jump of a potential keeps half of the energy that jumps",
        edit(
            f"{EVENTS}/impacts.c",
            "const mech_real square = r * r - 2 * w * jump;",
            "const mech_real square = r * r - w * jump;",
        ),
        models.STEP,
    ),
    Fault(
        "events: what 'reinit' and 'impulse' bring is not booked",
        edit(f"{EVENTS}/branches.c", "    mech_energy_book(s, mech_energy_total(s) - before);\n", ""),
        models.KICKED,
    ),
    Fault(
        "events: what a law brings that changes at an instant is not booked",
        edit(
            f"{EVENTS}/energy.c",
            "if (account >= 0) s->y[account] += change(s, before);",
            "if (account >= 0) change(s, before);",
        ),
        models.SUDDEN,
    ),
    Fault(
        "events: what a bend of a constraint takes is not booked",
        edit(
            f"{EVENTS}/instant.c",
            "    if (mech_energy_booked(s)) mech_energy_book_beyond_rounding(s, free);\n",
            "    if (free < -1) mech_energy_book_beyond_rounding(s, free);\n",
        ),
        models.BEND,
    ),
)
"""What happens at an instant."""

STEPS = (
    *(
        Fault(
            f"steps: every acceleration is larger by {by:g}",
            edit("runtime/kernel/run/run.h", *_pushed(f"MECH_C({by:g})")),
            models.PENDULUM,
        )
        for by in (1e-3, 1e-5, 1e-7, 1e-9)
    ),
    Fault(
        "steps: the first acceleration has the wrong sign",
        edit(
            "runtime/kernel/run/run.h",
            ACCELERATIONS,
            f"{ACCELERATIONS}    out[s->model->nq % s->ny] = -out[s->model->nq % s->ny];\n",
        ),
        models.PENDULUM,
    ),
    Fault(
        "steps: states are not projected onto their constraints",
        edit(
            "runtime/kernel/stepping/projection.c",
            "int mech_project(mech_solver *s, mech_real t, mech_real *y)\n{\n",
            "int mech_project(mech_solver *s, mech_real t, mech_real *y)\n{\n    if (s) return MECH_RUNNING;\n",
        ),
        models.MOVED,
    ),
    Fault(
        "steps: rotations are not normalised",
        edit(
            "runtime/kernel/run/rotations.c",
            "k < model->n_rotations; k++) {",
            "k < 0 * model->n_rotations; k++) {",
        ),
        models.TOP,
    ),
)
"""How a motion is followed."""

FAULTS = (*FORCES, *BOOKS, *AT_EVENTS, *STEPS)
