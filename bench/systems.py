"""The mechanisms of any size that are measured: each a model text with the structural parameter n."""

from __future__ import annotations

from msgspec import Struct


class System(Struct, frozen=True):
    """``freedoms`` of one unit of n; ``bound``: most operations per freedom at ``bound_size``."""

    name: str
    text: str
    freedoms: int = 1
    base: int = 0
    bound: float = float("inf")
    bound_size: int = 100
    largest: int = 400

    def freedom_count(self, n: int) -> int:
        return self.base + self.freedoms * n


_POINTS = """
import mech.planar.*;
model Swing "a rod whose angle is measured in {frame}"
  frame from;
  frame to;
  parameter l = 1 m;
  coordinate Angle angle ~ 0 rad;
  place to = from * {place};
end Swing;
model Chain
  structural parameter Integer n = 10;
  parameter Mass m[n] = 1 kg;
  parameter Length l[n] = 1 m;
  parameter g = 9.81 m/s^2;
  gravity {{0, -g}};
  Particle bob[i in 1:n](m = m[i]);
  Swing rod[i in 1:n]((if i == 1 then world else bob[i-1].a) -> bob[i].a, l = l[i], angle = {angle});
  experiment(stop = 10 s);
end Chain;
"""

POINTS_ABSOLUTE = _POINTS.format(
    frame="the world", place="trans({l*sin(angle), -l*cos(angle)})", angle="0.5 rad"
)

POINTS_RELATIVE = _POINTS.format(
    frame="the rod above",
    place="rot(angle) * trans({0 m, -l})",
    angle="if i == 1 then 0.5 rad else 0 rad",
)

BARS = """
import mech.planar.*;
model Chain
  structural parameter Integer n = 10;
  parameter Mass m[n] = 1 kg;
  parameter Length l[n] = 1 m;
  parameter g = 9.81 m/s^2;
  gravity {0, -g};
  Bar link[i in 1:n](m = m[i], l = l[i]);
  Revolute joint[i in 1:n]((if i == 1 then world else link[i-1].b) -> link[i].a,
                           angle = if i == 1 then -60 deg else 0 deg);
  experiment(stop = 10 s);
end Chain;
"""

BENT_BARS = BARS.replace("if i == 1 then -60 deg else 0 deg", "if i == 1 then -140 deg else 2 deg")
"""Hangs in an arc under tension: from a straight start the far joints hardly move, and compression makes them chaotic."""

_SPATIAL = """
import mech.spatial.*;
model Link "its mass centre on the y axis, symmetric about it"
  parameter m = 1 kg;
  parameter c = 0.5 m;
  parameter across = 0.1 kg.m^2;
  parameter along = 0.01 kg.m^2;
  frame a;
  mass m at a * {{0 m, -c, 0 m}};
  inertia diag({{across, along, across}}) on a;
end Link;
model Chain
  structural parameter Integer n = 7;
  parameter g = 9.81 m/s^2;
  gravity {{0, -g, 0}};
  {body}
  frame seat[i in 1:n] = (if i == 1 then world else link[i-1].a) * trans({{0, if i == 1 then 0 else -1, 0}} m);
  Revolute joint[i in 1:n](seat[i] -> link[i].a, angle = 0.3 rad,
                           axis = if mod(i, 3) == 1 then {{1, 0, 0}}
                                  else if mod(i, 3) == 2 then {{0, 1, 0}} else {{0, 0, 1}});
  experiment(stop = 10 s);
end Chain;
"""

SPATIAL = _SPATIAL.format(body="Link link[n];")
SPATIAL_GENERAL = _SPATIAL.format(
    body="Body link[n](m = 1 kg, com = {0, -0.5, 0} m, J = diag({0.1, 0.01, 0.1} kg.m^2));"
)

STIFF_SPRING = """
model StiffSpring "a heavy body on a soft spring, a light one on it by a stiff spring with a damper"
  parameter M = 1 kg;
  parameter m = 1e-3 kg;
  parameter soft = 1 N/m;
  parameter stiff = 1e5 N/m;
  parameter c = 10 kg/s;
  coordinate x = 1 m;
  coordinate y = 1 m;
  kinetic 1/2*M*der(x)^2 + 1/2*m*der(y)^2;
  potential 1/2*soft*x^2 + 1/2*stiff*(y - x)^2;
  dissipation 1/2*c*(der(y) - der(x))^2;
  experiment(stop = 10 s);
end StiffSpring;
"""

STAR = """
import mech.spatial.*;
model Star
  structural parameter Integer n = 30;
  parameter Mass m[n] = 1 kg;
  parameter Length c[n] = 0.5 m;
  parameter Inertia across[n] = 0.1 kg.m^2;
  parameter Inertia along[n] = 0.01 kg.m^2;
  gravity {0, -9.81, 0} m/s^2;
  Body hub(m = 5 kg, J = diag({1, 1.2, 1.4} kg.m^2));
  Free base(world -> hub.a);
  Body arm[i in 1:n](m = m[i], com = {0 m, -c[i], 0 m}, J = diag({across[i], along[i], across[i]}));
  Spherical ball[i in 1:n](hub.a -> arm[i].a);
  experiment(stop = 1 s);
end Star;
"""

SYSTEMS = (
    System("point masses, absolute angles", POINTS_ABSOLUTE, bound=60),
    System("point masses, joint angles", POINTS_RELATIVE, bound=70),
    System("bars on hinges", BARS, bound=85),
    System("spatial chain", SPATIAL, bound=285, bound_size=20, largest=100),
    System("spatial chain of general bodies", SPATIAL_GENERAL, largest=100),
    System("free base with spherical arms", STAR, freedoms=3, base=6, bound=250, bound_size=30, largest=30),
)
