"""Twins of a model: each is made, moves alike, and tells a fault that the model itself does not."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from msgspec.structs import replace
from slow_params import slow_among, slow_but

import mechc
from mechc.cli.main import run
from mechc.compiler.flat.names.instance import STATED, rank_of
from mechc.compiler.flat.statements import elaborate, initial_values
from mechc.compiler.flat.statements.energies import gravities
from mechc.compiler.graph import operations as ops
from mechc.compiler.mechanics.kinematics.frames import FrameKinematics
from mechc.compiler.mechanics.meaning import functions
from mechc.compiler.metamorphic.rewriting import apply
from mechc.compiler.metamorphic.table import TWINS
from mechc.compiler.metamorphic.twin import NotApplicable
from mechc.lang import ast
from mechc.measurement.extremes import Extreme
from mechc.measurement.metamorphic import Base, _turned, beside, compare, run_twin, twin_of
from mechc.measurement.metamorphic_starts import missed
from mechc.measurement.stress import Subject, worker
from mechc.requests.request import asked
from mechc.runtime.studies.kinds.motion import Simulate
from mechc.session import answered
from mechc.solution import Solution

PLANE = """
import mech.planar.*;
parameter k = 20 N/m;
gravity {0, -9.81} m/s^2;
Bar arm(m = 1 kg, l = 0.5 m);
Bar hand(m = 0.5 kg, l = 0.4 m);
Revolute shoulder(world -> arm.a, angle = -60 deg);
Revolute elbow(arm.b -> hand.a, angle ~ 20 deg);
initial der(elbow.angle) = 1 rad/s;
point tool = hand.a * {0.4 m, 0};
state lag = 0.2 m;
equation der(lag) = (norm(tool) - lag)/0.3 s;
potential 1/2*k*max(0 m, norm(tool - {0.3 m, 0}) - 0.2 m)^2;
force {1 N, 0.5 N*sin(3 rad/s*time)} on hand.b;
force 0.3 N*abs(lag)/1 m on norm(pos(hand.c));
output push = reaction(elbow);
output tip = tool;
output speed = vel(hand.b, arm.a);
experiment(stop = 1 s);
"""
SPACE = """
import mech.spatial.*;
gravity {0, 0, -9.81} m/s^2;
Box first(m = 1 kg, size = {0.5, 0.1, 0.2} m);
Box second(m = 0.3 kg, size = {0.2, 0.1, 0.3} m);
frame edge = first.a * trans({0.25, 0, 0.1} m);
point corner = second.a * {0.1, 0.05, 0.15} m;
Spherical ball(world -> first.a);
initial der(ball.orientation) = {0.5, -0.4, 1} rad/s;
Revolute hinge(edge -> second.a, axis = {0, 1, 0}, angle ~ 0.4 rad);
torque {0.1 N.m, 0, 0.2 N.m} on second.a;
force {1 N, 2 N, 0} on corner from first.a in first.a;
output load = reaction(hinge);
output bend = moment(hinge);
output spin = angvel(second.a);
output own = angvel(second.a, first.a);
experiment(stop = 0.5 s);
"""
LOSING = """
parameter m = 1 kg;
coordinate x = 1 m;
coordinate y[2] = {0.5, 1} m;
kinetic 1/2*m*(der(x)^2 + der(y[1])^2 + 2*der(y[2])^2) + 0.2 kg*der(x)*der(y[1]);
potential 1/2*20 N/m*(x^2 + (x - y[1])^2 + clamp(y[2], -0.3 m, 0.2 m)*y[2]);
damping 0.3 N.s/m on x - y[2];
friction 0.5 N on y[2];
force -0.1 N.s/m/(1 J)*(energy() - 2 J)*der(x) on x;
force -integral(exp(-s^2) for s in 0:3)*x*(0.2 N/m) on x;
force -min(1 N, 2 N/m*y[1], 3 N) on deadzone(y[1], 0.1 m);
output p = momentum(x);
experiment(stop = 1 s);
"""


TOLD = """
model Part
  parameter m = 1 kg;
  coordinate Length x = 0.3 m;
  kinetic 1/2*m*der(x)^2;
  potential 1/2*5 N/m*x^2;
