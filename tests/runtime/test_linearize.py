"""Linear systems near a state: against SymPy, against models in other coordinates, against differences."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from numpy.typing import NDArray
from sympy.physics.mechanics import (
    LagrangesMethod,
    Particle,
    Point,
    ReferenceFrame,
    dynamicsymbols,
)

import mechc
from mechc.cli.main import run as run_command
from mechc.runtime.case import SimulationOptions
from mechc.runtime.local.equilibrium_feasibility import arrived
from mechc.runtime.local.independent_coordinates import independent
from mechc.runtime.local.operating_point import Site, edges, site_of
from mechc.runtime.local.zeros import poles, zeros
from mechc.runtime.outcome import SimulationError
from mechc.runtime.settings import EQUILIBRIUM, Place
from mechc.runtime.studies.kinds.linearize import Linearization, Linearize

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.mech"))
Array = NDArray[np.float64]

CART_POLE = """\
model CartPole
  parameter M = 1 kg;
  parameter m = 0.2 kg;
  parameter l = 0.6 m;
  parameter c = 0.3 N.s/m;
  parameter g = 9.81 m/s^2;
  input Force u = 0 N;
  input Torque w = 0 N.m;
  coordinate x = 0 m;
  coordinate phi = 0 rad;
  kinetic 1/2*(M+m)*der(x)^2 + m*l*cos(phi)*der(x)*der(phi) + 1/2*m*l^2*der(phi)^2;
  potential m*g*l*cos(phi);
  damping c on x;
  force u on x;
  force w on phi;
  output tip = x + l*sin(phi);
end CartPole;
"""


def linear(model: mechc.Model, **settings: Any) -> Linearization:
    found = model.study("linearize", **settings)
    assert isinstance(found, Linearization)
    return found


def close(found: Array, wanted: Any, tolerance: float = 1e-13) -> None:
    """Compare entries of matrices; the tolerance is a few roundings of the largest entry."""
    wanted = np.array(wanted, dtype=float)
    assert found.shape == wanted.shape
    assert np.abs(found - wanted).max(initial=0.0) <= tolerance * max(1.0, np.abs(wanted).max(initial=0.0))


def test_cart_and_pole_against_the_linearizer_of_sympy() -> None:
    x, phi, u, w = dynamicsymbols("x phi u w")
    mass, m, length, c, g = 1.0, 0.2, 0.6, 0.3, 9.81
    t = dynamicsymbols._t
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    cart, bob = origin.locatenew("C", x * frame.x), Point("P")
    cart.set_vel(frame, x.diff(t) * frame.x)
    bob = cart.locatenew("P", length * (sp.sin(phi) * frame.x + sp.cos(phi) * frame.y))
    bob.set_vel(frame, bob.pos_from(origin).dt(frame))
    bodies = [Particle("c", cart, mass), Particle("b", bob, m)]
    bodies[1].potential_energy = m * g * length * sp.cos(phi)
    kinetic = sum(b.kinetic_energy(frame) for b in bodies)
    turning = ReferenceFrame("T")
    turning.set_ang_vel(frame, phi.diff(t) * frame.z)
    forces = [(cart, (u - c * x.diff(t)) * frame.x), (turning, w * frame.z)]
    method = LagrangesMethod(kinetic - m * g * length * sp.cos(phi), [x, phi], forcelist=forces, frame=frame)
    method.form_lagranges_equations()
    rest = {x: 0, phi: 0, x.diff(t): 0, phi.diff(t): 0}
    a, b, inputs = method.linearize(
        q_ind=[x, phi], qd_ind=[x.diff(t), phi.diff(t)], A_and_B=True, op_point=rest
    )
    order = [list(inputs).index(s) for s in (u, w)]
    found = linear(mechc.loads(CART_POLE), inputs="u,w", outputs="tip,x")
    close(found.A, a)
    close(found.B, np.array(b, dtype=float)[:, order])
    close(found.C, [[1, length, 0, 0], [1, 0, 0, 0]])
    close(found.D, np.zeros((2, 2)))
    assert [q.name for q in found.states] == ["x", "phi", "der(x)", "der(phi)"]
    assert [q.unit for q in found.states] == ["m", "rad", "m/s", "rad/s"]


def test_a_double_pendulum_off_its_equilibrium_against_sympy() -> None:
    """At any state: A is the derivative of the rates there."""
    text = """\
