"""Wrong models of machines, each written before its message: what is said of them, and what to write instead."""

from __future__ import annotations

import pytest

import mechc

X = "coordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2;\n"
A = "coordinate Angle a = 0 rad; kinetic 1/2*1 kg.m^2*der(a)^2;\n"

WRONG = {
    "degrees Celsius": (
        X + "parameter Temperature T = 20 degC;",
        "E0112",
        "unknown unit 'degC'",
        "temperatures are written in K: 293.15 K, and a difference is 20 K",
    ),
    "three moments of inertia": (
        "import mech.spatial.*;\nBody b(m = 1 kg, J = {1, 2, 3} kg.m^2);",
        "E0305",
        "'J' has 3 x 3 elements, the value has 3 elements",
        "give it 3 x 3 elements, or write 'diag({1, 2, 3} kg.m^2)' for a diagonal matrix",
    ),
    "node on nothing": (
        X + "coordinate Length z ~ 0 m;",
        "E0520",
        "nothing with mass moves with 'z', and no force decides where it is",
        "give a mass to what it moves, connect it by a spring or a damping, or remove the coordinate",
    ),
    "contact at a massless": (
        X + "coordinate Length z = 0 m; potential 1/2*4 N/m*(x - z)^2;\ncontact c: z;",
        "E0520",
        "nothing with mass moves with 'z'",
        "contacts and friction in contacts act on what has mass: give some to what it moves; a damping needs none",
    ),
    "freewheel at a massless": (
        X
        + "coordinate Length z = 0 m; potential 1/2*4 N/m*z^2; friction f: forward 1 N backward infinite on z - x;",
        "E0541",
        "the friction 'f' does not determine the motion of a massless coordinate",
        "let a damping act on this coordinate too, give it a mass, or a large limit in place of 'infinite'",
    ),
    "static friction at a massless": (
        X + "coordinate Length z = 0 m; potential 1/2*4 N/m*(x - z)^2;\nfriction f: 1 N static 2 N on z;",
        "E0541",
        "the friction 'f' does not determine the motion of a massless coordinate",
        "without mass, the coordinate would jump when sliding begins; leave 'static' out, or give it a mass",
    ),
    "friction on a rotation without mass": (
        "import mech.planar.*;\nBody arm(m = 0 kg, J = 0 kg.m^2); Revolute h(world -> arm.a, angle = 0 rad);\nfriction f: 1 N.m on h.angle;",
        "E0541",
        "the friction 'f' does not determine the motion of a massless coordinate",
        "connect what it moves by a spring or a damping, or give it a mass",
    ),
    "impulse on a massless": (
        X
        + "coordinate Length z ~ 0 m; potential 1/2*4 N/m*(x - z)^2 + 1/2*4 N/m*z^2;\nwhen x < 0 m then impulse 1 N.s on z; end when;",
        "E0713",
        "'z' has no mass, so it cannot be pushed",
        "let the event change a force, or give a mass to what moves with it",
    ),
    "massless follows an input": (
        X
        + "input Length u; coordinate Length z ~ 0 m; potential 1/2*4 N/m*(x - z)^2 + 1/2*4 N/m*(z - u)^2; output r = der(z);",
        "E0523",
        "the equations need the rate of the input 'u', which is unknown",
        "let formulas read it through a filter, which has rates: u(filter = 1 ms); a constant default keeps it as it is",
    ),
    "output guess without equation": (
        X + "output z ~ 1; force -1 N*z on x;",
        "E0339",
        "'z': 1 unknown number, no equations",
        "write 'equation a = b;' for what determines it",
    ),
    "equation without guess": (
        X + "output z; equation z^3 = x/1 m; force -1 N*z on x;",
        "E0411",
        "output 'z' has no value",
        "write 'output z = ...;', or 'output z ~ ...;' with a guess, where equations find it",
    ),
    "equation without solution": (
        X + "output z ~ 1; equation z^2 = -1; force -1 N*z on x;",
        "E0339",
        "the equations for 'z' contradict each other",
        "one of them is to be left out, or says something else than is meant",
    ),
    "unit mismatch in equation": (
        X + "output Length z ~ 1 m; equation z^2 = x; force -1 N/m*z on x;",
        "E0302",
        "the sides of the equation differ: left side is an area (m^2), right side is a length (m)",
        "on the right side one factor of [m] is missing; a length in scope: 'x' (line 1), 'z' (line 2)",
    ),
    "circle of signals": (
        "model G input Real u; output Real y = 2*u^2; end G;\nmodel L\n  G a(u = b.y); G b(u = a.y);\n  state Real s = 0; equation der(s) = a.y/1 s;\nend L;",
        "E0207",
        "'a.u' is defined by itself",
        "where both hold at once, let an equation determine one of them: 'output y ~ 0;' and 'equation y = ..;' instead of 'output y = ..;'",
    ),
    "function without return": (
        "function f(Real x) -> Real\n  let y = x^2;\nend f;\ncoordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2;\nforce -f(x/1 m)*1 N on x;",
        "E0221",
        "function 'f' returns nothing",
        "end it with 'return e;'",
    ),
    "wrong number of results": (
        "function f(Real x) -> (Real a, Real b)\n  return x;\nend f;\ncoordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2;\nlet (p, q) = f(x/1 m); force -p*1 N on x;",
        "E0222",
        "'f' gives 2 values, this returns 1",
        "write 'return (a, b);', one value for each",
    ),
    "unbounded loop": (
        "function f(Real x) -> Real\n  var s = x;\n  while s > 1 loop s := s/2; end while;\n  return s;\nend f;\ncoordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2;\nforce -f(x/1 m)*1 N on x;",
        "E0133",
        "a function has no 'while'",
        "a loop of a function runs over a range, 'for i in 1:n loop .. end for;': how often must be known when compiling",
    ),
    "loop bound by a state": (
        "function f(Real x) -> Real\n  var s = 0;\n  for i in 1:x loop s := s + i; end for;\n  return s;\nend f;\ncoordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2;\nforce -f(x/1 m)*1 N on x;",
        "E0315",
        "the end of a range must be known when compiling",
        "only structural parameters, numbers and indices of loops are known",
    ),
    "assign a let": (
        "function f(Real x) -> Real\n  let s = 0;\n  s := x;\n  return s;\nend f;\ncoordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2;\nforce -f(x/1 m)*1 N on x;",
        "E0220",
        "'s' is a 'let' and keeps its value",
        "declare it by 'var s = ..;' where its value changes",
    ),
    "recursion": (
        "function f(Real x) -> Real = x*f(x - 1);\ncoordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2;\nforce -f(x/1 m)*1 N on x;",
        "E0210",
        "function 'f' calls itself",
        "functions are written out where they are called, so they cannot be recursive",
    ),
    "unit of var changes": (
        "function f(Length x) -> Length\n  var s = 0 m;\n  s := x^2;\n  return s;\nend f;\ncoordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2;\nforce -f(x)*1 N/m on x;",
        "E0303",
        "'s' is a length (m), the value is an area (m^2)",
        "one factor of [m] is too many",
    ),
    "index out of range": (
        "function f(Real c[3]) -> Real\n  return c[4];\nend f;\ncoordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2;\nforce -f({1,2,3})*x*1 N/m on x;",
        "E0314",
        "index 4 is outside 1:3",
        "the first one is 'c[1]', the last one 'c[3]'",
    ),
    "sizes that do not fit": (
        "function f(Real a[n], Real b[n]) -> Real\n  return sum(a[i]*b[i] for i in 1:n);\nend f;\ncoordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2;\nforce -f({1,2,3},{1,2})*x*1 N/m on x;",
        "E0305",
        "'b' has 3 elements, the value has 2 elements",
        "give it 3 elements, or one value for all of them",
    ),
    "python words": (
        "function f(Real x) -> Real\n  s = x;\n  return s;\nend f;\ncoordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2;\nforce -f(x/1 m)*1 N on x;",
        "E0118",
        "a variable gets a new value by ':='",
        "write ':='; a name for a value that stays is declared by 'let'",
    ),
    "solve of non square": (
        X + "parameter Real A[2,3] = {{1,2,3},{4,5,6}}; let b[2] = solve(A, {1,2}); force -b[1]*1 N on x;",
        "E0305",
        "'solve' takes a square matrix, this is an array [2, 3] of numbers",
        "a system has as many equations as unknowns; least squares of more are 'solve(transpose(A)*A, transpose(A)*b)'",
    ),
    "eigenvalues of a moving matrix": (
        X + "let e[2] = eigenvalues({{x/1 m, 0},{0, 1}}); force -e[1]*1 N on x;",
        "E0315",
        "eigenvalues are those of a matrix of numbers and parameters",
        "'linearize' and 'modes' give the eigenvalues of a motion",
    ),
    "matrix times wrong size": (
        X + "parameter Real A[2,2] = {{1,2},{3,4}}; let b[3] = A*{1,2,3}; force -b[1]*1 N on x;",
        "E0305",
        "a matrix of 2 columns cannot be multiplied by 3 rows",
        "the right side has one row for each column of the left one, 2",
    ),
    "matlab apostrophe": (
        X + "parameter Real A[2,2] = {{1,2},{3,4}}; let B[2,2] = A'; force -B[1,1]*x*1 N/m on x;",
        "E0121",
        "a derivative is not written by primes",
        "write 'der(A)'; a transposed matrix is 'transpose(A)'",
    ),
    "matlab slice": (
        X + "parameter Real A[2,2] = {{1,2},{3,4}}; let b[2] = A(:,1); force -b[1]*x*1 N/m on x;",
        "E0110",
        "expected an expression or ')', found ':'",
        "elements stand in brackets, as in 'A[:, 1]'; parentheses are those of functions",
    ),
    "table of two variables as m41": (
        A
        + "parameter throttle = 0.5; force table({der(a), throttle}, {0, 100} rad/s, {0, 1}, {{0, 10}, {0, 5}} N.m) on a;",
        "E0309",
        "a table of two variables takes them one by one",
        "table(x, y, {x1, x2, ..}, {y1, y2, ..}, {{z11, z12, ..}, ..})",
    ),
    "lookup": (
        A + "force -lookup(a, {0, 1} rad, {0, 2} N.m) on a;",
        "E0209",
        "unknown function 'lookup'",
        "a table is written 'table(x, {0, 1, 2} m, {0, 5, 7} N)'",
    ),
    "interp1": (
        A + "force -interp1({0, 1} rad, {0, 2} N.m, a) on a;",
        "E0209",
        "unknown function 'interp1'",
        "a table is written 'table(x, {0, 1, 2} m, {0, 5, 7} N)'",
    ),
    "delay of a state-dependent time": (
        X + "force -4 N/m*delay(x, 0.1 s*abs(x)/1 m) on x;",
        "E0580",
        "a delay cannot change during a run",
        "write a number or a formula of parameters",
    ),
    "delay without unit": (
        X + "force -4 N/m*delay(x, 0.1) on x;",
        "E0304",
        "'delay' takes a time, this is a number",
        "write '0.1 s'",
    ),
    "delay in potential": (
        X + "potential 1/2*4 N/m*(x - delay(x, 0.1 s))^2;",
        "E0582",
        "an energy, a mass or a place of a body cannot depend on the past",
        "write the force itself, as in 'force -k*delay(x, T) on x;'",
    ),
    "delay in a constraint": (
        X + "coordinate Length y = 1 m; kinetic 1/2*1 kg*der(y)^2; constraint y = delay(x, 0.1 s);",
        "E0582",
        "a constraint, a contact or a prescribed motion cannot depend on the past",
        "let a force pull there, as in 'force k*(delay(y, T) - x) on x;'",
    ),
    "delay of acceleration": (
        X + "force -0.2 kg*delay(der(x, 2), 0.1 s) on x;",
        "E0581",
        "'der(der(x))' cannot be delayed",
        "let a 'state' follow it, as in 'equation der(y) = (e - y)/tau;', and delay that",
    ),
    "delay of a reaction": (
        X + "constraint c: x = 1 m; output r = delay(multiplier(c), 0.1 s);",
        "E0581",
        "'multiplier(c)' cannot be delayed",
        "let a 'state' follow it, as in 'equation der(y) = (e - y)/tau;', and delay that",
    ),
    "delay of what a nonlinear balance gives": (
        X
        + "coordinate Length z ~ 0 m; potential 1 N/m*(x - z)^2 + 1 N/m^3*z^4; force -1 N/m*delay(z, 0.1 s) on x;",
        "E0581",
        "'z' cannot be delayed",
        "give it a mass, or let a 'state' follow it and delay that",
    ),
    "transport delay habit": (
        X + "force -4 N/m*transport(x, 0.1 s) on x;",
        "E0209",
        "unknown function 'transport'",
        "what it was a while ago is 'delay(x, T)'; a state of first order lags: 'equation der(y) = (x - y)/T;'",
    ),
    "x(t-0.1)": (
        X + "force -4 N/m*x(time - 0.1 s) on x;",
        "E0209",
        "'x' is declared, but it is not a function",
        "write 'x*(...)' for a product; its value a while ago is 'delay(x, T)'",
    ),
    "noise without period": (
        X + "force 1 N*noise(1) on x;",
        "E0309",
        "'noise' takes 2 arguments, not 1",
        "random signal of size 1, the same in every run: noise(seed, period)",
    ),
    "noise with negative period": (
        X + "force 1 N*noise(1, -0.1 s) on x;",
        "E0584",
        "a noise with the period -0.1 s is none",
        "write the time from one random number to the next, as in 'noise(1, 0.1 s)'",
    ),
    "noise with a seed that is not a whole number": (
        X + "force 1 N*noise(1.5, 0.1 s) on x;",
        "E0308",
        "'noise' takes a whole number as seed, this is a number",
        "write a whole number, as in 'noise(1, 0.1 s)'; another one is another signal",
    ),
    "random": (
        X + "force 1 N*random() on x;",
        "E0209",
        "unknown function 'random'",
        "a random signal is 'noise(seed, period)'; 'mechc ensemble' draws values for many runs",
    ),
    "multiplier of an unnamed friction": (
        A + "force 1 N.m on a; friction 2 N.m on a; output m = multiplier(friction);",
        "E0212",
        "'multiplier' asks about a named constraint, contact or friction, 'friction' is none",
        "give one a name, as in 'constraint hold: a = b;', and ask 'multiplier(hold)'",
    ),
    "negative side": (
        A + "friction f: forward -1 N.m backward 1 N.m on a;",
        "E0706",
        "the limit of friction 'f' is negative",
        "write how large the force may be, without a sign: friction acts against the motion by itself",
    ),
    "forward alone": (
        A + "friction f: forward 1 N.m on a;",
        "E0110",
        "expected 'backward', found 'on'",
        "a friction of two sides has both limits: 'friction forward 2 N backward 1 N on x;'",
    ),
    "both infinite": (
        A + "friction f: forward infinite backward infinite on a;",
        "E0725",
        "a friction that never gives way is a constraint",
        "write 'constraint der(a) = 0;', which holds on both sides",
    ),
    "static below kinetic": (
        A + "friction f: 2 N.m static 1 N.m on a;",
        "E0706",
        "the limit while sticking is less than that while sliding",
        "'friction f static fs': fs is at least f",
    ),
    "friction on a time": (
        A + "friction f: 2 N.m on time;",
        "E0322",
        "a friction force on a time (s) is a power (W)",
        "a friction force acts on a coordinate, or on a length or an angle made of coordinates: name it after 'on'",
    ),
    "stationary of what falls": (
        A + "force 1 N.m on a; initial stationary;",
        "E0609",
        "the initial condition on 'initial stationary;' cannot hold",
        "nothing at the start changes it",
    ),
    "stationary of a parameter": (
        A + "parameter c ~ 1 N.m/rad; potential 1/2*c*a^2; initial stationary c;",
        "E0420",
        "'c' is neither a coordinate nor a state",
        "state more by 'initial der(..) = 0;'",
    ),
    "parameter to find without condition": (
        A + "parameter c ~ 1 N.m/rad; potential 1/2*c*a^2;",
        "E0610",
        "no initial condition determines the parameter 'c'",
        "add one more initial condition, such as 'initial der(q, 2) = 0;', or write 'c = ..'",
    ),
    "servo force that does not reach": (
        X
        + "coordinate Length y = 0 m; kinetic 1/2*1 kg*der(y)^2; constraint hold: x = 1 m + 0.1 m*sin(time/1 s) by force on y;",
        "E0728",
        "what keeps 'hold' does not reach it at once",
        "act on what the constraint moves; what follows by way of springs, or of states such as a current, follows later: constrain that, or let a controller follow",
    ),
    "servo by a parameter": (
        X + "parameter F = 1 N; force F on x; constraint hold: x = 1 m by F;",
        "E0726",
        "'F' is not an input that is free",
        "write 'by force on F'",
    ),
    "gravity by a function of a wrong result": (
        "import mech.spatial.*;\nfunction g(Length r[3]) = 2*r;\ngravity g;\nParticle p(m = 1 kg); Translation t(world -> p.a);",
        "E0323",
        "the field 'g' is neither an acceleration nor a potential",
        "give a vector in m/s^2, or a number in m^2/s^2, the potential energy of a mass over the mass",
    ),
    "release what is not a constraint": (
        A + "when a > 1 rad then release nothing; end when;",
        "E0201",
        "unknown name 'nothing'",
        "name the constraint, as in 'constraint hold: a = b;'",
    ),
    "release of a friction": (
        A + "friction f: 1 N.m on a; when a > 1 rad then release f; end when;",
        "E0212",
        "'release' takes a named constraint, a contact, a driven coordinate or a cut joint",
        "name the constraint, as in 'constraint hold: a = b;'",
    ),
    "arrow between nothing": (
        "model D input Angle from; input Angle to; damping 1 N.m.s on to - from; end D;\nmodel M\ncoordinate Angle a = 0 rad; kinetic 1/2*1 kg.m^2*der(a)^2;\n  D d(a);\nend M;",
        "E0127",
        "a modification gives a value to a name",
        "write 'name = a'",
    ),
    "typeof": (
        "model L input u; state typeof(v) y = 0; equation der(y) = (u - y)/1 s; end L;\nmodel M\ncoordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2;\n  L l(u = x);\nend M;",
        "E0201",
        "unknown name 'v'",
        "declare it: 'parameter v = ..;' for a given value, 'let v = ..;' for a formula",
    ),
    "generic block with two types": (
        "model L input u; input v; output y = u + v; end L;\nmodel M\ncoordinate Length x = 1 m; kinetic 1/2*1 kg*der(x)^2;\n  L l(u = x, v = der(x)); force -1 N/m*l.y on x;\nend M;",
        "E0302",
        "the two sides of '+' differ: left side is a length (m), right side is a velocity (m/s)",
        "on the right side one factor of [s] is missing",
    ),
    "rates of states in a circle": (
        "state Real p = 1; state Real q = 0; equation der(p) = der(q) + 1 Hz; equation der(q) = der(p);",
        "E0207",
        "'der(p)' is defined by itself",
        "solve the equations for the rates, or let 'output w ~ 0;' and 'equation ..;' find one of them",
    ),
    "L di/dt form": (
        "state Current i = 0 A; parameter Inductance L = 1 H; equation L*der(i) = 1 V - i*1 ohm;",
        "E0112",
        "unknown unit 'ohm'",
        "did you mean 'Ohm'?",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_messages_of_wrong_machines(name: str) -> None:
    text, code, message, help = WRONG[name]
    end = "" if text.rstrip().endswith(("end L;", "end M;")) else "\nexperiment(stop = 1 s);"
    with pytest.raises(mechc.CompileError) as refused:
        mechc.loads(text + end)
    said = str(refused.value)
    assert f"error[{code}]: {message}" in said
    assert help and help in said.partition("= help: ")[2]


def test_a_circle_of_names_is_told_whole() -> None:
    with pytest.raises(mechc.CompileError, match="a -> b -> d -> a"):
        mechc.loads(X + "let e = a; let a = b + 1; let b = 2*d; let d = a; force a*1 N on x;").compiled()
