"""The examples of Modelica's mechanical libraries that are written again in ``tests/foreign/modelica``.

Each row has the name in the library, the file here, which quantity of the reference is which of ours, and where the reference
ends to be one. The numbers of the models are those of github.com/modelica/ModelicaStandardLibrary, version 4.0.0 (4.1.0 of
CompareBraking... and ActuatorWithNoise; of the master branch GearGrounded, 21395bb, LeverGrounded, ac8fc82, and DemoFreeWheel, 72192fa), and of github.com/dzimmer/PlanarMechanics, cde02c4; the words are our own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from modelica_noise import uniform

FOLDER = Path(__file__).resolve().parents[1] / "foreign" / "modelica"
PUBLISHED = "github.com/modelica/MAP-LIB_ReferenceResults, d6a2b9b (Dymola 2020x, tolerance 1e-6)"
COMPUTED = "SciPy: the same system by other equations"


class Example(NamedTuple):
    """One row of the table; ``until`` is where the reference is off by more than it may, for a reason that ``note`` gives; ``inputs`` gives tables of inputs."""

    name: str
    reads: Mapping[str, str]
    file: str = ""
    until: float | None = None
    note: str = ""
    computed: bool = False
    inputs: Callable[[], Mapping[str, Any]] = dict

    @property
    def path(self) -> Path:
        """The text of the model."""
        return FOLDER / f"{self.file or self.name}.mech"

    @property
    def source(self) -> str:
        """Who computed the reference."""
        return COMPUTED if self.computed else PUBLISHED


def turn(there: str, here: str) -> dict[str, str]:
    """An angle and its rate."""
    return {f"{there}.phi": f"{here}.angle", f"{there}.w": f"der({here}.angle)"}


def slide(there: str, here: str) -> dict[str, str]:
    """A place along a line and its rate."""
    return {f"{there}.s": here, f"{there}.v": f"der({here})"}


def three(there: str, here: str, which: str = "123") -> dict[str, str]:
    """Components of a vector."""
    return {f"{there}[{i}]": f"{here}[{i}]" for i in which}


ROTATIONAL = (
    Example("Rotational.First", {"damper.phi_rel": "-gear_side.angle", **turn("inertia3", "load")}),
    Example(
        "Rotational.FirstGrounded",
        {"damper.phi_rel": "-gear_side.angle", **turn("inertia3", "load")},
        "Rotational.First",
    ),
    Example(
        "Rotational.Backlash",
        {
            "elastoBacklash.phi_rel": "second.angle",
            "elastoBacklash.w_rel": "der(second.angle)",
            "springDamper.phi_rel": "first.angle",
            "springDamper.w_rel": "der(first.angle)",
        },
    ),
    Example(
        "Rotational.CoupledClutches",
        {
            **turn("J1", "one"),
            "clutch1.w_rel": "der(two.angle) - der(one.angle)",
            "clutch2.w_rel": "der(three.angle) - der(two.angle)",
            "clutch3.w_rel": "der(four.angle) - der(three.angle)",
        },
    ),
    Example(
        "Rotational.Friction",
        {
            **turn("inertia3", "motor"),
            "clutch.w_rel": "der(plate.angle) - der(motor.angle)",
            "spring.phi_rel": "load.angle - plate.angle",
        },
    ),
    Example(
        "Rotational.ElasticBearing",
        {**turn("load", "load"), **turn("shaft", "shaft"), "springDamper.phi_rel": "housing.angle"},
    ),
    Example("Rotational.LossyGearDemo1", turn("Inertia2", "load")),
    Example("Rotational.LossyGearDemo2", turn("Inertia2", "load")),
    Example("Rotational.LossyGearDemo3", turn("Inertia2", "second")),
    *(
        Example(
            f"Rotational.{name}",
            {**turn("inertiaIn", "inner"), "oneWayClutch.w_rel": "der(outer.angle) - der(inner.angle)"},
        )
        for name in ("OneWayClutch", "OneWayClutchDisengaged")
    ),
    Example("Rotational.RollingWheel", turn("inertia", "rotor")),
    Example(
        "Rotational.SimpleGearShift",
        {
            **turn("engine", "engine"),
            **turn("load", "load"),
            "clutch.w_rel": "der(ring.angle) - der(engine.angle)",
        },
    ),
    Example(
        "Rotational.EddyCurrentBrake",
        {"inertia.phi": "angle", "heatCapacitor.T": "T", "eddyCurrentTorque.lossPower": "loss"},
    ),
    Example(
        "Rotational.GenerationOfFMUs",
        {
            **turn("directInertia.inertia", "whole"),
            "inertia2a.phi": "a2.angle",
            "inertia2b.w": "der(b2.angle)",
            "inertia3a.w": "der(a3.angle)",
            "inertia3b.phi": "b3.angle",
        },
    ),
)

TRANSLATIONAL = (
    Example("Translational.Accelerate", {"accelerate.s": "flange", "accelerate.v": "speed"}),
    Example("Translational.Brake", {**slide("mass1", "one.s"), "mass2.v": "der(two.s)"}),
    Example(
        "Translational.Damper",
        {
            "damper1.s_rel": "gap[1]",
            "damper2.v_rel": "rate[2]",
            "springDamper3.s_rel": "gap[3]",
            "springDamper3.v_rel": "rate[3]",
        },
    ),
    Example(
        "Translational.EddyCurrentBrake",
        {"mass.s": "s", "heatCapacitor.T": "T", "eddyCurrentForce.lossPower": "loss"},
    ),
    Example(
        "Translational.ElastoGap",
        {
            "elastoGap1.v_rel": "der(two.s)",
            "elastoGap2.s_rel": "gap2",
            "springDamper1.v_rel": "der(one.s)",
            "springDamper2.s_rel": "gap1",
        },
    ),
    Example(
        "Translational.Friction",
        {**slide("mass", "three.s"), **slide("stop1", "one.s"), **slide("stop2", "two.s")},
    ),
    Example(
        "Translational.GenerationOfFMUs",
        {
            **slide("directMass.mass", "whole.s"),
            "mass2a.s": "a2.s",
            "mass2b.v": "der(b2.s)",
            "mass3a.v": "der(a3.s)",
            "mass3b.s": "b3.s",
        },
    ),
    Example(
        "Translational.HeatLosses",
        {
            "damper.s_rel": "gap_",
            **slide("massWithStopAndFriction", "last.s"),
            "springDamper.s_rel": "span[1]",
            "springDamper1.s_rel": "span[2]",
        },
        until=0.42,
        note="at its first hard stop, at 0.4285 s, the reference loses the momentum of the neighbouring mass, too: 0.68 m/s of "
        "1 kg within no time, at a force of 7 N (the velocity of the stopped mass is set, and the relative velocity of the spring "
        "beside it is a state that is kept); SciPy on Newton's law with a stiff stop goes on as mechc does to 2e-6, and as the "
        "reference where the neighbour is stopped by hand (`test_third_programs`)",
    ),
    Example(
        "Translational.InitialConditions",
        {
            **slide("m1", "m1.s"),
            "m3.s": "m3.s",
            "sd1.s_rel": "span[1]",
            "sd1.v_rel": "rate[1]",
            "sd2.s_rel": "span[2]",
        },
    ),
    Example(
        "Translational.Oscillator",
        {**slide("mass1", "one.s"), "damper1.s_rel": "span", "damper1.v_rel": "rate"},
    ),
    Example(
        "Translational.PreLoad",
        {
            "friction.v_rel": "rub",
            "innerContactA.s_rel": "gap[1]",
            "innerContactB.s_rel": "gap[2]",
            "outerContactB.s_rel": "gap[3]",
        },
    ),
    Example("Translational.Sensors", slide("mass", "mass.s")),
    Example(
        "Translational.SignConvention", {"mass1.s": "one.s", "mass2.s": "two.s", **slide("mass3", "three.s")}
    ),
    Example("Translational.Vehicle", {**slide("vehicle", "alone"), **slide("vehicle1", "train")}),
    Example("Translational.WhyArrows", {**slide("mass1", "one.s"), **slide("inertia2", "two.s")}),
)


def measured_noise() -> Mapping[str, Any]:
    """Return the noise of a sensor that is read 200 times a second."""
    numbers = uniform(1601, -0.01, 0.01, "ActuatorWithNoise.motor.uniformNoise")
    return {"noise": ([k / 200 for k in range(len(numbers))], numbers)}


INVERSE = "the inverse of the lag is written out, u = y + T y'; the original lets a solver exchange its input and its output"
BLOCKS = (
    Example(
        "Blocks.PID_Controller",
        {
            **turn("inertia1", "motor"),
            "PI.I.y": "integral",
            "integrator.y": "set_",
            "spring.phi_rel": "twist",
        },
    ),
    Example(
        "Blocks.Noise.ActuatorWithNoise",
        {
            "controller.busdelay.y": "bus.y",
            "controller.speed_PI.x": "speed_x",
            "controller.positionToSpeed.x": "rate.lagging",
            "controller.position_PI.x": "place_x",
            "gearbox.phi_rel": "twist",
            "slewRateLimiter.y": "target.y",
            "rodMass.s": "rod.s",
            "rodMass.v": "der(rod.s)",
            "elastoGap.s_rel": "gap",
        },
        inputs=measured_noise,
        note="the noise is an input; Modelica's generator, written again in `modelica_noise`, gives its table. The rows are those of "
        "version 4.1.0 (6db6c50, Dymola 2023x): those before had another hash of the name, and so other numbers",
    ),
    Example("Blocks.InverseModel", {"firstOrder1.y": "filter.y", "firstOrder2.y": "again.y"}, note=INVERSE),
)

TWO = {**turn("revolute1", "r1"), **turn("revolute2", "r2")}
WHEELS = {
    "wheelSet.x": "free.x",
    "wheelSet.y": "free.y",
    "wheelSet.phi": "free.angle",
    "wheelSet.theta1": "left.angle",
    "wheelSet.der_theta1": "der(left.angle)",
}

ELEMENTARY = (
    Example("Pendulum", turn("rev", "rev")),
    Example("DoublePendulum", TWO),
    Example(
        "DoublePendulumInitTip",
        TWO,
        until=4.0,
        note="a chaotic motion: at 5 s the reference is 2e-3 from SciPy, mechc 2e-8",
    ),
    Example("ForceAndTorque", TWO),
    Example(
        "FreeBody",
        {
            **three("body.body.frame_a.r_0", "r"),
            **three("body.v_0", "v", "2"),
            **three("body.body.w_a", "w", "23"),
        },
    ),
    Example(
        "HeatLosses",
        {
            **three("body1.frame_a.r_0", "r1", "12"),
            **three("body2.frame_a.r_0", "r2", "12"),
            **three("body3.frame_a.r_0", "r3", "12"),
            "springDamperSeries.s_damper": "row.oil",
        },
    ),
    Example("LineForceWithTwoMasses", {**turn("revolute1", "hinge"), **turn("revolute2", "hinge")}),
    Example("PendulumWithSpringDamper", {**turn("revolute", "turn"), **slide("prismatic", "slide.position")}),
    Example(
        "PointGravity",
        {
            **three("body1.frame_a.r_0", "f1.position", "12"),
            **three("body2.frame_a.r_0", "f2.position", "12"),
        },
        until=3.0,
        note="a near miss of the centre: at 3.8 s the reference is 8e-3 from SciPy, mechc 2e-7",
    ),
    Example(
        "PointGravityWithPointMasses",
        {
            **three("body1.r_0", "t[1].position", "12"),
            **three("body2.r_0", "t[2].position", "12"),
            **three("body3.r_0", "t[3].position", "12"),
        },
    ),
    Example(
        "PointGravityWithPointMasses2",
        {
            **three("freeMotion.r_rel_a", "joint.position", "13"),
            **three("referenceSystem.pointMass1.w_a", "w", "2"),
            **three("referenceSystem.pointMass6.frame_a.r_0", "r1", "13"),
        },
    ),
    Example("RollingWheel", {"wheel1.x": "x", "wheel1.y": "y", **three("wheel1.angles", "turn")}),
    Example("RollingWheelSetDriving", WHEELS),
    Example("RollingWheelSetPulling", WHEELS),
    Example(
        "SpringDamperSystem",
        {
            **three("body1.frame_a.r_0", "r", "12"),
            **three("body1.v_0", "v", "2"),
            **three("body1.w_a", "w", "3"),
            **slide("p2", "slide.position"),
        },
    ),
    Example("SpringMassSystem", {**slide("p1", "p1.position"), **slide("p2", "p2.position")}),
    Example(
        "SpringWithMass",
        {"body.frame_a.r_0[2]": "joint.position[2]", "body.v_0[2]": "der(joint.position[2])"},
    ),
    Example(
        "ThreeSprings",
        {
            **three("body1.frame_a.r_0", "joint.position"),
            **three("body1.v_0", "v", "12"),
            **three("body1.w_a", "w", "13"),
        },
    ),
    Example("Surfaces", {"prismatic.s": "s", "prismatic.v": "v"}),
    Example("UserDefinedGravityField", turn("rev", "rev")),
)

LOOPS = (
    Example("PlanarFourbar", turn("revolute1", "r1")),
    Example("PlanarLoops_analytic", turn("rev", "rev")),
    Example("Fourbar1", turn("j1", "j1")),
    Example("Fourbar2", turn("j1", "j1")),
    Example("Fourbar_analytic", turn("j1", "j1"), "MultiBody.Loops.Fourbar2"),
    Example("Engine1a", turn("inertia", "bearing")),
    Example("Engine1b", turn("inertia", "bearing")),
    Example("Engine1b_analytic", turn("inertia", "bearing"), "MultiBody.Loops.Engine1b"),
    Example("EngineV6", turn("load", "bearing")),
    Example("EngineV6_analytic", turn("load", "bearing")),
)

EFFECTS = (
    Example("ActuatedDrive", {**turn("revolute", "hinge"), **turn("rotor1D", "rotor")}),
    Example(
        "BevelGear1D",
        {
            **turn("inertia2", "right"),
            "revolute1.phi": "r1.angle",
            "revolute2.phi": "r2.angle",
            "revolute3.phi": "r3.angle",
        },
        until=0.3,
        note="it passes near the singular position of its three hinges, where the first turns with 3000 rad/s, and is chaotic: SciPy "
        "on Euler's equations agrees with mechc to 2e-7 up to 0.5 s (`test_third_programs`) and to 1e-6 up to 0.7 s, the reference "
        "is off by 4e-4 at 0.4 s and by 1e-2 at 0.48 s, and at 1 s mechc says that nothing is left of the accuracy",
    ),
    Example(
        "GearConstraint", {**turn("inertia2", "slow"), **turn("gearConstraint.actuatedRevolute_b", "slow")}
    ),
    Example(
        "GyroscopicEffects",
        {
            **three("bodyCylinder2.body.w_a", "w1", "23"),
            **three("bodyCylinder3.body.w_a", "w2"),
            **turn("rotor1D", "rotor"),
        },
    ),
    Example(
        "MovingActuatedDrive",
        {"r1.phi": "swing1.angle", **turn("revolute", "hinge"), **turn("rotor1D", "rotor")},
    ),
)

CONSTRAINTS = (
    Example(
        "RevoluteConstraint", {**three("bodyOfConstraint.body.w_a", "w2", "2"), "joint.phi": "joint.angle"}
    ),
    Example("SphericalConstraint", three("bodyOfConstraint.body.w_a", "w2", "23")),
    Example(
        "UniversalConstraint",
        {
            **three("bodyOfConstraint.body.w_a", "w2"),
            "joint.phi_a": "joint.angle[1]",
            "joint.phi_b": "joint.angle[2]",
        },
    ),
    Example(
        "PrismaticConstraint",
        {
            **three("bodyOfConstraint.r_0", "r2"),
            "jointPrismatic_x.s": "joint.position",
            "jointPrismatic_y.s": "joint2.position",
        },
    ),
)

ROBOT = {f"mechanics.r{i}.phi": f"r{i}.angle" for i in (1, 3, 5, 6)}
SYSTEMS = (
    Example(
        "OneAxis",
        {
            "axis.initializeFlange.phi_flange": "load.angle",
            "axis.gear.spring.phi_rel": "twist",
            "axis.controller.PI.x": "controller",
            "axis.motor.La.i": "motor.i",
        },
    ),
    Example(
        "FullRobot",
        {
            **ROBOT,
            "axis1.motor.La.i": "motor[1].i",
            "axis2.gear.spring.phi_rel": "twist2",
            "axis4.motor.La.i": "motor[4].i",
            "axis6.motor.C.v": "v6",
        },
        note="currents and springs that hold it at the start are those of the first row of the reference; no body has the moments of "
        "inertia of its first arm (0.001, 1.16, 0.001 kg.m^2), as mechc says",
    ),
)

PAIR = {"r1.angle": "r1.angle", "r2.angle": "r2.angle"}
CRAB = {"rail": "rail.position", "pin": "pin.angle"}
JUMP = "taken as it is: the inverse law falls from 1e4 N to 100 N at 1 m/s, below which it is made smooth"
SLIP = "the original adds 1e-4 m/s to the slip against a division by zero, which by SciPy is {} of the way; left out on both sides"
AROUND = {"slide": "slide.position", "pin": "pivot.angle", "roll": "roll"}
PLANAR = (
    Example("Pendulum", {"pin": "pin.angle"}),
    Example("PendulumExcited", {"pin": "pin.angle"}),
    Example("DoublePendulum", PAIR),
    Example("MeasureDemo", {**PAIR, **three("place", "place", "12"), **three("v", "v", "12")}),
    Example("CraneCrab", CRAB),
    Example("PowerDistanceDemo", {**CRAB, "distance": "distance"}),
    Example("ControlledCraneCrab", CRAB),
    Example("InvertedCraneCrab", {**CRAB, "F": "F"}),
    Example("FreeBody", {"y": "free.y"}),
    Example("KinematicLoop", {"slide": "slide.position", "pin": "r4.angle"}),
    Example(
        "KinematicLoop_DynamicStateSelection",
        {"slide": "slide.position", "pin": "r4.angle"},
        "PlanarMechanics.KinematicLoop",
    ),
    Example("PistonEngine", {"crank": "crank.angle"}),
    Example("PistonEngine_DynamicStateSelection", {"crank": "crank.angle"}, "PlanarMechanics.PistonEngine"),
    Example("CraneCrabTo3D", {**CRAB, "carrier": "carrier"}),
    Example("CounterSpin", {"x": "x", "phi": "phi"}),
    Example("TestDryFrictionWheel", AROUND, note=SLIP.format("7e-4")),
    Example("TestSlipBasedWheel", AROUND, note=SLIP.format("2e-4")),
    Example("TestIdealWheel", {"pin": "pivot.angle", "roll": "roll"}),
    Example(
        "SingleTrackWithEngine",
        {"x": "free.x", "y": "free.y", "angle": "free.angle", "castor": "castor.angle"},
    ),
    Example(
        "TwoTrackWithDifferentialGear",
        {"x": "free.x", "y": "free.y", "angle": "free.angle", "steer": "steer", "roll": "wheel[3].angle"},
    ),
    Example("SpurGear", {"b": "b", "motor": "motor"}),
    Example("PlanetaryGear", {"carrier": "carrier.angle", "ring": "ring"}),
    Example("SpringDamperDemo", {"x": "free.x", "y": "free.y"}),
    Example("SpringDemo", {"y": "slide.position"}),
    Example("TestAirDrag", {"pin": "pin.angle"}),
    Example("WheelBasedCraneCrab", {"x": "wheel.position", "pin": "pin.angle"}),
)

BRAKES = tuple(
    Example(name, {f"x{i}": f"x[{i}]" for i in (1, 2, 3, 4)}, computed=True, note=JUMP)
    for name in ("Rotational.CompareBrakingTorque", "Translational.CompareBrakingForce")
)


LATER = (
    *(
        Example(
            f"Translational.{name}",
            {"mass1.s": "fast.s", "mass2.s": "slow.s", "support": node},
            computed=True,
        )
        for name, node in (("GearGrounded", "support.s"), ("LeverGrounded", "pivot.s"))
    ),
    Example(
        "Rotational.DemoFreeWheel",
        {**turn("inertia2", "outer")},
        computed=True,
        note="an ideal freewheel; the original's slips by 1e-5 rad/s for each N.m, at most 1.6e-3 rad/s of 5",
    ),
    Example(
        "Rotational.HeatLosses",
        {
            "damper.phi_rel": "one.angle",
            "springDamper.phi_rel": "two.angle - one.angle",
            "springDamper.w_rel": "twisting",
            "elastoBacklash.phi_rel": "three.angle - two.angle",
            "clutch.phi_rel": "slip",
            "clutch.w_rel": "slipping",
            "inertia5.phi": "five.angle",
            "inertia5.w": "der(five.angle)",
            "oneWayClutch.phi_rel": "ahead",
            "oneWayClutch.w_rel": "leaving",
            "heat": "energy.dissipated",
        },
        computed=True,
        note="the file of its published rows, of several megabytes, was not to be had; the heat of all parts is compared, too",
    ),
)


STARTS = (
    Example(
        "MultiBody.Elementary.InitSpringConstant",
        {"c": "found"},
        computed=True,
        note="the reference stands still, as the model does: what is compared is the stiffness that the start finds, m g/(0.2 m)",
    ),
)


def within(folder: str, examples: tuple[Example, ...], computed: bool = False) -> tuple[Example, ...]:
    """Put the folder of the library before the names."""
    return tuple(example._replace(name=f"{folder}.{example.name}", computed=computed) for example in examples)


EXAMPLES = (
    *ROTATIONAL,
    *TRANSLATIONAL,
    *BLOCKS,
    *within("MultiBody.Elementary", ELEMENTARY),
    *within("MultiBody.Loops", LOOPS),
    *within("MultiBody.Rotational3DEffects", EFFECTS),
    *within("MultiBody.Constraints", CONSTRAINTS),
    *within("MultiBody.Systems.RobotR3", SYSTEMS),
    *within("PlanarMechanics", PLANAR, computed=True),
    *BRAKES,
    *STARTS,
    *LATER,
)