model D
  dimensionless;
  input tau = 0.4;
  coordinate a = 0.5; coordinate b = -1.2;
  kinetic der(a)^2 + 1/2*der(b)^2 + cos(a - b)*der(a)*der(b);
  potential -2*cos(a) - cos(b);
  force tau - 0.1*der(b)^3 on b;
end D;
"""
    t = sp.Symbol("t")
    a, b = (sp.Function(n)(t) for n in "ab")
    tau = sp.Symbol("tau")
    da, db = a.diff(t), b.diff(t)
    energy = da**2 + db**2 / 2 + sp.cos(a - b) * da * db + 2 * sp.cos(a) + sp.cos(b)
    left = [energy.diff(d).diff(t) - energy.diff(q) for q, d in ((a, da), (b, db))]
    left[1] -= tau - sp.Rational(1, 10) * db**3
    rates = sp.solve(left, [a.diff(t, 2), b.diff(t, 2)])
    s = sp.symbols("A B C D")
    rates = [
        sp.expand(rates[q.diff(t, 2)]).subs({da: s[2], db: s[3]}).subs({a: s[0], b: s[1]}) for q in (a, b)
    ]
    place = dict(zip((*s, tau), (0.7, -0.4, 1.1, 0.3, 0.4), strict=True))
    bottom = sp.Matrix(rates).jacobian([*s, tau]).evalf(40, subs=place)
    found = linear(mechc.loads(text), at="a = 0.7, b = -0.4, der(a) = 1.1, der(b) = 0.3")
    close(found.A[2:], bottom[:, :4])
    close(found.B[2:], bottom[:, 4:])
    assert any("not an equilibrium" in remark for remark in found.remarks)


@pytest.mark.parametrize("rate", [7.0, 2.0])
def test_a_rolling_disk(rate: float) -> None:
    """A thin disk that rolls upright: lambda^2 = 4 g/(5 r) - 12/5 Omega^2, stable above Omega^2 = g/(3 r)."""
    r, g = 0.5, 9.81
    text = f"""\
model Disk
  parameter r = {r} m;
  parameter m = 2 kg;
  coordinate Length x = 0 m; coordinate Length y = 0 m;
  coordinate yaw = 0 rad; coordinate lean = 0 rad; coordinate roll = 0 rad;
  kinetic 1/2*m*(der(x)^2 + der(y)^2 + (r*sin(lean)*der(lean))^2)
    + 1/2*m*r^2*(1/4*der(lean)^2 + 1/4*(der(yaw)*cos(lean))^2 + 1/2*(der(roll) + der(yaw)*sin(lean))^2);
  potential m*({g} m/s^2)*r*cos(lean);
  constraint der(x) = r*(der(roll)*cos(yaw) + der(lean)*cos(lean)*sin(yaw) + der(yaw)*sin(lean)*cos(yaw));
  constraint der(y) = r*(der(roll)*sin(yaw) - der(lean)*cos(lean)*cos(yaw) + der(yaw)*sin(lean)*sin(yaw));
end Disk;
"""
    found = linear(mechc.loads(text), at=f"der(roll) = {rate}, der(x) = {r * rate}")
    assert len(found.states) == 8 and found.zeros is None
    squared = 4 * g / (5 * r) - 12 / 5 * rate**2
    swinging = found.poles[np.abs(found.poles) > 0.1]
    assert len(swinging) == 2
    assert np.abs(swinging**2 - squared).max() < 1e-12 * abs(squared)


def test_a_loop_is_the_same_system_as_its_minimal_twin() -> None:
    """A pendulum in Cartesian coordinates after a constraint, against that in its angle."""
    plain = """\
model P
  parameter l = 0.8 m;
  input Torque u = 0 N.m;
  coordinate th = 0 rad;
  kinetic 1/2*(2 kg)*l^2*der(th)^2;
  potential -(2 kg)*(9.81 m/s^2)*l*cos(th);
  damping 0.3 N.m.s on th;
  force u on th;
  output h = l*sin(th);
end P;
"""
    loop = """\
