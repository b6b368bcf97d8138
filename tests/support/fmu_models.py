"""FMUs of models for tests: made, and driven call by call."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import fmpy

from mechc.api import load, loads
from mechc.compiler.targets.fmu.export import Package, make_package, start_of
from mechc.compiler.targets.fmu.variables import Start
from mechc.fmu.export import equations_for

EXAMPLES = Path(__file__).parents[2] / "examples"

DRIVEN = """
model Driven "a damped oscillator with a force that is given as a table"
  parameter m = 2 kg;
  parameter k = 8 N/m;
  parameter c = 0.02 s*k;
  input Force F = 0.5 N;
  coordinate x = 0.3 m;
  initial der(x) = 0.1 m/s;
  kinetic 1/2*m*der(x)^2;
  potential 1/2*k*x^2;
  damping c on x;
  force F*cos(x/(1 m)) on x;
  output Force stretch = k*x;
  experiment(stop = 5 s, tolerance = 1e-8);
end Driven;
"""

STIFF = """
model Stiff "a relaxation oscillator, by an implicit method"
  parameter mu = 20;
  state x = 2;
  state w = 0;
  equation der(x) = w/(1 s);
  equation der(w) = (mu*(1 - x^2)*w - x)/(1 s);
  experiment(stop = 60 s, tolerance = 1e-10);
end Stiff;
"""

CHAIN = """
model Chain "fifty beads on a string"
  structural parameter Integer n = 50;
  coordinate Angle a[n] = {0.02 rad*i for i in 1:n};
  for i in 1:n loop
    kinetic 1/2*(1 kg)*(0.1 m)^2*der(a[i])^2;
    potential 1 N*(0.1 m)*(1 - cos(a[i]));
  end for;
  for i in 1:n-1 loop
    potential 1/2*(0.5 J/rad^2)*(a[i+1] - a[i])^2;
  end for;
  experiment(stop = 1 s, tolerance = 1e-8);
end Chain;
"""

REPRESENTATIVE: dict[str, tuple[str | Path, str]] = {
    "tree": (EXAMPLES / "double_pendulum.mech", "dop853"),
    "rotation": (EXAMPLES / "heavy_top_rotation.mech", "dop853"),
    "closed loop": (EXAMPLES / "double_pendulum_bars.mech", "dop853"),
    "guessed loop": (EXAMPLES / "four_bar.mech", "dop853"),
    "nonholonomic": (EXAMPLES / "chaplygin_sleigh.mech", "dop853"),
    "stiff": (STIFF, "radau5"),
    "contact": (EXAMPLES / "bouncing_ball.mech", "dop853"),
    "contact in a tree": (EXAMPLES / "double_pendulum_stops.mech", "dop853"),
    "friction": (EXAMPLES / "stick_slip_belt.mech", "dop853"),
    "impacts at once": (EXAMPLES / "rocking_block.mech", "dop853"),
    "input": (DRIVEN, "dop853"),
    "discrete controller": (EXAMPLES / "sampled_controller.mech", "dop853"),
    "terminates": (EXAMPLES / "catapult.mech", "dop853"),
    "chain of 50": (CHAIN, "dop853"),
}
"""Name, then source and method."""

HYBRID = ("contact", "contact in a tree", "friction", "impacts at once", "discrete controller", "terminates")


def packed(source: str | Path, fmi: int, method: str = "dop853") -> tuple[Package, Start]:
    """Return the FMU of a text or of the model in a file, with what it begins with."""
    model = (load(source) if isinstance(source, Path) else loads(source)).for_experiment(None)
    start = start_of(model.problem(reproducible=True, method=method))
    return make_package(equations_for(model, method), start, fmi=fmi, method=method), start


def written(folder: Path, source: str | Path, fmi: int, method: str = "dop853") -> tuple[Path, Start]:
    """Write the FMU of a model into a folder."""
    package, start = packed(source, fmi, method)
    path = folder / "model.fmu"
    path.write_bytes(package.data)
    return path, start


def references(path: Path) -> dict[str, int]:
    """Return the value references by name."""
    return {v.name: v.valueReference for v in fmpy.read_model_description(str(path)).modelVariables}


def states(path: Path) -> list[str]:
    """Return the names of the states in their order."""
    description = fmpy.read_model_description(str(path))
    return [unknown.variable.derivative.name for unknown in description.derivatives]


def put(fmu: Any, reference: int, value: float) -> None:
    (fmu.setReal if hasattr(fmu, "setReal") else fmu.setFloat64)([reference], [value])


def save(fmu: Any) -> bytes:
    """Return the serialised state of an instance."""
    state = (fmu.getFMUstate if hasattr(fmu, "getFMUstate") else fmu.getFMUState)()
    data = (fmu.serializeFMUstate if hasattr(fmu, "serializeFMUstate") else fmu.serializeFMUState)(state)
    (fmu.freeFMUstate if hasattr(fmu, "freeFMUstate") else fmu.freeFMUState)(state)
    return bytes(data)


def restore(fmu: Any, data: bytes) -> None:
    two = hasattr(fmu, "deSerializeFMUstate")
    state = (fmu.deSerializeFMUstate if two else fmu.deserializeFMUState)(data)
    (fmu.setFMUstate if two else fmu.setFMUState)(state)
    (fmu.freeFMUstate if two else fmu.freeFMUState)(state)


def derivative(
    fmu: Any, unknowns: list[int], knowns: list[int], seed: list[float], adjoint: bool = False
) -> list[float]:
    if adjoint:
        # without nSensitivity, fmpy makes room for as many results as unknowns
        return list(
            fmu.getAdjointDerivative(unknowns=unknowns, knowns=knowns, seed=seed, nSensitivity=len(knowns))
        )
    if hasattr(fmu, "getReal"):
        return list(fmu.getDirectionalDerivative(unknowns, knowns, seed))
    return list(fmu.getDirectionalDerivative(unknowns=unknowns, knowns=knowns, seed=seed))
