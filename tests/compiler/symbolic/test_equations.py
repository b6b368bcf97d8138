"""The equations shown are those of the textbook."""

from __future__ import annotations

import random
import re
from pathlib import Path
from xml.dom.minidom import parseString

import pytest
import sympy as sp
from compiled import compiled
from slow_params import slow_among

import mechc
from mechc.compiler.symbolic import equations
from mechc.compiler.symbolic.equations import account_of
from mechc.compiler.symbolic.layouts import latex_lines, sections_html, write_equations
from mechc.compiler.symbolic.names import latex_name

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"

PENDULUM = """
parameter m = 1 kg;
parameter l = 1 m;
parameter g = 9.81 m/s^2;
coordinate theta = 1 rad;
kinetic   1/2*m*l^2*der(theta)^2;
potential -m*g*l*cos(theta);
"""

CONE = """
parameter m = 1 kg;
parameter alpha = 0.5 rad;
parameter g = 9.81 m/s^2;
coordinate rho = 1 m;
coordinate phi = 0 rad;
kinetic 1/2*m*(der(rho)^2/sin(alpha)^2 + rho^2*der(phi)^2);
potential m*g*rho*cos(alpha)/sin(alpha);
"""

STRING = """
parameter m = 1 kg;
parameter l = 1 m;
gravity {0, -9.81 m/s^2};
coordinate x = 0 m;
coordinate y = -1 m;
mass m at world * {x, y};
constraint rod: sqrt(x^2 + y^2) = l;
"""


def s(*names: str) -> tuple[sp.Symbol, ...]:
    return tuple(sp.Symbol(n) for n in names)


def test_pendulum() -> None:
    (equation,) = account_of(compiled(PENDULUM).system, latex=False).equations
    m, l, g, theta, acceleration = s("m", "l", "g", "theta", "theta''")
    assert sp.expand(equation.right - (m * l**2 * acceleration + m * g * l * sp.sin(theta))) == 0


def test_cone_has_one_cyclic_coordinate() -> None:
    account = account_of(compiled(CONE).system, latex=False)
    m, rho, rate = s("m", "rho", "phi'")
    assert account.cyclic == ("phi",)
    assert sp.simplify(account.momenta[1].right - m * rho**2 * rate) == 0


@pytest.mark.parametrize(
    "step", ["if y > 0 then 1 else 2", "sign(y)", "floor(y)", "floor(x)*0 + sign(2*y - 1)"]
)
def test_a_step_of_the_potential_leaves_no_cyclic_coordinate(step: str) -> None:
    """Its slope is zero on both sides, and yet the momentum across it changes."""
    text = f"dimensionless; coordinate x = 0; coordinate y = 1; kinetic 1/2*(der(x)^2 + der(y)^2); potential {step};"
    assert account_of(compiled(text).system, latex=False).cyclic == ("x",)


def test_momenta_of_a_rotation_are_those_about_the_axes_of_the_body() -> None:
    text = "coordinate Rotation R; frame body = world * R; inertia diag({1, 2, 3} kg.m^2) on body;"
    written = write_equations(compiled(text).system, "text")
    assert "p[R[2]] = 2*omega_R[2]" in written


def test_multiplier_stands_in_the_equations() -> None:
    account = account_of(compiled(STRING).system, latex=False)
    m, x, y, ax, tension = s("m", "x", "y", "x''", "lambda[rod]")
    assert sp.simplify(account.equations[0].right - (m * ax - tension * x / sp.sqrt(x**2 + y**2))) == 0
    assert [c.left for c in account.constraints] == ["rod"]


SWITCHING = """
coordinate x = 1 m;
state Force f = 2 N;
equation der(f) = -f/1 s;
kinetic 1/2*1 kg*der(x)^2;
coordinate Angle turn;
kinetic 1/2*1 kg.m^2*der(turn)^2;
drive turn = 3 rad/s*time;
force f on x;
contact the_wall: x restitution 1;
friction grip: 1 N on x;
friction creep: 1 N on x, law = "regularized", v_stick = 1 mm/s;
when x > 2 m then terminate("far"); end when;
experiment(stop = 1 s);
"""


