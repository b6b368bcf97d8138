"""The library against a second text of it: every part alone, with its defaults and with other values."""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from random import Random

import numpy as np
import pytest
from msgspec.structs import replace
from random_models.another_library import FOLDER, another_library, definitions
from random_models.checks import compare_twin
from random_models.compiled import compiled
from random_models.mutants import ROOT
from random_models.tree import Model, statement
from slow_params import slow_among

import mechc
from mechc.lang import ast
from mechc.lang.diagnostics import Reporter
from mechc.lang.parser import parse
from mechc.lang.printing.printer import print_expression
from mechc.lang.read import read_source
from mechc.lang.units import parse_unit

LIBRARY = ROOT / "stdlib"
PACKAGES = sorted({path.stem for path in LIBRARY.glob("*.mech")} - {"shapes"})
"""Those with parts; mech.shapes hands on to mech.contact, which tests/stdlib/test_contacts_of_shapes.py compares with formulas."""
OF_FILES = {"Solid"}
"""Parts whose shape stands in another file: they are what the functions of meshes say of it."""

SIGNAL = "u = (0.3 m)*sin(time/0.1 s)"
CONTROLLED = "target = 0.1 m, measured = (0.3 m)*sin(time/0.1 s), k = 20 N/m"
LIMITS = "low = -3 N, high = 2 N"
OF_EVERY_TYRE = (
    "FNOMIN = 3800 N, UNLOADED_RADIUS = 0.376 m, LFZO = 1.02, PCX1 = 1.5587, PDX1 = 1.09, PDX2 = -0.079328, PDX3 = "
    "9.9376e-06, PEX1 = 0.27403, PEX2 = 0.10232, PEX3 = 0.074903, PEX4 = -0.00026944, PKX1 = 19.733, PKX2 = 0.093405, "
    "PKX3 = 0.12433, PHX1 = -0.001779, PHX2 = 0.00021808, PVX1 = -9.9052e-06, PVX2 = -2.8568e-05, RBX1 = 14.927, RBX2 "
    "= -10.534, RCX1 = 1.1288, REX1 = 0.62334, REX2 = -0.0039079, RHX1 = 0.001683, PCY1 = 1.4675, PDY1 = 0.94002, "
    "PDY2 = -0.17669, PDY3 = -0.69602, PEY1 = 0.0040023, PEY2 = 0.00085719, PEY3 = 0.4, PEY4 = 0.6, PKY1 = -12.536, "
    "PKY2 = 1.3856, PKY3 = -0.93342, PHY1 = 0.0024749, PHY2 = 0.0037538, PVY1 = 0.031255, PVY2 = -0.0017359, PVY3 = "
    "-0.38166, PVY4 = -0.033117, RBY1 = 5.5228, RBY2 = 2.7966, RBY3 = 0.08688, RCY1 = 1.0783, REY1 = 0.055543, REY2 = "
    "-0.0022958, RHY1 = -0.0027141, RHY2 = -0.00098972, RVY1 = 0.0076305, RVY2 = -0.09933, RVY3 = 0.16991, RVY4 = "
    "-9.6324e-05, RVY5 = 1.9, RVY6 = 0.025, QSX1 = 0.028, QSX2 = 0.037, QSX3 = 0.024, QSY1 = 0.035, QSY2 = -0.018, "
    "QSY3 = 0.008, QSY4 = 0.037, QBZ1 = 9.2824, QBZ2 = -2.6095, QBZ3 = -0.86548, QBZ4 = -0.16332, QBZ5 = -0.35511, "
    "QBZ9 = 13.946, QBZ10 = 0.019, QCZ1 = 1.1119, QDZ1 = 0.14332, QDZ2 = -0.0062385, QDZ3 = -0.43424, QDZ4 = -8.1598, "
    "QDZ6 = -0.0073867, QDZ7 = 0.0016767, QDZ8 = -0.17212, QDZ9 = -0.033444, QEZ1 = -2.9203, QEZ2 = -0.91079, QEZ3 = "
    "0.034, QEZ4 = 0.32935, QEZ5 = -1.9083, QHZ1 = 0.0019422, QHZ2 = 0.0034645, QHZ3 = 0.14727, QHZ4 = -0.035133, "
    "SSZ1 = 0.026243, SSZ2 = -0.013391, SSZ3 = 0.3923, SSZ4 = -0.16022, LCX = 0.92, LMUX = 0.99, LEX = 0.95, LKX = "
    "1.01, LHX = 1.01, LVX = 0.9, LCY = 0.96, LMUY = 1.08, LEY = 1.05, LKY = 0.93, LHY = 1.06, LVY = 0.93, LTR = "
    "0.93, LRES = 0.9, LXAL = 0.94, LYKA = 0.94, LVYKA = 1.1, LS = 1.07, LMX = 1.01, LVMX = 1.04, LMY = 0.94, FZMIN = "
    "300 N"
)
OF_A_TYRE = (
    "PTX1 = 1.9021, PTX2 = -0.0014739, PTX3 = 0.03631, PHY3 = 0.037561, PTY1 = 1.8473, PTY2 = 1.9465, LGAX = 0.94, "
    "LGAY = 1.02, LGAZ = 1.07, LSGKP = 0.96, LSGAL = 1.09, " + OF_EVERY_TYRE
)
OF_A_TYRE_62 = (
    "INFLPRES = 2.5e5 Pa, NOMPRES = 2.3e5 Pa, PPX1 = -0.8733, PPX2 = 0.7035, PPX3 = -0.0080216, PPX4 = -0.47776, RBX3 "
    "= 60, PEY5 = 5, PKY4 = 2.7364, PKY5 = 4, PKY6 = -1.001, PKY7 = 0.17458, PPY1 = 0.34039, PPY2 = 1.1056, PPY3 = "
    "0.098508, PPY4 = -0.10018, PPY5 = -0.81071, RBY4 = 170, QDZ10 = 1.0329, QDZ11 = -4.3212, PPZ1 = 0.94372, PPZ2 = "
    "0.5053, QSX4 = 11.4346, QSX5 = -0.22968, QSX6 = 1.3749, QSX7 = -0.90713, QSX8 = 4.5166, QSX9 = -0.033238, QSX10 "
    "= 0.73734, QSX11 = -1.7614, QSX12 = 0.3, QSX13 = 0.02, QSX14 = -0.3, PPMX1 = -0.032723, QSY5 = 0.2, QSY6 = -0.4, "
    "QSY7 = 0.85, QSY8 = -0.4, LONGITUDINAL_STIFFNESS = 2e5 N/m, LATERAL_STIFFNESS = 1e5 N/m, PCFX1 = 0.14171, PCFX2 "
    "= -0.16104, PCFX3 = 0.21776, PCFY1 = -0.2334, PCFY2 = 0.068881, PCFY3 = 0.69715, PFZ1 = 0.88241, LKYC = 0.93, "
    "LKZC = 1.06, " + OF_EVERY_TYRE
)
VALUES = {
    "planar": {
        "Particle": "m = 1.3 kg",
        "Body": "m = 1.3 kg, J = 0.4 kg.m^2, com = {0.3, -0.2} m",
        "Bar": "m = 1.3 kg, l = 0.7 m",
        "Rod": "m = 1.3 kg, l = 0.7 m, direction = {3, -2}",
        "Disk": "r = 30 cm, inner = 10 cm, thickness = 2 cm, density = 700 kg/m^3",
        "Box": "size = {30, 20} cm, depth = 2 cm, density = 700 kg/m^3",
        "Sphere": "r = 30 cm, inner = 20 cm, density = 70 kg/m^3",
        "Prismatic": "axis = {3, -2}",
        "PinSlot": "axis = {-3, 2}",
        "Rolling": "r = -0.4 m",
        "RollingOnCircle": "track = 1.2 m, r = -0.3 m",
        "Spring": "k = 30 N/m, rest = 0.2 m",
        "Damper": "c = 3 N.s/m",
        "TorsionSpring": "k = 3 N.m/rad, rest = 20 deg",
        "TorsionDamper": "c = 3 N.m.s",
        "Motor": "drive_torque = 3 N.m",
        "SpeedMotor": "gain = 3 N.m.s, speed = 2 rad/s",
        "UniformMagneticField": "q = -2 C, B = 3 T",
    },
    "spatial": {
        "Particle": "m = 1.3 kg",
        "Body": "m = 1.3 kg, J = {{4, 1, 2}, {1, 5, 0.5}, {2, 0.5, 6}} kg.m^2, com = {0.3, -0.2, 0.1} m",
        "Bar": "m = 1.3 kg, l = 0.7 m",
        "Rod": "m = 1.3 kg, l = 0.7 m, direction = {3, -2, 1.5}",
        "Disk": "m = 1.3 kg, r = 30 cm, inner = 10 cm, axis = {3, -2, 1.5}",
        "Box": "size = {30, 20, 50} cm, density = 70 kg/m^3",
        "Cylinder": "r = 30 cm, inner = 10 cm, l = 50 cm, axis = {3, -2, 1.5}, density = 70 kg/m^3",
        "CarriedRotor": "J = 0.4 kg.m^2, axis = {3, -2, 1.5}",
        "Link": "r = {3, -2, 1.5} dm, side = {1, 2, 3}, width = 10 cm, height = 20 cm, density = 70 kg/m^3",
        "Tube": "r = {3, -2, 1.5} dm, diameter = 20 cm, inner = 10 cm, density = 70 kg/m^3",
        "Sphere": "r = 30 cm, inner = 20 cm, density = 70 kg/m^3",
        "Hemisphere": "r = 30 cm, density = 70 kg/m^3",
        "Frustum": "r = 30 cm, top = 20 cm, h = 50 cm, density = 70 kg/m^3",
        "Cone": "r = 30 cm, h = 50 cm, density = 70 kg/m^3",
        "Ellipsoid": "radii = {30, 20, 50} cm, density = 70 kg/m^3",
        "Torus": "r = 30 cm, section = 10 cm, density = 70 kg/m^3",
        "Polyhedron": "n = 5, k = 6, corners = {{-2, 0, 1}, {3, 0, 1}, {3, 4, 1}, {-2, 4, 1}, {2, 2, 6}} dm,"
        " faces = {{1, 3, 2}, {1, 4, 3}, {1, 2, 5}, {2, 3, 5}, {3, 4, 5}, {4, 1, 5}}, density = 70 kg/m^3",
        "Revolute": "axis = {3, -2, 1.5}",
        "Prismatic": "axis = {3, -2, 1.5}",
        "Cylindrical": "axis = {3, -2, 1.5}",
        "Screw": "axis = {3, -2, 1.5}, pitch = 30 cm",
        "Universal": "first = {3, -2, 1.5}, second = {1, 5, 1}",
        "ConstantVelocity": "axis = {3, -2, 1.5}",
        "PointOnLine": "axis = {3, -2, 1.5}",
        "PointOnQuadric": "A = {{2, 0.5, 0}, {0.5, 1, 0.2}, {0, 0.2, 3}} m^-2, b = {0.3, -0.2, 0.1} m^-1, c = 2",
        "RollingSphere": "r = 0.4 m",
        "RollingDisk": "r = 0.4 m, axis = {0.3, -0.1, 2}",
        "Spring": "k = 30 N/m, rest = 0.2 m",
        "Damper": "c = 3 N.s/m",
        "TorsionSpring": "k = 3 N.m/rad, rest = 20 deg",
        "TorsionDamper": "c = 3 N.m.s",
        "Motor": "axis = {3, -2, 1.5}, drive_torque = 3 N.m",
        "SpeedMotor": "axis = {3, -2, 1.5}, gain = 3 N.m.s, speed = 2 rad/s",
        "UniformMagneticField": "q = -2 C, B = {1, -2, 3} T",
        "Orientation": "axes = {3, 1, 3}",
    },
    "couplings": {
        "Distance": "l = 0.6 m",
        "Gear": "r1 = 0.3 m, r2 = 0.7 m, offset = 0.1 m",
        "Planetary": "r_sun = 0.3 m, r_ring = 0.7 m",
        "Belt": "r1 = 0.3 m, r2 = 0.7 m, offset = 0.1 m",
        "Rack": "r = 0.3 m, offset = 0.1 m",
    },
    "fields": {
        "CentralField": "V0 = 3 J, r0 = 0.7 m, n = 1.4",
        "InverseSquare": "k = -3 J.m",
        "Gravitation": "m1 = 2 kg, m2 = 3 kg, G = 0.5 m^3/kg/s^2",
        "Coulomb": "q1 = 2 uC, q2 = -3 uC, epsilon0 = 9e-12 F/m",
        "LinearDrag": "c = 3 N.s/m",
        "QuadraticDrag": "k = 3 kg/m",
    },
    "elements": {
        "CartesianSpring": "k = 30 N/m, c = 2 N.s/m, rest = 0.2 m",
        "Bushing": "K = {{30, 2, 1}, {2, 20, 3}, {1, 3, 10}} N/m, R = {{3, 0.2, 0.1}, {0.2, 2, 0.3}, {0.1, 0.3, 1}} N.m/rad,"
        " Q = {{0.1, 0.2, 0.3}, {0.4, 0.5, 0.6}, {0.7, 0.8, 0.9}} N, C = {{3, 0.2, 0.1}, {0.2, 2, 0.3}, {0.1, 0.3, 1}} N.s/m,"
        " D = {{0.3, 0.02, 0.01}, {0.02, 0.2, 0.03}, {0.01, 0.03, 0.1}} N.m.s",
        "Bearing": "radial = 30 N/m, axial = 20 N/m, tilting = 3 N.m/rad, radial_damping = 2 N.s/m, axial_damping = 1 N.s/m,"
        " tilting_damping = 0.4 N.m.s",
        "BumpStop": "rest = 0.4 m, k = 30 N/m, k3 = 300 N/m^3, b = 0.3 s/m",
        "Maxwell": "k = 30 N/m, c = 2 N.s/m, rest = 0.2 m",
        "ConstantAngle": "first = {1, 2, 0.5}, second = {0.3, -1, 2}, angle = 70 deg",
        "Rope": "EA = 30 N, c = 0.4 N.s/m",
        "Tether": "restitution = 0.4",
        "Pulley": "falls = 2, EA = 30 N, c = 0.4 N.s/m",
        "Winch": "r = 0.2 m, stored = 0.8 m, EA = 30 N, c = 0.4 N.s/m",
        "BeltDrive": "r1 = 0.2 m, r2 = 0.3 m, l = 0.7 m, EA = 90 N, preload = 3 N, c = 0.4 N.s/m",
        "SlippingBelt": "r1 = 0.2 m, r2 = 0.3 m, l = 0.7 m, EA = 90 N, preload = 3 N, c = 0.4 N.s/m, mu = 0.2, wrap = 150 deg, m = 0.3 kg",
        "Cam": "restitution = 0.4",
        "Tendon": "F0 = 30 N, slack = 0.25 m, strain = 0.3",
        "Activation": "excitation = 0.8, on = 20 ms, off = 70 ms",
        "Muscle": "activation = 0.7, F0 = 30 N, fibre = 0.15 m, slack = 0.1 m, pennation = 20 deg, speed = 8 s^-1",
        "ElasticMuscle": "activation = 0.7, F0 = 30 N, fibre = 0.15 m, slack = 0.1 m, strain = 0.06, pennation = 20 deg, speed = 8 s^-1",
        "MagneticCoupling": "peak = 3 N.m, poles = 2, c = 0.3 N.m.s",
        "Buoyancy": "r = 0.4 m, density = 30 kg/m^3, g = 9.7 m/s^2",
        "Float": "area = 0.1 m^2, h = 0.8 m, density = 30 kg/m^3, g = 9.7 m/s^2, c = 0.3 N.s/m",
        "Propeller": "axis = {1, 2, 3}, speed = 30 rad/s, wind = 0.7 m/s, D = 0.5 m, density = 1.1 kg/m^3, kT = 0.2, kT1 = 0.05,"
        " kQ = 0.02, kQ1 = 0.005, hand = -1",
        "Wing": "area = 0.4 m^2, aspect = 6, slope = 5, zero = -2 deg, stall = 12 deg, CD0 = 0.02, e = 0.8, density = 1.1 kg/m^3,"
        " wind = 0.7 m/s",
        "Parachute": "CdS = 2 m^2, open = 0.2 s, fill = 0.5 s, order = 1.5, density = 1.1 kg/m^3, wind = 0.7 m/s",
    },
    "vehicle": {
        "Axle": "load = 3000 N, drive = 200 N, wheels = 4, mu = 0.9, fall = 0.1, nominal = 3500 N, B = 8, C = 1.4, E = -0.5, low = 0.2 m/s",
        "LinearAxle": "drive = 200 N, C = 3000 N/rad, low = 0.2 m/s",
        "RollingWheel": "r = 0.2 m, holds = false",
        "RoadVehicle": "wind = 0.3 m/s, CdA = 0.4 m^2, density = 1.1 kg/m^3, cr = 0.03, g = 9.7 m/s^2",
        "SlippingWheel": "load = 30 N, r = 0.2 m, peak = 0.9, rest = 0.5, adhesion = 0.7 m/s, sliding = 1.3 m/s, adhesion_share = 5, sliding_share = 12",
        "Driver": "preview = 3 m, gain = 0.5, T = 0.2 s, most = 20 deg",
    },
    "tyres": {
        "MagicFormula": OF_A_TYRE,
        "MagicFormula62": OF_A_TYRE_62,
        "TyreCurves62": f"kappa = 0.05, Fz = 3000 N, {OF_A_TYRE_62}",
        "Tyre62": f"VERTICAL_STIFFNESS = 3000 N/m, VERTICAL_DAMPING = 50 N.s/m, flattening = 0.01 m, LONGVL = 3 m/s, VXLOW = 0.8 m/s,"
        f" tread = 30 N.s/m, most = 1.2, {OF_A_TYRE_62}",
        "TyreCurves": f"kappa = 0.05, Fz = 3000 N, {OF_A_TYRE}",
        "Tyre": f"VERTICAL_STIFFNESS = 3000 N/m, VERTICAL_DAMPING = 50 N.s/m, flattening = 0.01 m, LONGVL = 3 m/s, VXLOW = 0.8 m/s,"
        f" tread = 30 N.s/m, most = 1.2, {OF_A_TYRE}",
    },
    "rails": {
        "RailWheelset": "V = 3 m/s, r0 = 0.4 m, b = 0.7 m, conicity = 0.1, f11 = 30 N, f22 = 40 N",
        "RailWheel": "side = -1, load = 30 N, r0 = 0.4 m, b = 0.7 m, at = {-2, 0, 1.5, 3} m, up = {-0.3, 0, 0.2, 0.9} m, rail = 0.6 m, hollow = -0.1 m^-1,"
        " E = 3e4 Pa, mu = 0.4, low = 0.3 m/s, cells = 4",
    },
    "space": {
        "GravityGradient": "J = {{4, 1, 2}, {1, 5, 0.5}, {2, 0.5, 6}} kg.m^2, mu = 3 m^3/s^2",
        "SunPressure": "area = 3 m^2, Cr = 1.7, P = 2 Pa, sun = {1, -2, 2}",
        "ReactionWheel": "axis = {1, -2, 2}, motor = 0.3 N.m, J = 0.2 kg.m^2, most = 0.2 N.m, c = 0.05 N.m.s",
        "Thruster": "axis = {1, -2, 2}, throttle = 0.4, thrust = 3 N, Isp = 100 s",
        "MagneticTorquer": "dipole = 1e-20 A.m^2, most = 7e-21 A.m^2",
    },
    "rotational": {
        "Rotor": "J = 0.4 kg.m^2",
        "SpringDamper": "k = 30 N.m/rad, c = 2 N.m.s, rest = 20 deg",
        "Backlash": "k = 300 N.m/rad, c = 2 N.m.s, play = 3 deg, soft = true",
        "Gear": "ratio = -2.5",
        "LossyGear": "ratio = 3, efficiency = 0.8, back_efficiency = 0.7, bearing = 0.1 N.m, back_bearing = 0.07 N.m",
        "VariableLossGear": "ratio = 3, efficiency = 0.8 - 0.1*sin(3 rad/s*time), back_efficiency = 0.7, bearing = 0.1 N.m, back_bearing = 0.07 N.m",
        "Planetary": "ratio = 3.5",
        "Clutch": "press = 30 N, radius = 0.2 m, faces = 4, mu = 0.3, peak = 1.2",
        "Brake": "press = 30 N, radius = 0.2 m, mu = 0.3, peak = 1.2",
        "OneWayClutch": "drag = 0.3 N.m",
        "BearingFriction": "coulomb = 0.3 N.m, stribeck = 0.2 N.m, speed = 0.4 rad/s, viscous = 0.1 N.m.s, peak = 1.3",
        "EddyCurrentBrake": "heated = 1.3, peak = 0.6 N.m, speed = 0.7 rad/s",
        "Stop": "low = -0.5 rad, high = 0.7 rad, restitution = 0.4",
        "TorqueSource": "torque = 3 N.m",
        "SpeedSource": "speed = 2 rad/s",
        "DCMotor": "voltage = 12 V, R = 2 Ohm, L = 30 mH, K = 0.3 N.m/A",
        "TorqueCurve": "load = 0.7, speeds = {-3, 0, 4} rad/s, full = {2, 3, 1} N.m, dragged = {0.2, 0, -0.4} N.m",
        "Servo": "kp = 5 s^-1, kv = 0.7 N.m.s, speed = 1.3 rad/s, limit = 0.6 N.m",
    },
    "translational": {
        "Slider": "m = 0.4 kg",
        "SpringDamper": "k = 30 N/m, c = 2 N.s/m, rest = 0.2 m",
        "Gap": "k = 300 N/m, c = 2 N.s/m, rest = 0.3 m, soft = true",
        "GasSpring": "area = 3 cm^2, charged = 12 cm, volume = 9 cm, pressure = 0.3 MPa, outside = 0.1 MPa, n = 1.4",
        "Rack": "r = 3 cm",
        "LeadScrew": "lead = 30 mm",
        "Brake": "press = 30 N, mu = 0.3, peak = 1.2",
        "StribeckFriction": "coulomb = 0.3 N, stribeck = 0.2 N, speed = 0.4 m/s, viscous = 0.1 N.s/m, peak = 1.3",
        "EddyCurrentBrake": "heated = 1.3, peak = 0.6 N, speed = 0.7 m/s",
        "Stop": "low = -0.5 m, high = 0.7 m, restitution = 0.4",
        "Cylinder": "flow1 = 1e-4 m^3/s, flow2 = -2e-5 m^3/s, area1 = 30 cm^2, area2 = 20 cm^2, stroke = 0.6 m, retracted = 0.01 m,"
        " dead = 2 dm^3, bulk = 1 MPa, air = 0.03, outside = 1.1e5 Pa, leak = 1e-9 m^3/s/Pa, stops = false, restitution = 0.4",
        "SingleActingCylinder": "flow = 1e-4 m^3/s, area = 30 cm^2, stroke = 0.6 m, retracted = 0.01 m, dead = 2 dm^3, bulk = 1 MPa,"
        " air = 0.03, outside = 1.1e5 Pa, leak = 1e-9 m^3/s/Pa, k = 30 N/m, preload = 2 N, stops = false, restitution = 0.4",
        "Valve": "u = 0.4, p1 = 3 Pa, p2 = 5 Pa, supply = 10 Pa, tank = 1 Pa, flow = 2 m^3/s, drop = 4 Pa, laminar = 2 Pa, overlap = 0.1",
        "ShockAbsorber": "low = 300 N.s/m, high = 100 N.s/m, knee = 0.4 m/s, gas = 10 N",
        "ForceSource": "push = 3 N",
        "SpeedSource": "speed = 2 m/s",
    },
    "control": {
        "FirstOrder": f"{SIGNAL}, T = 0.3 s",
        "SecondOrder": f"{SIGNAL}, w = 7 rad/s, D = 0.2",
        "Integrator": SIGNAL,
        "Derivative": f"{SIGNAL}, T = 0.1 s",
        "TransferFunction": f"{SIGNAL}, b = {{2, 3}}, a = {{2, 1, 4, 3}}, T = 0.1 s, n = 3",
        "StateSpace": "u = {(0.3 m)*sin(time/0.1 s)}, A = {{0, 1}, {-3, -2}}, B = {{1}, {2}}, C = {{1, 0}, {3, 1}}, D = {{0}, {2}},"
        " T = 0.1 s, n = 2",
        "Filter": f'{SIGNAL}, kind = "chebyshev", pass = "high", order = 4, cutoff = 3 Hz, ripple = 2',
        "PID": f"{CONTROLLED}, Ti = 0.3 s, Td = 0.1 s, Tf = 0.2 s, weight = 0.7, derivative_weight = 0.4",
        "LimitedPID": f"{CONTROLLED}, Ti = 0.3 s, Td = 0.1 s, Tf = 0.2 s, Tt = 0.5 s, {LIMITS}, weight = 0.7, derivative_weight = 0.4",
        "SampledPID": f"{CONTROLLED}, period = 30 ms, Ti = 0.3 s, Td = 0.1 s, Tf = 0.2 s, Tt = 0.5 s, {LIMITS}, weight = 0.7,"
        " derivative_weight = 0.4",
        "Limiter": f"{SIGNAL}, low = -0.1 m, high = 0.2 m",
        "RateLimiter": f"{SIGNAL}, rise = 1 m/s, fall = 2 m/s, T = 20 ms",
        "Hysteresis": f"{SIGNAL}, low = -0.1 m, high = 0.2 m",
        "Deadband": f"{SIGNAL}, width = 0.1 m",
        "Quantizer": f"{SIGNAL}, resolution = 0.07 m",
        "SampleHold": f"{SIGNAL}, period = 70 ms",
    },
}
"""Values of all parameters and inputs other than the defaults; a mass follows from a density."""


