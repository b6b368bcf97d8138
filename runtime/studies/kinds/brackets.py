"""Poisson brackets of quantities, and whether a transformation is canonical.

{f, g} = sum of df/dq dg/dp - df/dp dg/dq, so that {q, p} = 1 and df/dt = {f, H} + df/dt at rest (Goldstein's sign; that of
Landau and Lifshitz, {p, q} = 1, is the opposite). Derivatives by p are those by v through the mass matrix dp/dv; rotations
add -pi . (df/dpi x dg/dpi) with their angular momentum pi in the turned axes (Lie and Poisson).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from msgspec import Struct

from ...case import Case, inputs_at
from ...numerics.rank import FORMULAS, rank, solve
from ...outcome import Outcome, SimulationError
from ...problem import Array, Problem
from ...settings import Formula, settable
from ..findings import Curve, Findings, Panel, Table
from ..formulas.combination import number_text, sum_text
from ..formulas.sampling import Sampler
from ..study import OF_A_MOTION, Study
from .symmetries import case_of

STATES = 24
EXACT = 1e-9
"""Of the largest value: brackets that differ by less from a number or a quantity, are that."""


class Bracket(Struct, frozen=True, eq=False):
    """``values`` [n] at random states; ``text``: what it is at all of them, empty if that is not recognised."""

    first: str
    second: str
    values: Array
    text: str


class Brackets(Study, frozen=True, kw_only=True):
    """Poisson brackets of formulas (without any: of coordinates, momenta, named outputs and H) with each other and with H.

    ``canonical``: new momenta and coordinates by name; it is told whether their brackets are those of momenta and
    coordinates.
    """

    unused = OF_A_MOTION
    needs = frozenset({"phase"})
    of: Annotated[
        tuple[Formula, ...],
        settable("Formulas, such as 'x*p_y - y*p_x, p_x'; p_x is the momentum of x.", "formulas"),
    ] = ()
    canonical: Annotated[
        tuple[Formula, ...],
        settable("New momenta and coordinates, such as 'P=q, Q=-p'; several are P1, Q1, P2, Q2.", "formulas"),
    ] = ()

    def solve(self, problem: Problem) -> Findings:
        """Form the brackets. Raises SimulationError for models with constraints, and for pairs that are none."""
        case = case_of(problem, self)
        if problem.constraints:
            raise SimulationError(
                f"'{problem.name}' has constraints: its coordinates and momenta are not free",
                help="write it in independent coordinates; Dirac brackets are not supported",
            )
        if self.canonical:
            return _canonical(problem, case, self.canonical)
        names = [q.name for q in problem.phase if q.kind == "output"]
        asked = list(self.of)
        listed = {f.text: f.name for f in asked} or {name: name for name in names}
        space = PhaseSpace(case, list(dict.fromkeys(listed.values())), coordinates=not asked)
        shown_names = {place: text for text, place in listed.items()}
        found = space.brackets(shown_names)
        table = Table(
            "Poisson brackets, {q, p} = 1",
            (("f", ""), ("g", ""), ("{f, g}", "")),
            tuple(
                (b.first, b.second, b.text or "no number and none of these") for b in found if b.text != "0"
            ),
        )
        commuting = [b.first for b in found if b.second == "H" and b.text == "0"]
        zeros = sum(b.text == "0" for b in found)
        return Findings(
            study="brackets",
            model=problem.name,
            outcome=Outcome.COMPLETED,
            message=f"{len(found)} brackets, {zeros} of them zero",
            errors_from=f"what is recognised holds at {STATES} random states to {EXACT:g}",
            remarks=(
                f"constant, as the bracket with H vanishes: {', '.join(commuting) or 'nothing of these'}",
                "the sign is that of Goldstein; Landau's and Lifshitz's brackets are the negative of these",
            ),
            tables=(table,),
            panels=_panels(found),
            details={
                "brackets": [
                    {
                        "f": b.first,
                        "g": b.second,
                        "bracket": b.text or None,
                        "values": [float(v) for v in b.values[:3]],
                    }
                    for b in found
                ],
                "commute_with_H": commuting,
                "sign": "{q, p} = 1",
                "accuracy": {"states": STATES, "relative": EXACT},
            },
        )


class PhaseSpace:
    """Gradients of quantities in coordinates and momenta, at random states."""

    def __init__(self, case: Case, outputs: Sequence[str], *, coordinates: bool) -> None:
        problem, functions = case.problem, case.functions
        assert functions.phase_gradient is not None and functions.phase is not None, "the part phase"
        kinds = [q.kind for q in problem.phase]
        places = {q.name: k for k, q in enumerate(problem.phase) if q.kind == "output"}
        momenta = [k for k, kind in enumerate(kinds) if kind == "momentum"]
        states = [state.name for state in problem.states]
        nq, nv = problem.nq, problem.nv
        turning = {i + k for i in problem.rotations for k in range(4)}
        sample = Sampler(case, seed=31).states(STATES)
        self.names: list[str] = []
        rows: list[list[tuple[Array, Array]]] = []
        values: list[list[float]] = []
        self.spins: list[list[tuple[int, Array]]] = []
        for n, (t, y) in enumerate(zip(sample.t, sample.y, strict=True)):
            u = inputs_at(case, float(t))
            flat = functions.phase_gradient(float(t), y, u, case.z, case.p).reshape(-1, nq + nv)
            mass, slope = flat[momenta, nq:], flat[momenta, :nq]
            carry = moved_by(problem, y)

            def in_phase(
                row: Array, mass: Array = mass, slope: Array = slope, carry: Array = carry
            ) -> tuple[Array, Array]:
                by_p = np.linalg.solve(mass.T, row[nq:])
                return carry.T @ (row[:nq] - slope.T @ by_p), np.asarray(by_p)

            def of(
                name: str, flat: Array = flat, y: Array = y, phase: Array = sample.phase[n]
            ) -> tuple[Array, float]:
                if name in places:
                    return flat[places[name]], float(phase[places[name]])
                k = states.index(name)
                return np.eye(nq + nv)[k], float(y[k])

            quantities = [(name, *of(name)) for name in outputs]
            if coordinates:
                eye = np.eye(nq + nv)
                quantities += [(problem.states[k].name, eye[k], y[k]) for k in range(nq) if k not in turning]
                quantities += [
                    (_momentum_name(problem, i), flat[k], sample.phase[n, k]) for i, k in enumerate(momenta)
                ]
            energy = kinds.index("energy")
            quantities.append(("H", flat[energy], sample.phase[n, energy]))
            self.names = [name for name, *_ in quantities]
            rows.append([in_phase(row) for _, row, _ in quantities])
            values.append([float(value) for *_, value in quantities])
            own = sample.phase[n, momenta]
            firsts = _turning_velocities(problem)
            self.spins.append([(first, own[first : first + 3]) for first in firsts])
        self.values = np.array(values)
        self.rows = rows

    def bracket(self, a: int, b: int) -> Array:
        """Return {a, b} at all states."""
        found = []
        for rows, spins in zip(self.rows, self.spins, strict=True):
            (fq, fp), (gq, gp) = rows[a], rows[b]
            value = float(fq @ gp - fp @ gq)
            for first, spin in spins:
                block = slice(first, first + 3)
                value -= float(spin @ np.cross(fp[block], gp[block]))
            found.append(value)
        return np.array(found)

    def sizes(self, a: int, b: int) -> float:
        """Return how large the terms of a bracket are: what is far smaller is zero."""
        found = [
            float(np.abs(fq) @ np.abs(gp) + np.abs(fp) @ np.abs(gq))
            for (fq, fp), (gq, gp) in ((rows[a], rows[b]) for rows in self.rows)
        ]
        found += [
            float(np.abs(spin).max() * np.abs(rows[a][1]).max() * np.abs(rows[b][1]).max())
            for rows, spins in zip(self.rows, self.spins, strict=True)
            for _, spin in spins
        ]
        return max(found)

    def brackets(self, shown_names: dict[str, str]) -> list[Bracket]:
        """Return the brackets of all pairs."""
        names = [shown_names.get(name, name) for name in self.names]
        found = []
        for a in range(len(names)):
            for b in range(a + 1, len(names)):
                values = self.bracket(a, b)
                text = recognised(values, self.values, names, self.sizes(a, b))
                found.append(Bracket(names[a], names[b], values, text))
        return found


def recognised(values: Array, quantities: Array, names: Sequence[str], size: float) -> str:
    """Return what values are at all states: a number, or a sum of a few quantities; empty if neither."""
    if np.abs(values).max() <= EXACT * size:
        return "0"
    if np.ptp(values) <= EXACT * np.abs(values).max():
        return number_text(float(values[0]))
    for k, name in enumerate(names):
        column = quantities[:, k]
        if np.abs(column).min() > 0:
            ratio = values / column
            if np.ptp(ratio) <= EXACT * np.abs(ratio).max():
                return sum_text([number_text(float(ratio[0]))], [_whole(name)])
    moving = np.flatnonzero(quantities.any(axis=0))  # what is zero is part of no sum
    columns = np.hstack([np.ones((len(values), 1)), quantities[:, moving]])
    if columns.shape[1] > len(values) - 4:
        return ""
    scale = np.abs(columns).max(axis=0)
    solution = solve(columns / scale, values, FORMULAS)
    off = np.abs(columns / scale @ solution - values).max()
    if off > EXACT * np.abs(values).max() or rank(columns / scale, FORMULAS) < columns.shape[1]:
        return ""
    pairs = [
        (number_text(float(c / s)), name)
        for c, s, name in zip(solution, scale, ["1", *(names[int(k)] for k in moving)], strict=True)
        if abs(c) > 1e-8 * np.abs(solution).max()
    ]
    return sum_text([c for c, _ in pairs], [_whole(name) for _, name in pairs])


def _whole(name: str) -> str:
    """Return a formula so that it may be multiplied."""
    plain = name.replace("_", "").replace(".", "").isalnum() or name.startswith("der(")
    return name if plain else f"({name})"


def moved_by(problem: Problem, y: Array) -> Array:
    """Return N [nq, nv] with q' = N v: ones, and for rotations half the product with the quaternion."""
    nq, nv = problem.nq, problem.nv
    result = np.zeros((nq, nv))
    turning = {i: i for i in problem.rotations}
    k = i = 0
    while k < nq:
        if k in turning:
            w, a, b, c = y[k : k + 4]
            result[k : k + 4, i : i + 3] = 0.5 * np.array([[-a, -b, -c], [w, -c, b], [c, w, -a], [-b, a, w]])
            k, i = k + 4, i + 3
        else:
            result[k, i] = 1.0
            k, i = k + 1, i + 1
    return result


