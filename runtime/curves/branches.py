"""Branches of curves over a parameter: steps of given length along them, so that they turn where the parameter turns back
(Keller 1977); folds and forks located on them."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from ..numerics.continuation import GROWTH, LONGEST, Reached, follow, located
from ..numerics.newton import newton
from ..problem import Array
from .discrete import DiscreteCurve
from .mesh import Mesh
from .newton import Factors, is_finite, norm_of
from .posed import Posed
from .search import DEGREE, FINER, FoundCurve, answer_of, marked_elements
from .starts import evaluate, spans, transferred
from .unknowns import Unknowns

MOST_POINTS = 400
MOST_CORRECTIONS = 8
QUICK = 3
CLOSE = 1e-11
NUDGE = 1e-5
"""Of the range by which the parameter is moved for a derivative."""
LOCATED = 1e-12
"""Of a step along the branch, as a length of it."""
SPLIT, ROUNDING = 1e-9, 1e-14
LOOSE = 1e-8
"""Of the size of the curve: where the polynomials of a branch's elements end beyond that, elements are halved."""
MOST_ELEMENTS = 200


class _Place(Struct, frozen=True, eq=False):
    unknowns: Unknowns
    share: float

    def moved(self, step: _Place, part: float) -> _Place:
        return _Place(self.unknowns.moved(step.unknowns, part), self.share + part * step.share)


class CurvePoint(Struct, eq=False):
    """One curve of a branch: ``share`` of the range of the parameter, and dshare/dlength of the branch there."""

    share: float
    discrete: DiscreteCurve
    unknowns: Unknowns
    tangent: Unknowns
    rate: float


class CurveBifurcation(Struct, eq=False):
    """A ``fold``, where the branch turns back, or a ``fork``, where a direction changes; ``error`` of its parameter."""

    kind: str
    share: float
    error: float
    answer: FoundCurve


class CurveBranch(Struct, eq=False):
    """Points in the order of the branch with what is told of each, and how its two ends came about."""

    points: list[CurvePoint]
    answers: list[FoundCurve]
    specials: list[CurveBifurcation]
    ends: tuple[str, str]


