"""Types, shapes and units: what is inferred, and what is refused."""

from __future__ import annotations

from fractions import Fraction
from typing import Any, cast

import pytest
from flat_models import codes, definition, flat, said, value, variable

from mechc.compiler.flat.expressions.elaborate import elaborate
from mechc.compiler.flat.model import Literal
from mechc.compiler.flat.names.scope import Flattening, Scope
from mechc.compiler.flat.show import type_text
from mechc.compiler.flat.statements.contacts_of_shapes import make
from mechc.lang import ast
from mechc.lang.diagnostics import Reporter
from mechc.lang.source import SourceFile, Span


def let(expression: str, declarations: str = "") -> str:
    """Return the type and value of an expression beside a few declarations."""
    model = flat(f"{DECLARED}{declarations} let result = {expression};")
    result = definition(model, "result")
    return f"{type_text(result.type)} = {value(result.value)}"


DECLARED = """
parameter l = 2 m;
parameter m = 3 kg;
parameter t = 4 s;
parameter n = 5;
parameter a = 30 deg;
parameter v = {1, 2, 3} m;
parameter A = {{1, 2}, {3, 4}, {5, 6}} N;
structural parameter Integer k = 3;
coordinate x = 0 m;
coordinate q = 0 rad;
kinetic 1/2*m*der(x)^2 + 1/2*1 kg.m^2*der(q)^2;
"""


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("l*m/t^2", "N = l*m/t^2"),
        ("l^(1/2)", "m^(1/2) = l^0.5"),
        ("sqrt(l)", "m^(1/2) = sqrt(l)"),
        ("sqrt(l*l)", "m = sqrt(l*l)"),
        ("l^k", "m^3 = l^3"),
        ("l^(-1)", "1/m = l^(-1)"),
        ("l^0", "1 = l^0"),
        ("2^k", "Integer = 8"),
        ("l + 0", "m = l + 0"),
        ("0 - l", "m = 0 - l"),
        ("der(x)", "m/s = der(x)"),
        ("der(x, 2)", "m/s^2 = der(x, 2)"),
        ("der(der(x))", "m/s^2 = der(x, 2)"),
        ("der(q)", "rad/s = der(q)"),
        ("der(q)*t", "rad = der(q)*t"),
        ("l*der(q)", "m/s = l*der(q)"),
        ("a + 1", "rad = a + 1"),
        ("cos(a)", "1 = cos(a)"),
        ("atan2(l, x)", "rad = atan2(l, x)"),
        ("2*v", "m [3] = 2*v"),
        ("v/t", "m/s [3] = v/t"),
        ("v + v", "m [3] = v + v"),
        ("-v", "m [3] = -v"),
        ("v[2]", "m = v[2]"),
        ("v[2:3]", "m [2] = {v[2], v[3]}"),
        ("A*{1, 2}", "N [3] = A*{1, 2}"),
        ("transpose(A)", "N [2, 3] = transpose(A)"),
        ("transpose({{1, 2}, {3, 4}})", "Integer [2, 2] = transpose({{1, 2}, {3, 4}})"),
        ("transpose(A)*A", "kg^2.m^2/s^4 [2, 2] = transpose(A)*A"),
        ("A[2]", "N [2] = A[2]"),
        ("A[2, 1]", "N = A[2,1]"),
        ("A[1:k, 1]", "N [3] = {A[1,1], A[2,1], A[3,1]}"),
        ("dot(v, v)", "m^2 = dot(v, v)"),
        ("cross(v, v)", "m^2 [3] = cross(v, v)"),
        ("norm(v)", "m = norm(v)"),
        ("outer(v, {1, 2})", "m [3, 2] = outer(v, {1, 2})"),
        ("diag(v)", "m [3, 3] = diag(v)"),
        ("identity(k)", "1 [3, 3] = identity(3)"),
        ("sum(v)", "m = v[1] + v[2] + v[3]"),
        ("sum(i*v[i] for i in 1:k)", "m = 1*v[1] + 2*v[2] + 3*v[3]"),
        ("sum(v for i in 1:2)", "m [3] = v + v"),
        ("product(v[i] for i in 1:2)", "m^2 = v[1]*v[2]"),
        ("max(v)", "m = max(v[1], v[2], v[3])"),
        ("min(l, x, 0)", "m = min(l, x, 0)"),
        ("max(v[i] for i in 1:2)", "m = max(v[1], v[2])"),
        ("max(v[i] for i in 2:2)", "m = v[2]"),
        ("clamp(x, -l, l)", "m = clamp(x, -l, l)"),
        ("abs(-3 m)", "m = 3"),
        ("mod(7, 3)", "Integer = 1"),
        ("div(7, 2)", "Integer = 3"),
        ("floor(x/l)", "Integer = floor(x/l)"),
        ("if x > l then x else 0", "m = if x > l then x else 0"),
        ("if x > l then x elseif x > 0 then 0 else 0", "m = if x > l then x else if x > 0 then 0 else 0"),
        ("if k > 2 then l else t", "m = l"),
        ("{i^2 for i in 1:k}", "Integer [3] = {1, 4, 9}"),
        ("{i*l for i in 1:2}", "m [2] = {1*l, 2*l}"),
        ("{{i + j for j in 1:2} for i in 1:2}", "Integer [2, 2] = {{2, 3}, {3, 4}}"),
        ("{1, 2} cm", "m [2] = {0.01, 0.02}"),
        ("(1/2) m", "m = 0.5"),
        ("{0, l}", "m [2] = {0, l}"),
        ("linspace(1 m, 2 m, 3)", "m [3] = {1, 1.5, 2}"),
        ("table(x, {0, 1, 2} m, {0, 1, 4} N)", "N = table(x, {0, 1, 2}, {0, 1, 4})"),
        ("integral(s*l for s in 0 m:x)", "m^3 = integral(s#{}*l for s#{} in 0:x)"),
        ("momentum(x)", "kg.m/s = momentum(x)"),
        ("momentum(q)", "kg.m^2/s = momentum(q)"),
        ("energy()", "J = energy()"),
        ("energy.kinetic", "J = kinetic_energy()"),
        ("time", "s = time"),
        ("pi", "1 = 3.141592653589793"),
        ("x > l and not (q < 0)", "Boolean = x > l and not q < 0"),
    ],
)
def test_types_of_expressions(expression: str, expected: str) -> None:
    found = let(expression)
    if "#" in expected:
        number = found.split("#")[1].split("*")[0]
        expected = expected.format(number, number)
    assert found == expected


