"""Robots in URDF (http://wiki.ros.org/urdf/XML).

Every link is a body, or a frame where it has no mass; every joint is one of the library, with an input for its drive. A
joint that mimics another is a formula and no coordinate.
"""

from __future__ import annotations

import math

from .meshes import Meshes
from .touching import SHAPES, SWITCH, Touching
from .writing import (
    Matrix,
    Parts,
    Vector,
    Wishes,
    Writer,
    each_axis,
    eigenvalues,
    in_axes,
    matrix,
    moved,
    number,
    quantity,
    rotation,
    text,
    turned,
    vector,
)
from .xml import NotRead, XmlElement

ZERO: Vector = (0.0, 0.0, 0.0)
MADE_OF = ("Body", "Revolute", "Prismatic", "Planar", "Free", "Spherical")
"""Parts of the library."""
ROUNDING = 1e-12
"""Of an inertia: what is smaller is none."""
UNITS = {
    "angle": ("Angle", "rad", "Torque", "N.m", "N.m.s"),
    "position": ("Length", "m", "Force", "N", "N.s/m"),
}
"""Type and unit of a joint coordinate, those of what drives it, and the unit of its damping."""
MOVES = {"revolute": "angle", "continuous": "angle", "prismatic": "position"}


def read_urdf(robot: XmlElement, wishes: Wishes) -> tuple[Writer, Parts]:
    """Write the statements of a robot; returns the parts of the library that they use. Raises NotRead."""
    return _Robot(robot, wishes).written()


