"""The first curve that a guess leads to: on which elements, in which ways, and what is told of those that fail."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
from msgspec import Struct

from ..problem import Array
from . import obstacles
from .discrete import DiscreteCurve
from .globalized_newton import newton_by_steps, newton_from_afar
from .mesh import mesh_of
from .newton import Solved, newton, norm_of, projected, with_multipliers
from .posed import Posed
from .starts import (
    Source,
    beginning,
    evaluate,
    far_off,
    gauge,
    steep_ends,
    transferred,
    undefined,
    with_numbers,
    without_repeats,
)
from .unknowns import Unknowns

NEARER = 0.9
"""Share of the distance from the guess below which another curve is the nearer one."""


STRAIGHT, ALIKE, PLACES = 0.1, 0.5, 201
"""Of the size of a curve: what is nearer to a straight line has no shape; and the cosine below which shapes are not alike."""
ELSEWHERE = (
    "the curve has little of the shape of the guess: another one may be nearer to it, which '--all' looks for"
)


class Tried(Struct, frozen=True):
    """One way in which a curve was looked for, on so many elements, and how it ended."""

    elements: int
    way: str
    outcome: str


class Begun(Struct, eq=False):
    """A curve on the mesh on which it was found; ``guessed``: the size of the value's terms with the guess."""

    discrete: DiscreteCurve
    unknowns: Unknowns
    guessed: float


def first_from(
    posed: Posed, source: Source, meshes: Sequence[tuple[int, int]], deflated: Sequence[tuple[DiscreteCurve, Unknowns]],
    tried: list[Tried], remarks: list[str], *, once: bool, weights: Array | None = None,
) -> tuple[Begun | None, int]:  # fmt: skip
    """Return the first curve that a start leads to, on whatever mesh and in whatever way, and the steps of all ways."""
    steps = 0
    weights = gauge(posed, source) if weights is None else weights
    for count, coarse in meshes:
        discrete, first, off = _start(posed, source, count, max(coarse, 2 * posed.curve.order + 2), weights)
        without_repeats(discrete, first)
        if why := undefined(discrete, first):
            tried.append(Tried(count, "", why))
            continue
        guessed = value_of(discrete, first)[1]
        far = far_off(discrete, first)
        known = [transferred(before, unknowns, discrete) for before, unknowns in deflated]
        if obstacles.has_bounds(discrete):
            first = obstacles.begin(discrete, first)
        for words, way in _ways(discrete, first, known, once=once):
            solved = bounded(discrete, way())
            steps += solved.steps
            if solved.converged:
                if not (known or once):
                    solved = _nearer(discrete, first, solved)
                if off and not deflated:
                    remarks.append(f"the guess does not meet {' and '.join(off)}: it was bent to do so")
                if far and not deflated:
                    remarks.append(f"the guess is far from {' and '.join(far)}, which the curve meets")
                if not deflated and not once and _elsewhere(discrete, first, solved.at):
                    remarks.append(ELSEWHERE)
                return Begun(discrete, solved.at, guessed), steps
            tried.append(Tried(count, words, solved.why))
    return None, steps


ENDINGS = {
    "singular": "nothing determines the step",
    "no shorter step": "no step leads nearer",
    "too many steps": "the steps do not come to an end",
    "not finite": "the integrand is not defined there",
}


def said_of(tried: Sequence[Tried]) -> list[str]:
    """Say what was tried, in two lines: on which elements in which ways, and how often it ended how."""
    found = [t for t in tried if t.way and t.outcome != "nothing to bring in"]
    said = [t.outcome for t in tried if not t.way][:1] if len(tried) > len(found) else []
    if found:
        elements = dict.fromkeys(t.elements for t in found)
        said.append(
            f"tried on {', '.join(map(str, elements))} elements: {'; '.join(dict.fromkeys(t.way for t in found))}"
        )
        endings = Counter(ENDINGS.get(t.outcome, f"it ended with {t.outcome}") for t in found)
        said.append(
            "how that ended: "
            + "; ".join(f"{words}, {n} times" if n > 1 else words for words, n in endings.most_common())
        )
    return said


