"""Studies beside other tools: the same questions, their known answers, how far each is off and how long it took."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable

from msgspec import Struct
from scipy.special import ellipk

import mechc

from .machine import table, write
from .peers.studies import CHAIN, PEERS, Answer, Missing
from .references import EXAMPLES

TOOLS = ("mechc", "SymPy", "scipy", "MechanicsDSL")

CHAIN_TEXT = f"""\
model Chain
  dimensionless;
  structural parameter Integer N = {CHAIN};
  coordinate x[N] = 0;
  kinetic 1/2*dot(der(x), der(x));
  potential 1/2*x[1]^2 + 1/2*x[N]^2 + sum(1/2*(x[i + 1] - x[i])^2 for i in 1:N - 1);
end Chain;
"""
PAIR_TEXT = """\
model Pair
  dimensionless;
  coordinate a = 0;
  coordinate b = 0;
  kinetic 1/2*der(a)^2 + 3/2*der(b)^2;
  potential 3*(sin(a) - sin(b))^2 - 9.81*(cos(a) + 3*cos(b));
end Pair;
"""
TWO_TEXT = """\
model Two
  dimensionless;
  parameter m2 = 2;
  coordinate x1 = 0;
  coordinate y1 = 0;
  coordinate x2 = 1;
  coordinate y2 = 0.5;
  kinetic 1/2*(der(x1)^2 + der(y1)^2) + 1/2*m2*(der(x2)^2 + der(y2)^2);
  potential 3/sqrt((x1 - x2)^2 + (y1 - y2)^2);
  experiment(stop = 1);
end Two;
"""
SWING_TEXT = """\
model Swing
  dimensionless;
  coordinate q = {start};
  kinetic 1/2*der(q)^2;
  potential {potential};
end Swing;
"""
BEAM_TEXT = """\
model Beam
  dimensionless;
  parameter b = 1;
  coordinate x = -20;
  coordinate y = b;
  initial der(x) = 1;
  kinetic 1/2*(der(x)^2 + der(y)^2);
  potential {potential};
end Beam;
"""


class Question(Struct, frozen=True):
    """What is asked, its exact answer with where that is from, and how mechc is asked."""

    name: str
    asks: str
    exact: float
    source: str
    ours: Callable[[mechc.Model], Answer]
    model: Callable[[], mechc.Model]
    counted: bool = False


def _loads(text: str) -> Callable[[], mechc.Model]:
    return lambda: mechc.loads(text)


def _example(name: str) -> Callable[[], mechc.Model]:
    return lambda: mechc.load(EXAMPLES / f"{name}.mech")


QUESTIONS = (
    Question("pair", "higher frequency of two pendulums with a spring, m = 1 and 3", math.sqrt(9.81 + 6 * (1 + 1 / 3)),
             "closed form", lambda m: float(m.modes(at="a = 0, b = 0").frequencies[1]), _loads(PAIR_TEXT)),
    Question("chain", f"lowest frequency of a chain of {CHAIN} springs", 2 * math.sin(math.pi / (2 * (CHAIN + 1))),
             "closed form", lambda m: float(m.modes().frequencies[0]), _loads(CHAIN_TEXT)),
    Question("hoop", "equilibria of the bead on a hoop at 5 rad/s", 4, "closed form",
             lambda m: len(m.equilibria().summary()["equilibria"]), _example("rotating_hoop"), True),
    Question("pendulum", "period of a pendulum, 60 degrees", 4 * float(ellipk(0.25)), "4 K(1/2)",
             lambda m: m.period()["period"], _loads(SWING_TEXT.format(start="1.0471975511965976", potential="-cos(q)"))),
    Question("action", "action I of an oscillator with E = 5, w = 2", 2.5, "E/w",
             lambda m: m.action()["I"],
             _loads(SWING_TEXT.format(start=repr(math.sqrt(2.5)), potential="2*q^2").replace("end Swing", "experiment(stop = 20); end Swing"))),
    Question("van der Pol", "period of van der Pol's cycle, mu = 1", 6.6632868593231301896997, "Viswanath 2001",
             lambda m: m.orbit()["period"], _example("van_der_pol_cycle")),
    Question("Lorenz", "largest exponent of the Lorenz equations", 0.905630, "Viswanath 1998",
             lambda m: m.lyapunov(time=2000).summary()["exponents"][0], _example("lorenz")),
    Question("Rutherford", "deflection by 1/r, E = 1/2, b = 1", math.pi / 2, "2 atan(1/(2 E b))",
             lambda m: float(m.scattering(over="b = 1 .. 2, 2").summary()["angle"][0]), _loads(BEAM_TEXT.format(potential="1/sqrt(x^2 + y^2)"))),
    Question("inverse square", "deflection by 1/r^2, E = 1/2, b = 1", math.pi * (1 - 1 / math.sqrt(3)), "closed form",
             lambda m: float(m.scattering(over="b = 1 .. 2, 2").summary()["angle"][0]), _loads(BEAM_TEXT.format(potential="1/(x^2 + y^2)"))),
    Question("two bodies", "point symmetries of two bodies in a plane", 7, "Galilei's group with time",
             lambda m: len(m.symmetries().summary()["symmetries"]), _loads(TWO_TEXT), True),
)  # fmt: skip


def timed(ask: Callable[[], Answer]) -> tuple[Answer, float]:
    before = time.process_time()
    found = ask()
    return found, time.process_time() - before


def cell(question: Question, tool: str) -> str:
    """Give the answer of a tool, by how much it is off, and the processor time."""
    if tool == "mechc":
        model = question.model()
        question.ours(model)  # compiled, and kept
        found, took = timed(lambda: question.ours(model))
    elif tool in PEERS[question.name]:
        try:
            found, took = timed(PEERS[question.name][tool])
        except Missing as missing:
            return str(missing)
    else:
        return ""
    lasted = f"{took:.2g} s" if took >= 0.01 else f"{1e3 * took:.1g} ms"
    if question.counted:
        return f"{found}, {lasted}"
    off = abs(found - question.exact) / question.exact
    return f"{found:.10g} ({off:.1e}), {lasted}"


def main(quick: bool = False) -> None:
    rows = []
    for question in QUESTIONS[::3] if quick else QUESTIONS:
        exact = f"{question.exact:g}" if question.counted else f"{question.exact:.10g}"
        rows.append([question.asks, f"{exact}, {question.source}", *(cell(question, tool) for tool in TOOLS)])
        print(rows[-1], flush=True)
    text = (
        "The answer, in brackets its relative error, and processor time; of mechc once the model is compiled. Empty: the tool has "
        "nothing for the question. SymPy: `LagrangesMethod` with its `Linearizer`, `solve`. scipy: what its users write by hand "
        "(`eigh`, `fsolve` from 64 guesses, `quad`, `solve_ivp` with events or with the tangent equations). MechanicsDSL 2.1 "
        "(`mechanicsdsl-core`): its analyzers as they come; its deflections are integrals that stop short of the turning point and "
        "at a hundred impact parameters. DynamicalSystems.jl does not run where there is no Julia: its question, exponents, is "
        "held against the literature."
    )
    write("studies", "Studies beside other tools", [text, table(["question", "answer", *TOOLS], rows)])


if __name__ == "__main__":
    main(quick="--quick" in sys.argv)