def turned(w: int, x: int, y: int, z: int) -> str:
    """Write the matrix of a quaternion of length 5."""
    rows = (
        (w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z),
    )
    return "{" + ", ".join("{" + ", ".join(str(n / 25) for n in row) + "}" for row in rows) + "}"


TURNED = [turned(*q) for q in ((4, 2, -2, 1), (1, 4, 2, -2), (-2, 1, 4, 2), (2, -2, 1, 4), (5, 0, 0, 0))]
"""The whole, each axis, and no turn at all as what is largest."""
CONVENTIONS = ("1, 2, 3", "2, 3, 1", "3, 1, 2", "3, 2, 1", "3, 1, 3", "1, 3, 1", "2, 1, 2")
"""Of angles: some forwards, some backwards, some that turn about one axis twice."""

ASKED = {
    "tangents": "tangents({0.36, -0.8, 0.48})",
    "features": "concat({features(2)[i, k] for i in 1:4 for k in 1:2}, {features(3)[i, k] for i in 1:12 for k in 1:3})",
    "nearer": "nearer({0.3, -0.8, 0.4} m, {0.6, -0.48, 0.64}, {0.36, 0.8, 0.48}, {0.2, 0.1} m, {-0.3, 0.4} m)",
    "over_box": "over_box({0.3, -0.8, 0.4} m, {0.5, 0.4, 0.7} m)",
    "height": "height({0.3, 0.7} m, {0, 0.2, 1} m, {0, 0.5, 0.9, 2} m, {{1, 2, 4, 3}, {0, 1, 2, 2}, {5, 4, 2, 3}} m)",
    "unit_vector": "unit_vector({3, -1, 2})",
    "across": "across(unit_vector({3, -1, 2}), unit_vector({2, 1, 1}), unit_vector({1, -1, -1}))",
    "turned_by": "turned_by({0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6})",
    "first_normal": "{first_normal({3, -1, 2}), first_normal({3, -1, -2}), first_normal({0, 0, 2})}",
    "step": "{step(1 s, 0.9 s), step(1 s, 1.1 s)}",
    "ramp": "{ramp(t, 0.5 s, 1 s) for t in {0.2, 0.7, 1.6} s}",
    "sine": "sine(0.3 s, 0.7 Hz, 20 deg)",
    "chirp": "{chirp(t, 2 Hz, 3 Hz, 0.8 s) for t in {0.2, 0.7, 1.6} s}",
    "pulse": "{pulse(t, 0.5 s, 0.3 s, 0.4) for t in {0.2, 0.55, 0.65, 1.45} s}",
    "binary_sequence": "{sum(i*binary_sequence(5)[i] for i in 1:31), sum(i*binary_sequence(8)[i] for i in 1:255)}",
    "prbs": "{prbs(t, 4, 0.3 s) for t in {0.2, 2.2, 3.1, 5.3} s}",
    "trapezoid": "{trapezoid(t, 0.5 s, 0.3 s, 0.2 s, 0.4 s) for t in {0.2, 0.6, 0.9, 1.1, 1.6} s}",
    "point_to_point": "{point_to_point(t, l, 2 m/s, 5 m/s^2) for t in {0.3, 0.5, 0.8, 1.1} s for l in {0.3, -1.2} m}",
    "butterworth": "butterworth(5)",
    "chebyshev": "chebyshev(6, 0.7)",
    "bessel": "bessel(5)",
    "random_road": "{random_road(x, 64, 3) for x in {0, 7, 300} m}",
    "agm": "let (K1, E1) = agm(0.1); let (K2, E2) = agm(0.95); {K1, E1, K2, E2}",
    "hertz": "let (h1, h2) = hertz(2, 3); let (h3, h4) = hertz(3, 0.4); {h1, h2, h3, h4}",
    "kalker": "let (k1, k2, k3) = kalker(0.63); let (k4, k5, k6) = kalker(1.7); {k1, k2, k3, k4, k5, k6}",
    "fastsim": "let (f1, f2) = fastsim({0.5, 0.4, 0.6}, 0.75, 4); let (f3, f4) = fastsim({-0.1, 0.2, -0.1}, 1.3, 3); {f1, f2, f3, f4}",
    "tread": "{tread(s, {-2, 0, 1.5, 3} m, {-0.3, 0, 0.2, 0.9} m) for s in {-3, -1, 0.7, 2, 4} m}",
    "orifice": "{orifice(p, 30 l/min, 35 bar, 0.5 bar) for p in {-100, -0.1, 0.3, 200} bar}",
    "oil": "{oil(p, 1.3 GPa, a, 1.1e5 Pa) for p in {-1e5, 0, 30e5} Pa for a in {0, 0.02}}",
    "mirrored": "{mirrored({1, 2, 3} m, s) for s in {-1, 1}}",
    "magic": "{magic(s, 8, 1.4, -0.6) for s in {-0.3, 0.02, 0.5}}",
    "slip_friction": "{slip_friction({v, 0.3 m/s}, 0.5 m/s, 0.9 m/s, 0.8, 0.3) for v in {0, 0.2, 0.6, 2} m/s}",
    "magic_cosine": "{magic_cosine(s, 8, 1.1, -0.6) for s in {-0.3, 0.02, 0.5}}",
    "limit": "{limit(0.1, 1.5, v) for v in {0, 0.3, 2}}",
    "side": "{side(s) for s in {-1, -4e-5, 0, 7e-5, 0.2}}",
    "share": "{share(u, 0.1 m) for u in {-0.2, -0.04, 0.05, 0.3} m}",
    "held": "{held(u, 0.1 m, (2 m/s)*s) for u in {-0.2, 0.102, 0.05} m for s in {-1, 1}}",
    "earth": "{earth({5000, 3000, 4000} km), earth({1000, -300, 9000} km)}",
    "round_earth": "round_earth({5000, 3000, 4000} km)",
    "earth_field": "earth_field({5000, 3000, 4000} km)",
    "lit": "{lit({x, 1000, 500} km, {0.6, 0.8, 0}) for x in {9000, -9000, -1000}}",
    "cycloidal": "{cycloidal(s) for s in {-0.2, 0.3, 1.2}}",
    "polynomial345": "{polynomial345(s) for s in {-0.2, 0.3, 1.2}}",
    "cam_lift": "{cam_lift(a, 12 mm, 60 deg, 20 deg, 70 deg) for a in {-300, 30, 70, 100, 200, 400} deg}",
    "tendon_curve": "tendon_curve(1.03, 0.05)",
    "active_curve": "{active_curve(x) for x in {0.4, 0.9, 1.5}}",
    "passive_curve": "{passive_curve(x) for x in {0.4, 0.9, 1.5}}",
    "velocity_curve": "{velocity_curve(v) for v in {-0.9, 0.1, 0.8}}",
    "inverse_velocity_curve": "{inverse_velocity_curve(f) for f in {-1, 0.3, 1.2, 2.5}}",
    "cap_volume": "{cap_volume(d, 0.3 m) for d in {-0.1, 0.2, 0.7} m}",
    "stalling": "{stalling(a, 5, 12 deg) for a in {-30, -11, 2, 13, 40} deg}",
    "rotation_vector": f"{{{', '.join(f'rotation_vector({R})' for R in TURNED)}}}",
    "rotation_angles": f"{{{', '.join(f'rotation_angles({TURNED[0]}, {{{a}}})' for a in CONVENTIONS)}}}",
    "second_normal": "{second_normal({3, -1, 2}), second_normal({3, -1, -2}), second_normal({0, 0, 2})}",
}
IN_SPACE = {("elements", name) for name in ("Bushing", "Bearing", "ConstantAngle", "Propeller")} | {
    ("tyres", name) for name in ("Tyre", "Tyre62")
}
IN_THE_PLANE = {
    ("vehicle", name) for name in ("Axle", "LinearAxle", "RollingWheel", "SlippingWheel", "Driver")
}
"""Parts that stand in space or in the plane alone, in a package of both."""
LYING = {"RollingDisk": " * rotx(70 deg)"}
"""How a part does not stand that must not."""