model P
  parameter l = 0.8 m;
  input Torque u = 0 N.m;
  coordinate Length x = l*sin(0.6); coordinate Length y = -l*cos(0.6);
  let th = atan2(x, -y);
  kinetic 1/2*(2 kg)*(der(x)^2 + der(y)^2);
  potential (2 kg)*(9.81 m/s^2)*y;
  constraint x^2 + y^2 = l^2;
  damping 0.3 N.m.s on th;
  force u on th;
  output h = x;
end P;
"""
    for where in ({}, {"at": "equilibrium"}):
        at = where or {"at": "th = 0.6"}
        one = linear(mechc.loads(plain), outputs="h", **at)
        two = linear(mechc.loads(loop), outputs="h", **where)
        assert len(two.states) == 2
        assert two.states[0].name in ("x", "y")
        s = np.array([0.3j, 2.0 + 1j, -4.0 + 0.5j])
        if where:  # at rest the transfer function does not depend on the coordinates
            for value in s:
                gains = [f.C @ np.linalg.solve(value * np.eye(2) - f.A, f.B) for f in (one, two)]
                assert abs(gains[0] - gains[1]).max() < 1e-12
            assert np.abs(np.sort_complex(one.poles) - np.sort_complex(two.poles)).max() < 1e-12


@pytest.mark.parametrize("spin", [8.0, 30.0])
def test_a_sleeping_top(spin: float) -> None:
    """Upright with spin n its axis moves by A z'' - i C n z' - m g d z = 0; its turns are told in the frame of the body,
    which turns with n: each pole is shifted by -i n."""
    a, c, mgl = 0.25 + 0.5**2, 0.2, 9.81 * 0.5
    found = linear(
        mechc.load(ROOT / "examples" / "heavy_top_rotation.mech"),
        at=f"R = {{1, 0, 0, 0}}, der(R) = {{0, 0, {spin}}}",
    )
    assert [q.name for q in found.states] == [f"{n}[{k}]" for n in ("R.turn", "der(R)") for k in (1, 2, 3)]
    axis = 1j * (np.roots([-a, c * spin, -mgl]) - spin)
    wanted = np.concatenate([axis, axis.conj(), [0, 0]])
    left = list(found.poles)
    for pole in wanted:
        nearest = min(left, key=lambda z: abs(z - pole))
        assert abs(nearest - pole) < 1e-12 * spin
        left.remove(nearest)


def test_the_quaternion_of_a_compound_pendulum_against_its_angle() -> None:
    """Turned about its hinge's axis a body on a ball joint swings with sqrt(m g d / A), in two directions."""
    model = mechc.load(ROOT / "examples" / "heavy_top_rotation.mech")
    hanging = linear(model, at="R = {0, 1, 0, 0}, der(R) = {0, 0, 0}")
    swinging = hanging.poles[np.abs(hanging.poles) > 1e-3]
    assert len(swinging) == 4 and np.abs(swinging.real).max() < 1e-9
    standing = linear(model, at="R = {1, 0, 0, 0}, der(R) = {0, 0, 0}")
    falling = standing.poles[np.abs(standing.poles) > 1e-3]
    # the same potential upside down: the same squares with the other sign
    assert (
        np.abs(np.sort(swinging.imag**2) - np.sort(falling.real**2)).max() < 1e-11 * falling.real.max() ** 2
    )


@pytest.mark.parametrize(
    ("a", "b", "c", "d", "wanted"),
    [
        ([[0, 1], [-2, -3]], [[0], [1]], [[5, 1]], [[0]], [-5]),
        ([[0, 1, 0], [0, 0, 1], [-6, -11, -6]], [[0], [0], [1]], [[1, 0, 0]], [[0]], []),
        ([[-1, 0], [0, -2]], [[1], [1]], [[1, 1]], [[1]], [-3 - 1 / 2 + 1.5, -3]),
        (
            np.diag([-1.0, -2, -3]),
            np.eye(3)[:, :2] + np.eye(3)[:, 1:],
            [[1, 1, 0], [0, 1, 1]],
            np.zeros((2, 2)),
            None,
        ),
    ],
)
def test_zeros(a: Any, b: Any, c: Any, d: Any, wanted: Any) -> None:
    """Where the matrix [[A - s, B], [C, D]] loses rank; of one input and output the numerator's roots."""
    system = [np.array(m, dtype=float) for m in (a, b, c, d)]
    found = zeros(*system)
    assert found is not None
    a, b, c, d = system
    n = len(a)
    for s in found:
        whole = np.block([[a - s * np.eye(n), b], [c, d]])
        values = np.linalg.svd(whole, compute_uv=False)
        assert values[-1] < 1e-9 * values[0]
    if wanted is not None:
        numerator = np.poly(a - b @ c) + (d[0, 0] - 1) * np.poly(a)
        roots = np.roots(np.where(np.abs(numerator) < 1e-9, 0, numerator))
        assert (
            len(found) == len(roots)
            and np.abs(np.sort_complex(found) - np.sort_complex(roots)).max(initial=0) < 1e-9
        )