end Part;
partial model Base
  Part part(m = 2 kg);
  coordinate Length y[2];
  initial y = 0.1 m;
  initial y[2] = 0.4 m;
  kinetic 1/2*1 kg*(der(y[1])^2 + der(y[2])^2);
  potential 1/2*3 N/m*(y[1]^2 + y[2]^2);
end Base;
model Heir
  extends Base(part.m = 1.5 kg);
  coordinate z ~ 0.2 m;
  initial der(z) ~ 0.5 m/s;
  initial part.x = 0.25 m;
  coordinate Length u(nominal = 1 m) ~ 2 m;
  coordinate Length w(nominal = 10 m) ~ 0.5 m;
  kinetic 1/2*1 kg*(der(z)^2 + der(u)^2 + der(w)^2);
  constraint rod: u + w = 3 m;
  potential 1 J*exp(-z/(1 m))*cos(z/(0.3 m)) + 1 J*table(z/(1 m), {-0.5, 0.1, 0.6, 1.5}, {0, 0.4, 0.3, 1});
  force -1 N/m*sqrt(1 m^2 + y[1]^2)*sin(u/(1 m)) on u;
  discrete Real n = 0;
  discrete Real k = 0;
  discrete Force pull = 0 N;
  force pull on y[1];
  when sample(0.1 s) then
    n := n + 1;
    k := pre(n);
  end when;
  when sample(0.3 s) then
    pull := 0.1 N*n;
  end when;
  when sample(0.2 s, 0.1 s) then
    pull := 0.5*pull;
    reinit(der(z), 0.9*der(z));
  end when;
  output told = k;
  experiment(stop = 1.2 s);