def test_nothing_that_moves_the_model_is_left_out() -> None:
    """States, drives, contacts and friction have sections of their own: a gap is not an expression that vanishes."""
    account = account_of(compiled(SWITCHING).system, latex=False)
    found = {
        section.title: [statement.left for statement in section.statements] for section in account.sections()
    }
    assert found["Equations of further states"] == ["f'"]
    assert found["Prescribed motion"] == ["turn", "turn'"]
    assert found["Contacts"] == ["the_wall"] and found["Dry friction"] == ["grip"]
    assert found["Regularized friction"] == ["creep"] and "Constraints" not in found
    text = write_equations(compiled(SWITCHING).system, "text")
    assert text.splitlines()[-1] == "this holds between events: one branch of 'when' not written here"
    assert r"\[ \text{the\_wall} = x \]" in write_equations(compiled(SWITCHING).system, "latex")


def test_gravity_is_shown_as_a_decimal() -> None:
    assert "9.81*m" in write_equations(compiled(STRING).system, "text")


@pytest.mark.parametrize("text", [PENDULUM, CONE, STRING])
def test_html_holds_well_formed_formulas(text: str) -> None:
    formulas = re.findall(r"<math.*?</math>", write_equations(compiled(text).system, "html"), re.DOTALL)
    assert len(formulas) >= 3
    for formula in formulas:
        parseString(formula.replace("&InvisibleTimes;", "&#x2062;"))


@pytest.mark.parametrize(
    ("name", "latex"),
    [
        ("theta", r"\theta"),
        ("m1", "m_{1}"),
        ("x[2,1]", "x_{2,1}"),
        ("joint[3].angle", r"\mathrm{angle}_{\mathrm{joint\,3}}"),
        ("l_rest", r"l_{\mathrm{rest}}"),
    ],
)
def test_latex_names(name: str, latex: str) -> None:
    assert latex_name(name) == latex


def test_what_keeps_floats_from_dividing_by_a_root_that_vanishes_is_not_shown() -> None:
    """The force of x times the distance from the origin."""
    text = """
    coordinate x = 1 m; coordinate y = 1 m;
    kinetic 1/2*1 kg*(der(x)^2 + der(y)^2); potential 1 N/m*x*sqrt(x^2 + y^2);
    """
    first, second = account_of(compiled(text).system, latex=False).equations
    x, y, ax, ay = s("x", "y", "x''", "y''")
    far = sp.sqrt(x**2 + y**2)
    assert sp.simplify(first.right - (ax + sp.diff(x * far, x))) == 0
    assert sp.simplify(second.right - (ay + sp.diff(x * far, y))) == 0


def test_text_has_the_signs_of_the_language() -> None:
    text = write_equations(compiled(PENDULUM).system, "text")
    assert "  L = g*l*m*cos(theta) + l^2*m*theta'^2/2\n" in text and "**" not in text


def test_first_order_states_alone_have_no_lagrangian() -> None:
    text = write_equations(compiled("state Real x = 1; equation der(x) = -x/1 s;").system, "text")
    assert text.split("\n")[2:4] == ["equations of further states", "  x' = -x"]
    assert "Lagrangian" not in text and "cyclic" not in text


def test_latex_of_names_and_descriptions_is_escaped() -> None:
    model = 'model Two_Bars "50 % {loss} & more_"\n  coordinate Length x = 0 m;\n  kinetic 1/2*1 kg*der(x)^2;\nend Two_Bars;'
    text = write_equations(compiled(model).system, "latex")
    assert text.startswith("\\section*{Two\\_Bars}\n50 \\% \\{loss\\} \\& more\\_\n")