def test_poles_of_double_roots_say_that_they_cannot_be_told() -> None:
    assert poles(np.array([[0.0, 1.0], [0.0, 0.0]]))[1] == [None, None]
    values, errors = poles(np.array([[0.0, 1.0], [-4.0, 0.0]]))
    assert all(error is not None and error < 1e-14 for error in errors)
    assert np.abs(np.abs(values.imag) - 2).max() < 1e-14


def test_sampled_systems_and_those_of_other_programs(tmp_path: Path) -> None:
    from scipy.io import loadmat
    from scipy.signal import cont2discrete

    model = mechc.loads(CART_POLE)
    found = linear(model, inputs="u", outputs="x,phi")
    held = linear(model, inputs="u", outputs="x,phi", sample="20 ms")
    a, b, c, _d, period = cont2discrete((found.A, found.B, found.C, found.D), 0.02)
    close(held.A, a)
    close(held.B, b)
    assert held.period == period and held.signal().dt == period
    assert (found.signal().A == found.A).all() and found.signal().dt is None
    close(held.C, c)
    file = tmp_path / "cart.mech"
    file.write_text(CART_POLE, encoding="utf-8")
    for name in ("x.npz", "x.mat", "x.json"):
        assert (
            run_command(["study", "linearize", str(file), "--inputs", "u", "-o", str(tmp_path / name)]) == 0
        )
    assert (np.load(tmp_path / "x.npz")["A"] == found.A).all()
    assert (loadmat(tmp_path / "x.mat")["A"] == found.A).all()
    written = json.loads((tmp_path / "x.json").read_text(encoding="utf-8"))
    assert written["A"] == found.A.tolist() and written["inputs"] == ["u"] and written["outputs"] == ["tip"]
    assert [complex(*z) for z in written["poles"]] == list(found.poles)


def test_python_control() -> None:
    control = pytest.importorskip("control")
    found = linear(mechc.loads(CART_POLE), inputs="u", outputs="phi")
    system = found.control()
    assert system.input_labels == ["u"] and system.output_labels == ["phi"]
    assert found.zeros is not None
    assert np.abs(np.sort(control.zeros(system).real) - np.sort(found.zeros.real)).max() < 1e-9


@pytest.mark.parametrize("speed", [0.0, 0.3])
def test_resistance_by_the_square_of_the_speed(speed: float) -> None:
    """Of force -k |v| v the derivative is -k (|v| 1 + v v^T/|v|): nothing at rest, where the root in it has none."""
    found = linear(
        mechc.loads("""
        import mech.planar.*;
        import mech.fields.*;
        Body b(m = 2 kg, J = 1 kg.m^2);
        Free j(world -> b.a);
        QuadraticDrag air(to = b.a, k = 0.7 kg/m);
        """),
        at=f"der(j.x) = {speed}, der(j.y) = {2 * speed}",
    )
    v = np.array([speed, 2 * speed])
    size = float(np.linalg.norm(v))
    wanted = -0.7 / 2 * (size * np.eye(2) + (np.outer(v, v) / size if size else 0))
    rates = [k for k, q in enumerate(found.states) if q.name in ("der(j.x)", "der(j.y)")]
    assert found.A[np.ix_(rates, rates)] == pytest.approx(wanted, abs=1e-14)