def _start(
    posed: Posed, source: Source, count: int, degree: int, weights: Array
) -> tuple[DiscreteCurve, Unknowns, list[str]]:
    """Return elements with the guess on them, bent to its ends, and the ends that it does not meet."""
    steep = steep_ends(posed, source)
    mesh = mesh_of(posed.borders(), count, degree, steep)
    discrete = DiscreteCurve(posed.problem, mesh, posed.p, weights)
    first, off = beginning(discrete, posed, source)
    if off:  # only the curve that meets its ends tells where it is steep
        met = steep_ends(posed, lambda s: evaluate(discrete, first, s, 0)[: posed.curve.coordinates])
        if met != steep:
            mesh = mesh_of(posed.borders(), count, degree, met)
            other = DiscreteCurve(posed.problem, mesh, posed.p, weights)
            return other, beginning(other, posed, source)[0], off
    return discrete, first, off


def _nearer(discrete: DiscreteCurve, first: Unknowns, solved: Solved) -> Solved:
    """Return the curve that estimated multipliers lead to, from the guess or from one bent to all conditions, where it is nearer.

    With multipliers of zero the first step forgets the guess where a condition on the whole is all that keeps the curve from
    being lowest: it is one of inverse iteration, and leads to the first mode from any other. The estimate is Rayleigh's quotient.
    """
    if all(row.kind != "whole" for row in discrete.curve.wholes):
        return solved
    far = _apart(discrete, first, solved.at)
    for start in (first, _bent_to_all(discrete, first)):
        other = bounded(discrete, newton(discrete, with_multipliers(discrete, start)))
        near = _apart(discrete, first, other.at) if other.converged else np.inf
        if near < NEARER * far:
            solved, far = other, near
    return solved


def _bent_to_all(discrete: DiscreteCurve, first: Unknowns) -> Unknowns:
    return with_numbers(discrete, projected(discrete, first, every=True))


def _elsewhere(discrete: DiscreteCurve, first: Unknowns, found: Unknowns) -> bool:
    """Tell whether a curve has little of the shape of its guess: both are compared with straight lines between their ends."""
    s = np.linspace(0, 1, PLACES)
    shapes = []
    for unknowns in (first, found):
        at = evaluate(discrete, unknowns, s, 0)[: discrete.layout.n] / discrete.sizes(unknowns)[:, None]
        shapes.append(at - at[:, :1] - (at[:, -1:] - at[:, :1]) * s)
    guess, curve = (float(np.linalg.norm(shape)) for shape in shapes)
    alike = float(np.sum(shapes[0] * shapes[1]))
    return min(guess, curve) > STRAIGHT * np.sqrt(shapes[0].size) and alike < ALIKE * guess * curve


def _apart(discrete: DiscreteCurve, a: Unknowns, b: Unknowns) -> float:
    return norm_of(discrete, a)(a.moved(b, -1.0))


def _ways(
    discrete: DiscreteCurve, first: Unknowns, known: list[Unknowns], *, once: bool
) -> Iterator[tuple[str, Callable[[], Solved]]]:
    """Yield the ways in which a curve is looked for from a start, the fastest first, with words for each."""
    yield "Newton's method", partial(newton, discrete, first, deflated=known)
    if known or once:
        return
    better = with_multipliers(discrete, first)
    yield "with estimated multipliers", partial(newton, discrete, better)
    yield "with a stiffness that fades", partial(newton_from_afar, discrete, better)
    yield "with a stiffness that fades, multipliers zero", partial(newton_from_afar, discrete, first)
    nearer = with_multipliers(discrete, _bent_to_all(discrete, first))
    yield "with conditions brought in step by step", partial(newton_by_steps, discrete, better)
    yield "from a guess bent to all conditions", partial(newton, discrete, nearer)
    yield "with bounded steps", partial(newton, discrete, better, tested=False)


def bounded(discrete: DiscreteCurve, solved: Solved) -> Solved:
    if not obstacles.has_bounds(discrete):
        return solved
    return obstacles.solved_with_bounds(discrete, solved, lambda u: newton(discrete, u))


def value_of(discrete: DiscreteCurve, unknowns: Unknowns) -> tuple[float, float]:
    """Return what is stationary, and the size of the terms that it is made of."""
    y = np.zeros((discrete._height(), 1))
    value = float(discrete.call("wholes", np.zeros(1), y, discrete._z(unknowns))[0, 0])
    values = discrete.call(
        "integrands", discrete.inner.s, discrete.rows(unknowns, discrete.inner), discrete._z(unknowns)
    )
    layout = discrete.layout
    lam = unknowns.whole[layout.unknown + layout.numbers :]
    size = sum(abs(lam[k]) * float(np.sum(discrete.inner.weights * np.abs(f))) for k, f in enumerate(values))
    return value, max(size, abs(value))
