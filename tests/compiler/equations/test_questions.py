"""Every question of the language in every place of a model, against Lagrange's equations written down by SymPy.

The twin of a model has the same energies and forces, with each joint cut and each drive released: what holds them again
are constraints, whose multipliers are the reactions. The answer itself is one more unknown, so that forces may follow
from it in any way. Accelerations, rates of states and the answer are compared at one state.
"""

from __future__ import annotations

import itertools
import math

import mpmath
import pytest
import sympy as sp
from compiled import compiled, outcome
from msgspec import Struct, field
from sympy import Expr, Symbol

from mechc.compiler.compilation import Compilation
from mechc.lang.diagnostics import CompileError

t, Q = sp.symbols("t Q")
STATE = {"q": 0.7, "r": -0.4, "s": 0.3, "w": 0.0, "A": 0.6, "x": 0.25}
RATES = {"q": 0.5, "r": 1.3, "s": 1.8, "w": 0.0, "A": -0.8}
TIME = 0.3


def place(name: str) -> Symbol:
    return sp.Symbol(name)


def rate(name: str) -> Symbol:
    return sp.Symbol(f"d{name}")


def second(name: str) -> Symbol:
    return sp.Symbol(f"dd{name}")


class Part(Struct, frozen=True):
    """A piece of a model and of its twin: energies, dissipation, forces and constraints (with their multipliers)."""

    text: str
    coordinates: tuple[str, ...] = ()
    kinetic: Expr = sp.S.Zero
    potential: Expr = sp.S.Zero
    dissipation: Expr = sp.S.Zero
    forces: dict[str, Expr] = field(default_factory=dict)
    constraints: dict[str, Expr] = field(default_factory=dict)
    rates: dict[str, Expr] = field(default_factory=dict)


q, r, s, w, A = map(place, ("q", "r", "s", "w", "A"))
X, Y, D, U = map(place, ("X", "Y", "D", "U"))
dq, dr, dA = rate("q"), rate("r"), rate("A")

BASE = Part(
    """import mech.planar.*;
coordinate Length q = 0.7 m; coordinate Length r = -0.4 m; coordinate Length s;
mass 2 kg at world*{q, 0 m}; mass 1 kg at world*{0 m, r}; kinetic 1/4*1 kg*der(s)^2;
potential 3/2*1 N/m*q^2 + 1 N/m^2*q*r^2;
constraint c: s = q + r;
force f: 0.2 N/m*q on r;
damping d: 0.3 N.s/m on r;
""",
    ("q", "r", "s"),
    dq**2 + dr**2 / 2 + rate("s") ** 2 / 4,
    3 * q**2 / 2 + q * r**2,
    sp.Rational(3, 20) * dr**2,
    {"r": q / 5},
    {"c": s - q - r},
)

# the body of the hinge, cut: its place (X, Y), the angle in the joint, and a twist D of the cut
theta = A + D
centre = (X + 0.4 * sp.cos(theta), Y + 0.4 * sp.sin(theta))


def along(e: Expr, names: tuple[str, ...]) -> Expr:
    return sum((e.diff(place(n)) * rate(n) for n in names), e.diff(t))


HANGING = ("A", "X", "Y", "D")
speed = [along(e, HANGING) for e in centre]
tip = (X + sp.cos(theta), Y + sp.sin(theta))
spring = sp.sqrt((tip[0] - 3) ** 2 + (tip[1] - 4) ** 2)
HINGE = Part(
    """Body b(m = 1.5 kg, J = 0.2 kg.m^2, com = {0.4, 0} m);
Revolute h(world -> b.a, angle = 0.6 rad);
gravity {0, -9.81} m/s^2;
let tip = b.a*{1, 0} m;
let reach = norm(pos(tip) - {3, 4} m);
potential 1/2*7 N/m*reach^2;
dissipation 1/2*0.5 N.s/m*der(reach)^2;
kinetic 1/2*0.3 kg*(1 + (pos(tip)[1]/(2 m))^2)*der(reach)^2;
lagrangian 0.2 N.s/m*pos(tip)[2]*vel(tip)[1];
torque 0.4 N.m on h.angle;
""",
    HANGING,
    0.75 * (speed[0] ** 2 + speed[1] ** 2)
    + 0.1 * along(theta, HANGING) ** 2
    + 0.15 * (1 + tip[0] ** 2 / 4) * along(spring, HANGING) ** 2
    + 0.2 * tip[1] * along(tip[0], HANGING),
    3.5 * spring**2 + 1.5 * 9.81 * centre[1],
    0.25 * along(spring, HANGING) ** 2,
    {"A": sp.Rational(2, 5)},
    {"X": X, "Y": Y, "D": D},
)
# gravity acts on the point masses as well
HINGE_AND_WEIGHT = Part(
    HINGE.text, HINGE.coordinates, HINGE.kinetic, HINGE.potential + 9.81 * r, HINGE.dissipation,
    HINGE.forces, HINGE.constraints,
)  # fmt: skip
DRIVE = Part(
    "coordinate Length U; kinetic 1/2*0.8 kg*(der(U) + der(r))^2; drive U = 0.1 m*sin(2*time/(1 s));\n",
    ("U",),
    0.4 * (rate("U") + dr) ** 2,
    constraints={"U": U - sp.sin(2 * t) / 10},
)
FLOOR = Part(
    "coordinate Length w; kinetic 1/2*1 kg*(der(w) + 0.5*der(q))^2; force -2 N on w; contact floor: w;\n",
    ("w",),
    (rate("w") + dq / 2) ** 2 / 2,
    forces={"w": sp.Integer(-2)},
    constraints={"floor": w},
)
RUB = Part("friction fr: 0.2 N on r;\n", forces={"r": -sp.Rational(1, 5)})  # r slides forwards


