"""Studies against closed forms and the literature: how far each is off, what it says of itself, and processor time."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable

import numpy as np
from msgspec import Struct

import mechc

from .machine import table, write
from .references import EXAMPLES
from .studies import BEAM_TEXT

CHAIN_TEXT = """\
model Chain
  dimensionless;
  structural parameter Integer n = 400;
  coordinate Real x[n];
  kinetic 1/2*sum(der(x[i])^2 for i in 1:n);
  potential 1/2*x[1]^2 + 1/2*x[n]^2 + 1/2*sum((x[i + 1] - x[i])^2 for i in 1:n - 1);
end Chain;
"""
ROTOR_TEXT = """\
model Rotor "Jeffcott rotor: damping outside, and inside, where it turns with the shaft"
  dimensionless;
  parameter speed = 1;
  coordinate x = 0;
  coordinate y = 0;
  kinetic 1/2*(der(x)^2 + der(y)^2);
  potential 1/2*(x^2 + y^2);
  damping 0.1 on x;
  damping 0.1 on y;
  force -0.05*(der(x) + speed*y) on x;
  force -0.05*(der(y) - speed*x) on y;
end Rotor;
"""
PROVEN = {
    "charged bead": ("coordinate a(min = 0.1, max = 6.2) = 1; kinetic 1/2*der(a)^2; potential -cos(a) + 1/(2*sin(a/2));", 3),
    "double pendulum with spring and force": (
        "coordinate a(min = -4, max = 4) = 0.1; coordinate b(min = -4, max = 4) = 0.2;"
        " kinetic der(a)^2 + 1/2*der(b)^2 + cos(a - b)*der(a)*der(b);"
        " potential -2*cos(a) - cos(b) + 0.15*(b - a)^2 - 0.2*b;", None),
    "Henon and Heiles": ("henon_heiles", 4),
    "buckling of three bars": (
        "coordinate x(min = -0.45, max = 0.45) = 0; coordinate y(min = -0.45, max = 0.45) = 0;"
        " let Real s = asin(x); let Real t = asin(y - x); let Real u = asin(-y); kinetic 1/2*(der(x)^2 + der(y)^2);"
        " potential 1/2*((s - t)^2 + (t - u)^2) + 1.02*(cos(s) + cos(t) + cos(u));", 3),
}  # fmt: skip
FOLDS_TEXT = """\
model Folds
  dimensionless;
  parameter f = 0;
  coordinate x(min = -20, max = 20) = 0.1;
  kinetic 1/2*der(x)^2;
  potential 0.01*x^2 - cos(x) - f*x;
end Folds;
"""
TILTED_TEXT = """\
model Tilted
  dimensionless;
  parameter w = 1;
  coordinate a = 0.1;
  kinetic 1/2*der(a)^2;
  potential -cos(a) - 1/2*w^2*sin(a)^2 - 0.01*sin(a);