end Heir;
"""


def base_of(text: str) -> Base:
    model = mechc.loads(text)
    request = asked(Simulate, {})
    ran, solution = answered(model, request)
    assert isinstance(solution, Solution)
    return Base.of(ran, request, solution)


BASES: dict[str, Base] = {}


@pytest.fixture(params=slow_among(["space"], ["plane", "space", "losing", "told"]))
def base(request: pytest.FixtureRequest) -> Base:
    name = request.param
    if name not in BASES:
        BASES[name] = base_of({"plane": PLANE, "space": SPACE, "losing": LOSING, "told": TOLD}[name])
    return BASES[name]


MADE = {
    "another order": "plane space losing told",
    "kinks by if": "plane losing",
    "energies as forces": "plane space told",
    "bodies as energies": "plane space",
    "answers written out": "losing",
    "powers written out": "losing",
    "integrals in parts": "losing",
    "functions otherwise": "plane space losing told",
    "tables in pieces": "told",
    "clocks counted": "told",
    "times as a state": "",
    "steps ended": "plane space losing told",
    "actions reordered": "told",
    "starts elsewhere": "plane space told",
    "inheritance expanded": "told",
    "nominal sizes": "told",
    "written out": "plane space",
    "turned world": "plane space",
    "other units": "plane space losing told",
    "joint as closure": "plane space",
    "other coordinates": "plane space losing told",
    "time reversed": "plane space",
    "start perturbed": "plane space losing told",
}


@pytest.mark.parametrize("name", TWINS)
def test_each_twin_moves_alike(name: str, base: Base, request: pytest.FixtureRequest) -> None:
    which = request.node.callspec.params["base"]
    if which not in MADE[name].split():
        with pytest.raises(NotApplicable, match=r"\w"):
            twin_of(name, base)
        return
    twin = twin_of(name, base)
    base = beside(twin, base)
    made = run_twin(twin, base)
    found = compare(base, twin, made)
    assert found is not None and found.same, found
    assert found.allowed < 1e-4
    assert sum(n in made.solution for n in base.solution if twin.means(n)) > 3


@pytest.mark.parametrize("name", ["another order", "other units", "turned world", "time reversed"])
def test_what_moves_otherwise_is_told(name: str) -> None:
    base = BASES.setdefault("plane", base_of(PLANE))
    twin = twin_of(name, base)
    wrong = replace(twin, model=replace(twin.model, loads=twin.model.loads[:-1]))
    found = compare(base, twin, run_twin(wrong, base))
    assert found is not None and not found.same


NEW = [name for name in TWINS if MADE[name] == "told"]


@pytest.mark.slow
@pytest.mark.parametrize("name", [*NEW, "functions otherwise", "starts elsewhere"])
def test_what_the_text_says_otherwise_is_told(name: str) -> None:
    base = BASES.setdefault("told", base_of(TOLD))
    twin = twin_of(name, base)
    wrong = replace(twin, model=replace(twin.model, loads=twin.model.loads[:-1]))
    found = compare(base, twin, run_twin(wrong, base))
    assert found is not None and not found.same


FAULTS: dict[str, tuple[str, Callable[[pytest.MonkeyPatch], None], str]] = {
    "the gravity of a base goes before that of its heir": (
        "inheritance expanded",
        lambda patch: patch.setattr(elaborate, "gravities", _first_gravity),
        "model Base gravity {0, -1} m/s^2; end Base; model Heir extends Base; gravity {0, -9} m/s^2;"
        "coordinate Length y = 0 m; mass 1 kg at world * {0 m, y}; experiment(stop = 1 s); end Heir;",
    ),
    "the root of a square has the sign of what is squared": (
        "functions otherwise",
        lambda patch: patch.setitem(functions.FUNCTIONS, "sqrt", _bare_root),
        "coordinate x = -1 m; kinetic 1/2*1 kg*der(x)^2; potential 3 N*sqrt(x*x); experiment(stop = 1 s);",
    ),
    "what 'initial' says loses to the declaration": (
        "starts elsewhere",
        lambda patch: patch.setattr(initial_values, "STATED", -1),
        "coordinate Length y = 2 m; initial y = 3 m; kinetic 1/2*1 kg*der(y)^2;"
        "potential 1/2*1 N/m*y^2; experiment(stop = 1 s);",
    ),
    "what the whole says of a part loses to the part": (
        "starts elsewhere",
        lambda patch: patch.setattr(initial_values, "rank_of", _inner_first),
        "model Part coordinate Length x; initial x = 1 m; kinetic 1/2*1 kg*der(x)^2; potential 1/2*1 N/m*x^2; end Part;"
        "model Whole Part part; initial part.x = 4 m; experiment(stop = 1 s); end Whole;",
    ),
}


def _inner_first(scope: Any, stage: int) -> tuple[int, int, int]:
    depth, level, stage = rank_of(scope, stage)
    return (-depth if stage == STATED else depth), level, stage


def _bare_root(kinematics: FrameKinematics, rate: Any, arguments: tuple[Any, ...]) -> Any:
    graph, (a,) = kinematics.graph, arguments
    same = graph._code[a] == ops.MUL and graph._left[a] == graph._right[a]
    return graph._left[a] if same else graph._function(ops.SQRT, a)


def _first_gravity(instance: Any, statements: list[Any]) -> None:
    stated = [s for s in statements if isinstance(s.statement, ast.Gravity)]
    gravities(instance, stated[:1])


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_of_reading_are_told(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    name, plant, text = FAULTS[fault]
    right = base_of(text)
    twin = twin_of(name, right)
    found = compare(right, twin, run_twin(twin, right))
    assert found is not None and found.same
    plant(monkeypatch)
    wrong = base_of(text)
    assert any(abs(wrong.solution[n][-1] - right.solution[n][-1]) > 1e-3 for n in wrong.solution), "reached"
    twin = twin_of(name, wrong)
    found = compare(wrong, twin, run_twin(twin, wrong))
    assert found is not None and not found.same


def test_a_fault_of_one_way_to_say_it_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    made: Callable[..., Any] = functions.FUNCTIONS["max"]

    def first(k: Any, rate: Any, a: tuple[Any, ...]) -> Any:
        return made(k, rate, a[:1] * len(a))

    monkeypatch.setitem(functions.FUNCTIONS, "max", first)
    file = tmp_path / "kink.mech"
    file.write_text(
        "coordinate x = 1 m;\nkinetic 1/2*1 kg*der(x)^2;\npotential 2 N*max(0.3 m, x);\nexperiment(stop = 3 s);\n",
        encoding="utf-8",
    )
    judge = worker(Subject(str(file), None, {}, None, 5))
    assert judge(Extreme("twin", "another order")).kind == "same"
    row = judge(Extreme("twin", "kinks by if"))
    assert row.kind == "other" and row.error is not None and row.error > 0.1 and "x" in row.reason


@pytest.mark.slow
def test_the_exit_code_tells(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "twins.mech"
    file.write_text(PLANE, encoding="utf-8")
    assert run(["stress", str(file), "--only", "twin"]) == 0
    assert "14 the same motion" in capsys.readouterr().out


FREE = """
coordinate Rotation R;
initial der(R) = {0.001, 1, 0.001} rad/s;
frame body = world * R;
inertia diag({1 kg.m^2, 2 kg.m^2, 3 kg.m^2}) on body;
experiment(stop = 60 s, tolerance = 1e-10);
"""


def test_a_rotation_may_come_back_with_the_other_sign() -> None:
    base = base_of(FREE)
    twin = twin_of("time reversed", base)
    found = compare(base, twin, run_twin(twin, base))
    assert found is not None and found.difference < 1e-7
    rows = np.arange(base.solution.time.size)
    for sign in (1.0, -1.0):
        other = {f"R[{k}]": sign * base.solution[f"R[{k}]"] for k in range(1, 5)}
        turned = _turned(base, cast(Solution, other), twin, rows, rows)
        assert len(turned) == 4 and all((signs == sign).all() for signs in turned.values())


DRAG = """
import mech.planar.*;
Bar sledge(m = 1.68 kg, l = 1 m);
Prismatic rail(world -> sledge.a, axis = {-1, 0}, der(position) ~ 0.58 m/s);
Bar rider(m = 1.78 kg, l = 0.88 m);
Prismatic slide(sledge.a -> rider.a, position ~ 0.69 m, der(position) ~ 0.76 m/s);
dissipation 1/2*0.25 kg/s*der(slide.position)^2;
force -0.29 kg/m*norm(vel(rider.a))*vel(rider.a) on rider.a;
experiment(stop = 1.5 s);
"""


def test_the_account_that_a_force_counts_on_is_no_motion() -> None:
    """That the drag brakes can be told of its own text, not of the one that the turned world makes of it."""
    base = base_of(DRAG)
    twin = twin_of("turned world", base)
    made = run_twin(twin, base)
    accounts = made.solution.energy, base.solution.energy
    assert accounts[0] and accounts[0].supplied and accounts[1] and accounts[1].supplied is None
    found = compare(base, twin, made)
    assert found is not None and found.same
    feeding = replace(twin, model=replace(twin.model, loads=()))
    found = compare(base, twin, run_twin(feeding, base))
    assert found is not None and not found.same


@pytest.mark.parametrize(
    "library, coordinates",
    [
        ("planar", "coordinate Length q[3]; drive q = {1, 2, 3} m/s*time; kinetic 1 kg*dot(der(q), der(q));"),
        (
            "spatial",
            "coordinate Rotation q; drive q = rotx(1 rad/s^2*time^2); inertia diag({1, 2, 3} kg.m^2) on world * q;",
        ),
    ],
)
def test_forces_of_drives_are_along_their_coordinates(library: str, coordinates: str) -> None:
    """Those of joints are in components of the world, which another twin turns."""
    bar = f"import mech.{library}.*; Bar bar(m = 1 kg, l = 1 m); Prismatic rail(world -> bar.a);"
    base = base_of(f"{bar} {coordinates} output push = reaction(q); experiment(stop = 0.1 s);")
    twin = twin_of("turned world", base)
    found = compare(base, twin, run_twin(twin, base))
    assert found is not None
    assert found.same, found


def test_what_is_too_unstable_backwards_is_no_other_motion(tmp_path: Path) -> None:
    file = tmp_path / "cycle.mech"
    file.write_text(
        "coordinate x = 2 m;\nkinetic 1/2*1 kg*der(x)^2;\npotential 1/2*1 N/m*x^2;\n"
        "force 1 kg/s*(1 - (x/1 m)^2)*der(x) on x;\nexperiment(stop = 20 s);\n",
        encoding="utf-8",
    )
    judge = worker(Subject(str(file), None, {}, None, 5))
    assert judge(Extreme("twin", "time reversed")).kind == "rough"


def test_momenta_are_apart_where_a_joint_closes() -> None:
    """The momentum of the shoulder is that of all it carries: of the arm alone where the hand has coordinates of its own."""
    text = """
