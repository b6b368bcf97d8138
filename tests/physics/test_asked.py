"""Sources' rows that ask about a model rather than for a motion: vectors, fields, inertia, frames, Hamilton's mechanics."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from shared_models import example

import mechc

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def outputs(name: str) -> dict[str, float]:
    return example(name).simulate(estimate_error=False).final()


def vector(found: dict[str, float], name: str) -> list[float]:
    return [found[f"{name}[{k}]"] for k in (1, 2, 3)]


# ---------------------------------------------------------------- vectors


def test_vectors() -> None:
    """U2: 70.5288 degrees, 4, (0, -2, 2), (2, 0, 2); U3: 41.4096 degrees; U6: sphere, plane and cylinder; U7: identities, the
    sine rule with twice the area over the product of the sides."""
    found = outputs("vectors")
    assert math.degrees(found["angle_ab"]) == pytest.approx(70.5288, abs=5e-5)
    assert math.degrees(found["angle_wires"]) == pytest.approx(41.4096, abs=5e-5)
    assert found["triple"] == pytest.approx(4, abs=1e-14)
    assert vector(found, "right") == pytest.approx([0, -2, 2], abs=1e-14)
    assert vector(found, "left") == pytest.approx([2, 0, 2], abs=1e-14)
    assert vector(found, "parts") == pytest.approx([0, 0, 0], abs=1e-14)
    A, B = np.array([0.3, -1.7, 0.9]), np.array([0.5, 1.1, -0.7])
    sides = np.linalg.norm([A, B, A + B], axis=1)
    twice_the_area = np.linalg.norm(np.cross(A, B))
    assert vector(found, "sines") == pytest.approx([twice_the_area / sides.prod()] * 3, rel=1e-13)
    model = example("vectors")
    for x, y, z in (
        (0.6, 0.8, 1.0),
        (2 / 7, -3 / 7, 6 / 7),
        (0.6, -0.8, -5.0),
        (3.0, -7.0, 1.0),
        (1.0, 2.0, 3.0),
    ):
        place = model.simulate(set={"p[1]": x, "p[2]": y, "p[3]": z}, estimate_error=False).final()
        off = [math.hypot(x, y, z) - 1, z - 1, math.hypot(x, y) - 1]
        names = ("from_sphere", "from_plane", "from_cylinder")
        assert [place[n] for n in names] == pytest.approx(off, abs=1e-14)


def test_lorentz_inferred() -> None:
    """U4: B = (3, 2, 4) or with -3; U5: B = (1, 2, 3)."""
    found = outputs("lorentz_inferred")
    assert vector(found, "B") == pytest.approx([3, 2, 4], abs=1e-14)
    other = example("lorentz_inferred").simulate(experiment="other", estimate_error=False)
    assert [float(other[f"B[{k}]"][-1]) for k in (1, 2, 3)] == pytest.approx([-3, 2, 4], abs=1e-14)
    assert vector(found, "C") == pytest.approx([1, 2, 3], abs=1e-14)


# ---------------------------------------------------------------- force fields


def test_swirl_and_saddle() -> None:
    """U8: work -2 pi k r^2 round a circle, k = 2; U34: it is the curl, -2 k, times the area (Stokes); U9: potential -k x y."""
    swirl = example("swirl").field(radius=1.5).details
    assert swirl["curl_free"] is False and swirl["conservative"] is False and swirl["potential"] is None
    assert swirl["circulation"] == pytest.approx(-2 * math.pi * 2 * 1.5**2, rel=1e-12)
    assert np.array(swirl["curl"]) == pytest.approx(-4, abs=1e-7)
    shown = str(example("swirl").field())
    assert "-4 N/m" in shown and "[N/m]" in shown
    saddle = example("saddle_xy").field().details
    assert saddle["conservative"] is True and saddle["potential"] == "-2*x*y"
    assert saddle["circulation"] == pytest.approx(0, abs=1e-12)


def test_field_of_potentials() -> None:
    """U34: the forces of x^2 - y^2 and of x^2 + y^2."""
    model = example("field_of_potentials")
    for s, potential, sources in ((-1, "x^2 - y^2", 0), (1, "x^2 + y^2", -4)):
        found = model.field(set={"s": s}).details
        assert found["conservative"] is True and found["potential"] == potential
        assert found["circulation"] == pytest.approx(0, abs=1e-12)
        assert np.trace(found["derivatives_at_start"]) == pytest.approx(sources, abs=1e-9)


def test_field_operators() -> None:
    """U34: (-2x, 2y), free of curl; U35: the vortex is free of curl; U36: curl (0, 0, (2c - 1) x), F = grad W for c = 1/2."""
    solution = example("field_operators").simulate(estimate_error=False)
    x, y, zero = solution["x"], solution["y"], np.zeros(len(solution.time))
    assert np.ptp(x) > 0.3
    expected = {
        "force[1]": -2 * x,
        "force[2]": 2 * y,
        "other_turn[3]": 3 * x,
        **dict.fromkeys(("curl_of_forces", "sources", "curl_of_vortex", "sources_of_vortex"), zero),
        **{f"{name}[{k}]": zero for name in ("turn", "off") for k in (1, 2, 3)},
        **{f"other_turn[{k}]": zero for k in (1, 2)},
    }
    for name, values in expected.items():
        assert solution[name] == pytest.approx(values, abs=1e-14), name


def test_vortex() -> None:
    """U35: free of curl, 2 pi round the origin."""
    found = example("vortex").field(radius=0.8).details
    assert found["curl_free"] is True and found["conservative"] is False
    assert found["circulation"] == pytest.approx(2 * math.pi, rel=1e-13)


@pytest.mark.slow
def test_curl_of_field() -> None:
    """U36: c = 1/2, and of y with a sign instead of x y, -x y - z^4/4 for plus alone; U37: a = c = 0 alone, and -x y z."""
    found = example("curl_of_field").field(vary="c").details
    assert found["possible"] and found["parameter"]["c"] == pytest.approx(0.5, abs=1e-8)
    assert found["conservative"] is False
    half = example("curl_of_field").field(set={"c": 0.5}).details
    assert half["conservative"] is True and half["potential"] == "-1/2*x^2*y - 1/4*z^4"
    text = (EXAMPLES / "curl_of_field.mech").read_text(encoding="utf-8")
    text = text.replace("force x*y on x", "force c*y on x").replace("force c*x^2 on y", "force x on y")
    signed = mechc.loads(text)
    assert signed.field(vary="c").details["parameter"]["c"] == pytest.approx(1, abs=1e-8)
    plus, minus = signed.field(set={"c": 1}).details, signed.field(set={"c": -1}).details
    assert plus["conservative"] is True and plus["potential"] == "-x*y - 1/4*z^4"
    assert minus["conservative"] is False and np.abs(minus["curl"])[:, 0] == pytest.approx(2, abs=1e-9)
    model = example("curl_of_two")
    both = model.field(vary="a,c").details
    assert both["possible"] and both["parameter"] == pytest.approx({"a": 0, "c": 0}, abs=1e-6)
    for a, c in ((0, 0), (0, 1), (1, 0), (-2, 3)):
        assert model.field(set={"a": a, "c": c}).details["conservative"] is (a == c == 0)
    product = example("product_field").field().details
    assert product["conservative"] is True and product["potential"] == "-x*y*z"


# ---------------------------------------------------------------- inertia


def body(found: Any, name: str) -> dict[str, Any]:
    return next(one for one in found.details["bodies"] if one["name"] == name)


def off(axis: Any, along: Sequence[float]) -> float:
    """Return the sine of the angle between an axis, of either sense, and a direction."""
    assert np.linalg.norm(axis) == pytest.approx(1, abs=1e-13)
    return float(np.linalg.norm(np.cross(axis, along)) / np.linalg.norm(along))


def test_the_picture_of_a_potential_shows_its_well() -> None:
    """U15: the wall a/r^12 is 1e30 high within the picture; the drawn curve ends twice the depth above the energy, and has the minimum -b^2/4a."""
    found = example("lennard_jones").energy()
    curve = found.panels[0].curves[0]
    level = found["energy"]
    assert np.nanmin(curve.y) == pytest.approx(-1 / 4, abs=1e-3)
    assert np.nanmax(curve.y) <= level + 2 * (level + 0.25) and np.isnan(curve.y).any()


def test_hemisphere() -> None:
    """U118: 3/8 of the radius, of the library's body and by the integral over its slices."""
    (found,) = example("hemisphere").inertia().details["bodies"]
    assert found["centre"] == pytest.approx([0, 0, 3 / 8 * 0.8], abs=1e-15)
    solution = example("hemisphere").simulate()
    assert solution["integrated"] == pytest.approx(3 / 8 * 0.8, abs=1e-14)


