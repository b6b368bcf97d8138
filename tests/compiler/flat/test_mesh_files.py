"""Triangles of COLLADA and glTF files: where the scene places them, against rotations by SciPy."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mechc
from mechc.compiler.flat.values.mesh_files import triangles

TETRA = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]], float)
FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
TURN, STRETCH, SHIFT = Rotation.from_rotvec([0.3, -0.5, 0.7]), np.array([1.5, 2, 0.5]), np.array([4, -5, 6])


def dae(shapes: str, nodes: str, more: str = "") -> str:
    positions = " ".join(map(str, TETRA.ravel()))
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="centimeter" meter="0.01"/><up_axis>Y_UP</up_axis></asset>
  <library_geometries><geometry id="g"><mesh>
    <source id="p"><float_array id="a" count="14">9 9 {positions}</float_array>
      <technique_common><accessor source="#a" count="4" offset="2" stride="3"/></technique_common></source>
    <source id="n"><float_array id="b" count="3">0 0 1</float_array></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>{shapes}
  </mesh></geometry></library_geometries>{more}
  <library_visual_scenes><visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>"""


INPUTS = '<input semantic="NORMAL" source="#n" offset="0"/><input semantic="VERTEX" source="#v" offset="1"/>'
LISTED = " ".join(f"0 {k}" for face in FACES for k in face)
CUT = {
    "triangles": f'<triangles count="4">{INPUTS}<p>{LISTED}</p></triangles>',
    "polylist": f'<polylist count="4">{INPUTS}<vcount>3 3 3 3</vcount><p>{LISTED}</p></polylist>',
    "polygons": f"<polygons>{INPUTS}"
    + "".join("<p>" + " ".join(f"0 {k}" for k in face) + "</p>" for face in FACES)
    + "</polygons>",
    "tristrips": f"<tristrips>{INPUTS}<p>0 0 0 2 0 1 0 3 0 0</p><p>0 0 0 3 0 2</p></tristrips>",
}
PLACED = f"""<node><translate>4 -5 6</translate><node><rotate>{" ".join(map(str, TURN.as_rotvec()))} {np.degrees(TURN.magnitude())}</rotate>
<scale>1.5 2 0.5</scale><instance_geometry url="#g"/></node></node>"""


def sorted_rows(surface: Any) -> Any:
    """Return triangles in an order of their own, each from its least corner on, so that which way it faces counts."""
    turned = []
    for triangle in np.round(np.array(surface), 12).tolist():
        first = triangle.index(min(triangle))
        turned.append(triangle[first:] + triangle[:first])
    return np.array(sorted(turned))


def expected(size: float = 1.0) -> Any:
    corners = size * (TURN.apply(STRETCH * TETRA) + SHIFT)
    return sorted_rows([[corners[k] for k in face] for face in FACES])


@pytest.mark.parametrize("kind", CUT)
def test_a_collada_file(tmp_path: Path, kind: str) -> None:
    """Each way to list faces, corners among normals, nodes in nodes, and the unit; the axis that points up stays."""
    file = tmp_path / "t.DAE"
    file.write_text(dae(CUT[kind], PLACED))
    assert sorted_rows(triangles(file)) == pytest.approx(expected(0.01), abs=1e-12)


def test_nodes_of_a_library_and_matrices(tmp_path: Path) -> None:
    rows = np.hstack([TURN.as_matrix() * STRETCH, SHIFT[:, None]])
    node = f'<node id="k"><matrix>{" ".join(map(str, rows.ravel()))} 0 0 0 1</matrix><instance_geometry url="#g"/></node>'
    text = dae(
        CUT["triangles"], '<node><instance_node url="#k"/></node>', f"<library_nodes>{node}</library_nodes>"
    )
    (tmp_path / "t.dae").write_text(text)
    assert sorted_rows(triangles(tmp_path / "t.dae")) == pytest.approx(expected(0.01), abs=1e-12)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<robot/>", "'t.dae' is not a COLLADA file: it begins with 'robot'"),
        ("<COLLADA>", "'t.dae' is not a COLLADA file: no element found"),
        (dae(CUT["triangles"], '<node><instance_geometry url="#h"/></node>'), "there is no '#h'"),
        (dae(CUT["triangles"], '<node id="k"><instance_node url="#k"/></node>'), "a node holds itself"),
        (dae(CUT["triangles"], "<node><skew>1</skew></node>"), "places a shape by 'skew', which is not read"),
        (dae(CUT["triangles"], "<node><scale>1 2</scale></node>"), "'scale' is not so many numbers"),
        (dae(CUT["triangles"].replace("VERTEX", "OTHER"), PLACED), "there is no input 'VERTEX'"),
        (
            dae(CUT["triangles"].replace("<p>0 0", "<p>0 9"), PLACED),
            "is not a COLLADA file: list index out of range",
        ),
        (dae(CUT["triangles"], "<node/>"), "'t.dae' holds no triangle"),
    ],
)
def test_wrong_collada_files(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "t.dae").write_text(text)
    with pytest.raises(ValueError, match=said):
        triangles(tmp_path / "t.dae")