class _Robot:
    def __init__(self, robot: XmlElement, wishes: Wishes) -> None:
        self.robot, self.wishes = robot, wishes
        self.writer = Writer((*MADE_OF, *SHAPES, "stops", "contacts", "floor_friction"))
        self.touching = Touching(self.writer)
        self.still: set[str] = set()
        """Links that stand still in the world."""
        self.meshes = Meshes(wishes)
        self.used: set[str] = set()
        self.frames: dict[str, str] = {}
        """By link: the frame that stands for it."""
        self.moved_by: dict[str, tuple[str, str]] = {}
        """By joint: its coordinate as it is written, and ``angle`` or ``position``."""
        self.stops: list[str] = []
        self.colours = {
            one.get("name"): colour for one in robot.all("material") if (colour := _colour(one)) is not None
        }
        self.links = _named(robot, "link")
        self.joints = _named(robot, "joint")
        self.below: dict[str, list[XmlElement]] = {}
        carried: dict[str, XmlElement] = {}
        for joint in self.joints.values():
            ends = [joint.one(tag) for tag in ("parent", "child")]
            for tag, end in zip(("parent", "child"), ends, strict=True):
                if end is None:
                    raise NotRead(f"the joint '{joint.get('name')}' has no {tag}", joint.line)
                if end.need("link") not in self.links:
                    raise NotRead(f"there is no link '{end.get('link')}'", end.line)
            parent, child = (end.get("link") for end in ends if end is not None)
            if child in carried:
                raise NotRead(f"the link '{child}' is the child of two joints: a URDF is a tree", joint.line)
            carried[child] = joint
            self.below.setdefault(parent, []).append(joint)
        if not self.links:
            raise NotRead("the robot has no link", robot.line)
        roots = [link for link in self.links if link not in carried]
        if len(roots) != 1:
            what = (
                "no link is the root: the joints go round"
                if not roots
                else f"{len(roots)} links have no parent"
            )
            raise NotRead(f"{what}{': ' if roots else ''}{', '.join(roots[:5])}", robot.line)
        self.root = roots[0]

    def written(self) -> tuple[Writer, Parts]:
        say = self.writer.say
        held = self.root == "world" and _inertial(self.links["world"]) is None and not self.wishes.floating
        for name, joint in self.joints.items():  # joints keep their names where a link has the same one
            if joint.need("type") != "fixed":
                self.writer.name("joint", name)
        for link in self.links:
            if not (held and link == self.root):
                self.writer.name("link", link)
        say("gravity {0, 0, -9.81} m/s^2;")
        at = len(self.writer.statements)
        self._root(held)
        waiting = list(reversed(self.below.get(self.root, [])))
        while waiting:
            joint = waiting.pop()
            child = self._joint(joint)
            waiting += reversed(self.below.get(child, []))
        self._contacts(at)
        if self.stops:
            self.writer.statements.insert(
                at, 'structural parameter Boolean stops = false "whether joints end at their ranges";'
            )
            self.writer.gap()
            say("if stops then\n" + "\n".join(self.stops) + "\nend if;")
        if self.meshes.drawn:
            self.writer.statements.insert(at, "draw none;")
        if self.stops:
            self.writer.leave_out("the ends of joint ranges, unless stops = true", 0)
        if self.moved_by and not any(_inertial(link) for link in self.links.values()):
            self.writer.leave_out(
                "masses: no link has one, and nothing moves before bodies have some, or formulas take the place of joint angles",
                self.robot.line,
            )
        for what, line in self.robot.unseen():
            self.writer.leave_out(what, line)
        self.writer.copies = self.meshes.copies
        used = tuple(part for part in MADE_OF if part in self.used)
        return self.writer, {"spatial": used, "shapes": self.touching.used()}

    def _contacts(self, at: int) -> None:
        """Write what touches a floor, with the parameter that switches it on among the first statements."""
        carried = []
        floor = self.touching.shape("floor_plane", "", "Plane", "", "world")
        for link, element in self.links.items():
            for shape in element.all("collision"):
                try:
                    if link in self.still:
                        raise NotRead("collision shapes of what stands still: they touch nothing", shape.line)
                    self._touches(link, shape, floor)
                    carried.append(shape.line)
                except NotRead as wrong:
                    self.writer.leave_out(wrong.message, wrong.line)
        if not carried:
            return
        self.writer.statements.insert(at, SWITCH)
        self.writer.gap()
        friction = (
            'parameter Real floor_friction(min = 0) = 1 "of dry friction; the file says nothing of it";'
        )
        self.writer.say(self.touching.statements(friction))
        for line in carried:
            self.writer.leave_out(
                "contacts, unless contacts = true; it brings those with the floor z = 0, with a friction of 1",
                line,
            )

    def _touches(self, link: str, shape: XmlElement, floor: str) -> None:
        """Let a collision shape touch the floor. Raises NotRead for one that the library does not have."""
        geometry = shape.one("geometry")
        if geometry is None or not geometry.children:
            raise NotRead(f"a collision shape of '{link}': it has no geometry", shape.line)
        solid, where = geometry.children[0], self.frames[link]
        origin = shape.one("origin")
        place = origin.numbers("xyz", 3, ZERO) if origin is not None else ZERO
        match solid.tag:
            case "sphere":
                kind, settings = "Sphere", f"(r = {quantity(solid.number('radius'), 'm')})"
                where += f" at {vector(place, 'm')}" if any(place) else ""
            case "box":
                kind, settings = "Box", f"(size = {vector(solid.numbers('size', 3, ZERO), 'm')})"
                where = _placed(where, shape)
            case "cylinder" | "capsule" as round_:
                kind = round_.capitalize()
                sizes = [quantity(solid.number(what), "m") for what in ("radius", "length")]
                settings = f"(r = {sizes[0]}, l = {sizes[1]})"
                where = f"{_placed(where, shape)} * roty(90 deg)"  # those of the library lie along x
            case other:
                raise NotRead(f"contacts of shapes of the kind {other}", shape.line)
        name = self.touching.shape(shape.get("name"), link, kind, settings, where)
        self.touching.touch(floor, name, "floor_friction")

    def _root(self, held: bool) -> None:
        """Write the root; ``held``: it is the world."""
        if not self.wishes.floating:
            self.still.add(self.root)
        if held:
            self.frames[self.root] = "world"
            self._looks(self.root)
            return
        if not self.wishes.floating:
            self._body(self.root, "world")
            return
        self._body(self.root, "")
        self.used.add("Free")
        self.writer.say(f"Free {self.writer.name('joint', 'root_joint')}(world -> {self.frames[self.root]});")
        self._looks(self.root)

    # ------------------------------------------------------------ links

    def _body(self, link: str, place: str) -> None:
        """Write a link, without ``place`` as what a joint places."""
        name = self.writer.name("link", link)
        inertial = _inertial(self.links[link])
        if inertial is None:
            self.writer.say(f"frame {name} = {place};" if place else f"frame {name};")
            self.frames[link] = name
        else:
            given = [f"m = {quantity(inertial.need_mass, 'kg')}"]
            if any(inertial.centre):
                given.append(f"com = {vector(inertial.centre, 'm')}")
            if any(map(any, inertial.J)):
                given.append(f"J = {matrix(inertial.J, 'kg.m^2')}")
            given += [f"a = {place}"] if place else []
            self.writer.say(f"Body {name}({', '.join(given)});")
            self.used.add("Body")
            self.frames[link] = f"{name}.a"
            if inertial.remark:
                self.writer.leave_out(f"{inertial.remark} of '{link}'; it is kept as it is", inertial.line)
        if place:
            self._looks(link)

    def _looks(self, link: str) -> None:
        """Draw a link."""
        element = self.links[link]
        shapes, touching = element.all("visual"), element.all("collision")
        for shape in touching:
            _mark(shape)
        drawn = [statement for shape in shapes if (statement := self._drawn(link, shape, tell=True))]
        if not drawn and shapes and self.wishes.meshes != "none":
            drawn = [statement for shape in touching if (statement := self._drawn(link, shape, tell=False))]
            if drawn:
                self.writer.leave_out("how links look: their collision shapes are drawn", shapes[0].line)
        for statement in drawn:
            self.writer.say(statement)
        self.meshes.drawn |= bool(drawn)

    def _drawn(self, link: str, shape: XmlElement, *, tell: bool) -> str:
        """Return the statement that draws a shape; empty where it cannot be drawn."""
        try:
            return self._shape(link, shape, tell=tell)
        except NotRead as wrong:
            self.writer.leave_out(f"a shape: {wrong.message}", wrong.line)
            return ""

    def _shape(self, link: str, shape: XmlElement, *, tell: bool) -> str:
        geometry = shape.one("geometry")
        if geometry is None or not geometry.children:
            raise NotRead(f"a shape of the link '{link}' has no geometry", shape.line)
        frame = _placed(self.frames[link], shape)
        material = shape.one("material")
        colour = None
        if material is not None:
            colour = _colour(material) or self.colours.get(material.get("name"))
        options = f", colour = {text(colour)}" if colour else ""
        solid = geometry.children[0]
        geometry.all(solid.tag)
        match solid.tag:
            case "box":
                drawn = f"box({vector(solid.numbers('size', 3, ZERO), 'm')})"
            case "sphere":
                drawn = f"sphere({quantity(solid.number('radius'), 'm')})"
            case "cylinder" | "capsule":
                radius, length = (quantity(solid.number(name), "m") for name in ("radius", "length"))
                drawn = f"cylinder(radius = {radius}, length = {length}, axis = {{0, 0, 1}})"
            case "mesh":
                file, why = self.meshes.found(solid.need("filename"))
                scale = solid.numbers("scale", 3, (1.0, 1.0, 1.0))
                if why:
                    if tell and self.wishes.meshes != "none":
                        self.writer.leave_out(f"meshes: {why}", solid.line)
                    return ""
                drawn = f"mesh({text(file)}, scale = {each_axis(scale)})"
            case other:
                if tell:
                    self.writer.leave_out(f"a shape '{other}'", solid.line)
                return ""
        return f"draw {drawn} on {frame}{options};"

    # ------------------------------------------------------------ joints

    def _joint(self, joint: XmlElement) -> str:
        """Write a joint with the link that it carries; returns that link."""
        kind, given = joint.need("type"), joint.need("name")
        parent, child = (
            end.get("link") for end in (joint.one("parent"), joint.one("child")) if end is not None
        )
        carrier = _placed(self.frames[parent], joint)
        axis_of = joint.one("axis")
        axis = axis_of.numbers("xyz", 3, (1.0, 0.0, 0.0)) if axis_of is not None else (1.0, 0.0, 0.0)
        self.writer.gap()
        if kind == "fixed":
            self._ignore_limits(joint)
            self._body(child, carrier)
            self.still |= {child} if parent in self.still else set()
            return child
        if kind in MOVES:
            if not any(axis):
                raise NotRead(f"the axis of the joint '{given}' has no direction", joint.line)
            if self._idle(joint):
                self._held(joint, MOVES[kind], child, carrier, axis)
                self.still |= {child} if parent in self.still else set()
                return child
            self._moving(joint, MOVES[kind], child, carrier, axis)
            return child
        name = self.writer.name("joint", given)
        self._body(child, "")
        to = self.frames[child]
        match kind:
            case "floating":
                self._part("Free", f"Free {name}({carrier} -> {to});")
            case "spherical" | "ball":
                self._part("Spherical", f"Spherical {name}({carrier} -> {to});")
            case "planar":
                turn = _across(axis)
                self._part("Planar", f"Planar {name}({carrier}{turn} -> {to}{turn});")
            case other:
                raise NotRead(
                    f"the joint '{given}' is of the type '{other}', which URDF does not have", joint.line
                )
        for tag in ("dynamics", "limit"):
            if (element := joint.one(tag)) is not None:
                self.writer.leave_out(f"{tag} of a joint of several freedoms", element.line)
        self._looks(child)
        return child

    def _idle(self, joint: XmlElement) -> bool:
        """Tell whether nothing with mass or damping moves with a joint, nor with those that follow it, in a robot that has a mass."""
        mimic = self._mimic(joint)
        if mimic is not None and not self._idle(self.joints[mimic.need("joint")]):
            return False
        if not any(_inertial(link) for link in self.links.values()):
            return False
        name = joint.get("name")
        followers = [one for one in self.joints.values() if self._follows(one, name)]
        return all(self._light(one) and not _dynamics(one, "N.s/m", "N") for one in [joint, *followers])

    def _follows(self, joint: XmlElement, leader: str) -> bool:
        """Tell whether a joint follows another, or one that follows it."""
        mimic = self._mimic(joint)
        if mimic is None:
            return False
        above = mimic.need("joint")
        return above == leader or self._follows(self.joints[above], leader)

    def _light(self, joint: XmlElement) -> bool:
        """Tell whether the link that a joint carries, and all that hang on it, have no mass."""
        child = joint.one("child")
        assert child is not None
        waiting = [child.get("link")]
        while waiting:
            link = waiting.pop()
            if _inertial(self.links[link]) is not None:
                return False
            waiting += [
                end.get("link") for one in self.below.get(link, []) if (end := one.one("child")) is not None
            ]
        return True

    def _start(self, joint: XmlElement) -> float:
        """Return where a joint of one freedom starts: at zero, or at the nearer end of its range."""
        mimic = self._mimic(joint)
        if mimic is not None:
            leader = self._start(self.joints[mimic.need("joint")])
            return mimic.number("multiplier", 1.0) * leader + mimic.number("offset", 0.0)
        low, high, _, _ = _limits(joint, joint.one("limit"))
        return 0.0 if low is None or high is None else min(max(0.0, low), high)

    def _held(self, joint: XmlElement, moves: str, child: str, carrier: str, axis: Vector) -> None:
        """Write a joint that moves nothing with mass: no law tells its motion, and it stays where it starts."""
        self._ignore_limits(joint)
        start = quantity(self._start(joint), UNITS[moves][1])
        plain = vector(_unit(axis))
        if self._start(joint):
            carrier += (
                f" * axis_angle({plain}, {start})" if moves == "angle" else f" * trans({start}*{plain})"
            )
        self._body(child, carrier)
        self.writer.leave_out(
            f"the freedom of '{joint.get('name')}': nothing with mass moves with it, and it stays at {start}",
            joint.line,
        )

    def _part(self, part: str, statement: str) -> None:
        self.used.add(part)
        self.writer.say(statement)

    def _moving(self, joint: XmlElement, moves: str, child: str, carrier: str, axis: Vector) -> None:
        """Write a joint of one freedom."""
        given = joint.need("name")
        name = self.writer.name("joint", given)
        type_, unit, load, strength, resistance = UNITS[moves]
        limit, mimic = joint.one("limit"), self._mimic(joint)
        low, high, effort, speed = _limits(joint, limit)
        begins = self._start(joint)
        about = text(f"at most {number(speed)} {unit}/s") if speed else ""
        passive = _dynamics(joint, resistance, strength)
        if mimic is not None:
            leader, kind = self._leader(mimic)
            factor = mimic.number("multiplier", 1.0)
            ratio = number(factor) if kind == moves else quantity(factor, f"{unit}/{UNITS[kind][1]}")
            formula = leader if ratio == "1" else f"{ratio}*{leader}"
            offset = mimic.number("offset", 0.0)
            formula += (
                f" + {quantity(offset, unit)}"
                if offset > 0
                else f" - {quantity(-offset, unit)}"
                if offset
                else ""
            )
            self.writer.say(f"let {type_} {name} = {formula} {about};".replace(" ;", ";"))
            coordinate = name
            plain = _unit(axis)
            by = (
                f"axis_angle({vector(plain)}, {name})"
                if moves == "angle"
                else f"trans({name}*{vector(plain)})"
            )
            self._body(child, f"{carrier} * {by}")
        else:
            coordinate = f"{name}.{moves}"
            part = "Revolute" if moves == "angle" else "Prismatic"
            self._body(child, "")
            own = [f"axis = {vector(axis)}", f"{moves} = {quantity(begins, unit)}"]
            own += [f"{what} = {amount}" for what, amount in passive]
            self._part(
                part,
                f"{part} {name}({carrier} -> {self.frames[child]}, {', '.join(own)}) {about};".replace(
                    " ;", ";"
                ),
            )
        self.moved_by[given] = coordinate, moves
        if limit is not None and (effort or speed):
            self.writer.leave_out(
                "limits of effort and speed; the text states them, but nothing enforces them", limit.line
            )
        bounds = (
            f"(min = {quantity(-effort, strength)}, max = {quantity(effort, strength)})" if effort else ""
        )
        drive = self.writer.name(load.lower(), f"{load.lower()}_{name}")
        self.writer.say(f"input {load} {drive}{bounds} = {quantity(0, strength)};")
        self.writer.say(f"force {drive} on {coordinate};")
        if mimic is not None:  # it has no joint that could say it
            for what, amount in passive:
                self.writer.say(f"{what} {amount} on {coordinate};")
        if low is not None and high is not None:
            upper, lower = (self.writer.name("contact", f"{name}_{end}") for end in ("upper", "lower"))
            self.stops += [
                f"contact {upper}: {quantity(high, unit)} - {coordinate};",
                f"contact {lower}: {coordinate} - ({quantity(low, unit)});"
                if low < 0
                else f"contact {lower}: {coordinate} - {quantity(low, unit)};",
            ]
            if begins and mimic is None and limit is not None:
                self.writer.leave_out(
                    f"the zero of '{given}': it lies beyond the range, and the joint starts at {quantity(begins, unit)}",
                    limit.line,
                )
        if mimic is None:
            self._looks(child)

    def _mimic(self, joint: XmlElement) -> XmlElement | None:
        """Return what a joint follows; None where it follows none that there is. Raises NotRead for one that follows itself."""
        first, seen = joint.one("mimic"), {joint.get("name")}
        mimic = first
        while mimic is not None:
            leader = mimic.need("joint")
            if leader in seen:
                raise NotRead(f"the joint '{leader}' follows itself", mimic.line)
            seen.add(leader)
            why = "there is no such joint" if leader not in self.joints else ""
            why = why or ("" if self.joints[leader].need("type") in MOVES else "it has no single freedom")
            if why:
                if mimic is first:
                    self.writer.leave_out(
                        f"that '{joint.get('name')}' follows '{leader}': {why}, and it moves freely",
                        mimic.line,
                    )
                return None if mimic is first else first
            mimic = self.joints[leader].one("mimic")
        return first

    def _leader(self, mimic: XmlElement) -> tuple[str, str]:
        """Return the coordinate that a joint follows, as it is written, and what it is."""
        leader = self.joints[mimic.need("joint")]
        name, moves = self.writer.name("joint", leader.get("name")), MOVES[leader.need("type")]
        followed = leader.one("mimic")
        above = None if followed is None else self.joints.get(followed.need("joint"))
        free = above is None or above.need("type") not in MOVES
        return (f"{name}.{moves}" if free else name), moves

    def _ignore_limits(self, joint: XmlElement) -> None:
        """Mark what means nothing of a fixed joint."""
        for tag in ("axis", "limit", "dynamics"):
            if (element := joint.one(tag)) is not None:
                _mark(element)