def test_box_at_corner() -> None:
    """U119: M/12 diag(b^2 + c^2, ...), at the corner M(b^2 + c^2)/3 and -M a b/4; K6: parallel axes."""
    (found,) = example("box_at_corner").inertia().details["bodies"]
    a, b, c, mass = 1, 2, 3, 12
    squares = np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    assert np.array(found["tensor"]) == pytest.approx(mass / 12 * squares, abs=1e-13)
    products = np.array([[0, a * b, c * a], [a * b, 0, b * c], [c * a, b * c, 0]])
    corner = mass * (squares / 3 - products / 4)
    assert np.array(found["tensor_about_point"]) == pytest.approx(corner, abs=1e-13)
    d = np.array([a, b, c]) / 2
    shifted = np.array(found["tensor"]) + mass * (d @ d * np.eye(3) - np.outer(d, d))
    assert np.array(found["tensor_about_point"]) == pytest.approx(shifted, abs=1e-13)


def test_three_points() -> None:
    """U120: 2 m a^2 about the origin whatever the axis; about the centre 2 m a^2 along (1, 1, 1), m a^2 across. U124."""
    found = example("three_points").inertia()
    (one,) = found.details["bodies"]
    size = 2 * 1.5**2
    assert np.array(one["tensor_about_point"]) == pytest.approx(2 * size * np.eye(3), abs=1e-13)
    assert one["principal"] == pytest.approx([size, size, 2 * size], rel=1e-14)
    assert off(one["axes"][2], [1, 1, 1]) < 1e-12
    assert one["centre"] == pytest.approx([0.5] * 3, rel=1e-14)
    assert any("symmetric top" in remark for remark in found.remarks)


