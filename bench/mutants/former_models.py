"""Models of faults that mechc once had, most of them as they were found."""

PUMP = """\
model Pump
  coordinate Length q = 0.5 m;
  kinetic 1/2*2 kg*der(q)^2;
  potential 1/2*3 N/m*q^2;
  force -0.4 s/m^2*(energy() - 2 J)*der(q) on q;
  experiment(stop = 6 s);
end Pump;
"""
CREEP = """\
model Creep
  coordinate Length x = 0 m;
  coordinate Length y ~ 0 m;
  initial der(x) = 3 m/s;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1 kg*9.81 m/s^2*y;
  constraint floor: y = 0.1 m*sin(x/(1 m));
  force -0.3*multiplier(floor)*tanh(der(x)/(1 m/s)) on x;
  experiment(stop = 1 s);
end Creep;
"""
FOLLOW = """\
model Follow
  coordinate Length x = 0 m;
  coordinate Length y ~ 0 m;
  state Force N = 0 N;
  initial der(x) = 3 m/s;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1 kg*9.81 m/s^2*y;
  constraint floor: y = 0.1 m*sin(x/(1 m));
  equation der(N) = (multiplier(floor) - N)/(0.1 s);
  force -0.3*N*tanh(der(x)/(1 m/s)) on x;
  experiment(stop = 1 s);
end Follow;
"""
HINGE = """\
import mech.planar.*;

model Hinge
  gravity {0, 0} m/s^2;
  Revolute hinge(world -> bar.a, angle = 0 deg, der(angle) = 10 rad/s);
  Bar bar(m = 1 kg, l = 2 m);
  potential 1/2*10 N/m*(pos(bar.b)[1] - 1 m)^2;
  friction 0.05 m*norm(reaction(hinge)) on hinge.angle;
  experiment(stop = 1 s);
end Hinge;
"""
PLANE = """\
  coordinate Length x = {x} m;
  coordinate Length y = {y} m;
  initial der(x) = {vx} m/s;
  initial der(y) = {vy} m/s;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1 kg*9.81 m/s^2*y;
"""
TABLE = f"""\
model Table
{PLANE.format(x=0, y=0, vx=1.5, vy=0)}
  contact table: max(y, x - 1 m);
  experiment(stop = 1 s);
end Table;
"""
ROOF = f"""\
model Roof
{PLANE.format(x=-1, y=-0.5, vx=3, vy=1.5)}
  contact c: y + 0.5*abs(x);
  experiment(stop = 0.6 s);
end Roof;
"""
PLATE = """\
model Plate
  coordinate Length z = 0 m;
  kinetic 1/2*1 kg*der(z)^2;
  potential 9.81 N*z;
  contact plate: z - max(0 m, 3 m/s*(time - 1 s)) restitution 0.5;
  experiment(stop = 1.2 s);
end Plate;
"""
BELT = """\
model Belt
  coordinate Length x = 0 m;
  kinetic 1/2*1 kg*der(x)^2;
  friction 2 N on x - max(0 m, 3 m/s*(time - 1 s));
  potential 1/2*1 N/m*x^2;
  experiment(stop = 3 s);
end Belt;
"""
GROOVE = f"""\
model Groove
{PLANE.format(x=0.3, y=1, vx=0, vy=0)}
  contact g: min(y - x, y + x) restitution 0.5;
  experiment(stop = 5 s);
end Groove;
"""
CLOCKS = """\
model Clocks
  coordinate Length x = 0 m;
  discrete Integer fast = 0;
  discrete Integer slow = 0;
  kinetic 1/2*1 kg*der(x)^2;
  force slow*(1 N) on x;
  when sample(0.1 s) then fast := fast + 1; end when;
  when sample(0.3 s) then slow := slow + fast; end when;
  experiment(stop = 3.05 s);
end Clocks;
"""
BEGUN = """\
model Begun
  coordinate Length x = 0 m;
  kinetic 1/2*1 kg*der(x)^2;
  when time > 0 s then reinit(der(x), 1 m/s); end when;
  experiment(stop = 1 s);
end Begun;
"""
ROD = """\
model Rod
  gravity {0, -9.81} m/s^2;
  coordinate Length x = 0 m;
  coordinate Length y ~ 1 m;
  coordinate Angle a = 60 deg;
  initial der(x) = -10 m/s;
  initial der(a) = 5 rad/s;
  frame rod = world * trans({x, y}) * rot(a);
  mass 1 kg at rod;
  inertia 0.05 kg.m^2 on rod;
  point foot = rod * {-1, 0} m;
  initial foot[2] = 0 m;
  initial der(foot[2]) = 0 m/s;
  contact ground: foot[2] friction 3 along vel(foot)[1];
  experiment(stop = 0.01 s);
end Rod;
"""
BOX = """\
model Box
  gravity {0, -9.81} m/s^2;
  coordinate Length x = 0 m;
  coordinate Length y = 1 m;
  coordinate Angle a = 0 deg;
  frame box = world * trans({x, y}) * rot(a);
  mass 1 kg at box;
  inertia 0.05 kg.m^2 on box;
  point left = box * {-0.3, -0.1} m;
  point right = box * {0.3, -0.1} m;
  contact on_left: left[2] restitution 0.5;
  contact on_right: right[2] restitution 0.5;
  experiment(stop = 0.6 s);
end Box;
"""
CART = """\
model Cart
  coordinate Length x = 0 m;
  coordinate Length y = 0 m;
  coordinate Angle a = 0 deg;
  coordinate Angle b = 0 deg;
  kinetic 1/2*0.01 kg.m^2*der(b)^2;
  initial der(b) = -1 rad/s;
  frame body = world * trans({x, y}) * rot(a);
  mass 1 kg at body;
  inertia 0.1 kg.m^2 on body;
  point p = body * {0, 1} m;
  point q = body * {0, -1} m;
  constraint first: dot(vel(p), {-sin(a), cos(a)}) = 0 m/s;
  constraint second: dot(vel(q), {-sin(a + b), cos(a + b)}) = 0 m/s;
  initial der(x) ~ 1 m/s;
  initial der(y) ~ 0 m/s;
  initial der(a) ~ 1 rad/s;
  experiment(stop = 0.5 s);
end Cart;
"""
WAVES = """\
model Waves
  coordinate Length x = 0.1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 20 J*integral(sin(400*s)^2 for s in 0:x/(1 m));
  experiment(stop = 1 s);
end Waves;
"""
CORNER = """\
model Corner
  coordinate Length x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 10 J*integral(abs(s - 0.3) for s in 0:x/(1 m));
  experiment(stop = 1 s);
end Corner;
"""
FAR = """\
model Far
  coordinate Length x = 0 m;
  coordinate Length y = 1e5 m;
  initial der(x) = 1e-8 m/s;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1/2*40 N/m*x^2 + 1/2*1 N/m*y^2;
  experiment(stop = 10 s);
end Far;
"""
HUMP = """\
model Hump
  coordinate Length x = -5 m;
  coordinate Length y = 1 m;
  initial der(x) = 1 m/s;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1/2*3 N/m*y^2 + 1 J*exp(-(x/(1 mm))^2);
  experiment(stop = 10 s);
end Hump;
"""
PUSH = """\
model Push
  coordinate Length x = 0 m;
  kinetic 1/2*1 kg*der(x)^2;
  force 100 N*exp(-((time - 55 s)/(10 ms))^2) on x;
  experiment(stop = 100 s);
end Push;
"""
KINK = """\
model Kink
  coordinate x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*1 N/m*x^2 + 1 N*abs(x - 0.65 m);
  experiment(stop = 2.5 s, method = "gauss4", step = 0.05 s);
end Kink;
"""
HEIR = """\
model Part
  parameter m = 1 kg;
  coordinate Length x = 1 m;
  kinetic 1/2*m*der(x)^2;
  potential 1/2*4 N/m*x^2;
end Part;

model Base
  Part part(m = 2 kg);
  experiment(stop = 1 s);
end Base;

model Heir
  extends Base(part.m = 7 kg);
end Heir;
"""
INNER = """\
model Part
  coordinate Length x;
  initial x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*4 N/m*x^2;
end Part;

model Outer
  Part part;
  initial part.x = 4 m;
  experiment(stop = 1 s);
end Outer;
"""
