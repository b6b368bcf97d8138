"""Falling four-bar by Exudyn's generalised-alpha, over a ladder of steps; all of its time is that of its C++ solver.

Standard input: {"lengths", "ground", "gravity", "angles", "stop", "steps", "longest"}; prints rows
[method, step, seconds, [three angles against the world, their rates]] as JSON.
"""

import json
import sys
import time

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    LoadMassProportional,
    MarkerBodyMass,
    MarkerBodyPosition,
    NodeRigidBody2D,
    ObjectGround,
    ObjectJointRevolute2D,
    ObjectRigidBody2D,
)

case = json.load(sys.stdin)
lengths, angles = case["lengths"], case["angles"]


def solve(step, index):
    container = exu.SystemContainer()
    system = container.AddSystem()
    ground = system.AddObject(ObjectGround())
    at, nodes, bars = np.zeros(2), [], []
    for length, angle in zip(lengths, angles, strict=True):
        along = length * np.array([np.cos(angle), np.sin(angle)])
        centre = at + along / 2
        node = system.AddNode(NodeRigidBody2D(referenceCoordinates=[*centre, angle]))
        bar = ObjectRigidBody2D(physicsMass=1, physicsInertia=length**2 / 12, nodeNumber=node)
        nodes.append(node)
        bars.append(system.AddObject(bar))
        mass = system.AddMarker(MarkerBodyMass(bodyNumber=bars[-1]))
        system.AddLoad(LoadMassProportional(markerNumber=mass, loadVector=[0, -case["gravity"], 0]))
        at = at + along

    def marker(body, x):
        return system.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[x, 0, 0]))

    ends = [(ground, 0.0)]
    for bar, length in zip(bars, lengths, strict=True):
        ends += [(bar, -length / 2), (bar, length / 2)]
    ends.append((ground, case["ground"]))
    for first, second in zip(ends[::2], ends[1::2], strict=True):
        system.AddObject(ObjectJointRevolute2D(markerNumbers=[marker(*first), marker(*second)]))
    system.Assemble()
    settings = exu.SimulationSettings()
    settings.solutionSettings.writeSolutionToFile = False
    settings.linearSolverType = exu.LinearSolverType.EXUdense
    run = settings.timeIntegration
    run.endTime, run.numberOfSteps, run.verboseMode = case["stop"], round(case["stop"] / step), 0
    run.newton.useModifiedNewton = True
    run.generalizedAlpha.computeInitialAccelerations = True
    run.generalizedAlpha.spectralRadius = 0.9
    run.generalizedAlpha.useIndex2Constraints = run.generalizedAlpha.useNewmark = index == 2
    begun = time.process_time()
    system.SolveDynamic(settings)
    seconds = time.process_time() - begun
    kinds = exu.OutputVariableType
    turned = [system.GetNodeOutput(n, kinds.Coordinates)[2] for n in nodes]
    rates = [system.GetNodeOutput(n, kinds.Coordinates_t)[2] for n in nodes]
    return seconds, [*(np.array(turned) + angles), *rates]


rows = []
for index in (3, 2):
    for step in case["steps"]:
        seconds, state = solve(step, index)
        rows.append([f"generalised-alpha, index {index}", step, seconds, [float(x) for x in state]])
        if seconds > case["longest"]:
            break
print("\n" + json.dumps(rows))
