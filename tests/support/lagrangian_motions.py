"""Motions of x and y by SymPy and SciPy alone, along which stated constants are looked at; shares nothing with the search."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy
from scipy.integrate import solve_ivp

T, X, Y, VX, VY = sympy.symbols("time x y vx vy", real=True)
DT, DX, DY, F = sympy.symbols("d_dt d_dx d_dy F")
STATE = (T, X, Y, VX, VY)
DIGITS = 1e-7
"""Largest relative change of a number of eight digits by rounding, with as much for fractions that were multiplied out."""
TOLD = 1e-3
"""Share of how much a quantity differs between motions, which the digits of its formula must leave."""
STARTS = 5
FARTHEST = 1.5
"""Of the origin, where motions in potentials without a bottom end."""


def read(text: str) -> sympy.Expr:
    """Return a formula of the language as one of SymPy."""
    text = re.sub(r"d/d([txy])", r"d_d\1", text)
    text = re.sub(r"der\(([xy])\)", r"v\1", text).replace("^", "**")
    names = {str(s): s for s in (*STATE, DT, DX, DY, F)} | {"sin": sympy.sin, "cos": sympy.cos}
    return sympy.parse_expr(text, local_dict=names)


class Motions:
    """Random motions of a Lagrangian with linear damping: accelerations by SymPy, steps by DOP853 at two tolerances."""

    def __init__(
        self, kinetic: str, potential: str, damping: tuple[float, float] = (0.0, 0.0), seed: int = 0
    ) -> None:
        self.lagrangian = lagrangian = read(kinetic) - read(potential)
        q, v = sympy.Matrix([X, Y]), sympy.Matrix([VX, VY])
        momenta = sympy.Matrix([lagrangian.diff(s) for s in v])
        forces = sympy.Matrix([lagrangian.diff(s) for s in q]) - momenta.jacobian(q) * v - momenta.diff(T)
        forces -= sympy.Matrix([c * s for c, s in zip(damping, v, strict=True)])
        self.accelerations = momenta.jacobian(v).inv() * forces
        rates = sympy.lambdify(STATE, list(self.accelerations), modules="math", cse=True)
        self.random = np.random.default_rng(seed)
        self.points: list[Any] = []
        for _ in range(STARTS):
            start = self.random.uniform(-1, 1, 4) * (0.8, 0.8, 1.2, 1.2)
            fine, coarse = (self._motion(rates, start, tolerance) for tolerance in (1e-12, 1e-10))
            n = min(fine.shape[1], coarse.shape[1])
            self.points.append((fine[:, :n], coarse[:, :n]))

    def _motion(self, rates: Any, start: Any, tolerance: float) -> Any:
        def rhs(t: float, y: Any) -> list[float]:
            return [y[2], y[3], *rates(t, *y)]

        def away(t: float, y: Any) -> float:
            return float(np.hypot(y[0], y[1])) - FARTHEST

        away.terminal = True  # type: ignore[attr-defined]
        found = solve_ivp(
            rhs, (0, 3), start, "DOP853", np.linspace(0, 3, 31), events=away, rtol=tolerance, atol=tolerance
        )
        return np.vstack([found.t, found.y])

    def false(self, formula: str) -> str:
        """Say how a stated constant changes along the motions, or differs by no more than its digits; nothing where it is true.

        The digits of its numbers allow each term to change by as much as they may be off.
        """
        terms = [
            sympy.lambdify(STATE, term, "numpy") for term in sympy.expand(read(formula)).as_ordered_terms()
        ]
        values, unsure = [], 0.0
        for fine, coarse in self.points:
            parts = [np.broadcast_to(term(*fine), fine[0].shape) for term in terms]
            total = np.sum(parts, axis=0)
            steps = np.abs(
                total - np.sum([np.broadcast_to(term(*coarse), fine[0].shape) for term in terms], axis=0)
            )
            digits = DIGITS * np.sum([np.abs(part - part[0]) for part in parts], axis=0)
            allowed = digits + steps + 1e-13 * np.sum(np.abs(parts), axis=0)
            off = np.abs(total - total[0])
            if (off > allowed).any():
                return f"changes by {off.max():.1e} where {allowed.max():.1e} is rounding: {formula}"
            values.append(total[0])
            unsure = max(unsure, float(allowed.max()))
        spread = float(np.std(values))
        return f"has no digit: {unsure:.1e} of {spread:.1e}: {formula}" if unsure > TOLD * spread else ""

    def independent(self, formulas: Sequence[str]) -> int:
        """Return how many stated constants are functionally independent: the rank of their gradients at random states."""
        if not formulas:
            return 0
        gradients = [[read(text).diff(s) for s in STATE] for text in formulas]
        at = sympy.lambdify(STATE, gradients, "numpy")
        ranks = []
        for _ in range(5):
            rows = np.array(at(*self.random.uniform(-1, 1, 5)), dtype=float)
            rows /= np.linalg.norm(rows, axis=1)[:, None]
            ranks.append(int(np.linalg.matrix_rank(rows, tol=1e-5)))
        return max(ranks)

    def unsymmetric(self, generator: str, conserved: str) -> str:
        """Say how far a generator is from leaving the action as it is, and from its constant; nothing where it holds.

        Noether: xi L_q + (D xi - v D tau) L_v + tau L_t + L D tau = D F, and I = xi p - tau h - F.
        """
        field, _, gauge = generator.partition(", F = ")
        whole, gain = sympy.expand(read(field)), read(gauge) if gauge else sympy.Integer(0)
        tau, xi = whole.coeff(DT), (whole.coeff(DX), whole.coeff(DY))
        lagrangian, v, q = self.lagrangian, (VX, VY), (X, Y)

        def rate(of: sympy.Expr) -> sympy.Expr:
            return of.diff(T) + of.diff(X) * VX + of.diff(Y) * VY

        momenta = [lagrangian.diff(s) for s in v]
        energy = sum(p * s for p, s in zip(momenta, v, strict=True)) - lagrangian
        pieces = [x * lagrangian.diff(s) for x, s in zip(xi, q, strict=True)]
        pieces += [(rate(x) - s * rate(tau)) * p for x, s, p in zip(xi, v, momenta, strict=True)]
        pieces += [tau * lagrangian.diff(T), lagrangian * rate(tau), -rate(gain)]
        constant = sum(x * p for x, p in zip(xi, momenta, strict=True)) - tau * energy - gain
        told = read(conserved)
        for left, what in (
            (pieces, "is not a symmetry"),
            ([constant, -told], "is not its constant"),
            ([constant, told], ""),
        ):
            at = [self.random.uniform(-1, 1, 5) for _ in range(6)]
            found = np.array(
                [[float(sympy.lambdify(STATE, piece, "numpy")(*place)) for piece in left] for place in at]
            )
            off, allowed = np.abs(found.sum(axis=1)), 4 * DIGITS * np.abs(found).sum(axis=1) + 1e-12
            if what == "is not a symmetry" and (off > allowed).any():
                return f"{what}, {off.max():.1e} of {np.abs(found).sum(axis=1).max():.1e}: {generator}"
            if what != "is not a symmetry" and (off <= allowed).all():
                return ""
        return f"is not the generator of {conserved}: {generator}"
