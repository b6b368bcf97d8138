"""Form and run the systems by Exudyn, and write what they come to in ``reference.json``: ``python exudyn_reference.py [NAME ...]``,
where exudyn is installed (made with 1.13).

Each function of ``exudyn_*.py`` makes one system, with the numbers of Exudyn's TestModels and Examples where the table says so. Where there
are constraints, the motion is found by the trapezoidal rule, with steps of 4, 2 and 1, of which the error is removed (Richardson); the
difference of both results is its doubt. Elsewhere a Runge-Kutta method goes there twice, with steps of 2 and 1 or at two tolerances.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import exudyn_events
import exudyn_first
import exudyn_masses
import exudyn_planar
import exudyn_spatial
import numpy as np
from exudyn_forming import Scene, System, exu

SYSTEMS: dict[str, System] = {
    **exudyn_first.SYSTEMS,
    **exudyn_masses.SYSTEMS,
    **exudyn_planar.SYSTEMS,
    **exudyn_spatial.SYSTEMS,
    **exudyn_events.SYSTEMS,
}
REFERENCE = Path(__file__).with_name("reference.json")


def ended(system: System, n: int) -> np.ndarray:
    """Run one system with n times its fewest steps; return what is compared."""
    scene = Scene(exu.SystemContainer().AddSystem())
    read = system.make(scene)
    scene.mbs.Assemble()
    settings = exu.SimulationSettings()
    time = settings.timeIntegration
    time.verboseMode = 0
    settings.solutionSettings.writeSolutionToFile = False
    if system.method == "implicit":
        method = exu.DynamicSolverType.GeneralizedAlpha
        time.generalizedAlpha.spectralRadius = 1.0
        time.generalizedAlpha.useIndex2Constraints = True
        time.generalizedAlpha.useNewmark = True
        time.newton.relativeTolerance = time.newton.absoluteTolerance = 1e-12
    elif system.method == "explicit":
        method = exu.DynamicSolverType.RK67
        time.automaticStepSize = False
    else:
        method = exu.DynamicSolverType.DOPRI5
        time.minimumStepSize = 1e-7
        time.relativeTolerance = time.absoluteTolerance = 10.0 ** (-9 - n)
    begun, stages = 0.0, [*scene.stages, (system.stop, lambda: None)]
    for end, change in stages:
        time.startTime, time.endTime = begun, end
        time.numberOfSteps = n * round((end - begun) / system.step) if system.step else 200
        scene.mbs.SolveDynamic(settings, solverType=method, updateInitialValues=True)
        change()
        begun = end
    return np.array(read(), float)


def solved(system: System) -> tuple[np.ndarray, float]:
    """Return what is compared, and its doubt."""
    if system.method == "implicit":
        runs = [ended(system, n) for n in (1, 2, 4)]
        coarse, fine = (4 * runs[1] - runs[0]) / 3, (4 * runs[2] - runs[1]) / 3
    else:
        coarse, fine = (ended(system, n) for n in (1, 2))
    return fine, float(np.abs(fine - coarse).max())


def main(names: list[str]) -> None:
    found = json.loads(REFERENCE.read_text(encoding="utf-8")) if REFERENCE.exists() else {}
    for name, system in SYSTEMS.items():
        if names and name not in names:
            continue
        values, doubt = solved(system)
        print(f"{name:28s} {doubt:.1e}", np.round(values, 6))
        found[name] = {
            "stop": system.stop,
            "values": [float(f"{x:.12g}") for x in values],
            "doubt": float(f"{doubt:.2g}"),
        }
        kept = {name: found[name] for name in SYSTEMS if name in found}
        REFERENCE.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