@cache
def parts(path: str) -> dict[str, ast.Model]:
    """Return the parts that a file of a library holds, each with what it inherits."""
    file = parse(read_source(path), Reporter())
    found: dict[str, ast.Model] = {}
    for model in (item for item in file.items if isinstance(item, ast.Model)):
        bases = [s for s in model.body if isinstance(s, ast.Extends)]
        inherited = [s for base in bases for s in found[base.base].body]
        found[model.name] = replace(model, body=(*inherited, *model.body))
    return found


def first(package: str) -> dict[str, ast.Model]:
    """Return the parts of a package of the library."""
    return {n: p for n, p in parts(str(LIBRARY / f"{package}.mech")).items() if n not in OF_FILES}


def second(package: str) -> dict[str, ast.Model]:
    """Return the parts of a package as the second text has them."""
    return parts(str(FOLDER / f"{package}.mech"))


def functions(package: str) -> list[str]:
    """Return the functions of a package of the library."""
    file = parse(read_source(LIBRARY / f"{package}.mech"), Reporter())
    return [item.name for item in file.items if isinstance(item, ast.Function)]


ASSEMBLIES = {
    *(("machines", name) for name in ("Ram", "LumpedBeam", "HangingLoad")),
    *(("suspension", name) for name in ("Wishbone", "Suspension", "DoubleWishbone", "McPherson")),
    *(("contact", name) for name in first("contact")),
}
"""They have answers of their own, in tests/stdlib: test_machines.py, test_suspensions.py, test_contact.py, test_more_contacts.py."""
HALVES = {("tyres", name) for name in ("TyreData", "RollingTyre")}
"""What parts share, and which is nothing alone: the parts are compared."""
EVERY = [
    (package, name)
    for package in PACKAGES
    for name in first(package)
    if not name.endswith("Settings") and (package, name) not in ASSEMBLIES | HALVES
]
"""Parts; settings of joints are compared with statements in tests/stdlib/test_settings.py, and random models give none."""
JOINTS = [(p, name) for p, name in EVERY if any(isinstance(s, ast.Place) for s in first(p)[name].body)]


