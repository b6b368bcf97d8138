"""Phase space: volumes, brackets, canonical transformations, Hamilton's and Jacobi's functions (T17, T24, T25, P16, U149, U150)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from gallery import load, run
from scipy.linalg import expm

import mechc

PLANE = """\
model Plane
  dimensionless;
  parameter gamma = 0;
  coordinate x = 0.7;
  coordinate y = -0.4;
  initial der(x) = 0.3;
  initial der(y) = 0.9;
  kinetic 1/2*(der(x)^2 + 2*der(y)^2) + 0.3*x*der(x)*der(y);
  potential x^4/4 + y^2/2 + x*y^2/5;
  damping gamma on y;
end Plane;
"""
"""Two freedoms that are coupled in the kinetic energy and in the potential."""


@pytest.fixture(scope="module")
def plane() -> mechc.Model:
    return mechc.loads(PLANE)


# ---------------------------------------------------------------- volumes


@pytest.mark.parametrize("damping", [0.0, 0.2])
def test_volume_of_states_of_two_freedoms(plane: mechc.Model, damping: float) -> None:
    """U149 in four dimensions: kept without damping; p_y' = ... - gamma y' shrinks it at gamma times dy'/dp_y, which is 1/(2 - 0.09 x^2)."""
    found = plane.volume(stop=5, set={"gamma": damping}).summary()
    motion = plane.simulate(stop=5, tolerance=1e-11, set={"gamma": damping})
    assert isinstance(motion, mechc.Solution)
    t = np.linspace(0, 5, 2001)
    rate = damping / (2 - 0.09 * motion(t)["x"] ** 2)
    shrunk = np.sum((rate[1:] + rate[:-1]) / 2 * np.diff(t))  # the trapezium rule
    assert found["values"]["ratio"] == pytest.approx(math.exp(-shrunk), rel=1e-6)


# ---------------------------------------------------------------- brackets


def brackets(model: mechc.Model, of: str | None = None) -> dict[tuple[str, str], str]:
    found = (model.brackets(of=of) if of else model.brackets()).details["brackets"]
    return {(one["f"], one["g"]): one["bracket"] for one in found}


def test_rate_of_a_quantity_is_its_bracket_with_h() -> None:
    """U150: df/dt = [H, f] and [p, q] = 1 in the notes' sign, whose bracket is the negative of this one: f = q p changes at p^2/m -
    k q^2, as along the run."""
    model = load("hamilton_spring")
    table = brackets(model, "q*p_q, p_q^2/m - k*q^2, q, p_q, p_q/m, -k*q")
    assert table["q", "p_q"] == "1"
    assert table["q*p_q", "H"] == "(p_q^2/m - k*q^2)"
    assert table["q", "H"] == "1/2*p_q" and table["p_q", "H"] == "-5*q"  # m = 2, k = 5
    solution = run("hamilton_spring")
    q, p = solution["q"], 2 * solution["der(q)"]
    t = solution.time
    middle = (p**2 / 2 - 5 * q**2)[1:-1]
    rate = np.gradient(q * p, t)[1:-1]
    assert rate == pytest.approx(middle, abs=(2 * math.sqrt(2.5) * (t[1] - t[0])) ** 2 / 6 * 5 * 1.01)


def test_momenta_of_vectors_of_parts_in_arrays_and_of_cyclic_coordinates() -> None:
    """The formula p_x[1] was an unknown name, and p_phi of a cyclic coordinate 'a vector'."""
    model = mechc.loads(
        "model Mass  coordinate Length x[2] = {1, 2} m; coordinate Angle phi = 0 rad;"
        "kinetic 1/2*1 kg*(der(x[1])^2 + der(x[2])^2) + 1/2*1 kg.m^2*der(phi)^2; potential 1/2*1 N/m*x[1]^2*x[2]^2/(1 m^2); end Mass;"
        "model M  Mass m[2]; end M;"
    )
    table = brackets(
        model, "m[2].x[1]*p_m[2].x[2], m[2].x[2], p_m[1].phi, m[1].phi, m[2].x[1], p_m[2].x[ 2 ]"
    )
    assert table["m[2].x[1]*p_m[2].x[2]", "m[2].x[2]"] == "-(m[2].x[1])"
    assert table["p_m[1].phi", "m[1].phi"] == "-1" and table["p_m[1].phi", "H"] == "0"
    assert table["m[2].x[1]", "p_m[2].x[ 2 ]"] == "0" and table["m[2].x[2]", "p_m[2].x[ 2 ]"] == "1"


