"""Models in C for the tests of the kernel's methods, with Jacobians, momenta and projections where they are asked
for. All in units in which gravity, lengths and masses are 1."""

from __future__ import annotations

from kernel_driver import Model

_SERIES = """
static void series_start(ARGUMENTS) { out[0] = y[1]; out[1] = -sin(y[0]); out[2] = cos(y[0]); out[3] = sin(y[0]); }
static void series_next(ARGUMENTS)
{
    const mech_real sine = z[0] * y[0] + u[8] * u[0], cosine = -(z[1] * y[0] + u[8] * u[1]);
    for (int i = 0; i < 24; i++) out[i] = 0;
    out[0] = y[1], out[1] = -sine;
    out[8] = t * y[0], out[16] = cosine; /* k sine[k] = sum of j y[0][j] cosine[k-j] */
    out[9] = t * y[0], out[17] = sine;
}
static const mech_series series = {2, 2, series_start, series_next};
"""

PENDULUM = Model(
    {
        "rhs": "out[0] = y[1]; out[1] = -sin(y[0]);",
        "jacobian": "out[0] = 1; out[1] = -cos(y[0]);",
        "momentum": "out[0] = y[1];",
        "force": "out[0] = -sin(y[0]);",
        "mass": "out[0] = 1;",
    },
    nq=1,
    nv=1,
    entries=((0, 1), (1, 0)),
    sizes={"separable": 1, "series": "&series"},
    prelude=_SERIES,
)

PUSHED_PENDULUM = Model(
    {
        "rhs": "out[0] = y[1]; out[1] = -sin(y[0]) + cos(t); out[2] = y[1] * cos(t);",
        "momentum": "out[0] = y[1];",
        "force": "out[0] = -sin(y[0]) + cos(t);",
        "mass": "out[0] = 1;",
    },
    nq=1,
    nv=1,
    nx=1,
    sizes={"separable": 1, "n_accounts": 1},
)
"""With an account of the energy that the push supplies."""

KEPLER = Model(
    {
        "rhs": "mech_real s = y[0]*y[0] + y[1]*y[1], k = -1 / (s * sqrt(s));"
        "out[0] = y[2]; out[1] = y[3]; out[2] = k*y[0]; out[3] = k*y[1];",
        "jacobian": "mech_real s = y[0]*y[0] + y[1]*y[1], k = 1 / (s * sqrt(s)), m = 3 * k / s;"
        "out[0] = 1; out[1] = 1; out[2] = m*y[0]*y[0] - k; out[3] = m*y[0]*y[1]; out[4] = m*y[0]*y[1];"
        "out[5] = m*y[1]*y[1] - k;",
    },
    nq=2,
    nv=2,
    entries=((0, 2), (1, 3), (2, 0), (2, 1), (3, 0), (3, 1)),
    sizes={"separable": 1},
)

VAN_DER_POL = Model(
    {
        "rhs": "out[0] = y[1]; out[1] = p[0] * (1 - y[0]*y[0]) * y[1] - p[1] * y[0];",
        "jacobian": "out[0] = 1; out[1] = -2 * p[0] * y[0] * y[1] - p[1]; out[2] = p[0] * (1 - y[0]*y[0]);",
    },
    nx=2,
    entries=((0, 1), (1, 0), (1, 1)),
    sizes={"np": 2},
)
"""p: factors of the damping and of the spring."""

TWO_SPRINGS = Model(
    {
        "rhs": "out[0] = y[2]; out[1] = y[3]; out[2] = -y[0]; out[3] = -p[0]*y[1] - p[1]*y[3];",
        "jacobian": "out[0] = 1; out[1] = 1; out[2] = -1; out[3] = -p[0]; out[4] = -p[1];",
    },
    nq=2,
    nv=2,
    entries=((0, 2), (1, 3), (2, 0), (3, 1), (3, 3)),
    sizes={"np": 2},
)
"""A spring of stiffness 1 beside one of stiffness and damping p[0], p[1]."""