def _dynamics(joint: XmlElement, resistance: str, strength: str) -> list[tuple[str, str]]:
    """Return damping and dry friction of a joint, each with its unit; what is zero is not there."""
    dynamics = joint.one("dynamics")
    if dynamics is None:
        return []
    found = (("damping", resistance), ("friction", strength))
    return [(what, quantity(amount, unit)) for what, unit in found if (amount := dynamics.number(what, 0.0))]


def _mark(element: XmlElement) -> None:
    """Take an element as read."""
    element.seen |= {*element.attributes, *(child.tag for child in element.children)}
    for child in element.children:
        _mark(child)


def _named(robot: XmlElement, tag: str) -> dict[str, XmlElement]:
    found: dict[str, XmlElement] = {}
    for element in robot.all(tag):
        name = element.need("name")
        if name in found:
            raise NotRead(
                f"two elements '{tag}' are called '{name}', the first in line {found[name].line}",
                element.line,
            )
        found[name] = element
    return found


def _colour(material: XmlElement) -> str | None:
    colour, _ = material.one("color"), material.get("name")
    if colour is None:
        return None
    rgba = colour.numbers("rgba", 4, (0.5, 0.5, 0.5, 1.0))
    return "#" + "".join(f"{round(255 * min(max(c, 0.0), 1.0)):02x}" for c in rgba[:3])


