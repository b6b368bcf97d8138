"""``model.functions``: against Pinocchio, against differences of what is reported, and against each other."""

from __future__ import annotations

import types
from typing import Any

import numpy as np
import pytest

import mechc
from mechc.functions import Functions
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import FEW_CALLS, load_functions
from mechc.runtime.local.model_functions import ModelFunctions
from mechc.runtime.native import calls
from mechc.runtime.native.build import CompilerMissing

ARM = """
import mech.spatial.*;
model Arm
  input Torque u[3] = {1, 2, 3} N.m;
  gravity {0, 0, -9.81} m/s^2;
  Body link[i in 1:3](m = 1.5 kg, com = {0.1, -0.4, 0.05} m, J = diag({0.11, 0.02, 0.13} kg.m^2));
  frame seat[i in 1:3] = (if i == 1 then world else link[i-1].a) * trans({0, if i == 1 then 0 else -1, 0} m);
  Revolute joint[i in 1:3](seat[i] -> link[i].a, angle = 0.3 rad,
                           axis = if i == 1 then {1, 0, 0} else if i == 2 then {0, 1, 0} else {0, 0, 1});
  point hand = link[3].a * {0, -1, 0} m;
  torque u[1] on joint[1].angle;
  torque u[2] on joint[2].angle;
  torque u[3] on joint[3].angle;
  output tip = hand;
  output turning = angvel(link[3].a);
  output stored = potential_energy();
end Arm;
"""


@pytest.fixture(scope="module")
def arm() -> Functions:
    return mechc.loads(ARM).functions


@pytest.fixture(scope="module")
def random() -> np.random.Generator:
    return np.random.default_rng(5)


@pytest.fixture(scope="module")
def peer() -> Any:
    """The same arm in Pinocchio."""
    pin = pytest.importorskip("pinocchio")
    model = pin.Model()
    model.gravity.linear = np.array([0, 0, -9.81])
    parent = 0
    for i, axis in enumerate("XYZ"):
        place = pin.SE3(np.eye(3), np.array([0, -1.0 if i else 0.0, 0]))
        parent = model.addJoint(parent, getattr(pin, f"JointModelR{axis}")(), place, f"j{i}")
        body = pin.Inertia(1.5, np.array([0.1, -0.4, 0.05]), np.diag([0.11, 0.02, 0.13]))
        model.appendBodyToJoint(parent, body, pin.SE3.Identity())
    return pin, model, model.createData()


