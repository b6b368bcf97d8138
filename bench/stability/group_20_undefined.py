"""Values that stop being numbers, masses that vanish, motions that end."""

from __future__ import annotations

from .case import Array, Case, Refusal

NUMBER = 20
TITLE = "Undefined and singular"

FREE = """
coordinate Length x = 0 m;
initial der(x) = 1 m/s;
kinetic 1/2*1 kg*der(x)^2;
{more}
experiment(stop = 3 s);
"""


def free(more: str) -> str:
    return FREE.format(more=more)


def even(t: Array) -> Array:
    return t


CASES = (
    Case(
        "square root of a negative number",
        "a force that is not defined beyond x = 1",
        free("force 0.1 N*sqrt(1 - x/1 m) on x;"),
        Refusal("stops at x = 1 and names the acceleration of x", ("acceleration of 'x'", "not a number"), (0.9, 1.01)),
        fault="no refusal",
    ),
    Case(
        "logarithm of zero",
        "a potential wall so thin that steps cross it: its energy is undefined beyond",
        free("potential -1 J*log(1 - x/1 m);"),
        Refusal("does not go on where its energy is undefined", ("t =",), (0.009, 0.011)),
        fault="no refusal",
        options={"set": {"der(x)": 100.0}},
    ),
    Case(
        "division by zero",
        "a force 1/(x - 1)^2 that pulls across its pole",
        free("force 1 N/(x/1 m - 1)^2 on x;"),
        Refusal("stops at the pole", ("t =",), (0.3, 1.0)),
        fault="no refusal",
    ),
    Case(
        "finite escape",
        "x'' = 6 x^2 grows beyond all bounds at t = 1",
        """
dimensionless;
coordinate x = 1;
initial der(x) = 2;
kinetic 1/2*der(x)^2;
potential -2*x^3;
experiment(stop = 3);
""",
        Refusal("stops at t = 1; right to 1e-4 until shortly before", ("t =",), (0.999999, 1.000001),
                {"x": lambda t: 1 / (1 - t) ** 2}, 1e-4, 0.999),
        fault="no refusal",
    ),
    Case(
        "overflow",
        "a state that grows by exp(exp(t)) passes 1e308",
        "dimensionless;\nstate x = 1;\nequation der(x) = x*log(x + 2);\nexperiment(stop = 20);",
        Refusal("stops where numbers end and names x", ("x",), (7, 7.2)),
        fault="no refusal",
    ),
    Case(
        "mass matrix singular at a point",
        "the inertia of y is (t - 0.5)^2",
        """
coordinate Length y = 0 m;
initial der(y) = 1 m/s;
kinetic 1/2*1 kg/s^2*(time - 0.5 s)^2*der(y)^2;
force 1 N on y;
experiment(stop = 3 s);
""",
        Refusal("stops where the inertia vanishes", ("t =",), (0.49, 0.51)),
        fault="no refusal",
    ),
    Case(
        "mass that runs out",
        "the mass is 1 - t",
        """
coordinate Length x = 0 m;
kinetic 1/2*(1 kg - 1 kg/s*time)*der(x)^2;
force 1 N on x;
experiment(stop = 3 s);
""",
        Refusal("stops at t = 1", ("t =",), (0.999, 1.001)),
        fault="no refusal",
    ),
    Case(
        "mass zero from the start",
        "a parameter that is zero",
        "parameter m = 0 kg;\ncoordinate Length x = 1 m;\nkinetic 1/2*m*der(x)^2;\npotential 1/2*1 N/m*x^2;\nexperiment(stop = 1 s);",
        Refusal("does not begin and says the cause", ("x", "inertia")),
        fault="massless starts unchecked",
    ),
    Case(
        "initial value that is not a number",
        "sqrt(-1) as an initial value",
        "parameter a = -1;\ncoordinate Length x = sqrt(a)*1 m;\nkinetic 1/2*1 kg*der(x)^2;\nexperiment(stop = 1 s);",
        Refusal("does not begin and names x", ("x", "not a number")),
        fault="checks ignored",
    ),
    Case(
        "parameter out of its range",
        "a negative mass",
        "parameter Mass m(min = 0 kg) = -1 kg;\ncoordinate Length x = 0 m;\nkinetic 1/2*m*der(x)^2;\nexperiment(stop = 1 s);",
        Refusal("does not begin and names m", ("m", "minimum")),
        fault="checks ignored",
    ),
    Case(
        "assertion",
        "a condition of the model that ends",
        free('assert x < 2 m, "too far";'),
        Refusal("stops where it fails, with its words", ("too far", "t ="), (2.0, 2.4), {"x": even}, 1e-9),
        fault="no refusal",
    ),
    Case(
        "event without an end",
        "two events that set each other off",
        free("discrete Boolean on = false;\nwhen x > 1 m then on := true; end when;\nwhen on then on := false; end when;\n"
             "when not on and x > 0.5 m then on := true; end when;"),
        Refusal("stops, with the conditions named", ("on", "t ="), (0.49, 1.01)),
        fault="no refusal",
    ),
)  # fmt: skip
