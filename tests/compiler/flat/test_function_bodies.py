"""Functions with bodies against the same written in Python: values, and derivatives by complex steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mechc
from mechc.compiler.program.loops.replay import verify
from mechc.compiler.program.loops.roll import roll
from mechc.compiler.targets.c import emit_c

STEP = 1e-30


def model(functions: str, outputs: str, count: int) -> Any:
    """Return a model whose state begins with ``count`` numbers q."""
    text = f"""
{functions}
coordinate Real q[{count}] = 0.3;
kinetic 1/2*1 kg.m^2*sum(der(q[i])^2 for i in 1:{count});
{outputs}
"""
    return mechc.loads(text)


def compare(
    made: Any,
    expected: Callable[[Any], Any],
    count: int,
    rows: np.ndarray[Any, Any],
    tolerance: float = 1e-13,
) -> None:
    """Compare the output y of states with a function of q, and its Jacobian with complex steps of that function."""
    functions = made.functions
    states = np.hstack([rows, np.zeros((len(rows), count))])
    found = functions.output["y"](states)
    slopes = functions.jacobian["y"](states)
    for row, value, slope in zip(rows, found, slopes, strict=True):
        wanted = np.asarray(expected(row.astype(complex)))
        scale = np.abs(wanted.real).max()
        assert np.abs(value - wanted.real).max() <= tolerance * scale
        for k in range(count):
            moved = row.astype(complex)
            moved[k] += STEP * 1j
            derivative = np.asarray(expected(moved)).imag / STEP
            of = slope[..., k]
            size = max(np.abs(derivative).max(), scale)
            assert np.abs(of - derivative).max() <= 20 * tolerance * size


def numbers(count: int, rows: int = 20, seed: int = 1) -> np.ndarray[Any, Any]:
    return np.random.default_rng(seed).uniform(-1.5, 1.5, (rows, count))


MAGIC = """
function magic(Real slip, Force load, Real c[n]) -> (Force side, Torque aligning)
  "Pacejka's Magic Formula with a load-dependent peak"
  let relative = load/4000 N - 1;
  let D = load*(c[1] + c[2]*relative);
  let C = c[3];
  let BCD = c[4]*4000 N*sin(2*atan(load/(c[5]*4000 N)));
  let B = BCD/(C*D);
  var shift = 0;
  for i in 6:n loop
    shift := shift + c[i]*relative^(i - 6);
  end for;
  let x = slip + shift;
  var E = 1.2 - 0.4*relative;
  if x < 0 then
    E := E + 0.3;
  elseif E > 1 then
    E := 1;
  end if;
  let F = D*sin(C*atan(B*x - E*(B*x - atan(B*x))));
  let trail = 30 mm*cos(1.1*atan(8*x));
  return (F, -trail*F);
end magic;
"""


def magic(slip: Any, load: Any, c: Sequence[float]) -> tuple[Any, Any]:
    relative = load / 4000 - 1
    D = load * (c[0] + c[1] * relative)
    B = c[3] * 4000 * np.sin(2 * np.arctan(load / (c[4] * 4000))) / (c[2] * D)
    x = slip + sum(c[i] * relative ** (i - 5) for i in range(5, len(c)))
    E = 1.2 - 0.4 * relative
    if x.real < 0:
        E += 0.3
    elif E.real > 1:
        E = 1
    F = D * np.sin(c[2] * np.arctan(B * x - E * (B * x - np.arctan(B * x))))
    return F, -0.03 * np.cos(1.1 * np.arctan(8 * x)) * F


def test_magic_formula() -> None:
    c = (1.1, -0.08, 1.4, 22.0, 1.7, 0.01, -0.004, 0.002)
    outputs = f"""
let (F, M) = magic(q[1], (q[2] + 3)*1500 N, {{{", ".join(map(str, c))}}});
output y = {{F/1 N, M/1 N.m}};
"""

    def expected(q: Any) -> Any:
        return magic(q[0], (q[1] + 3) * 1500, c)

    compare(model(MAGIC, outputs, 2), expected, 2, numbers(2))


HILL = """
function hill(Real activation, Real length, Real speed, Force strongest) -> Force
  "Muscle: active force of length and speed, and the passive one"
  let active = exp(-((length - 1)/0.45)^2);
  var factor = 0;
  if speed <= 0 then
    factor := (1 + speed)/(1 - speed/0.25);
  else
    let g = 0.25*(1.4 - 1)/(1 + 0.25);
    factor := (1.4*speed + g)/(speed + g);
  end if;
  if length <= 1 then
    return activation*active*factor*strongest;
  end if;
  let passive = (exp(4*(length - 1)/0.6) - 1)/(exp(4) - 1);
  return (activation*active*factor + passive)*strongest;
