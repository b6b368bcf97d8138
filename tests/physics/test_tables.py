"""Tables of all kinds, against SciPy's interpolators; their kinks and jumps, against motions by pieces."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import (
    CubicHermiteSpline,
    CubicSpline,
    PchipInterpolator,
    RectBivariateSpline,
    RegularGridInterpolator,
)

import mechc

Floats = NDArray[np.float64]

POINTS = np.array([-1.0, 0.5, 1.0, 2.5, 3.0, 4.5])
VALUES = np.array([2.0, -1.0, 0.5, 0.25, 3.0, 2.0])
WAVE = np.array([2.0, -1.0, 0.5, 0.25, 3.0, 2.0])
KINDS = ("smooth", "spline", "linear", "step")
STOP = 9.0


def listed(values: Floats) -> str:
    if values.ndim > 1:
        return "{" + ", ".join(map(listed, values)) + "}"
    return "{" + ", ".join(f"{float(x)!r}" for x in values) + "}"


def along(outputs: str, count: int = 401) -> mechc.Solution:
    """Return a run of which ``s`` grows from -3 to 6."""
    text = f"""
        dimensionless;
        state s = -3; equation der(s) = 1;
        {outputs}
        experiment(stop = {STOP!r}, every = {STOP / (count - 1)!r});
    """
    return mechc.loads(text).simulate()


def inside(x: Floats, points: Floats, outside: str) -> Floats:
    if outside == "hold":
        return np.clip(x, points[0], points[-1])
    if outside == "periodic":
        folded: Floats = points[0] + np.mod(x - points[0], points[-1] - points[0])
        return folded
    return x


def expected(kind: str, outside: str, x: Floats, points: Floats = POINTS, values: Floats = VALUES) -> Floats:
    """By SciPy; beyond the ends as a straight line."""
    at = inside(x, points, outside)
    if kind == "linear":
        low = np.clip(np.searchsorted(points, at, side="right") - 1, 0, len(points) - 2)
        slopes = np.diff(values) / np.diff(points)
        return values[low] + slopes[low] * (at - points[low])
    if kind == "step":
        return values[np.clip(np.searchsorted(points, at, side="right") - 1, 0, len(points) - 1)]
    curve = smooth_curve(kind, outside, points, values)
    found = curve(np.clip(at, points[0], points[-1]))
    beyond = at - np.clip(at, points[0], points[-1])
    continued: Floats = found + beyond * np.where(beyond < 0, curve(points[0], 1), curve(points[-1], 1))
    return continued


def slopes_of(kind: str, outside: str, x: Floats) -> Floats:
    """The same of the derivative."""
    at = inside(x, POINTS, outside)
    if kind == "step":
        return np.zeros_like(x)
    if kind == "linear":
        low = np.clip(np.searchsorted(POINTS, at, side="right") - 1, 0, len(POINTS) - 2)
        found: Floats = (np.diff(VALUES) / np.diff(POINTS))[low]
    else:
        curve = smooth_curve(kind, outside, POINTS, VALUES)
        found = curve(np.clip(at, POINTS[0], POINTS[-1]), 1)
    return np.where((x < POINTS[0]) | (x > POINTS[-1]), 0.0, found) if outside == "hold" else found


def smooth_curve(kind: str, outside: str, points: Floats, values: Floats) -> CubicSpline | PchipInterpolator:
    if kind == "spline":
        return CubicSpline(points, values, bc_type="periodic" if outside == "periodic" else "not-a-knot")
    if outside != "periodic":
        return PchipInterpolator(points, values)
    period = points[-1] - points[0]
    wide = np.concatenate([points[:-1] - period, points[:-1], points + period])
    return PchipInterpolator(wide, np.concatenate([values[:-1], values[:-1], values]))


@pytest.fixture(scope="module")
def curves() -> mechc.Solution:
    every = product(KINDS, ("extend", "hold", "periodic"))
    calls = {f"{k}_{o}": f'table(s, {listed(POINTS)}, {listed(WAVE)}, "{k}", "{o}")' for k, o in every}
    return along(
        "".join(f"output {n} = {call}; output d_{n} = der({call});\n" for n, call in calls.items()), 721
    )


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("outside", ["extend", "hold", "periodic"])
def test_a_table_of_one_variable_is_scipys(curves: mechc.Solution, kind: str, outside: str) -> None:
    """To some roundings; at points where it jumps or bends either side may be taken, within a rounding of the time."""
    name = f"{kind}_{outside}"
    x = curves["s"]
    edge = np.min(np.abs(inside(x, POINTS, outside)[:, None] - POINTS), axis=1) < 1e-9
    edge &= kind in ("linear", "step")
    wanted = expected(kind, outside, x)
    if kind == "step":
        wanted[edge] = curves[name][edge]
    np.testing.assert_allclose(curves[name], wanted, rtol=0, atol=1e-13)
    slopes = slopes_of(kind, outside, x)
    np.testing.assert_allclose(curves[f"d_{name}"][~edge], slopes[~edge], rtol=0, atol=1e-12)


def test_long_smooth_tables_are_those_of_short_ones() -> None:
    """Beyond SHORT points a table is read by the index of a cell."""
    rng = np.random.default_rng(3)
    points = np.sort(rng.uniform(-2.5, 5.0, 300))
    values = rng.normal(size=300)
    call = f"table(s, {listed(points)}, {listed(values)})"
    found = along(f"output f = {call}; output d = der({call});")
    curve = PchipInterpolator(points, values)
    np.testing.assert_allclose(
        found["f"], expected("smooth", "extend", found["s"], points, values), atol=1e-13
    )
    within = (found["s"] > points[0]) & (found["s"] < points[-1])
    np.testing.assert_allclose(found["d"][within], curve(found["s"][within], 1), rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("count", [40, 80])
@pytest.mark.parametrize("kind", ["smooth", "spline"])
def test_slopes_at_points_are_those_between_them(kind: str, count: int) -> None:
    """Short tables and long ones, of time, which passes whole numbers exactly, and beyond both ends."""
    rng = np.random.default_rng(4)
    points, values = np.arange(1.0, count + 1), rng.normal(size=count)
    call = f'table(time, {listed(points)}, {listed(values)}, "{kind}")'
    stop = count + 3
    text = f"dimensionless; state x = 0; equation der(x) = 1; output d = der({call}); experiment(stop = {stop}, every = 0.5);"
    found = mechc.loads(text).simulate()
    curve = smooth_curve(kind, "extend", points, values)
    np.testing.assert_allclose(found["d"], curve(np.clip(found.time, 1, count), 1), rtol=0, atol=1e-12)


def test_very_uneven_points_are_found() -> None:
    """Where evenly spaced points would have the cell there is none near: the search goes on from there, to either side."""
    steps = np.geomspace(1e-9, 1.0, 80)
    for points in (
        np.concatenate([[-2.0], 5.0 - steps[::-1], 5.0 + steps]),
        np.concatenate([-2.0 + steps, [5.5]]),
    ):
        values = np.sin(points)
        found = along(f'output f = table(s, {listed(points)}, {listed(values)}, "smooth", "hold");', 721)
        wanted = PchipInterpolator(points, values)(np.clip(found["s"], points[0], points[-1]))
        np.testing.assert_allclose(found["f"], wanted, rtol=0, atol=1e-14)


# ---------------------------------------------------------------- two variables

XS, YS = np.array([-2.0, -1.0, 0.5, 1.0, 4.0]), np.array([0.0, 1.0, 1.5, 3.0])
Z = np.array(
    [[1.0, 2.0, -1.0, 0.0], [0.5, 3.0, 1.0, 1.0], [2.0, 2.5, 2.0, 4.0], [0.0, -1.0, 2.0, 2.0], [1, 1, 0, 3.0]]
)
PATH = "(1.5 + 1.4*sin(2*s))"


def surface(kind: str, outside: str = "extend") -> str:
    return f'table(s, {PATH}, {listed(XS)}, {listed(YS)}, {listed(Z)}, "{kind}", "{outside}")'


@pytest.fixture(scope="module")
def surfaces() -> mechc.Solution:
    return along("".join(f"output {k} = {surface(k)}; output d_{k} = der({surface(k)});" for k in KINDS), 301)


def bicubic(x: Floats, y: Floats, by: tuple[int, int] = (0, 0)) -> Floats:
    """By two steps of SciPy: along y on every line of the grid, then along x; slopes across by the mean of both orders. ``by``: how
    often differentiated by x and by y."""

    def slopes(points: Floats, values: Floats, axis: int) -> Floats:
        return np.asarray(PchipInterpolator(points, values, axis=axis)(points, 1))

    by_x, by_y = slopes(XS, Z, 0), slopes(YS, Z, 1)
    both = (slopes(YS, by_x, 1) + slopes(XS, by_y, 0)) / 2
    lines = CubicHermiteSpline(YS, Z, by_y, axis=1)(y, by[1])
    across = CubicHermiteSpline(YS, by_x, both, axis=1)(y, by[1])
    return np.array([CubicHermiteSpline(XS, lines[:, k], across[:, k])(x[k], by[0]) for k in range(len(x))])


def bilinear(x: Floats, y: Floats, by: tuple[int, int] = (0, 0)) -> Floats:
    """By SciPy; derivatives are differences across the cell, in which it is linear along each axis."""
    sides = []
    for at, points, order in ((x, XS, by[0]), (y, YS, by[1])):
        low = np.searchsorted(points, at, side="right") - 1
        sides.append((points[low], points[low + 1]) if order else (at, at))
    ends = [np.stack([a, b], axis=1) for a, b in zip(*sides, strict=True)]
    f = RegularGridInterpolator((XS, YS), Z)
    if not any(by):
        return np.asarray(f(ends[0]))
    return np.asarray((f(ends[1]) - f(ends[0])) / np.sum(ends[1] - ends[0], axis=1))


def stairs(x: Floats, y: Floats, by: tuple[int, int] = (0, 0)) -> Floats:
    rows, columns = np.searchsorted(XS, x, side="right") - 1, np.searchsorted(YS, y, side="right") - 1
    return np.zeros_like(x) if any(by) else Z[rows, columns]


def bispline(x: Floats, y: Floats, by: tuple[int, int] = (0, 0)) -> Floats:
    return np.asarray(RectBivariateSpline(XS, YS, Z, s=0).ev(x, y, *by))


SURFACES = {"smooth": bicubic, "spline": bispline, "linear": bilinear, "step": stairs}


@pytest.mark.parametrize("kind", KINDS)
def test_a_table_of_two_variables_is_scipys(surfaces: mechc.Solution, kind: str) -> None:
    """Along a path x = s, y(s): the derivative is that by x and y' times that by y."""
    x = surfaces["s"]
    within = (x > XS[0]) & (x < XS[-1]) & (np.min(np.abs(x[:, None] - XS), axis=1) > 1e-9)
    x = x[within]
    y, rate = 1.5 + 1.4 * np.sin(2 * x), 2.8 * np.cos(2 * x)
    f = SURFACES[kind]
    np.testing.assert_allclose(surfaces[kind][within], f(x, y), rtol=0, atol=2e-13)
    slopes = f(x, y, (1, 0)) + rate * f(x, y, (0, 1))
    np.testing.assert_allclose(surfaces[f"d_{kind}"][within], slopes, rtol=0, atol=2e-12)


