"""Functions of robots from C: mechc's, Pinocchio's in C++ and CasADi's generated code, from the same files in URDF.

``MECHC_PEERS`` names the Python of an environment with pin, example-robot-data and casadi (bench/peers/README.md). Contestants that it
lacks are left out; without it there are no robots. All are called in one process in turn, at random states one after the other.
"""

from __future__ import annotations

import ctypes
import json
import os
import subprocess
import tempfile
import time
from collections.abc import Callable
from ctypes import CDLL, c_char_p, c_double, c_int, c_long, c_void_p
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import Struct

from mechc.runtime.native.build import build_shared

from .machine import table, write
from .peer_builds import PEERS, built, packages
from .robots_sweep import Ours, frame_of

STATES = 64
ROUNDS = 15
BATCH = 2e-3
"""Seconds of one batch, about."""
DATA = "cmeel.prefix/share/example-robot-data/robots"
ROBOTS = {
    "UR5": (f"{DATA}/ur_description/urdf/ur5_robot.urdf", False),
    "xArm 7": (f"{DATA}/xarm_description/urdf/xarm7.urdf", False),
    "Solo 12": (f"{DATA}/solo_description/robots/solo12.urdf", True),
    "ANYmal C": (f"{DATA}/anymal_c_simple_description/urdf/anymal.urdf", True),
    "Talos": (f"{DATA}/talos_data/robots/talos_reduced.urdf", True),
    "rodent": ("dm_control/locomotion/walkers/assets/rodent.xml", False),
    "Centauro": (f"{DATA}/centauro_description/urdf/centauro.urdf", True),
}
"""Files of example-robot-data and dm_control; whether the root of a URDF moves freely."""
ABA, CRBA, RNEA, JACOBIAN = (0, 1), (3, 4), (2,), (5,)
"""What ``pinocchio_functions.cpp`` calls them, in the convention of the joints and that of the world."""
FUNCTIONS = {"accelerations": ABA, "inverse_dynamics": RNEA, "mass_matrix": CRBA, "jacobian": JACOBIAN}
CASADI = {"accelerations": "aba", "inverse_dynamics": "rnea"}
FLAGS = ("-march=native", "-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math", "-fPIC")
LEVELS = ("-O1", "-O3")
LONG = 500_000
"""Characters of C beyond which only the first level is tried: the others take minutes."""
CALLER = """
#include <time.h>
typedef int function(const double **, double **, long long *, double *, int);
int aba(const double **, double **, long long *, double *, int), rnea(const double **, double **, long long *, double *, int);
int aba_work(long long *, long long *, long long *, long long *), rnea_work(long long *, long long *, long long *, long long *);
static double work[1 << 20], out[1 << 10];
static double seconds(void) { struct timespec t; clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t); return t.tv_sec + 1e-9*t.tv_nsec; }
static void call(function *f, const double *y, int nq, int nv)
{
    const double *given[] = {y, y + nq, y + nq + nv};
    double *results[] = {out};
    f(given, results, 0, work, 0);
}
__attribute__((visibility("default"))) const double *result_of(int which, const double *y, int nq, int nv)
{
    long long sizes[4];
    (which ? rnea_work : aba_work)(sizes, sizes + 1, sizes + 2, sizes + 3);
    if (sizes[3] > 1 << 20 || nv > 1 << 10) return 0;
    call(which ? rnea : aba, y, nq, nv);
    return out;
}
__attribute__((visibility("default"))) double time_of(int which, const double *y, int nq, int nv, int states, long calls)
{
    function *f = which ? rnea : aba;
    const double begun = seconds();
    for (long k = 0; k < calls; k++) call(f, y + (k % states)*(nq + 2*nv), nq, nv);
    return seconds() - begun;
}
"""

OURS = """
#include <time.h>
typedef void function(double, const double *, const double *, const double *, const double *, double *);
static double seconds(void) { struct timespec t; clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t); return t.tv_sec + 1e-9*t.tv_nsec; }
__attribute__((visibility("default"))) double time_of(function *f, const double *y, int ny, const double *u, const double *z,
                                                      int nz, const double *p, double *out, int states, long calls)
{
    const double begun = seconds();
    for (long k = 0; k < calls; k++) f(0, y + (k % states)*ny, u, z + (k % states)*nz, p, out);
    return seconds() - begun;
}
"""

Timed = Callable[[int], float]
"""Processor seconds of so many calls."""