class Question(Struct, frozen=True):
    """``text`` is a pure number; ``answer`` what it is, of energies ``T``, ``V``, ``h`` or of the parts' symbols."""

    text: str
    answer: Expr
    part: Part = Part("")
    force: bool = False


T, V, h, momentum = sp.symbols("T V h momentum")


def multiplier(name: str) -> Symbol:
    return sp.Symbol(f"lam_{name}")


QUESTIONS = {
    "energy": Question("energy()/(1 J)", h),
    "energy beside a drive": Question("energy()/(1 J)", h, DRIVE),
    "energy of a body": Question("energy()/(1 J)", h, HINGE_AND_WEIGHT),
    "kinetic energy": Question("kinetic_energy()/(1 J)", T),
    "potential energy": Question("potential_energy()/(1 J)", V, HINGE_AND_WEIGHT),
    "momentum": Question("momentum(q)/(1 N.s)", momentum),
    "mass centre": Question("mass_centre()[1]/(1 m)", 2 * q / 3),
    "inertia": Question("inertia_tensor(b.a)/(1 kg.m^2)", sp.Rational(1, 5), HINGE_AND_WEIGHT),
    "power of a force": Question("power(f)/(1 W)", q / 5 * dr),
    "power of a damping": Question("power(d)/(1 W)", -sp.Rational(3, 10) * dr**2),
    "power on a coordinate": Question("power(1.5 N, q)/(1 W)", sp.Rational(3, 2) * dq),
    "closed": Question("(if closed(floor) then 1 else 0)", sp.S.One, FLOOR),
    "power of a friction": Question("power(fr)/(1 W)", -dr / 5, RUB, force=True),
    "multiplier": Question("multiplier(c)/(1 N)", multiplier("c"), force=True),
    "multiplier of a contact": Question("multiplier(floor)/(1 N)", multiplier("floor"), FLOOR, force=True),
    "reaction of a drive": Question("reaction(U)/(1 N)", multiplier("U"), DRIVE, force=True),
    "first reaction": Question("reaction(h)[1]/(1 N)", multiplier("X"), HINGE_AND_WEIGHT, force=True),
    "second reaction": Question("reaction(h)[2]/(1 N)", multiplier("Y"), HINGE_AND_WEIGHT, force=True),
    "moment": Question("moment(h)/(1 N.m)", multiplier("D"), HINGE_AND_WEIGHT, force=True),
}