def _turning_velocities(problem: Problem) -> list[int]:
    """Return the first velocity of each rotation."""
    return [i - n for n, i in enumerate(sorted(problem.rotations))]


def _momentum_name(problem: Problem, i: int) -> str:
    rate = problem.states[problem.nq + i].name
    return "p_" + rate.removeprefix("der(").replace(")", "", 1)


def _panels(found: Sequence[Bracket]) -> tuple[Panel, ...]:
    """Draw the brackets with H at the random states: what is constant lies on zero."""
    curves = [
        Curve(b.first, np.arange(1.0, len(b.values) + 1), b.values, style="points")
        for b in found
        if b.second == "H"
    ]
    return (Panel("brackets with H", "random state", "", "{f, H}", "", tuple(curves[:8])),)


# ---------------------------------------------------------------- canonical transformations


def _canonical(problem: Problem, case: Case, given: Sequence[Formula]) -> Findings:
    label = {f.name: _label(f) for f in given}
    momenta = sorted((f for f in given if label[f.name].startswith("P")), key=lambda f: label[f.name])
    places = sorted((f for f in given if label[f.name].startswith("Q")), key=lambda f: label[f.name])
    if (
        not momenta
        or [label[f.name][1:] for f in momenta] != [label[f.name][1:] for f in places]
        or len(momenta) + len(places) != len(given)
    ):
        raise SimulationError(
            "a transformation has as many new coordinates Q as momenta P",
            help="write --canonical 'P=q, Q=-p', or 'P1=..., Q1=..., P2=..., Q2=...'",
        )
    if len(momenta) != problem.nv:
        raise SimulationError(
            f"'{problem.name}' has {problem.nv} coordinates, the transformation {len(momenta)} pairs",
            help="transform all of them; Pk = p_x and Qk = x for those that stay",
        )
    order = [*places, *momenta]
    space = PhaseSpace(case, [f.name for f in order], coordinates=False)
    n = len(order)
    values = np.array([[space.bracket(a, b) for b in range(n)] for a in range(n)])
    half = n // 2
    wanted = np.block([[np.zeros((half, half)), np.eye(half)], [-np.eye(half), np.zeros((half, half))]])
    off = float(np.abs(values - wanted[:, :, None]).max())
    canonical = off <= 1e-8
    scale = float(values[0, half, 0])
    multiplied = not canonical and float(np.abs(values - scale * wanted[:, :, None]).max()) <= 1e-8 * abs(
        scale
    )
    names = [label[f.name] for f in order]
    rows = tuple(
        (names[a], names[b], recognised(values[a, b], space.values, [*names, "H"], 1.0) or "not constant")
        for a in range(n)
        for b in range(a + 1, n)
    )
    what = "canonical" if canonical else "not canonical"
    remarks = [f"all brackets are {scale:g} times those of a canonical one"] if multiplied else []
    text = {label[f.name]: f.text.partition("=")[2].strip() for f in order}
    return Findings(
        study="brackets",
        model=problem.name,
        outcome=Outcome.COMPLETED,
        message=f"the transformation is {what}",
        errors_from=f"largest difference of M J M^T from J at {STATES} random states: {off:.1e}",
        remarks=tuple(remarks),
        tables=(Table("brackets of the new variables", (("f", ""), ("g", ""), ("{f, g}", "")), rows),),
        panels=(
            Panel(
                "brackets of the new variables",
                "random state",
                "",
                "{Q, P}",
                "",
                tuple(
                    Curve(
                        f"{{{names[k]}, {names[half + k]}}}",
                        np.arange(1.0, STATES + 1),
                        values[k, half + k],
                        style="points",
                    )
                    for k in range(half)
                ),
            ),
        ),
        details={
            "canonical": canonical,
            "multiplier": scale if multiplied or canonical else None,
            "brackets": [{"f": a, "g": b, "bracket": c} for a, b, c in rows],
            "transformation": text,
            "sign": "{q, p} = 1",
            "accuracy": {"off": off, "states": STATES},
        },
    )


def _label(formula: Formula) -> str:
    name, sign, _ = formula.text.partition("=")
    if not sign:
        raise SimulationError(
            f"'{formula.text}' has no name", help="write --canonical 'P=q, Q=-p', each with its name"
        )
    return name.strip()