import mech.planar.*;
gravity {0, -9.81} m/s^2;
Bar arm(m = 1 kg, l = 0.5 m);
Bar hand(m = 0.5 kg, l = 0.4 m);
Revolute shoulder(world -> arm.a, angle = -60 deg);
Revolute elbow(arm.b -> hand.a, angle = 20 deg);
output turning = momentum(shoulder.angle);
experiment(stop = 0.5 s);
"""
    base = base_of(text)
    twin = twin_of("joint as closure", base)
    found = compare(base, twin, run_twin(twin, base))
    assert found is not None
    assert found.same


def test_what_a_closure_cannot_tell_is_left_alone() -> None:
    """The angle of a closure is told up to whole turns, as an output: nothing can be integrated of it."""
    text = """
import mech.planar.*;
Bar arm(m = 1 kg, l = 0.5 m);
Revolute shoulder(world -> arm.a, angle = -60 deg);
output sum = integral(shoulder.angle);
experiment(stop = 0.5 s);
"""
    with pytest.raises(NotApplicable, match="equations of a closure"):
        twin_of("joint as closure", base_of(text))


def test_a_law_that_asks_for_a_momentum_is_another_one_where_a_joint_is_a_closure() -> None:
    """What the angle carried moves freely then, and its momentum is that of nothing."""
    text = """
