"""Random mechanisms with dry friction in their joints, with the law of friction left open."""

from __future__ import annotations

import re
from collections.abc import Callable
from random import Random


class RoughModel:
    """``text`` holds LAW and the unit of its speed after each friction; ``watched`` coordinates tell the motion."""

    def __init__(self, text: str, *watched: str) -> None:
        self.text = text
        self.watched = watched

    def dry(self) -> str:
        return re.sub(r" LAW \S+;", ";", self.text)

    def smooth(self, speed: float) -> str:
        """Return the text with forces that are smooth below a speed."""
        return re.sub(r" LAW (\S+);", rf', law = "regularized", v_stick = {speed} \1;', self.text)


def _bar(random: Random, name: str, shortest: float, longest: float) -> str:
    return f"Bar {name}(m = {random.uniform(0.2, 1):.2f} kg, l = {random.uniform(shortest, longest):.3f} m);"


def _torque(random: Random) -> str:
    return f"{random.uniform(0, 3):.2f} N.m*sin({random.uniform(2, 9):.2f} rad/s*time)"


def _hinge(random: Random) -> str:
    return f"{random.uniform(0.02, 0.3):.3f} N.m"


def slider_crank(random: Random) -> RoughModel:
    """With dead centres, where no force moves the piston."""
    force = f"{random.uniform(0.5, 4):.2f} N"
    press = f"{random.uniform(0.05, 0.3):.3f}*abs(reaction(guide)[2])"
    text = f"""import mech.planar.*;
model SliderCrank
  {_bar(random, "crank", 0.08, 0.14)}
  {_bar(random, "rod", 0.2, 0.4)}
  Body piston(m = {random.uniform(0.3, 1):.2f} kg);
  gravity {{0, -9.81 m/s^2}};
  Revolute main(world -> crank.a, angle = {random.uniform(10, 80):.1f} deg);
  Revolute big_end(crank.b -> rod.a, angle ~ -40 deg);
  Prismatic guide(world -> piston.a, axis = {{1, 0}}, position ~ 38 cm);
  cut Revolute small_end(rod.b -> piston.a);
  initial der(main.angle) = {random.uniform(-40, 40):.1f} rad/s;
  torque {_torque(random)} on main.angle;
  friction {random.choice([force, press])} on guide.position LAW m/s;
  friction {_hinge(random)} on big_end.angle LAW rad/s;
  friction {_hinge(random)} on main.angle LAW rad/s;
end SliderCrank;
"""
    return RoughModel(text, "main.angle")


def four_bar(random: Random) -> RoughModel:
    """Each of its bars stands still where the two others lie on one line."""
    text = f"""import mech.planar.*;
model FourBar
  {_bar(random, "crank", 0.25, 0.4)}
  {_bar(random, "coupler", 0.8, 1.0)}
  {_bar(random, "rocker", 0.6, 0.8)}
  gravity {{0, -9.81 m/s^2}};
  Revolute p(world -> crank.a, angle = {random.uniform(20, 160):.1f} deg);
  Revolute q(crank.b -> coupler.a, angle ~ -50 deg);
  Revolute r(coupler.b -> rocker.a, angle ~ -100 deg);
  cut Revolute s(rocker.b -> world * trans({{0.9 m, 0 m}}));
  initial der(p.angle) = {random.uniform(-20, 20):.1f} rad/s;
  torque {_torque(random)} on p.angle;
  friction {_hinge(random)} on p.angle LAW rad/s;
  friction {_hinge(random)} on q.angle LAW rad/s;
  friction {random.uniform(0.005, 0.05):.3f} m*abs(reaction(r)[1]) on r.angle LAW rad/s;
end FourBar;
"""
    return RoughModel(text, "p.angle")


def double_pendulum(random: Random) -> RoughModel:
    size = random.choice(["abs(reaction(q)[1])", "abs(reaction(q)[1] - reaction(p)[2])"])
    text = f"""import mech.planar.*;
model DoublePendulum
  {_bar(random, "upper", 0.25, 0.6)}
  {_bar(random, "lower", 0.3, 1.0)}
  gravity {{0, -9.81 m/s^2}};
  Revolute p(world -> upper.a, angle = {random.uniform(-160, 160):.1f} deg);
  Revolute q(upper.b -> lower.a, angle = {random.uniform(-160, 160):.1f} deg);
  torque {_torque(random)} on p.angle;
  friction {_hinge(random)} on p.angle LAW rad/s;
  friction {random.choice([_hinge(random), f"{random.uniform(0.005, 0.05):.3f} m*{size}"])} on q.angle LAW rad/s;
end DoublePendulum;
"""
    return RoughModel(text, "p.angle", "q.angle")


def carts(random: Random) -> RoughModel:
    """Two carts, rough against the ground and against each other, and a pendulum on one of them."""

    def force() -> str:
        return f"{random.uniform(0.3, 4):.2f} N"

    text = f"""model Carts
  parameter l = {random.uniform(0.3, 1):.2f} m;
  coordinate Length x = 0 m;
  coordinate Length y = 1 m;
  coordinate phi = {random.uniform(-2, 2):.2f};
  kinetic 1/2*{random.uniform(0.5, 2):.2f} kg*der(x)^2 + 1/2*{random.uniform(0.5, 2):.2f} kg*der(y)^2;
  kinetic 1/2*1 kg*((der(y) + l*cos(phi)*der(phi))^2 + (l*sin(phi)*der(phi))^2);
  potential 1/2*{random.uniform(20, 200):.1f} N/m*(y - x - 1 m)^2 - 9.81 N*l*cos(phi);
  initial der(x) = {random.uniform(-2, 2):.2f} m/s;
  force {random.uniform(0, 10):.2f} N*sin({random.uniform(1, 9):.2f} rad/s*time) on x;
  friction {force()} on x LAW m/s;
  friction {force()} on y - x LAW m/s;
  friction {random.uniform(0.02, 0.4):.3f} N.m on phi LAW rad/s;
end Carts;
"""
    return RoughModel(text, "x", "y", "phi")


ROUGH: tuple[Callable[[Random], RoughModel], ...] = (slider_crank, four_bar, double_pendulum, carts)