class Robot(Struct, frozen=True, eq=False):
    """A robot as Pinocchio numbers it: its text of numbers, joints, and states [STATES, nq + 2 nv] of positions, velocities and
    what a function gets beside them."""

    text: str
    joints: list[str]
    link: str
    """What the last joint carries."""
    armature: list[float]
    """Inertia of rotors on each velocity; neither Pinocchio nor CasADi get it."""
    floating: bool
    states: Any

    @property
    def nv(self) -> int:
        return len(self.joints) + 5 * self.floating

    @property
    def nq(self) -> int:
        return self.nv + self.floating


def read(python: str, path: Path, floating: bool, random: np.random.Generator) -> Robot:
    words = [python, str(PEERS / "robot_numbers.py"), str(path), "floating" if floating else "fixed"]
    said = json.loads(subprocess.run(words, capture_output=True, text=True, check=True).stdout)
    nv = len(said["joints"]) + 5 * floating
    states = random.uniform(-1, 1, (STATES, 3 * nv + floating))
    if floating:
        states[:, 3:7] /= np.linalg.norm(states[:, 3:7], axis=1, keepdims=True)
    return Robot(**said, floating=floating, states=states)


# ---------------------------------------------------------------- the contestants


class Mechc:
    """The functions of the imported file, by the C compiler of this machine."""

    def __init__(self, path: Path, robot: Robot, random: np.random.Generator) -> None:
        self.ours = Ours(path, "--meshes", "none", *(["--floating"] if robot.floating else []))
        f = self.ours.f = self.ours.f.faster()
        assert self.ours.nv == robot.nv, f"{path}: {self.ours.nv} and {robot.nv} freedoms"
        self.robot, nq = robot, self.ours.nq
        self.bare = path.suffix == ".urdf"  # without springs and tendons
        y = np.tile(f.start, (STATES, 1))
        y[:, : nq + robot.nv] = random.uniform(-1, 1, (STATES, nq + robot.nv))
        a = random.uniform(-1, 1, (STATES, robot.nv))
        self.y, self.a = y, a
        for joint, at, _ in self.places():
            if joint is None:
                y[:, at] /= np.linalg.norm(y[:, at], axis=1, keepdims=True)
        self.jacobian = frame_of(f, self.ours.name("link" if self.bare else "body", robot.link)).jacobian

    def places(self) -> Any:
        """Yield each joint of Pinocchio, None for an orientation, with its numbers in our states and velocities."""
        for k, joint in enumerate(self.robot.joints):
            name = self.ours.name("joint", joint)
            if k == 0 and self.robot.floating:
                yield "", *self.ours.places(f"{name}.position")
                yield None, *self.ours.places(f"{name}.orientation")
            else:
                angle = f"{name}.angle" in self.ours.states
                yield joint, *self.ours.places(f"{name}.{'angle' if angle else 'position'}")

    def timed(self, name: str) -> Timed:
        """Call a function of the model directly, and one of a frame by arrays of states."""
        if name == "jacobian":
            return self._in_arrays
        bound, y = self.ours.f._bound, self.y
        library = CDLL(str(build_shared({"calls.c": OURS}, ("-O2", "-fPIC"), name="bench")))
        library.time_of.restype = c_double
        library.time_of.argtypes = [
            c_void_p,
            c_void_p,
            c_int,
            *[c_void_p] * 2,
            c_int,
            *[c_void_p] * 2,
            c_int,
            c_long,
        ]
        z = np.hstack([np.tile(bound.z, (STATES, 1)), self.a])
        u, p, out = (
            np.zeros(len(self.ours.inputs) + 1),
            np.ascontiguousarray(bound.site.p),
            np.zeros(self.robot.nv**2),
        )
        at = [array.ctypes.data for array in (y, u, z, p, out)]
        sizes = y.shape[1], z.shape[1]

        def seconds(count: int, held: object = (y, u, z, p, out)) -> float:
            address = bound.address(name)
            return float(
                library.time_of(address, at[0], sizes[0], at[1], at[2], sizes[1], *at[3:], STATES, count)
            )

        return seconds

    def _in_arrays(self, count: int) -> float:
        begun = time.process_time()
        for _ in range(count // STATES):
            self.jacobian(self.y)
        return time.process_time() - begun

    def at_rest(self, states: Any) -> tuple[Any, Any, list[int]]:
        """Return our states and accelerations where those of Pinocchio rest, and the order of our velocities in theirs."""
        robot = self.robot
        y, a = np.tile(self.ours.f.start, (len(states), 1)), np.zeros((len(states), robot.nv))
        order: list[int] = []
        q = 0
        for joint, at, speeds in self.places():
            theirs = states[:, q : q + len(at)]
            y[:, at] = np.roll(theirs, 1, axis=1) if joint is None else theirs
            q += len(at)
            order += speeds
        given = states[:, robot.nq + robot.nv :]
        a[:, order] = given
        return y, a, order


class Pinocchio:
    def __init__(self, library: CDLL, robot: Robot) -> None:
        library.robot_of.restype = c_void_p
        library.robot_of.argtypes = [c_char_p]
        library.result_of.argtypes = [c_void_p, c_int, c_void_p, c_void_p]
        library.time_of.restype = c_double
        library.time_of.argtypes = [c_void_p, c_int, c_void_p, c_int, c_long]
        self._library, self.robot, self._held = library, robot, robot.text.encode()
        self._at = library.robot_of(self._held)

    def result(self, function: int, state: Any) -> Any:
        nv, state = self.robot.nv, np.ascontiguousarray(state)
        out = np.zeros({3: nv * nv, 4: nv * nv, 5: 6 * nv}.get(function, nv))
        self._library.result_of(self._at, function, state.ctypes.data, out.ctypes.data)
        return out

    def timed(self, function: int) -> Timed:
        states = self.robot.states
        return lambda count: self._library.time_of(self._at, function, states.ctypes.data, STATES, count)


class CasADi:
    """Forward and inverse dynamics in C, compiled with some level of optimisation."""

    def __init__(self, code: str, level: str, robot: Robot) -> None:
        self._library = CDLL(str(build_shared({"robot.c": code + CALLER}, (level, *FLAGS), name="bench")))
        self._library.result_of.restype = ctypes.POINTER(c_double)
        self._library.result_of.argtypes = [c_int, c_void_p, c_int, c_int]
        self._library.time_of.restype = c_double
        self._library.time_of.argtypes = [c_int, c_void_p, c_int, c_int, c_int, c_long]
        self.robot = robot

    def result(self, name: str, state: Any) -> Any:
        robot, state = self.robot, np.ascontiguousarray(state)
        found = self._library.result_of(name == "rnea", state.ctypes.data, robot.nq, robot.nv)
        return np.ctypeslib.as_array(found, (robot.nv,)).copy()

    def timed(self, name: str) -> Timed:
        robot, at = self.robot, self.robot.states.ctypes.data
        return lambda count: self._library.time_of(name == "rnea", at, robot.nq, robot.nv, STATES, count)


def written_by_casadi(python: str, robot: Robot) -> str:
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "robot.c")
        words = [python, str(PEERS / "casadi_functions.py"), str(out)]
        subprocess.run(words, input=robot.text, text=True, check=True)
        return out.read_text(encoding="utf-8")