import mech.planar.*;
Bar arm(m = 1 kg, l = 0.5 m);
Revolute shoulder(world -> arm.a, angle = -60 deg);
torque -0.3 s^-1*momentum(shoulder.angle) on arm.a;
experiment(stop = 0.5 s);
"""
    with pytest.raises(NotApplicable, match="a law asks for a momentum"):
        twin_of("joint as closure", base_of(text))


@pytest.mark.parametrize(("body", "fits"), [("Rod", False), ("Body", True)])
def test_what_has_no_inertia_about_a_line_is_not_freed(body: str, fits: bool) -> None:
    """A thin rod in the air turns about itself without inertia: only what closes the loop would hold it."""
    made = {
        "Rod": "Rod arm(m = 0.57 kg, l = 0.66 m, direction = {0.43, 0.9, -0.43});",
        "Body": "Body arm(m = 0.57 kg, J = diag({0.1, 0.2, 0.2} kg.m^2), com = {0.1, 0.2, 0.1} m);",
    }[body]
    text = f"""
import mech.spatial.*;
gravity {{0, 0, -9.81}} m/s^2;
{made}
Revolute hinge(world -> arm.a, axis = {{-0.23, 0.87, 0.56}}, angle = -30 deg);
experiment(stop = 0.3 s);
"""
    base = base_of(text)
    if not fits:
        with pytest.raises(NotApplicable, match="inertia about every line"):
            twin_of("joint as closure", base)
        return
    twin = twin_of("joint as closure", base)
    found = compare(base, twin, run_twin(twin, base))
    assert found is not None
    assert found.same


@pytest.mark.slow
def test_integrals_that_are_known_roughly_may_differ() -> None:
    """By as much in what follows from them at once as in what moves."""
    text = """