def declared(part: ast.Model) -> list[tuple[object, ...]]:
    """Return what a part lets others know: free frames in their order, parameters, coordinates, inputs, labels."""
    told: list[tuple[object, ...]] = [("partial", part.partial)]
    told += [("free frame", s.name) for s in part.body if isinstance(s, ast.Frame) and s.value is None]
    rest: list[tuple[object, ...]] = []
    for s in part.body:
        match s:
            case ast.Parameter():
                rest.append(("parameter", s.name, s.structural, s.value is None, len(s.dimensions)))
            case ast.Coordinate():
                rest.append(("coordinate", s.name, s.start is None or s.start.guess, len(s.dimensions)))
            case ast.Input():
                rest.append(("input", s.name, s.value and print_expression(s.value)))
            case ast.Constraint(label=ast.LabelName(name=name)):
                rest.append(("constraint", name))
            case _:
                pass
    return told + sorted(rest, key=str)


def quantities(part: ast.Model) -> dict[str, Fraction]:
    """Return the defaults that are numbers with a unit, in SI: small ones are lost in a comparison of motions."""
    given = ((s.name, s.value) for s in part.body if isinstance(s, (ast.Parameter, ast.Input)))
    return {n: q.value * parse_unit(q.unit).factor for n, q in given if isinstance(q, ast.Quantity)}