def _placed(frame: str, element: XmlElement) -> str:
    """Return the frame at the origin of an element."""
    origin = element.one("origin")
    if origin is None:
        return frame
    return turned(moved(frame, origin.numbers("xyz", 3, ZERO)), origin.numbers("rpy", 3, ZERO))


class _Inertial:
    """Mass, mass centre and inertia about it in the axes of the link; ``remark``: why no body has them."""

    def __init__(self, element: XmlElement, mass: float) -> None:
        self.line, self.need_mass, self.remark = element.line, mass, ""
        origin, inertia = element.one("origin"), element.one("inertia")
        self.centre = origin.numbers("xyz", 3, ZERO) if origin is not None else ZERO
        names = (("ixx", "ixy", "ixz"), ("ixy", "iyy", "iyz"), ("ixz", "iyz", "izz"))
        J: Matrix = (ZERO, ZERO, ZERO)
        if inertia is not None:
            J = tuple(tuple(inertia.number(name, 0.0) for name in row) for row in names)
        angles = origin.numbers("rpy", 3, ZERO) if origin is not None else ZERO
        if any(angles):
            J = in_axes(J, rotation(angles))
        largest = max(abs(value) for row in J for value in row)
        self.J: Matrix = J
        low, middle, high = eigenvalues(J)
        if low < -ROUNDING * largest:
            self.remark = "the inertia with a negative principal moment"
        elif low + middle < high * (1 - 1e-6):
            self.remark = "the inertia that no body has (two principal moments add up to less than the third)"
        elif low < 0 and largest < 1e-15:
            self.J = (ZERO, ZERO, ZERO)


