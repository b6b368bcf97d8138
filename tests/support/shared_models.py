"""Models that several tests look at, from different sides."""

from __future__ import annotations

from pathlib import Path

import mechc


def example(name: str) -> mechc.Model:
    """Load an example by the name of its file."""
    return mechc.load(Path(__file__).resolve().parents[2] / "examples" / f"{name}.mech")


BALL = """\
model Ball
  coordinate Length y = 1 m;
  kinetic 1/2*1 kg*der(y)^2;
  potential 1 kg*9.81 m/s^2*y;
  contact floor: y restitution 0.8;
  experiment(stop = 2 s);
end Ball;
"""

CUBIC = """\
model Cubic
  dimensionless;
  parameter r = -1;
  state Real x = -1;
  equation der(x) = r + x - x^3;
end Cubic;
"""

FOUR_BAR = """\
import mech.planar.*;
model FourBar
  gravity {0, -9.81 m/s^2};
  Bar crank(m = 1 kg, l = 0.2 m);
  Bar coupler(m = 2 kg, l = 0.5 m);
  Bar rocker(m = 1.5 kg, l = 0.4 m);
  frame pivot = world * trans({0.5 m, 0});
  Revolute a(world -> crank.a, angle = 60 deg);
  Revolute b(crank.b -> coupler.a, angle ~ -30 deg);
  Revolute d(pivot -> rocker.a, angle ~ 90 deg);
  cut Revolute c(coupler.b -> rocker.b);
end FourBar;
"""

STIFF = """\
model Stiff
  dimensionless;
  parameter mu = 1;
  state x = 2;
  state v = 0;
  equation der(x) = v;
  equation der(v) = mu*(1 - x^2)*v - x;
  experiment(stop = 30);
end Stiff;
"""

WHIRL = """\
model Whirl
  parameter m = 0.5 kg;
  coordinate a = 1 rad;
  coordinate b = 40 deg;
  kinetic 1/2*2 kg*(1 m*der(a))^2 + 1/2*m*(1 m*der(b))^2 + m*(1 m)^2*der(a)*der(b)*cos(a - b);
  potential -9.81 m/s^2*1 m*(2 kg*cos(a) + m*cos(b));
  experiment(stop = 2 s, tolerance = 1e-10);
end Whirl;
"""