coordinate x = 0.25 m;
coordinate y = -0.16 m;
kinetic 1/2*1.65 kg*(der(x)^2 + der(y)^2);
force -(integral(abs(sin(6.17*(s - 0.41*sin(cosh(0.33*tanh(der(x)/(1.34 m/s))))))) for s in 0:2.4)*0.47 N) on y;
potential 1 J/m*x;
output a = der(y, 2);
experiment(stop = 1 s);
"""
    base = base_of(text)
    twin = twin_of("integrals in parts", base)
    found = compare(base, twin, run_twin(twin, base))
    assert found is not None
    assert found.same


GUESSED = """
import mech.planar.*;
parameter long = 3 m;
Bar arm(m = 1 kg, l = 0.5 m);
Revolute joint(world -> arm.a, angle ~ 0.3 rad);
coordinate Length x ~ 0.4 m;
initial der(x) ~ 0.2 m/s;
coordinate Angle b = 0.2 rad;
kinetic 1/2*2 kg*der(x)^2 + 1/2*1 kg.m^2*der(b)^2;
constraint rack: x = 0.25 m*sin(joint.angle + b);
output shown = long/(1 m)*inertia_tensor(arm.a);
experiment(stop = 0.5 s);
"""


SIZELESS = """
coordinate Angle a ~ 0.3 rad;
coordinate Length x ~ 0.4 m;
kinetic 1/2*2 kg*der(x)^2 + 1/2*1 kg.m^2*der(a)^2;
constraint rack: x = 0.25 m*sin(a + 0.2 rad);
experiment(stop = 0.5 s);
"""


@pytest.mark.parametrize(("name", "text"), [("other units", SIZELESS), ("bodies as energies", GUESSED)])
def test_guesses_that_other_sizes_weigh_otherwise(name: str, text: str) -> None:
    """Before, an angle and a length were moved onto their constraint in other shares, which was called another motion."""
    base = base_of(text)
    twin = twin_of(name, base)
    made = run_twin(twin, base)
    found = compare(base, twin, made)
    assert made.own is not None and found is not None and found.same
    rack = twin.model.constraints[0]
    wrong = replace(rack, right=apply("negate", rack.right.type, rack.right))
    told = compare(base, twin, run_twin(replace(twin, model=replace(twin.model, constraints=(wrong,))), base))
    assert told is not None and not told.same and told.name == "rack"


def test_what_a_start_misses_is_told() -> None:
    """Its equations in places and in rates, and what is given."""
    case = base_of(GUESSED).plan.case
    assert missed(case, case.y0).same
    for name, told in (("x", "rack"), ("der(x)", "rack"), ("b", "b")):
        y = case.y0.copy()
        y[[q.name for q in case.problem.states].index(name)] += 1e-6
        found = missed(case, y)
        assert not found.same and (found.name == told or name == "b")


ALIKE = {
    "a potential that changes at a time": (
        "another order",
        "coordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2; potential 1/2*4 N/m*x^2*(if time < 1 s then 1 else 2);"
        "experiment(stop = 2 s, every = 0.1 s);",
    ),
    "what happens right after the start": (
        "times as a state",
        "coordinate Length x = 0 m; kinetic 1/2*1 kg*der(x)^2; when time > 0 s then reinit(der(x), 1 m/s); end when;"
        "experiment(stop = 1 s);",
    ),
    "a weight that grows": (
        "turned world",
        "import mech.planar.*; model Tray gravity {0, -9.81} m/s^2; Revolute pivot(world -> arm.a, angle = -30 deg);"
        "Bar arm(m = 1 kg, l = 1 m); mass 0.2 kg + 0.5 kg/s*time at arm.b; experiment(stop = 1 s); end Tray;",
    ),
}


@pytest.mark.parametrize("what", ALIKE)
def test_what_happens_at_times_is_no_other_motion(what: str) -> None:
    """At the time of a change rows of both sides stand; by how much a growing weight counts is a matter of its height."""
    name, text = ALIKE[what]
    base = base_of(text)
    twin = twin_of(name, base)
    found = compare(base, twin, run_twin(twin, base))
    assert found is not None and found.same, found


def test_what_a_bend_takes_has_no_way_back() -> None:
    base = base_of(
        "coordinate Length x = -1 m; coordinate Length y = 0 m; initial der(x) = 2 m/s;"
        "kinetic 1/2*1 kg*(der(x)^2 + der(y)^2); constraint guide: y = 0.5*max(0 m, x); experiment(stop = 1 s);"
    )
    with pytest.raises(NotApplicable, match="no way back"):
        twin_of("time reversed", base)


FOLLOWING = """
coordinate Length x = 0 m;
coordinate Length y ~ 0 m;
state Force N = 0 N;
initial der(x) = 3 m/s;
kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
potential 1 kg*9.81 m/s^2*y;
constraint floor: y = 0.1 m*sin(x/(1 m));
equation der(N) = (multiplier(floor) - N)/(0.1 s);
force drag: -0.3*multiplier(floor)*tanh(der(x)/(1 m/s)) on x;
experiment(stop = 1 s);
"""


@pytest.mark.parametrize("part", ["power of drag", "rate of N"])
def test_questions_in_forces_and_states_are_those_of_outputs(part: str) -> None:
    """The twin tells what the text says, the model with outputs what mechc makes of it."""
    base = BASES.setdefault("following", base_of(FOLLOWING))
    twin = twin_of("powers written out", base)
    assert twin.beside is not None
    found = compare(beside(twin, base), twin, run_twin(twin, base))
    assert found is not None and found.same, found
    doubled = tuple(
        replace(d, value=apply("add", d.type, d.value, d.value))
        if d.name == part and d.value is not None
        else d
        for d in twin.beside.definitions
    )
    wrong = replace(twin, beside=replace(twin.beside, definitions=doubled))
    found = compare(beside(wrong, base), wrong, run_twin(wrong, base))
    assert found is not None and not found.same and found.name == part


NODES = """
parameter c = 2 N.s/m; parameter k = 5 N/m;
coordinate x = 0.4 m; initial der(x) = 1 m/s; kinetic 1/2*1 kg*der(x)^2; potential 1/2*3 N/m*x^2;
coordinate a = 0.1 m; coordinate b ~ 7 m; coordinate d ~ 7 m;
potential 1/2*k*(x - b)^2 + 1/2*2*k*(b - a)^2; damping c on a;
potential 1/2*k*(x - d)^2 + 1/2*3*k*d^2;
experiment(stop = 2 s, tolerance = 1e-9);
"""
"""A node ``a`` that is a state without inertia, and nodes ``b`` and ``d`` that balances give, far from their guesses."""


@pytest.mark.parametrize("name", slow_but(["start perturbed"], ["other coordinates", "start perturbed"]))
def test_nodes_without_mass_begin_where_they_are(name: str, tmp_path: Path) -> None:
    """Such twins looked for rates, or for places, that such coordinates have none of."""
    file = tmp_path / "nodes.mech"
    file.write_text(NODES, encoding="utf-8")
    row = worker(Subject(str(file), None, {}, None, 10.0))(Extreme("twin", name))
    assert row.kind == "same", row.reason
    base = base_of(NODES)
    began = run_twin(twin_of(name, base), base).solution
    assert all(began[q][0] == pytest.approx(base.solution[q][0], rel=1e-8) for q in ("a", "b", "d"))