def test_a_damper_between_points_is_a_square_over_a_square() -> None:
    text = (
        "import mech.planar.*; Particle p(m = 1 kg); Translation t(world -> p.a, position = {1, 1} m);"
        "Damper d(world -> p.a, c = 2 N.s/m);"
    )
    account = account_of(compiled(text).system, latex=False)
    assert account.dissipation is not None
    way = "t.position[1]*t.position[1]' + t.position[2]*t.position[2]'"
    assert str(account.dissipation.right) == f"d.c*({way})**2/(2*(t.position[1]**2 + t.position[2]**2))"


@pytest.mark.parametrize("example", slow_among(["rolling_coin"], ["rolling_coin", "double_pendulum_3d"]))
def test_names_of_parts_stand_for_what_was_formed(example: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """At random values the equations with names are those that nothing was abbreviated in."""
    system = mechc.load(EXAMPLES / f"{example}.mech").compilation.system
    monkeypatch.setattr(equations, "LONG_LINE", -1)
    monkeypatch.setattr(equations, "decimals", lambda expression: expression)
    named = account_of(system, latex=False)
    assert named.abbreviations
    numbers = random.Random(1)
    values: dict[sp.Symbol, float] = {}

    def value(expression: sp.Expr) -> float:
        for symbol in sorted(expression.free_symbols - set(values), key=str):
            values[symbol] = numbers.uniform(0.5, 1.5)
        symbols = sorted(expression.free_symbols, key=str)
        return float(sp.lambdify(symbols, expression, "math")(*(values[s] for s in symbols)))

    for part in named.abbreviations:
        values[sp.Symbol(part.left)] = value(part.right)
    monkeypatch.setattr(equations, "LONG_LINE", 10**9)
    monkeypatch.setattr(equations, "LONG", 10**9)
    monkeypatch.setattr(equations, "_tidy", lambda expression, *_: expression)
    plain = account_of(system, latex=False)
    compared = 0
    for short, whole in zip(named.sections(), plain.sections(), strict=False):
        for one, other in zip(short.statements, whole.statements, strict=True):
            assert value(one.right) == pytest.approx(value(other.right), rel=1e-9, abs=1e-9)
            compared += 1
    assert compared > 4


def test_equations_of_mechanisms_in_space_are_short() -> None:
    """Six hundred thousand signs in a minute, before parts had names."""
    text = write_equations(mechc.load(EXAMPLES / "rolling_coin.mech").compilation.system, "text")
    assert len(text) < 5000 and max(len(line) for line in text.splitlines()) < 250


def test_long_sums_are_broken_in_latex() -> None:
    x = sp.symbols("x:40")
    broken = latex_lines(sum(x[1:], -x[0]))
    lines = (
        broken.removeprefix(r"\begin{aligned}[t] & ").removesuffix(r" \end{aligned}").split(r" \\ & \quad ")
    )
    assert len(lines) == 3 and " ".join(lines) == sp.latex(sum(x[1:], -x[0]))
    assert latex_lines(x[0] - x[1]) == "x_{0} - x_{1}"


def test_a_condition_with_a_name_of_its_own_is_shown() -> None:
    """A vector that is chosen holds the condition once for each element."""
    model = mechc.loads(
        """import mech.planar.*; Bar b; Free f(world -> b.a); frame g = b.b;
        force if f.x + f.y > sin(f.angle)*1 m then {1, 2} N else {f.x*1 N/m, 3 N} on b.c;"""
    )
    formulas = re.findall(r"<math.*?</math>", write_equations(model.compilation.system, "html"), re.DOTALL)
    shown = [parseString(f.replace("&InvisibleTimes;", "&#x2062;")).toxml() for f in formulas]
    assert [f for f in shown if "&lt;" in f or "&gt;" in f]


def test_where_nothing_moves_that_is_said() -> None:
    model = compiled("input Length u = 1 m;\noutput twice = 2*u;")
    assert "nothing moves" in write_equations(model.system, "text")
    assert "<p>Nothing moves: there are no equations of motion.</p>" in sections_html(model.system)
