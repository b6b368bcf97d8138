"""Tyres against the curves of another program, a car against its linear theory, a road against its spectrum."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

import mechc

BUS = """
FNOMIN 3800 N, UNLOADED_RADIUS 0.376 m, PCX1 1.5587, PDX1 1.09, PDX2 -0.079328, PDX3 9.9376e-06, PEX1 0.27403, PEX2 0.10232, PEX3 0.074903,
PEX4 -0.00026944, PKX1 19.733, PKX2 0.093405, PKX3 0.12433, PHX1 -0.001779, PHX2 0.00021808, PVX1 -9.9052e-06, PVX2 -2.8568e-05,
RBX1 14.927, RBX2 -10.534, RCX1 1.1288, REX1 0.62334, REX2 -0.0039079, RHX1 0.001683, PTX1 1.9021, PTX2 -0.0014739, PTX3 0.03631,
PCY1 1.4675, PDY1 0.94002, PDY2 -0.17669, PDY3 -0.69602, PEY1 0.0040023, PEY2 0.00085719, PEY3 41.465, PEY4 665.25, PKY1 -12.536,
PKY2 1.3856, PKY3 -0.93342, PHY1 0.0024749, PHY2 0.0037538, PHY3 0.037561, PVY1 0.031255, PVY2 -0.0017359, PVY3 -0.38166, PVY4 -0.033117,
RBY1 5.5228, RBY2 2.7966, RBY3 0.08688, RCY1 1.0783, REY1 0.055543, REY2 -0.0022958, RHY1 -0.0027141, RHY2 -0.00098972, RVY1 0.0076305,
RVY2 -0.09933, RVY3 0.16991, RVY4 -9.6324e-05, RVY5 1.9, PTY1 1.8473, PTY2 1.9465, QBZ1 9.2824, QBZ2 -2.6095, QBZ3 -0.86548,
QBZ4 -0.16332, QBZ5 -0.35511, QBZ9 13.946, QCZ1 1.1119, QDZ1 0.14332, QDZ2 -0.0062385, QDZ3 -0.43424, QDZ4 -8.1598, QDZ6 -0.0073867,
QDZ7 0.0016767, QDZ8 -0.17212, QDZ9 -0.033444, QEZ1 -2.9203, QEZ2 -0.91079, QEZ4 0.32935, QEZ5 -1.9083, QHZ1 0.0019422, QHZ2 0.0034645,
QHZ3 0.14727, QHZ4 -0.035133, SSZ1 0.026243, SSZ2 -0.013391, SSZ3 0.3923, SSZ4 -0.16022
"""
"""A tyre 185/80 R14 as published with Project Chrono (BSD licence), VW_microbus/json/mf_185_80R14.tir."""

CURVES = [
    (0, 0.05, 0, 3800, -102.9578094, -1983.153886, 78.68371924),
    (0, -0.12, 0, 6000, -106.2296517, 4164.791533, -186.7026749),
    (0, 0.02, 0.05, 2000, -65.72561266, -692.9025267, 5.375360654),
    (0.05, 0, 0, 3800, 2911.700049, 6.663534651, 21.57724832),
    (-0.15, 0, 0, 5000, -5323.854312, -15.20114805, -55.53891418),
    (0.04, 0.06, 0, 3800, 1844.667944, -2218.947181, 79.59323308),
    (-0.1, -0.08, 0.03, 4500, -3556.919468, 2600.788895, -64.77569592),
    (0.3, 0.2, -0.04, 3000, 2260.978853, -1336.770688, 6.187463991),
]
"""Slip, side slip, camber, load; Fx, Fy, Mz of Chrono's ChPac02Tire::CalcFxyMz with Pacejka's weighting, compiled apart, without its 0.1 N in denominators
and its bounds of slopes, and with the sign of PDY3 and of the slip of the trail as Pacejka (2006) and MFeval have them."""


CAR_TYRE = """
UNLOADED_RADIUS 0.3943 m, NOMPRES 260000 Pa, FNOMIN 6752 N, PFZ1 0.88241, LONGITUDINAL_STIFFNESS 391219.8116 N/m, LATERAL_STIFFNESS
189871.776 N/m, PCFX1 0.14171, PCFX2 -0.16104, PCFX3 0.21776, PCFY1 -0.2334, PCFY2 0.068881, PCFY3 0.69715, PCX1 1.5482, PDX1 1.1632, PDX2
-0.11154, PDX3 0.94173, PEX1 0.27, PEX2 0.011693, PEX3 0.053303, PEX4 0.59223, PKX1 32.9102, PKX2 12.7911, PKX3 -0.11254, PHX1 -0.0017527,
PHX2 0.00068824, PVX1 0.068079, PVX2 0.0023429, PPX1 -0.8733, PPX2 0.7035, PPX3 -0.0080216, PPX4 -0.47776, RBX1 18.3369, RBX2 18.2559, RBX3
607.8133, RCX1 0.96372, REX1 -1.2699, REX2 -0.14323, RHX1 0.0037359, QSX1 0.00062469, QSX2 -9.9089, QSX3 1.621, QSX4 11.4346, QSX5 -0.22968,
QSX6 1.3749, QSX7 -0.90713, QSX8 4.5166, QSX9 -0.033238, QSX10 0.73734, QSX11 -1.7614, PPMX1 -0.032723, PCY1 1.4759, PDY1 1.0085, PDY2
-0.1323, PDY3 2.4957, PEY1 -0.34653, PEY2 -0.60297, PEY3 -0.084051, PEY4 -20.7741, PEY5 57.615, PKY1 -28.3155, PKY2 3.313, PKY3 -0.21509,
PKY4 2.7364, PKY5 49.8685, PKY6 -1.001, PKY7 0.17458, PHY1 0.0016662, PHY2 0.00081921, PVY1 0.022144, PVY2 0.0073185, PVY3 -0.47424, PVY4
-0.2317, PPY1 0.34039, PPY2 1.1056, PPY3 0.098508, PPY4 -0.10018, PPY5 -0.81071, RBY1 25.972, RBY2 -16.0345, RBY3 -0.012821, RBY4 1747.3832,
RCY1 0.93848, REY1 0.47225, REY2 0.089042, RHY1 -0.0062355, RHY2 0.0044985, RVY1 0.013748, RVY2 0.012074, RVY3 0.47896, RVY4 -97.0538, RVY5
-1.7992, RVY6 -27.5155, QSY1 0.01, QSY3 0.0004, QSY4 4e-05, QSY7 0.85, QSY8 -0.4, QBZ1 12.5909, QBZ2 -0.90176, QBZ3 -0.60231, QBZ4 -1.2812,
QBZ5 3.1497, QBZ9 176.0292, QBZ10 17.3439, QCZ1 1.1676, QDZ1 0.084112, QDZ2 0.0024576, QDZ3 -1.0046, QDZ4 9.1761, QDZ6 0.0020533, QDZ7
0.0020396, QDZ8 -0.34545, QDZ9 0.52144, QDZ10 1.0329, QDZ11 -4.3212, QEZ1 -3.4668, QEZ2 -1.6919, QEZ3 1.4023, QEZ4 0.37768, QEZ5 -8.9305,
QHZ1 0.0023613, QHZ2 0.0019525, QHZ3 0.28223, QHZ4 -0.22141, PPZ1 0.94372, PPZ2 0.5053
"""
"""A tyre 255/50 R16 of FITTYP 62 as published with MFeval, MagicFormula62_Parameters.tir (M. Furlan, BSD licence)."""

CURVES62 = [
    (0, 0.05, 0, 6752, 260000.0, 45.96864479, -5353.919628, 111.2970774, 82.58921909),
    (0, -0.12, 0, 9000, 260000.0, 41.8401902, 8901.25334, -53.54523463, -44.79574935),
    (0, 0.02, 0.05, 4000, 260000.0, 29.62809879, -1874.871186, 17.36853293, -40.05032355),
    (0.05, 0, 0, 6752, 260000.0, 7471.078083, 33.03736088, 1.032238638, 1.107627691),
    (-0.15, 0, 0, 8000, 260000.0, -8403.142952, -124.2739833, -0.06030362741, 3.693690936),
    (0.04, 0.06, 0, 6752, 260000.0, 4543.803962, -5230.766648, 37.98633657, 81.13132811),
    (-0.1, -0.08, 0.03, 7500, 260000.0, -6449.274513, 4149.546327, 13.41151321, -131.2463905),
    (0.03, 0.1, -0.04, 5000, 260000.0, 1600.027962, -4778.715931, 8.154069917, 158.8331477),
    (0.02, 0.03, 0.02, 6000, 310000.0, 2733.280092, -3163.523676, 46.7701155, 11.14603732),
    (-0.03, -0.06, -0.06, 8500, 210000.0, -4579.264892, 6349.165791, -60.01307435, 93.07414992),
]
"""Slip, side slip, camber, load, pressure; Fx, Fy, Mz, Mx of MFeval.jl (MIT licence), without limits, apart, and without its 1e-6 in denominators."""


def named(text: str) -> str:
    return ", ".join(" = ".join(row.split(" ", 1)) for row in text.replace("\n", " ").strip().split(", "))


def bus() -> str:
    return named(BUS)


def run(text: str, stop: float = 1.0, space: str = "planar", **given: Any) -> mechc.Solution:
    whole = (
        f"import mech.{space}.*;\nimport mech.vehicle.*;\nimport mech.tyres.*;\nimport mech.rails.*;\nmodel M\n{text}\n"
        f"  experiment(stop = {stop} s, tolerance = 1e-10);\nend M;\n"
    )
    solution = mechc.loads(whole).simulate(**given)
    assert solution.outcome.value == "completed", solution.message
    return solution


def test_a_tyre_has_the_curves_of_another_program() -> None:
    """Pure and combined slip, with camber, at several loads: to all ten digits that were printed."""
    parts = "".join(
        f"TyreCurves t{i}(kappa = {k}, alpha = {a} rad, gamma = {g} rad, Fz = {N} N, {bus()});\n"
        for i, (k, a, g, N, *_) in enumerate(CURVES)
    )
    s = run(parts, 0.0, estimate_error=False)
    for i, (*_, Fx, Fy, Mz) in enumerate(CURVES):
        found = [float(s[f"t{i}.{name}"][0]) for name in ("Fx", "Fy", "Mz")]
        assert found == pytest.approx([Fx, Fy, Mz], rel=2e-9), CURVES[i]


def test_a_tyre_of_version_62_has_the_curves_of_another_program() -> None:
    """Pure and combined slip, camber, load and inflation pressure: to all ten digits that were printed."""
    given = named(CAR_TYRE)
    parts = "".join(
        f"TyreCurves62 t{i}(kappa = {k}, alpha = {a} rad, gamma = {g} rad, Fz = {N} N, INFLPRES = {p} Pa, {given});\n"
        for i, (k, a, g, N, p, *_) in enumerate(CURVES62)
    )
    s = run(parts, 0.0, estimate_error=False)
    for i, (*_, Fx, Fy, Mz, Mx) in enumerate(CURVES62):
        found = [float(s[f"t{i}.{name}"][0]) for name in ("Fx", "Fy", "Mz", "Mx")]
        assert found == pytest.approx([Fx, Fy, Mz, Mx], rel=2e-9), CURVES62[i]


CAR = """
  parameter m = 1500 kg; parameter a = {a} m; parameter b = {b} m; parameter V = {V!r} m/s; parameter steer = 0 rad;
  Body car(m = m, J = 2600 kg.m^2);
  Planar pose(world -> car.a, x = 0 m, y = 0 m, angle = 0 rad, der(x) = V);
  let weight = m*9.81 m/s^2;
  Axle front(to = car.a * trans({{a, 0 m}}) * rot({steer}), load = weight*{front}/2, mu = 1.05, fall = 0.08, B = 9.5, C = 1.35, E = -0.6);
  Axle rear(to = car.a * trans({{-b, 0 m}}), load = weight*{rear}/2, mu = 1.05, fall = 0.08, B = 9.5, C = 1.35, E = -0.6,
            drive = 5000 N.s/m*(V - components(car.a, vel(car.a))[1]));