end hill;
"""


def hill(q: Any) -> Any:
    activation, length, speed = q[0], 1 + q[1] / 4, q[2] / 2
    active = np.exp(-(((length - 1) / 0.45) ** 2))
    if speed.real <= 0:
        factor = (1 + speed) / (1 - speed / 0.25)
    else:
        g = 0.25 * 0.4 / 1.25
        factor = (1.4 * speed + g) / (speed + g)
    passive = (np.exp(4 * (length - 1) / 0.6) - 1) / (np.exp(4) - 1) if length.real > 1 else 0
    return [(activation * active * factor + passive) * 900]


def test_hill_muscle() -> None:
    outputs = "output y = {hill(q[1], 1 + q[2]/4, q[3]/2, 900 N)/1 N};"
    compare(model(HILL, outputs, 3), hill, 3, numbers(3))


QUATERNIONS = """
function times(Real a[4], Real b[4]) -> Real[4]
  var c[4] = 0;
  c[1] := a[1]*b[1] - dot(a[2:4], b[2:4]);
  c[2:4] := a[1]*b[2:4] + b[1]*a[2:4] + cross(a[2:4], b[2:4]);
  return c;
end times;
function unit(Real a[:]) -> Real[:] = a/norm(a);
function multiple(Real a[4], Integer n) -> Real[4]
  var c[4] = {1, 0, 0, 0};
  for i in 1:n loop
    c := unit(times(c, a));
  end for;
  return c;
end multiple;
"""


def product(a: Any, b: Any) -> Any:
    v = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
    return np.array([a[0] * b[0] - a[1:] @ b[1:], *v])


def test_quaternions() -> None:
    def expected(q: Any) -> Any:
        c = np.array([1, 0, 0, 0], complex)
        for _ in range(6):
            c = product(c, q)
            c = c / np.sqrt(c @ c)
        return c

    made = model(QUATERNIONS, "output y = multiple(q, 6);", 4)
    compare(made, expected, 4, numbers(4), 1e-13)


LU = """
function lu(Real A[n, n], Real b[n]) -> Real[n]
  "Solve by Crout's factors without exchanges"
  var F[n, n] = A;
  for k in 1:n loop
    for i in k + 1:n loop
      F[i, k] := F[i, k]/F[k, k];
      for j in k + 1:n loop
        F[i, j] := F[i, j] - F[i, k]*F[k, j];
      end for;
    end for;
  end for;
  var x[n] = b;
  for i in 1:n loop
    x[i] := b[i] - sum(F[i, j]*x[j] for j in 1:i - 1);
  end for;
  for i in n:-1:1 loop
    x[i] := (x[i] - sum(F[i, j]*x[j] for j in i + 1:n))/F[i, i];
  end for;
  return x;
end lu;
"""


def test_factors_of_a_matrix() -> None:
    outputs = """
let A[6, 6] = {{if i == j then 9 + q[i] else q[i]*q[j]/(i + j) for j in 1:6} for i in 1:6};
output y = lu(A, {1, 2, 3, 4, 5, 6});
"""

    def expected(q: Any) -> Any:
        A = np.array(
            [[9 + q[i] if i == j else q[i] * q[j] / (i + j + 2) for j in range(6)] for i in range(6)]
        )
        return np.linalg.solve(A, np.arange(1, 7))

    compare(model(LU, outputs, 6), expected, 6, numbers(6, rows=5), 1e-14)


FASTSIM = """
function creep(Real xi, Real eta, Real psi, Integer m) -> (Real fx, Real fy)
  "Tangential forces on an ellipse of contact in strips (after Kalker's FASTSIM)"
  var fx = 0;
  var fy = 0;
  for j in 1:m loop
    let y = (2*j - 1)/m - 1;
    let a = sqrt(1 - y^2);
    let dx = 2*a/m;
    var px = 0;
    var py = 0;
    for i in 1:m loop
      let x = a - (i - 0.5)*dx;
      px := px - dx*(xi - psi*y);
      py := py - dx*(eta + psi*x);
      let limit = max(1 - x^2 - y^2, 0);
      let size = sqrt(px^2 + py^2 + 1e-30);
      if size > limit then
        px := px*limit/size;
        py := py*limit/size;
      end if;
      fx := fx + px*dx*2/m;
      fy := fy + py*dx*2/m;
    end for;
  end for;
  return (fx, fy);