@pytest.mark.parametrize(
    ("expression", "code"),
    [
        ("l + t", "E0302"),
        ("l + 1", "E0302"),
        ("1 - l", "E0302"),
        ("l > t", "E0302"),
        ("l == 1", "E0302"),
        ("if x > l then l else t", "E0302"),
        ("if x > l then v else l", "E0305"),
        ("if l then 1 else 2", "E0318"),
        ("not l", "E0318"),
        ("x > l and 1", "E0318"),
        ("v + {1, 2} m", "E0305"),
        ("v + l", "E0305"),
        ("v*v", "E0308"),
        ("v^2", "E0308"),
        ("A*v", "E0305"),
        ("1/v", "E0308"),
        ("v > v", "E0305"),
        ("l^n", "E0313"),
        ("2^l", "E0313"),
        ("sin(l)", "E0304"),
        ("sin(v)", "E0321"),
        ("sqrt(v)", "E0321"),
        ("exp(t)", "E0304"),
        ("atan2(l, t)", "E0302"),
        ("max(l, t)", "E0302"),
        ("max({l, l} for i in 1:1)", "E0321"),
        ("clamp(l, 0, 1)", "E0302"),
        ("dot(v, {1, 2})", "E0305"),
        ("cross({1, 2, 3, 4}, {1, 2, 3, 4})", "E0305"),
        ("norm(l)", "E0305"),
        ("transpose(v)", "E0305"),
        ("sum(l)", "E0305"),
        ("{l, t}", "E0317"),
        ("{l, 1}", "E0317"),
        ("{{1, 2}, {3}}", "E0305"),
        ("{1 m, 2 m} m", "E0334"),
        ("(l) m", "E0334"),
        ("v[4]", "E0314"),
        ("v[0]", "E0314"),
        ("v[n]", "E0315"),
        ("v[floor((-8)^(1/3))]", "E0315"),
        ("v[1.5]", "E0326"),
        ("v[1, 2]", "E0316"),
        ("l[1]", "E0316"),
        ("A[1, 2:3]", "E0314"),
        ("unknown", "E0201"),
        ("L", "E0201"),
        ("unknown(1)", "E0209"),
        ("l(1)", "E0209"),
        ("sin", "E0213"),
        ("sin()", "E0309"),
        ("sin(1, 2)", "E0309"),
        ("sin(x = 1)", "E0309"),
        ("momentum(l)", "E0212"),
        ("momentum(2*x)", "E0212"),
        ("reaction(l)", "E0212"),
        ("multiplier(x)", "E0212"),
        ("pre(x)", "E0330"),
        ("world + l", "E0308"),
        ("l*world", "E0308"),
        ("der(world)", "E0329"),
        ("integral(v)", "E0305"),
        ("integral(s for s in v)", "E0309"),
        ("sum(i for i in l)", "E0305"),
        ("identity(n)", "E0315"),
        ("table(x, {0, 1} m, {0, 1, 2} N)", "E0305"),
        ("table(t, {0, 1} m, {0, 1} N)", "E0302"),
        ('"text" + 1', "E0308"),
        ("-true", "E0308"),
        ("if x > l then world else world", "E0308"),
    ],
)
def test_refused_expressions(expression: str, code: str) -> None:
    assert codes(f"{DECLARED} let result = {expression};") == [code]