# ---------------------------------------------------------------- measurements


def agree(mechc: Mechc, pinocchio: Pinocchio, casadi: list[CasADi]) -> None:
    """Fail unless CasADi's code gives what Pinocchio gives in motion, and ours what it gives at rest.

    In motion free bodies have other velocities in both; ``bench.robots_sweep`` compares that, and more.
    """
    robot = mechc.robot
    for state in robot.states[:3]:
        for law, function in (("aba", ABA[0]), ("rnea", RNEA[0])):
            exact = pinocchio.result(function, state)
            for one in casadi:
                assert np.abs(one.result(law, state) - exact).max() < 1e-9 * np.abs(exact).max(), law
    still = robot.states[:3].copy()
    still[:, robot.nq : robot.nq + robot.nv] = 0
    if robot.floating:
        still[:, 3:7] = (0, 0, 0, 1)
    y, a, order = mechc.at_rest(still)
    f = mechc.ours.f
    for k, state in enumerate(still):
        mass = pinocchio.result(CRBA[0], state)
        upper = np.triu(mass.reshape(robot.nv, robot.nv).T)
        M = f.mass_matrix(y[k])[np.ix_(order, order)]
        rotors = np.diag(robot.armature)
        assert np.abs(np.triu(M) - upper - rotors).max() < 1e-9 * np.abs(upper).max(), "mass matrix"
        if not mechc.bare:
            continue
        torques, ours = pinocchio.result(RNEA[0], state), f.inverse_dynamics(y[k], a[k])[order]
        assert np.abs(ours - torques).max() < 1e-9 * np.abs(torques).max(), "inverse dynamics"
        state[robot.nq + robot.nv :] = 0
        exact = pinocchio.result(ABA[0], state)
        found = f.accelerations(y[k])[order]
        balance = np.abs(M @ (found - exact)).max()
        assert balance < 1e-9 * np.abs(M @ exact).max(), "accelerations"


