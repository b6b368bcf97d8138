"""One small model for each pair of a construct and a place: tables of both, and how they are put together.

Constructs are texts of a number (or a truth value) with ``X`` for something to look at; places are statements with ``E``.
What a construct or a place needs is added to a model of one body on a hinge and a mass on a spring.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

PLANE = """\
  gravity {0, -9.81} m/s^2;
  parameter a(min = 0.1) = 0.7;
  parameter row[3] = {0.3, 0.5, 0.9};
  structural parameter Integer n = 2;
  coordinate Length x = 0.2 m;
  initial der(x) = 0.3 m/s;
  kinetic 1/2*1.3 kg*der(x)^2;
  potential 1/2*3 N/m*x^2;
  Bar bar(m = 1.1 kg, l = 0.9 m);
  Revolute pin(world -> bar.a, angle = 0.4 rad, der(angle) = 0.6 rad/s);
"""
SPACE = """\
  gravity {0, 0, -9.81} m/s^2;
  parameter a(min = 0.1) = 0.7;
  parameter row[3] = {0.3, 0.5, 0.9};
  structural parameter Integer n = 2;
  coordinate Length x = 0.2 m;
  initial der(x) = 0.3 m/s;
  kinetic 1/2*1.3 kg*der(x)^2;
  potential 1/2*3 N/m*x^2;
  Body bar(m = 1.1 kg, J = diag({0.2, 0.3, 0.25} kg.m^2), com = {0.3, 0.1, 0.2} m);
  Revolute pin(world -> bar.a, axis = {1, 2, 2}, angle = 0.4 rad, der(angle) = 0.6 rad/s);
"""
LATER = 3.0
"""Up to when probes with events run."""


@dataclass(frozen=True)
class Construct:
    """``text``: with X for its argument, a number without a dimension; ``truth``: it is a truth value."""

    name: str
    text: str
    needs: str = ""
    truth: bool = False
    space: int = 2
    file: str = ""


@dataclass(frozen=True)
class Place:
    """``text``: statements with E for the number, or C for the truth value that stands there.

    ``look``: what constructs look at here: something that moves, a parameter, or time.
    """

    name: str
    group: str
    text: str
    look: str = "(x/(1 m))"
    file: str = ""
    truth: bool = False
    guessed: bool = False
    """Whether what begins gives way, as a constraint of rates wants."""


_CONSTRAINT = """\
  coordinate Length y ~ 0.3 m;
  coordinate Length w ~ 0.2 m;
  initial der(w) ~ 0.1 m/s;
  kinetic 1/2*1 kg*(der(y)^2 + 2*der(w)^2);
  potential 2 N*y;
  constraint rope: y = 0.5*w + 0.1 m;
"""
_DRIVE = """\
  coordinate Length d;
  kinetic 1/2*0.8 kg*(der(d)^2 + der(d)*der(x));
  drive d = 0.1 m*sin(time*1 s^-1);
"""
_CONTACT = """\
  coordinate Length h = 0.4 m;
  kinetic 1/2*1 kg*der(h)^2;
  potential 1 N*h;
  contact floor: h restitution 0.5;
"""

_ROUTINE = """\
function routine(Real r, Real c[n]) -> Real
  var s = 0.1;
  for i in 1:n loop
    let u = s + c[i]*r;
    if u > 0.25 then
      s := s + 0.3*u^2;
    else
      s := s + 0.1*u;
    end if;
  end for;
  return s;
end routine;
"""
_BOTH = """\
function both(Real r) -> (Real sine, Real square)
  if r > 0.3 then
    return (sin(r), 0.2*r^2);
  end if;
  return (0.1, 0.05*r + 0.2);