"""


def car(
    V: float,
    a: float = 1.15,
    b: float = 1.55,
    shares: tuple[float, float] | None = None,
    steer: str = "steer",
) -> str:
    front, rear = shares or (b / (a + b), a / (a + b))
    return CAR.format(V=V, a=a, b=b, front=front, rear=rear, steer=steer)


def stiffness(load: float) -> float:
    """Return the cornering stiffness of an axle with two wheels of a load."""
    return 2 * load * 1.05 * (1 - 0.08 * (load / 4000 - 1)) * 1.35 * 9.5


def bicycle(V: float, a: float, b: float, front: float, rear: float) -> np.ndarray:
    """Return the matrix of side speed and yaw rate."""
    Cf, Cr = stiffness(1500 * 9.81 * front / 2), stiffness(1500 * 9.81 * rear / 2)
    return np.array(
        [
            [-(Cf + Cr) / (1500 * V), -(a * Cf - b * Cr) / (1500 * V) - V],
            [-(a * Cf - b * Cr) / (2600 * V), -(a**2 * Cf + b**2 * Cr) / (2600 * V)],
        ]
    )


def poles(text: str) -> np.ndarray:
    whole = f"import mech.planar.*;\nimport mech.vehicle.*;\nimport mech.rails.*;\nmodel M\n{text}\n  experiment(stop = 1 s);\nend M;\n"
    return np.array([complex(*pole) for pole in mechc.loads(whole).linearize().details["poles"]])


def test_a_car_has_the_poles_of_the_bicycle_model() -> None:
    L = 2.7
    expected = np.linalg.eigvals(bicycle(25, 1.15, 1.55, 1.55 / L, 1.15 / L))
    found = poles(car(25.0))
    for pole in expected:
        assert np.abs(found - pole).min() < 1e-9


def test_axles_of_the_linear_theory() -> None:
    """The poles of the bicycle model, and at any slip C times its angle: a sledge that is let go sideways turns its momentum by that force."""
    Cf, Cr = stiffness(1500 * 9.81 * 1.55 / 2.7 / 2), stiffness(1500 * 9.81 * 1.15 / 2.7 / 2)
    found = poles(f"""
  Body car(m = 1500 kg, J = 2600 kg.m^2);
  Planar pose(world -> car.a, x = 0 m, y = 0 m, angle = 0 rad, der(x) = 25 m/s);
  LinearAxle front(to = car.a * trans({{1.15 m, 0 m}}), C = {Cf!r} N/rad);
  LinearAxle rear(to = car.a * trans({{-1.55 m, 0 m}}), C = {Cr!r} N/rad);