def nanoseconds(contestants: dict[str, Timed], rounds: int) -> dict[str, float]:
    """Least processor time of one call of each, in turn."""
    counts = {}
    for name, seconds in contestants.items():
        count = STATES
        while seconds(count) < BATCH / 2:
            count *= 2
        counts[name] = count
    best = dict.fromkeys(contestants, float("inf"))
    for _ in range(rounds):
        for name, seconds in contestants.items():
            best[name] = min(best[name], seconds(counts[name]) / counts[name] * 1e9)
    return best


def library_of_pinocchio(python: str | None) -> CDLL | None:
    """Load Pinocchio's functions, compiled for this processor from its headers alone; None where they cannot be."""
    if python is None:
        return None
    try:
        flags = ("-O3", "-march=native", "-fPIC", "-shared")
        return CDLL(str(built(python, "pinocchio_functions", *flags, link=False)))
    except (subprocess.CalledProcessError, OSError) as error:
        print(f"without Pinocchio: {error}", flush=True)
        return None


def rows_of(
    name: str, path: Path, floating: bool, python: str, library: CDLL | None, rounds: int
) -> dict[str, list[str]]:
    random = np.random.default_rng(1)
    robot = read(python, path, floating, random)
    mechc = Mechc(path, robot, random)
    casadi: list[CasADi] = []
    try:
        code = written_by_casadi(python, robot)
        levels = LEVELS if len(code) < LONG else LEVELS[:1]
        casadi = [CasADi(code, level, robot) for level in levels]
    except subprocess.CalledProcessError as error:
        print(f"without CasADi: {error}", flush=True)
    pinocchio = None if library is None else Pinocchio(library, robot)
    if pinocchio is not None:
        agree(mechc, pinocchio, casadi)
    rows = {}
    for function, theirs in FUNCTIONS.items():
        contestants = {"mechc": mechc.timed(function)}
        if pinocchio is not None:
            contestants |= {f"Pinocchio {k}": pinocchio.timed(k) for k in theirs}
        if function in CASADI:
            contestants |= {f"CasADi {k}": one.timed(CASADI[function]) for k, one in enumerate(casadi)}
        found = nanoseconds(contestants, rounds)
        ours, *others = (
            min((value for key, value in found.items() if key.startswith(word)), default=float("inf"))
            for word in ("mechc", "Pinocchio", "CasADi")
        )
        cells = ["-" if value == float("inf") else f"{value:.0f}" for value in (ours, *others)]
        ratio = "-" if min(others) == float("inf") else f"{ours / min(others):.2f}"
        rows[function] = [name, str(robot.nv), *cells, ratio]
        print(function, *rows[function], flush=True)
    return rows


def main(quick: bool = False) -> None:
    python = os.environ.get("MECHC_PEERS")
    rounds = 5 if quick else ROUNDS
    rows: dict[str, list[list[str]]] = {function: [] for function in FUNCTIONS}
    if python is not None:
        site, library = packages(python), library_of_pinocchio(python)
        for name, (file, floating) in list(ROBOTS.items())[: 3 if quick else None]:
            if (site / file).is_file():
                for function, row in rows_of(name, site / file, floating, python, library, rounds).items():
                    rows[function].append(row)
    words = (
        f"Nanoseconds of processor time of one call from C at random states, least of {rounds} batches in turn. mechc: "
        "`model.functions.faster()`, masses and sizes at run time, dampers, springs, tendons and drives included; Pinocchio: `aba` and "
        "`crba`, the better of both conventions, `rnea`, and `computeJointJacobian` of the last joint (ours: of the link on it, in arrays "
        "of states), from its headers by `g++ -O3 -march=native`; CasADi: its C of Featherstone's two recursions with masses and sizes "
        f"baked in, the better of {' and '.join(LEVELS)} (of the longest, the first). Goal: at most 1 beside the better one in "
        "accelerations and inverse dynamics."
    )
    tables = [
        table(
            [
                function.replace("_", " "),
                "freedoms",
                "mechc",
                "Pinocchio",
                "CasADi",
                "mechc / the better one",
            ],
            found,
        )
        for function, found in rows.items()
    ]
    write("robot_functions", "Functions of robots from C", [words, *tables])


if __name__ == "__main__":
    main()