COUPLED_PENDULUM = Model(
    {
        "rhs": "mech_real c = cos(y[1]), s = sin(y[1]);"
        "out[0] = y[2]; out[1] = y[3]; out[2] = (s*y[3]*y[3] + s*c) / (2 - c*c) - p[0] * y[0] / (2 - c*c);"
        "out[3] = -(c*s*y[3]*y[3] + 2*s) / (2 - c*c) + p[0] * c * y[0] / (2 - c*c);",
        "momentum": "out[0] = 2*y[2] + cos(y[1])*y[3]; out[1] = cos(y[1])*y[2] + y[3];",
        "force": "out[0] = -p[0]*y[0]; out[1] = -sin(y[1])*y[2]*y[3] - sin(y[1]);",
        "mass": "out[0] = 2; out[1] = out[2] = cos(y[1]); out[3] = 1;",
    },
    nq=2,
    nv=2,
    sizes={"np": 1},
)
"""A pendulum on a cart on a spring of stiffness p[0]: its mass matrix depends on the angle."""

BODY_WITH_SPRING = Model(
    {
        "rhs": "mech_real a=y[0], b=y[1], c=y[2], d=y[3], w1=y[5], w2=y[6], w3=y[7];"
        "out[0] = (-b*w1-c*w2-d*w3)/2; out[1] = (a*w1+c*w3-d*w2)/2; out[2] = (a*w2+d*w1-b*w3)/2;"
        "out[3] = (a*w3+b*w2-c*w1)/2; out[4] = y[8];"
        "out[5] = -w2*w3; out[6] = w3*w1; out[7] = -w1*w2/3; out[8] = -p[0]*y[4] - 2*p[1]*y[8] + a*b; "
        "out[9] = y[8] - y[9];",
        "jacobian": "mech_real a=y[0], b=y[1], c=y[2], d=y[3], w1=y[5], w2=y[6], w3=y[7]; mech_real *o = out;"
        "*o++=-w1/2; *o++=-w2/2; *o++=-w3/2; *o++=-b/2; *o++=-c/2; *o++=-d/2;"
        "*o++=w1/2; *o++=w3/2; *o++=-w2/2; *o++=a/2; *o++=-d/2; *o++=c/2;"
        "*o++=w2/2; *o++=-w3/2; *o++=w1/2; *o++=d/2; *o++=a/2; *o++=-b/2;"
        "*o++=w3/2; *o++=w2/2; *o++=-w1/2; *o++=-c/2; *o++=b/2; *o++=a/2;"
        "*o++=1; *o++=-w3; *o++=-w2; *o++=w3; *o++=w1; *o++=-w2/3; *o++=-w1/3;"
        "*o++=b; *o++=a; *o++=-p[0]; *o++=-2*p[1]; *o++=1; *o++=-1;",
    },
    nq=5,
    nv=4,
    nx=1,
    rotations=(0,),
    entries=(
        *((0, j) for j in (1, 2, 3, 5, 6, 7)),
        *((1, j) for j in (0, 2, 3, 5, 6, 7)),
        *((2, j) for j in (0, 1, 3, 5, 6, 7)),
        *((3, j) for j in (0, 1, 2, 5, 6, 7)),
        *((4, 8), (5, 6), (5, 7), (6, 5), (6, 7), (7, 5), (7, 6)),
        *((8, 0), (8, 1), (8, 4), (8, 8), (9, 8), (9, 9)),
    ),
    sizes={"np": 2},
)
"""A free body, a spring driven by its attitude, and a filter of its rate: one row of the Jacobian has one entry."""