end Tilted;
"""


class Row(Struct, frozen=True):
    """What is asked, how far it is off, what it says of its own error, and processor time once compiled."""

    asked: str
    off: str
    said: str
    seconds: float


def timed(asked: str, ask: Callable[[], tuple[str, str]]) -> Row:
    ask()  # compiled, and kept
    before = time.process_time()
    off, said = ask()
    return Row(asked, off, said, time.process_time() - before)


def example(name: str) -> mechc.Model:
    return mechc.load(EXAMPLES / f"{name}.mech")


def chain() -> Callable[[], tuple[str, str]]:
    model = mechc.loads(CHAIN_TEXT)
    exact = 2 * np.sin(np.arange(1, 401) * math.pi / 802)

    def ask() -> tuple[str, str]:
        found = model.modes()
        said = max(m["error"] / w for m, w in zip(found.details["modes"], exact, strict=True))
        return f"{np.abs(found.frequencies / exact - 1).max():.1e}", f"{said:.1e}"

    return ask


def rotor() -> Callable[[], tuple[str, str]]:
    model = mechc.loads(ROTOR_TEXT)

    def ask() -> tuple[str, str]:
        worst = said = 0.0
        for speed in np.linspace(0, 6, 7):
            found = model.modes(set={"speed": float(speed)})
            # z'' + 0.15 z' + (1 - 0.05 i speed) z = 0, z = x + i y
            whirls = np.roots([1, 0.15, 1 - 0.05j * speed])
            exact = np.array([z if z.imag >= 0 else z.conjugate() for z in whirls])
            off = np.abs(found.eigenvalues[:, None] - exact).min(axis=1).max()
            worst, said = max(worst, float(off)), max(said, *(m["error"] for m in found.details["modes"]))
        return f"{worst:.1e}", f"{said:.1e}"

    return ask


def special(
    text: str, over: str, exact: Callable[[dict[str, float]], float]
) -> Callable[[], tuple[str, str]]:
    """Ask for special points of branches; ``exact`` gives how far one is off."""
    model = mechc.loads(text) if text.startswith("model") else example(text)

    def ask() -> tuple[str, str]:
        found = model.equilibria(over=over).summary()["special"]
        off = max(exact({**one["parameter"], **one["values"]}) for one in found)
        return f"{off:.1e} ({', '.join(sorted({one['kind'] for one in found}))}: {len(found)})", ""

    return ask


def proof(text: str, count: int | None) -> Callable[[], tuple[str, str]]:
    model = mechc.loads(f"model Proven dimensionless; {text} end Proven;") if " " in text else example(text)

    def ask() -> tuple[str, str]:
        found = model.equilibria(prove=True).summary()
        right = count is None or len(found["equilibria"]) == count
        return f"{len(found['equilibria'])}{'' if right else ', WRONG'}", "complete" if found[
            "complete"
        ] else "not proven"

    return ask


def orbit(name: str, exact: float, **settings: str) -> Callable[[], tuple[str, str]]:
    model = example(name)

    def ask() -> tuple[str, str]:
        found = model.orbit(**settings)
        return f"{abs(found['period'] / exact - 1):.1e}", f"{found.values[0].error / exact:.1e}"

    return ask


def section(name: str, **settings: object) -> Callable[[], tuple[str, str]]:
    model = example(name)

    def ask() -> tuple[str, str]:
        return f"{model.section(count=100_000, **settings).summary()['count']} points", ""

    return ask


def scattering(potential: str, exact: Callable[[float], float]) -> Callable[[], tuple[str, str]]:
    model = mechc.loads(BEAM_TEXT.format(potential=potential) if "contact" not in potential else
                        BEAM_TEXT.replace("potential {potential}", potential))  # fmt: skip

    def ask() -> tuple[str, str]:
        found = model.scattering(over="b = 0.2 .. 0.9, 8").summary()
        off = max(abs(a - exact(b)) for a, b in zip(found["angle"], found["parameter"]["b"], strict=True))
        return f"{off:.1e}", f"{max(found['angle_errors']):.1e}"

    return ask


def main(quick: bool = False) -> None:
    asks = [
        ("modes of a chain of 400", chain()),
        ("Jeffcott rotor, eigenvalues over seven speeds", rotor()),
        ("fork of the hoop at sqrt(g/R)", special("rotating_hoop", "w = 0 .. 10 rad/s", lambda v: abs(v["w"] - math.sqrt(9.81)))),
        ("fold of the tilted hoop", special(TILTED_TEXT, "w = 0 .. 3", lambda v: abs(v["w"] - (1 + 0.01 ** (2 / 3)) ** 0.75))),
        ("a branch through its folds", special(FOLDS_TEXT, "f = -2 .. 2", lambda v: abs(v["f"] - 0.02 * v["x"] - math.sin(v["x"])))),
        *((f"--prove: {name}", proof(*what)) for name, what in PROVEN.items()),
        ("period of van der Pol's cycle, mu = 1", orbit("van_der_pol_cycle", 6.6632868593231301897)),
        ("the same, mu = 1000", orbit("van_der_pol_cycle", 1614.4011258088, experiment="relaxation")),
        ("section of Henon and Heiles", section("henon_heiles", where="q1 = 0")),
        ("section of the driven pendulum", section("driven_pendulum", every="2*pi/wD", set={"g": 1.15})),
        ("Rutherford's angles", scattering("1/sqrt(x^2 + y^2)", lambda b: 2 * math.atan(1 / b))),
        ("hard disk", scattering("contact sqrt(x^2 + y^2) - 1 restitution 1", lambda b: math.pi - 2 * math.asin(b))),
        ("inverse square", scattering("1/(x^2 + y^2)", lambda b: math.pi * (1 - b / math.sqrt(b * b + 2)))),
    ]  # fmt: skip
    rows = []
    for asked, ask in asks[::4] if quick else asks:
        row = timed(asked, ask)
        rows.append([row.asked, row.off, row.said, f"{row.seconds:.2g} s"])
        print(rows[-1], flush=True)
    text = (
        "Largest differences from closed forms, from Viswanath's digits (2001) and from Radau's method of SciPy (mu = 1000), relative "
        "for modes and periods; what the study says of its error; processor time once the model is compiled."
    )
    write("answers", "Studies against closed forms", [text, table(["asked", "off by", "said", "time"], rows)])


if __name__ == "__main__":
    main(quick="--quick" in sys.argv)