def test_angular_momenta_in_four_dimensions() -> None:
    """T17: of J_ij = p_i x_j - p_j x_i, here {J_ij, J_jk} = J_ik in Goldstein's sign, as {M_x, M_y} = M_z; those without a common index
    commute, and all are constant in a central field."""
    rows = ["model Space", "  dimensionless;"]
    rows += [f"  coordinate x{i} = {0.3 * i};" for i in range(1, 5)]
    rows += [
        "  initial der(x1) = 1;",
        "  kinetic 1/2*(" + " + ".join(f"der(x{i})^2" for i in range(1, 5)) + ");",
    ]
    rows += ["  potential -1/sqrt(x1^2 + x2^2 + x3^2 + x4^2);"]
    pairs = [(i, j) for i in range(1, 5) for j in range(i + 1, 5)]
    rows += [f"  output J{i}{j} = momentum(x{i})*x{j} - momentum(x{j})*x{i};" for i, j in pairs]
    model = mechc.loads("\n".join([*rows, "  experiment(stop = 1);", "end Space;"]))
    found = model.brackets().details
    table = {(one["f"], one["g"]): one["bracket"] for one in found["brackets"]}

    def J(i: int, j: int) -> str:
        return f"J{i}{j}" if i < j else f"-J{j}{i}"

    for a, (i, j) in enumerate(pairs):
        for k, l in pairs[a + 1 :]:
            common = {i, j} & {k, l}
            if not common:
                wanted = "0"
            else:
                (c,) = common
                first = 1 if c == j else -1  # J_ij = -J_ji
                second = 1 if c == k else -1
                free, other = ({i, j} - common).pop(), ({k, l} - common).pop()
                text = J(free, other)
                wanted = (
                    text if first * second == 1 else text.removeprefix("-") if text[0] == "-" else f"-{text}"
                )
            assert table[J(i, j), J(k, l)] == wanted, (i, j, k, l)
    assert {J(i, j) for i, j in pairs} <= set(found["commute_with_H"])


# ---------------------------------------------------------------- canonical transformations


def linear(matrix: Any) -> str:
    """Return the transformation (Q1, Q2, P1, P2) = matrix (x, y, p_x, p_y) as text."""
    old, new = ("x", "y", "p_x", "p_y"), ("Q1", "Q2", "P1", "P2")
    rows = (" + ".join(f"({float(v)!r})*{q}" for v, q in zip(row, old, strict=True)) for row in matrix)
    return ", ".join(f"{name} = {text}" for name, text in zip(new, rows, strict=True))


def test_symplectic_matrices(plane: mechc.Model) -> None:
    """P16: canonical where M J M^T = J, and nowhere else; the brackets of the new variables are those of J."""
    J = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.eye(2), np.zeros((2, 2))]])
    rng = np.random.default_rng(7)
    root = rng.normal(size=(4, 4))
    M = expm(0.3 * J @ (root + root.T))
    assert np.allclose(M @ J @ M.T, J, rtol=0, atol=1e-13)
    found = plane.brackets(canonical=linear(M)).details
    assert found["canonical"] is True
    table = {(one["f"], one["g"]): one["bracket"] for one in found["brackets"]}
    assert len(table) == 6 and table == {(a, b): "1" if a[1] == b[1] else "0" for a, b in table}
    bent = M + 1e-3 * np.outer([1, 0, 0, 0], [0, 0, 0, 1])
    assert not np.allclose(bent @ J @ bent.T, J, rtol=0, atol=1e-4)
    assert plane.brackets(canonical=linear(bent)).details["canonical"] is False


