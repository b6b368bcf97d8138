"""Modules for CasADi and JAX against the C kernel, its tangents, and motions with known answers."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from differentiable_modules import module, wanted
from scipy.integrate import solve_ivp

import mechc
from mechc.exporting import without_bends
from mechc.requests.parse_values import UsageMistake
from mechc.runtime.case import Case, SimulationOptions, prepare
from mechc.runtime.functions import Functions, load_functions

EXAMPLES = sorted((Path(__file__).parents[3] / "examples").glob("*.mech"))
LIBRARIES = pytest.mark.parametrize("library", ["casadi", "jax"])

CLOSE = 1e-11
"""Rounding of accelerations, by the size of the largest: libraries order sums as they like; the worst example is a loop."""

FEW = ("pendulum", "lagrange_top", "ball_in_bowl", "four_bar", "driven_pendulum", "spherical_pendulum")

QUICK = """
model Swing
  parameter m = 1 kg;
  parameter l = 0.8 m;
  parameter J = m*l^2;
  parameter g = 9.81 m/s^2;
  input Torque push = 0 N.m;
  coordinate Angle theta = 60 deg;
  kinetic 1/2*J*der(theta)^2;
  potential -m*g*l*cos(theta);
  force push on theta;
  experiment(stop = 1 s);
end Swing;
"""


def exported(model: Any, library: str, folder: Path) -> ModuleType:
    wanted(library)
    (path,) = model.compile(library, folder / f"{model.name}_{library}.py")
    return module(path)


def of_library(module: ModuleType, library: str, name: str) -> Any:
    """Return a function (t, y, u) of a module as one of arrays, evaluated without compiling it."""
    if library == "casadi":
        p = [value_of(module, n) for n in module.INDEPENDENT]
        function = module.functions()[name]
        return lambda t, y, u: np.array(function(t, y, u, p)).ravel()
    import jax

    p = module.all_parameters()

    def evaluate(t: float, y: Any, u: Any) -> Any:
        with jax.disable_jit():
            return np.array(getattr(module, name)(t, y, u, p))

    return evaluate


def value_of(module: ModuleType, name: str) -> float:
    names = [n for n, _ in module.PARAMETERS]
    return float(module.all_parameters()[names.index(name)])


def states_near(module: ModuleType, count: int = 3) -> list[Any]:
    """Return the start, and states beside it, off the constraints too, with quaternions of length 1."""
    rng = np.random.default_rng(1)
    found = [np.array(module.START)]
    for _ in range(count):
        y = found[0] + rng.normal(0, 0.05, len(found[0])) * (1 + abs(found[0]))
        for i in module.ROTATIONS:
            y[i : i + 4] /= np.linalg.norm(y[i : i + 4])
        found.append(y)
    return found


def begun(model: Any) -> tuple[Case, Functions]:
    """Return the case of the default experiment and the functions of the C kernel."""
    functions = load_functions(problem := model.problem())
    return prepare(problem, functions, SimulationOptions(stop=1.0)), functions


def agrees(path: Path, library: str, folder: Path) -> None:
    """Compare all functions of an example with those of the C kernel."""
    model = mechc.load(path)
    program = model.compilation.program
    if program.switching is not None or program.curve is not None:
        if (plain := without_bends(model)) is not model:
            compared(plain, library, folder)
            return
        with pytest.raises(UsageMistake, match=r"switches|is a curve"):
            model.compile(library, folder / "none.py")
        assert not (folder / "none.py").exists()
        return
    compared(model, library, folder)


def compared(model: Any, library: str, folder: Path) -> None:
    """Compare all functions of a model with those of the C kernel."""
    made = exported(model, library, folder)
    case, functions = begun(model)
    empty = np.empty(0)
    np.testing.assert_allclose(made.START, case.y0, 1e-14, 1e-14)
    u = np.array(made.INPUT)
    for y in states_near(made):
        for name in ("rhs", "outputs"):
            expected = getattr(functions, name)(made.TIME, y, u, empty, case.p)
            if len(expected) == 0:
                continue
            found = of_library(made, library, name)(made.TIME, y, u)
            finite = np.isfinite(expected)
            assert (np.isfinite(found) == finite).all()
            size = max(1.0, np.max(abs(expected[finite]), initial=0.0))
            assert np.max(abs(found - expected)[finite], initial=0.0) <= CLOSE * size, (name, y)


@LIBRARIES
@pytest.mark.parametrize("name", FEW)
def test_some_examples_agree_with_the_kernel(name: str, library: str, tmp_path: Path) -> None:
    agrees(next(path for path in EXAMPLES if path.stem == name), library, tmp_path)


SPRINGS = """
model Springs
  dimensionless;
  coordinate x = 1; coordinate a ~ 0.3; coordinate b ~ 0.6;
  kinetic der(x)^2;
  potential 3/2*a^2 + a^4/4 + (b - a)^2 + (b - a)^4/4 + (x - b)^2;
  experiment(stop = 1);