def test_equals_pinocchio(arm: Functions, peer: Any, random: np.random.Generator) -> None:
    pin, model, data = peer
    q, v, a, u = (random.normal(size=3) for _ in range(4))
    y = np.concatenate([q, v, np.zeros(len(arm.states) - 6)])
    pin.crba(model, data, q)
    mass = np.triu(data.M) + np.triu(data.M, 1).T
    np.testing.assert_allclose(arm.mass_matrix(y), mass, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(
        arm.bias(y, 0.0, np.zeros(3)), pin.nonLinearEffects(model, data, q, v), rtol=1e-12
    )
    np.testing.assert_allclose(
        arm.inverse_dynamics(y, a, 0.0, np.zeros(3)), pin.rnea(model, data, q, v, a), rtol=1e-12
    )
    np.testing.assert_allclose(arm.accelerations(y, 0.0, u), pin.aba(model, data, q, v, u), rtol=1e-12)
    pin.computeAllTerms(model, data, q, v)
    assert arm.kinetic_energy(y) == pytest.approx(data.kinetic_energy, rel=1e-13)
    wrench = pin.getJointJacobian(model, data, 3, pin.LOCAL_WORLD_ALIGNED)
    np.testing.assert_allclose(arm.frame("link[3].a").jacobian(y), wrench, rtol=1e-12, atol=1e-14)


def test_inputs_are_given_or_have_their_defaults(arm: Functions, random: np.random.Generator) -> None:
    y = random.normal(size=len(arm.states))
    assert np.array_equal(arm.accelerations(y), arm.accelerations(y, 0.0, np.array([1.0, 2.0, 3.0])))
    free = arm.inverse_dynamics(y, arm.accelerations(y), 0.0, np.zeros(3))
    np.testing.assert_allclose(free, [1, 2, 3], rtol=1e-11)


def test_arrays_of_states_are_their_rows(arm: Functions, random: np.random.Generator) -> None:
    y, a = random.normal(size=(20, len(arm.states))), random.normal(size=(20, 3))
    t, u = random.normal(size=20), random.normal(size=(20, 3))
    for name in arm.offers:
        function, more = getattr(arm, name), (a,) if name == "inverse_dynamics" else ()
        rows = function(y, *more, t, u)
        alone = [function(y[k], *(x[k] for x in more), t[k], u[k]) for k in range(20)]
        assert rows.shape == (20, *arm.offer(name).shape)
        assert np.array_equal(rows, np.array(alone)), name
        assert np.array_equal(rows, arm.in_threads(function, 3, y, *more, t, u)), name
    assert np.array_equal(arm.in_threads(arm.rates, 2, y[:3], 0.0, u[0]), arm.rates(y[:3], 0.0, u[0]))
    few = arm.in_threads(arm.inverse_dynamics, 2, y[:3], a[:3], t[:3], u[0])
    assert np.array_equal(few, arm.inverse_dynamics(y[:3], a[:3], t[:3], u[0]))
    assert np.array_equal(arm.accelerations(y, 0.0, u[0])[3], arm.accelerations(y[3], 0.0, u[0]))


def test_one_state_needs_no_work_of_python(arm: Functions) -> None:
    assert isinstance(arm.rates, types.BuiltinFunctionType)
    assert isinstance(arm.energy(arm.start), float)


def test_where_nothing_can_be_compiled_they_say_so(arm: Functions, monkeypatch: pytest.MonkeyPatch) -> None:
    """As in workers of a cluster without a compiler, which are sent the code of models: what runs call goes on by ctypes."""

    def missing(*_: object, **__: object) -> None:
        raise CompilerMissing("no C compiler was found")

    y, u = arm.start, np.array([1.0, 2.0, 3.0])
    expected = arm.rates(y, 0.0, u)
    monkeypatch.setattr(calls, "build_shared", missing)
    calls.library.cache_clear()
    try:
        model = mechc.loads(ARM)
        with pytest.raises(CompilerMissing, match="no C compiler was found"):
            model.functions.rates(y)
        functions = load_functions(model.problem())
        case = prepare(model.problem(), functions, SimulationOptions(stop=1.0))
        for _ in range(FEW_CALLS + 1):
            np.testing.assert_allclose(functions.rhs(0.0, y, u, case.z, case.p), expected, rtol=1e-12)
    finally:
        calls.library.cache_clear()


def test_lists_and_other_arrays_serve(arm: Functions) -> None:
    y = arm.start
    expected = arm.mass_matrix(y)
    wide = np.zeros((y.size, 2))
    wide[:, 0] = y
    for given in (list(y), y.astype(np.float32).astype(object), wide[:, 0], tuple(y)):
        np.testing.assert_allclose(arm.mass_matrix(given), expected, rtol=1e-7)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((np.zeros(3),), "y has the shape (3,), not"),
        ((np.zeros((2, 2, 2)),), "y has the shape (2, 2, 2)"),
        ((None, 0.0, np.zeros(2)), "u has the shape (2,), not (3,)"),
        ((None, np.zeros(2)), "t has the shape (2,)"),
    ],
)
def test_other_shapes_are_refused(arm: Functions, arguments: tuple[Any, ...], words: str) -> None:
    given = [arm.start if x is None else x for x in arguments]
    with pytest.raises(ValueError) as found:
        arm.rates(*given)
    assert words in str(found.value)


def test_wrong_numbers_of_arguments_are_refused(arm: Functions) -> None:
    with pytest.raises(TypeError, match=r"inverse_dynamics.*takes"):
        arm.inverse_dynamics(arm.start)
    with pytest.raises(TypeError, match="4 arguments"):
        arm.rates(arm.start, 0.0, np.zeros(3), 1)
    with pytest.raises(AttributeError, match="has no constraints"):
        _ = arm.constraint_jacobian
    with pytest.raises(AttributeError, match="mass_matrix"):
        _ = arm.mass_matrx
    with pytest.raises(KeyError, match="tip"):
        _ = arm.output["tipp"]
    with pytest.raises(mechc.UsageMistake, match="neither a frame"):
        arm.frame("nothing")


