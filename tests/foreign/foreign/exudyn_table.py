"""Systems of Exudyn's tests and examples, in our own words, beside what Exudyn makes of them (``exudyn/exudyn_reference.py``)."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
from msgspec import Struct

import mechc
from foreign import exudyn_events, exudyn_first, exudyn_masses, exudyn_planar, exudyn_spatial
from foreign.exudyn_case import Example

REFERENCE = Path(__file__).parents[1] / "exudyn" / "reference.json"


class Compared(Struct, frozen=True):
    """What Exudyn comes to: ``doubt`` is how far two of its runs or extrapolations differ."""

    stop: float
    values: tuple[float, ...]
    doubt: float


def reference() -> dict[str, Compared]:
    """Return what was stored, by the names of the systems."""
    kept = json.loads(REFERENCE.read_text(encoding="utf-8"))
    return {n: Compared(r["stop"], tuple(r["values"]), r["doubt"]) for n, r in kept.items()}


BOUND = 1e-10
"""Of the largest value, beside the doubt of Exudyn's own numbers; the largest that was seen is 2e-11."""


def agreement(example: Example, kept: Compared) -> float:
    """Return the largest difference from Exudyn over the largest value, without the doubt of that."""
    solution = mechc.loads(example.text).simulate(stop=kept.stop, tolerance=1e-12, estimate_error=False)
    assert solution.outcome.value == "completed", solution.message
    found = np.array([solution[name][-1] for name in example.read])
    expected = np.array(kept.values)
    return max(0.0, float(np.abs(found - expected).max()) - kept.doubt) / float(np.abs(expected).max())


EXAMPLES = (
    *exudyn_first.SYSTEMS,
    *exudyn_masses.SYSTEMS,
    *exudyn_planar.SYSTEMS,
    *exudyn_spatial.SYSTEMS,
    *exudyn_events.SYSTEMS,
)

QUICK = {
    *(e.name for e in exudyn_first.SYSTEMS),
    "spring_for_two_seconds",
    "block_of_points",
    "train_of_gears",
    "crank_slider_and_spring",
    "two_arms_on_oil",
    "branching_tree",
    "bricard",
    "slider_crank_in_space",
    "arm_of_six",
    "springs_that_break",
    "rod_that_is_let_go",
    "pin_in_a_slot",
}
"""One of each kind; the tests of the others are marked slow."""

WAITING = (
    (
        "chains of ANCF cables, geometrically exact beams, plates",
        "TestModels/ANCF*, geometricallyExactBeam*, rightAngleFrame, LShapeGeomExactBeam2D; Examples/ANCF*, beamTutorial, pendulumGeomExactBeam2D",
        "beams and cables that bend",
    ),
    (
        "floating frames of reference from finite elements",
        "TestModels/objectFFRF*, NGsolve*, abaqusImportTest, ACFtest, superElementRigidJointTest; Examples/NGsolve*, CMSexampleCourse, serialRobotFlexible",
        "modal bodies from finite elements",
    ),
    (
        "belts and reeving systems",
        "Examples/beltDrive*, reevingSystem*, craneReevingSystem, bungeeJump, sliderCrank3DwithANCFbeltDrive; TestModels/ACNFslidingAndALEjointTest",
        "axially moving cables",
    ),
    (
        "spheres on triangles and quads, cylinders and rolls on them, heaps of particles",
        "TestModels/sphereTriangleTest, createSphereQuadContact, createSphereTriangleContact, generalContact*, ConvexContactTest; Examples/tippeTop, particles*",
        "contact with meshes",
    ),
    (
        "bearings and chains of many rollers",
        "TestModels/ballBearingTest; Examples/ballBearningModel, rollerBearningModel, chainDriveExample",
        "to be written: circles in grooves and on teeth, by stiffness and dry friction",
    ),
    (
        "impacts by laws of stiffness that give a restitution, and adhesion",
        "TestModels/contactSphereSphereTest, contactSphereSphereTestEAPM",
        "to be written: laws with memory of the greatest depth",
    ),
    (
        "a rope as a spring over sheaves in space",
        "TestModels/reevingSystemSpringsTest",
        "to be written: tangents of circles in planes of their own",
    ),
    (
        "torques by three angles of a relative rotation",
        "TestModels/connectorRigidBodySpringDamperTest, MiniExamples/ObjectConnectorRigidBodySpringDamper",
        "to be written: torques that have no energy",
    ),
    (
        "variants of the systems above for optimisation, parameter studies, learning, drawing, storage, communication or co-simulation",
        "Examples/parameterVariationExample, geneticOptimizationExample, minimizeExample, testGym*, ROS*, TCPIP*, solutionViewerTest; TestModels/simulatorCouplingTwoMbs",
        "nothing new moves",
    ),
)
"""What is not written, and what it waits for."""


def covered() -> set[str]:
    """Return the tests and examples that the systems stand for."""
    return {part.split("/")[-1] for e in EXAMPLES for part in re.split("[;,] ", e.source)}