@pytest.mark.slow
def test_what_has_no_linear_system_is_refused() -> None:
    well = "model W dimensionless; coordinate x = {start}; kinetic 1/2*der(x)^2; {more} end W;"

    def told(start: float, more: str, **settings: Any) -> str:
        with pytest.raises(SimulationError) as caught:
            linear(mechc.loads(well.format(start=start, more=more)), **settings)
        return str(caught.value)

    assert "stands at its edge" in told(0, "force (if x > 0 then 3*x else x) on x;")
    assert "a derivative is undefined here: of the rate of 'der(x)' by 'x'" in told(0, "force -sqrt(x) on x;")
    assert "'der(x)' is not an input" in told(1, "", inputs="der(x)")
    assert "no equilibrium was found" in told(1, "force 1 + x^2 on x;", at="equilibrium")
    assert "depends on time" in told(1, "force sin(time) on x;", at="equilibrium")
    assert "the period of sampling is positive" in told(1, "", sample=-1)
    drop = mechc.load(ROOT / "examples" / "bouncing_ball.mech")
    assert linear(drop).states
    assert not linear(drop, at="h = 0").states  # it lies on the ground
    with pytest.raises(mechc.UsageMistake, match="has no coordinate"):
        linear(mechc.loads(well.format(start=0, more="")), outputs="xx")


def test_a_state_that_depends_on_time_says_so() -> None:
    text = "model W dimensionless; coordinate x = 1; kinetic 1/2*der(x)^2; force -x*cos(time) on x; end W;"
    found = linear(mechc.loads(text))
    close(found.A, [[0, 1], [-1, 0]])
    assert any("depends on time" in remark for remark in found.remarks)


def differences(site: Site, y: Array) -> float:
    """Compare A with differences of the rates along the independent coordinates; return how far it is off."""
    problem = site.problem
    if edges(site, y).sharp:
        return 0.0
    found = site.derivatives(y)
    free = independent(site.chart, found)
    h, n = 1e-6, site.chart.size
    off = 0.0
    scale = 1.0 + np.abs(found.rates @ free.tangent).max(initial=0.0)
    spin = np.zeros((n, n))  # rates of a turn are those of a body that turns itself
    for j, i in enumerate(site.chart.places):
        if i in problem.rotations and site.chart.places.index(i) == j:
            w = site.rates(y)[j : j + 3]
            spin[j : j + 3, j : j + 3] = -np.cross(np.eye(3), w).T @ np.eye(3)
    for k, along in enumerate(free.tangent.T):
        ahead, behind = (site.rates(site.chart.moved(y, sign * h * along)) for sign in (1, -1))
        change = (ahead - behind) / (2 * h)
        wanted = found.rates @ along
        mask = np.ones(n, dtype=bool)
        for j, i in enumerate(site.chart.places):
            mask[j] = i not in problem.rotations
        off = max(off, float(np.abs(change - wanted)[mask].max(initial=0.0)) / scale)
        assert k < n
    return off


BENDS = {
    "falling_strip": "drag and lift have no second derivative at rest: differences are off by their step",
}
"""Examples whose rates bend where they are looked at, which linearize does not tell."""


@pytest.mark.slow
@pytest.mark.parametrize("path", [p for p in EXAMPLES if p.stem not in BENDS], ids=lambda p: p.stem)
def test_examples_against_differences(path: Path) -> None:
    """Second differences of step 1e-6 are off by rounding over the step, 1e-10, times what conditions the rates."""
    model = mechc.load(path)
    problem = model.problem(parts=Linearize.needs, quick=True)
    site = site_of(problem, SimulationOptions(values=model.settings), Place())
    try:
        off = differences(site, site.y)
    except SimulationError as refused:
        assert "undefined" in str(refused) or "depend on each other" in str(refused)
        return
    assert off < 1e-6


NONE = (
    "no equilibrium was found",
    "depends on time",
    "holds",
    "moves by itself",
    "is driven",
    "lies beyond",
    "undefined",
    "depend on each other",
    "on the side of its switches",
)
"""Why there is no equilibrium to look at, in words of the messages."""

RESTING = (
    "bricard",
    "double_pendulum",
    "heavy_symmetric_top",
    "n_four_bar",
    "rolling_coin",
    "stewart_platform",
)
LOSES_DIGITS = {
    "wheel_on_curve": "its slope there is computed by a division by it: differences lose all digits"
}


@pytest.mark.slow
@pytest.mark.parametrize("path", [p for p in EXAMPLES if p.stem not in BENDS], ids=lambda p: p.stem)
def test_examples_at_their_equilibria_against_differences(path: Path) -> None:
    model = mechc.load(path)
    problem = model.problem(parts=Linearize.needs, quick=True)
    if problem.ny > 60 or path.stem in LOSES_DIGITS:
        assert path.stem not in RESTING
        return
    site = site_of(problem, SimulationOptions(values=model.settings), Place(word=EQUILIBRIUM))
    try:
        site, rest = arrived(site, site.y)
        apart = differences(site, rest.y)
    except SimulationError as refused:
        assert any(words in str(refused) for words in NONE) and path.stem not in RESTING
        return
    assert apart < 1e-6