def hanging_point(n: int) -> Model:
    """A point on a rod of length 1 in Cartesian coordinates of the plane (n = 2) or space; the last one points up.

    The accelerations do without multipliers: the rod pulls with the force that keeps its length.
    """
    each, up = range(n), n - 1
    square = "+".join(f"y[{i}]*y[{i}]" for i in each)
    speed = "+".join(f"y[{n + i}]*y[{n + i}]" for i in each)
    rate = "+".join(f"y[{i}]*y[{n + i}]" for i in each)
    velocities = "".join(f"out[{i}] = y[{n + i}];" for i in each)
    return Model(
        {
            "rhs": f"mech_real pull = (y[{up}] - ({speed})) / ({square}); {velocities}"
            + "".join(f"out[{n + i}] = pull * y[{i}];" for i in each)
            + f"out[{n + up}] -= 1;",
            "jacobian": f"mech_real s = {square}, pull = (y[{up}] - ({speed})) / s; mech_real *o = out;"
            + "*o++ = 1;" * n
            + "".join(
                f"*o++ = y[{i}] * ({int(j == up)} - 2*pull*y[{j}]) / s + {int(i == j)} * pull;"
                for i in each
                for j in each
            )
            + "".join(f"*o++ = -2 * y[{n + j}] * y[{i}] / s;" for i in each for j in each),
            "project_position": f"mech_real s = {square}, phi = (s - 1) / 2;"
            + "".join(f"out[{i}] = -y[{i}] * phi / s;" for i in each)
            + f"out[{n}] = phi;",
            "project_velocity": f"mech_real s = {square}, c = {rate};"
            + "".join(f"out[{i}] = -y[{i}] * c / s;" for i in each)
            + f"out[{n}] = c;",
            "displace": velocities,
            "momentum": velocities,
            "force": "".join(f"out[{i}] = {-1 if i == up else 0};" for i in each),
            "mass": "".join(f"out[{n * i + j}] = {int(i == j)};" for i in each for j in each),
            "constraints": f"out[0] = ({square} - 1) / 2; out[1] = {rate};",
            "constraint_jacobian": "".join(f"out[{i}] = y[{i}];" for i in each),
        },
        nq=n,
        nv=n,
        entries=(
            *((i, n + i) for i in each),
            *((n + i, j) for i in each for j in each),
            *((n + i, n + j) for i in each for j in each),
        ),
        sizes={"n_position": 1, "n_velocity": 1},
    )


CARTESIAN_PENDULUM = hanging_point(2)
SPHERICAL_PENDULUM = hanging_point(3)

TILTED_BODY = Model(
    {
        "rhs": "mech_real a=y[0], b=y[1], c=y[2], d=y[3], w1=y[4], w2=y[5], w3=y[6];"
        "out[0] = (-b*w1-c*w2-d*w3)/2; out[1] = (a*w1+c*w3-d*w2)/2; out[2] = (a*w2+d*w1-b*w3)/2;"
        "out[3] = (a*w3+b*w2-c*w1)/2; out[4] = 0; out[5] = 0; out[6] = -sin(2 * atan2(d, a));",
        "project_position": "out[0] = -2*y[1]; out[1] = -2*y[2]; out[2] = 0; out[3] = y[1]; out[4] = y[2];",
        "project_velocity": "out[0] = -y[4]; out[1] = -y[5]; out[2] = 0; out[3] = y[4]; out[4] = y[5];",
        "displace": "mech_real a=y[0], b=y[1], c=y[2], d=y[3], w1=y[4], w2=y[5], w3=y[6];"
        "out[0] = (-b*w1-c*w2-d*w3)/2; out[1] = (a*w1+c*w3-d*w2)/2; out[2] = (a*w2+d*w1-b*w3)/2;"
        "out[3] = (a*w3+b*w2-c*w1)/2;",
    },
    nq=4,
    nv=3,
    rotations=(0,),
    sizes={"n_position": 2, "n_velocity": 2},
    prelude="#if defined(MECH_QUAD)\n#define atan2 atan2q\n#endif\n",
)
"""A body that turns about its third axis like a pendulum: the second and third entry of its quaternion are zero.

The corrections hold for small residuals only, as a model's do: near the identity b changes by half the turn.
"""