@pytest.mark.parametrize(
    ("declaration", "expected"),
    [
        ("parameter c = 1", "1"),
        ("parameter c = 1 N.m", "J"),
        ("parameter c = 30 deg", "rad"),
        ("parameter c = 2*l", "m"),
        ("parameter c = {1, 2} m", "m [2]"),
        ("parameter Length c[3] = 0", "m [3]"),
        ("parameter Real c[k, 2] = 1", "1 [3, 2]"),
        ("parameter Length c[i in 1:k] = i*l", "m [3]"),
        ("parameter Integer c = 3", "Integer"),
        ("parameter Boolean c = true", "Boolean"),
        ("coordinate c = 1 m", "m"),
        ("coordinate c ~ l", "m"),
        ("coordinate Angle c", "rad"),
        ("coordinate Rotation c", "Rotation"),
        ("coordinate Rotation c = rotz(a)", "Rotation"),
        ("state c = 1 N; equation der(c) = -c/t", "N"),
        ("discrete Integer c = 0", "Integer"),
        ("discrete c = 0", "1"),
        ("input Force c", "N"),
        ("input Force c[2] = 0", "N [2]"),
    ],
)
def test_types_of_variables(declaration: str, expected: str) -> None:
    assert type_text(variable(flat(f"{DECLARED} {declaration};"), "c").type) == expected


@pytest.mark.parametrize(
    ("declaration", "code"),
    [
        ("parameter Length c = 1 s", "E0303"),
        ("parameter Length c = 1", "E0303"),
        ("parameter Length c = {1, 2} m", "E0305"),
        ("parameter Length c[2] = {1, 2, 3} m", "E0305"),
        ("parameter Integer c = 1.5", "E0303"),
        ("parameter Boolean c = 1", "E0303"),
        ("parameter Lenght c = 1 m", "E0203"),
        ("parameter c", "E0327"),
        ("parameter c = c", "E0207"),
        ("parameter c = world", "E0303"),
        ("parameter Length c[n] = 1 m", "E0315"),
        ("parameter Length c[-1] = 1 m", "E0422"),
        ("parameter c = x", "E0810"),
        ("parameter c = 2*time", "E0810"),
        ("coordinate c", "E0327"),
        ("coordinate Boolean c", "E0303"),
        ("coordinate Rotation c[2]", "E0305"),
        ("coordinate Length c = rotz(a)", "E0303"),
        ("structural parameter c = n", "E0315"),
        ("structural parameter Integer c = 2.5", "E0303"),
        ("structural parameter Integer c(min = 2) = 1", "E0423"),
        ("structural parameter Length c(max = 2 m) = 3 m", "E0423"),
        ("structural parameter Length c(min = 2 s) = 3 m", "E0333"),
        ("structural parameter Integer c(minn = 2) = 3", "E0415"),
        ("output c", "E0411"),
        ("output Length c = t", "E0303"),
        ("output Length c[2] = v", "E0305"),
        ("let c = d; let d = c", "E0207"),
        ("let Real c = d; let Real d = c", "E0207"),
        ("parameter Real c = d; parameter Real d = c", "E0207"),
    ],
)
def test_refused_declarations(declaration: str, code: str) -> None:
    assert codes(f"{DECLARED} {declaration};") == [code]


