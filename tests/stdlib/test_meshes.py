"""Solids inside triangles: against closed forms, and against cones over their faces in floating point."""

from __future__ import annotations

import itertools
import struct
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from oracle import Meaning
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

import mechc

Array = NDArray[np.float64]
Mesh = tuple[Array, NDArray[np.int64]]

CUBE = np.array(list(itertools.product((0, 1), repeat=3)), float)


def hull(points: Array) -> Mesh:
    """Return the triangles of a convex hull, all facing outwards."""
    found = ConvexHull(points)
    faces = found.simplices.copy()
    for face, plane in zip(faces, found.equations, strict=True):
        a, b, c = points[face]
        if np.dot(np.cross(b - a, c - a), plane[:3]) < 0:
            face[1:] = face[:0:-1]
    return points, faces


def icosphere(rounds: int) -> Mesh:
    """Return a ball of triangles: each is cut into four, its corners put onto the sphere."""
    golden = (1 + 5**0.5) / 2
    points = np.array([p for a, b in itertools.product((-1, 1), (-golden, golden)) for p in ((0, a, b), (a, b, 0), (b, 0, a))])  # fmt: skip
    for _ in range(rounds):
        _, faces = hull(points)
        middles = [
            (points[i] + points[j]) / 2 for f in faces for i, j in itertools.pairwise((*f, f[0])) if i < j
        ]
        points = np.array([*points, *middles])
        points /= np.linalg.norm(points, axis=1, keepdims=True)
    return hull(points / np.linalg.norm(points[0]))


def by_divergence(points: Array, faces: NDArray[np.int64]) -> tuple[float, Array, Array]:
    """Return volume, centre and tensor about it from integrals over the faces alone.

    Of x_i, x_i^2 and x_i x_j along coordinate i, whose divergences are 1, 2 x_i and 3 x_i x_j, by a rule on triangles
    that is exact to the fifth degree (J. Radon 1948), as the integrands are cubic.
    """
    root = 15**0.5
    a, b = (6 - root) / 21, (6 + root) / 21
    rule = [((1 / 3,) * 3, 9 / 40)]
    for s, w in ((a, (155 - root) / 1200), (b, (155 + root) / 1200)):
        rule += [(p, w) for p in ((s, s, 1 - 2 * s), (s, 1 - 2 * s, s), (1 - 2 * s, s, s))]
    volume, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for i, j, k in faces:
        p, q, r = points[i], points[j], points[k]
        normal = np.cross(q - p, r - p) / 2
        for (u, v, t), w in rule:
            x = u * p + v * q + t * r
            volume += w * x @ normal / 3
            first += w * x**2 * normal / 2
            second += w * np.outer(x, x) * (x @ normal) / 5
    centre = first / volume
    about = second - volume * np.outer(centre, centre)
    return volume, centre, np.trace(about) * np.eye(3) - about


def write_obj(path: Path, mesh: Mesh) -> None:
    points, faces = mesh
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    lines += [f"f {i + 1}//1 {j + 1}/2 {k - len(points)}" for i, j, k in faces.tolist()]
    path.write_text("# made for a test\n" + "\n".join(lines) + "\n", encoding="utf-8")


def write_stl(path: Path, mesh: Mesh, text: bool) -> Mesh:
    """Write an STL file; return what it holds, which a binary one rounds to 24 bits."""
    points, faces = mesh
    if text:
        rows = ["solid s"]
        for face in faces:
            corners = [f"vertex {' '.join(map(repr, points[k].tolist()))}" for k in face]
            rows += ["facet normal 0 0 0", "outer loop", *corners, "endloop", "endfacet"]
        path.write_text("\n".join([*rows, "endsolid s"]), encoding="utf-8")
        return mesh
    records = [struct.pack("<12f2x", 0, 0, 0, *points[face].ravel()) for face in faces]
    path.write_bytes(bytes(80) + struct.pack("<I", len(faces)) + b"".join(records))
    return points.astype(np.float32).astype(float), faces