def test_round_bodies() -> None:
    """U121: 2/5, 1/2 and 1 times M a^2."""
    found = example("round_bodies").inertia()
    size = 3 * 0.5**2
    shares = {"ball": 2 / 5, "cylinder": 1 / 2, "shell": 1}
    for name, share in shares.items():
        assert body(found, name)["tensor"][2][2] == pytest.approx(share * size, rel=1e-14)


def test_square_at_corner() -> None:
    """U129: m a^2 [[1/3, -1/4], [-1/4, 1/3]] and 2/3; principal 1/12 along (1, 1, 0), 7/12 along (1, -1, 0)."""
    (found,) = example("square_at_corner").inertia().details["bodies"]
    size = 3 * 2**2
    tensor = size * np.array([[1 / 3, -1 / 4, 0], [-1 / 4, 1 / 3, 0], [0, 0, 2 / 3]])
    assert np.array(found["tensor_about_point"]) == pytest.approx(tensor, abs=1e-13)
    assert found["principal_about_point"] == pytest.approx(
        [size / 12, 7 * size / 12, 2 * size / 3], rel=1e-13
    )
    for axis, along in zip(found["axes_about_point"], ([1, 1, 0], [1, -1, 0], [0, 0, 1]), strict=True):
        assert off(axis, along) < 1e-12


@pytest.mark.parametrize(
    ("moments", "word"),
    [
        ((1, 1, 2.5), "no body"),
        ((1, 2, 3), "flat"),
        ((2, 2, 2), "spherical"),
        ((1, 1, 1.5), "symmetric top"),
        ((1, 2, 2.5), ""),
    ],
)
def test_what_moments_are_like(moments: tuple[float, ...], word: str) -> None:
    """U124: the triangle inequality of moments, symmetric tops; T11: spherical ones."""
    from mechc.runtime.studies.kinds.inertia import Body, judged

    told = judged(Body("b", 1.0, np.zeros(3), np.diag(np.array(moments, dtype=float))))
    assert (word in " ".join(told)) if word else told == []


# ---------------------------------------------------------------- frames