def test_the_example_of_the_language_page() -> None:
    (error,) = said(
        "model Pendulum\n  parameter m = 1 kg;\n  parameter l = 1 m;\n  parameter g = 9.81 m/s^2;\n"
        "  coordinate theta = 1 rad;\n  kinetic    1/2*m*l^2*der(theta)^2;\n  potential  -m*g*cos(theta);\nend Pendulum;\n"
    )
    assert (error.code, error.message) == ("E0301", "potential must be an energy")
    assert error.caption == "this is kg.m/s^2 (N), an energy is kg.m^2/s^2 (J)"
    assert error.help == "one factor of [m] is missing; a length in scope: 'l' (line 3)"
    assert error.span is not None and error.span.text == "-m*g*cos(theta)"


def test_both_places_of_a_mismatch_are_shown() -> None:
    (error,) = said("parameter l = 1 m; parameter t = 1 s; let s = l + t;")
    assert error.message == "the two sides of '+' differ: left side is a length (m), right side is a time (s)"
    assert error.span is not None and error.span.text == "t"
    assert [label.span.text for label in error.labels] == ["l"]


def test_one_cause_is_one_error() -> None:
    text = "parameter a = 1 m + 1 s; parameter b = 2*a; coordinate x = b; kinetic 1/2*1 kg*der(x)^2; let c = sin(x);"
    assert codes(text) == ["E0302"]


# ---------------------------------------------------------------- models without units


def test_dimensionless_models_have_pure_numbers_only() -> None:
    model = flat(
        "dimensionless; parameter Length l = 2; coordinate x = 30 deg; kinetic 1/2*der(x)^2 + l; potential l*x;"
        " damping 1 on x; force cos(time) on x; equation der(s) = x; state s = 0; experiment(stop = 10);"
    )
    assert model.dimensionless
    assert {type_text(v.type) for v in model.variables} == {"1", "rad"}
    assert codes("dimensionless; parameter l = 2 m;") == ["E0319"]
    base = "model A  dimensionless; coordinate x = 0; kinetic der(x)^2; end A;"
    assert codes(base + "model B  extends A; potential 1 J; end B;") == ["E0319"]
    assert codes(base + "model B  A a; end B;") == ["E0320"]


def test_the_independent_variable_can_have_another_name_and_dimension() -> None:
    model = flat(
        "independent Length s; coordinate y = 1 m; lagrangian sqrt(1 + der(y)^2); output slope = s/y;"
    )
    assert model.independent == "s"
    assert value(definition(model, "slope").value) == "time/y"
    assert type_text(definition(model, "slope").type) == "1"
    assert codes("independent s; coordinate y = 1 m; kinetic 1 kg*der(y)^2; output a = time;") == ["E0201"]


# ---------------------------------------------------------------- functions and types of the model


def test_functions_are_written_out() -> None:
    model = flat(
        "function half(x) = x/2; function force(Length d, k) -> Force = k*half(d);"
        " coordinate x = 1 m; kinetic 1/2*1 kg*der(x)^2; let F = force(x, 3 N/m);"
    )
    assert value(definition(model, "F").value) == "3*(x/2)"


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("function f(Length d) = d; let a = f(1 s);", "E0303"),
        ("function f(Length d) -> Time = d; let a = f(1 m);", "E0303"),
        ("function f(Length d) = d; let a = f(1 m, 2 m);", "E0309"),
        ("function f(Length d) = d; let a = f({1, 2} m);", "E0305"),
        ("function f(d) = d + e; let a = f(1 m);", "E0201"),
        ("function f(d) = g(d); function g(d) = f(d); let a = f(1);", "E0210"),
        ("function f(Real d[2]) = d[1]; let a = f({1, 2, 3});", "E0305"),
        ('type Area = unit "kg"; let a = 1;', "E0211"),
        ("parameter f = 1; let a = f(2);", "E0209"),
    ],
)
def test_wrong_functions(text: str, code: str) -> None:
    assert codes(text) == [code]