PLACES = {
    "force": Part("force 0.1 N*(Q) on r;", forces={"r": Q / 10}),
    "force with a rate": Part("force -0.1 N*((Q) - 2)*der(q)/(1 m/s) on q;", forces={"q": -(Q - 2) * dq / 10}),
    "force of an alias": Part("let e = Q; force 0.1 N*e on r; output twice = 2*e;", forces={"r": Q / 10}),
    "force of a condition": Part(
        "force (if (Q) > -1000 then 1 N else 7 N) on r;", forces={"r": sp.Integer(1)}
    ),
    "force of a size": Part("force 0.1 N*abs(Q) on r;", forces={"r": sp.Abs(Q) / 10}),
    "force of an integral": Part(
        "force 0.1 N*integral((Q)*(1 + z) for z in 0:1) on r;", forces={"r": 3 * Q / 20}
    ),
    "torque": Part("coordinate Angle k; kinetic 1/2*2 kg.m^2*der(k)^2; torque 0.1 N.m*(Q) on k;", ("k",),
        rate("k") ** 2, forces={"k": Q / 10}),
    "damping": Part("damping 0.1 N.s/m*(Q) on r;", dissipation=Q * dr**2 / 20),
    "dissipation": Part("dissipation 0.1 N.s/m*(Q)*der(q)*der(r);", dissipation=Q * dq * dr / 10),
    "equation": Part("state x = 0.25; equation der(x) = ((Q) - x)/(0.1 s);",
        rates={"x": 10 * (Q - place("x"))}),
    "equation and force": Part("state x = 0.25; equation der(x) = ((Q) - x)/(0.1 s); force 1 N*x on r;",
        forces={"r": place("x")}, rates={"x": 10 * (Q - place("x"))}),
    "equation beside an energy of the state": Part(
        "state x = 0.25; equation der(x) = (0.1*(Q) - x)/(1 s); kinetic 1/2*1 kg*x*der(r)^2;",
        kinetic=place("x") * dr**2 / 2, rates={"x": Q / 10 - place("x")}),
    "root of a force": Part("force -0.1 N*(abs(Q) + 0.1)^(1/3) on r;",
        forces={"r": -(sp.Abs(Q) + sp.Rational(1, 10)) ** sp.Rational(1, 3) / 10}),
    "quotient by a force": Part("force 0.2 N/(2 + (Q)^2) on r;", forces={"r": 1 / (10 + 5 * Q**2)}),
    "two laws": Part("force 0.1 N*sin(Q) on r; force -0.2 N*(Q)/sqrt(1 + (Q)^2) on q;",
        forces={"r": sp.sin(Q) / 10, "q": -Q / sp.sqrt(1 + Q**2) / 5}),
    "nothing": Part(""),
}  # fmt: skip
ENERGIES = {
    "potential": Part("potential 0.1 J*(Q);", potential=Q / 10),
    "kinetic": Part("kinetic 0.1 kg*(Q)*der(r)^2;", kinetic=Q * dr**2 / 10),
    "lagrangian": Part("lagrangian 0.1 J*(Q);", kinetic=Q / 10),
}
"""Places of energies, for questions that they are not part of."""

NOT_CIRCULAR = {
    ("mass centre", "potential"), ("mass centre", "kinetic"), ("mass centre", "lagrangian"),
    ("inertia", "potential"), ("inertia", "kinetic"), ("inertia", "lagrangian"),
    ("power of a force", "potential"), ("power of a force", "kinetic"), ("power of a force", "lagrangian"),
    ("power of a damping", "kinetic"), ("power on a coordinate", "lagrangian"),
    ("kinetic energy", "potential"), ("kinetic energy", "lagrangian"),
    ("potential energy", "kinetic"), ("potential energy", "lagrangian"),
}  # fmt: skip