def values(package: str, name: str, k: int) -> str:
    """Return modifications: those of inputs and of what has no default alone for the first of a kind, all for the second."""
    given = VALUES[package].get(name, "")
    needed = {
        s.name
        for s in first(package)[name].body
        if isinstance(s, ast.Input) or (isinstance(s, ast.Parameter) and s.value is None)
    }
    return given if k else ", ".join(m for m in given.split(", ") if m.partition(" = ")[0] in needed)


def moving(name: str, n: int, place: str, k: int) -> str:
    """Write a frame that moves freely beside a place, for ``k`` = 0 from there, with a body whose mass centre is elsewhere."""
    if n == 2:
        return f"""
  coordinate Length {name}_r[2] ~ {{0.{2 * k}, -0.{k}}} m;
  initial der({name}_r) ~ {{0.3, -0.{k + 4}}} m/s;
  coordinate Angle {name}_q ~ {k} rad;
  initial der({name}_q) ~ 0.7 rad/s;
  frame {name} = world{place} * trans({name}_r) * rot({name}_q);
  mass 1.{k} kg at {name} * {{0.2 m, -0.1 m}};
  inertia 0.{k + 3} kg.m^2 on {name};"""
    return f"""
  coordinate Length {name}_r[3] ~ {{0.{2 * k}, -0.{k}, 0.{k}}} m;
  initial der({name}_r) ~ {{0.3, -0.{k + 4}, 0.5}} m/s;
  coordinate Rotation {name}_q ~ axis_angle({{1, -2, 0.5}}, {k} rad);
  initial der({name}_q) ~ {{0.7, -0.3, 0.4}} rad/s;
  frame {name} = world{place} * trans({name}_r) * {name}_q;
  mass 1.{k} kg at {name} * {{0.2 m, -0.1 m, 0.3 m}};
  inertia {{{{3, 0.2, 0.1}}, {{0.2, 4, 0.3}}, {{0.1, 0.3, 5}}}} kg.m^2 on {name};"""


