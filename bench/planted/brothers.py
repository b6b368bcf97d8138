"""Brothers of the faults that mechc once had: models that reach the same fault another way, with the heading of theirs."""

from __future__ import annotations

from .former_models import PLANE

SPRING = """\
model Spring
  coordinate Length q = 0.5 m;
  initial der(q) = 1 m/s;
  kinetic 1/2*2 kg*der(q)^2;
  potential 1/2*3 N/m*q^2;
  {rest}
  experiment(stop = 6 s);
end Spring;
"""
GROUND = """\
model Ground
{plane}
  {rest}
  experiment(stop = {stop} s);
end Ground;
"""


def spring(rest: str) -> str:
    return SPRING.format(rest=rest)


def ground(x: float, y: float, vx: float, vy: float, rest: str, stop: float = 1.0) -> str:
    return GROUND.format(plane=PLANE.format(x=x, y=y, vx=vx, vy=vy), rest=rest, stop=stop)


MODELS: dict[str, tuple[str, str]] = {
    "kinetic_energy() in a force": ("1", spring("force -0.4 s/m^2*kinetic_energy()*der(q) on q;")),
    "potential_energy() in a force": ("1", spring("force -0.4 s/m^2*potential_energy()*der(q) on q;")),
    "momentum() in a force": ("1", spring("force -0.3/(1 s)*momentum(q) on q;")),
    "power() in a force": (
        "1",
        spring("force push: 1 N*sin(time/(1 s)) on q; force -0.5 s/m*power(push) on q;"),
    ),
    "energy() in a damping": ("1", spring("damping 0.1 N.s/m*energy()/(1 J) on q;")),
    "energy() in a dissipation": ("1", spring("dissipation 0.05 N.s/m*energy()/(1 J)*der(q)^2;")),
    "closed() in a force": (
        "1",
        ground(0, 0.1, 1, 0, "contact floor: y; force if closed(floor) then -1 N else 0 N on x;"),
    ),
    "a gap that bends by abs alone": ("3", ground(-1, 0, 3, 0, "contact c: y - 0.1 m + 0.1*abs(x);", 0.6)),
    "a gap that bends by clamp": (
        "3",
        ground(-0.5, 0, 3, 0, "contact c: y - 0.5*clamp(x, 0 m, 1 m);", 0.5),
    ),
    "friction on what bends": (
        "3",
        ground(-1, 0, 3, 0, "contact floor: y; friction 2 N on x - 0.5*abs(x);", 1),
    ),
    "two sides of a groove at once": ("3", ground(0, 0.5, 0, 0, "contact g: min(y - x, y + x);", 1)),
}