def test_surfaces_hold_and_repeat() -> None:
    """Held ones are those at the nearest place of the grid; periodic splines, by SciPy along one axis after the other."""
    wave = Z.copy()
    wave[:, -1], wave[-1] = wave[:, 0], wave[0]
    wave[-1, -1] = wave[0, 0]
    y = "(1.7 + 2.9*sin(2*s))"
    calls = {
        f"{k}_{o}": f'table(s, {y}, {listed(XS)}, {listed(YS)}, {listed(wave)}, "{k}", "{o}")'
        for k, o in product(KINDS, ("hold", "periodic"))
    }
    held = {
        k: f'table(clamp(s, {XS[0]}, {XS[-1]}), clamp({y}, {YS[0]}, {YS[-1]}), {listed(XS)}, {listed(YS)}, {listed(wave)}, "{k}")'
        for k in KINDS
    }
    found = along("".join(f"output {n} = {c};\n" for n, c in (calls | held).items()), 301)
    x, ys = found["s"], 1.7 + 2.9 * np.sin(2 * found["s"])
    for kind in KINDS:
        np.testing.assert_allclose(found[f"{kind}_hold"], found[kind], rtol=0, atol=1e-13)
    at = inside(x, XS, "periodic"), inside(ys, YS, "periodic")
    lines = CubicSpline(YS, wave, axis=1, bc_type="periodic")(at[1])
    spline = [CubicSpline(XS, lines[:, k], bc_type="periodic")(at[0][k]) for k in range(len(x))]
    np.testing.assert_allclose(found["spline_periodic"], spline, rtol=0, atol=2e-13)
    linear = RegularGridInterpolator((XS, YS), wave)(np.stack(at, axis=1))
    np.testing.assert_allclose(found["linear_periodic"], linear, rtol=0, atol=2e-13)
    rows, columns = (np.searchsorted(p, v, side="right") - 1 for p, v in zip((XS, YS), at, strict=True))
    clear = np.min(np.abs(at[0][:, None] - XS), axis=1) > 1e-9
    np.testing.assert_array_equal(found["step_periodic"][clear], wave[rows, columns][clear])