ARM = {2: "{0.3, -0.4}", 3: "{0.3, -0.4, 0.5}"}
"""From the line about which something sways to where it is."""


def swaying(name: str, n: int, k: int) -> str:
    """Write a frame that turns about a line, which time carries away from it, with a body whose mass centre is elsewhere."""
    turn = f"rot({name}_q)" if n == 2 else f"axis_angle({{1, -2, 0.5}}, {name}_q)"
    centre, inertia = (
        ("{0.2, -0.1}", "2 kg.m^2") if n == 2 else ("{0.2, -0.1, 0.3}", "diag({2, 3, 4} kg.m^2)")
    )
    return f"""
  coordinate Angle {name}_q ~ 0.{k} rad;
  initial der({name}_q) ~ 0.7 rad/s;
  frame {name} = world * {turn} * trans({ARM[n]} m + time*{ARM[n]} m/s);
  mass 1.{k} kg at {name} * {centre} m;
  inertia {inertia} on {name};"""


def looked_at(frame: str, n: int) -> str:
    """Write where a frame is, and how it stands."""
    axes = ["{1, 0}"] if n == 2 else ["{1, 0, 0}", "{0, 1, 0}"]
    name = frame.replace(".", "_")
    return f"\n  output {name}_at = pos({frame});" + "".join(
        f"\n  output {name}_axis{i} = direction({frame}, {axis});" for i, axis in enumerate(axes)
    )