@pytest.mark.parametrize(
    "force", ["potential -(1 N.m^2)/sqrt(x^2 + y^2);", "potential (1 N.m)*log((x^2 + y^2)/(1 m^2));"]
)
def test_a_place_where_forces_are_infinite_is_no_equilibrium(force: str) -> None:
    """Strong damping leads into the centre, where Newton's steps are as short as the distance to it."""
    text = "coordinate x = 1 m; coordinate y = 0.3 m; kinetic 1/2*(1 kg)*(der(x)^2 + der(y)^2);" + force
    with pytest.raises(SimulationError, match="no equilibrium was found"):
        linear(mechc.loads(text), at="equilibrium")


BENT = """
model Bent
  coordinate Length x = 0 m;
  coordinate Length y = 0 m;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1/2*4 N/m*x^2 + 1 N/m*y^2 + 1 N/m^2*y^3;
  force -{force} on x;
  force -0.1 kg/m*abs(der(y))*der(y) on y;
  experiment(stop = 1 s);
end Bent;
"""


@pytest.mark.parametrize(
    ("force", "named"),
    [
        ('table(x, {-1, 0, 1} m, {-3, 0, 1} N, "linear")', "x"),
        ("3 N/m*max(x, 0 m)", "x"),
        ("3 N.s/m*max(der(x), 0 m/s)", "der(x)"),
        ("3 N/m^2*x*abs(x)", ""),
        ("3 N*tanh(x/(1 mm))", ""),
    ],
)
def test_rates_that_bend_have_no_linearisation(force: str, named: str) -> None:
    """Two derivatives of one side each are not a derivative; what is smooth, however curved, has one."""
    problem = mechc.loads(BENT.format(force=force)).problem(parts=Linearize.needs)
    site = site_of(problem, SimulationOptions(), Place())
    found = edges(site, site.y).sharp
    if named:
        assert any(f"'{named}'" in text or "stands at its edge" in text for text in found)
    else:
        assert not found


BALANCED = """
import mech.planar.*;
model Rotor "three blades on a hub that sways, with a torsion spring to a generator; the weights balance each other"
  gravity {0, -9.81} m/s^2;
  Body nacelle(m = 20 kg);
  Prismatic sway(world -> nacelle.a, stiffness = 900 N/m);
  Bar blade[3](m = 2 kg, l = 3 m);
  Disk hub(m = 5 kg, r = 0.3 m);
  Revolute shaft(nacelle.a -> hub.a);
  Weld root[i in 1:3](hub.a * rot(120 deg*i) * trans({0.3, 0} m) -> blade[i].a);
  Disk gen(m = 1 kg, r = 0.2 m);
  Revolute g(hub.a -> gen.a, stiffness = 30 N.m/rad);
  experiment(stop = 1 s);
end Rotor;
"""


def test_a_pole_of_rounding_is_no_pole_and_tells_of_no_instability() -> None:
    """Nothing turns the rotor back: two poles are zero, which rounding of the weights makes +-1e-8.

    The others are those of two oscillators: sqrt(900/32) and sqrt(30/J), 1/J = 1/J_gen + 1/J_rotor.
    """
    model = mechc.loads(BALANCED)
    found = model.linearize()
    errors = np.array(found.details["accuracy"]["errors"]["poles"], dtype=float)
    still = np.abs(found.poles) < 1e-6
    assert still.sum() == 2 and (np.abs(found.poles[still]) <= errors[still]).all()
    gen, rotor = 0.02, 5 * 0.09 / 2 + 3 * 2 * (9 / 12 + 1.8**2)
    wanted = np.sqrt([900 / 32, 30 * (1 / gen + 1 / rotor)])
    swings = np.sort(found.poles[~still].imag)[2:]
    np.testing.assert_allclose(swings, wanted, rtol=1e-12)
    assert (errors[~still] < 1e-11).all()
    (rest,) = model.equilibria().equilibria
    assert rest["stable"] is None