def test_kinks_of_surfaces_are_located() -> None:
    """Of a force over place and time, both of which cross lines of the grid; against SciPy with short steps."""
    rows = listed(Z)
    law = f'force table(x, time, {listed(XS)} m, {listed(YS)} s, {rows} N, "linear") on x;'
    found = mechc.loads(SPRING + law + "experiment(stop = 2.5 s, tolerance = 1e-12);").simulate()
    force = RegularGridInterpolator((XS, YS), Z, bounds_error=False, fill_value=None)
    run = solve_ivp(
        lambda t, y: [y[1], float(force([[y[0], t]])[0])], (0, 2.5), [0.1, 3.0], method="DOP853",
        rtol=1e-10, atol=1e-10, max_step=0.01,
    )  # fmt: skip
    assert abs(found["x"][-1] - run.y[0, -1]) < 1e-8 and found["x"][-1] > XS[-1]
    assert found.accuracy.error is not None and found.accuracy.error.largest < 1e-10


def test_a_smooth_surface_is_its_curve_on_lines_of_the_grid() -> None:
    grid = f"{listed(XS)}, {listed(YS)}, {listed(Z)}"
    found = along(f"output along_x = table(s, 1.5, {grid}); output along_y = table(0.5, s, {grid});")
    for name, points, values in (("along_x", XS, Z[:, 2]), ("along_y", YS, Z[2])):
        wanted = expected("smooth", "extend", found["s"], points, values)
        np.testing.assert_allclose(found[name], wanted, rtol=0, atol=1e-13)