class Twin:
    """Lagrange's equations of some parts, with the answer to a question as one more unknown."""

    def __init__(self, question: Question, parts: tuple[Part, ...]) -> None:
        self.names = tuple(itertools.chain(*(p.coordinates for p in parts)))
        kinetic = sum((p.kinetic for p in parts), sp.S.Zero)
        potential = sum((p.potential for p in parts), sp.S.Zero)
        self.rates = {k: v for p in parts for k, v in p.rates.items()}
        bare = kinetic.subs(Q, 0) - potential.subs(Q, 0)
        free = [n for n in self.names if n not in ("X", "Y", "D")]  # what is driven has a momentum, too
        gradient = {n: bare.diff(rate(n)) for n in free}
        # a velocity-dependent term of the Lagrangian belongs to no energy of its own, but to h
        linear = 0.2 * tip[1] * along(tip[0], HANGING) if "X" in self.names else sp.S.Zero
        known = {
            T: kinetic.subs(Q, 0) - linear,
            V: potential.subs(Q, 0),
            h: sum((gradient[n] * rate(n) for n in free), sp.S.Zero) - bare,
            momentum: gradient["q"],
        }
        answer = question.answer.subs(known)
        put_in = {} if question.force else {Q: answer}
        lagrangian = (kinetic - potential).subs(put_in)
        dissipation = sum((p.dissipation for p in parts), sp.S.Zero).subs(put_in)
        constraints = {k: e for p in parts for k, e in p.constraints.items()}
        self.unknowns = [*map(second, self.names), *map(multiplier, constraints), Q]
        self.equations: list[Expr] = []
        for n in self.names:
            p = lagrangian.diff(rate(n))
            row = self.total(p) - lagrangian.diff(place(n)) + dissipation.diff(rate(n))
            row -= sum((part.forces.get(n, sp.S.Zero) for part in parts), sp.S.Zero)
            row -= sum((multiplier(k) * e.diff(place(n)) for k, e in constraints.items()), sp.S.Zero)
            self.equations.append(row)
        self.equations += [self.total(self.total(e)) for e in constraints.values()]
        self.equations.append(Q - answer)

    def total(self, e: Expr) -> Expr:
        """The time derivative along the motion."""
        result = e.diff(t) + sum((e.diff(place(x)) * f for x, f in self.rates.items()), sp.S.Zero)
        for n in self.names:
            result += e.diff(place(n)) * rate(n) + e.diff(rate(n)) * second(n)
        return result

    def solve(self) -> dict[str, float]:
        values = {place(n): STATE.get(n, 0.0) for n in (*self.names, *self.rates)}
        values |= {rate(n): RATES.get(n, 0.0) for n in self.names} | {t: TIME}
        values |= {U: mpmath.sin(2 * TIME) / 10, rate("U"): mpmath.cos(2 * TIME) / 5}
        residuals = [e.subs(values) for e in self.equations]
        function = sp.lambdify(self.unknowns, residuals, "mpmath")
        found = mpmath.findroot(function, [0.5] * len(self.unknowns), tol=1e-24, maxsteps=60)
        solution = dict(zip(self.unknowns, found, strict=True))
        result = {f"der(der({n}))": float(solution[second(n)]) for n in self.names}
        result["answer"] = float(solution[Q])
        for x, f in self.rates.items():
            result[f"der({x})"] = float(f.subs(values).subs(solution))
        return result


def values_of(model: Compilation) -> dict[str, float]:
    """The state above by the names of the model, with the floor closed and the friction sliding."""
    of = {"h.angle": "A", "k": "k"}
    values = {"time": TIME}
    for entry in model.equations.states:
        name = entry.name.removeprefix("der(").removesuffix(")")
        if entry.kind in ("coordinate", "rate", "state"):
            table = RATES if entry.kind == "rate" else STATE
            values[entry.name] = table.get(of.get(name, name), 0.0)
    on = {"closed(floor)": 1.0, "enabled(floor)": 1.0, "slip(fr)": 1.0}
    for entry in model.equations.discretes:
        if entry.name in on:
            values[entry.name] = on[entry.name]
        elif entry.name.startswith("switch("):
            values[entry.name] = 1.0  # of a condition, which holds
    return values


def compare(question: Question, part: Part) -> None:
    text = BASE.text + question.part.text + part.text.replace("Q", question.text)
    text += f"\noutput answer = {question.text};\n"
    model = compiled(text)
    expected = Twin(question, (BASE, question.part, part)).solve()
    values = values_of(model)
    if "abs(" in part.text:  # the sides of forces are switches
        negative = float(expected["answer"] < 0)
        values |= {e.name: negative for e in model.equations.discretes if e.name.startswith("switch(force")}
    rhs, outputs = outcome(model, "rhs", values), outcome(model, "outputs", values)
    assert outputs["answer"] == pytest.approx(expected["answer"], rel=1e-9, abs=1e-9)
    names = {"A": "h.angle"}
    compared = 0
    for key, value in expected.items():
        n = key.removeprefix("der(").removesuffix(")").removeprefix("der(").removesuffix(")")
        name = (
            f"der({names.get(n, n)})"
            if key.startswith("der(der(")
            else key.removeprefix("der(").removesuffix(")")
        )
        if name in rhs:
            assert rhs[name] == pytest.approx(value, rel=1e-9, abs=1e-9), name
            compared += 1
    assert compared >= 3


def pairs() -> list[object]:
    """Every question in every place; one in eighteen is quick enough for each run of the tests."""
    table = itertools.product(enumerate(QUESTIONS), enumerate(PLACES))
    return [
        pytest.param(name, there, marks=() if (i + j) % 18 == 0 else pytest.mark.slow)
        for (i, name), (j, there) in table
    ]


@pytest.mark.parametrize(("name", "there"), pairs())
def test_question_in_its_place(name: str, there: str) -> None:
    compare(QUESTIONS[name], PLACES[there])


