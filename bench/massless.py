"""Coordinates without mass: one evaluation of the rates beside the same model solved by hand, or with a mass too small to be seen.

Processor times, medians of both in turn, at states within 1 % of the start. What iterates by hand is C with Newton's method from the
same guess until a step is 1e-9 of the unknown.
"""

from __future__ import annotations

import ctypes
import tempfile
from pathlib import Path

import numpy as np

import mechc
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import load_functions
from mechc.runtime.native.build import build_shared, model_flags
from mechc.runtime.native.kernel import kernel_sources

from .generated import Contestant, _Task, caller, measured
from .machine import table, write
from .tables import contestant

STATES = 1024
GOAL = 1.2

SERIES = (
    """model Series
  dimensionless;
  structural parameter Integer n = {n};
  parameter k = 3; parameter m = 2;
  coordinate x = 1; coordinate node[n - 1] ~ 0;
  kinetic m/2*der(x)^2;
  potential k/2*node[1]^2 + sum(k*(1 + i/n)/2*(node[i] - node[i - 1])^2 for i in 2:n - 1) + k*2/2*(x - node[n - 1])^2;
  experiment(stop = 1);
end Series;""",
    """model Series
  dimensionless;
  structural parameter Integer n = {n};
  parameter k = 3; parameter m = 2;
  parameter whole = 1/(1/k + sum(1/(k*(1 + i/n)) for i in 2:n - 1) + 1/(2*k));
  coordinate x = 1;
  kinetic m/2*der(x)^2;
  potential whole/2*x^2;
  experiment(stop = 1);
end Series;""",
)
MAXWELL = (
    """model Maxwell
  dimensionless;
  parameter k = 3; parameter c = 0.7; parameter m = 2;
  coordinate x = 1; coordinate s[{n}] = {{0 for i in 1:{n}}};
  kinetic m/2*der(x)^2;
  potential sum(k*i/2*(x - s[i])^2 for i in 1:{n});
  for i in 1:{n} loop damping c/i on s[i]; end for;
  experiment(stop = 1);
end Maxwell;""",
    """model Maxwell
  dimensionless;
  parameter k = 3; parameter c = 0.7; parameter m = 2;
  coordinate x = 1; state s[{n}] = {{0 for i in 1:{n}}};
  kinetic m/2*der(x)^2;
  equation der(s) = {{k*i*(x - s[i])/(c/i) for i in 1:{n}}};
  force -sum(k*i*(x - s[i]) for i in 1:{n}) on x;
  experiment(stop = 1);
end Maxwell;""",
)
MUSCLE = (
    """model Muscle
  dimensionless;
  parameter m = 2; parameter k = 40; parameter c = 3; parameter a = 5;
  coordinate x = 1; coordinate fibre = 0.5;
  kinetic m/2*der(x)^2;
  potential k/3*(x - fibre)^3;
  damping c on fibre;
  force -a*exp(-(fibre - 0.5)^2/0.2) on fibre;
  experiment(stop = 1);
end Muscle;""",
    """model Muscle
  dimensionless;
  parameter m = 2; parameter k = 40; parameter c = 3; parameter a = 5;
  coordinate x = 1; state fibre = 0.5;
  kinetic m/2*der(x)^2;
  let tendon = k*(x - fibre)^2;
  equation der(fibre) = (tendon - a*exp(-(fibre - 0.5)^2/0.2))/c;
  force -tendon on x;
  experiment(stop = 1);
end Muscle;""",
)
CUBIC = (
    """model Cubic
  dimensionless;
  parameter m = 2; parameter k = 3; parameter k3 = 1; parameter c = 2;
  coordinate x = 1; coordinate node ~ 0.4;
  kinetic m/2*der(x)^2;
  potential k/2*node^2 + k3/4*node^4 + c/2*(x - node)^2;
  experiment(stop = 1);
end Cubic;""",
    """model Cubic
  dimensionless;
  parameter m = 2; parameter k = 3; parameter k3 = 1; parameter c = 2;
  coordinate x = 1;
  kinetic m/2*der(x)^2;
  let p = (k + c)/k3; let q = -c*x/k3; let d = sqrt(q^2/4 + p^3/27);
  let node = (d - q/2)^(1/3) - (d + q/2)^(1/3);
  force -c*(x - node) on x;
  experiment(stop = 1);
end Cubic;""",
)
_CRANK = """import mech.planar.*;
model Crank
  gravity {{0, -9.81}} m/s^2;
  Bar rod(m = MASS, l = 0.3 m);
  Body crank(m = 0 kg, J = 0.02 kg.m^2);
  Particle slider(m = 2 kg);
  Revolute main(world -> crank.a, angle = 0.3 rad, der(angle) = 9 rad/s);
  Revolute pin(crank.a * trans({{0.1 m, 0 m}}) -> rod.a, angle ~ -0.4 rad);
  Prismatic guide(world -> slider.a, position ~ 0.39 m);
  Revolute wrist(rod.b -> slider.a);
  experiment(stop = 1 s);
end Crank;"""
CRANK = tuple(_CRANK.replace("MASS", mass) for mass in ("0 kg", "1e-9 kg"))
_FOUR_BAR = """import mech.planar.*;
model FourBar
  Bar crank(m = 1 kg, l = 0.2 m);
  Bar coupler(m = MASS, l = 0.5 m);
  Bar rocker(m = MASS, l = 0.4 m);
  Revolute a(world -> crank.a, angle = 60 deg, der(angle) = 3 rad/s);
  Revolute b(crank.b -> coupler.a, angle ~ -30 deg);
  Revolute c(world * trans({{0.5 m, 0 m}}) -> rocker.a, angle ~ 100 deg);
  Revolute d(coupler.b -> rocker.b);
  potential 1/2*(5 N.m/rad)*c.angle^2;
  experiment(stop = 1 s);
end FourBar;"""
FOUR_BAR = tuple(_FOUR_BAR.replace("MASS", mass) for mass in ("0 kg", "1e-9 kg"))
IMPLICIT = """model Implicit
  dimensionless;
  parameter F = 1000; parameter a = 0.5; parameter m = 20; parameter k = 20000;
  coordinate x = 0.01; coordinate l = 0.1;
  kinetic m/2*der(x)^2;
  force 9.81*m on x;
  potential k/2*(x - l + 0.1)^2;
  let w = -8.149*der(l) - 0.374;
  force -F*(a*exp(-((10*l - 1)/0.45)^2)*(0.886 + 0.318*log(-w + sqrt(w^2 + 1))) + 0.02*exp(4*(10*l - 1))) on l;
  experiment(stop = 1);
end Implicit;"""
CAM = """model Cam
  dimensionless;
  parameter J = 0.5; parameter m = 1; parameter k = 5000; parameter g = 9.81;
  coordinate phi = 0.4; initial der(phi) = 6;
  coordinate y = 1.2;
  output u ~ atan2(2*cos(phi), sin(phi));
  let size = sqrt(cos(u)^2 + 4*sin(u)^2);
  let cx = 2*cos(u) + 0.2*cos(u)/size; let cy = sin(u) + 0.4*sin(u)/size;
  equation cx*cos(phi) - cy*sin(phi) = 0;
  kinetic J/2*der(phi)^2 + m/2*der(y)^2;
  potential m*g*y + k/2*(y - sqrt(cx^2 + cy^2))^2;
  experiment(stop = 1);
end Cam;"""
_NEWTON = """#include <math.h>
#include <stddef.h>
#include "model.h"
static void rhs(mech_real t, const mech_real *y, const mech_real *u, const mech_real *z, const mech_real *p, mech_real *restrict out)
{
    (void)t, (void)u, (void)z;
%s}
static const mech_model model = {.rhs = rhs};
__attribute__((visibility("default"))) const mech_model *mech_model_get(void) { return &model; }
"""
CUBIC_BY_STEPS = (
    _NEWTON
    % """\
    const double m = p[0], k = p[1], k3 = p[2], c = p[3], x = y[0];
    double node = y[2];
    for (int i = 0; i < 30; i++) {
        const double d = (k * node + k3 * node * node * node - c * (x - node)) / (k + 3 * k3 * node * node + c);
        node -= d;
        if (fabs(d) <= 1e-9 * fabs(node)) break;
    }
    out[0] = y[1];
    out[1] = -c * (x - node) / m;
    out[2] = c * y[1] / (k + 3 * k3 * node * node + c);
"""
)
IMPLICIT_BY_STEPS = (
    _NEWTON
    % """\
    const double F = p[0], a = p[1], m = p[2], k = p[3], x = y[0], l = y[2];
    const double s = (10 * l - 1) / 0.45, active = F * a * exp(-s * s), passive = F * 0.02 * exp(4 * (10 * l - 1));
    const double tendon = k * (x - l + 0.1);
    double rate = 0;
    for (int i = 0; i < 30; i++) {
        const double w = -8.149 * rate - 0.374, root = sqrt(w * w + 1);
        const double h = active * (0.886 + 0.318 * log(-w + root)) + passive - tendon;
        const double d = h / (active * 0.318 * 8.149 / root);
        rate -= d;
        if (fabs(d) <= 1e-9 * fabs(rate)) break;
    }
    out[0] = y[1];
    out[1] = (9.81 * m - tendon) / m;
    out[2] = rate;
    out[3] = 9.81 * m * y[1] - tendon * rate;
"""
)
CAM_BY_STEPS = (
    _NEWTON
    % """\
    const double J = p[0], m = p[1], k = p[2], g = p[3], sp = sin(y[0]), cp = cos(y[0]);
    double place = atan2(2 * cp, sp), s, c, r, cx, cy, cx1, cy1, bent;
    int found = 0;
    for (int i = 0; ; i++) {
        s = sin(place), c = cos(place), r = 1 / sqrt(c * c + 4 * s * s);
        cx = 2 * c + 0.2 * c * r, cy = s + 0.4 * s * r;
        bent = 3 * s * c * r * r * r;
        cx1 = -2 * s - 0.2 * s * r - 0.2 * c * bent, cy1 = c + 0.4 * c * r - 0.4 * s * bent;
        if (found || i == 30) break;
        const double d = (cx * cp - cy * sp) / (cx1 * cp - cy1 * sp);
        place -= d;
        found = fabs(d) <= 1e-9 * fabs(place);
    }
    const double lift = sqrt(cx * cx + cy * cy), f = k * (y[1] - lift);
    const double moved = (cx * sp + cy * cp) / (cx1 * cp - cy1 * sp) * (cx * cx1 + cy * cy1) / lift;
    out[0] = y[2];
    out[1] = y[3];
    out[2] = f * moved / J;
    out[3] = -g - f / m;
"""
)
CASES = {
    "2 springs in series": (SERIES, 2, "one spring"),
    "20 springs in series": (SERIES, 20, "one spring"),
    "200 springs in series": (SERIES, 200, "one spring"),
    "3 Maxwell elements": (MAXWELL, 3, "states"),
    "20 Maxwell elements": (MAXWELL, 20, "states"),
    "muscle and elastic tendon": (MUSCLE, 0, "a state"),
    "cubic spring in series": (CUBIC, 0, "Cardano's formula"),
    "cubic spring in series by steps": ((CUBIC[0], CUBIC_BY_STEPS), 0, "Newton's method in C"),
    "muscle by an implicit law": ((IMPLICIT, IMPLICIT_BY_STEPS), 0, "Newton's method in C"),
    "cam and follower": ((CAM, CAM_BY_STEPS), 0, "Newton's method in C"),
    "slider-crank, rod without mass": (CRANK, 0, "a rod of 1e-9 kg"),
    "four-bar, two links without mass": (FOUR_BAR, 0, "links of 1e-9 kg"),
}