def test_generated_transformations(plane: mechc.Model) -> None:
    """T24: those of generating functions are canonical: {Q_i, P_k} = delta_ik. F2 = x P1 + y P2 + x^2 P2 gives Q1 = x, Q2 = y + x^2,
    p_x = P1 + 2 x P2, p_y = P2; F1 = x Q1 + y Q2 the exchange; polar coordinates are a point transformation."""
    point = "Q1 = x, Q2 = y + x^2, P1 = p_x - 2*x*p_y, P2 = p_y"
    exchange = "Q1 = p_x, Q2 = p_y, P1 = -x, P2 = -y"
    polar = "Q1 = sqrt(x^2 + y^2), Q2 = atan2(y, x), P1 = (x*p_x + y*p_y)/sqrt(x^2 + y^2), P2 = x*p_y - y*p_x"
    for text in (point, exchange, polar):
        assert plane.brackets(canonical=text).details["canonical"] is True, text
    for text in (
        point.replace("- 2*x", "+ 2*x"),
        exchange.replace("-y", "y"),
        polar.replace("x*p_y - y*p_x", "x*p_y"),
    ):
        assert plane.brackets(canonical=text).details["canonical"] is False, text


# ---------------------------------------------------------------- Hamilton's and Jacobi's functions


UNIFORM = """\
model Uniform
  dimensionless;
  parameter m = 1.5;
  parameter F = 0.8;
  coordinate x = 0.4;
  initial der(x) = 0.3;
  kinetic 1/2*m*der(x)^2;
  potential -F*x;
  experiment(tolerance = 1e-11);
end Uniform;
"""


def test_action_in_a_uniform_field() -> None:
    """T25: S = m (x - x0)^2/(2 t) + F t (x + x0)/2 - F^2 t^3/(24 m) and W = S + E t = [(2 m (E + F x))^(3/2)]/(3 m F); dW/dx = p, and
    beta = dW/dE - t is what stays, so that x = F t^2/(2 m) + ..."""
    m, F, x0, v0 = 1.5, 0.8, 0.4, 0.3
    E = m * v0**2 / 2 - F * x0
    model = mechc.loads(UNIFORM)
    for t in (0.7, 2.5):
        x = x0 + v0 * t + F * t**2 / (2 * m)
        found = model.action(stop=t)
        assert found["S"] == pytest.approx(
            m * (x - x0) ** 2 / (2 * t) + F * t * (x + x0) / 2 - F**2 * t**3 / (24 * m), rel=1e-9
        )
        cubes = [(2 * m * (E + F * place)) ** 1.5 for place in (x0, x)]
        assert found["W"] == pytest.approx((cubes[1] - cubes[0]) / (3 * m * F), rel=1e-9)
        end = model.simulate(stop=t)(t)
        assert end["x"] == pytest.approx(x, rel=1e-9)
        assert end["der(x)"] == pytest.approx(math.sqrt(2 * m * (E + F * x)) / m, rel=1e-9)  # dW/dx


def test_an_output_that_is_zero_is_part_of_no_sum() -> None:
    """Rates of momenta are sums of forces, beside the drag of a damper that is turned off."""
    text = """\
model Plane
  parameter c = 0 N.s/m;
  coordinate x = 0.1 m;
  coordinate y = 0.3 m;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1/2*3 N/m*x^2 + 2 N/m*y^2 + 1 N/m*x*y;
  output drag = -c*der(x);
end Plane;
"""
    found = mechc.loads(text).brackets().details["brackets"]
    told = {(one["f"], one["g"]): one["bracket"] for one in found}
    assert told["drag", "H"] == told["drag", "x"] == "0"
    assert told["p_x", "H"] == "-3*x - y" and told["p_y", "H"] == "-x - 4*y"