class CurveTracer:
    """Follows branches. ``posed(share)`` makes the problem at a share of the range of the parameter."""

    def __init__(self, posed: Callable[[float], Posed]) -> None:
        self.posed = posed
        self.least = np.zeros(0)

    def discrete(self, like: DiscreteCurve, share: float, old: float) -> DiscreteCurve:
        """Return the problem at another value of the parameter, on elements whose borders move along."""
        posed = self.posed(share)
        mesh = like.mesh
        before, now = (
            np.unique([0.0, *self.posed(old).borders(), 1.0]),
            np.unique([0.0, *posed.borders(), 1.0]),
        )
        if len(before) == len(now) and np.any(before != now):
            mesh = Mesh(np.interp(mesh.nodes, before, now), mesh.steep, mesh.degree)
        made = DiscreteCurve(posed.problem, mesh, posed.p, like.gauge)
        made.active_nodes, made.active_rates = like.active_nodes, like.active_rates
        return made

    def trace(self, answer: FoundCurve, share: float) -> CurveBranch:
        """Follow a branch from one of its curves to both sides."""
        posed, n = self.posed(share), answer.discrete.layout.n
        s = np.linspace(0, 1, 101)
        at = evaluate(answer.discrete, answer.solved, s, 0)[:n]
        self.least = np.maximum(spans(posed, posed.guess(s)), spans(posed, at))
        start = self._oriented(answer.discrete, answer.solved, share, None)
        back, why_back = self._follow(
            CurvePoint(share, start.discrete, start.unknowns, _turned(start.tangent), -start.rate)
        )
        ahead, why_ahead = self._follow(start)
        points = [*reversed(back[1:]), *ahead]
        answers = [self._answer(p) for p in points]
        for p in back[1:]:  # all point the same way along the branch
            p.tangent, p.rate = _turned(p.tangent), -p.rate
        specials = self._specials(points, answers)
        return CurveBranch(points, answers, specials, (why_back, why_ahead))

    # ------------------------------------------------------------ one step

    def _sizes(self, discrete: DiscreteCurve, at: Unknowns) -> Unknowns:
        norm = norm_of(discrete, at, self.least)
        return Unknowns(norm.border, norm.inside, norm.whole)

    def _oriented(
        self, discrete: DiscreteCurve, at: Unknowns, share: float, along: CurvePoint | None
    ) -> CurvePoint:
        """Return a point with its tangent: unit length, and the way that ``along`` goes."""
        by_share = self._by_share(discrete, at, share)
        blocks = discrete.blocks(at)
        blocks.local_residual, blocks.whole_residual = by_share
        t = Factors(discrete, blocks).step(blocks)
        size = self._sizes(discrete, at)
        length = float(np.sqrt(_product(t, t, size) + 1))
        t, rate = Unknowns(t.border / length, t.inside / length, t.whole / length), 1 / length
        if along is not None:
            before = along.tangent
            if before.border.shape != t.border.shape or discrete.mesh.degree != along.discrete.mesh.degree:
                before = transferred(along.discrete, before, discrete)
            if _product(t, before, size) + rate * along.rate < 0:
                t, rate = _turned(t), -rate
        return CurvePoint(share, discrete, at, t, rate)

    def _by_share(self, discrete: DiscreteCurve, at: Unknowns, share: float) -> tuple[Array, Array]:
        ahead = self.discrete(discrete, share + NUDGE, share).blocks(at, matrix=False)
        behind = self.discrete(discrete, share - NUDGE, share).blocks(at, matrix=False)
        return (
            (ahead.local_residual - behind.local_residual) / (2 * NUDGE),
            (ahead.whole_residual - behind.whole_residual) / (2 * NUDGE),
        )

    def _stepped(self, p: CurvePoint, length: float) -> tuple[CurvePoint, int] | None:
        """Return the point of the branch at a distance, and the corrections that it took; None where there is none."""
        size = self._sizes(p.discrete, p.unknowns)

        def step(at: _Place) -> tuple[_Place, float] | None:
            discrete = self.discrete(p.discrete, at.share, p.share)
            blocks = discrete.blocks(at.unknowns)
            if not is_finite(blocks):
                return None
            try:
                factors = Factors(discrete, blocks)
            except (np.linalg.LinAlgError, RuntimeError):
                return None
            one = factors.step(blocks)
            blocks.local_residual, blocks.whole_residual = self._by_share(discrete, at.unknowns, at.share)
            two = factors.step(blocks)
            apart = at.unknowns.moved(p.unknowns, -1.0)
            off = _product(p.tangent, apart, size) + p.rate * (at.share - p.share) - length
            divisor = _product(p.tangent, two, size) + p.rate
            move = -(off + _product(p.tangent, one, size)) / divisor if divisor else np.nan
            whole = one.moved(two, move)
            far = float(np.sqrt(_product(whole, whole, size) + move**2))
            return (_Place(whole, move), far) if far <= 10 * max(length, LONGEST) else None

        ahead = _Place(p.unknowns, p.share).moved(_Place(p.tangent, p.rate), length)
        solved = newton(ahead, step, _Place.moved, most=MOST_CORRECTIONS, close=CLOSE)
        if not solved.converged:
            return None
        discrete = self.discrete(p.discrete, solved.at.share, p.share)
        return self._oriented(discrete, solved.at.unknowns, solved.at.share, p), solved.steps

    def _follow(self, start: CurvePoint) -> tuple[list[CurvePoint], str]:
        """Return points from a start on in the direction of its tangent, and why they end."""

        def advance(points: list[CurvePoint], length: float) -> Reached[CurvePoint] | None:
            p = points[-1]
            try:
                found = self._stepped(p, length)
            except (np.linalg.LinAlgError, RuntimeError):
                found = None
            if found is None:
                return None
            q, corrections = found
            if not 0 <= q.share <= 1:
                edge = self._at_share(p, length, float(q.share > 1))
                return Reached([edge] if edge is not None else [], end="the range ends")
            marked = marked_elements(q.discrete, q.unknowns, LOOSE)
            if marked.any() and q.discrete.mesh.count < MOST_ELEMENTS:
                finer = self._finer(p, marked)
                if finer is not None:
                    points[-1] = finer
                    return Reached([])
            return Reached([q], GROWTH if corrections <= QUICK else 1.0)

        return follow([start], advance, most=MOST_POINTS, what="curve")

    def _finer(self, p: CurvePoint, marked: NDArray[np.bool_]) -> CurvePoint | None:
        """Return a point on smaller elements."""
        mesh = p.discrete.mesh.refined(marked)
        return self._on(p, mesh)

    def _on(self, p: CurvePoint, mesh: Mesh) -> CurvePoint | None:
        """Return the nearest point of the branch on other elements: across it, so that folds do not hinder it."""
        other = DiscreteCurve(p.discrete.problem, mesh, p.discrete.p, p.discrete.gauge)
        at = transferred(p.discrete, p.unknowns, other)
        tangent = transferred(p.discrete, p.tangent, other)
        found = self._stepped(CurvePoint(p.share, other, at, tangent, p.rate), 0.0)
        return found[0] if found else None

    def _at_share(self, p: CurvePoint, length: float, share: float) -> CurvePoint | None:
        """Return the point of the branch beyond p at which the parameter has a value."""

        def off(q: CurvePoint) -> float:
            return q.share - share

        return self._root(p, length, off)

    def _root(self, p: CurvePoint, length: float, off: Callable[[CurvePoint], float]) -> CurvePoint | None:
        """Return where something vanishes between p and the point at a distance."""
        if off(p) == 0:
            return p
        return located(lambda c: self._at(p, c), off, 0.0, length, LOCATED)

    def _at(self, p: CurvePoint, length: float) -> CurvePoint | None:
        """Return the point of the branch at a distance."""
        found = self._stepped(p, length) if length else (p, 0)
        return found[0] if found else None

    # ------------------------------------------------------------ what is told

    def _answer(self, p: CurvePoint) -> FoundCurve:
        return answer_of(self.posed(p.share), p.discrete, p.unknowns, None, 0, 0, [])

    def _specials(self, points: list[CurvePoint], answers: list[FoundCurve]) -> list[CurveBifurcation]:
        found = []
        for k, (p, q) in enumerate(itertools.pairwise(points)):
            same = p.discrete.mesh.count == q.discrete.mesh.count
            length = self._distance(p, q) if same else 0.0
            if p.rate * q.rate < 0:
                at = self._root(p, length, lambda r: r.rate) if same else None
                if at is None:
                    at = min((p, q), key=lambda r: abs(r.rate))
                found.append(self._special("fold", at, p, q))
            elif answers[k].negative != answers[k + 1].negative and same:
                at = self._changed(p, length, answers[k].negative)
                found.append(self._special("fork", at, p, q))
        return found

    def _distance(self, p: CurvePoint, q: CurvePoint) -> float:
        size = self._sizes(p.discrete, p.unknowns)
        apart = q.unknowns.moved(p.unknowns, -1.0)
        return _product(p.tangent, apart, size) + p.rate * (q.share - p.share)

    def _changed(self, p: CurvePoint, length: float, negative: int) -> CurvePoint:
        """Return where the number of directions that lead down changes."""

        nearest = p

        def side(q: CurvePoint) -> float:
            nonlocal nearest
            nearest = q
            return 1.0 if self._answer(q).negative == negative else -1.0

        # on the fork itself there may be no step
        return located(lambda c: self._at(p, c), side, 0.0, length, SPLIT * abs(length)) or nearest

    def _special(self, kind: str, at: CurvePoint, p: CurvePoint, q: CurvePoint) -> CurveBifurcation:
        """Return a special point, its parameter on elements of higher degree, and how far that moved it."""
        share, error = at.share, abs(p.share - q.share)
        finer = self._on(p, p.discrete.mesh.of_degree(DEGREE + FINER))
        if finer is not None and p.discrete.mesh.count == q.discrete.mesh.count:
            length = self._distance(p, q)
            if kind == "fold":
                again, width = self._root(finer, length, lambda r: r.rate), 0.0
            else:
                again, width = self._changed(finer, length, self._answer(p).negative), SPLIT * abs(length)
            if again is not None:
                error = abs(again.share - share) + 2 * width + ROUNDING
                at = again
        return CurveBifurcation(kind, at.share, error, self._answer(at))