def properties(folder: Path, name: str, scale: str = "1 m") -> tuple[float, Array, Array]:
    """Return volume, centre and tensor of unit density in SI, as outputs of a model beside the file."""
    args = f'"{name}", {scale}'
    (folder / "solid.mech").write_text(
        f"output v = mesh_volume({args}); output c = mesh_centre({args}); output J = mesh_inertia({args});"
        "experiment(stop = 0);",
        encoding="utf-8",
    )
    return outputs(mechc.load(folder / "solid.mech"))


def outputs(model: mechc.Model) -> tuple[float, Array, Array]:
    solution = model.simulate(estimate_error=False)
    J = [[float(solution[f"J[{i},{j}]"][0]) for j in (1, 2, 3)] for i in (1, 2, 3)]
    return (
        float(solution["v"][0]),
        np.array([float(solution[f"c[{i}]"][0]) for i in (1, 2, 3)]),
        np.array(J),
    )


def listed(mesh: Mesh) -> str:
    points, faces = mesh
    corners = ", ".join("{" + ", ".join(f"{x!r}" for x in p) + "}" for p in points.tolist())
    numbers = ", ".join("{" + ", ".join(str(k + 1) for k in f) + "}" for f in faces.tolist())
    return f"parameter Length p[{len(points)}, 3] = {{{corners}}} m; structural parameter Integer f[{len(faces)}, 3] = {{{numbers}}};"


def close(found: tuple[float, Array, Array], expected: tuple[float, Array, Array], relative: float) -> bool:
    size = expected[0] ** (1 / 3)
    return (
        abs(found[0] - expected[0]) <= relative * size**3
        and np.allclose(found[1], expected[1], rtol=0, atol=relative * (size + np.abs(expected[1]).max()))
        and np.allclose(
            found[2], expected[2], rtol=0, atol=relative * (size + np.abs(expected[1]).max()) ** 5
        )
    )


def test_box_and_tetrahedron_have_their_closed_forms(tmp_path: Path) -> None:
    a, b, c = 2.0, 3.0, 5.0
    write_obj(tmp_path / "box.obj", hull(CUBE * (a, b, c)))
    V = a * b * c
    box = (V, np.array([a, b, c]) / 2, V / 12 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b]))
    found = properties(tmp_path, "box.obj")
    assert found[0] == V and np.array_equal(found[1], box[1])
    assert np.allclose(found[2], box[2], rtol=1e-15, atol=0)
    cm = properties(tmp_path, "box.obj", "1 cm")
    assert (cm[0], cm[2][0, 0]) == pytest.approx((V * 1e-6, box[2][0, 0] * 1e-10), rel=1e-15)
    write_obj(
        tmp_path / "tetrahedron.obj", hull(np.array([[0, 0, 0], [a, 0, 0], [0, b, 0], [0, 0, c]], float))
    )
    V = a * b * c / 6
    squares = 3 * V / 80 * np.array([a, b, c]) ** 2
    tensor = np.diag(squares.sum() - squares) + V / 80 * np.array(
        [[0, a * b, a * c], [a * b, 0, b * c], [a * c, b * c, 0]]
    )
    assert close(properties(tmp_path, "tetrahedron.obj"), (V, np.array([a, b, c]) / 4, tensor), 1e-15)


@pytest.mark.parametrize("kind", ["obj", "text.stl", "binary.stl"])
def test_ball_of_triangles(tmp_path: Path, kind: str) -> None:
    """1280 triangles, off the origin: exact for the polyhedron, and 1 % less than the ball."""
    points, faces = icosphere(3)
    mesh = np.add(points, (0.3, -2.0, 1.0)), faces
    if kind == "obj":
        write_obj(tmp_path / kind, mesh)
        (tmp_path / kind).rename(tmp_path / "ball.obj")
    else:
        mesh = write_stl(tmp_path / kind, mesh, kind.startswith("text"))
    assert len(faces) == 1280
    found = properties(tmp_path, "ball.obj" if kind == "obj" else kind)
    assert close(found, by_divergence(*mesh), 1e-13)
    assert 4 / 3 * np.pi * 0.98 < found[0] < 4 / 3 * np.pi