def of_body(package: str, name: str, n: int, k: int) -> str:
    """Write a body in a frame that moves freely."""
    part = first(package)[name]
    frames = [s.name for s in part.body if isinstance(s, ast.Frame)]
    outputs = "".join(looked_at(f"part{k}.{frame}", n) for frame in frames)
    given = ", ".join(filter(None, (f"a = base{k}", values(package, name, k))))
    return f"""{moving(f"base{k}", n, "", k)}
  {name} part{k}({given});
  output centre{k} = mass_centre(part{k}.a);
  output inertia{k} = inertia_tensor(part{k}.a);{outputs}"""


def of_joint(package: str, name: str, n: int, k: int, *, closes: bool) -> str:
    """Write a joint between a body that moves freely and another, which it carries, or to which it closes a loop."""
    place = (" * trans({0.3, 0.2} m) * rot(25 deg)", " * trans({0.3, 0.2, -0.1} m) * rotx(20 deg) * rotz(30 deg)")[n == 3]  # fmt: skip
    part = first(package)[name]
    told = [
        f"\n  output {s.name}{k} = part{k}.{s.name};\n  output {s.name}_rate{k} = der(part{k}.{s.name});"
        for s in part.body
        if isinstance(s, ast.Coordinate) and s.type != "Rotation"
    ]
    push = ("{1, 2} N", "{1, 2, 3} N")[n == 3]
    twist = ("2 N.m", "{3, -1, 2} N.m")[n == 3]
    carried = (
        f"\n  frame tip{k};\n  mass 1.7 kg at tip{k} * {{{('0.2, -0.1', '0.2, -0.1, 0.3')[n == 3]}}} m;\n  inertia "
        + ("0.4 kg.m^2", "diag({2, 3, 4} kg.m^2)")[n == 3]
        + f" on tip{k};"
    )
    given = ", ".join(filter(None, (f"stand{k} -> tip{k}", values(package, name, k))))
    return f"""{swaying(f"base{k}", n, k)}
  frame stand{k} = base{k}{place};{moving(f"tip{k}", n, f" * trans({ARM[n]} m){place}", k) if closes else carried}
  {"cut " if closes and k else ""}{name} part{k}({given});
  force {push} on tip{k};
  torque {twist} on tip{k};
  output reaction{k} = reaction(part{k});
  output moment{k} = moment(part{k});{looked_at(f"tip{k}", n)}{"".join(told)}"""


def flanges(part: ast.Model) -> list[ast.Input]:
    """Return the inputs that stand for angles and lengths of others: a part acts on these."""
    return [s for s in part.body if isinstance(s, ast.Input) and s.type in ("Angle", "Length")]


def of_other(package: str, name: str, n: int, k: int) -> str:
    """Write a constraint or a force between bodies that move freely, or between coordinates."""
    part = first(package)[name]
    lines, binds = [], []
    if any(isinstance(s, ast.Frame) and s.name == "from" for s in part.body):
        lines.append(swaying(f"base{k}", n, k))
        binds.append(f"from = base{k}")
    if any(isinstance(s, ast.Frame) and s.name == "over" for s in part.body):
        lines.append(swaying(f"over{k}", n, k + 2))
        binds.append(f"over = over{k}")
    if any(isinstance(s, ast.Frame) and s.name == "to" for s in part.body):
        away = ("{0.6, 0.7}", "{0.6, 0.7, 0.5}")[n == 3]
        lines.append(moving(f"tip{k}", n, f" * trans({away} m - time*{away} m/s)" + LYING.get(name, ""), k))
        binds.append(f"to = tip{k}")
    for i, s in enumerate(flanges(part)):
        kind, unit = ("Length", "m") if s.type == "Length" else ("Angle", "rad")
        lines.append(
            f"\n  coordinate {kind} {s.name}{k} ~ 0.{i + 3 + k} {unit};\n  initial der({s.name}{k}) ~ 0.{i + 5 + k} {unit}/s;"
            f"\n  kinetic 1/2*1.{i} kg{'.m^2' if unit == 'rad' else ''}*der({s.name}{k})^2;\n  force {i + 1} N{'.m' if unit == 'rad' else ''} on {s.name}{k};"
        )
        binds.append(f"{s.name} = {s.name}{k}")
    for coordinate in (s for s in part.body if isinstance(s, ast.Coordinate)):
        stiff, damping = ("3 N/m", "1 N.s/m") if coordinate.type == "Length" else ("3 N.m/rad", "1 N.m.s")
        own = f"part{k}.{coordinate.name}"
        lines.append(
            f"\n  potential 1/2*({stiff})*{own}^2;\n  damping {damping} on {own};\n  force 2 {stiff[2:].split('/')[0]} on {own};"
        )
    given = ", ".join(filter(None, (*binds, values(package, name, k))))
    points = [s.name for s in part.body if isinstance(s, ast.Point)]
    asked = "".join(
        f"\n  output {p}{k} = pos(part{k}.{p});\n  output {p}_rate{k} = vel(part{k}.{p});" for p in points
    )
    labels = [s.label.name for s in part.body if isinstance(s, ast.Constraint) and s.label is not None]
    asked += "".join(f"\n  output {label}{k} = multiplier(part{k}.{label});" for label in labels)
    if any(s.name == "y" for s in part.body if isinstance(s, (ast.State, ast.Discrete, ast.Output))):
        asked += f"\n  output y{k} = part{k}.y;"
    kind = f"Heir{name}" if part.partial else name
    return f"{''.join(lines)}\n  {kind} part{k}({given});{asked}"


def heirs(name: str, n: int) -> str:
    """Write what states the curve or the surface of a part that leaves it to its heir."""
    if name.startswith("MagicFormula"):
        stated = "let kappa = 0.03; let alpha = -0.05 rad; let gamma = 0.02 rad; let Fz = 3500 N;"
        return f"model Heir{name}\n  extends {name};\n  {stated}\n  output told = {{Fx, Fy, Mz/1 m, Mx/1 m}};\nend Heir{name};\n"
    if name == "PointOnSurface":
        off = "p[3] - 0.1 m - p[1]*p[2]/2 m"
    else:
        off = "p[2] - p[1]^2/2 m" if n == 2 else "{p[2] - p[1]^2/2 m, p[3] - p[1]^3/3 m^2}"
    return f"model Heir{name}\n  extends {name};\n  let off = {off};\nend Heir{name};\n"


