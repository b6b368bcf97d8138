"""Robots in MJCF (https://mujoco.readthedocs.io/en/stable/XMLreference.html), read by MuJoCo's own compiler.

The compiler resolves defaults, classes, includes and inertias of shapes; what it makes is written body by body. Constraints are
rigid here, and soft there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from .meshes import Meshes
from .mjcf_actuators import Actuators
from .mjcf_contacts import Contacts
from .mjcf_file import BALL, FREE, HINGE, UNITS, MjcfFile, signed, within
from .touching import SHAPES, SWITCH
from .writing import (
    Matrix,
    Parts,
    Vector,
    Wishes,
    Writer,
    each_axis,
    in_axes,
    matrix,
    moved,
    number,
    quantity,
    text,
    turned_by_quaternion,
    vector,
)
from .xml import NotRead, XmlElement

MADE_OF = ("Body", "Revolute", "Prismatic", "Spherical", "Free", "Weld")
DRAWN_GROUPS = 3
"""Groups of shapes that are shown, from 0 on; the others are for contacts."""


def read_mjcf(root: XmlElement, wishes: Wishes) -> tuple[Writer, Parts]:
    """Write the statements of a robot; returns the parts of the library that they use. Raises NotRead."""
    if wishes.floating:
        raise NotRead("the file says itself what moves freely", help="leave --floating out")
    try:
        import mujoco
    except ImportError:
        raise NotRead(
            "MJCF is read by MuJoCo, which is not there", help="pip install 'mechc[robots]'"
        ) from None
    warned: list[str] = []
    mujoco.set_mju_user_warning(warned.append)  # else they go to a file of MuJoCo
    try:
        model = mujoco.MjModel.from_xml_path(str(wishes.source))
    except ValueError as error:
        raise NotRead(f"MuJoCo refuses it: {' '.join(str(error).split())}") from None
    finally:
        mujoco.set_mju_user_warning(None)
    file = MjcfFile(root, model, mujoco, Writer((*MADE_OF, *SHAPES, "stops", "contacts")))
    _settle_flags(file)
    writer, parts = _Robot(file, wishes).written()
    for warning in warned:
        writer.leave_out(f"MuJoCo warns: {' '.join(warning.split())}", 0)
    return writer, parts


def _settle_flags(file: MjcfFile) -> None:
    """Take out of a model what its flags switch off."""
    m, off = file.m, file.disabled
    springs, dampers = off("SPRING", "PASSIVE"), off("DAMPER", "PASSIVE")
    for switched_off, arrays in (
        (off("CONSTRAINT", "EQUALITY"), ("eq_active0",)),
        (off("CONSTRAINT", "LIMIT"), ("jnt_limited", "tendon_limited")),
        (off("CONSTRAINT", "FRICTIONLOSS"), ("dof_frictionloss", "tendon_frictionloss")),
        (springs, ("jnt_stiffness", "tendon_stiffness")),
        (dampers, ("dof_damping", "tendon_damping")),
        (springs and dampers, ("body_gravcomp",)),
        (off("CLAMPCTRL"), ("actuator_ctrllimited",)),
    ):
        for array in arrays if switched_off else ():
            getattr(m, array)[:] = 0
    if springs and dampers:
        m.opt.density = m.opt.viscosity = 0


class _Robot:
    def __init__(self, file: MjcfFile, wishes: Wishes) -> None:
        self.file, self.wishes = file, wishes
        self.m, self.mj, self.writer = file.m, file.mj, file.writer
        self.frames, self.moved, self.named, self.given = file.frames, file.moved, file.named, file.given
        self.meshes = Meshes(wishes)
        self.used: set[str] = set()
        self.lengths: dict[int, str] = {}
        """By tendon."""
        self.stops: list[str] = []
        self.sites = self._asked_sites()
        self.actuators = Actuators(file, self.lengths, self._site)
        self.sign = "~" if self.m.neq and self.m.eq_active0.any() else "="
        """Starts of joints that constraints bind are guesses."""

    # ------------------------------------------------------------ the whole

    def written(self) -> tuple[Writer, Parts]:
        m, say = self.m, self.writer.say
        for joint in range(m.njnt):  # joints keep their names where a body has the same one
            self.named("joint", joint)
        for body in range(1, m.nbody):
            self.named("body", body)
        gravity = tuple(m.opt.gravity.tolist())
        if any(gravity) and not self.file.disabled("GRAVITY"):
            say(f"gravity {vector(gravity, 'm/s^2')};")
        else:
            gravity = (0.0, 0.0, 0.0)
        at = len(self.writer.statements)
        for body in range(m.nbody):
            self._body(body, gravity)
        self._tendons()
        self._equalities()
        self.actuators.write()
        touching = self._contacts(at)
        if self.stops:
            self.writer.statements.insert(
                at,
                'structural parameter Boolean stops = false "whether joints and tendons end at their ranges";',
            )
            self.writer.gap()
            say("if stops then\n" + "\n".join(self.stops) + "\nend if;")
            self.writer.leave_out("the ends of joint ranges, unless stops = true", 0)
        if self.meshes.drawn:
            self.writer.statements.insert(at, "draw none;")
        self._rest()
        self._keyframes()
        self.writer.copies = self.meshes.copies
        return self.writer, {
            "spatial": tuple(part for part in MADE_OF if part in self.used),
            "shapes": touching,
        }

    def _contacts(self, at: int) -> tuple[str, ...]:
        """Write what touches, with the parameter that switches it on among the first statements; returns the kinds of its shapes."""
        if self.file.disabled("CONSTRAINT", "CONTACT"):
            return ()
        contacts = Contacts(self.file)
        contacts.carry()
        if statements := contacts.touching.statements():
            self.writer.statements.insert(at, SWITCH)
            self.writer.gap()
            self.writer.say(statements)
            self.writer.leave_out(
                "contacts, unless contacts = true; they are rigid then, where those of MuJoCo give way",
                0,
            )
        return contacts.touching.used()

    def _rest(self) -> None:
        """List what belongs to no body and is not written."""
        m = self.m
        if (m.opt.density or m.opt.viscosity) and m.geom_fluid.any():
            self.file.leave_out(
                "forces of the fluid on ellipsoids: those on boxes of the same inertia stand for them",
                "option",
            )
        for count, what, tags in (
            (m.nsensor, "sensors", ("sensor",)),
            (m.nflex, "flexible bodies", ("flexcomp", "flex", "deformable")),
            (m.nplugin, "plugins", ("plugin",)),
            (m.nhfield, "height fields", ("hfield",)),
        ):
            if count:
                self.file.leave_out(what, *tags)

    def _keyframes(self) -> None:
        """Write what starts at a keyframe as an experiment."""
        m = self.m
        for key in range(m.nkey):
            given = []
            for joint, name in self.moved.items():
                a, kind = int(m.jnt_qposadr[joint]), int(m.jnt_type[joint])
                q = m.key_qpos[key].tolist()
                if kind in UNITS:
                    value = q[a] - float(m.qpos0[a])
                    said = value or self._start(joint)  # what starts elsewhere
                    given += [f"{name} {self.sign} {quantity(value, UNITS[kind][1])}"] if said else []
                    continue
                turn = a + 3 if kind == FREE else a
                given += [f"{name}.position {self.sign} {vector(q[a : a + 3], 'm')}"] if kind == FREE else []
                orientation = ", ".join(map(number, q[turn : turn + 4]))
                given.append(f"{name}.orientation {self.sign} quat({orientation})")
            for joint, name in self.moved.items():
                given += self._velocities(joint, name, m.key_qvel[key].tolist())
            told = self.actuators.controls, self.actuators.activations
            for names, values in zip(told, (m.key_ctrl[key], m.key_act[key]), strict=True):
                given += [f"{name} = {number(float(values[k]))}" for k, name in names.items() if values[k]]
            self.writer.say(f"experiment {self.named('key', key)}({', '.join([*given, 'stop = 1 s'])});")

    def _velocities(self, joint: int, name: str, v: list[float]) -> list[str]:
        """Return the rates of a joint at a keyframe; what is zero is not there."""
        d, kind = int(self.m.jnt_dofadr[joint]), int(self.m.jnt_type[joint])
        if kind in UNITS:
            return [f"der({name}) {self.sign} {quantity(v[d], UNITS[kind][1] + '/s')}"] if v[d] else []
        turn = d + 3 if kind == FREE else d
        rates = [("position", v[d:turn], "m/s"), ("orientation", v[turn : turn + 3], "rad/s")]
        return [
            f"der({name}.{what}) {self.sign} {vector(rate, unit)}" for what, rate, unit in rates if any(rate)
        ]

    # ------------------------------------------------------------ bodies

    def _body(self, body: int, gravity: Vector) -> None:
        m = self.m
        if body:
            self.writer.gap()
            self._placed(body)
            self._gravity_compensated(body, gravity)
            self._in_fluid(body)
        for geom in range(int(m.body_geomadr[body]), int(m.body_geomadr[body]) + int(m.body_geomnum[body])):
            if int(m.geom_group[geom]) < DRAWN_GROUPS:
                self._draw(body, geom)
        for site in range(m.nsite):
            if int(m.site_bodyid[site]) == body and site in self.sites:
                self._write_site(site)

    def _placed(self, body: int) -> None:
        """Write a body with the joints that carry it."""
        m = self.m
        first, count = int(m.body_jntadr[body]), int(m.body_jntnum[body])
        place, turn = m.body_pos[body].tolist(), m.body_quat[body].tolist()
        pose = turned_by_quaternion(moved(self.frames[int(m.body_parentid[body])], place), turn)
        name = self.named("body", body)
        mass = float(m.body_mass[body])
        inner = f"{name}.a" if mass > 0 else name
        joints = range(first, first + count) if count else range(0)
        if int(m.body_mocapid[body]) >= 0:
            self.writer.leave_out(
                f"that '{name}' is moved from outside: it stays where it is", self.file.line(("body",), name)
            )
        self._mass(body, name, "" if count else pose)
        self.frames[body] = inner
        for joint in joints:
            last = joint == first + count - 1
            to = inner if last else self.writer.name("frame", f"{name}_{joint - first + 1}")
            if not last:
                self.writer.say(f"frame {to};")
            pose = self._joint(joint, body, pose, to)

    def _mass(self, body: int, name: str, place: str) -> None:
        """Write the mass of a body, or a frame without any."""
        m = self.m
        mass = float(m.body_mass[body])
        if not mass > 0:
            self.writer.say(f"frame {name} = {place};" if place else f"frame {name};")
            return
        given = [f"m = {quantity(mass, 'kg')}"]
        centre = m.body_ipos[body].tolist()
        given += [f"com = {vector(centre, 'm')}"] if any(centre) else []
        a, b, c = m.body_inertia[body].tolist()
        inertia: Matrix = ((a, 0.0, 0.0), (0.0, b, 0.0), (0.0, 0.0, c))
        turn = m.body_iquat[body].tolist()
        if any(turn[1:]) and not a == b == c:
            inertia = in_axes(inertia, _rotation(turn))
        given += [f"J = {matrix(inertia, 'kg.m^2')}"] if any((a, b, c)) else []
        given += [f"a = {place}"] if place else []
        self._part("Body", f"Body {name}({', '.join(given)});")

    def _part(self, part: str, statement: str) -> None:
        self.used.add(part)
        self.writer.say(statement)

    def _gravity_compensated(self, body: int, gravity: Vector) -> None:
        share = float(self.m.body_gravcomp[body])
        if share and any(gravity) and float(self.m.body_mass[body]) > 0:
            name = self.named("body", body)
            weight = vector([-share * float(self.m.body_mass[body]) * g for g in gravity], "N")
            self.writer.say(f"force {weight} on {name}.a at {name}.a * {name}.com;")

    def _in_fluid(self, body: int) -> None:
        """Write the forces of the fluid on the box of the same inertia (MuJoCo, "Inertia model" of fluid forces)."""
        m, name = self.m, self.named("body", body)
        mass, density, viscosity = float(m.body_mass[body]), float(m.opt.density), float(m.opt.viscosity)
        if not (density or viscosity) or not mass > 0:
            return
        a, b, c = m.body_inertia[body].tolist()
        x, y, z = (math.sqrt(max(1e-15, one) / mass * 6) for one in (b + c - a, a + c - b, a + b - c))
        across, axes = (y * z, x * z, x * y), (x * (y**4 + z**4), y * (x**4 + z**4), z * (x**4 + y**4))
        size = (x + y + z) / 3
        frame = self.writer.name("frame", f"{name}_in_fluid")
        at = moved(f"{name}.a", m.body_ipos[body].tolist())
        self.writer.say(f"frame {frame} = {turned_by_quaternion(at, m.body_iquat[body].tolist())};")
        wind = m.opt.wind.tolist()
        flow = f"vel({frame}) - {vector(wind, 'm/s')}" if any(wind) else f"vel({frame})"
        speed, spin = (self.writer.name("let", f"{name}_{what}") for what in ("flow", "spin"))
        self.writer.say(f"let {speed} = components({frame}, {flow});")
        self.writer.say(f"let {spin} = components({frame}, angvel({frame}));")
        if viscosity:
            drag = quantity(-3 * math.pi * size * viscosity, "N.s/m")
            turning = quantity(-math.pi * size**3 * viscosity, "N.m.s")
            self.writer.say(f"force {drag}*{speed} on {frame} in {frame};")
            self.writer.say(f"torque {turning}*{spin} on {frame} in {frame};")
        if density:
            for what, of, factors, unit in (
                ("force", speed, [-density / 2 * one for one in across], "kg/m"),
                ("torque", spin, [-density / 64 * one for one in axes], "kg.m^2"),
            ):
                each = ", ".join(
                    f"{quantity(f, unit)}*abs({of}[{k}])*{of}[{k}]" for k, f in enumerate(factors, start=1)
                )
                self.writer.say(f"{what} {{{each}}} on {frame} in {frame};")

    # ------------------------------------------------------------ joints

    def _joint(self, joint: int, body: int, pose: str, to: str) -> str:
        """Write a joint from a pose to the frame that it moves; returns the pose after it."""
        m = self.m
        kind, name = int(m.jnt_type[joint]), self.named("joint", joint)
        at = m.jnt_pos[joint].tolist()
        if kind == FREE:
            self.moved[joint] = name
            place = vector(m.body_pos[body].tolist(), "m")
            start = [f"position {self.sign} {place}"] if any(m.body_pos[body]) else []
            turn = turned_by_quaternion("", m.body_quat[body].tolist()).removeprefix(" * ")
            start += [f"orientation {self.sign} {turn}"] if turn else []
            self._part("Free", f"Free {name}({', '.join([f'world -> {to}', *start])});")
        elif kind == BALL:
            self.moved[joint] = name
            self._part("Spherical", f"Spherical {name}({moved(pose, at)} -> {moved(to, at)});")
        else:
            part = "Revolute" if kind == HINGE else "Prismatic"
            coordinate, unit = UNITS[kind][:2]
            self.moved[joint] = f"{name}.{coordinate}"
            own = [f"axis = {vector(m.jnt_axis[joint].tolist())}"]
            begins = self._start(joint)
            own += [f"{coordinate} {self.sign} {quantity(begins, unit)}", *self._own(joint, kind)]
            self._part(part, f"{part} {name}({moved(pose, at)} -> {moved(to, at)}, {', '.join(own)});")
            line = self.file.line(("joint",), self.given("joint", joint))
            if reference := self.file.reference(joint):
                self.writer.leave_out(
                    f"the zero of '{name}': it counts from its reference, {quantity(reference, unit)}", line
                )
            if begins:
                self.writer.leave_out(
                    f"the zero of '{name}': it lies beyond the range, and the joint starts at {quantity(begins, unit)}",
                    line,
                )
        self._passive(joint, kind, name)
        return to

    def _start(self, joint: int) -> float:
        """Return where a joint of one freedom starts: at zero, or at the nearer end of its range."""
        low, high = self._range(joint) if self.m.jnt_limited[joint] else (0.0, 0.0)
        return min(max(0.0, low), high)

    def _range(self, joint: int) -> tuple[float, float]:
        """Return the ends of the range of a joint of one freedom."""
        zero = self.file.reference(joint)
        low, high = (float(x) - zero for x in self.m.jnt_range[joint])
        return low, high

    def _own(self, joint: int, kind: int) -> list[str]:
        """Return what a joint of one freedom has beside that, as settings; what is zero is not there."""
        m = self.m
        d, a = int(m.jnt_dofadr[joint]), int(m.jnt_qposadr[joint])
        _, unit, force, inertia, resistance, spring = UNITS[kind]
        stiffness = float(m.jnt_stiffness[joint])
        rest = float(m.qpos_spring[a]) - float(m.qpos0[a]) if stiffness else 0.0
        amounts = (
            ("damping", float(m.dof_damping[d]), resistance),
            ("friction", float(m.dof_frictionloss[d]), force),
            ("stiffness", stiffness, spring),
            ("rest", rest, unit),
            ("armature", float(m.dof_armature[d]), inertia),
        )
        return [f"{what} = {quantity(amount, unit)}" for what, amount, unit in amounts if amount]

    def _passive(self, joint: int, kind: int, name: str) -> None:
        """Write what a joint has beside its freedom."""
        m = self.m
        d = int(m.jnt_dofadr[joint])
        armature, damping, friction = (
            float(getattr(m, f"dof_{what}")[d]) for what in ("armature", "damping", "frictionloss")
        )
        stiffness = float(m.jnt_stiffness[joint])
        line = self.file.line(("joint", "freejoint"), self.given("joint", joint))
        for array in ("jnt_stiffnesspoly", "dof_dampingpoly", "jnt_springyield"):
            value = getattr(m, array, None)
            if value is not None and value[d if array.startswith("dof") else joint].any():
                self.writer.leave_out(f"{array.partition('_')[2]} of '{name}'", line)
        if kind in UNITS:
            q, unit = self.moved[joint], UNITS[kind][1]
            if m.jnt_limited[joint]:
                self._stop(name, q, self._range(joint), unit)
            if m.jnt_actfrclimited[joint] and joint not in self.actuators.together:
                self.writer.leave_out(f"the largest force of actuators on '{name}'", line)
            return
        rates = [(f"der({name}.orientation)", "kg.m^2", "N.m.s")]
        rates += [(f"der({name}.position)", "kg", "N.s/m")] if kind == FREE else []
        for rate, inertia, resistance in rates:
            if armature:
                self.writer.say(f"kinetic 1/2*{quantity(armature, inertia)}*dot({rate}, {rate});")
            if damping:
                self.writer.say(f"dissipation 1/2*{quantity(damping, resistance)}*dot({rate}, {rate});")
        if friction or stiffness or m.jnt_limited[joint]:
            self.writer.leave_out(f"friction, stiffness and range of '{name}'", line)

    def _stop(self, name: str, q: str, bounds: Sequence[float], unit: str) -> None:
        upper, lower = (self.writer.name("contact", f"{name}_{end}") for end in ("upper", "lower"))
        self.stops += [
            f"contact {upper}: {quantity(bounds[1], unit)} - {q};",
            f"contact {lower}: {q} - {signed(bounds[0], unit)};",
        ]

    # ------------------------------------------------------------ sites and shapes

    def _asked_sites(self) -> set[int]:
        """Return the sites that have a name, and those that something holds to."""
        m = self.m
        asked = {site for site in range(m.nsite) if self.given("site", site)}
        site = int(self.mj.mjtWrap.mjWRAP_SITE)
        return asked | {int(o) for t, o in zip(m.wrap_type, m.wrap_objid, strict=True) if int(t) == site}

    def _site(self, site: int) -> str:
        """Return the frame of a site, which is written where it was not asked for."""
        if site not in self.sites:
            self.sites.add(site)
            self._write_site(site)
        return self.named("site", site)

    def _write_site(self, site: int) -> None:
        body = self.frames[int(self.m.site_bodyid[site])]
        place = moved(body, self.m.site_pos[site].tolist())
        turned = turned_by_quaternion(place, self.m.site_quat[site].tolist())
        self.writer.say(f"frame {self.named('site', site)} = {turned};")

    def _draw(self, body: int, geom: int) -> None:
        m, shapes = self.m, self.mj.mjtGeom
        kind, size = int(m.geom_type[geom]), m.geom_size[geom].tolist()
        place, turn = m.geom_pos[geom].tolist(), m.geom_quat[geom].tolist()
        material = int(m.geom_matid[geom])
        rgba = (m.mat_rgba[material] if material >= 0 else m.geom_rgba[geom]).tolist()
        colour = "#" + "".join(f"{round(255 * min(max(c, 0.0), 1.0)):02x}" for c in rgba[:3])
        line = self.file.geom_lines[geom]
        if rgba[3] == 0:
            return
        match kind:
            case shapes.mjGEOM_PLANE:
                return
            case shapes.mjGEOM_SPHERE:
                drawn = f"sphere({quantity(size[0], 'm')})"
            case shapes.mjGEOM_BOX:
                drawn = f"box({vector([2 * x for x in size], 'm')})"
            case shapes.mjGEOM_CAPSULE | shapes.mjGEOM_CYLINDER:
                longer = size[0] if kind == shapes.mjGEOM_CAPSULE else 0
                length = quantity(2 * (size[1] + longer), "m")
                drawn = f"cylinder(radius = {quantity(size[0], 'm')}, length = {length}, axis = {{0, 0, 1}})"
            case shapes.mjGEOM_MESH:
                drawn, place, turn = self._mesh(int(m.geom_dataid[geom]), place, turn)
            case _:
                drawn = ""
                self.writer.leave_out("how shapes of other kinds look", line)
        if drawn:
            frame = turned_by_quaternion(moved(self.frames[body], place), turn)
            self.writer.say(f'draw {drawn} on {frame}, colour = "{colour}";')
            self.meshes.drawn = True

    def _mesh(self, mesh: int, place: Vector, turn: Vector) -> tuple[str, Vector, Vector]:
        """Return the drawing of a mesh with the frame of its file: MuJoCo moves meshes to their principal axes."""
        m = self.m
        start = int(m.mesh_pathadr[mesh])
        given = "" if start < 0 else bytes(m.paths[start:]).split(b"\\0")[0].decode()
        folder = next(
            (one.attributes.get("meshdir", "") for one in within(self.file.root) if one.tag == "compiler"), ""
        )
        names = [str(Path(folder) / given), given]
        scale = m.mesh_scale[mesh].tolist()
        file, why = next(
            (found for found in map(self.meshes.found, names) if not found[1]), self.meshes.found(given)
        )
        if not given:
            why = "their vertices stand in the file itself"
        if why:
            if self.wishes.meshes != "none":
                self.writer.leave_out(f"meshes: {why}", self.file.line(("mesh",), self.given("mesh", mesh)))
            return "", place, turn
        own, back = m.mesh_pos[mesh].tolist(), m.mesh_quat[mesh].tolist()
        turn = _times(turn, (back[0], -back[1], -back[2], -back[3]))
        shift = _rotation(turn)
        place = tuple(place[i] - sum(shift[i][k] * own[k] for k in range(3)) for i in range(3))
        return f"mesh({text(file)}, scale = {each_axis(scale)})", place, turn

    # ------------------------------------------------------------ tendons and equalities

    def _tendons(self) -> None:
        m, wraps = self.m, self.mj.mjtWrap
        for tendon in range(m.ntendon):
            start, count = int(m.tendon_adr[tendon]), int(m.tendon_num[tendon])
            kinds, objects, numbers = (
                [x.item() for x in getattr(m, name)[start : start + count]]
                for name in ("wrap_type", "wrap_objid", "wrap_prm")
            )
            name, line = (
                self.named("tendon", tendon),
                self.file.line(("fixed", "spatial"), self.given("tendon", tendon)),
            )
            if kinds[0] == int(wraps.mjWRAP_JOINT):
                if any(int(m.jnt_type[joint]) not in UNITS for joint in objects):
                    self.writer.leave_out(f"the tendon '{name}' on a joint of several freedoms", line)
                    continue
                length = " + ".join(
                    f"{quantity(factor, 'm/rad' if int(m.jnt_type[joint]) == HINGE else '1').removesuffix(' 1')}*{self.moved[joint]}"
                    for joint, factor in zip(objects, numbers, strict=True)
                ).replace("+ -", "- ")
                if offset := sum(
                    factor * self.file.reference(joint)
                    for joint, factor in zip(objects, numbers, strict=True)
                ):
                    length += f" + {signed(offset, 'm')}"
            elif set(kinds) <= {int(wraps.mjWRAP_SITE), int(wraps.mjWRAP_PULLEY)}:
                length = self._along_sites(kinds, objects, numbers)
            else:
                self.writer.leave_out(f"the tendon '{name}': it wraps round a shape", line)
                continue
            self.writer.gap()
            self.writer.say(f"let Length {name} = {length};")
            self.lengths[tendon] = name
            self._tendon_forces(tendon, name, line)

    def _along_sites(self, kinds: list[int], objects: list[int], numbers: list[float]) -> str:
        site = int(self.mj.mjtWrap.mjWRAP_SITE)
        pieces, share = [], 1.0
        for k in range(len(kinds) - 1):
            if kinds[k] != site:
                share = numbers[k]
            elif kinds[k + 1] == site:
                ends = (f"pos({self.named('site', objects[i])})" for i in (k, k + 1))
                pieces.append(f"norm({' - '.join(ends)})" + (f"/{number(share)}" if share != 1 else ""))
        return " + ".join(pieces)

    def _tendon_forces(self, tendon: int, name: str, line: int) -> None:
        m, say = self.m, self.writer.say
        low, high = m.tendon_lengthspring[tendon].tolist()
        if stiffness := float(m.tendon_stiffness[tendon]):
            stretch = f"{name} - {signed(low, 'm')}" if low else name
            if low != high:
                stretch = f"{name} - clamp({name}, {quantity(low, 'm')}, {quantity(high, 'm')})"
            say(f"potential 1/2*{quantity(stiffness, 'N/m')}*({stretch})^2;")
        if damping := float(m.tendon_damping[tendon]):
            say(f"damping {quantity(damping, 'N.s/m')} on {name};")
        if friction := float(m.tendon_frictionloss[tendon]):
            say(f"friction {quantity(friction, 'N')} on {name};")
        if m.tendon_limited[tendon]:
            self._stop(name, name, m.tendon_range[tendon].tolist(), "m")
        for what in ("armature", "stiffnesspoly", "dampingpoly", "springyield", "actfrclimited"):
            value = getattr(m, f"tendon_{what}", None)
            if value is not None and value[tendon].any():
                self.writer.leave_out(f"{what} of the tendon '{name}'", line)

    def _equalities(self) -> None:
        m, kinds = self.m, self.mj.mjtEq
        for k in range(m.neq):
            one, other, data = int(m.eq_obj1id[k]), int(m.eq_obj2id[k]), m.eq_data[k].tolist()
            name = self.named("equality", k)
            kind = int(m.eq_type[k])
            tag = self.mj.mjtEq(kind).name.removeprefix("mjEQ_").lower()
            line = self.file.line((tag,), self.given("equality", k))
            line = line or (lines[0] if len(lines := self.file.lines(tag)) == 1 else 0)
            if not m.eq_active0[k]:
                self.writer.leave_out(f"the equality '{name}', which is not active", line)
                continue
            of_bodies = int(m.eq_objtype[k]) == int(self.mj.mjtObj.mjOBJ_BODY)
            self.writer.gap()
            match kind:
                case kinds.mjEQ_JOINT if int(m.jnt_type[one]) in UNITS:
                    said = self._joint_equality(name, one, other, data)
                case kinds.mjEQ_TENDON if {one, other} - {-1} <= self.lengths.keys():
                    said = self._tendon_equality(name, one, other, data)
                case kinds.mjEQ_CONNECT:
                    ends = self._points(one, other, data, of_bodies=of_bodies)
                    said = f"constraint {name}: pos({ends[0]}) = pos({ends[1]});"
                case kinds.mjEQ_WELD if of_bodies:
                    self.used.add("Weld")
                    first = turned_by_quaternion(moved(self.frames[one], data[3:6]), _unit(data[6:10]))
                    said = f"cut Weld {name}({first} -> {moved(self.frames[other], data[0:3])});"
                case kinds.mjEQ_WELD:
                    self.used.add("Weld")
                    said = f"cut Weld {name}({self.named('site', one)} -> {self.named('site', other)});"
                case _:
                    self.writer.leave_out(f"the equality '{name}' of the kind {tag}", line)
                    continue
            self.writer.say(said)
            self.writer.leave_out("that equalities give way: they hold exactly", line)

    def _points(self, one: int, other: int, data: list[float], *, of_bodies: bool) -> tuple[str, str]:
        if not of_bodies:
            return self.named("site", one), self.named("site", other)
        return (
            f"{self.frames[one]} * {vector(data[:3], 'm')}",
            f"{self.frames[other]} * {vector(data[3:6], 'm')}",
        )

    def _joint_equality(self, name: str, one: int, other: int, data: list[float]) -> str:
        m = self.m
        unit = UNITS[int(m.jnt_type[one])][1]
        if other < 0:
            return f"constraint {name}: {self.moved[one]} = {quantity(data[0], unit)};"
        by = UNITS[int(m.jnt_type[other])][1]
        powers = [quantity(data[0], unit)] if data[0] else []
        for k, factor in enumerate(data[1:5], start=1):
            if factor:
                ratio = "" if unit == by and k == 1 else f" {unit}/{by}" + (f"^{k}" if k > 1 else "")
                powers.append(f"{number(factor)}{ratio}*{self.moved[other]}" + (f"^{k}" if k > 1 else ""))
        return f"constraint {name}: {self.moved[one]} = {' + '.join(powers) or quantity(0, unit)};"

    def _tendon_equality(self, name: str, one: int, other: int, data: list[float]) -> str:
        rest = float(self.m.tendon_length0[one])
        left = f"{self.lengths[one]} - {signed(rest, 'm')}"
        right = quantity(data[0], "m")
        if other >= 0:
            stretch = f"({self.lengths[other]} - {signed(float(self.m.tendon_length0[other]), 'm')})"
            for k, factor in enumerate(data[1:5], start=1):
                if factor:
                    ratio = "" if k == 1 else f" m/m^{k}"
                    right += f" + {number(factor)}{ratio}*{stretch}" + (f"^{k}" if k > 1 else "")
        return f"constraint {name}: {left} = {right};"


def _unit(q: Sequence[float]) -> Vector:
    size = math.sqrt(sum(x * x for x in q))
    return tuple(x / size for x in q)


def _rotation(q: Sequence[float]) -> Matrix:
    """Return the matrix of a quaternion, its real part first."""
    w, x, y, z = q
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )


def _times(a: Sequence[float], b: Sequence[float]) -> Vector:
    """Return the product of two quaternions."""
    w, x, y, z = a
    s, p, q, r = b
    return (
        w * s - x * p - y * q - z * r,
        w * p + x * s + y * r - z * q,
        w * q - x * r + y * s + z * p,
        w * r + x * q - y * p + z * s,
    )