def test_a_smooth_surface_of_a_product_is_the_product() -> None:
    """Beyond the ends, too."""
    product = np.outer(XS, YS)
    found = along(f"output f = table(s, {PATH}, {listed(XS)}, {listed(YS)}, {listed(product)});")
    np.testing.assert_allclose(found["f"], found["s"] * (1.5 + 1.4 * np.sin(2 * found["s"])), atol=1e-13)


# ---------------------------------------------------------------- motions

SPRING = """
    parameter m = 1 kg;
    coordinate Length x = 0.1 m;
    initial der(x) = 3 m/s;
    kinetic 1/2*m*der(x)^2;
"""


@pytest.mark.parametrize("method", ["dop853", "radau5", "taylor"])
@pytest.mark.parametrize("kind", ["linear", "step"])
def test_kinks_and_jumps_are_located(kind: str, method: str) -> None:
    """Against SciPy, which is stopped at each point by its own events."""
    points, values = np.array([-1.0, 0.0, 0.5, 1.0]), np.array([3.0, -0.5, -1.0, -9.0])
    law = f'force table(x, {listed(points)} m, {listed(values)} N, "{kind}") on x;'
    model = mechc.loads(SPRING + law + "experiment(stop = 3 s, tolerance = 1e-12);")
    found = model.simulate(method=method)

    def piece(k: int, x: float) -> float:
        if kind == "step":
            return float(values[k])
        return float(values[k] + (values[k + 1] - values[k]) / (points[k + 1] - points[k]) * (x - points[k]))

    t, state, crossings = 0.0, np.array([0.1, 3.0]), 0
    last = len(points) - (1 if kind == "step" else 2)
    k = 1
    while t < 3.0:
        low = points[k] if k > 0 else -np.inf
        high = points[k + 1] if k < last else np.inf

        def lower(t: float, y: Floats, low: float = low) -> float:
            return float(y[0] - low) if np.isfinite(low) else 1.0

        def upper(t: float, y: Floats, high: float = high) -> float:
            return float(high - y[0]) if np.isfinite(high) else 1.0

        lower.terminal = upper.terminal = True  # type: ignore[attr-defined]
        lower.direction = upper.direction = -1  # type: ignore[attr-defined]
        run = solve_ivp(
            lambda t, y, k=k: [y[1], piece(k, y[0])],
            (t, 3.0), state, method="DOP853", rtol=1e-13, atol=1e-13, events=[lower, upper],
        )  # fmt: skip
        t, state = run.t[-1], run.y[:, -1]
        if run.status == 1:
            crossings += 1
            k += 1 if run.t_events[1].size else -1
            state[0] = points[k + 1] if run.t_events[0].size else points[k]
    assert crossings >= 4
    assert abs(found["x"][-1] - state[0]) < 1e-9 and abs(found["der(x)"][-1] - state[1]) < 1e-9


