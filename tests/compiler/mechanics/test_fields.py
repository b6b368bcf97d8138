"""Derivatives of fields by place, against SymPy's vector calculus on random fields, and in the equations of motion."""

from __future__ import annotations

import re
from random import Random

import numpy as np
import pytest
import sympy
from oracle import Meaning
from sympy.vector import CoordSys3D, Laplacian, curl, divergence, gradient

import mechc

N = CoordSys3D("N")
X, Y, Z = N.base_scalars()
AT = {X: 0.7, Y: -0.4, Z: 1.3}
NAMES = ("x", "y", "z")


def formula(random: Random) -> str:
    """Return a random smooth field of x, y, z, in a text that both SymPy and the language read."""
    return " + ".join(
        f"{random.randint(1, 9)}/{random.randint(2, 7)}*"
        + random.choice(
            (
                "x^2*y", "x*y*z", "sin(x*y)", "exp(y*z/3)", "z^3", "cos(x + 2*z)", "log(4 + x*y)", "sqrt(3 + z*x)",
                "1/(2 + x^2 + y^2)", "atan(y*z)", "tanh(x - z)",
            )
        )
        for _ in range(3)
    )  # fmt: skip


def here(text: str) -> str:
    """Write a field of x, y, z in components of a vector r."""
    for k, name in enumerate(NAMES):
        text = "".join(f"r[{k + 1}]" if part == name else part for part in _words(text))
    return text


def _words(text: str) -> list[str]:
    return list(filter(None, re.split(r"(\w+)", text)))


def there(text: str) -> sympy.Expr:
    return sympy.sympify(text.replace("^", "**"), locals={"x": X, "y": Y, "z": Z})


def numbers(vector: object) -> list[float]:
    return [float(vector.dot(e).subs(AT)) for e in (N.i, N.j, N.k)]  # type: ignore[attr-defined]


@pytest.fixture(scope="module", params=range(8))
def fields(request: pytest.FixtureRequest) -> tuple[list[str], dict[str, list[float]]]:
    """Return random formulas V, F1, F2, F3 and the outputs of a model that differentiates them."""
    random = Random(request.param)
    v, *f = [formula(random) for _ in range(4)]
    text = f"""
        dimensionless;
        function V(r[3]) = {here(v)};
        function F(r[3]) = {{{", ".join(map(here, f))}}};
        function G(r[3]) = grad(V, r);
        function C(r[3]) = curl(F, r);
        function D(r[3]) = div(F, r);
        function VF(r[3]) = V(r)*F(r);
        parameter r[3] = {{0.7, -0.4, 1.3}};
        output gradient = grad(V, r);
        output divergence = div(F, r);
        output curled = curl(F, r);
        output laplace = laplacian(V, r);
        output laplace_of_vector = laplacian(F, r);
        output jacobian = grad(F, r);
        output of_gradient = curl(G, r);
        output of_curl = div(C, r);
        output twice = grad(D, r) - curl(C, r);
        output product = curl(VF, r) - V(r)*curl(F, r) - cross(grad(V, r), F(r));
        output along = grad(V, r)*F(r);
        experiment(stop = 0);
    """
    text = text.replace("grad(V, r)*F(r)", "dot(grad(V, r), F(r))")
    solution = mechc.loads(text).simulate(estimate_error=False)
    outputs: dict[str, list[float]] = {}
    for name in solution.quantities:
        outputs.setdefault(name.partition("[")[0], []).append(float(solution[name][-1]))
    return [v, *f], outputs


def test_operators_are_those_of_vector_calculus(fields: tuple[list[str], dict[str, list[float]]]) -> None:
    (v, *f), found = fields
    scalar, parts = there(v), [there(x) for x in f]
    vector = parts[0] * N.i + parts[1] * N.j + parts[2] * N.k
    assert found["gradient"] == pytest.approx(numbers(gradient(scalar)), rel=1e-13, abs=1e-13)
    assert found["divergence"] == pytest.approx([float(divergence(vector).subs(AT))], rel=1e-13, abs=1e-13)
    assert found["curled"] == pytest.approx(numbers(curl(vector)), rel=1e-13, abs=1e-13)
    laplace = [float(Laplacian(x).doit().subs(AT)) for x in (scalar, *parts)]
    assert found["laplace"] == pytest.approx(laplace[:1], rel=1e-12, abs=1e-12)
    assert found["laplace_of_vector"] == pytest.approx(laplace[1:], rel=1e-12, abs=1e-12)
    rows = [float(sympy.diff(x, s).subs(AT)) for x in parts for s in (X, Y, Z)]
    assert found["jacobian"] == pytest.approx(rows, rel=1e-13, abs=1e-13)


def test_identities_hold(fields: tuple[list[str], dict[str, list[float]]]) -> None:
    """curl grad V = 0, div curl F = 0, grad div F - curl curl F = laplacian F, curl(V F) by the product rule."""
    _, found = fields
    assert found["of_gradient"] == pytest.approx([0] * 3, abs=1e-12)
    assert found["of_curl"] == pytest.approx([0], abs=1e-12)
    assert found["twice"] == pytest.approx(found["laplace_of_vector"], rel=1e-11, abs=1e-11)
    assert found["product"] == pytest.approx([0] * 3, abs=1e-12)


