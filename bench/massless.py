"""Coordinates without mass: one evaluation of the rates beside the same model solved by hand, or with a mass too small to be seen.

Processor times, medians of both in turn.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

import mechc
from mechc.runtime.case import SimulationOptions, prepare
from mechc.runtime.functions import load_functions

from .generated import caller, measured
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
CASES = {
    "2 springs in series": (SERIES, 2, "one spring"),
    "20 springs in series": (SERIES, 20, "one spring"),
    "200 springs in series": (SERIES, 200, "one spring"),
    "3 Maxwell elements": (MAXWELL, 3, "states"),
    "20 Maxwell elements": (MAXWELL, 20, "states"),
    "muscle and elastic tendon": (MUSCLE, 0, "a state"),
    "cubic spring in series": (CUBIC, 0, "Cardano's formula"),
    "slider-crank, rod without mass": (CRANK, 0, "a rod of 1e-9 kg"),
    "four-bar, two links without mass": (FOUR_BAR, 0, "links of 1e-9 kg"),
}


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
            tasks = []
            for k, text in enumerate(texts):
                file = Path(folder, f"m{k}.mech")
                file.write_text(text.format(n=n), encoding="utf-8")
                model = mechc.load(file)
                tasks.append(contestant(model, places(model)))
            ours, theirs = measured(library, tasks, False)
            rows.append([name, other, f"{ours:.1f}", f"{theirs:.1f}", f"{ours / theirs:.2f}"])
    head = ["without mass", "beside", "ours, ns", "beside, ns", "ratio"]
    write("massless", "Coordinates without mass", [__doc__ or "", table(head, rows)])