@pytest.fixture(scope="module")
def lump() -> Mesh:
    return hull(np.random.default_rng(3).normal(size=(12, 3)))


def test_listed_triangles_move_and_turn_with_their_tensor(lump: Mesh, tmp_path: Path) -> None:
    """J' = R J R^T, c' = R c + d; formulas of parameters, the file, and the oracle agree."""
    text = listed(lump) + (
        "parameter Real R[3, 3] = identity(3); parameter Length d[3] = 0 m;"
        "let q = {R*p[i, 1:3] + d for i in 1:12};"
        "output v = mesh_volume(q, f); output c = mesh_centre(q, f); output J = mesh_inertia(q, f); experiment(stop = 0);"
    )
    model = mechc.loads(text)
    expected = by_divergence(*lump)
    assert close(outputs(model), expected, 1e-14)
    write_obj(tmp_path / "lump.obj", lump)
    assert close(properties(tmp_path, "lump.obj"), expected, 1e-14)
    turn, moved = Rotation.from_rotvec([0.3, -1.2, 2.0]).as_matrix(), np.array([3.0, -4.0, 2.0])
    values: dict[str, float] = {f"R[{i + 1},{j + 1}]": turn[i, j] for i in range(3) for j in range(3)}
    values |= {f"d[{i + 1}]": moved[i] for i in range(3)}
    turned = outputs(model.with_values(values))
    assert close(turned, (expected[0], turn @ expected[1] + moved, turn @ expected[2] @ turn.T), 1e-13)
    meaning = Meaning(model.compilation.flat)
    told = meaning.outputs(meaning.start())
    assert [told[f"J[{i},{i}]"] for i in (1, 2, 3)] == pytest.approx(np.diag(expected[2]), rel=1e-12)


def test_library_solids_are_bodies(lump: Mesh, tmp_path: Path) -> None:
    """Solid from a file and Polyhedron from a list: mass, centre and tensor about it; both swing alike."""
    write_obj(tmp_path / "lump.obj", lump)
    volume, centre, tensor = by_divergence(*lump)
    runs = []
    texts = {
        "file": 'Solid b(file = "lump.obj", scale = 1 dm, density = 2000 kg/m^3);',
        "list": listed(lump).replace("} m;", "} dm;")
        + f"Polyhedron b(n = 12, k = {len(lump[1])}, corners = p, faces = f, density = 2000 kg/m^3);",
    }
    for text in texts.values():
        (tmp_path / "m.mech").write_text(
            f"import mech.spatial.*; model M {text} gravity {{0, 0, -9.81}} m/s^2; Spherical s(world -> b.a); "
            "experiment(stop = 1 s, tolerance = 1e-10); end M;",
            encoding="utf-8",
        )
        model = mechc.load(tmp_path / "m.mech")
        (body,) = model.inertia().details["bodies"]
        assert body["mass"] == pytest.approx(2000 * volume * 1e-3, rel=1e-13)
        assert np.allclose(body["centre"], centre / 10, atol=1e-13)
        assert np.allclose(body["tensor"], 2000 * tensor * 1e-5, rtol=0, atol=1e-13 * 2000)
        runs.append(model.simulate(estimate_error=False)["s.orientation[1]"])
    assert runs[0] == pytest.approx(runs[1], abs=1e-9)


TETRAHEDRON = hull(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float))


def _without(mesh: Mesh) -> Mesh:
    return mesh[0], mesh[1][1:]


def _one_turned(mesh: Mesh) -> Mesh:
    faces = mesh[1].copy()
    faces[0] = faces[0][::-1]
    return mesh[0], faces


def _doubled(mesh: Mesh) -> Mesh:
    return mesh[0], np.vstack([mesh[1], np.roll(mesh[1], 1, axis=1)])


def _copied(mesh: Mesh) -> Mesh:
    """Return each triangle twice, the second time with corners of its own at the same places."""
    return np.vstack([mesh[0], mesh[0]]), np.vstack([mesh[1], mesh[1] + len(mesh[0])])


