"""An MJCF as MuJoCo's compiler has read it: names and lines of its objects, and what its flags switch off."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from .writing import Writer, quantity
from .xml import XmlElement

FREE, BALL, SLIDE, HINGE = range(4)
"""Joints."""
UNITS = {
    HINGE: ("angle", "rad", "N.m", "kg.m^2", "N.m.s", "N.m/rad"),
    SLIDE: ("position", "m", "N", "kg", "N.s/m", "N/m"),
}
"""Coordinate of a joint; units of itself, of its force, inertia, damping and stiffness."""


class MjcfFile:
    """``m``: the compiled model; ``mj``: the package MuJoCo; ``writer``: what the statements go to. ``frames``: by body, the frame that
    stands for it; ``moved``: by joint, its coordinate, or its name where that has several."""

    def __init__(self, root: XmlElement, model: Any, mujoco: Any, writer: Writer) -> None:
        self.root, self.m, self.mj, self.writer = root, model, mujoco, writer
        self.frames = {0: "world"}
        self.moved: dict[int, str] = {}
        self.geom_lines = self._lines_of_geoms()

    def disabled(self, *names: str) -> bool:
        """Tell whether one of these flags switches something off."""
        bits = (getattr(self.mj.mjtDisableBit, f"mjDSBL_{name}", 0) for name in names)
        return any(int(self.m.opt.disableflags) & int(bit) for bit in bits)

    def named(self, kind: str, index: int) -> str:
        """Return the name of an object in the model that is written."""
        given = self.given(kind, index)
        return self.writer.name(kind, given or f"{kind}_{index}")

    def given(self, kind: str, index: int) -> str:
        """Return the name of an object in the file; empty where it has none."""
        return str(self.mj.mj_id2name(self.m, getattr(self.mj.mjtObj, f"mjOBJ_{kind.upper()}"), index) or "")

    def lines(self, *tags: str) -> list[int]:
        """Return the lines of elements in the file itself; [0] where there are none, as of a file that it includes."""
        return [one.line for one in within(self.root) if one.tag in tags] or [0]

    def line(self, tags: Sequence[str], name: str) -> int:
        """Return the line of a named element."""
        found = (
            one.line for one in within(self.root) if one.tag in tags and one.attributes.get("name") == name
        )
        return next(found, 0)

    def _lines_of_geoms(self) -> list[int]:
        """Return the line of each shape; that of its name, or 0, where the file itself does not hold just these shapes."""
        found = [geom for world in self.root.children if world.tag == "worldbody" for geom in _geoms(world)]
        names = [self.given("geom", geom) for geom in range(self.m.ngeom)]
        if [geom.attributes.get("name", "") for geom in found] == names:
            return [geom.line for geom in found]
        return [self.line(("geom",), name) for name in names]

    def leave_out(self, what: str, *tags: str) -> None:
        """Note what the model does not hold, with the lines of these elements."""
        for line in self.lines(*tags):
            self.writer.leave_out(what, line)

    def reference(self, joint: int) -> float:
        """Return what a joint of one freedom measures where its coordinate is zero."""
        return float(self.m.qpos0[int(self.m.jnt_qposadr[joint])])


def within(element: XmlElement) -> Iterator[XmlElement]:
    yield element
    for child in element.children:
        yield from within(child)


def _geoms(body: XmlElement) -> list[XmlElement]:
    """Return the shapes of a body and of those below, in the order of MuJoCo: its own first."""
    own: list[XmlElement] = []
    below: list[XmlElement] = []
    waiting = list(body.children)
    while waiting:
        child = waiting.pop(0)
        if child.tag == "geom":
            own.append(child)
        elif child.tag == "body":
            below += _geoms(child)
        elif child.tag == "frame":
            waiting = child.children + waiting
    return own + below


def signed(value: float, unit: str) -> str:
    """Return what follows a minus sign."""
    return f"({quantity(value, unit)})" if value < 0 else quantity(value, unit)