PLATE = 'table(time, {0, 0.5, 1, 2}*1 s, {0, 0, 1, 0} m, "linear")'
"""Rises with 2 m/s from 0.5 s to 1 s, then sinks with 1 m/s."""


def test_a_plate_by_a_linear_table_throws() -> None:
    """Taken along from 0.5 s on, thrown at 1 s: 1 + 2 (0.3) - 5 (0.3)^2; it was passed over, and lay on the sinking plate."""
    text = f"coordinate Length y = 0 m; kinetic 1/2*1 kg*der(y)^2; potential 1 kg*10 m/s^2*y; contact c: y - {PLATE};"
    s = mechc.loads(text + "experiment(stop = 1.3 s);").simulate(estimate_error=False)
    assert s["y"][-1] == pytest.approx(1.15, rel=1e-12) and s["der(y)"][-1] == pytest.approx(-1, rel=1e-12)


def test_friction_on_a_belt_by_a_linear_table() -> None:
    """Against a belt of 0, 2 and -1 m/s: slows by 1 m/s^2, sticks at 2 m/s from 1 s... the same belt as choices of time."""
    text = "coordinate Length x = 0 m; initial der(x) = 2 m/s; kinetic 1/2*1 kg*der(x)^2; friction 1 N on x - ({});"
    chosen = (
        "if time < 0.5 s then 0 m elseif time < 1 s then 2 m/s*(time - 0.5 s) else 1 m - 1 m/s*(time - 1 s)"
    )
    told, ours = (
        mechc.loads(text.format(one) + "experiment(stop = 2 s);").simulate() for one in (chosen, PLATE)
    )
    assert ours.outcome.value == "completed", ours.message
    # by hand: 2 - t until 0.5 s, 1.5 + (t - 0.5) until 1 s, 2 - (t - 1) until the end
    assert ours["x"][-1] == pytest.approx(0.875 + 0.875 + 1.5, rel=1e-9)
    assert ours["x"][-1] == pytest.approx(told["x"][-1], rel=1e-12)