def _one_twice_more(mesh: Mesh) -> Mesh:
    return mesh[0], np.vstack([mesh[1], mesh[1][:1], mesh[1][:1]])


def _two_sided(mesh: Mesh) -> Mesh:
    return mesh[0], np.vstack([mesh[1], mesh[1][:, ::-1]])


WRONG = {
    "4 of the triangles stand more than once": _doubled(TETRAHEDRON),
    "4 of the triangles stand (more than once)": _copied(TETRAHEDRON),
    "a triangle stands more than once": _one_twice_more(TETRAHEDRON),
    "the triangles enclose nothing(.|\n)*each of them stands beside one that faces the other way": _two_sided(
        TETRAHEDRON
    ),
    "the surface is not closed": _without(TETRAHEDRON),
    "triangles that meet face opposite sides": _one_turned(TETRAHEDRON),
    "the triangles face inwards": (TETRAHEDRON[0], TETRAHEDRON[1][:, ::-1]),
    "the triangles enclose nothing": (TETRAHEDRON[0] * (1, 1, 0), TETRAHEDRON[1]),
}


@pytest.mark.parametrize("message", WRONG)
def test_what_is_no_solid_is_refused(message: str, tmp_path: Path) -> None:
    write_obj(tmp_path / "wrong.obj", WRONG[message])
    with pytest.raises(mechc.CompileError, match=message):
        properties(tmp_path, "wrong.obj")
    with pytest.raises(mechc.CompileError, match=message):
        points, faces = listed(WRONG[message]).split("= ")[1:]
        corners, numbers = points.partition(";")[0], faces.partition(";")[0]
        mechc.loads(f"output v = mesh_volume({corners}, {numbers}); experiment(stop = 0);")


def _beside(mesh: Mesh, other: Mesh) -> Mesh:
    return np.vstack([mesh[0], other[0]]), np.vstack([mesh[1], other[1] + len(mesh[0])])


def _cube(size: float, at: float, inwards: bool = False) -> Mesh:
    points, faces = hull(CUBE)
    return (points - 0.5) * size + at, faces[:, ::-1] if inwards else faces


PIECES = {
    "apart": (_beside(_cube(2, 0), _cube(1, 5)), 9),
    "hole": (_beside(_cube(2, 0), _cube(1, 0.25, inwards=True)), 7),
    "ball in a hole": (_beside(_beside(_cube(4, 0), _cube(2, 0.1, inwards=True)), _cube(1, 0.2)), 64 - 8 + 1),
    "sheet": (hull(CUBE * (2, 2, 0.5e-3)), 2e-3),
    "overlapping by rounding": (_beside(_cube(2, 0), hull(CUBE * (1, 4, 4) + (1 - 1e-8, -2, -2))), 8 + 16),
    "face to face": (_beside(_cube(2, 0), hull(CUBE * (1, 4, 4) + (1 + 1e-8, -2, -2))), 8 + 16),
    "touching, no corner shared": (_beside(_cube(2, 0), _cube(1, 1.5)), 9),
    "inner one outwards": (_beside(_cube(2, 0), _cube(1, 0.25)), "encloses the same place 2 times"),
    "outer one first": (_beside(_cube(1, 0.25), _cube(2, 0)), "encloses the same place 2 times"),
    "inside out": (_beside(_cube(2, 0), _cube(1, 5, inwards=True)), "faces inwards, and is not a hole"),
    "in a hole, inwards": (
        _beside(_beside(_cube(4, 0), _cube(2, 0.1, inwards=True)), _cube(1, 0.2, inwards=True)),
        "faces inwards, and is not a hole",
    ),
}


@pytest.mark.parametrize("name", PIECES)
def test_pieces_of_a_surface(name: str, tmp_path: Path) -> None:
    """Pieces enclose what they enclose once: solids apart and holes add and take volumes, all else is refused."""
    mesh, expected = PIECES[name]
    write_obj(tmp_path / "pieces.obj", mesh)
    if isinstance(expected, str):
        with pytest.raises(mechc.CompileError, match=expected):
            properties(tmp_path, "pieces.obj")
    else:
        assert properties(tmp_path, "pieces.obj")[0] == pytest.approx(expected, rel=1e-15)


