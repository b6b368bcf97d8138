"""Problems of contact with friction that others have published, solved by the kernel and, where it is installed, by Siconos.

``MECHC_FRICTION_PROBLEMS`` names a folder of files as Siconos' numerics writes them (``*.dat``) and as FCLIB does (``*.hdf5``, with
h5py); the page is left out without one.
"""

from __future__ import annotations

import ctypes
import json
import os
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from mechc.runtime.native.build import build_shared, kernel_flags
from mechc.runtime.native.kernel import kernel_sources

from .machine import table, write

Array = NDArray[np.float64]
FOLDER = "MECHC_FRICTION_PROBLEMS"
DRIVER = Path(__file__).parents[1] / "tests" / "support" / "cones_driver.c"
MOST = 1500
"""Rows of W, which is a full matrix here."""

BY_SICONOS = """
import json, sys, time
import numpy as np
import siconos.numerics as sn
problem = sn.frictionContact_new_from_filename(sys.argv[1])
n, flat = problem.dimension*problem.numberOfContacts, problem.dimension == 2
kinds = ["FRICTION_2D_NSGS"] if flat else ["FRICTION_3D_NSGS", "FRICTION_3D_NSN_AC", "FRICTION_3D_ADMM"]
found = []
for kind in kinds:
    options = sn.SolverOptions(getattr(sn, "SICONOS_" + kind))
    options.iparam[0], options.dparam[0] = 20000, 1e-12
    r, u = np.zeros(n), np.zeros(n)
    begun = time.process_time()
    (sn.fc2d_driver if flat else sn.fc3d_driver)(problem, r, u, options)
    found.append([kind, time.process_time() - begun, r.tolist()])
print("\\n" + json.dumps(found))
"""


class FrictionProblem(Struct, frozen=True):
    """u = W r + q; of each contact the normal row, then ``slips`` tangential ones."""

    w: Array
    q: Array
    friction: Array

    @property
    def slips(self) -> int:
        return self.q.size // self.friction.size - 1

    def residual(self, r: Array) -> float:
        """Return the natural map by which FCLIB and Siconos judge, over the norm of q."""
        u = (self.w @ r + self.q).reshape(self.friction.size, -1)
        r = r.reshape(u.shape)
        moved = r - u
        moved[:, 0] -= self.friction * np.linalg.norm(u[:, 1:], axis=1)
        return float(np.linalg.norm(r - self._projected(moved)) / (np.linalg.norm(self.q) or 1))

    def _projected(self, x: Array) -> Array:
        """Return what is nearest to x in the cones."""
        normal, slip, mu = x[:, 0], np.linalg.norm(x[:, 1:], axis=1), self.friction
        on = np.maximum(normal + mu * slip, 0) / (1 + mu**2)
        share = np.where(slip > 0, mu * on / np.where(slip > 0, slip, 1), 0)
        edge = np.column_stack([on, share[:, None] * x[:, 1:]])
        return np.where((slip <= mu * normal)[:, None], x, edge)


def read(path: Path) -> FrictionProblem:
    return _read_fclib(path) if path.suffix == ".hdf5" else _read_text(path.read_text())


def _read_fclib(path: Path) -> FrictionProblem:
    import h5py

    with h5py.File(path) as file:
        local = file["fclib_local"]
        n = _whole(local["W/m"])
        w = np.zeros((n, n))
        rows, ends, values = local["W/i"][:], local["W/p"][:], local["W/x"][:]
        if _whole(local["W/nz"]) >= 0:
            np.add.at(w, (rows, ends), values)
        else:
            by_row = _whole(local["W/nz"]) == -2
            for k in range(n):
                part = slice(ends[k], ends[k + 1])
                w[(k, rows[part]) if by_row else (rows[part], k)] = values[part]
        return FrictionProblem(w, local["vectors/q"][:], local["vectors/mu"][:])


def _whole(held: Any) -> int:
    return int(np.ravel(held[()])[0])