def _inertial(link: XmlElement) -> _Inertial | None:
    """Return the inertial of a link; None for a link without mass."""
    element = link.one("inertial")
    if element is None:
        return None
    mass = element.one("mass")
    if mass is None:
        raise NotRead(f"the inertial of the link '{link.get('name')}' has no mass", element.line)
    value = mass.number("value")
    if value < 0:
        raise NotRead(f"the mass of the link '{link.get('name')}' is {number(value)} kg", mass.line)
    found = _Inertial(element, value)
    return found if value or any(map(any, found.J)) else None


def _limits(joint: XmlElement, limit: XmlElement | None) -> tuple[float | None, float | None, float, float]:
    """Return the range of a joint (None for none), the largest effort and speed (0 for none)."""
    if limit is None:
        return None, None, 0.0, 0.0
    low, high = limit.number("lower", 0.0), limit.number("upper", 0.0)
    effort, speed = abs(limit.number("effort", 0.0)), abs(limit.number("velocity", 0.0))
    if joint.get("type") == "continuous" or low == high == 0:
        return None, None, effort, speed
    if low > high:
        raise NotRead(f"the range of the joint '{joint.get('name')}' ends before it begins", limit.line)
    return low, high, effort, speed


def _unit(axis: Vector) -> Vector:
    length = sum(a * a for a in axis) ** 0.5
    return axis if length == 1 else tuple(a / length for a in axis)


def _across(axis: Vector) -> str:
    """Return the turn that takes z to the normal of a plane, as it is written after a frame."""
    x, y, z = _unit(axis)
    if (x, y) == (0, 0):
        return "" if z > 0 else " * rotx(180 deg)"
    across = math.hypot(x, y)
    angle = quantity(math.atan2(across, z), "rad")
    return f" * axis_angle({vector((-y / across, x / across, 0.0))}, {angle})"