def test_a_part_exported_twice_with_other_triangles_is_refused(tmp_path: Path) -> None:
    """The faces of a cube along both diagonals: all edges are balanced, no triangle stands twice, and it is there twice."""
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    cuts = [(q[k], q[(k + 1) % 4], q[(k + 2) % 4]) for q in quads for k in range(4)]
    first = [t for k, t in enumerate(cuts) if k % 2 == 0]
    second = [t for k, t in enumerate(cuts) if k % 2 == 1]
    write_obj(tmp_path / "once.obj", (CUBE, np.array(first)))
    assert properties(tmp_path, "once.obj")[0] == 1
    write_obj(tmp_path / "twice.obj", (CUBE, np.array(first + second)))
    with pytest.raises(mechc.CompileError, match="encloses the same place 2 times"):
        properties(tmp_path, "twice.obj")


@pytest.mark.parametrize("text", [True, False])
def test_double_triangles_of_an_stl_file_are_refused(text: bool, tmp_path: Path) -> None:
    """They would have counted twice: a box of 30 m^3 was one of 60 m^3."""
    write_stl(tmp_path / "double.stl", _doubled(hull(CUBE * (2, 3, 5))), text)
    with pytest.raises(mechc.CompileError, match="12 of the triangles stand more than once"):
        properties(tmp_path, "double.stl")


def test_solids_that_touch_have_both_walls(tmp_path: Path) -> None:
    """Two cubes side by side: the wall between them stands twice, with opposite sides, and counts for neither."""
    points, faces = hull(CUBE)
    both = np.vstack([points, points + np.array([1, 0, 0])]), np.vstack([faces, faces + 8])
    write_stl(tmp_path / "pair.stl", both, True)
    volume, centre, tensor = properties(tmp_path, "pair.stl")
    assert volume == 2 and np.array_equal(centre, [1, 0.5, 0.5])
    assert np.allclose(tensor, 2 / 12 * np.diag([2, 5, 5]), rtol=1e-15, atol=1e-15)


def test_corners_that_turn_inside_out_end_the_run() -> None:
    model = mechc.loads(
        "import mech.spatial.*; model M Polyhedron b(corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, -1}} m, m = 1 kg); Free f(world -> b.a); experiment(stop = 1 s); end M;"
    )
    solution = model.simulate()
    assert isinstance(solution, mechc.Solution)
    assert solution.outcome.value == "failed"
    assert "the triangles of a polyhedron face outwards" in str(solution.message)


FILES = {
    "none.stl": ("there is no file", None),
    "a.ply": ("is not an STL, OBJ, DAE or GLB file", "ply"),
    "a.stl": ("is not an STL file", "solid nothing"),
    "a.obj": ("there is no corner 4", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"),
    "b.obj": ("is not a corner of a face", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 x\n"),
    "c.obj": ("a corner is not three numbers", "v 0 0\n"),
    "d.obj": ("holds no triangle", "v 0 0 0\n"),
    "e.obj": ("is not a number", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
}


@pytest.mark.parametrize("name", FILES)
def test_files_that_hold_no_mesh_are_refused(name: str, tmp_path: Path) -> None:
    message, text = FILES[name]
    if text is not None:
        (tmp_path / name).write_text(text, encoding="utf-8")
    with pytest.raises(mechc.CompileError, match=message):
        properties(tmp_path, name)


def test_a_file_that_changes_is_read_again(tmp_path: Path) -> None:
    write_obj(tmp_path / "a.obj", TETRAHEDRON)
    first = properties(tmp_path, "a.obj")[0]
    write_obj(tmp_path / "a.obj", (TETRAHEDRON[0] * 2, TETRAHEDRON[1]))
    assert properties(tmp_path, "a.obj")[0] == pytest.approx(8 * first, rel=1e-15)