def test_euler_angles() -> None:
    """U93: rotations do not commute, k = cos(theta) e3 + ...; U106: (0, sqrt(2), 1); P9, T13: the angles come back."""
    model = example("euler_angles")
    found = model.simulate(estimate_error=False).final()
    assert vector(found, "turned") == pytest.approx([0, math.sqrt(2), 1], abs=1e-14)
    theta, psi = math.pi / 2, math.pi / 4
    wanted = [math.sin(theta) * math.sin(psi), math.sin(theta) * math.cos(psi), math.cos(theta)]
    assert vector(found, "k") == pytest.approx(wanted, abs=1e-14)
    assert vector(found, "nodes") == pytest.approx([math.cos(psi), -math.sin(psi), 0], abs=1e-14)
    assert vector(found, "xz") == pytest.approx([0, 0, 1], abs=1e-14)
    assert vector(found, "zx") == pytest.approx([0, 1, 0], abs=1e-14)
    R = np.array([[found[f"R[{i},{j}]"] for j in (1, 2, 3)] for i in (1, 2, 3)])
    assert np.allclose(R, turn("Z", math.pi) @ turn("X", theta) @ turn("Z", psi), rtol=0, atol=1e-14)
    assert np.allclose(R.T @ R, np.eye(3), rtol=0, atol=1e-14)
    told = model.kinematics(set={"phi": 0.4, "theta": 0.7, "psi": -0.3}).details["rotations"]["R"]
    assert told["euler"]["ZXZ"] == pytest.approx([0.4, 0.7, -0.3], abs=1e-12)
    w, x, y, z = told["quaternion"]
    half, plus, minus = 0.35, 0.5 * (0.4 - 0.3), 0.5 * (0.4 + 0.3)  # Cayley and Klein
    assert [w, z] == pytest.approx(
        [math.cos(half) * math.cos(plus), math.cos(half) * math.sin(plus)], abs=1e-12
    )
    assert [x, y] == pytest.approx(
        [math.sin(half) * math.cos(minus), math.sin(half) * math.sin(minus)], abs=1e-12
    )


def test_order_of_turns() -> None:
    """U93: a quarter about x and one about z, in the notes' passive matrices: R1 R2 and R2 R1, which differ."""
    text = """\
model Turns
  dimensionless;
  frame one = world * rotx(pi/2) * rotz(pi/2);
  frame other = world * rotz(pi/2) * rotx(pi/2);
  let axes[3, 3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  output first[3, 3] = {components(one, axes[1]), components(one, axes[2]), components(one, axes[3])};
  output second[3, 3] = {components(other, axes[1]), components(other, axes[2]), components(other, axes[3])};
  experiment(stop = 0);
end Turns;
"""
    found = mechc.loads(text).simulate(estimate_error=False).final()
    R1, R2 = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]), np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    for name, matrix in (("first", R2 @ R1), ("second", R1 @ R2)):
        columns = np.array([[found[f"{name}[{i},{j}]"] for j in (1, 2, 3)] for i in (1, 2, 3)])
        assert np.allclose(columns.T, matrix, rtol=0, atol=1e-14), name
    assert not np.allclose(R1 @ R2, R2 @ R1)


def turn(axis: str, angle: float) -> np.ndarray[Any, Any]:
    """Return the matrix of a rotation about x, y or z."""
    j, k = {"X": (1, 2), "Y": (2, 0), "Z": (0, 1)}[axis]
    matrix = np.eye(3)
    matrix[j, j] = matrix[k, k] = math.cos(angle)
    matrix[j, k], matrix[k, j] = -math.sin(angle), math.sin(angle)
    return matrix


def test_angles_of_all_twelve_kinds_and_axis_and_angle_give_the_rotation_back() -> None:
    """Products of elementary matrices, and the formula of Rodrigues, with the matrix of R itself."""
    told = (
        example("euler_angles")
        .kinematics(set={"phi": 0.4, "theta": 0.7, "psi": -1.3})
        .details["rotations"]["R"]
    )
    matrix = turn("Z", 0.4) @ turn("X", 0.7) @ turn("Z", -1.3)
    assert np.allclose(told["matrix"], matrix, rtol=0, atol=1e-14)
    kinds = {a + b + c for a in "XYZ" for b in "XYZ" for c in "XYZ" if b not in (a, c)}
    assert set(told["euler"]) == kinds and len(kinds) == 12
    for kind, (a, b, c) in told["euler"].items():
        product = turn(kind[0], a) @ turn(kind[1], b) @ turn(kind[2], c)
        assert np.allclose(product, matrix, rtol=0, atol=1e-13), kind
    n, angle = np.array(told["axis"]), told["angle"]
    across = np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
    rodrigues = np.eye(3) + math.sin(angle) * across + (1 - math.cos(angle)) * across @ across
    assert np.allclose(rodrigues, matrix, rtol=0, atol=1e-14)