def test_the_corner_of_a_guide_by_a_linear_table_takes_energy() -> None:
    """Across a corner from slope 0 to -1 the momentum along the new line stays: x' = 1/3, and 1/3 J are dissipated."""
    text = """
        coordinate Length x = 0 m; coordinate Length y = 0 m; initial der(x) = 1 m/s;
        kinetic 1/2*1 kg*der(x)^2 + 1/2*2 kg*der(y)^2;
        constraint guide: y = table(x, {0, 0.5, 2} m, {0, 0, -1.5} m, "linear");
        experiment(stop = 1.5 s);
        """
    s = mechc.loads(text).simulate()
    assert s.outcome.value == "completed", s.message
    assert s["x"][-1] == pytest.approx(0.5 + 1 / 3, rel=1e-9)
    assert s["energy.dissipated"][-1] == pytest.approx(1 / 3, rel=1e-9)


def test_modules_without_events_have_linear_tables(tmp_path: Path) -> None:
    """As they stand, within steps; the motion is that of `mechc run`, to what unlocated kinks cost."""
    law = 'force table(x, {-1, 0, 0.5, 1} m, {3, -0.5, -1, -9} N, "linear", "hold") on x; experiment(stop = 2 s);'
    model = mechc.loads(SPRING + law)
    namespace: dict[str, Any] = {"__name__": "generated"}
    (path,) = model.compile("python", tmp_path / "made.py")
    exec(path.read_text(encoding="utf-8"), namespace)
    made, found = namespace["simulate"](stop=2.0), model.simulate()
    assert abs(made["x"][-1] - found["x"][-1]) < 1e-4
    mechc.loads(SPRING + law.replace("linear", "step")).compile("python", tmp_path / "switching.py")
    exec((tmp_path / "switching.py").read_text(encoding="utf-8"), namespace)
    with pytest.raises(RuntimeError, match="the model switches"):
        namespace["simulate"]()


def road_of(count: int) -> tuple[Floats, Floats]:
    """Return points of 6 s and heights: waves with random phases, up to 2 Hz."""
    rng = np.random.default_rng(5)
    at, k = np.linspace(0, 6, count), np.arange(1, 41)
    return at, np.sum(0.02 / k * np.sin(0.1 * np.pi * k * at[:, None] + rng.uniform(0, 6, k.size)), axis=1)


def wheel(kind: str, points: Floats, values: Floats, argument: str = "time") -> mechc.Model:
    """A mass on a road, by a spring and a damper."""
    return mechc.loads(f"""
        dimensionless;
        parameter v = 2;
        coordinate x = 0;
        initial der(x) = 0;
        kinetic 1/2*der(x)^2;
        let road = table({argument}, {listed(points)}, {listed(values)}, "{kind}");
        potential 1/2*2500*(x - road)^2;
        force -3*(der(x) - der(road)) on x;
        experiment(stop = 5.9, every = 0.1);
    """)


def restarted(curve: Callable[..., Any], knots: Floats, times: Floats, stop: float) -> Floats:
    """By SciPy, begun anew at every point of the road: places of the wheel at the times."""
    y, found = np.zeros(2), np.full(times.size, np.nan)
    for a, b in pairwise([0.0, *knots[(knots > 0) & (knots < stop)], stop]):
        inside = np.flatnonzero((times >= a) & (times <= b))
        run = solve_ivp(
            lambda t, y: [y[1], 2500 * (curve(t) - y[0]) + 3 * (curve(t, 1) - y[1])],
            (a, b), y, method="DOP853", rtol=1e-11, atol=1e-14, t_eval=np.union1d(times[inside], b),
        )  # fmt: skip
        found[inside] = run.y[0, : inside.size]
        y = run.y[:, -1]
    return found


@pytest.mark.parametrize(("count", "tolerance"), [(80, 1e-6), (80, 1e-9), (40, 1e-9)])
def test_steps_end_at_the_points_of_a_smooth_table_of_time(count: int, tolerance: float) -> None:
    """So it takes about as many as over a spline, with an error of some tolerances. Both a long table and a short one."""
    points, values = road_of(count)
    over, beside = (
        wheel(kind, points, values).simulate(tolerance=tolerance) for kind in ("smooth", "spline")
    )
    assert over.statistics.steps < 1.2 * beside.statistics.steps + count
    assert over.statistics.rejected is not None
    assert over.statistics.rejected < 0.2 * over.statistics.steps
    curve = PchipInterpolator(points, values)
    expected = restarted(curve, points, over.time, 5.9)
    assert np.max(np.abs(over["x"] - expected)) < 60 * tolerance * np.ptp(expected)