def test_types_of_the_model() -> None:
    model = flat('type Rigidity = unit "N.m^2"; parameter Rigidity EI = 3 N.m^2;')
    assert type_text(variable(model, "EI").type) == "kg.m^3/s^2"


def test_parameters_without_unit_are_pointed_at_where_dimensions_differ() -> None:
    text = "parameter g = 9.81; parameter m = 1 kg; coordinate Length x = 0; kinetic 1/2*m*der(x)^2;"
    for wrong in ("potential m*g*x;", "output a = der(x)^2 + g*x;"):
        (found,) = said(text + wrong)
        assert [label.text for label in found.labels][-1] == "'g' is a number without unit"


@pytest.mark.parametrize("factor", ["{1, 2}*2", "2*{1, 2}", "{1, 2} + {1, 2}"])
def test_arrays_of_structure_are_scaled_from_either_side(factor: str) -> None:
    model = flat(f"structural parameter Integer n[2] = {factor}; coordinate Length x[n[2]]; kinetic 0;")
    assert variable(model, "x").type.shape == (4,)


def test_whole_numbers_are_told_from_numbers_in_arrays() -> None:
    (message,) = said("structural parameter Integer n[2] = {2, 4}/2;")
    assert "'n' is a vector of 2 whole numbers, the value is a vector of 2 numbers" in message.message


def test_a_torque_is_told_in_newton_metres() -> None:
    (found,) = said("frame F = world * rot(1 rad); torque 2 N on F;")
    assert found.message == "a torque on a body is one value in N.m"


@pytest.mark.parametrize(
    ("text", "what", "unit"),
    [
        ("parameter Torque M = 3;", "a torque (N.m)", "3 N.m"),
        ("parameter Energy M = 3;", "an energy (J)", "3 J"),
        ("parameter RotationalDamping M[2] = {3, 4};", "a vector of 2 rotational dampings (N.m.s/rad)", "{3, 4} N.m.s/rad"),
        ("function f(Torque M) = 2*M; let y = f(3);", "a torque (N.m)", "3 N.m"),
        ("model P parameter M = 1 N.m; end P; model Q P p(M = 3); end Q;", "a torque (N.m)", "3 N.m"),
        ("model P parameter M = 1 kg^3; end P; model Q P p(M = 3); end Q;", "a quantity in kg^3", "3 kg^3"),
        ("model P parameter M = 1 cm; end P; model Q P p(M = 3); end Q;", "a length (m)", "3 m"),
        ("model P input Torque M; end P; model Q P p(M = 3); end Q;", "a torque (N.m)", "3 N.m"),
    ],
)  # fmt: skip
def test_a_bare_number_gets_the_unit_of_the_declared_type(text: str, what: str, unit: str) -> None:
    """A torque and an energy have one dimension: what was declared tells which it is."""
    found = next(d for d in said(text, model="Q" if "model" in text else None) if d.code == "E0303")
    assert found.message.startswith(f"'M' is {what}, the value is")
    assert found.help == f"write '{unit}'"


def test_numbers_of_nodes_that_are_gone_are_not_those_of_others() -> None:
    """Formulas that are made while compiling are let go, and the next ones lie in the same memory."""
    library, classes = cast("Any", None), cast("Any", None)
    scope = Scope(Flattening(Reporter(), library, classes, elaborate, make, {}), None, library)
    span = Span(SourceFile("m.mech", "0"), 0, 1)
    for k in range(100):
        node = ast.Number(value=Fraction(k), text=str(k), span=span)
        found = elaborate(node, scope)
        assert isinstance(found, Literal) and found.value == k
        del node