def test_inertia_about_any_point_and_axes_and_its_principal_axes() -> None:
    """A turned box: parallel axes, J' = R J R^T, moments and axes against the edges of the box."""
    model = mechc.loads(
        """
        import mech.spatial.*;
        model M
          Box b(size = {1, 2, 3} m, m = 12 kg);
          Free f(world -> b.a, position = {1, -2, 0.5} m, orientation = rotz(0.4)*rotx(0.7)*rotz(-1.3));
          frame other = world * roty(0.9);
          let axes[3, 3] = {components(other, direction(b.a, {1, 0, 0})), components(other, direction(b.a, {0, 1, 0})),
                            components(other, direction(b.a, {0, 0, 1}))} "rows: axes of the box in those of other";
          output J = transpose(axes)*inertia_tensor(b.a)*axes;
          experiment(stop = 0);
        end M;
        """
    )
    R = turn("Z", 0.4) @ turn("X", 0.7) @ turn("Z", -1.3)
    own = np.diag([13.0, 10.0, 5.0])
    (body,) = model.inertia(about="0.3, 0.1, -1").details["bodies"]
    assert np.allclose(body["tensor"], R @ own @ R.T, rtol=0, atol=1e-13)
    d = np.array([0.7, -2.1, 1.5])
    shifted = R @ own @ R.T + 12 * (d @ d * np.eye(3) - np.outer(d, d))
    assert np.allclose(body["tensor_about_point"], shifted, rtol=0, atol=1e-12)
    for moment, axis in zip(body["principal"], np.array(body["axes"]), strict=True):
        assert np.allclose(R @ own @ R.T @ axis, moment * axis, rtol=0, atol=1e-12)
    assert sorted(body["principal"]) == pytest.approx([5, 10, 13], rel=1e-13)
    solution = model.simulate(estimate_error=False)
    assert isinstance(solution, mechc.Solution)
    found = np.array([[float(solution[f"J[{i},{j}]"][0]) for j in (1, 2, 3)] for i in (1, 2, 3)])
    to = turn("Y", 0.9).T @ R
    assert np.allclose(found, to @ own @ to.T, rtol=0, atol=1e-13)


def test_turned_vector() -> None:
    """U94: active (1, -0.366, 1.366), passive (1, 1.366, -0.366)."""
    found = outputs("turned_vector")
    assert vector(found, "active") == pytest.approx([1, -0.3660254, 1.3660254], abs=5e-8)
    assert vector(found, "passive") == pytest.approx([1, 1.3660254, -0.3660254], abs=5e-8)


def test_axis_and_angle() -> None:
    """P8: (1, 0, 1)/sqrt(2), 60 degrees."""
    told = example("axis_and_angle").kinematics(of="R").details["rotations"]["R"]
    assert told["axis"] == pytest.approx([math.sqrt(0.5), 0, math.sqrt(0.5)], abs=1e-12)
    assert math.degrees(told["angle"]) == pytest.approx(60, abs=1e-10)


def test_racing_car() -> None:
    """U97: a = -s^2/a e_r + s' e_phi, with s' = 2 m/s^2 and s = 30 m/s."""
    found = example("racing_car").kinematics().details["points"]["car"]
    assert found["polar"]["velocity"] == pytest.approx([0, 30], abs=1e-12)
    assert found["polar"]["acceleration"] == pytest.approx([-(30**2) / 50, 2], rel=1e-8)
    assert found["path"]["radius"] == pytest.approx(50, rel=1e-8)
    assert found["path"]["tangential"] == pytest.approx(2, rel=1e-8)