end creep;
"""


def creep(q: Any, m: int) -> Any:
    xi, eta, psi = q
    fx = fy = 0
    for j in range(1, m + 1):
        y = (2 * j - 1) / m - 1
        a = np.sqrt(1 - y * y)
        dx = 2 * a / m
        px = py = 0
        for i in range(1, m + 1):
            x = a - (i - 0.5) * dx
            px -= dx * (xi - psi * y)
            py -= dx * (eta + psi * x)
            limit = max(1 - x * x - y * y, 0)
            size = np.sqrt(px**2 + py**2 + 1e-30)
            if size.real > limit:
                px, py = px * limit / size, py * limit / size
            fx += px * dx * 2 / m
            fy += py * dx * 2 / m
    return fx, fy


def test_nested_loops() -> None:
    made = model(FASTSIM, "let (fx, fy) = creep(q[1], q[2], q[3], 7); output y = {fx, fy};", 3)
    compare(made, lambda q: creep(q, 7), 3, numbers(3), 1e-13)


# ---------------------------------------------------------------- where calls may stand

MODEL = """
function spring(Length x, Stiffness k, Real c[n]) -> (Force pull, Energy stored)
  var s = 0;
  var e = 0;
  for i in 1:n loop
    let u = x/1 m;
    s := s - c[i]*k*x*u^(2*i - 2);
    e := e + c[i]*k*x^2*u^(2*i - 2)/(2*i);
  end for;
  return (s, e);
end spring;
function count(Integer n) -> Integer
  var s = 0;
  for i in 1:n loop
    if mod(i, 2) == 1 then
      s := s + i;
    end if;
  end for;
  return s;
end count;

model Oscillator
  structural parameter Integer n = count(4);
  parameter Real c[n] = {1, 0.3, 0.1, 0.05};
  coordinate x = 1 m;
  kinetic 1/2*2 kg*der(x)^2;
  let (pull, stored) = spring(x, 5 N/m, c);
  force pull on x;
  output U = stored;
  output E = 1/2*2 kg*der(x)^2 + U;
  output direct[2] = {grad(energy_of, x, c)/1 N, 0};
  function energy_of(Length x, Real c[:]) -> Energy
    let (a, b) = spring(x, 5 N/m, c);
    return b;
  end energy_of;
  discrete Integer hits = 0;
  when x < 0 m then hits := hits + count(2); end when;
  experiment(stop = 2 s, tolerance = 1e-10);
end Oscillator;
"""


def by_scipy(times: Any) -> Any:
    c = (1, 0.3, 0.1, 0.05)

    def rate(_: float, y: Any) -> Any:
        return [y[1], -sum(5 * c[i] * y[0] ** (2 * i + 1) for i in range(4)) / 2]

    return solve_ivp(rate, (0, 2), [1, 0], "DOP853", rtol=1e-12, atol=1e-13, dense_output=True).sol(times)


def test_a_motion_with_events() -> None:
    solution: Any = mechc.loads(MODEL).simulate()
    x, _ = by_scipy(solution.time)
    assert np.abs(solution["x"] - x).max() < 1e-8
    assert np.ptp(solution["E"]) < 1e-8
    wanted = sum(c * 5 * x ** (2 * i + 1) for i, c in enumerate((1, 0.3, 0.1, 0.05)))
    assert np.abs(solution["direct[1]"] - wanted).max() < 1e-7
    assert solution["hits"][-1] == 1


def test_a_motion_by_the_python_target() -> None:
    text = "\n".join(line for line in MODEL.splitlines() if "hits" not in line)
    solution: Any = mechc.loads(text).simulate()
    assert np.abs(solution["x"] - by_scipy(solution.time)[0]).max() < 1e-8


@pytest.mark.slow
def test_long_loops_stay_loops_in_c() -> None:
    """Twice the turns add numbers to a table, and nothing to the code."""
    text = """
function f(Real a, Integer n) -> Real
  var s = 0;
  for i in 1:n loop
    let u = a + i/100;
    s := s + sin(u)*exp(-u^2)/(1 + u^2);
  end for;
  return s;