PARTICLE = """
function V(Length r[3], Stiffness k) = k*(r[1]^2 + 2*r[2]^2*r[3]/(1 m) + 3*r[3]^2)/2;
function A(Length r[3], MagneticField B) = 1/2*B*{-r[2], r[1]*(1 + r[3]/(2 m)), 0};
parameter k = 3 N/m;
parameter B = 0.7 T;
parameter q = 2 C;
parameter m = 1.5 kg;
coordinate Length x[3] = {0.3, -0.2, 0.5} m;
initial der(x) = {1, 2, -1} m/s;
kinetic 1/2*m*dot(der(x), der(x));
"""
BY_ENERGIES = PARTICLE + "lagrangian q*dot(der(x), A(x, B)) - V(x, k);"
BY_FORCES = PARTICLE + "force -grad(V, x, k) + q*cross(der(x), curl(A, x, B)) on world * x;"


def test_forces_of_fields_are_those_of_their_potentials() -> None:
    """q v x curl A - grad V against the Lagrangian of A and V, in the oracle too, which takes differences."""
    energies, forces = (mechc.loads(text) for text in (BY_ENERGIES, BY_FORCES))
    runs = [m.simulate(stop=1.0, tolerance=1e-11, estimate_error=False) for m in (energies, forces)]
    for name in ("x[1]", "x[2]", "x[3]"):
        assert runs[1][name] == pytest.approx(runs[0][name], abs=1e-8)
    meaning = Meaning(forces.compilation.flat)
    state = meaning.start()
    other = Meaning(energies.compilation.flat).accelerations(state)
    assert meaning.accelerations(state) == pytest.approx(other, rel=1e-9)


def test_in_the_plane_and_of_one_number() -> None:
    solution = mechc.loads(
        """
        function F(Length r[2]) = {-r[2]*r[1], r[1]^2};
        function V(Length x, Stiffness k) -> Energy = 1/2*k*x^2 + 1 N/m^2*x^3/1 m;
        coordinate Length x = 2 m;
        kinetic 1/2*1 kg*der(x)^2;
        force -grad(V, x, 3 N/m) on x;
        output c = curl(F, {x, 3 m});
        output d = div(F, {x, 3 m});
        output k = laplacian(V, x, 3 N/m) "stiffness";
        output a = der(x, 2);
        output rate = der(grad(V, x, 3 N/m));
        initial der(x) = 0.5 m/s;
        """.replace("1 N/m^2*x^3/1 m", "(1 N/m^2)*x^3")
    ).simulate(stop=0.1, estimate_error=False)
    found = {name: float(solution[name][0]) for name in ("c", "d", "k", "a", "rate")}
    assert found == pytest.approx({"c": 6, "d": -3, "k": 15, "a": -18, "rate": 7.5}, rel=1e-14)
    units = {entry.name: entry.unit for entry in solution.problem.outputs}
    assert (units["c"], units["k"], units["rate"]) == ("m", "N/m", "kg.m/s^3")


def test_what_a_field_compares_is_looked_for_along_the_motion() -> None:
    """The force of V = k (r - R)^2/2 outside of R only: a run stops where it begins."""
    model = mechc.loads(
        """
        function V(Length r[2], Length R) = if norm(r) > R then 50 N/m*(norm(r) - R)^2 else 0 J;
        coordinate Length x[2] = {0, 0.5} m;
        initial der(x) = {1, 0.3} m/s;
        kinetic 1/2*1 kg*dot(der(x), der(x));
        force -grad(V, x, 1 m) on world * x;
        output V = V(x, 1 m) + kinetic_energy();
        """.replace("output V", "output E")
    )
    assert len(model.compilation.equations.switching.switches) == 1  # type: ignore[union-attr]
    solution = model.simulate(stop=3.0, tolerance=1e-11, estimate_error=False)
    assert np.ptp(solution["E"]) < 1e-9


def test_an_integral_over_a_field_keeps_its_estimate() -> None:
    """The potential of a rod of charge, by an integral, and its field."""
    solution = mechc.loads(
        """
        dimensionless;
        function V(r[2]) = integral(1/sqrt((r[1] - s)^2 + r[2]^2) for s in -1:1);
        output E = -grad(V, {0, 0.5});
        experiment(stop = 0);
        """
    ).simulate(estimate_error=False)
    expected = 2 / (0.5 * np.sqrt(1.25))
    assert [float(solution[f"E[{k}]"][0]) for k in (1, 2)] == pytest.approx([0, expected], abs=1e-12)


REFUSED = {
    "output y = grad(x, x);": "'grad' takes a function of the model, 'x' is none",
    "output y = grad(sin, x);": "'grad' takes a function of the model, 'sin' is none",
    "output y = grad(V);": "'grad' takes a function, a place, and what else the function takes",
    "output y = grad(V, x);": "'V' takes 2 arguments, not 1",
    "output y = grad(V, world, 1 N/m);": "a frame",
    "output y = grad(V, {1, 2, 3} s, 1 N/m);": "a vector of 3 lengths",
    "output y = div(V, {1, 2, 3} m, 1 N/m);": "'div' takes a vector at a place of as many components",
    "output y = curl(V, {1, 2, 3} m, 1 N/m);": "'curl' takes a vector of 2 or 3 components at a place of as many",
    "output y = grad(rate, {x, 0 m, 0 m});": "a field has no rate of its place",
    "output Length y = grad(V, {x, 0 m, 0 m}, 1 N/m)[1];": "E0303",
}


@pytest.mark.parametrize("statement", REFUSED)
def test_what_is_no_field_is_refused(statement: str) -> None:
    text = """
        function V(Length r[3], Stiffness k) = k*dot(r, r);
        function rate(Length r[3]) = der(r[1]);
        coordinate Length x = 1 m;
        kinetic 1/2*1 kg*der(x)^2;
    """
    with pytest.raises(mechc.CompileError) as refused:
        mechc.loads(text + statement)
    assert REFUSED[statement] in str(refused.value)