def test_curvilinear_coordinates() -> None:
    """U96: velocity and acceleration in polar, cylindrical and spherical coordinates, all of which change."""
    found = example("curvilinear").kinematics().details["points"]
    (r, r1, r2), (o, o1, o2), (f1, f2) = (1.3, 0.5, 0.3), (0.7, -0.6, -0.2), (0.8, 0.5)
    across = [r2 - r * f1**2, r * f2 + 2 * r1 * f1]
    s, c = math.sin(o), math.cos(o)
    expected = {
        ("flat", "polar"): ([r1, r * f1], across),
        ("tube", "cylindrical"): ([r1, r * f1, o1], [*across, o2]),
        ("space", "spherical"): (
            [r1, r * o1, r * s * f1],
            [
                r2 - r * o1**2 - r * f1**2 * s**2,
                r * o2 + 2 * r1 * o1 - r * f1**2 * s * c,
                r * s * f2 + 2 * r1 * f1 * s + 2 * r * o1 * f1 * c,
            ],
        ),
    }
    for (name, kind), (velocity, acceleration) in expected.items():
        assert found[name][kind]["velocity"] == pytest.approx(velocity, rel=1e-13), kind
        # of differences of sixth order
        assert found[name][kind]["acceleration"] == pytest.approx(acceleration, abs=1e-10), kind


def test_spinning_sphere() -> None:
    """U99: v e_theta + w R/sqrt(2) e_phi; -(v^2/R + w^2 R/2) e_r - w^2 R/2 e_theta + sqrt(2) v w e_phi."""
    found = example("spinning_sphere").kinematics().details["points"]["place"]["spherical"]
    R, w, v = 2.0, 0.7, 0.5
    assert found["velocity"] == pytest.approx([0, v, w * R / math.sqrt(2)], abs=1e-12)
    wanted = [-(v**2 / R + w**2 * R / 2), -(w**2) * R / 2, math.sqrt(2) * v * w]
    assert found["acceleration"] == pytest.approx(wanted, abs=1e-9)


def test_coriolis() -> None:
    """U104: 0.1031245 N east, 0.0240635 N; U105: 0.0683 m; U107: 670 m; U108: the same whatever the direction, to the right in the north, to
    the left in the south. P10."""
    found = outputs("coriolis")
    assert vector(found, "coriolis") == pytest.approx([0, 0.1031245, 0], abs=5e-8)
    assert vector(found, "centrifugal") == pytest.approx([0.0240635, 0, 0], abs=5e-8)
    assert found["tilt"] == pytest.approx(0.0683, abs=5e-5)
    assert found["from_height"] == pytest.approx(670, abs=0.5)
    sideways = 2 * 1000 * 7.292e-5 * math.sin(math.radians(45))
    south = example("coriolis").simulate(experiment="south", estimate_error=False).final()
    for k in range(1, 5):
        assert found[f"to_the_right[{k}]"] == pytest.approx(sideways, rel=1e-12)
        assert south[f"to_the_right[{k}]"] == pytest.approx(-sideways, rel=1e-12)


# ---------------------------------------------------------------- Hamilton's mechanics


@pytest.mark.slow
def test_hamilton_spring() -> None:
    """U146, P15: H = p^2/(2 m) + k q^2/2; U148, T24, P16: exchange is canonical; T25: I = E/w; U65: m a = -dV/dx,
    and the action from the start is -(k q0^2/4 w) sin(2 w t)."""
    model = example("hamilton_spring")
    found = model.hamilton().details
    assert found["H"] == "1/2*k*q^2 + 1/2*p_q^2/m"
    assert found["equations"] == {"der(q)": "p_q/m", "der(p_q)": "-k*q"}
    assert model.brackets(canonical="P=q, Q=-p").details["canonical"] is True
    assert model.brackets(canonical="P=p^2/(2*m) + k*q^2/2, Q=sqrt(m/k)*atan2(sqrt(k*m)*q, p)").details[
        "canonical"
    ]
    twice = model.brackets(canonical="P=2*p, Q=q").details
    assert twice["canonical"] is False and twice["multiplier"] == pytest.approx(2, rel=1e-14)
    wrong = model.brackets(canonical="P=q, Q=p").details
    assert wrong["canonical"] is False and wrong["multiplier"] == pytest.approx(-1, rel=1e-14)
    action = model.action()
    w = math.sqrt(5 / 2)
    assert action["I"] == pytest.approx(0.5 * 5 * 1**2 / w, rel=1e-9)
    assert action["period"] == pytest.approx(2 * math.pi / w, rel=1e-9)
    for stop in (1.3, 2 * math.pi / w):
        S = model.action(stop=stop)["S"]
        assert pytest.approx(-5 / (4 * w) * math.sin(2 * w * stop), abs=1e-10) == S