def _read_text(text: str) -> FrictionProblem:
    """Full matrices, those of blocks and those of columns."""
    if "CSparse" in text:
        return _read_columns(text)
    numbers = iter(text.split())

    def whole() -> int:
        return int(next(numbers))

    def array(size: int) -> Array:
        return np.array([float(next(numbers)) for _ in range(size)])

    dimension, contacts, kind, n, _ = (whole() for _ in range(5))
    if kind == 0:
        array(2)
        w = array(n * n).reshape(n, n, order="F")  # as Siconos reads them
    else:
        blocks, across, down = (whole() for _ in range(3))
        ends = [0, *(whole() for _ in range(across))]
        [whole() for _ in range(down)]
        begins, places = whole(), whole()
        begin = [whole() for _ in range(begins)]
        columns = [whole() for _ in range(places)]
        w = np.zeros((n, n))
        for i in range(across):
            for at in range(begin[i], begin[i + 1]):
                assert whole() == at < blocks
                rows, beside = slice(ends[i], ends[i + 1]), slice(ends[columns[at]], ends[columns[at] + 1])
                shape = rows.stop - rows.start, beside.stop - beside.start
                w[rows, beside] = array(shape[0] * shape[1]).reshape(shape, order="F")
    return FrictionProblem(w, array(dimension * contacts), array(contacts))


def _read_columns(text: str) -> FrictionProblem:
    head, _, body = text.partition("CSparse")
    dimension, contacts, _, n, _, _ = map(int, head.split())
    w, column = np.zeros((n, n)), 0
    rest: list[str] = []
    for line in body.splitlines()[2:]:
        words = line.split()
        if words[:1] == ["col"]:
            column = int(words[1])
        elif ":" in words:
            w[int(words[0]), column] = float(words[2])
        else:
            rest += words
    numbers = np.array(rest, float)
    return FrictionProblem(w, numbers[: dimension * contacts], numbers[-contacts:])


def by_mechc(problem: FrictionProblem, slack: float) -> tuple[Array, float]:
    """Return impulses of the kernel's solver, and processor seconds."""
    sources = {
        name: text
        for name, text in kernel_sources().items()
        if name.endswith(".h") or name in ("linear.c", "orthogonal.c", "cones.c")
    }
    sources["driver.c"] = DRIVER.read_text(encoding="utf-8")
    library = ctypes.CDLL(str(build_shared(sources, kernel_flags(), name="cones")))
    n, contacts = problem.q.size, problem.friction.size
    each = 1 + problem.slips
    kinds = np.array([[1, each * k, problem.slips] for k in range(contacts)], np.int32)
    numbers = np.column_stack([problem.friction, np.full(contacts, slack * np.abs(problem.q).max())])
    r, u, report = np.zeros(n), np.zeros(n), np.zeros(3)
    arrays = [np.ascontiguousarray(a) for a in (kinds, numbers, problem.w, problem.q)]
    pointers = [ctypes.c_void_p(a.ctypes.data) for a in (*arrays, r, u, report)]
    begun = time.process_time()
    library.cones(n, contacts, *pointers[:4], 0, 0, *pointers[4:])
    return r, time.process_time() - begun


def by_siconos(path: Path, problem: FrictionProblem) -> list[tuple[str, float, float]]:
    """Return of each solver its name, processor seconds and residual; nothing where it is not installed or cannot read the file."""
    command = ["/usr/bin/python3", "-c", BY_SICONOS, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        return []
    found = json.loads(done.stdout.splitlines()[-1])
    return [(kind, seconds, problem.residual(np.array(r))) for kind, seconds, r in found]


def rows_of(folder: Path, quick: bool) -> Iterator[list[str]]:
    """Yield a row for each file of a problem in local form of at most ``MOST`` rows."""
    for path in sorted((*folder.glob("*.dat"), *folder.glob("*.hdf5"))):
        try:
            problem = read(path)
        except (KeyError, ValueError, StopIteration):  # another form of problem
            continue
        n = problem.q.size
        if problem.w.shape != (n, n) or not problem.q.any() or n > (100 if quick else MOST):
            continue
        r, seconds = by_mechc(problem, 1e-12)
        theirs = [
            f"{kind[12:]} {residual:.0e}, {1000 * taken:.0f} ms"
            for kind, taken, residual in by_siconos(path, problem)
        ]
        yield [
            path.name.split(".")[0],
            f"{problem.friction.size}",
            f"{problem.residual(r):.0e}, {1000 * seconds:.0f} ms",
            "; ".join(theirs) or "not read",
        ]


def main(quick: bool = False) -> None:
    if not (folder := os.environ.get(FOLDER)):
        print(f"left out: {FOLDER} names no folder of problems")
        return
    write(
        "friction_problems",
        "Problems of contact with friction",
        [
            "One-step problems that others have published: impulses r in cones of friction and the rates u = W r + q that they leave. "
            "Of each solver what the natural map of FCLIB leaves, over the norm of q, and processor time. mechc solves with full "
            "matrices, from zero, to 1e-12 of q; Siconos has 20 000 iterations for the same.",
            table(["problem", "contacts", "mechc", "Siconos"], list(rows_of(Path(folder), quick))),
        ],
    )