end both;
"""

CONSTRUCTS: tuple[Construct, ...] = (
    Construct("number", "0.4"), Construct("quantity", "(0.4 m/s)/(1 m/s)"), Construct("unit of a parenthesis", "((0.2 + 0.1) m)/(1 m)"),
    Construct("+", "(X + 0.2)"), Construct("-", "(0.9 - X)"), Construct("*", "0.7*X"), Construct("/", "X/1.3"),
    Construct("^", "X^2"), Construct("^ rational", "(1 + X^2)^1.5"), Construct("- before", "(-X)"),
    Construct("if", "(if X > 0.1 then 0.4 else 0.6*X)"), Construct("elseif", "(if X > 2 then 0.1 elseif X > 1 then 0.2 else 0.3 + X)"),
    Construct("pi", "0.1*pi"),
    *(Construct(f, f"{f}(X)") for f in ("sin", "cos", "tan", "atan", "tanh", "asinh", "exp", "abs", "sign", "floor", "ceil")),
    *(Construct(f, f"{f}(0.3*sin(X))") for f in ("asin", "acos", "atanh", "sinh", "cosh")),
    *(Construct(f, f"{f}(1.2 + X^2)") for f in ("acosh", "log", "log10", "sqrt")),
    Construct("atan2", "atan2(X, 1.2)"), Construct("mod", "mod(X, 0.7)"), Construct("div", "div(7, 2)/10"),
    Construct("clamp", "clamp(X, -0.1, 0.9)"), Construct("deadzone", "deadzone(X, 0.05)"),
    Construct("min", "min(X, 0.6)"), Construct("max", "max(X, 0.1, -X)"), Construct("min for", "min(X/i for i in 1:3)"),
    Construct("sum", "sum({X, 0.1})"), Construct("sum for", "sum(0.1*i*X for i in 1:3)"), Construct("product", "product({X, 0.9})"),
    Construct("integral over time", "integral(0.3 + 0.1*X)/(1 s)"), Construct("integral over", "integral(cos(X*s) for s in 0:0.5)"),
    Construct("dot", "dot({X, 0.2}, {0.3, 0.4})"), Construct("cross", "cross({X, 0.2}, {0.3, 0.4})"),
    Construct("norm", "norm({X, 0.4})"), Construct("matrix", "({{0.3, 0.1}, {0.2, X}}*{0.5, 0.6})[2]"),
    Construct("transpose", "(transpose({{0.3, 0.1}, {0.2, X}})*{0.5, 0.6})[2]"), Construct("outer", "outer({X, 0.2}, {0.3, 0.4})[1, 2]"),
    Construct("identity", "(identity(2)*{X, 0.3})[1]"), Construct("diag", "(diag({0.5, X})*{0.5, 0.6})[2]"),
    Construct("table", "table(X, {-1, 0.1, 2}, {0.2, 0.3, 0.8})"), Construct("linspace", "linspace(0.1, 0.5, 3)[2]"),
    Construct("det", "det({{1 + X^2, 0.3}, {0.2, 0.5}})"), Construct("trace", "trace({{X, 0.3}, {0.2, 0.1}})"),
    Construct("inverse", "(inverse({{2 + X^2, 0.3}, {0.1, 1}})*{0.3, 0.4})[1]"), Construct("solve", "solve({{2 + X^2, 0.3}, {0.1, 1}}, {0.3, 0.4})[2]"),
    Construct("eigenvalues", "eigenvalues({{0.2*a, 0.1}, {0.1, 0.3*n}})[2]"), Construct("concat and size", "concat({X, 0.2}, row)[size(row, 1)]/2"),
    Construct("comprehension of two ranges", "{i*k*X/3 for i in 1:2, k in 1:3}[2, 1]"), Construct("slice", "(0.5*row[3:-1:2])[1]"),
    Construct("comprehension", "{i*X for i in 1:3}[2]"), Construct("index", "row[2]"),
    Construct("function", "shape(X)", file="function shape(Real r) = 0.3 + 0.2*r^2;\n"),
    Construct("function with a body", "routine(X, {0.3, 0.2, 0.1})", file=_ROUTINE),
    Construct("one of several results", "second", "  let (first, second) = both(X);\n", file=_BOTH),
    Construct("grad", "grad(dent, X)", file="function dent(Real r) = 0.3*r + 0.2*r^3;\n"),
    Construct("curl", "curl(eddy, {X, 0.4}, 0.3)", file="function eddy(Real r[2], Real c) = {c*r[2]^2, sin(r[1])};\n"),
    Construct("let", "held", "  let held = 0.4 + 0.1*(X);\n"), Construct("parameter", "a"), Construct("structural parameter", "0.2*n"),
    Construct("coordinate", "x/(1 m)"), Construct("rate", "der(x)/(1 m/s)"), Construct("second derivative", "der(x, 2)/(9 m/s^2)"),
    Construct("derivative of an expression", "der(sin(x/(1 m)))*1 s"),
    Construct("state", "follow", "  state Real follow = 0.3;\n  equation der(follow) = (0.5 - follow)/(1 s);\n"),
    Construct("output that equations determine", "root", "  output root ~ 0.5;\n  equation root^3 + root = 0.6 + 0.2*(X);\n"),
    Construct("rate of such an output", "der(root)*1 s", "  output root ~ 0.5;\n  equation root^3 + root = 0.6 + 0.2*(X);\n"),
    Construct("input", "u", "  input Real u = 0.4 + 0.1*sin(time/(1 s));\n"),
    Construct("discrete", "z", "  discrete Real z = 0.6;\n  when time > 1 s then\n    z := 0.5;\n  end when;\n"),
    Construct("time", "time/(9 s)"),
    Construct("pos", "pos(bar.b)[1]/(2 m)"), Construct("vel", "vel(bar.b)[1]/(2 m/s)"), Construct("vel relative", "vel(bar.b, bar.a)[2]/(2 m/s)"),
    Construct("vel_at", "vel_at(bar.a, bar.c)[2]/(2 m/s)"), Construct("angvel", "angvel(bar.a)/(2 rad/s)"), Construct("heading", "heading(bar.a)"),
    Construct("local", "local(bar.c, world)[1]/(2 m)"), Construct("components", "components(bar.a, {1, 0})[1]"),
    Construct("direction", "direction(bar.a, {0, 1})[2]"), Construct("point", "tip[1]/(2 m)", "  point tip = bar.a * {0.2, 0.3} m;\n"),
    Construct("trans and rot", "pos(world * trans({0.1 m, 0.2 m}) * rot(X) * {0.3, 0.4} m)[1]/(1 m)"),
    *(Construct(f, f"direction(world * {f}(X), {{0.3, 0.4, 0.5}})[{k}]", space=3) for f, k in (("rotx", 2), ("roty", 1), ("rotz", 2))),
    Construct("axis_angle", "direction(world * axis_angle({0.6, 0, 0.8}, X), {0.3, 0.4, 0.5})[1]", space=3),
    Construct("quat", "direction(world * quat(0.8, 0.6, 0, 0), {0.3, 0.4, 0.5})[2]", space=3),
    Construct("cross in space", "cross({X, 0.2, 0.1}, {0.3, 0.4, 0.5})[3]", space=3),
    Construct("angvel in space", "angvel(bar.a)[1]/(2 rad/s)", space=3),
    Construct("energy()", "energy()/(20 J)"), Construct("kinetic_energy()", "kinetic_energy()/(20 J)"), Construct("potential_energy()", "potential_energy()/(20 J)"),
    Construct("momentum", "momentum(x)/(2 kg.m/s)"), Construct("power of a name", "power(push)/(9 W)", "  force push: 0.3 N on x;\n"),
    Construct("power of a force", "power(0.3 N, x)/(9 W)"),
    Construct("reaction of a joint", "reaction(pin)[1]/(90 N)"), Construct("moment of a joint", "moment(weld)/(90 N.m)", "  Body lump(m = 0.4 kg, J = 0.1 kg.m^2);\n  Weld weld(bar.b -> lump.a);\n"),
    Construct("reaction of a drive", "reaction(d)/(9 N)", _DRIVE), Construct("multiplier of a constraint", "multiplier(rope)/(9 N)", _CONSTRAINT),
    Construct("multiplier of a contact", "multiplier(floor)/(9 N)", _CONTACT),
    Construct("mass_centre()", "mass_centre()[1]/(1 m)"), Construct("mass_centre of a body", "mass_centre(bar.a)[1]/(1 m)"),
    Construct("inertia_tensor", "inertia_tensor(bar.a)/(1 kg.m^2)"),
    Construct("<", "X < 0.3", truth=True), Construct(">=", "X >= 0.3", truth=True), Construct("==", "n == 2", truth=True), Construct("<>", "n <> 3", truth=True),
    Construct("and", "X > 0.1 and X < 0.9", truth=True), Construct("or", "X > 0.9 or X < 0.8", truth=True), Construct("not", "not X > 0.9", truth=True),
    Construct("true", "true", truth=True), Construct("closed", "closed(floor)", _CONTACT, truth=True),
    Construct("pre", "pre(x)/(1 m)"), Construct("sample", "sample(0.4 s)", truth=True), Construct("initial()", "initial()", truth=True),
)  # fmt: skip

_OWN = "  coordinate Length {0} = {1};\n  kinetic 1/2*1 kg*der({0})^2;\n  potential 1/2*2 N/m*{0}^2;\n"
PLACES: tuple[Place, ...] = (
    Place("parameter", "values", "  parameter p = E;\n  output seen = p*x;\n", "a"),
    Place("array of parameters", "values", "  parameter p[2] = {E, 0.3};\n  output seen = p[1]*x;\n", "a"),
    Place("structural parameter", "values", "  structural parameter Real p = E;\n  output seen = p*x;\n", "n"),
    Place("least value", "values", "  parameter p(min = E - 9) = 0.4;\n  output seen = p*x;\n", "a"),
    Place("initial value", "values", _OWN.format("c", "(E)*1 m"), "a"),
    Place("guess", "values", _OWN.format("c", "0.1 m").replace(" = 0.1 m", " ~ (E)*1 m"), "a"),
    Place("initial rate", "values", _OWN.format("c", "0.1 m") + "  initial der(c) = (E)*1 m/s;\n", "a"),
    Place("initial value of an expression", "values", _OWN.format("c", "0.1 m") + "  initial momentum(c) = (E)*1 kg.m/s;\n", "a"),
    Place("state", "values", "  state Real c = E;\n  equation der(c) = -c/(1 s);\n", "a"),
    Place("input", "values", "  input Real c = E;\n  output seen = c*x;\n", "(time/(1 s))"),
    Place("discrete", "values", "  discrete Real c = E;\n  when time > 1 s then\n    c := 0.5;\n  end when;\n  output seen = c*x;\n", "a"),
    Place("modification of a parameter", "values", "  Box box(m = (E + 2)*1 kg, size = {0.3, 0.4} m);\n  Prismatic rail(world -> box.a);\n", "a"),
    Place("modification of an initial value", "values", "  Box box(m = 1 kg, size = {0.3, 0.4} m);\n  Prismatic rail(world -> box.a, position = (E)*1 m);\n", "a"),
    Place("modification of an input", "values", "  SpeedMotor motor(world -> bar.a, speed = (E)*1 rad/s);\n"),
    Place("setting of an experiment", "values", "  parameter p = 0.3;\n  output seen = p*x;\n  experiment(stop = 1 s, p = E);\n", "a"),
    Place("stop time", "values", "  experiment(stop = (1.5 + E)*1 s);\n", "a"),
    Place("condition of a component", "values", "  Spring spring(world -> bar.b, k = 2 N/m) if C;\n", "n", truth=True),
    Place("condition of a block", "values", "  if C then\n    force 0.3 N on x;\n  end if;\n", "n", truth=True),
    Place("range of a loop", "values", "  for i in 1:E loop\n    force 0.3 N on x;\n  end for;\n", "n"),
    Place("size of an array", "values", "  parameter p[E] = 0.3;\n  output seen = p[1]*x;\n", "n"),
    Place("output", "formulas", "  output seen = E;\n"),
    Place("equation of an unknown output", "formulas", "  output seen ~ 0.5;\n  equation seen^3 + seen = 0.7 + 0.2*(E);\n"),
    Place("guess of an unknown output", "formulas", "  output seen ~ 0.5 + 0.1*(E);\n  equation seen^3 + seen = 0.9 + x/(3 m);\n"),
    Place("let", "formulas", "  let seen = E;\n  force seen*1 N on x;\n"),
    Place("function", "formulas", "  force g(0.3)*1 N on x;\n", "r", "function g(Real r) = E;\n"),
    Place("argument of a table", "formulas", "  force 1 N*table(E, {-1, 0.2, 3}, {0.3, 0.2, 0.9}) on x;\n"),
    Place("body of an integral", "formulas", "  force 1 N*integral(s*(E) for s in 0:1) on x;\n"),
    Place("bound of an integral", "formulas", "  force 1 N*integral(cos(s) for s in 0:(E)) on x;\n"),
    Place("integral over time", "formulas", "  output seen = integral(E);\n"),
    Place("frame", "formulas", "  frame spot = world * trans({E, 0.1}*1 m);\n  output seen = pos(spot)[1];\n"),
    Place("point", "formulas", "  point spot = bar.a * ({E, 0.1}*1 m);\n  output seen = spot[1];\n"),
    Place("place of a joint", "formulas", "  frame box;\n  mass 1 kg at box;\n  inertia 0.2 kg.m^2 on box;\n  coordinate Length c = 0.1 m;\n  place box = bar.b * trans({c, 0.1*(E)*1 m});\n"),
    Place("kinetic", "mechanics", "  kinetic 1/2*0.5 kg*(2 + 0.1*(E))*der(x)^2;\n"),
    Place("potential", "mechanics", "  potential 1 J*(E);\n"),
    Place("lagrangian", "mechanics", "  lagrangian -0.3 J*(E);\n"),
    Place("dissipation", "mechanics", "  dissipation 1/2*0.3 kg/s*(2 + 0.1*(E))*der(x)^2;\n"),
    Place("gravity", "mechanics", "E:gravity"),
    Place("mass", "mechanics", "  mass 0.2 kg*(2 + 0.3*(E)) at bar.b;\n"),
    Place("place of a mass", "mechanics", "  mass 0.4 kg at world * ({0.5*x, 0.2 m*(E)});\n"),
    Place("inertia", "mechanics", "  frame box;\n  mass 1 kg at box;\n  inertia 0.2 kg.m^2*(2 + 0.3*(E)) on box;\n  Revolute turn(bar.b -> box);\n"),
    Place("force", "mechanics", "  force 0.5 N*(E) on x;\n"),
    Place("what a force acts along", "mechanics", "  force 0.3 J on x/(1 m) + 0.3*(E);\n"),
    Place("force at a point", "mechanics", "  force {0.5 N*(E), 0.2 N} on bar.b;\n"),
    Place("where a force acts", "mechanics", "  force {0.5, 0.2} N on bar.a at bar.a * ({0.3*(E), 0.1}*1 m);\n"),
    Place("torque", "mechanics", "  torque 0.3 N.m*(E) on bar.a;\n"),
    Place("damping", "mechanics", "  damping 0.3 kg/s*(2 + 0.3*(E)) on x;\n"),
    Place("what is damped", "mechanics", "  damping 0.3 N.m.s on x/(1 m) + 0.3*(E);\n"),
    Place("equation of a state", "mechanics", "  state Real c = 0.2;\n  equation der(c) = (E - c)/(1 s);\n"),
    Place("constraint", "holding", _CONSTRAINT.replace("rope", "line").replace("Length y", "Length yy").replace("Length w", "Length ww").replace("der(w)", "der(ww)").replace("der(y)", "der(yy)").replace("2 N*y", "2 N*yy").replace("y = 0.5*w + 0.1 m", "yy = 0.5*ww + 0.1 m*(E)"), guessed=True),
    Place("constraint of velocities", "holding", "  coordinate Length yy = 0.3 m;\n  kinetic 1/2*1 kg*der(yy)^2;\n  constraint der(yy) = 0.5*der(x) + 0.1 m/s*(E);\n"),
    Place("closure", "holding", "  Box box(m = 1 kg, size = {0.3, 0.4} m);\n  Planar free(world -> box.a, x ~ 0.2 m, y ~ 0.3 m, angle ~ 0.1 rad);\n  Own hold(bar.b -> box.a);\n", file="model Own\n  frame from;\n  frame to;\n  coordinate Angle angle ~ 0 rad;\n  place to = from * rot(angle);\n  closure local(from, to) = {0.1 m*(E), 0 m};\nend Own;\n"),
    Place("prescribed motion", "holding", "  coordinate Length dd;\n  kinetic 1/2*0.8 kg*(der(dd)^2 + der(dd)*der(x));\n  drive dd = 0.1 m*(E);\n", "(time/(1 s))"),
    Place("friction", "holding", "  friction 0.3 N*(1.5 + 0.2*(E)) on x;\n"),
    Place("static friction", "holding", "  friction 0.3 N static 0.3 N*(1.8 + 0.2*(E)) on x;\n"),
    Place("what rubs", "holding", "  friction 0.3 N.m on x/(1 m) + 0.2*(E);\n"),
    Place("gap of a contact", "holding", "  contact stop: 1.4 m - x + 0.2 m*(E);\n"),
    Place("restitution", "holding", "  contact stop: 0.5 m - x restitution 0.4 + 0.1*(E);\n"),
    Place("friction of a contact", "holding", "  coordinate Length c = 0.1 m;\n  kinetic 1/2*1 kg*der(c)^2;\n  contact stop: 0.5 m - x friction 0.2 + 0.1*(E) along der(c);\n"),
    Place("condition of when", "events", "  discrete Real k = 0;\n  when C then\n    k := k + 1;\n  end when;\n", truth=True),
    Place("number in a condition of when", "events", "  discrete Real k = 0;\n  when E > 0.45 then\n    k := k + 1;\n  end when;\n"),
    Place("period of samples", "events", "  discrete Real k = 0;\n  when sample((0.4 + 0.2*(E))*1 s) then\n    k := k + 1;\n  end when;\n", "a"),
    Place("reinit", "events", "  when time > 0.5 s then\n    reinit(der(x), 0.2 m/s*(E));\n  end when;\n"),
    Place("assignment", "events", "  discrete Real k = 0;\n  when time > 0.5 s then\n    k := E;\n  end when;\n  force k*0.2 N on x;\n"),
    Place("impulse", "events", "  when time > 0.5 s then\n    impulse {0.1 N.s*(E), 0 N.s} on bar.b;\n  end when;\n"),
    Place("assert", "events", '  assert E < 99, "too large";\n'),
    Place("if in a force", "events", "  force if C then 0.3 N else -0.2 N on x;\n", truth=True),
    Place("if in a potential", "events", "  potential if C then 0.3 N*x else 0.1 N*x;\n", truth=True),
    Place("if in an output", "events", "  output seen = if C then 0.3 else x/(1 m);\n", truth=True),
)  # fmt: skip


def probe(construct: Construct, place: Place) -> str | None:
    """Write the model of a pair; None where a truth value meets the place of a number, or the other way round."""
    if construct.truth != place.truth:
        return None
    e = construct.text.replace("X", place.look)
    needs = construct.needs.replace("X", place.look)
    base = PLANE if construct.space == 2 else SPACE
    text = place.text
    if construct.space == 3:
        text = (
            text.replace("0.1}*1 m", "0.1, 0.2}*1 m")
            .replace("0.2 N}", "0.2 N, 0.1 N}")
            .replace("{0.5, 0.2} N", "{0.5, 0.2, 0.1} N")
        )
        text = (
            text.replace("0.2 m*(E)}", "0.2 m*(E), 0.1 m}")
            .replace("0 N.s}", "0 N.s, 0 N.s}")
            .replace("0.1*(E)*1 m})", "0.1*(E)*1 m, 0 m})")
        )
        text = (
            text.replace("0.3, 0.4} m", "0.3, 0.4, 0.5} m")
            .replace("0.2 kg.m^2 on", "0.2 kg.m^2*identity(3) on")
            .replace("bar.b", "bar.a")
        )
        text = text.replace("0.2 kg.m^2*(2 + 0.3*(E))", "0.2 kg.m^2*(2 + 0.3*(E))*identity(3)").replace(
            "torque 0.3 N.m*(E)", "torque {0, 0, 0.3 N.m*(E)}"
        )
        text = text.replace("speed = (E)", "speed = (E)").replace(
            "Planar free(world -> box.a, x ~ 0.2 m, y ~ 0.3 m, angle ~ 0.1 rad)", "Free free(world -> box.a)"
        )
    file = place.file + construct.file
    if construct.space == 3:
        file = file.replace("rot(angle)", "rotz(angle)").replace("0 m}", "0 m, 0 m}")
    if place.guessed:
        base = re.sub(r"der\((x|angle)\) = ", r"der(\1) ~ ", base)
    if place.text == "E:gravity":
        base = base.replace("-9.81}", "-9.81*(1 + 0.01*(E))}")
        text = ""
    both = (base + needs + text).replace("(E)", f"({e})").replace("E,", f"{e},")
    whole = _put(both, e)
    last = "" if "experiment" in whole else f"  experiment(stop = {LATER} s);\n"
    return f"import mech.{'planar' if construct.space == 2 else 'spatial'}.*;\n{_put(file, e)}model M\n{whole}{last}end M;\n"


def _put(text: str, e: str) -> str:
    """Put the expression where E or C stands alone."""
    return re.sub(r"(?<![\w.])[EC](?![\w.])", lambda _: e, text)
