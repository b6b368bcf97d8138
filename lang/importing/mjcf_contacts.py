"""Contacts of MJCF: which shapes touch by the rules of MuJoCo (Computation, "Collision detection"), and with which friction.

Carried are contacts with what stands still, those between separate trees of bodies, and pairs that the file names.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from msgspec import Struct

from .mjcf_file import MjcfFile, within
from .touching import SHAPES, Touching, meet
from .writing import moved, number, quantity, turned_by_quaternion, vector


class PairOfShapes(Struct, frozen=True):
    """Two shapes; ``sliding``, ``other``: coefficients of friction along both directions of slip, and the largest of the rest;
    ``line``: that of a pair that the file names, else 0."""

    shapes: tuple[int, int]
    sliding: tuple[float, float]
    other: float
    margin: float
    line: int


class Contacts:
    """``touching``: the shapes that touch, and what they touch."""

    def __init__(self, file: MjcfFile) -> None:
        self.file, self.m, self.mj, self.writer = file, file.m, file.mj, file.writer
        self.lines = {"geom": file.geom_lines, "pair": self._lines_of_pairs()}
        """Of shapes, and of the pairs that the file names."""
        self.touching = Touching(self.writer)
        self.names: dict[int, str] = {}
        m = self.m
        self.body: list[int] = m.geom_bodyid.tolist()
        """By shape, as the bits."""
        self.bits = list(zip(m.geom_contype.tolist(), m.geom_conaffinity.tolist(), strict=True))
        self.weld: list[int] = m.body_weldid.tolist()
        """By body: the first of those that are fixed to one another."""
        self.still = [True]
        """By body: whether it stands still in the world."""
        for body in range(1, m.nbody):
            self.still.append(self.still[int(m.body_parentid[body])] and not m.body_jntnum[body])
        self.related_touch = file.disabled("FILTERPARENT")

    def _lines_of_pairs(self) -> list[int]:
        named = {
            frozenset(one.attributes.get(end) for end in ("geom1", "geom2")): one.line
            for one in within(self.file.root)
            if one.tag == "pair"
        }
        ends = zip(self.m.pair_geom1, self.m.pair_geom2, strict=True)
        return [named.get(frozenset(self.file.given("geom", int(geom)) for geom in pair), 0) for pair in ends]

    def carry(self) -> None:
        """Collect what touches, and list what is left out."""
        m, out = self.m, self.writer.leave_out
        pairs = list(self._pairs())
        wanted: list[PairOfShapes] = []
        for pair in pairs:
            kinds = tuple(self._kind(geom) for geom in pair.shapes)
            lines = [self.lines["geom"][geom] for geom in pair.shapes]
            strange = [k for k in range(2) if kinds[k] not in SHAPES]
            for k in strange:
                out(f"contacts of shapes of the kind {kinds[k].lower()}", lines[k])
            if strange:
                continue
            if not meet(*kinds):
                what = " with ".join(f"a {kind.lower()}" for kind in sorted(kinds))
                for line in lines:
                    out(f"contacts of {what}", line)
                continue
            for line in lines if kinds == ("Box", "Box") else ():
                out("edges of boxes that cross: boxes touch each other at their corners", line)
            wanted.append(pair)
        for geom in sorted({geom for pair in wanted for geom in pair.shapes}):
            self._shape(geom)
        for pair in wanted:
            one, other = sorted(pair.shapes, key=lambda geom: not self.still[self.body[geom]])
            mu, across = pair.sliding
            self.touching.touch(self.names[one], self.names[other], number(mu) if mu else "")
            if mu != across:
                out(f"a second friction of pairs: {number(mu)} holds in all directions", pair.line)
            for line in self._said(pair, m.geom_condim > 3) if pair.other else ():
                out("torsional and rolling friction of contacts", line)
            for line in self._said(pair, m.geom_margin > 0) if pair.margin else ():
                out("margins of contacts: shapes touch where their surfaces meet", line)

    def _said(self, pair: PairOfShapes, where: Any) -> list[int]:
        """Return the lines that say something of a pair: its own, or those of its shapes ``where`` they do; 0 for another."""
        of_shapes = [self.lines["geom"][geom] for geom in pair.shapes if where[geom]]
        return [pair.line] if pair.line else of_shapes or [0]

    # ------------------------------------------------------------ what touches

    def _pairs(self) -> Iterator[PairOfShapes]:
        m = self.m
        told: set[tuple[int, int]] = set()
        for k in range(m.npair):
            one, other = sorted((int(m.pair_geom1[k]), int(m.pair_geom2[k])))
            line = self.lines["pair"][k]
            told.add((one, other))
            if self._together(one, other):
                self.writer.leave_out("pairs within what moves as one", line)
                continue
            dim, friction = int(m.pair_dim[k]), m.pair_friction[k].tolist()
            yield self._pair((one, other), dim, friction, float(m.pair_margin[k]), line)
        excluded = {int(x) for x in m.exclude_signature}
        among = False
        for one in range(m.ngeom):
            for other in range(one + 1, m.ngeom):
                if (one, other) in told or not self._may_touch(one, other, excluded):
                    continue
                ends = self.body[one], self.body[other]
                if (
                    not any(self.still[end] for end in ends)
                    and len({int(m.body_rootid[b]) for b in ends}) == 1
                ):
                    among = True
                    continue
                yield self._dynamic(one, other)
        if among:
            self.writer.leave_out(
                "that bodies of one tree touch each other, but in pairs that the file names", 0
            )

    def _may_touch(self, one: int, other: int, excluded: set[int]) -> bool:
        """Tell whether MuJoCo looks for contacts of two shapes by itself."""
        (type_one, with_one), (type_other, with_other) = self.bits[one], self.bits[other]
        if not (type_one & with_other or type_other & with_one) or self._together(one, other):
            return False
        ends = self.body[one], self.body[other]
        if (min(ends) << 16) + max(ends) in excluded:
            return False
        first, second = (self.weld[end] for end in ends)
        above = self.m.body_parentid
        related = (
            first and second and (first == self.weld[above[second]] or second == self.weld[above[first]])
        )
        return not related or self.related_touch

    def _dynamic(self, one: int, other: int) -> PairOfShapes:
        """Return a pair with what its shapes say of friction: that with the higher priority, or the larger of both."""
        m = self.m
        first, second = int(m.geom_priority[one]), int(m.geom_priority[other])
        heard = [one, other] if first == second else [one if first > second else other]
        slide, spin, roll = (max(float(m.geom_friction[geom][k]) for geom in heard) for k in range(3))
        dim = max(int(m.geom_condim[geom]) for geom in heard)
        margin = float(m.geom_margin[one]) + float(m.geom_margin[other])
        return self._pair((one, other), dim, [slide, slide, spin, roll, roll], margin, 0)

    def _pair(
        self, shapes: tuple[int, int], dim: int, friction: list[float], margin: float, line: int
    ) -> PairOfShapes:
        m = self.m
        if int(m.opt.enableflags) & int(self.mj.mjtEnableBit.mjENBL_OVERRIDE):
            friction, margin = m.opt.o_friction.tolist(), float(m.opt.o_margin)
        friction = [mu if k < dim - 1 else 0.0 for k, mu in enumerate(friction)]
        return PairOfShapes(shapes, (friction[0], friction[1]), max(friction[2:]), margin, line)

    def _together(self, one: int, other: int) -> bool:
        """Tell whether two shapes keep their distance."""
        ends = self.body[one], self.body[other]
        return self.weld[ends[0]] == self.weld[ends[1]] or all(self.still[end] for end in ends)

    # ------------------------------------------------------------ shapes

    def _kind(self, geom: int) -> str:
        return str(self.mj.mjtGeom(int(self.m.geom_type[geom])).name.removeprefix("mjGEOM_").capitalize())

    def _shape(self, geom: int) -> None:
        m = self.m
        body, size = int(m.geom_bodyid[geom]), m.geom_size[geom].tolist()
        kind, place, turn = self._kind(geom), m.geom_pos[geom].tolist(), m.geom_quat[geom].tolist()
        settings, along = {
            "Plane": ("", ""),
            "Sphere": (f"(r = {quantity(size[0], 'm')})", ""),
            "Capsule": (
                f"(r = {quantity(size[0], 'm')}, l = {quantity(2 * size[1], 'm')})",
                " * roty(90 deg)",
            ),
            "Cylinder": (
                f"(r = {quantity(size[0], 'm')}, l = {quantity(2 * size[1], 'm')})",
                " * roty(90 deg)",
            ),
            "Box": (f"(size = {vector([2 * x for x in size], 'm')})", ""),
        }[kind]  # Capsules and Cylinders of the library lie along x
        where = self.file.frames[body]
        if kind == "Sphere" or not (any(turn[1:]) or along):
            where += f" at {vector(place, 'm')}" if any(place) else ""
        else:
            where = turned_by_quaternion(moved(where, place), turn) + along
        owner = self.file.given("body", body) or (f"body_{body}" if body else "world")
        self.names[geom] = self.touching.shape(self.file.given("geom", geom), owner, kind, settings, where)
