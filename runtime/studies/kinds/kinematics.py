"""How a point moves, in curvilinear and path components, and what a rotation is: axis and angle, Euler angles of twelve kinds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...case import Case, inputs_at
from ...interface import array_of
from ...outcome import Outcome, SimulationError
from ...problem import Array, Problem
from ...settings import Place, settable
from ...tangent.coordinates import basis
from ..findings import Cell, Curve, Findings, Panel, Table
from ..formulas.combination import Track, ended_early, tracked
from ..study import Study
from .symmetries import case_of

EULER = ("ZXZ", "ZYZ", "XYX", "XZX", "YXY", "YZY", "XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")
"""The twelve kinds: axes of the turned body, in their order (intrinsic); lists begin with that of most textbooks."""

STEP = 1e-3
"""Of the time in which a state changes by its size: step of the differences that give accelerations."""

RIGHT = 1e-9
"""How far a matrix may be from a rotation."""

Vector = tuple[str, tuple[int, ...]]


class Kinematics(Study, frozen=True, kw_only=True):
    """Degrees of freedom; position, velocity and acceleration of points (outputs of two or three numbers) in Cartesian, polar, cylindrical,
    spherical and path components, with their Jacobians by the velocities; rotations (coordinates, and outputs that are matrices: of these the
    angular velocity by the velocities)."""

    unused = frozenset({"every", "estimate_error"})
    needs = frozenset({"phase"})
    of: Annotated[
        tuple[str, ...], settable("Outputs that are points or rotation matrices (default: all).", "names")
    ] = ()
    at: Annotated[Place, settable("Where: start, or the start with other values.", "place")] = Place()

    def solve(self, problem: Problem) -> Findings:
        """Look at the state. Raises SimulationError where there is nothing to look at."""
        case = case_of(problem, self)
        y = _placed(case, self.at)
        names = [q.name for q in problem.phase if q.kind == "output"]
        listed = [name for name in names if not self.of or name in self.of]
        points = _vectors(listed, problem)
        matrices = _matrices(listed, problem)
        turned = list(problem.rotations)
        if self.of and not points and not matrices:
            raise SimulationError(
                f"'{problem.name}' has no point and no rotation among its outputs {', '.join(self.of)}",
                help="write 'output tip = pos(body.b);', a vector of two or three lengths",
            )
        state = _State(case, y)
        tables: list[Table] = []
        details: dict[str, Any] = {
            "points": {},
            "rotations": {},
            "freedoms": problem.nv - len(problem.constraints),
            "velocities": [q.name for q in problem.states[problem.nq : problem.nq + problem.nv]],
        }
        for name, places in points:
            found = state.point(places)
            tables.append(_point_table(name, found))
            details["points"][name] = {
                kind: {n: _list(v) for n, v in parts.items()} for kind, parts in found.items()
            }
        rotations = {
            problem.states[i].name.removesuffix("[1]"): Rotation.from_quat(
                np.roll(y[i : i + 4], -1)
            ).as_matrix()
            for i in turned
        }
        rotations |= {name: state.values[list(places)].reshape(3, 3) for name, places in matrices}
        for name, matrix in rotations.items():
            told = rotation_of(matrix)
            if told is None:
                continue
            tables.append(_rotation_table(name, told))
            own = dict(matrices).get(name)
            if own is not None:
                told["jacobian"] = state.turning(own).tolist()
            details["rotations"][name] = told
        freedoms = _counted(details["freedoms"], "degree") + " of freedom"
        velocities = "1 velocity" if problem.nv == 1 else f"{problem.nv} velocities"
        track = tracked(case, self) if points else None
        remarks = [
            *ended_early(track),
            f"{freedoms}: {velocities}, {_counted(len(problem.constraints), 'constraint')}",
        ]
        shown = f"{_counted(len(points), 'point')}, {_counted(len(details['rotations']), 'rotation')}"
        return Findings(
            study="kinematics",
            model=problem.name,
            outcome=Outcome.COMPLETED,
            message=shown if tables else freedoms,
            errors_from="positions, velocities and Jacobians are exact to rounding; accelerations by differences of sixth order",
            remarks=tuple(remarks),
            tables=tuple(tables),
            panels=_paths(track, points),
            details=details,
        )


def _counted(n: int, word: str) -> str:
    return f"{n} {word}{'' if n == 1 else 's'}"


class _State:
    """The outputs at a state, their rates, and the rates of these."""

    def __init__(self, case: Case, y: Array) -> None:
        self.case, self.y = case, y
        problem, functions = case.problem, case.functions
        assert functions.phase is not None and functions.phase_rate is not None, "the part phase"
        assert functions.phase_gradient is not None
        self.u = inputs_at(case, case.begin)
        around = (self.u, case.z, case.p)
        t = case.begin
        self.values = functions.phase(t, y, *around)
        self.rates = functions.phase_rate(t, y, *around)
        rate = functions.rhs(t, y, *around)
        size = np.abs(rate) / np.maximum(np.abs(y), 1.0)
        dt = STEP / max(float(size.max(initial=0.0)), 1.0)
        weights = {1: 45.0, 2: -9.0, 3: 1.0}
        slope = np.zeros_like(self.rates)
        for k, weight in weights.items():  # along the motion to second order: outputs know no more
            ahead = functions.phase_rate(t + k * dt, self._along(k * dt, rate), *around)
            behind = functions.phase_rate(t - k * dt, self._along(-k * dt, rate), *around)
            slope += weight * (ahead - behind)
        self.second = slope / (60 * dt)
        width = problem.nq + problem.nv
        by_coordinates = functions.phase_gradient(t, y, *around).reshape(-1, width)[:, : problem.nq]
        self.jacobian = by_coordinates @ basis(problem, y)[: problem.nq, : problem.nv]

    def turning(self, places: Sequence[int]) -> Array:
        """Return [3, nv]: the angular velocity of a rotation matrix, in the axes of the world, by the velocities."""
        matrix = self.values[list(places)].reshape(3, 3)
        rates = np.moveaxis(self.jacobian[list(places)].reshape(3, 3, -1), 2, 0) @ matrix.T
        return np.array([rates[:, 2, 1], rates[:, 0, 2], rates[:, 1, 0]])

    def _along(self, dt: float, rate: Array) -> Array:
        """Return the state a time ahead, by the classical method of fourth order."""
        case, f = self.case, self.case.functions.rhs
        around = (self.u, case.z, case.p)
        t = case.begin
        k2 = f(t + dt / 2, self.y + dt / 2 * rate, *around)
        k3 = f(t + dt / 2, self.y + dt / 2 * k2, *around)
        k4 = f(t + dt, self.y + dt * k3, *around)
        result: Array = self.y + dt / 6 * (rate + 2 * k2 + 2 * k3 + k4)
        return result

    def point(self, places: Sequence[int]) -> dict[str, dict[str, Array | float]]:
        """Return a point's position, velocity, acceleration and Jacobian, in all components."""
        k = list(places)
        r, v, a = self.values[k], self.rates[k], self.second[k]
        found: dict[str, dict[str, Array | float]] = {
            "cartesian": {"position": r, "velocity": v, "acceleration": a, "jacobian": self.jacobian[k]}
        }
        found |= curvilinear(r, v, a)
        return found