def in_a_model(package: str, name: str, n: int, text: str) -> Model:
    """Return a file that imports a package, with a model of some statements."""
    g = ("{1, -9.81} m/s^2", "{1, 2, -9.81} m/s^2")[n == 3]
    head = heirs(name, n) if name and first(package)[name].partial else ""
    whole = f"{head}model M\n  gravity {g};{text}\n  experiment(stop = 1 s);\nend M;"
    return Model((statement("import", f"import mech.{package}.*;"), statement("text", whole)))


def agree(model: Model) -> None:
    """Assert that a model is the same with the second text of the library."""
    twin = another_library(model, Random(1))
    assert twin is not None
    assert "import" not in twin.model.text()
    found = compare_twin(compiled(model.text()), twin, 1)
    if found is None:  # what switches is compared by its motion
        one, other = (
            mechc.loads(text).simulate(tolerance=1e-10) for text in (model.text(), twin.model.text())
        )
        assert one.outcome is other.outcome
        told = [s.name for s in one.problem.states if s.kind in ("coordinate", "state")]
        told += [o.name for o in one.problem.outputs if o.name in ("y0", "y1")]
        for quantity in told:
            assert np.abs(one[quantity][-1] - other[quantity][-1]) < 1e-7, quantity
        return
    assert found == [], "\n".join(d.text for d in found)


@pytest.mark.parametrize("package", PACKAGES)
def test_every_part_has_a_counterpart(package: str) -> None:
    """Same names, kinds and order of what others may give, bind or ask for."""
    there = {name: part for name, part in first(package).items() if (package, name) in EVERY}
    assert there.keys() == second(package).keys() - {name for _, name in HALVES}
    for name, part in there.items():
        assert declared(part) == declared(second(package)[name]), name
        others = quantities(second(package)[name])
        alike = {n: size for n, size in quantities(part).items() if n in others}
        assert alike == {n: others[n] for n in alike}, name
    assert set(functions(package)) | there.keys() <= definitions(package).keys()


@pytest.mark.parametrize(("package", "name"), EVERY)
def test_every_value_is_given(package: str, name: str) -> None:
    """Masses follow from densities; all else has another value than its default."""
    given = {m.partition(" = ")[0] for m in values(package, name, 1).split(", ") if " = " in m}
    names = [s.name for s in first(package)[name].body if isinstance(s, ast.Parameter)]
    names += [
        s.name
        for s in first(package)[name].body
        if isinstance(s, ast.Input) and s not in flanges(first(package)[name])
    ]
    assert given == set(names) - ({"m"} if "density" in names else set())


def in_every_space(package: str) -> tuple[int, ...]:
    """Return the spaces in which the parts of a package may stand."""
    both = {"couplings", "elements", "fields", "vehicle"}
    return (2, 3) if package in both else (3,) if package in ("spatial", "space") else (2,)


def may_stand(package: str, name: str, n: int) -> bool:
    """Tell whether a part may stand in a space: some need three axes."""
    return (package, name) not in (IN_SPACE if n == 2 else IN_THE_PLANE)


UNBOUND = [
    (p, name) for p, name in EVERY if not any(isinstance(s, ast.Constraint) for s in first(p)[name].body)
]
HOLDING = [
    (p, name, n)
    for p, name in EVERY
    if (p, name) not in UNBOUND
    for n in in_every_space(p)
    if may_stand(p, name, n)
]


LONG = {("vehicle", name) for name in ("Tyre", "MagicFormula", "Tyre62", "MagicFormula62")}
"""Parts that take seconds."""


@pytest.mark.parametrize(
    ("package", "name"),
    [pytest.param(*part, marks=[pytest.mark.slow] if part in LONG else []) for part in UNBOUND],
)
def test_every_part_agrees(package: str, name: str) -> None:
    """With defaults and with other values, on bodies that move freely, at random states."""
    kinds = {type(s) for s in first(package)[name].body}
    for n in (n for n in in_every_space(package) if may_stand(package, name, n)):
        if ast.Place in kinds:
            text = "".join(of_joint(package, name, n, k, closes=False) for k in (0, 1))
        elif ast.Mass in kinds:
            text = "".join(of_body(package, name, n, k) for k in (0, 1))
        else:
            text = "".join(of_other(package, name, n, k) for k in (0, 1))
        agree(in_a_model(package, name, n, text))


def valued(*places: tuple[object, ...]) -> list[object]:
    """Return each place with other values than the defaults, and with these; in space they take long."""

    def case(place: tuple[object, ...], k: int) -> object:
        marks = [pytest.mark.slow] if place[0] == "spatial" else []
        return pytest.param(
            *place, k, id="-".join(map(str, (*place, ("defaults", "other values")[k]))), marks=marks
        )

    return [case(place, k) for place in places for k in (0, 1)]


@pytest.mark.parametrize(
    ("package", "name", "n", "k"), valued(*(h for h in HOLDING if h[1:] != ("PointOnSurface", 2)))
)
def test_every_constraint_agrees(package: str, name: str, n: int, k: int) -> None:
    """With its multipliers, between bodies that move freely, where assembly puts them."""
    agree(in_a_model(package, name, n, of_other(package, name, n, k)))


@pytest.mark.parametrize(("package", "name", "k"), valued(*JOINTS))
def test_every_joint_closes_loops_alike(package: str, name: str, k: int) -> None:
    n = 2 if package == "planar" else 3
    agree(in_a_model(package, name, n, of_joint(package, name, n, k, closes=True)))


@pytest.mark.parametrize("package", slow_among(["control"], [p for p in PACKAGES if functions(p)]))
def test_every_function_agrees(package: str) -> None:
    """Up to rounding, however small its values are."""
    names = functions(package)
    asked = {name: ASKED.get(name, f"{name}()").rpartition("; ") for name in names}
    outputs = "".join(
        f"\n  {lets}{end}output {name} = {value};" for name, (lets, end, value) in asked.items()
    )
    model = in_a_model(package, "", 3, moving("base", 3, "", 0) + outputs)
    twin = another_library(model, Random(1))
    assert twin is not None
    one, other = (c.outputs(c.start()) for c in (compiled(model.text()), compiled(twin.model.text())))
    told = [n for n in one if n.partition("[")[0] in names]
    assert {n.partition("[")[0] for n in told} == set(names)
    assert {n: one[n] for n in told} == {n: pytest.approx(other[n], rel=1e-14, abs=0) for n in told}
