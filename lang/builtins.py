"""The functions and constants that the language knows: one table for the checker, editors and docs.

Type rules live in ``compiler/flat``; ``der`` and ``pre`` have a syntax of their own.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from fractions import Fraction
from math import pi

from msgspec import Struct


class Category(Enum):
    ELEMENTARY = "elementary"  # scalars to a scalar
    VECTOR = "vector"  # arrays and matrices
    REDUCTION = "reduction"  # a whole array, or ``e for i in r``, to one value
    POSE = "pose"  # build a pose or a rotation
    KINEMATIC = "kinematic"  # positions and velocities of frames and points
    QUERY = "query"  # about a named element, or the whole model
    EVENT = "event"  # conditions of ``when``
    STRUCTURE = "structure"  # values for arrays, sweeps and tables
    FIELD = "field"  # derivatives of functions by place
    PAST = "past"  # signals: what was a while ago, noise


class Builtin(Struct, frozen=True):
    """``least`` and ``most`` count the positional arguments; ``most`` None means any number.

    ``types``: what it takes and gives, in the words "angle", "number" and "whole", if these say all.
    """

    name: str
    least: int
    most: int | None
    category: Category
    doc: str
    keywords: tuple[str, ...] = ()
    generators: bool = False
    types: str = ""

    @property
    def arity(self) -> str:
        """Say the number of arguments in words: ``1 argument``, ``2 or 3 arguments``."""
        if self.most is None:
            return f"at least {self.least} argument{'s' if self.least != 1 else ''}"
        if self.least == self.most:
            return f"{self.least or 'no'} argument{'s' if self.least != 1 else ''}"
        joint = "or" if self.most == self.least + 1 else "to"
        return f"{self.least} {joint} {self.most} arguments"


_E, _V, _R, _P = Category.ELEMENTARY, Category.VECTOR, Category.REDUCTION, Category.POSE
_K, _Q, _W, _S = Category.KINEMATIC, Category.QUERY, Category.EVENT, Category.STRUCTURE
_F = Category.FIELD

_ALL = (
    Builtin("sin", 1, 1, _E, "sine of an angle", types="angle -> number"),
    Builtin("cos", 1, 1, _E, "cosine of an angle", types="angle -> number"),
    Builtin("tan", 1, 1, _E, "tangent of an angle", types="angle -> number"),
    Builtin("asin", 1, 1, _E, "angle between -pi/2 and pi/2 whose sine is given", types="number -> angle"),
    Builtin("acos", 1, 1, _E, "angle between 0 and pi whose cosine is given", types="number -> angle"),
    Builtin("atan", 1, 1, _E, "angle between -pi/2 and pi/2 whose tangent is given", types="number -> angle"),
    Builtin("atan2", 2, 2, _E, "angle of the point (x, y), written atan2(y, x)"),
    Builtin("sinh", 1, 1, _E, "hyperbolic sine", types="number -> number"),
    Builtin("cosh", 1, 1, _E, "hyperbolic cosine", types="number -> number"),
    Builtin("tanh", 1, 1, _E, "hyperbolic tangent", types="number -> number"),
    Builtin("asinh", 1, 1, _E, "inverse hyperbolic sine", types="number -> number"),
    Builtin("acosh", 1, 1, _E, "inverse hyperbolic cosine", types="number -> number"),
    Builtin("atanh", 1, 1, _E, "inverse hyperbolic tangent", types="number -> number"),
    Builtin("exp", 1, 1, _E, "exponential function", types="number -> number"),
    Builtin("log", 1, 1, _E, "natural logarithm", types="number -> number"),
    Builtin("log10", 1, 1, _E, "decimal logarithm", types="number -> number"),
    Builtin("erf", 1, 1, _E, "error function", types="number -> number"),
    Builtin("ellipk", 1, 1, _E, "complete elliptic integral K(m), m = k^2 below 1", types="number -> number"),
    Builtin(
        "ellipf", 2, 2, _E, "elliptic integral F(phi, m) of the first kind", types="angle, number -> number"
    ),
    Builtin("sn", 2, 2, _E, "elliptic sine of Jacobi: sn(u, m)", types="number, number -> number"),
    Builtin("cn", 2, 2, _E, "elliptic cosine of Jacobi: cn(u, m)", types="number, number -> number"),
    Builtin("dn", 2, 2, _E, "elliptic delta of Jacobi: dn(u, m)", types="number, number -> number"),
    Builtin("sqrt", 1, 1, _E, "square root"),
    Builtin("abs", 1, 1, _E, "absolute value"),
    Builtin("sign", 1, 1, _E, "-1, 0 or 1"),
    Builtin("floor", 1, 1, _E, "largest whole number that is not greater", types="number -> whole"),
    Builtin("ceil", 1, 1, _E, "smallest whole number that is not less", types="number -> whole"),
    Builtin("mod", 2, 2, _E, "x - floor(x/y)*y"),
    Builtin(
        "div",
        2,
        2,
        _E,
        "quotient of two whole numbers, rounded towards zero; divergence of a field: div(F, r)",
    ),
    Builtin("clamp", 3, 3, _E, "x kept between a lower and an upper limit: clamp(x, low, high)"),
    Builtin(
        "deadzone", 2, 2, _E, "0 for abs(x) below the half width w, beyond it x - w or x + w: deadzone(x, w)"
    ),
    Builtin("min", 1, None, _R, "smallest of the arguments, of an array, or of e for i in r", (), True),
    Builtin("max", 1, None, _R, "largest of the arguments, of an array, or of e for i in r", (), True),
    Builtin("sum", 1, 1, _R, "sum of an array, or of e for i in r", (), True),
    Builtin("product", 1, 1, _R, "product of an array, or of e for i in r", (), True),
    Builtin("integral", 1, 1, _R, "integral over time from the start, or of e for s in a:b", (), True),
    Builtin(
        "rms",
        1,
        1,
        _R,
        'root mean square since the start; with a weighting of human vibration: rms(a, weighting = "ISO2631-Wk")',
        ("weighting",),
    ),
    Builtin("dot", 2, 2, _V, "scalar product"),
    Builtin("cross", 2, 2, _V, "vector product; a scalar in the plane"),
    Builtin("norm", 1, 1, _V, "length of a vector"),
    Builtin("transpose", 1, 1, _V, "transposed matrix"),
    Builtin("outer", 2, 2, _V, "matrix of the products a[i]*b[j]"),
    Builtin("identity", 1, 1, _V, "identity matrix of n rows"),
    Builtin("diag", 1, 1, _V, "diagonal matrix from a vector"),
    Builtin("det", 1, 1, _V, "determinant of a square matrix"),
    Builtin("inverse", 1, 1, _V, "inverse of a square matrix"),
    Builtin("solve", 2, 2, _V, "x with A*x = b, a vector or a matrix: solve(A, b)"),
    Builtin("trace", 1, 1, _R, "sum of the diagonal of a square matrix"),
    Builtin("trans", 1, 1, _P, "displacement by a vector"),
    Builtin("rot", 1, 1, _P, "rotation in the plane"),
    Builtin("rotx", 1, 1, _P, "rotation about x"),
    Builtin("roty", 1, 1, _P, "rotation about y"),
    Builtin("rotz", 1, 1, _P, "rotation about z"),
    Builtin("axis_angle", 2, 2, _P, "rotation about an axis by an angle"),
    Builtin("quat", 1, 4, _P, "rotation of a quaternion, scalar part first"),
    Builtin("origin", 1, 1, _K, "position of the origin of a frame, in world components"),
    Builtin("pos", 1, 1, _K, "position of a frame or point, in world components"),
    Builtin("vel", 1, 2, _K, "velocity of a frame or point; with a frame: relative to it, in its components"),
    Builtin("vel_at", 2, 2, _K, "velocity of the material point of a frame that is now at a point"),
    Builtin("angvel", 1, 2, _K, "angular velocity of a frame in world components, or in those of a frame"),
    Builtin("heading", 1, 1, _K, "angle of a frame in the plane"),
    Builtin("local", 2, 2, _K, "position of a point in a frame: local(F, P)"),
    Builtin("components", 2, 2, _K, "components in a frame of a vector given in world: components(F, v)"),
    Builtin("direction", 2, 2, _K, "world components of a vector given in a frame: direction(F, v)"),
    Builtin("energy", 0, 0, _Q, "total energy"),
    Builtin("kinetic_energy", 0, 0, _Q, "kinetic energy"),
    Builtin("potential_energy", 0, 0, _Q, "potential energy"),
    Builtin("momentum", 1, 1, _Q, "generalised momentum of a coordinate"),
    Builtin(
        "power",
        1,
        2,
        _Q,
        "power of a named force, damping or friction, or of a force on a coordinate: power(f, q)",
    ),
    Builtin(
        "multiplier",
        1,
        1,
        _Q,
        "multiplier of a named constraint, normal force of a contact, or force of a friction",
    ),
    Builtin("reaction", 1, 1, _Q, "force of a joint on its 'to' side, or of a drive", ("in",)),
    Builtin("moment", 1, 1, _Q, "moment of a joint on its 'to' side about the origin of 'to'", ("in",)),
    Builtin("closed", 1, 1, _Q, "true while a contact presses, a friction sticks or a constraint holds"),
    Builtin("inertia_tensor", 1, 1, _Q, "inertia of the rigid body of a frame about its mass centre"),
    Builtin("mass_centre", 0, 1, _Q, "mass centre of the rigid body of a frame, or of the whole model"),
    Builtin("at", 2, 2, _Q, "value of an expression at a value of the independent variable: at(e, x)"),
    Builtin(
        "sample", 1, 2, _W, "true at the start and then periodically: sample(period), sample(period, start)"
    ),
    Builtin("initial", 0, 0, _W, "true at the start only"),
    Builtin(
        "noise", 2, 2, Category.PAST, "random signal of size 1, the same in every run: noise(seed, period)"
    ),
    Builtin("delay", 2, 2, Category.PAST, "value of an expression a time T ago: delay(e, T)"),
    Builtin(
        "table",
        3,
        7,
        _S,
        "value of a curve or surface through points: table(x, {x1, x2, ..}, {y1, y2, ..})",
    ),
    Builtin(
        "mesh_volume", 2, 2, _S, "volume inside a mesh: mesh_volume(file, scale), mesh_volume(corners, faces)"
    ),
    Builtin("mesh_centre", 2, 2, _S, "centre of the solid inside a mesh, as mesh_volume"),
    Builtin("mesh_inertia", 2, 2, _S, "its inertia for unit density about the centre, as mesh_volume"),
    Builtin("grad", 2, None, _F, "gradient of a field, a function of position: grad(V, r)"),
    Builtin("curl", 2, None, _F, "curl of a vector field: curl(F, r); a number in the plane"),
    Builtin("laplacian", 2, None, _F, "sum of second derivatives of a field: laplacian(V, r)"),
    Builtin("file", 1, 2, _S, "numbers of a CSV, NPZ or Matrix Market file: file(name), file(name, column)"),
    Builtin("size", 2, 2, _S, "number of elements along index k of an array, of rows for k = 1: size(A, k)"),
    Builtin("given", 1, 1, _S, "true if the text around a component gives this name a value: given(damping)"),
    Builtin("concat", 2, None, _S, "vectors joined end to end, or matrices joined by rows"),
    Builtin("eigenvalues", 1, 1, _S, "real eigenvalues of a matrix of parameters, smallest first"),
    Builtin("linspace", 3, 3, _S, "n values from first to last: linspace(first, last, n)"),
)

BUILTINS: Mapping[str, Builtin] = {b.name: b for b in _ALL}

CONSTANTS: Mapping[str, Fraction] = {"pi": Fraction(pi)}
"""Numbers without a dimension that have a name."""

PREDEFINED: Mapping[str, str] = {"world": "the fixed frame", "time": "the independent variable"}
"""Names that every model has, with what they are."""