def by_hand(text: str, states: np.ndarray, p: np.ndarray) -> Contestant:
    """Return rates that are written in C, of the states and parameters of a model."""
    sources = {"rates.c": text, "model.h": kernel_sources()["model.h"]}
    library = ctypes.CDLL(str(build_shared(sources, model_flags(), name="bench")))
    library.mech_model_get.restype = ctypes.c_void_p
    task = _Task(
        library.mech_model_get(),
        None,
        None,
        states.shape[1] // 2,
        STATES,
        states.ctypes.data,
        p.ctypes.data,
        None,
    )
    return Contestant(task, (library, states, p))


def agree(library: ctypes.CDLL, a: Contestant, b: Contestant, width: int) -> None:
    """Assert that the rates of both are the same."""
    found = []
    for one in (a, b):
        out = np.zeros((STATES, width))
        library.accelerations(ctypes.byref(one.task), out.ctypes.data_as(ctypes.POINTER(ctypes.c_double)))
        found.append(out)
    sizes = 1 + np.abs(found[1]).max(axis=0)
    assert (np.abs(found[0] - found[1]) / sizes).max() < 1e-11, np.abs(found[0] - found[1]).max(axis=0)


def places(model: mechc.Model) -> np.ndarray:
    """Return states near the start, an even number of columns."""
    problem = model.problem()
    start = prepare(problem, load_functions(problem), SimulationOptions()).y0
    width = len(start) + len(start) % 2
    y = np.zeros((STATES, width))
    y[:, : len(start)] = start * (1 + 0.01 * np.random.default_rng(1).uniform(-1, 1, (STATES, len(start))))
    return np.ascontiguousarray(y)


def main(quick: bool = False) -> None:
    library = caller()
    rows: list[list[str]] = []
    with tempfile.TemporaryDirectory() as folder:
        for name, (texts, n, other) in CASES.items():
            tasks: list[Contestant] = []
            for k, text in enumerate(texts):
                if text.startswith("#include"):
                    _, case, states, _ = tasks[0].held
                    tasks.append(by_hand(text, states, case.p))
                    agree(library, tasks[0], tasks[1], states.shape[1])
                    continue
                file = Path(folder, f"m{k}.mech")
                file.write_text(text.format(n=n), encoding="utf-8")
                model = mechc.load(file)
                tasks.append(contestant(model, places(model)))
            ours, theirs = measured(library, tasks, False)
            rows.append([name, other, f"{ours:.1f}", f"{theirs:.1f}", f"{ours / theirs:.2f}"])
    head = ["without mass", "beside", "ours, ns", "beside, ns", "ratio"]
    write("massless", "Coordinates without mass", [__doc__ or "", table(head, rows)])