def test_units_and_names(arm: Functions) -> None:
    mass = arm.offer("mass_matrix")
    assert mass.rows[1] == ("force on joint[2].angle", "N.m")
    assert mass.columns[1] == ("der(der(joint[2].angle))", "rad/s^2")
    assert arm.offer("tip", "jacobian").rows[0] == ("rate of tip[1]", "m/s")
    assert arm.offer("turning", "jacobian").rows[0] == ("turning[1]", "rad/s")
    assert 'jacobian["tip"]' in repr(arm)


def _along(f: ModelFunctions, name: str, y: np.ndarray, h: float = 1e-5) -> np.ndarray:
    """Differences of an output along the rates of its state, of fourth order."""
    r = f.rates(y)
    g = f.output[name]
    found: np.ndarray = (8 * (g(y + h * r) - g(y - h * r)) - (g(y + 2 * h * r) - g(y - 2 * h * r))) / (12 * h)
    return found


def test_jacobians_of_outputs_are_differences(arm: Functions, random: np.random.Generator) -> None:
    y = random.normal(size=len(arm.states))
    v = y[3:6]
    np.testing.assert_allclose(arm.jacobian["tip"](y) @ v, _along(arm, "tip", y), rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(arm.jacobian["turning"](y) @ v, arm.output["turning"](y), rtol=1e-12)
    assert arm.jacobian["stored"](y).shape == (3,)


TOP = """
model Top
  parameter m = 2 kg;
  coordinate Rotation R = rotx(40 deg);
  initial der(R) = {0.3, 0.2, 9} rad/s;
  frame body = world * R;
  point c = body * {0.1, 0.2, 0.5} m;
  mass m at c;
  inertia diag({0.3, 0.3, 0.1} kg.m^2) on body;
  gravity {0, 0, -9.81} m/s^2;
  output place = pos(c);
  output axes[3,3] = {direction(body, {1, 0, 0}), direction(body, {0, 1, 0}), direction(body, {0, 0, 1})};
end Top;
"""


def test_rotations_move_in_three_directions(random: np.random.Generator) -> None:
    f = mechc.loads(TOP).functions
    y = f.start.copy()
    y[4:7] = random.normal(size=3)
    assert f.mass_matrix(y).shape == (3, 3) and f.rates(y).shape == (7,)
    np.testing.assert_allclose(f.jacobian["place"](y) @ y[4:7], _along(f, "place", y), rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(f.mass_matrix(y) @ f.accelerations(y) + f.bias(y), 0, atol=1e-12)
    frame = f.frame("body")
    assert frame.angular_velocity is not None
    np.testing.assert_allclose(frame.jacobian(y)[3:] @ y[4:7], frame.angular_velocity(y), rtol=1e-12)
    np.testing.assert_allclose(f.output["axes"](y).T @ y[4:7], frame.angular_velocity(y), rtol=1e-12)
    point = f.frame("c")
    assert point.angular_velocity is None and point.jacobian(y).shape == (3, 3)


def test_constraints_and_their_multipliers(random: np.random.Generator) -> None:
    f = mechc.load("examples/four_bar.mech").functions
    y = f.start + np.concatenate([random.normal(size=4), np.zeros(len(f.states) - 4)])
    a = random.normal(size=2)
    k, h = f.constraint_jacobian(y), 1e-5
    position = slice(0, len(f.constraints(y)) - len(k))

    def moved(s: float) -> np.ndarray:
        """The state s later with these accelerations."""
        q, v = y[:2] + s * y[2:4] + s**2 / 2 * a, y[2:4] + s * a
        return np.concatenate([q, v, y[4:]])

    before, after = (f.constraints(moved(s), s) for s in (-h, h))  # what drives the crank depends on time
    slope, rates = (after - before) / (2 * h), slice(position.stop, None)
    np.testing.assert_allclose(f.constraints(y)[rates], slope[position], atol=1e-7)
    np.testing.assert_allclose(k @ a + f.constraint_bias(y), slope[rates], atol=1e-5)
    changed = f.constraints(np.concatenate([y[:2], y[2:4] + a, y[4:]])) - f.constraints(y)
    np.testing.assert_allclose(k @ a, changed[rates], atol=1e-12)
    y = f.start
    left = f.mass_matrix(y) @ f.accelerations(y) + f.bias(y)
    k = f.constraint_jacobian(y)
    multipliers = np.linalg.lstsq(k.T, left, rcond=None)[0]
    np.testing.assert_allclose(k.T @ multipliers, left, atol=1e-10 * np.abs(left).max())
    np.testing.assert_allclose(k @ f.accelerations(y) + f.constraint_bias(y), 0, atol=1e-10)


SWITCHED = """
model Switched
  parameter k = 3 N/m;
  coordinate x = 1 m;
  kinetic 1/2*(2 kg)*der(x)^2;
  force (if x > 0 m then -k*x else 5 N) on x;
end Switched;
"""


def test_relations_are_evaluated_at_each_state() -> None:
    """The motion begins at x = 1; the law on the other side holds there all the same."""
    f = mechc.loads(SWITCHED).functions
    y = np.zeros((2, len(f.states)))
    y[:, 0] = 1, -1
    np.testing.assert_allclose(f.accelerations(y), [[-1.5], [2.5]], rtol=1e-15)
    assert f.accelerations(y[1]) == 2.5


def test_values_that_are_set_count() -> None:
    f = mechc.loads(SWITCHED).with_values({"k": 7.0}).functions
    assert f.accelerations(f.start) == -3.5


def test_functions_outlive_their_model(random: np.random.Generator) -> None:
    energy = mechc.loads(SWITCHED).functions.energy
    assert energy(np.array([1.0, 2.0, 0.0])) == pytest.approx(4.0)


def test_curves_have_none() -> None:
    with pytest.raises(mechc.UsageMistake, match="is a curve"):
        _ = mechc.load("examples/curves/brachistochrone.mech").functions


def test_python_modules_tell_the_places_of_entries(tmp_path: Any) -> None:
    (path,) = mechc.loads(
        SWITCHED.replace("(if x > 0 m then -k*x else 5 N)", "-k*x"), keep={"jacobian"}
    ).compile("python", tmp_path / "made.py")
    made: dict[str, Any] = {"__name__": "made"}
    exec(compile(path.read_text(), str(path), "exec"), made)
    entries = made["jacobian"](0.0, [1.0, 2.0, 0.0], [], made["parameters"]())
    # of x, its rate, and the energy supplied
    found = dict(zip(made["PATTERNS"]["jacobian"], entries, strict=True))
    assert found == {(0, 1): 1.0, (1, 0): -1.5, (2, 0): -6.0, (2, 1): -3.0}


def test_kinematics_tell_jacobians_by_velocities() -> None:
    """A study tells what the functions give: three columns for a rotation, of its turning the angular velocity."""
    model = mechc.loads(
        TOP.replace(
            "{direction(body, {1, 0, 0}), direction(body, {0, 1, 0}), direction(body, {0, 0, 1})}",
            "{{direction(body, {1, 0, 0})[i], direction(body, {0, 1, 0})[i], direction(body, {0, 0, 1})[i]} for i in 1:3}",
        )
    )
    told: Any = model.study("kinematics")
    y = model.functions.start
    place = told.details["points"]["place"]["cartesian"]["jacobian"]
    np.testing.assert_allclose(place, model.functions.jacobian["place"](y), rtol=1e-12, atol=1e-14)
    frame = model.functions.frame("body")
    turning = told.details["rotations"]["axes"]["jacobian"]
    np.testing.assert_allclose(turning, frame.jacobian(y)[3:], rtol=1e-12, atol=1e-14)
    assert told.details["velocities"] == [name for name, _ in model.functions.states[4:7]]


def test_outputs_of_parts_in_arrays_are_functions_of_their_own() -> None:
    """Each element of an array of parts has its outputs, in their shapes, by the names that results have."""
    model = mechc.loads("""
    import mech.spatial.*;
    model Arm
      frame root;
      Body b(m = 1 kg, com = {0.1, 0.2, 0} m, J = identity(3)*0.1 kg.m^2);
      Revolute j(root -> b.a, axis = {0, 1, 0});
      output tip[3] = pos(b.a * trans({0.5, 0, 0} m));
      output Real axes[2, 3] = {direction(b.a, {1, 0, 0}), direction(b.a, {0, 1, 0})};
      output speed = der(j.angle);
    end Arm;
    model Two
      Arm arm[2](root = {world, world * trans({0, 1, 0} m)}, j.angle = {0.3, 0.5} rad);
      Spring s[2](world -> {arm[1].b.a * trans({2, 0, 0} m), arm[2].b.a}, k = 3 N/m);
    end Two;
    """)
    f = model.functions
    y = f.start
    assert list(f.output) == [
        *(f"arm[{k}].{name}" for k in (1, 2) for name in ("tip", "axes", "speed")),
        "s[1].tension",
        "s[2].tension",
    ]
    for k, angle in ((1, 0.3), (2, 0.5)):
        c, s = np.cos(angle), np.sin(angle)
        assert f.output[f"arm[{k}].tip"](y) == pytest.approx([0.5 * c, k - 1, -0.5 * s], abs=1e-15)
        assert f.output[f"arm[{k}].axes"](y) == pytest.approx(np.array([[c, 0, -s], [0, 1, 0]]), abs=1e-15)
        turning = np.zeros((3, 2))
        turning[:, k - 1] = [-0.5 * s, 0, -0.5 * c]
        assert f.jacobian[f"arm[{k}].tip"](y) == pytest.approx(turning, abs=1e-15)
    assert [f.output[f"s[{k}].tension"](y) for k in (1, 2)] == pytest.approx([6, 3])


def test_kinematics_tell_points_of_parts_in_arrays() -> None:
    """Three springs are no point, and a tip of each arm is one."""
    model = mechc.loads("""
    import mech.spatial.*;
    model Mass
      parameter Length x = 1 m;
      Particle p;
      Translation t(world -> p.a, position = {x, 0, 0}, der(position) = {0, 2, 0} m/s);
      output place = pos(p.a);
    end Mass;
    model Three
      Mass m[3](x = {1, 2, 3} m);
      Spring s[3](world -> {m[1].p.a, m[2].p.a, m[3].p.a}, k = 1 N/m);
    end Three;
    """)
    points = model.kinematics().details["points"]
    assert list(points) == ["m[1].place", "m[2].place", "m[3].place"]


SWITCHES = """
parameter Mass m = 2 kg;
parameter Stiffness soft = 10 N/m;
discrete Real hits = 3;
input Force push = 1 N;
coordinate Length x = 0.2 m;
coordinate Length z = 0.1 m;
kinetic 1/2*m*(der(x)^2 + der(z)^2) + 1/2*(0.5 kg)*sin(x/(1 m))*der(x)*der(z);
force -(if x > 0 m then soft else 4*soft)*x - (hits*1 N.s/m)*der(x) on x;
force push on z;
when z < -1 m then hits := hits + 1; end when;
"""


@pytest.mark.parametrize("text", [ARM, SWITCHES], ids=["arm", "switches"])
def test_derivatives_of_rates_have_a_library_of_their_own(text: str, random: np.random.Generator) -> None:
    """Central differences: h^2 of the third derivatives, and 1e-16/h."""
    f = mechc.loads(text).with_values({"m": 3.0} if text is SWITCHES else {}).functions
    with pytest.raises(AttributeError):
        f._bound.address("rates_jacobian")  # what is longer than all others is compiled when it is asked for
    h = 1e-6
    for _ in range(4):
        y = random.uniform(0.1, 1, len(f.states)) * random.choice([-1, 1], len(f.states))
        u = random.normal(size=len(f.inputs))
        found = f.rates_jacobian(y, 0.0, u)
        columns = [
            (f.rates(y + h * e, 0.0, u) - f.rates(y - h * e, 0.0, u)) / (2 * h) for e in np.eye(y.size)
        ]
        np.testing.assert_allclose(found, np.array(columns).T, rtol=1e-7, atol=1e-7)
    shape = f.offer("rates_jacobian")
    assert shape.shape == (len(f.states),) * 2 and len(shape.columns) == len(f.states)