def test_hamilton_pendulum() -> None:
    """U147: H = p^2/(2 m a^2) - m g a cos(theta)."""
    found = example("hamilton_pendulum").hamilton().details
    assert found["H"] == "-a*g*m*cos(theta) + 1/2*p_theta^2/(a^2*m)"
    assert found["equations"] == {"der(theta)": "p_theta/(a^2*m)", "der(p_theta)": "-a*g*m*sin(theta)"}


def test_relativistic_particle() -> None:
    """T23: H = sqrt(p^2 c^2 + m^2 c^4), and q' = c^2 p/H."""
    found = example("relativistic_particle").hamilton().details
    assert found["H"] == "sqrt(c^4*m^2 + c^2*p_x^2 + c^2*p_y^2)"
    c, m, px, py = sympy.symbols("c m p_x p_y")
    for name, p in (("x", px), ("y", py)):
        rate = sympy.sympify(
            found["equations"][f"der({name})"].replace("^", "**"), locals={"p_x": px, "p_y": py}
        )
        assert sympy.simplify(rate - c**2 * p / sympy.sqrt(c**4 * m**2 + c**2 * px**2 + c**2 * py**2)) == 0


def test_angular_momentum() -> None:
    """T17, U150: {M_x, M_y} = M_z and so on in Goldstein's sign; all commute with H, [p, q] = -{p, q} = 1 in the notes' sign."""
    found = example("angular_momentum").brackets().details
    table = {(one["f"], one["g"]): one["bracket"] for one in found["brackets"]}
    assert [table["Mx", "My"], table["Mx", "Mz"], table["My", "Mz"]] == ["Mz", "-My", "Mx"]
    assert table["x", "p_x"] == "1" and table["x", "p_y"] == "0"
    assert {"Mx", "My", "Mz"} <= set(found["commute_with_H"])


def test_noether() -> None:
    """T2, K5, P18: energy, momentum and angular momentum, with their reasons."""
    found = {one["name"]: one["conserved"] for one in example("noether").symmetries().details["symmetries"]}
    assert found["translation along x1, x2"] == "m1*der(x1) + m2*der(x2)"
    assert (
        found["rotation in y1, x1, y2, x2"] == "m1*x1*der(y1) - m1*y1*der(x1) + m2*x2*der(y2) - m2*y2*der(x2)"
    )
    kinetic = " + ".join(f"1/2*m{i}*der({x}{i})^2" for i in (1, 2) for x in "xy")
    assert found["translation in time"] == f"{kinetic} + k/sqrt((x1 - x2)^2 + (y1 - y2)^2)"
    assert found["translation along y1, y2"] == "m1*der(y1) + m2*der(y2)"
    assert len(found) == 7


def test_runge_lenz_vector_of_kepler() -> None:
    """T5: v x M - r/|r| is constant (its x component: y' (x y' - y x') - x/r)."""
    found = example("kepler").invariants().details
    assert "x/sqrt(x^2 + y^2) + y*der(x)*der(y) - x*der(y)^2" in [
        one["formula"] for one in found["invariants"]
    ]


@pytest.mark.slow
def test_toda() -> None:
    """One constant of degree 3 beside those of lower degree."""
    toda = example("toda").invariants(degree=3).details
    assert [one["degree"] for one in toda["invariants"]] == [1, 2, 3]
    assert toda["invariants"][2]["drift"] < 1e-8


@pytest.mark.slow
def test_kovalevskaya() -> None:
    found = example("kovalevskaya").invariants(degree=4).details
    assert [one["degree"] for one in found["invariants"]] == [1, 2, 4]
    assert max(one["drift"] for one in found["invariants"]) < 1e-8


def test_energy_of_a_well() -> None:
    """x^4/4 - x^2/2 = -3/16 at x^2 = 1 -+ 1/2: two intervals; the one at energy 0.1 joins them."""
    text = (
        "model Well dimensionless; coordinate x(min = -2, max = 2) = sqrt(1.5); kinetic 1/2*der(x)^2; "
        "potential x^4/4 - x^2/2; experiment(stop = 1); end Well;"
    )
    found = mechc.loads(text).energy().details["region"]
    edges = [math.sqrt(0.5), math.sqrt(1.5)]
    assert np.array(found) == pytest.approx(np.array([[-edges[1], -edges[0]], edges]), abs=1e-12)
    joined = mechc.loads(text).energy(set={"x": 1.6}).details["region"]
    assert len(joined) == 1