""")
    for pole in np.linalg.eigvals(bicycle(25, 1.15, 1.55, 1.55 / 2.7, 1.15 / 2.7)):
        assert np.abs(found - pole).min() < 1e-9
    s = run(
        "Particle p(m = 2 kg); Translation slide(world -> p.a, der(position) = {1, 1.5} m/s); LinearAxle axle(to = p.a, C = 3 N/rad, drive = 0.5 N); initial slide.position = {0, 0} m;",
        2.0,
    )
    found = solve_ivp(
        lambda t, v: [0.25, -1.5 * math.atan(v[1] / v[0])], (0, 2), [1, 1.5], "DOP853", rtol=1e-11, atol=1e-12
    ).y[:, -1]
    assert [s[f"der(slide.position[{k}])"][-1] for k in (1, 2)] == pytest.approx(found, rel=1e-8)


def test_a_car_that_oversteers_has_its_critical_speed() -> None:
    """V^2 = Cf Cr L^2/(m (a Cf - b Cr)): below it straight running is stable, above it not."""
    L, front, rear = 2.7, 0.45, 0.55
    Cf, Cr = stiffness(1500 * 9.81 * front / 2), stiffness(1500 * 9.81 * rear / 2)
    a, b = 1.5, 1.2  # the load is as if the mass were elsewhere: stiff in front
    V = math.sqrt(Cf * Cr * L**2 / (1500 * (a * Cf - b * Cr)))
    largest = []
    for speed in (0.999 * V, 1.001 * V):
        real = poles(car(speed, a, b, (front, rear))).real
        largest.append(real[np.abs(real) > 1e-9].max())  # x, y and the heading are free: three poles are zero
    assert largest[0] < 0 < largest[1]


def test_a_steady_turn_shows_the_understeer_gradient() -> None:
    """steer = L/R + K a, K = m (b/Cf - a/Cr)/L, for small angles."""
    s = run(car(30.0).replace("steer = 0 rad", "steer = 0.001 rad") + "output r = der(pose.angle);", 5.0)
    Cf, Cr = stiffness(1500 * 9.81 * 1.55 / 2.7 / 2), stiffness(1500 * 9.81 * 1.15 / 2.7 / 2)
    K = 1500 * (1.55 / Cf - 1.15 / Cr) / 2.7
    # slips of 0.03: cubes are 1e-3, curves bend by a tenth of that
    assert s["r"][-1] == pytest.approx(0.001 * 30 / (2.7 + K * 30**2), rel=1e-4)


def test_a_driver_changes_the_lane() -> None:
    lane = "if driver.ahead < 50 m then 0 m elseif driver.ahead < 110 m then (3.5 m)*(1 - cos(pi*(driver.ahead - 50 m)/60 m))/2 else 3.5 m"
    s = run(car(20.0, steer="driver.steer") + f"Driver driver(to = car.a, lane = {lane});", 12.0)
    assert s["pose.y"][-1] == pytest.approx(3.5, abs=0.01)
    assert s["pose.y"].max() < 3.9 and np.abs(s["front.alpha"]).max() < 0.1


def test_a_road_has_its_spectrum() -> None:
    """Its variance is the integral of the density; heights differ by seeds, and are the same again."""
    s = run(
        "output z = random_road((20 m/s)*time, 64, 3); output other = random_road((20 m/s)*time, 64, 4);",
        100.0,
        estimate_error=False,
    )
    variance = 64e-6 * 0.01 * (1 / 0.011 - 1 / 2.83)
    for name in ("z", "other"):
        assert np.mean(s[name] ** 2) == pytest.approx(variance, rel=0.15)  # 22 waves of the longest
    assert np.abs(np.corrcoef(s["z"], s["other"])[0, 1]) < 0.6


WHEEL = """gravity {{0, 0, -9.81}} m/s^2; frame hub;
  Body wheel(m = 387.4 kg, J = diag({{1, 2, 1}} kg.m^2));
  {guide}
  Revolute axle(hub -> wheel.a, axis = {{0, 1, 0}}{spin});
  Tyre tyre(world -> wheel.a, VERTICAL_STIFFNESS = 1.75e5 N/m, VERTICAL_DAMPING = 8000 N.s/m, QSY1 = 0, {bus});