@pytest.mark.parametrize("there", [name for name in PLACES if name != "nothing"])
def test_reaction_that_is_asked_for_nowhere_else(there: str) -> None:
    """The joint is cut for the sake of any place that asks."""
    text = BASE.text + HINGE.text + PLACES[there].text.replace("Q", "reaction(h)[1]/(1 N)")
    alone, reported = compiled(text), compiled(f"{text}\noutput F = reaction(h)[1];")
    values = values_of(alone)
    expected = outcome(reported, "rhs", values)
    assert outcome(alone, "rhs", values) == pytest.approx(expected, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(
    ("name", "there"),
    [
        pytest.param(*pair, marks=pytest.mark.slow if k % 3 else ())
        for k, pair in enumerate(sorted(NOT_CIRCULAR))
    ],
)
def test_question_in_an_energy(name: str, there: str) -> None:
    compare(QUESTIONS[name], ENERGIES[there])


def refused(text: str) -> list[str]:
    with pytest.raises(CompileError) as error:
        compiled(BASE.text + text)
    return [d.code for d in error.value.diagnostics if d.code.startswith("E")]


CIRCULAR = sorted(
    {(q, e) for q, e in itertools.product(("energy", "momentum"), ENERGIES)}
    | {("kinetic energy", "kinetic"), ("potential energy", "potential")}
)


@pytest.mark.parametrize(("name", "there"), CIRCULAR)
def test_energy_of_itself(name: str, there: str) -> None:
    assert refused(ENERGIES[there].text.replace("Q", QUESTIONS[name].text)) == ["E0534"]


@pytest.mark.parametrize("name", [name for name, question in QUESTIONS.items() if question.force])
@pytest.mark.parametrize("there", ENERGIES)
def test_energy_of_a_force(name: str, there: str) -> None:
    question = QUESTIONS[name]
    assert refused(question.part.text + ENERGIES[there].text.replace("Q", question.text)) == ["E0535"]


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("mass 1 kg*(Q) at world;", "E0535"),
        ("inertia 1 kg.m^2*(Q) on world;", "E0535"),
        ("mass 1 kg at world*trans({1 m*(Q), 0 m});", "E0535"),
        ("constraint e: s = 1 m*(Q);", "E0535"),
        ("constraint e: der(s) = 1 m/s*(Q);", "E0535"),
        ("contact e: s + 1 m*(Q);", "E0535"),
        ("contact e: s friction 0.1 along der(r)*(Q);", "E0535"),
        ("drive s = 1 m*(Q);", "E0504"),
        ("input k = (Q);", "E0811"),
        ("parameter k = (Q);", "E0810"),
        ("state k = (Q); equation der(k) = 1/(1 s);", "E0607"),
        ("experiment(r = 1 m*(Q));", "E0812"),
        ("output k = der(Q);", "E0528"),
    ],
)
@pytest.mark.parametrize("question", ["multiplier(c)/(1 N)", "(if closed(e2) then 1 else 0)"])
def test_place_that_cannot_know_forces(text: str, code: str, question: str) -> None:
    if "closed" in question and "der(Q)" in text:
        return  # it jumps, and has the rate 0
    found = refused("contact e2: s + 5 m;" + text.replace("Q", question))
    assert [c for c in found if c != "E0702"] == [code]  # a gap that only a drive changes


SPACE = """import mech.spatial.*;
gravity {0, 1, -9.81} m/s^2;
Body top(m = 2 kg, J = diag({0.3, 0.4, 0.5} kg.m^2), com = {0.4, -0.1, 0.2} m);
Body low(m = 1 kg, J = diag({0.1, 0.2, 0.15} kg.m^2), com = {0, 0.3, -0.2} m);
Spherical ball(world -> top.a);
Universal cross(top.a*trans({0.5, 0, 0.2} m) -> low.a);
Spring line(world*trans({1, 2, 0} m) -> low.a*trans({0, 1, 0} m), k = 8 N/m, rest = 0.4 m);
constraint held: pos(low.a)[3] = 0.1 m;
force push: 0.3 N/m*pos(low.a) on top.a*{0, 0, 1} m;
"""
ANSWERS = {
    "energy()": ("J", 0.01), "momentum(ball.orientation)[2]": ("N.m.s", 0.3), "mass_centre()[3]": ("m", 1.0),
    "mass_centre(low.a)[1]": ("m", 1.0), "inertia_tensor(top.a)[1,1]": ("kg.m^2", 1.0), "power(push)": ("W", 0.1),
    "reaction(ball)[2]": ("N", 0.02), "moment(cross)[1]": ("N.m", 0.1), "reaction(cross)[3]": ("N", 0.02),
    "multiplier(held)": ("N", 0.03),
}  # fmt: skip
USES = {
    "force": "force {0.1, 0.2, 0.3} N*(Q) on low.a;",
    "torque": "torque {0.1, -0.2, 0.3} N.m*(Q) on top.a;",
    "law": "force {0.1, 0.2, 0.3} N*cos(Q) on low.a; torque {0.1, 0, 0.2} N.m*exp(-(Q)^2) on top.a;",
}