end f;
"""
    sizes = []
    for turns in (1200, 2400):
        made = model(text, f"output y = f(q[1], {turns});", 1)
        text_of = emit_c(made.compilation.program)
        sizes.append(sum(len(line) for line in text_of.splitlines() if "real(" not in line))
        function = made.compilation.program.function("outputs")
        rolled = roll(function)
        assert rolled is not None
        verify(function, rolled)
    u = 0.3 + np.arange(1, turns + 1) / 100
    found = made.simulate(stop=1e-3, estimate_error=False)["y"][0]
    assert found == pytest.approx(np.sum(np.sin(u) * np.exp(-(u**2)) / (1 + u**2)), rel=1e-12)
    assert sizes[1] < 1.02 * sizes[0] < 40_000


def test_known_conditions_decide_where_a_function_ends() -> None:
    text = """
function first(Real a[n], Real limit) -> Integer
  for i in 1:n loop
    if a[i] > limit then
      return i;
    end if;
  end for;
  return 0;
end first;
function fold(Real a, Integer n) -> Real
  if n == 1 then
    return a;
  elseif n == 2 then
    return a^2;
  end if;
  return a^3 + 1;
end fold;
structural parameter Integer k = first({1, 2, 5, 7}, 3);
parameter Real c[k] = 2;
"""
    made = model(text, "output y = {size(c, 1), fold(q[1], 1), fold(q[1], 2), fold(q[1], 3)};", 1)
    assert made.functions.output["y"](np.array([2.0, 0.0])).tolist() == [3, 2, 4, 9]


def test_an_integral_over_time_of_a_function() -> None:
    made = model(HILL, "output y = {integral(hill(0.5, 1.2, 0.3, 1 N)*time)/1 J*1 m/1 s};", 1)
    solution: Any = made.simulate(stop=2)
    active = np.exp(-((0.2 / 0.45) ** 2))
    g = 0.25 * 0.4 / 1.25
    force = 0.5 * active * (1.4 * 0.3 + g) / (0.3 + g) + (np.exp(4 * 0.2 / 0.6) - 1) / (np.exp(4) - 1)
    assert abs(solution["y[1]"][-1] - 2 * force) < 1e-10


def test_loops_over_elements_truth_values_and_calls_in_calls() -> None:
    text = """
function largest(Real a[:]) -> (Real value, Real count)
  var best = a[1];
  var above = 0;
  var seen = false;
  for x in a loop
    if x > best then
      best := x;
      seen := true;
    end if;
    if seen and x > 0 then
      above := above + 1;
    end if;
  end for;
  return (best, above);
end largest;
function twice(Real a[n]) -> Real[n]
  let (value, count) = largest(a);
  let Real unchanged[:] = a*(1 m);
  let Length same[n] = unchanged;
  var A[2, n] = 0;
  for i in 1:n loop
    A[:, i] := {a[i], value*count};
  end for;
  A[1, 2:n] := A[1, 1:n-1];
  return A[1, :] + A[2, :];
end twice;
"""
    made = model(text, "output y = twice({q[1], q[2], q[3], 0.2});", 3)

    def expected(q: Any) -> Any:
        a = [*q, 0.2]
        best, above, seen = a[0], 0, False
        for x in a:
            if x.real > best.real:
                best, seen = x, True
            above += seen and x.real > 0
        return np.array([a[0], *a[:3]]) + best * above

    compare(made, expected, 3, numbers(3))


def test_a_loop_that_a_condition_of_the_motion_leaves() -> None:
    text = """
function first(Real a, Integer n) -> (Real turn, Real value)
  var s = 0;
  for i in 1:n loop
    s := s + a^i/i;
    if sin(a*i) > 0.8 then
      return (i, s);
    end if;
    for k in 1:2 loop
      if cos(a*i*k) < -0.99 then
        return (i + 100*k, s);
      end if;
    end for;
  end for;
  return (0, s);
end first;
"""
    made = model(text, "let (turn, value) = first(q[1], 30); output y = {turn, value};", 1)

    def expected(q: Any) -> Any:
        a, s = q[0], 0
        for i in range(1, 31):
            s += a**i / i
            if np.sin(a * i).real > 0.8:
                return i, s
            for k in (1, 2):
                if np.cos(a * i * k).real < -0.99:
                    return i + 100 * k, s
        return 0, s

    compare(made, expected, 1, np.linspace(0.01, 0.9, 20)[:, None])