def test_points_of_a_table_of_a_distance_follow_the_speed() -> None:
    """The argument is a speed times the time, by a parameter that is set, and less a distance; the table repeats."""
    points, values = road_of(24)
    values[-1] = values[0]
    argument = "v*time - 1"
    model = wheel('smooth", "periodic', points, values, argument)
    found = model.simulate(set={"v": 1.5}, tolerance=1e-9)
    line = smooth_curve("smooth", "periodic", points, values)
    period = points[-1]

    def road(t: float, order: int = 0) -> float:
        return float(line((1.5 * t - 1) % period, order)) * 1.5**order

    knots = (np.concatenate([points[:-1] + period * k for k in (-1, 0, 1)]) + 1) / 1.5
    expected = restarted(road, knots, found.time, 5.9)
    assert np.max(np.abs(found["x"] - expected)) < 30e-9 * np.ptp(expected)
    assert found.statistics.rejected is not None
    assert found.statistics.rejected < 0.2 * found.statistics.steps


def test_a_dense_table_is_passed_over_where_the_error_allows() -> None:
    """Its points are closer than the steps that its bends allow at a loose tolerance."""
    points, values = road_of(3000)
    model = wheel("smooth", points, values)
    loose, tight = (model.simulate(tolerance=t) for t in (1e-6, 1e-9))
    assert loose.statistics.steps < 1000 and tight.statistics.steps > 2000
    assert np.max(np.abs(loose["x"] - tight["x"])) < 30 * 1e-6 * np.ptp(tight["x"])


def test_a_sawtooth_goes_on_and_its_jumps_are_located() -> None:
    """v' = the rest of t over 0.75: its integral is known."""
    text = 'dimensionless; state v = 0; equation der(v) = table(time, {0, 0.75}, {0, 0.75}, "linear", "periodic");'
    found = mechc.loads(f"{text} experiment(stop = 4, tolerance = 1e-12);").simulate()
    turns, rest = divmod(4.0, 0.75)
    assert abs(found["v"][-1] - (turns * 0.75**2 / 2 + rest**2 / 2)) < 1e-11


def test_potential_energies_keep_their_sum() -> None:
    """A mass in straight valleys: the energy stays, across kinks whose sides do not differ; a step takes speed."""
    valley = 'potential table(x, {-2, -1, 0, 1.5} m, {4, 1, 0, 3} J, "linear");'
    found = mechc.loads(SPRING + valley + "experiment(stop = 8 s, tolerance = 1e-12);").simulate()
    energy = found["der(x)"] ** 2 / 2 + expected(
        "linear", "extend", found["x"], np.array([-2, -1, 0, 1.5]), np.array([4.0, 1, 0, 3])
    )
    assert np.ptp(energy) < 1e-9
    stairs = 'potential table(x, {0, 1, 2} m, {0, 2, 3} J, "step");'
    found = mechc.loads(SPRING + stairs + "experiment(stop = 1.2 s);").simulate()
    assert abs(found["der(x)"][-1] - np.sqrt(9 - 2 * 3)) < 1e-9


def test_a_run_ends_where_a_table_does() -> None:
    table = 'dimensionless; state s = 0; equation der(s) = 1; output f = table(s, {0, 2}, {0, 1}, "linear", "error");'
    found = mechc.loads(f"{table} experiment(stop = 3);").simulate()
    assert "the argument of a table is between 0 and 2" in found.message
    assert found.time[-1] < 2.5


# ---------------------------------------------------------------- files


def road(folder: Path, text: str, call: str) -> mechc.Model:
    (folder / "road.csv").write_text(text, encoding="utf-8")
    (folder / "m.mech").write_text(
        "model Car\n  state Length s = 0 m;\n  equation der(s) = 2 m/s;\n"
        f"  output Length z = {call};\n  experiment(stop = 3 s);\nend Car;\n",
        encoding="utf-8",
    )
    return mechc.load(folder / "m.mech")