end Springs;
"""


def springs(y: Any) -> Any:
    """Return the rates by hand, of complex numbers too: Newton's method for the nodes, and the implicit function for their rates."""
    x, v, a, b = y
    for _ in range(12):
        stiff = 2 + 3 * (b - a) ** 2
        rows = [3 * a + a**3 - 2 * (b - a) - (b - a) ** 3, 2 * (b - a) + (b - a) ** 3 - 2 * (x - b)]
        matrix = np.array([[3 + 3 * a**2 + stiff, -stiff], [-stiff, stiff + 2]])
        a, b = np.array([a, b]) - np.linalg.solve(matrix, rows)
    return np.array([v, -(x - b), *(np.linalg.solve(matrix, [0, 2]) * v)])


UNKNOWNS = """
model Unknowns
  dimensionless;
  parameter k = 2;
  coordinate x = 1; coordinate a ~ 0.3;
  output z ~ 1; equation z^3 + z = k + x;
  output r ~ 1; output s ~ 1;
  equation r*(2 + x^2) + s*x = k; equation r*x + 3*s = x^2;
  output d ~ 1; equation d^3 = x^3; equation d^2 + d = x^2 + x;
  kinetic der(x)^2;
  potential 3/2*a^2 + a^4/4 + (x - a)^2;
  force r - s + d^2 - z on x;
  experiment(stop = 1);
end Unknowns;
"""


def unknowns(values: Any) -> Any:
    """Return the rates by hand: a and z by Newton's method, r and s of linear equations, d is x; then how a moves with x, and the power."""
    x, v, a, _, k = values
    z = x
    for _ in range(12):
        a -= (3 * a + a**3 - 2 * (x - a)) / (5 + 3 * a**2)
        z -= (z**3 + z - k - x) / (3 * z**2 + 1)
    r, s = np.linalg.solve([[2 + x**2, x], [x, 3.0]], [k, x**2])
    force = r - s + x**2 - z
    return np.array([v, (force - 2 * (x - a)) / 2, 2 * v / (5 + 3 * a**2), force * v])


OF_UNKNOWNS = {"springs": (SPRINGS, springs), "unknowns": (UNKNOWNS, unknowns)}


@LIBRARIES
@pytest.mark.parametrize("name", ["springs", pytest.param("unknowns", marks=pytest.mark.slow)])
def test_derivatives_of_what_is_found_together(name: str, library: str, tmp_path: Path) -> None:
    """Two coordinates without mass; one beside an unknown, linear unknowns, and more equations than unknowns. Rates and their
    derivatives forward and backward, by states and by a parameter, against complex steps of what is solved by hand. JAX gave NaN backward."""
    (text, by_hand), n = OF_UNKNOWNS[name], 4
    made = exported(mechc.loads(text), library, tmp_path)
    y = np.array(made.START) + np.array([0.1, 0.7, 0, 0])
    at = np.array([*y, *(value_of(made, p) for p in made.INDEPENDENT)])
    exact = np.array([by_hand(at + 1e-30j * d).imag / 1e-30 for d in np.eye(len(at))]).T
    if library == "casadi":
        from casadi import DM, SX, Function, jacobian, jtimes, vertcat

        w = SX.sym("w", len(at))
        rates = made.functions()["rhs"](0.0, w[:n], [], w[n:])
        back = [jtimes(rates, w, DM(row), True).T for row in np.eye(n)]
        value, *slopes = Function("all", [w], [rates, jacobian(rates, w), vertcat(*back)])(at)
    else:
        import jax

        def rates(w: Any) -> Any:
            given = dict(zip(made.INDEPENDENT, w[n:], strict=True))
            return made.rhs(0.0, w[:n], np.zeros(0), made.all_parameters(given))

        def every(w: Any) -> Any:
            return rates(w), jax.jacfwd(rates)(w), jax.jacrev(rates)(w), jax.hessian(lambda w: rates(w)[1])(w)

        several = np.array([at, at + 0.01])
        (value, other), *slopes, bent = jax.jit(jax.vmap(every))(several)
        slopes, bent = [found[0] for found in slopes], bent[0]
        np.testing.assert_allclose(other, by_hand(several[1]), 0, 1e-14)
        h = 1e-4
        expected = [
            (np.imag(by_hand(at + h * d + 1e-30j * e)) - np.imag(by_hand(at - h * d + 1e-30j * e)))[1]
            for d in np.eye(len(at))
            for e in np.eye(len(at))
        ]
        # differences of order two, of third derivatives near 1
        np.testing.assert_allclose(np.ravel(bent), np.array(expected) / (2e-30 * h), 0, 1e-6)
    np.testing.assert_allclose(np.array(value).ravel(), by_hand(at), rtol=0, atol=1e-14)
    for found in slopes:
        np.testing.assert_allclose(np.array(found), exact, rtol=0, atol=1e-14)


