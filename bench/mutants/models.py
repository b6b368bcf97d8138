"""Small models that reach what faults change."""

SPRING = """\
model Spring
  coordinate Length x = 1 m;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*4 N/m*x^2;
  experiment(stop = 3 s);
end Spring;
"""
DAMPED = SPRING.replace("  experiment", "  damping 0.5 N.s/m on x;\n  experiment")
RAYLEIGH = SPRING.replace("  experiment", "  dissipation 1/4*(1 N.s/m)*der(x)^2;\n  experiment")
PUSHED = SPRING.replace("  experiment", "  force 1 N*sin(3 rad/s*time) on x;\n  experiment")
BRAKED = SPRING.replace("  experiment", "  force -0.3*(1 N.s^2/m^2)*der(x)*abs(der(x)) on x;\n  experiment")
WEAKER = SPRING.replace("*x^2;\n", "*x^2*exp(-time/(2 s));\n")
SUDDEN = SPRING.replace("*x^2;\n", "*x^2*(if time < 1 s then 1 else 2);\n")
STEP = """\
model Step
  coordinate Length x = -1 m;
  initial der(x) = 2 m/s;
  kinetic 1/2*1 kg*der(x)^2;
  potential if x > 0 m then 1 J else 0 J;
  damping 0.1 N.s/m on x;
  experiment(stop = 2 s);
end Step;
"""
PENDULUM = """\
model Pendulum
  coordinate th = 60 deg;
  kinetic 1/2*1 kg*(1 m)^2*der(th)^2;
  potential -1 kg*9.81 m/s^2*(1 m)*cos(th);
  experiment(stop = 3 s);
end Pendulum;
"""
DOUBLE = """\
model Double
  coordinate a = 1.2 rad;
  coordinate b = 0.3 rad;
  kinetic 1/2*(1 kg.m^2)*(2*der(a)^2 + der(b)^2 + 2*cos(a - b)*der(a)*der(b));
  potential -9.81 J*(2*cos(a) + cos(b));
  experiment(stop = 2 s);
end Double;
"""
WALL = """\
model Wall
  coordinate Length x = 1 m;
  initial der(x) = -1 m/s;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*400 N/m*max(0 m, -x)^2;
  experiment(stop = 3 s);
end Wall;
"""
BOUNCE = """\
model Bounce
  coordinate Length y = 1 m;
  kinetic 1/2*1 kg*der(y)^2;
  potential 1 kg*9.81 m/s^2*y;
  contact floor: y restitution 0.8;
  experiment(stop = 2 s);
end Bounce;
"""
BLOCK = """\
model Block
  coordinate Length x = 0 m;
  initial der(x) = 2 m/s;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*9 N/m*x^2;
  friction 1 N on x;
  experiment(stop = 3 s);
end Block;
"""
CRANE = """\
import mech.planar.*;

model Crane
  gravity {0, -9.81} m/s^2;
  Revolute pivot(world -> bar.a, angle = 30 deg);
  Bar bar(m = 1 kg, l = 1 m);
  Revolute elbow(bar.b -> tip.a, angle = 20 deg);
  Bar tip(m = 0.5 kg, l = 0.6 m);
  drive pivot.angle = 0.5 rad*sin(2 rad/s*time) + 30 deg;
  experiment(stop = 2 s);
end Crane;
"""
HOOP = """\
model Hoop
  parameter w = 4 rad/s;
  coordinate th = 0.4 rad;
  kinetic 1/2*1 kg*(1 m)^2*(der(th)^2 + w^2*sin(th)^2);
  potential -1 kg*9.81 m/s^2*(1 m)*cos(th);
  experiment(stop = 3 s);
end Hoop;
"""
MOVED = """\
model Moved
  coordinate Length x = 1 m;
  coordinate Length y = 0 m;
  initial der(y) = 1 m/s;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1 kg*9.81 m/s^2*y;
  constraint rod: (x - 0.2 m*sin(3 rad/s*time))^2 + y^2 = 1 m^2;
  experiment(stop = 2 s);
end Moved;
"""
TRAY = """\
import mech.planar.*;

model Tray
  gravity {0, -9.81} m/s^2;
  parameter rate = 0.5 kg/s;
  Revolute pivot(world -> arm.a, angle = -30 deg);
  Bar arm(m = 1 kg, l = 1 m);
  mass 0.2 kg + rate*time at arm.b;
  experiment(stop = 2 s);
end Tray;
"""
TOP = """\
model Tumbling
  coordinate Rotation R;
  initial der(R) = {0.1 rad/s, 3 rad/s, 0.2 rad/s};
  frame body = world * R;
  inertia diag({0.1 kg.m^2, 0.2 kg.m^2, 0.35 kg.m^2}) on body;
  experiment(stop = 3 s);
end Tumbling;
"""
KICKED = """\
model Kicked
  coordinate Length x = 1 m;
  discrete Integer n = 0;
  kinetic 1/2*1 kg*der(x)^2;
  potential 1/2*4 N/m*x^2;
  when time > 1 s then reinit(der(x), 2 m/s); n := n + 1; end when;
  experiment(stop = 2 s);
end Kicked;
"""
BEND = """\
model Bend
  coordinate Length x = -1 m;
  coordinate Length y = 0 m;
  initial der(x) = 2 m/s;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  constraint guide: y = 0.5*max(0 m, x);
  experiment(stop = 1 s);
end Bend;
"""
SWING = """\
import mech.planar.*;

model Swing
  gravity {0, -9.81} m/s^2;
  Revolute pivot(world -> bar.a, angle = 30 deg);
  Bar bar(m = 1 kg, l = 1 m);
  experiment(stop = 2 s);
end Swing;
"""
WIRE = """\
model Wire
  coordinate Length x = 0.3 m;
  coordinate Length y ~ 0.1 m;
  kinetic 1/2*1 kg*(der(x)^2 + der(y)^2);
  potential 1 kg*9.81 m/s^2*y;
  constraint wire: y = table(x, {-1, 0, 1, 2} m, {1, 0, 1, 3} m);
  experiment(stop = 2 s);
end Wire;
"""
DRIVEN = """\
model Driven
  coordinate Length x;
  kinetic 1/2*1 kg*der(x)^2;
  damping 0.3 N.s/m on x;
  drive x = 1 m*sin(2 rad/s*time);
  experiment(stop = 2 s);
end Driven;
"""