def glb(tree: dict[str, Any], numbers: bytes) -> bytes:
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    body = (
        struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(numbers), b"BIN\0") + numbers
    )
    return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


def tetra(mode: int = 4) -> tuple[dict[str, Any], bytes]:
    """A tetrahedron whose corners stand among other numbers."""
    corners = b"".join(struct.pack("<6f", *corner, 9, 9, 9) for corner in TETRA)
    order = {4: [k for face in FACES for k in face], 5: [0, 2, 1, 3, 0, 2]}[mode]
    tree: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"translation": SHIFT.tolist(), "children": [1]},
            {"rotation": TURN.as_quat().tolist(), "scale": STRETCH.tolist(), "mesh": 0},
            {"mesh": 0},  # in no scene
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": mode}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "byteOffset": 2, "componentType": 5123, "count": len(order), "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 96, "byteStride": 24},
            {"buffer": 0, "byteOffset": 96, "byteLength": 2 + 2 * len(order)},
        ],
        "buffers": [{"byteLength": 98 + 2 * len(order)}],
    }
    return tree, corners + struct.pack(f"<{1 + len(order)}H", 7, *order)


@pytest.mark.parametrize("mode", [4, 5])
def test_a_gltf_file(tmp_path: Path, mode: int) -> None:
    """Nodes in nodes, corners among other numbers, lists and strips of triangles; what no scene shows is not there."""
    tree, numbers = tetra(mode)
    (tmp_path / "t.glb").write_bytes(glb(tree, numbers))
    assert sorted_rows(triangles(tmp_path / "t.glb")) == pytest.approx(expected(), abs=1e-6)  # of 32 bits
    columns = np.vstack([np.hstack([TURN.as_matrix() * STRETCH, SHIFT[:, None]]), [0, 0, 0, 1]]).T
    tree["nodes"] = [{"matrix": columns.ravel().tolist(), "mesh": 0}]
    (tmp_path / "t.glb").write_bytes(glb(tree, numbers))
    assert sorted_rows(triangles(tmp_path / "t.glb")) == pytest.approx(expected(), abs=1e-6)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            {"extensionsRequired": ["KHR_draco_mesh_compression"]},
            "needs KHR_draco_mesh_compression of glTF, which is",
        ),
        ({"buffers": [{"uri": "t.bin", "byteLength": 9}]}, "keeps its corners in another file"),
        ({"accessors": []}, "is not a glTF file"),
        ({"nodes": [{"children": [0]}]}, "a node holds itself"),
        ({"scenes": [{}]}, "holds no triangle"),
    ],
)
def test_wrong_gltf_files(tmp_path: Path, change: dict[str, Any], said: str) -> None:
    tree, numbers = tetra()
    (tmp_path / "t.glb").write_bytes(glb({**tree, **change}, numbers))
    with pytest.raises(ValueError, match=said):
        triangles(tmp_path / "t.glb")
    (tmp_path / "t.glb").write_bytes(b"solid")
    with pytest.raises(ValueError, match="is not a glTF file of version 2"):
        triangles(tmp_path / "t.glb")


def test_the_volume_inside_a_collada_file(tmp_path: Path) -> None:
    (tmp_path / "t.dae").write_text(dae(CUT["triangles"], '<node><instance_geometry url="#g"/></node>'))
    model = tmp_path / "m.mech"
    model.write_text('output V = mesh_volume("t.dae", 1 m);\nexperiment(stop = 1 s);\n')
    assert mechc.load(model).simulate()["V"][0] == pytest.approx(1e-6, rel=1e-12)