def test_a_column_of_a_file_is_a_table(tmp_path: Path) -> None:
    rows = [(0.0, 0.0, 1.0), (150.0, 12.5, 2.0), (400.0, -3.0, 3.0), (700.0, 2.0, 4.0)]
    text = "s [cm],z [mm],other [kg]\n" + "".join(f"{a},{b},{c}\n" for a, b, c in rows)
    points, values = np.array([r[0] for r in rows]) / 100, np.array([r[1] for r in rows]) / 1000
    for kind in KINDS:
        found = road(tmp_path, text, f'table(s, "road.csv", "z", "{kind}")').simulate()
        np.testing.assert_allclose(
            found["z"], expected(kind, "extend", found["s"], points, values), atol=1e-15
        )
    moved = road(tmp_path, text.replace("12.5", "22.5"), 'table(s, "road.csv", "z")').simulate()
    assert moved["z"].max() > 0.022, "another file is another model"


@pytest.mark.parametrize(
    ("text", "call", "code", "said"),
    [
        ("s [m],z [m]\n0,0\n1,1\n", 'table(s, "rood.csv", "z")', "E0823", "there is no file 'rood.csv'"),
        ("s [m],z [m]\n0,0\n1,1\n", 'table(s, "road.csv", "y")', "E0823", "has no column 'y'"),
        ("s [s],z [m]\n0,0\n1,1\n", 'table(s, "road.csv", "z")', "E0304", "which is in s"),
        ("s,z [m]\n0,0\n1,1\n", 'table(s, "road.csv", "z")', "E0304", "which has no unit"),
        ("s [m],z [kg]\n0,0\n1,1\n", 'table(s, "road.csv", "z")', "E0303", "a mass (kg)"),
        ("s [m],z [m]\n0,0\n2,1\n1,1\n", 'table(s, "road.csv", "z")', "E0311", "line 4"),
        ("s [m],z [m]\n0,0\n2,\n3,1\n", 'table(s, "road.csv", "z")', "E0823", "no value of 'z'"),
        ("s [m],z [m]\n0,0\n2,1\n", 'table(s, "road.csv", "z", "cubic")', "E0340", "no kind of table 'cubic'"),
        ("s [m],z [m]\n0,0\n2,1\n", 'table(s, "road.csv", "z", "hold")', "E0340", '"smooth", "hold"'),
        ("s [m],z [m]\n0,0\n2,1\n", 'table(s, "road.csv", "z", "smooth", "loop")', "E0340", "extend, hold"),
        ("s [m],z [m]\n0,0\n2,1\n", 'table(s, "road.csv", "z", "smooth", "periodic")', "E0340", "begins with"),
        ("s [m],z [m]\n0,0\n2,1\n", 'table(s, "road.csv")', "E0309", "3"),
    ],
)  # fmt: skip
def test_wrong_tables_are_refused(tmp_path: Path, text: str, call: str, code: str, said: str) -> None:
    with pytest.raises(mechc.CompileError) as error:
        road(tmp_path, text, call)
    assert code in str(error.value) and said in str(error.value), error.value


@pytest.mark.parametrize(
    ("call", "code", "said"),
    [
        ("table(s, 1, {0, 1}, {0, 1, 2}, {{0, 1}, {2, 3}})", "E0305", "2 rows of 3"),
        ("table(s, 1, {0, 1}, {1, 0}, {{0, 1}, {2, 3}})", "E0311", "increase"),
        ("table(s, {0, 1}, {0, 1}, 3)", "E0308", "a text"),
        ('table(s, {0, 1}, {0, 1}, "smooth", "periodic")', "E0340", "begins with"),
        ("table(s, {0, 1}, {0, 1}, {0, 1})", "E0308", "a text"),
    ],
)
def test_wrong_numbers_are_refused(call: str, code: str, said: str) -> None:
    with pytest.raises(mechc.CompileError) as error:
        along(f"output f = {call};")
    assert code in str(error.value) and said in str(error.value), error.value
