"""Outputs that equations determine (language, section 12): the solution beside the guess, with its derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechc.compiler.flat import model as flat
from oracle.expressions import Evaluator, Value
from oracle.series import real
from oracle.values import Several, Undetermined

Array = Any
SMALL, STEP = 1e-12, 1e-6
ASIDE = (-0.1, 0.1)
"""From where the same solution has to be found, as shares of the guess."""


def found(at: Evaluator, model: flat.FlatModel) -> dict[str, Value]:
    """The unknowns by name, with answers to questions that know nothing of them asked once."""
    ask, known = at.question, dict[tuple[str, str], Value]()

    def once(q: flat.Query) -> Value:
        if q.arguments:
            return ask(q)
        if (q.function, q.target) not in known:
            known[q.function, q.target] = ask(q)
        return known[q.function, q.target]

    at.question = once
    try:
        return _solved(at, model)
    finally:
        at.question = ask


def _solved(at: Evaluator, model: flat.FlatModel) -> dict[str, Value]:
    """Numbers first, then the orders in time and the displacements one by one."""
    shapes = {u.name: at.definitions[u.name].type.shape for u in model.unknowns}
    guesses = [np.broadcast_to(np.asarray(at(u.guess), object), shapes[u.name]) for u in model.unknowns]
    guess = np.array([real(x) for g in guesses for x in np.ravel(g)])

    def named(z: Any) -> dict[str, Value]:
        out, k = {}, 0
        for name, shape in shapes.items():
            n = int(np.prod(shape))
            whole = np.empty(n, object)
            whole[:] = list(z[k : k + n])
            out[name] = whole.reshape(shape) if shape else whole[0]
            k += n
        return out

    def rows(z: Any) -> list[Any]:
        outer = at.local
        at.local = {**outer, **named(z)}
        try:
            sides = [np.asarray(at(e.left) - at(e.right), object) for e in model.implicit]
            return [x for side in sides for x in np.ravel(side)]
        finally:
            at.local = outer

    def numbers(z: Array) -> Array:
        try:
            with at.only_numbers():
                return np.array([real(x) for x in rows(list(z))])
        except ArithmeticError:  # where a series says that something is not a number
            return np.array([real(x) for x in rows(list(z))])

    def slopes(z: Array) -> Array:
        columns = []
        for k in range(z.size):
            h = np.zeros(z.size)
            h[k] = STEP * (1 + abs(z[k]))
            columns.append((numbers(z + h) - numbers(z - h)) / (2 * h[k]))
        return np.array(columns).T

    z = root(numbers, slopes, guess)
    for share in ASIDE:
        other = root(numbers, slopes, guess + share * (abs(guess) + np.abs(z - guess)))
        if np.abs(other - z).max() > 1e-6 * (1 + np.abs(z).max()):
            raise Several("several solutions of equations near their guess")
    inverse = np.linalg.pinv(slopes(z))
    whole = list(z)
    for _ in range(8):  # each time all orders up to one more are those of the implicit function
        off = rows(whole)
        whole = [
            x - sum(w * r for w, r in zip(row, off, strict=True))
            for x, row in zip(whole, inverse, strict=True)
        ]
    return named(whole)


def root(f: Any, slopes: Any, z: Array) -> Array:
    """Newton's method with steps that are halved until they lead nearer."""
    for _ in range(60):
        r = f(z)
        J = slopes(z)
        step = -np.linalg.lstsq(J, r, rcond=1e-10)[0]
        if not np.isfinite(step).all():
            break
        if np.abs(step).max() <= SMALL * (1 + np.abs(z).max()):
            if np.abs(r).max() > 1e-7 * (np.abs(J) @ (1 + np.abs(z))).max():
                break
            if np.linalg.matrix_rank(J, 1e-8 * np.abs(J).max()) < z.size:
                break
            return z + step
        for halving in range(30):
            tried = z + step / 2**halving
            if np.linalg.norm(f(tried)) < np.linalg.norm(r):
                break
        else:
            tried = z + step
        z = tried
    raise Undetermined("no solution of equations is found")