def test_a_lagrangian_with_accelerations_has_no_such_equations() -> None:
    """Its momentum m q'/2 is half of that of the oscillator which it is."""
    model = mechc.loads("dimensionless; coordinate q = 1; lagrangian -1/2*2*q*der(q, 2) - 1/2*3*q^2;")
    with pytest.raises(mechc.SimulationError, match="holds accelerations"):
        model.study("hamilton")


def test_momenta_that_are_constant_beside_large_terms() -> None:
    """Their rates are zero at all states, and were divided by 1e-300: the study ended with an overflow."""
    model = mechc.loads(
        "parameter Mass m[2] = {20, 10} kg; coordinate Length x[2] = {0, 1000} m;"
        "kinetic 1/2*m[1]*der(x[1])^2 + 1/2*m[2]*der(x[2])^2; potential 1/2*1 N/m*x[1]^2;"
    )
    found = model.hamilton().summary()
    assert found["H"] == "1/2*x[1]^2 + 1/2*p_x[1]^2/m[1] + 1/2*p_x[2]^2/m[2]"
    assert found["equations"]["der(p_x[2])"] == "0" and found["equations"]["der(p_x[1])"] == "-x[1]"


def test_the_equations_of_a_rotation_name_its_angular_velocity() -> None:
    """Euler's equations: der(R)[1] = p_1/J_1, and p' = p x w; der(R[1]) would be the rate of a number of the quaternion."""
    text = """
model Free
  coordinate Rotation R = rotx(20 deg);
  initial der(R) = {1, 2, 0.1} rad/s;
  frame body = world*R;
  inertia diag({1, 2, 3} kg.m^2) on body;
end Free;
"""
    equations = mechc.loads(text).hamilton().details["equations"]
    assert equations["der(R)[2]"] == "1/2*p_R[2]" and equations["der(p_R[2])"] == "2/3*p_R[1]*p_R[3]"
    assert not any(name.startswith("der(R[") for name in equations)


SLIDES = """
model Slides
  coordinate Length x = 1 m;
  initial der(x) = VELOCITY;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*16 N/m*x^2;
  friction 0.3 N on x;
  experiment(stop = 5 s);
end Slides;
"""


@pytest.mark.parametrize(("velocity", "sign"), [("0 m/s", "-"), ("-1 m/s", "-"), ("1 m/s", "+")])
def test_dry_friction_takes_energy_between_events_too(velocity: str, sign: str) -> None:
    """While it slides one way, the friction is a constant force: x'^2/2 + 8 x^2 +/- 0.3 x is constant, and the energy is not."""
    model = mechc.loads(SLIDES.replace("VELOCITY", velocity))
    (one,) = model.symmetries().details["symmetries"]
    assert one["conserved"] == f"1/2*der(x)^2 + 8*x^2 {sign} 3/10*x" and 0 < one["drift"] < 1e-6
    (other,) = model.invariants().details["invariants"]
    assert other["formula"] == f"5*der(x)^2 + 80*x^2 {sign} 3*x" and 0 < other["drift"] < 1e-6


def test_constants_of_what_a_contact_holds_have_no_drift_beside_it() -> None:
    """A block that slides on a floor: the constants are those of its flight, which the run has none of."""
    model = mechc.loads("""
model Floor
  coordinate Length x = 0 m;
  coordinate Length y = 0 m;
  initial der(x) = 3 m/s;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1 kg*9.81 m/s^2*y;
  contact floor: y friction 0.2 along der(x);
  experiment(stop = 1 s);
end Floor;
""")
    found = model.symmetries()
    assert all(one["drift"] is None for one in found.details["symmetries"])
    assert any("'floor' too, which the motion begins on" in remark for remark in found.remarks)
    assert any("no drift" in remark for remark in found.remarks)
    assert not any("der(x)" in one.name for one in model.simulate(constants=True).accuracy.conserved)