def _product(a: Unknowns, b: Unknowns, size: Unknowns) -> float:
    """Return the product of two changes of a curve, measured against its size: the mean over its elements."""
    total = 0.0
    for x, y, s in (
        (a.border, b.border, size.border),
        (a.inside, b.inside, size.inside),
        (a.whole, b.whole, size.whole),
    ):
        if x.size:
            total += float(np.sum((x / s) * (y / s))) / (len(x) if x.ndim > 1 else 1)
    return total


def _turned(t: Unknowns) -> Unknowns:
    return Unknowns(-t.border, -t.inside, -t.whole)


def on_branch(branch: CurveBranch, answer: FoundCurve, share: float) -> bool:
    """Tell whether a curve lies on a branch: beside the curves of the nearest values of the parameter."""
    s = np.linspace(0, 1, 101)
    n = answer.discrete.layout.n
    y = evaluate(answer.discrete, answer.solved, s, 0)[:n]
    size = max(float(np.max(np.abs(y))), 1e-12)
    for p, q in zip(branch.points[:-1], branch.points[1:], strict=True):
        low, high = sorted((p.share, q.share))
        if low - 1e-9 <= share <= high + 1e-9:
            a, b = (evaluate(r.discrete, r.unknowns, s, 0)[:n] for r in (p, q))
            part = (share - p.share) / (q.share - p.share) if q.share != p.share else 0.5
            near = a + part * (b - a)
            if np.max(np.abs(near - y)) <= 0.3 * np.max(np.abs(b - a)) + 1e-5 * size:
                return True
    return False