"""


def wheel(guide: str, spin: str = "") -> str:
    return WHEEL.format(guide=guide, spin=spin, bus=bus())


def test_a_wheel_that_is_pulled_askew() -> None:
    """At 0.05 rad of side slip its force rises as 1 - exp(-x/sigma) while it is small, and becomes that of TyreCurves."""
    guide = "coordinate Length s; drive s = (10 m/s)*time; coordinate Length z ~ 0.35429 m; initial z = 0.3542827 m; place hub = world * trans({s*cos(0.05 rad), s*sin(0.05 rad), z});"
    rolling = 10 * math.cos(0.05) / 0.376
    s = run(
        wheel(guide, f", der(angle) = {rolling!r} rad/s")
        + f"TyreCurves rig(kappa = tyre.kappa, alpha = tyre.alpha, Fz = tyre.Fz, {bus()}); output sy = tyre.sy; output alpha = tyre.alpha;",
        1.0,
        "spatial",
    )
    sigma = s["sy"][0]
    x = 10 * math.cos(0.05) * s.time
    expected = np.arctan(math.tan(0.05) * (1 - np.exp(-x / sigma)))
    # the load, and sigma with it, settles by 0.1 %
    assert s["alpha"][:200] == pytest.approx(expected[:200], rel=2e-3)
    assert s["alpha"][-1] == pytest.approx(0.05, rel=1e-6)
    assert s["tyre.Fy"] == pytest.approx(s["rig.Fy"], rel=1e-9)


def test_a_wheel_of_version_62_that_is_pulled_askew() -> None:
    """Its relaxation length is the cornering stiffness over that of the carcass; with more pressure in it the wheel stands higher."""
    N, F0, dp = 387.4 * 9.81, 6752.0, 3e5 / 2.6e5 - 1
    z0 = 0.3943 - N / (314931.2969 * (1 + 0.88241 * dp))
    guide = f"coordinate Length s; drive s = (10 m/s)*time; coordinate Length z ~ {z0!r} m; initial z = {z0!r} m; place hub = world * trans({{s*cos(0.05 rad), s*sin(0.05 rad), z}});"
    rolling = 10 * math.cos(0.05) / 0.3943
    tyre = f"Tyre62 tyre(world -> wheel.a, VERTICAL_STIFFNESS = 314931.2969 N/m, VERTICAL_DAMPING = 8000 N.s/m, QSY1 = 0, INFLPRES = 3e5 Pa, {named(CAR_TYRE.replace('QSY1 0.01, ', ''))});"
    text = re.sub(
        r"Tyre tyre\(.*?\);",
        tyre.replace("\\", ""),
        wheel(guide, f", der(angle) = {rolling!r} rad/s"),
        flags=re.DOTALL,
    )
    given = named(CAR_TYRE)
    s = run(
        text
        + f"TyreCurves62 rig(kappa = tyre.kappa, alpha = tyre.alpha, Fz = tyre.Fz, INFLPRES = 3e5 Pa, {given});"
        + " output sy = tyre.sy; output alpha = tyre.alpha; output z_ = z; output Ky = tyre.Ky;",
        1.0,
        "spatial",
    )
    df = N / F0 - 1
    stiff = (
        28.3155 * F0 * (1 + 0.34039 * dp) * math.sin(2.7364 * math.atan(N / F0 / (3.313 * (1 + 1.1056 * dp))))
    )
    carcass = 189871.776 * (1 - 0.2334 * df + 0.068881 * df**2) * (1 + 0.69715 * dp)
    assert s["sy"][-1] == pytest.approx(stiff / carcass, rel=1e-4)
    assert s["z_"][-1] == pytest.approx(z0, abs=1e-5)
    x = 10 * math.cos(0.05) * s.time
    expected = np.arctan(math.tan(0.05) * (1 - np.exp(-x / s["sy"][-1])))
    assert s["alpha"][:200] == pytest.approx(expected[:200], rel=2e-3) and s["alpha"][-1] == pytest.approx(
        0.05, rel=1e-6
    )
    assert s["tyre.Fy"] == pytest.approx(s["rig.Fy"], rel=1e-9)


def test_a_wheel_at_rest_holds_on_a_slope() -> None:
    """Its brake is on: the tread bends by as much as carries the weight, and it stays; it does not creep."""
    guide = "Translation free(world -> hub, position = {0, 0, 0.3542827} m);"
    s = run(
        wheel(guide)
        .replace("{0, 0, -9.81} m/s^2", "{-1, 0, -9.81} m/s^2")
        .replace("Revolute axle(", "Weld axle(")
        .replace(", axis = {0, 1, 0}", ""),
        12.0,
        "spatial",
    )
    assert s["tyre.Fx"][-1] == pytest.approx(387.4, rel=1e-4)
    assert abs(s["free.position[1]"][-1]) < 0.01
    assert np.abs(s["der(free.position[1])"][-50:]).max() < 1e-5


def test_a_wheel_that_hops_and_lands() -> None:
    """Dropped from 5 cm it lifts off and comes back; in the air no force acts, and the flight is a parabola."""
    guide = "Translation free(world -> hub, position = {0, 0, 0.426} m, der(position) = {10, 0, 0} m/s);"
    s = run(wheel(guide, ", der(angle) = 26 rad/s").replace("= 8000 N.s/m", "= 500 N.s/m"), 1.0, "spatial")
    fly = s["tyre.Fz"] == 0
    assert fly[0] and not fly.all() and (np.diff(fly.astype(int)) == 1).any()
    assert (s["tyre.Fx"][fly] == 0).all() and (s["tyre.Fy"][fly] == 0).all()
    assert s["free.position[3]"][-1] > 0.3


@pytest.mark.parametrize(("spin", "height"), [(60.0, 0.6), (20 / 0.3, 0.6), (40.0, 3.0), (0.0, 0.6)])
def test_a_wheel_flies_until_it_lands(spin: float, height: float) -> None:
    """No force of the tyre acts in the air, however it spins; runs ended where its forces of rounding changed their sign."""
    text = f"""
        import mech.spatial.*; import mech.tyres.*;
        gravity {{0, 0, -9.81}} m/s^2; frame slide; frame hub;
        Body rim(m = 20 kg, J = diag({{0.6, 1.1, 0.6}}) kg.m^2);
        Prismatic fwd(world -> slide, axis = {{1, 0, 0}}, der(position) = 20 m/s);
        Prismatic up(slide -> hub, axis = {{0, 0, 1}}, position = {height} m);
        Revolute axle(hub -> rim.a, axis = {{0, 1, 0}}, der(angle) = {spin!r} rad/s);
        Tyre tyre(world -> rim.a);
        experiment(stop = 1 s);
        """
    s = mechc.loads(text).simulate()
    assert s.outcome.value == "completed", s.message
    flying = s.time < math.sqrt(2 * (height - 0.3) / 9.81)
    assert s["up.position"][flying] == pytest.approx(height - 9.81 / 2 * s.time[flying] ** 2, abs=1e-9)
    assert s["der(axle.angle)"][flying] == pytest.approx(spin, abs=1e-9)


def test_a_locked_wheel_slides_to_a_stop() -> None:
    """From 10 m/s with its friction at full slip; then it rests on its bent tread."""
    guide = "Translation free(world -> hub, position = {0, 0, 0.3542827} m, der(position) = {10, 0, 0} m/s);"
    text = wheel(guide).replace("Revolute axle(", "Weld axle(").replace(", axis = {0, 1, 0}", "")
    s = run(text, 4.0, "spatial")
    force = -float(
        run(f"TyreCurves t(kappa = -1, Fz = 3800.394 N, {bus()});", 0.0, estimate_error=False)["t.Fx"][0]
    )
    assert abs(s["der(free.position[1])"][-1]) < 1e-3
    # between the way with the friction of full slip and that with the largest one, through which the slip builds up
    assert 0.9 * 387.4 * 50 / force < s["free.position[1]"][-1] < 387.4 * 50 / force


def test_a_wheelset_hunts() -> None:
    """At low speed with the wave of Klingel, V sqrt(conicity/(r0 b)); with mass, the eigenvalues of its four equations."""
    text = "coordinate Length y = 0 m; coordinate Angle p = 0 rad; kinetic 1/2*1200 kg*der(y)^2 + 1/2*700 kg.m^2*der(p)^2; RailWheelset w(y = y, yaw = p, V = {} m/s); potential 1/2*1e5 N/m*y^2*{};"
    slow = poles(text.format(0.5, 0))
    klingel = 0.5 * math.sqrt(0.05 / (0.46 * 0.75))
    assert slow[slow.imag > 0].imag == pytest.approx(klingel, rel=1e-4)
    for V in (20.0, 80.0):
        k, f, b = 1e5, 7e6, 0.75
        A = np.array(
            [
                [0, 0, 1, 0],
                [0, 0, 0, 1],
                [-k / 1200, 2 * f / 1200, -2 * f / V / 1200, 0],
                [-2 * b * f * 0.05 / 0.46 / 700, 0, 0, -2 * b * b * f / V / 700],
            ]
        )
        found, expected = np.sort_complex(poles(text.format(V, 1))), np.sort_complex(np.linalg.eigvals(A))
        assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


def test_a_wheel_that_slips_in_all_directions() -> None:
    """A spinning wheel pushed sideways: SciPy with the friction curve by its values and slopes at its ends; momentum and spin."""
    peak, rest, near, far, load, r, m, J = 0.9, 0.5, 0.4, 1.5, 30.0, 0.2, 2.0, 0.05
    rise = CubicHermiteSpline([0, near], [0, peak], [1.5 * peak / near, 0])
    fall = CubicHermiteSpline([near, far], [peak, rest], [0, 0])

    def right(t: float, y: np.ndarray) -> list[float]:
        vx, vy, spin = y
        sx, sy = vx - r * spin, vy
        slip = math.hypot(sx, sy)
        mu = rise(slip) if slip < near else fall(slip) if slip < far else rest
        f = load * mu / slip
        return [-f * sx / m, -f * sy / m, r * f * sx / J]

    found = solve_ivp(right, (0, 0.4), [1.0, 1.2, 12.0], "DOP853", rtol=1e-11, atol=1e-12, max_step=1e-3)
    s = run(
        f"Particle hub(m = {m} kg); Translation t(world -> hub.a, position = {{0, 0}} m, der(position) = {{1, 1.2}} m/s); coordinate Angle q = 0 rad; initial der(q) = 12 rad/s; kinetic 1/2*({J} kg.m^2)*der(q)^2;"
        f"SlippingWheel w(to = hub.a, roll = q, load = {load} N, r = {r} m, peak = {peak}, rest = {rest}, adhesion = {near} m/s, sliding = {far} m/s);",
        0.4,
    )
    for name, value in zip(("der(t.position[1])", "der(t.position[2])", "der(q)"), found.y[:, -1], strict=True):  # fmt: skip
        assert s[name][-1] == pytest.approx(value, abs=1e-8)


def test_a_wheelset_rolls_in_a_circle() -> None:
    """Two wheels 0.5 m apart whose rolls differ: the axle turns with (v2 - v1)/0.5 m and its middle runs around."""
    s = run(
        "Body axle(m = 1 kg, J = 0.1 kg.m^2); Planar free(world -> axle.a, x = 0 m, y = 0 m, angle = 0 rad); coordinate Angle p = 0 rad; coordinate Angle q = 0 rad; initial der(p) = 8 rad/s; initial der(q) = 12 rad/s; kinetic 1/2*(0.01 kg.m^2)*(der(p)^2 + der(q)^2);"
        "RollingWheel one(to = axle.a * trans({0, 0.25} m), roll = p, r = 0.1 m); RollingWheel two(to = axle.a * trans({0, -0.25} m), roll = q, r = 0.1 m, holds = false);",
        2.0,
    )
    turn = 0.8 * s.time
    assert s["free.angle"] == pytest.approx(turn, abs=1e-9)
    assert s["free.x"] == pytest.approx(1 / 0.8 * np.sin(turn), abs=1e-9)
    assert s["free.y"] == pytest.approx(1 / 0.8 * (1 - np.cos(turn)), abs=1e-9)
    assert s["one.side"] == pytest.approx(0.8, abs=1e-8)


def test_a_car_coasts_to_rest() -> None:
    """m v' = -a v^2 - b: v = sqrt(b/a) tan(phi - sqrt(a b) t/m), and it stands on the hill that its rolling resistance holds."""
    s = run("coordinate Length s = 0 m; initial der(s) = 20 m/s; RoadVehicle car(s = s, m = 1200 kg, CdA = 0.8 m^2, cr = 0.05, slope = 0.02 rad);", 60.0)  # fmt: skip
    a, weight = 0.5 * 1.2 * 0.8, 1200 * 9.80665
    b = weight * (0.05 * math.cos(0.02) + math.sin(0.02))
    (stands,) = [e.time for e in s.events if e.kind == "stick"]
    phi = math.atan(20 / math.sqrt(b / a))
    assert stands == pytest.approx(1200 / math.sqrt(a * b) * phi, rel=1e-9)
    t = 10.0
    assert s(t)["der(s)"] == pytest.approx(math.sqrt(b / a) * math.tan(phi - math.sqrt(a * b) * t / 1200), rel=1e-8)  # fmt: skip
    assert s["car.rest"][-1] == pytest.approx(weight * math.sin(0.02), rel=1e-9)