def test_jax_says_where_nothing_is_found(tmp_path: Path) -> None:
    """a^2 = x, of a state without a root beside others that have one."""
    text = """
    dimensionless;
    coordinate x = 1;
    output a ~ 1; equation a^2 = x;
    kinetic 1/2*der(x)^2;
    force -a on x;
    experiment(stop = 1);
    """
    made = exported(mechc.loads(text), "jax", tmp_path)
    import jax

    states = np.array([[4.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [9.0, 0.0, 0.0]])
    found = jax.vmap(lambda y: made.rhs(0.0, y, np.zeros(0), made.all_parameters()))(states)
    np.testing.assert_array_equal(np.array(found)[:, 1], [-2.0, np.nan, -3.0])


LONG = ", ".join(f"{0.1 * k:.1f}" for k in range(-40, 41))
TABLES = f"""
model Tables
  coordinate x = 0.3 m;
  coordinate y = 0.7 m;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  force table(x, {{{LONG}}} m, {{sin(3*s) for s in {{{LONG}}}}} N) on x;
  force table(x, y, {{-1, 0, 0.4, 2}} m, {{0, 0.5, 1}} m, {{{{1, 2, 0}}, {{0, 1, 3}}, {{4, 2, 1}}, {{1, 1, 2}}}} N) on y;
  force table(y, {{0, 0.2, 0.5, 1}} m, {{1, 3, 2, 1}} N, "spline", "periodic") on x;
  force table(x, y, {{-1, 0, 0.4, 2}} m, {{0, 0.5, 1}} m, {{{{1, 2, 0}}, {{0, 1, 3}}, {{4, 2, 1}}, {{1, 1, 2}}}} N, "linear", "hold") on x;
  output stepped = table(x, y, {{-1, 0, 2}} m, {{0, 1}} m, {{{{1, 2}}, {{3, 4}}, {{5, 6}}}}, "step", "periodic");
  experiment(stop = 1 s);
end Tables;
"""


@LIBRARIES
def test_tables_of_all_kinds_agree_with_the_kernel(library: str, tmp_path: Path) -> None:
    (path := tmp_path / "tables.mech").write_text(TABLES, encoding="utf-8")
    agrees(path, library, tmp_path)


@pytest.mark.slow
@LIBRARIES
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_all_examples_agree_with_the_kernel(path: Path, library: str, tmp_path: Path) -> None:
    agrees(path, library, tmp_path)


@pytest.fixture(scope="module", params=["casadi", "jax"])
def swing(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, ModuleType]:
    folder = tmp_path_factory.mktemp(request.param)
    return request.param, exported(mechc.loads(QUICK).with_values({"m": 2}), request.param, folder)


def acceleration(swing: tuple[str, ModuleType], values: dict[str, float], theta: float, push: float) -> Any:
    """Return the acceleration of the pendulum and its derivatives by the values, in their order."""
    library, made = swing
    y = [theta, 0.0, 0.0]
    if library == "casadi":
        import casadi

        f = made.functions(tuple(values))["accelerations"]
        p = casadi.SX.sym("p", len(values))
        a = f(0, y, [push], p)
        found = casadi.Function("f", [p], [a, casadi.jacobian(a, p)])(list(values.values()))
        return np.concatenate([np.array(x).ravel() for x in found])
    import jax

    def one(values: Any) -> Any:
        return made.accelerations(0.0, np.array(y), np.array([push]), made.all_parameters(values))[0]

    value, slopes = jax.value_and_grad(one)(values)
    return np.array([value, *(slopes[name] for name in values)])


def test_parameters_and_what_follows_from_them(swing: tuple[str, ModuleType]) -> None:
    """a = (u - m g l sin theta)/J with J = m l^2, or as it is set; the mass was set to 2 kg when it was written."""
    m, l, g, theta, u = 2.0, 0.5, 9.81, 0.7, 3.0
    s = np.sin(theta)
    found = acceleration(swing, {"l": l}, theta, u)
    J = m * l**2
    np.testing.assert_allclose(found, [u / J - g / l * s, -2 * u / (J * l) + g / l**2 * s], 1e-14)
    found = acceleration(swing, {"m": 1.0, "l": l}, theta, u)
    np.testing.assert_allclose(found[0], u / l**2 - g / l * s, 1e-14)
    J = 0.3
    found = acceleration(swing, {"l": l, "J": J}, theta, u)
    a = (u - m * g * l * s) / J
    np.testing.assert_allclose(found, [a, -m * g * s / J, -a / J], 1e-14)


def test_unknown_parameters_are_refused(swing: tuple[str, ModuleType]) -> None:
    with pytest.raises(KeyError, match="no parameter lenght; there are m, l, J, g"):
        swing[1].all_parameters({"lenght": 1.0})
    assert swing[1].INDEPENDENT == ["m", "l", "g"]


@pytest.mark.slow
@LIBRARIES
@pytest.mark.parametrize("name", ["four_bar", "heavy_top_rotation", "rolling_coin", "lagrange_top"])
def test_derivatives_of_rates_are_those_of_differences(name: str, library: str, tmp_path: Path) -> None:
    """With constraints and quaternions; differences of the C kernel of order four, step 1e-3: errors near 1e-10."""
    path = next(path for path in EXAMPLES if path.stem == name)
    model = mechc.load(path)
    made = exported(model, library, tmp_path)
    case, functions = begun(model)
    start, p, empty = case.y0, case.p, np.empty(0)
    rng = np.random.default_rng(2)
    w = rng.normal(size=len(start))

    def rates(s: float) -> Any:
        return functions.rhs(0.0, start + s * w, empty, empty, p)

    h = 1e-3
    expected = (8 * (rates(h) - rates(-h)) - (rates(2 * h) - rates(-2 * h))) / (12 * h)
    if library == "casadi":
        import casadi

        y = casadi.SX.sym("y", len(start))
        f = made.functions(())["rhs"]
        along = casadi.jtimes(f(0, y, [], []), y, w)
        found = np.array(casadi.Function("f", [y], [along])(start)).ravel()
    else:
        import jax

        p_ = made.all_parameters()
        _, found = jax.jvp(lambda y: made.rhs(0.0, y, np.zeros(0), p_), (start,), (w,))
    np.testing.assert_allclose(np.array(found), expected, 1e-7, 1e-7 * np.max(abs(expected)))


@LIBRARIES
def test_projection_squares_the_distance(library: str, tmp_path: Path) -> None:
    path = next(path for path in EXAMPLES if path.stem == "four_bar")
    made = exported(mechc.load(path), library, tmp_path)
    distance, project = of_library(made, library, "constraints"), of_library(made, library, "projected")
    y = np.array(made.START)
    y[: made.NQ + made.NV] += 1e-3 * np.cos(np.arange(made.NQ + made.NV))
    sizes = []
    for _ in range(3):
        sizes.append(np.max(abs(distance(made.TIME, y, []))))
        y = project(made.TIME, y, [])
    assert sizes[0] > 1e-4
    assert sizes[1] < 10 * sizes[0] ** 2
    assert sizes[2] < 10 * sizes[1] ** 2 + 1e-15


def test_the_motion_of_a_module_is_that_of_the_model(swing: tuple[str, ModuleType]) -> None:
    """Integrated by SciPy, against the kernel at 1e-11."""
    library, made = swing
    rates = of_library(made, library, "rhs")
    found = solve_ivp(
        lambda t, y: rates(t, y, made.INPUT), (0, 1), made.START, "DOP853", rtol=1e-10, atol=1e-10
    )
    solution = mechc.loads(QUICK).with_values({"m": 2}).simulate(tolerance=1e-11)
    assert found.y[0, -1] == pytest.approx(solution["theta"][-1], abs=1e-8)


@LIBRARIES
def test_a_branch_that_is_not_taken_may_divide_by_zero(library: str, tmp_path: Path) -> None:
    """A constant of the run is made of numbers of Python, which raise where a parameter is zero."""
    text = """
    parameter M = 2 N.m;
    parameter k = 0 N.m/rad;
    coordinate Angle a = 0.3 rad;
    kinetic 1/2*1 kg.m^2*der(a)^2;
    force (if k > 0 then M/k*1 N.m/rad else -a*1 N.m/rad) on a;
    experiment(stop = 1 s);
    """
    made = exported(mechc.loads(text), library, tmp_path)
    assert list(of_library(made, library, "rhs")(0.0, made.START, np.empty(0))) == [0.0, -0.3, 0.0]