def curvilinear(r: Array, v: Array, a: Array) -> dict[str, dict[str, Array | float]]:
    """Return velocity and acceleration in polar or cylindrical, spherical and path components.

    Directions are e_rho, e_phi(, e_z); e_r, e_theta (from z), e_phi; tangent and normal.
    """
    found: dict[str, dict[str, Array | float]] = {}
    rho = math.hypot(r[0], r[1])
    phi = math.atan2(r[1], r[0])
    radial, around = np.array([math.cos(phi), math.sin(phi)]), np.array([-math.sin(phi), math.cos(phi)])
    if len(r) == 2:
        axes = np.array([radial, around])
        found["polar"] = {"place": np.array([rho, phi]), "velocity": axes @ v, "acceleration": axes @ a}
    else:
        e_rho, e_phi, e_z = np.array([*radial, 0.0]), np.array([*around, 0.0]), np.array([0.0, 0.0, 1.0])
        axes = np.array([e_rho, e_phi, e_z])
        found["cylindrical"] = {
            "place": np.array([rho, phi, r[2]]),
            "velocity": axes @ v,
            "acceleration": axes @ a,
        }
        theta = math.atan2(rho, r[2])
        e_r = math.sin(theta) * e_rho + math.cos(theta) * e_z
        e_theta = math.cos(theta) * e_rho - math.sin(theta) * e_z
        axes = np.array([e_r, e_theta, e_phi])
        found["spherical"] = {
            "place": np.array([math.hypot(rho, r[2]), theta, phi]),
            "velocity": axes @ v,
            "acceleration": axes @ a,
        }
    speed = float(np.linalg.norm(v))
    if speed > 0:
        along = float(a @ v) / speed
        across = float(np.linalg.norm(a - along * v / speed))
        radius = speed**2 / across if across > 1e-12 * max(float(np.linalg.norm(a)), 1e-300) else math.inf
        found["path"] = {"speed": speed, "tangential": along, "normal": across}
        if math.isfinite(radius):
            found["path"]["radius"] = radius
    return found