@pytest.mark.parametrize(
    ("asked", "use"),
    [
        pytest.param(asked, use, marks=() if (i + j) % 3 == 0 else pytest.mark.slow)
        for (i, asked), (j, use) in itertools.product(enumerate(ANSWERS), enumerate(USES))
    ],
)
def test_answer_in_space_is_what_the_output_says(asked: str, use: str) -> None:
    """Where the answer stands, an input with its value gives the same accelerations."""
    unit, size = ANSWERS[asked]
    number = f"{size}*{asked}/(1 {unit})"
    model = compiled(f"{SPACE}{USES[use].replace('Q', number)}\noutput answer = {number};")
    twin = compiled(f"{SPACE}input Real k;\n{USES[use].replace('Q', 'k')}\noutput answer = {number};")
    moving = [e.name for e in model.equations.states if e.kind in ("coordinate", "rate")]
    values = {name: 0.3 + 0.4 * math.sin(7.0 * k) for k, name in enumerate(moving)}
    length = math.hypot(*(values[f"ball.orientation[{k}]"] for k in range(1, 5)))
    values |= {f"ball.orientation[{k}]": values[f"ball.orientation[{k}]"] / length for k in range(1, 5)}
    values["time"] = 0.2
    answer = outcome(model, "outputs", values)["answer"]
    assert abs(answer) > 1e-3
    found, expected = outcome(model, "rhs", values), outcome(twin, "rhs", values | {"k": answer})
    assert outcome(twin, "outputs", values | {"k": answer})["answer"] == pytest.approx(answer, rel=1e-9)
    rates = [n for n in found if n.startswith("der(")]
    assert [found[n] for n in rates] == pytest.approx([expected[n] for n in rates], rel=1e-8, abs=1e-8)


LOOP = """\
import mech.planar.*;
Body b1(m = 1 kg, J = 0.1 kg.m^2);
Body b2(m = 1 kg, J = 0.1 kg.m^2);
Revolute j1(world -> b1.a, angle ~ 0.1 rad);
Revolute j2(b1.a * trans({0.5, 0} m) -> b2.a, angle ~ 0.3 rad);
PinSlot slot(world * trans({0.7, 0} m) -> b2.a * trans({0.5, 0} m));
"""


@pytest.mark.parametrize(
    "place",
    [
        "force Q*1 N.m on j1.angle;",
        "force Q*{1, 0} N on b1.a * {0.2, 0} m;",
        "torque Q*1 N.m on b1.a;",
        "damping Q*1 N.m.s on j1.angle;",
        "friction Q*1 N.m on j1.angle;",
        "dissipation Q*1 N.m.s*der(j1.angle)^2;",
        "kinetic Q*1 J.s*der(j1.angle);",
        "potential Q*1 J;",
        "gravity {0, Q} m/s^2;",
        "mass Q*1 kg at b1.a;",
        "inertia Q*1 kg.m^2 on b1.a;",
        "constraint c: sin(j1.angle) = Q;",
        "constraint c: der(j1.angle) = Q*1 rad/s;",
        "contact c: 1 m - 0.1 m*j1.angle restitution Q;",
        "state x = 0; equation der(x) = Q/(1 s);",
        "output y ~ 1; equation y^3 + y = Q;",
        "output y = der(Q);",
        "assert Q < 1, \"small\";",
        "when Q > 1 then terminate(\"large\"); end when;",
    ],
)  # fmt: skip
def test_questions_without_an_answer_are_refused_wherever_they_stand(place: str) -> None:
    """The coordinate of a joint that closes a loop is none that is free, and has no momentum."""
    with pytest.raises(CompileError) as caught:
        compiled(LOOP + place.replace("Q", "(momentum(slot.angle)/(1 J.s))"))
    assert {d.code for d in caught.value.diagnostics if d.code.startswith("E")} == {"E0522"}