def rotation_of(matrix: Array) -> dict[str, Any] | None:
    """Return axis, angle, quaternion, Cayley-Klein parameters and twelve kinds of Euler angles; None for no rotation.

    The matrix turns components in the body into those of the world (active); that of a change of axes (passive) is its
    transposed, with the opposite angle about the same axis.
    """
    if np.abs(matrix @ matrix.T - np.eye(3)).max() > RIGHT or np.linalg.det(matrix) < 0:
        return None
    rotation = Rotation.from_matrix(matrix)
    vector = rotation.as_rotvec()
    angle = float(np.linalg.norm(vector))
    axis = vector / angle if angle > 0 else np.array([0.0, 0.0, 1.0])
    x, y, z, w = rotation.as_quat()
    if w < 0:
        w, x, y, z = -w, -x, -y, -z
    euler: dict[str, list[float]] = {}
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a gimbal that is locked one angle is chosen to be zero
        for kind in EULER:
            euler[kind] = [float(part) for part in rotation.as_euler(kind)]
    return {
        "matrix": matrix.tolist(),
        "axis": axis.tolist(),
        "angle": angle,
        "quaternion": [float(w), float(x), float(y), float(z)],
        "cayley_klein": {"alpha": [float(w), float(z)], "beta": [float(y), float(x)]},
        "euler": euler,
    }


def _placed(case: Case, at: Place) -> Array:
    problem = case.problem
    y = case.y0.copy()
    names = [state.name for state in problem.states]
    if at.word != "start":
        raise SimulationError(
            "kinematics are those of the start, or of the start with other values", help="--at 'q = 1'"
        )
    for name, value in at.values.items():
        if name not in names:
            raise SimulationError(f"'{name}' is neither a coordinate nor a rate of '{problem.name}'")
        y[names.index(name)] = value
    return y


def _groups(names: Sequence[str], problem: Problem) -> dict[str, list[int]]:
    places = {q.name: k for k, q in enumerate(problem.phase) if q.kind == "output"}
    groups: dict[str, list[int]] = {}
    for name in names:
        head, subscripts = array_of(name)
        if subscripts:
            groups.setdefault(head, []).append(places[name])
    return groups


def _vectors(names: Sequence[str], problem: Problem) -> list[Vector]:
    return [(name, tuple(k)) for name, k in _groups(names, problem).items() if len(k) in (2, 3)]


def _matrices(names: Sequence[str], problem: Problem) -> list[Vector]:
    return [(name, tuple(k)) for name, k in _groups(names, problem).items() if len(k) == 9]


def _list(value: Array | float) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else float(value)


def _point_table(name: str, found: dict[str, dict[str, Array | float]]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for kind, parts in found.items():
        for what, value in parts.items():
            if what == "jacobian":
                continue
            numbers = [float(x) for x in np.atleast_1d(value)]
            cells: list[Cell] = [*numbers, *([""] * (3 - len(numbers)))]
            rows.append((kind, what, *cells))
    return Table(f"{name}, SI", (("components", ""), ("", ""), ("1", ""), ("2", ""), ("3", "")), tuple(rows))


def _rotation_table(name: str, told: dict[str, Any]) -> Table:
    rows: list[tuple[Cell, ...]] = [
        ("axis", *told["axis"]),
        ("angle [rad]", told["angle"], "", ""),
        ("quaternion w; x, y, z", told["quaternion"][0], "", ""),
        ("", *told["quaternion"][1:]),
    ]
    rows += [(f"Euler {kind} [rad]", *angles) for kind, angles in told["euler"].items()]
    return Table(f"rotation {name}", (("", ""), ("1", ""), ("2", ""), ("3", "")), tuple(rows))


def _paths(track: Track | None, points: Sequence[Vector]) -> tuple[Panel, ...]:
    """Draw the paths of the points along a run, if something says when to stop."""
    if track is None:
        return ()
    curves = [Curve(name, track.phase[:, k[0]], track.phase[:, k[1]]) for name, k in points]
    return (Panel("paths", "x", "m", "y", "m", tuple(curves), equal=True),)
