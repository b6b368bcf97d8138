"""The operations of the graph, one row each: everything that is known of one stands there, for all passes and targets.

A code is a small int, so that the constructors and sweeps compare machine integers. Codes are dense
and start with the two leaves; everything from ``ADD`` on counts as one operation. The columns are explained in operation.py.
"""

from __future__ import annotations

import math
import operator
from fractions import Fraction
from operator import attrgetter, methodcaller
from typing import Any, Final

from . import floats, fold, scalar_functions
from .operation import (
    ATOM,
    BITWISE,
    CHOICE,
    COMPARISON,
    LOGIC,
    PRODUCT,
    SUM,
    UNARY,
    Form,
    Operation,
    Parity,
    Sign,
    call,
    infix,
)

CONST: Final = 0
SYMBOL: Final = 1
ADD: Final = 2
SUB: Final = 3
MUL: Final = 4
NEG: Final = 5
DIV: Final = 6
SIN: Final = 7
COS: Final = 8
TAN: Final = 9
ASIN: Final = 10
ACOS: Final = 11
ATAN: Final = 12
SINH: Final = 13
COSH: Final = 14
TANH: Final = 15
ASINH: Final = 16
ACOSH: Final = 17
ATANH: Final = 18
EXP: Final = 19
LOG: Final = 20
SQRT: Final = 21
ABS: Final = 22
SIGN: Final = 23
FLOOR: Final = 24
ATAN2: Final = 25
MINIMUM: Final = 26
MAXIMUM: Final = 27
MODULO: Final = 28
POW: Final = 29
LESS: Final = 30
LESS_EQUAL: Final = 31
EQUAL: Final = 32
AND: Final = 33
OR: Final = 34
NOT: Final = 35
SELECT: Final = 36
LOOKUP: Final = 37
ERF: Final = 38
NORMAL: Final = 39
DERIVED: Final = 40

_BOTH: Final = (True, True, False)

_SIGN: Final = """\
static inline mech_real sign(mech_real x)
{
    return x > 0 ? 1 : x < 0 ? -1 : x;
}
"""

_MINIMUM: Final = """\
static inline mech_real minimum(mech_real a, mech_real b)
{
    return a < b || a != a ? a : b;
}
"""

_MAXIMUM: Final = """\
static inline mech_real maximum(mech_real a, mech_real b)
{
    return a > b || a != a ? a : b;
}
"""

_NORMAL: Final = """\
/* Number k of the standard normal numbers of a seed, both whole: Philox 4x32-10 (J. Salmon and others, SC 2011), its 52 bits by the
 * inverse of the normal distribution (M. Wichura, AS 241, 1988). */
static mech_real normal(mech_real seed, mech_real k)
{
    static const double above[3][8] = {{3.3871328727963666080e0, 1.3314166789178437745e+2, 1.9715909503065514427e+3, 1.3731693765509461125e+4, 4.5921953931549871457e+4, 6.7265770927008700853e+4, 3.3430575583588128105e+4, 2.5090809287301226727e+3},
        {1.42343711074968357734e0, 4.63033784615654529590e0, 5.76949722146069140550e0, 3.64784832476320460504e0, 1.27045825245236838258e0, 2.41780725177450611770e-1, 2.27238449892691845833e-2, 7.74545014278341407640e-4},
        {6.65790464350110377720e0, 5.46378491116411436990e0, 1.78482653991729133580e0, 2.96560571828504891230e-1, 2.65321895265761230930e-2, 1.24266094738807843860e-3, 2.71155556874348757815e-5, 2.01033439929228813265e-7}};
    static const double below[3][8] = {{1, 4.2313330701600911252e+1, 6.8718700749205790830e+2, 5.3941960214247511077e+3, 2.1213794301586595867e+4, 3.9307895800092710610e+4, 2.8729085735721942674e+4, 5.2264952788528545610e+3},
        {1, 2.05319162663775882187e0, 1.67638483018380384940e0, 6.89767334985100004550e-1, 1.48103976427480074590e-1, 1.51986665636164571966e-2, 5.47593808499534494600e-4, 1.05075007164441684324e-9},
        {1, 5.99832206555887937690e-1, 1.36929880922735805310e-1, 1.48753612908506148525e-2, 7.86869131145613259100e-4, 1.84631831751005468180e-5, 1.42151175831644588870e-7, 2.04426310338993978564e-15}};
    const unsigned long long low = 0xFFFFFFFFull;
    if (!(seed < 9e18 && seed > -9e18 && k < 9e18 && k > -9e18)) return (seed - seed) / (k - k);
    const unsigned long long number = (unsigned long long)(long long)k, key = (unsigned long long)(long long)seed;
    unsigned long long a = number & low, b = number >> 32, c = 0, d = 0, p = key & low, q = key >> 32;
    for (int i = 0; i < 10; i++) {
        const unsigned long long x = 0xD2511F53ull * a, y = 0xCD9E8D57ull * c;
        a = (y >> 32) ^ b ^ p, b = y & low;
        c = (x >> 32) ^ d ^ q, d = x & low;
        p = (p + 0x9E3779B9ull) & low, q = (q + 0xBB67AE85ull) & low;
    }
    const double share = ((double)((a << 32 | b) >> 12) + 0.5) / 4503599627370496.0, off = share - 0.5;
    double r, top = 0, bottom = 0;
    int part = 0;
    if (off <= 0.425 && off >= -0.425) {
        r = 0.180625 - off * off;
    } else {
        double rest = off < 0 ? share : 1 - share, exponent = 0, odd = 0;
        while (rest < 0.70710678118654752) rest = rest * 2, exponent = exponent + 1;
        const double s = (rest - 1) / (rest + 1), square = s * s;
        for (int i = 25; i > 0; i -= 2) odd = odd * square + 1.0 / (double)i;
        r = sqrt(exponent * 0.6931471805599453094 - 2 * s * odd);
        part = r <= 5 ? 1 : 2;
        r = r - (part == 1 ? 1.6 : 5);
    }
    for (int i = 7; i >= 0; i--) top = top * r + above[part][i], bottom = bottom * r + below[part][i];
    if (part == 0) return off * top / bottom;
    return off < 0 ? -top / bottom : top / bottom;
}
"""

_DERIVED: Final = """\
static inline mech_real derived(mech_real value, mech_real formula)
{
    (void)formula;
    return value;
}
"""

_MODULO: Final = """\
/* a - b floor(a/b): takes the sign of b. */
static inline mech_real modulo(mech_real a, mech_real b)
{
    const mech_real r = fmod(a, b);
    return r != 0 && (r < 0) != (b < 0) ? r + b : r == 0 ? copysign(r, b) : r;
}
"""


def _one(g: Any, x: tuple[Any, ...], n: Any) -> Any:
    return g.one


def _minus_one(g: Any, x: tuple[Any, ...], n: Any) -> Any:
    return g.minus_one


def _less(g: Any, a: Any, b: Any) -> Any:
    """Return 1 where a < b, else 0."""
    return g.select(g.less(a, b), g.one, g.zero)


def _square_plus(g: Any, a: Any, b: Any) -> Any:
    return g.add(g.mul(a, a), g.mul(b, b))


def _erf_slope(g: Any, x: tuple[Any, ...], n: Any) -> Any:
    """Return 2 exp(-x^2)/sqrt(pi)."""
    return g.div(g.mul(g.two, g.exp(g.neg(g.mul(x[0], x[0])))), g.sqrt(g.constant(Fraction(math.pi))))


OPERATIONS: Final[tuple[Operation, ...]] = (
    Operation(CONST, "constant", 0),
    Operation(SYMBOL, "symbol", 0),
    Operation(
        ADD,
        "add",
        2,
        (_one, _one),
        value=operator.add,
        form=infix("+", SUM),
        wasm="f64.add",
        sympy=operator.add,
        ball=operator.add,
    ),
    Operation(
        SUB,
        "sub",
        2,
        (_one, _minus_one),
        value=operator.sub,
        form=infix("-", SUM),
        wasm="f64.sub",
        sympy=operator.sub,
        ball=operator.sub,
    ),
    Operation(
        MUL,
        "mul",
        2,
        (lambda g, x, n: x[1], lambda g, x, n: x[0]),
        value=operator.mul,
        form=infix("*", PRODUCT),
        wasm="f64.mul",
        sympy=operator.mul,
        ball=operator.mul,
    ),
    Operation(
        NEG,
        "neg",
        1,
        (_minus_one,),
        Parity.ODD,
        value=operator.neg,
        form=Form("-{}", UNARY, (UNARY + 1,)),
        wasm="f64.neg",
        sympy=operator.neg,
        ball=operator.neg,
    ),
    Operation(
        DIV,
        "div",
        2,
        (lambda g, x, n: g.div(g.one, x[1]), lambda g, x, n: g.neg(g.div(n, x[1]))),
        value=floats.divide,
        digits=lambda context: operator.truediv,
        regular=lambda a, b: b != 0,
        form=infix("/", PRODUCT),
        wasm="f64.div",
        sympy=operator.truediv,
        ball=operator.truediv,
    ),
    Operation(
        SIN,
        "sin",
        1,
        (lambda g, x, n: g.cos(x[0]),),
        Parity.ODD,
        value=floats.quiet(math.sin),
        digits=attrgetter("sin"),
        exact=fold.sine,
        ball=methodcaller("sin"),
    ),
    Operation(
        COS,
        "cos",
        1,
        (lambda g, x, n: g.neg(g.sin(x[0])),),
        Parity.EVEN,
        value=floats.quiet(math.cos),
        digits=attrgetter("cos"),
        exact=fold.cosine,
        ball=methodcaller("cos"),
    ),
    Operation(
        TAN,
        "tan",
        1,
        (lambda g, x, n: g.add(g.one, g.mul(n, n)),),
        Parity.ODD,
        value=floats.quiet(math.tan),
        digits=attrgetter("tan"),
        exact=fold.only(0, 0),
        regular=lambda x: math.cos(x) != 0,
        ball=methodcaller("tan"),
    ),
    Operation(
        ASIN,
        "asin",
        1,
        (lambda g, x, n: g.div(g.one, g.sqrt(g.sub(g.one, g.mul(x[0], x[0])))),),
        Parity.ODD,
        value=floats.quiet(math.asin),
        digits=attrgetter("asin"),
        exact=fold.only(0, 0),
        regular=lambda x: abs(x) < 1,
        sign=Sign.OF_ARGUMENT,
        array="np.arcsin",
        ball=methodcaller("asin"),
    ),
    Operation(
        ACOS,
        "acos",
        1,
        (lambda g, x, n: g.neg(g.div(g.one, g.sqrt(g.sub(g.one, g.mul(x[0], x[0]))))),),
        value=floats.quiet(math.acos),
        digits=attrgetter("acos"),
        exact=fold.only(1, 0),
        regular=lambda x: abs(x) < 1,
        sign=Sign.NEVER_NEGATIVE,
        array="np.arccos",
        ball=methodcaller("acos"),
    ),
    Operation(
        ATAN,
        "atan",
        1,
        (lambda g, x, n: g.div(g.one, g.add(g.one, g.mul(x[0], x[0]))),),
        Parity.ODD,
        value=math.atan,
        digits=attrgetter("atan"),
        exact=fold.only(0, 0),
        sign=Sign.OF_ARGUMENT,
        narrow=True,
        array="np.arctan",
        ball=methodcaller("atan"),
    ),
    Operation(
        SINH,
        "sinh",
        1,
        (lambda g, x, n: g.cosh(x[0]),),
        Parity.ODD,
        value=floats.sinh,
        digits=attrgetter("sinh"),
        exact=fold.only(0, 0),
        sign=Sign.OF_ARGUMENT,
        narrow=True,
        ball=methodcaller("sinh"),
    ),
    Operation(
        COSH,
        "cosh",
        1,
        (lambda g, x, n: g.sinh(x[0]),),
        Parity.EVEN,
        value=floats.quiet(math.cosh),
        digits=attrgetter("cosh"),
        exact=fold.only(0, 1),
        sign=Sign.NEVER_NEGATIVE,
        narrow=True,
        ball=methodcaller("cosh"),
    ),
    Operation(
        TANH,
        "tanh",
        1,
        (lambda g, x, n: g.sub(g.one, g.mul(n, n)),),
        Parity.ODD,
        value=math.tanh,
        digits=attrgetter("tanh"),
        exact=fold.only(0, 0),
        sign=Sign.OF_ARGUMENT,
        narrow=True,
        ball=methodcaller("tanh"),
    ),
    Operation(
        ASINH,
        "asinh",
        1,
        (lambda g, x, n: g.div(g.one, g.sqrt(g.add(g.one, g.mul(x[0], x[0])))),),
        Parity.ODD,
        value=math.asinh,
        digits=attrgetter("asinh"),
        exact=fold.only(0, 0),
        sign=Sign.OF_ARGUMENT,
        array="np.arcsinh",
        ball=methodcaller("asinh"),
    ),
    # its derivative: the product of two roots keeps the branch x >= 1 and both factors well conditioned near 1
    Operation(
        ACOSH,
        "acosh",
        1,
        (lambda g, x, n: g.div(g.one, g.mul(g.sqrt(g.sub(x[0], g.one)), g.sqrt(g.add(x[0], g.one)))),),
        value=floats.quiet(math.acosh),
        digits=attrgetter("acosh"),
        exact=fold.only(1, 0),
        regular=lambda x: x > 1,
        sign=Sign.NEVER_NEGATIVE,
        array="np.arccosh",
        ball=methodcaller("acosh"),
    ),
    Operation(
        ATANH,
        "atanh",
        1,
        (lambda g, x, n: g.div(g.one, g.sub(g.one, g.mul(x[0], x[0]))),),
        Parity.ODD,
        value=floats.atanh,
        digits=attrgetter("atanh"),
        exact=fold.only(0, 0),
        regular=lambda x: abs(x) < 1,
        sign=Sign.OF_ARGUMENT,
        array="np.arctanh",
        ball=methodcaller("atanh"),
    ),
    Operation(
        EXP,
        "exp",
        1,
        (lambda g, x, n: n,),
        value=floats.quiet(math.exp),
        digits=attrgetter("exp"),
        exact=fold.only(0, 1),
        sign=Sign.NEVER_NEGATIVE,
        narrow=True,
        ball=methodcaller("exp"),
    ),
    Operation(
        LOG,
        "log",
        1,
        (lambda g, x, n: g.div(g.one, x[0]),),
        value=floats.log,
        digits=attrgetter("log"),
        exact=fold.only(1, 0),
        regular=lambda x: x > 0,
        ball=methodcaller("log"),
    ),
    Operation(
        SQRT,
        "sqrt",
        1,
        (lambda g, x, n: g.div(g.half, n),),
        value=floats.quiet(math.sqrt),
        digits=attrgetter("sqrt"),
        exact=fold.root,
        regular=lambda x: x > 0,
        sign=Sign.NEVER_NEGATIVE,
        wasm="f64.sqrt",
        ball=methodcaller("sqrt"),
    ),
    Operation(
        ABS,
        "abs",
        1,
        (lambda g, x, n: g.sign(x[0]),),
        Parity.EVEN,
        value=abs,
        exact=abs,
        sign=Sign.NEVER_NEGATIVE,
        kinks=True,
        c="fabs",
        wasm="f64.abs",
        python=call("abs", 1),
        casadi="fabs",
        sympy="Abs",
        ball=abs,
    ),
    Operation(
        SIGN,
        "sign",
        1,
        (),
        Parity.ODD,
        value=scalar_functions.sign,
        digits=attrgetter("sign"),
        exact=fold.sign,
        jumps=True,
        sign=Sign.OF_ARGUMENT,
        c_text=_SIGN,
        python=scalar_functions.sign,
    ),
    Operation(
        FLOOR,
        "floor",
        1,
        value=floats.floor,
        digits=attrgetter("floor"),
        exact=fold.whole,
        jumps=True,
        wasm="f64.floor",
        python=scalar_functions.floor,
    ),
    Operation(
        ATAN2,
        "atan2",
        2,
        (
            lambda g, x, n: g.div(x[1], _square_plus(g, x[0], x[1])),
            lambda g, x, n: g.neg(g.div(x[0], _square_plus(g, x[0], x[1]))),
        ),
        value=math.atan2,
        digits=attrgetter("atan2"),
        exact=lambda y, x: Fraction(0) if y == 0 and x > 0 else None,
        regular=lambda y, x: y != 0 or x > 0,
        array="np.arctan2",
        ball=lambda y, x: type(y).atan2(y, x),
    ),
    # at a tie both rules choose the second argument, so that the two partial derivatives sum to one
    Operation(
        MINIMUM,
        "minimum",
        2,
        (lambda g, x, n: _less(g, x[0], x[1]), lambda g, x, n: g.select(g.less(x[0], x[1]), g.zero, g.one)),
        value=scalar_functions.minimum,
        exact=min,
        kinks=True,
        c_text=_MINIMUM,
        python=scalar_functions.minimum,
        casadi="fmin",
        sympy="Min",
    ),
    Operation(
        MAXIMUM,
        "maximum",
        2,
        (lambda g, x, n: _less(g, x[1], x[0]), lambda g, x, n: g.select(g.less(x[1], x[0]), g.zero, g.one)),
        value=scalar_functions.maximum,
        exact=max,
        kinks=True,
        c_text=_MAXIMUM,
        python=scalar_functions.maximum,
        casadi="fmax",
        sympy="Max",
    ),
    Operation(
        MODULO,
        "modulo",
        2,
        (_one, lambda g, x, n: g.neg(g.floor(g.div(x[0], x[1])))),
        value=floats.modulo,
        digits=lambda context: lambda a, b: a - b * context.floor(a / b),
        exact=fold.modulo,
        regular=lambda a, b: b != 0,
        jumps=True,
        c_text=_MODULO,
        calls=("fmod", "copysign"),
        python=infix("%", PRODUCT),
        array="np.mod",
        sympy="Mod",
    ),
    Operation(
        POW,
        "pow",
        2,
        (lambda g, x, n: g.mul(x[1], g.pow(x[0], g.sub(x[1], g.one))), lambda g, x, n: g.mul(g.log(x[0]), n)),
        value=floats.power,
        digits=attrgetter("power"),
        regular=lambda a, b: a > 0,
        array="np.power",
        casadi="power",
        sympy="Pow",
    ),
    Operation(
        LESS,
        "less",
        2,
        value=operator.lt,
        exact=lambda a, b: Fraction(a < b),
        jumps=True,
        condition=True,
        form=infix("<", COMPARISON, groups=False),
        wasm="f64.lt",
        sympy="Lt",
    ),
    Operation(
        LESS_EQUAL,
        "less_equal",
        2,
        value=operator.le,
        exact=lambda a, b: Fraction(a <= b),
        jumps=True,
        condition=True,
        form=infix("<=", COMPARISON, groups=False),
        wasm="f64.le",
        sympy="Le",
    ),
    Operation(
        EQUAL,
        "equal",
        2,
        value=operator.eq,
        exact=lambda a, b: Fraction(a == b),
        jumps=True,
        condition=True,
        form=infix("==", COMPARISON, groups=False),
        wasm="f64.eq",
        sympy="Eq",
        ball=lambda a, b: type(a)(1) if a == b else type(a)(0) if a != b else None,
    ),
    Operation(
        AND,
        "and",
        2,
        value=lambda a, b: bool(a) and bool(b),
        build="logical_and",
        condition=True,
        conditions=_BOTH,
        c=Form("{} && {}", LOGIC, (LOGIC + 1, LOGIC + 1)),
        wasm="i32.and",
        lanes=Form("{} & {}", ATOM, ()),
        python=Form("{} & {}", BITWISE, (BITWISE + 1, BITWISE + 1)),
        array="np.logical_and",
        casadi="logic_and",
        sympy="And",
    ),
    Operation(
        OR,
        "or",
        2,
        value=lambda a, b: bool(a) or bool(b),
        build="logical_or",
        condition=True,
        conditions=_BOTH,
        c=Form("{} || {}", LOGIC, (LOGIC + 1, LOGIC + 1)),
        wasm="i32.or",
        lanes=Form("{} | {}", ATOM, ()),
        python=Form("{} | {}", BITWISE, (BITWISE + 1, BITWISE + 1)),
        array="np.logical_or",
        casadi="logic_or",
        sympy="Or",
    ),
    Operation(
        NOT,
        "not",
        1,
        value=operator.not_,
        build="logical_not",
        condition=True,
        conditions=(True, False, False),
        c=Form("!{}", UNARY, (UNARY + 1,)),
        wasm="i32.eqz",
        lanes=Form("~{}", ATOM, ()),
        python=scalar_functions.negation,
        array="np.logical_not",
        casadi="logic_not",
        sympy="Not",
    ),
    Operation(
        SELECT,
        "select",
        3,
        value=scalar_functions.select,
        conditions=(True, False, False),
        c=Form("{} ? {} : {}", CHOICE, (LOGIC, CHOICE + 1, CHOICE + 1)),
        wasm="select",
        lanes="pick",
        python=scalar_functions.select,
        array="np.where",
        casadi="if_else",
        sympy="Piecewise",
        ball=lambda c, a, b: a if c == 1 else b if c == 0 else None,
    ),
    Operation(
        LOOKUP,
        "lookup",
        1,
        (lambda g, x, n: g.lookup_slope(n),),
    ),
    Operation(
        ERF,
        "erf",
        1,
        (_erf_slope,),
        Parity.ODD,
        value=math.erf,
        digits=attrgetter("erf"),
        exact=fold.only(0, 0),
        sign=Sign.OF_ARGUMENT,
        narrow=True,
        lanes=None,
        array=None,
        jax="jax.scipy.special.erf",
        ball=methodcaller("erf"),
    ),
    Operation(
        NORMAL,
        "normal",
        2,
        value=scalar_functions.normal,
        digits=lambda context: lambda seed, k: context.mpf(scalar_functions.normal(float(seed), float(k))),
        jumps=True,
        c_text=_NORMAL,
        calls=("sqrt",),
        python=scalar_functions.normal,
        lanes=None,
        array=None,
        casadi=None,
        jax=None,
        sympy=None,
    ),
    # programs hold one of its arguments in its place (program/lower.py), but for those that JAX differentiates (program/formulas.py)
    Operation(
        DERIVED,
        "derived",
        2,
        (lambda g, x, n: g.zero, _one),
        value=scalar_functions.derived,
        exact=lambda value, formula: value,
        c_text=_DERIVED,
        wasm="drop",
        lanes=None,
        python=scalar_functions.derived,
        array=None,
        casadi=None,
        jax="derived",
        sympy=scalar_functions.derived,
        ball=scalar_functions.derived,
    ),
)
"""The table, indexed by code."""

PARTIAL: Final = frozenset(row.code for row in OPERATIONS if row.regular is not None)
"""Operations that have no value, or no derivative, for some arguments."""

SINGULAR: Final = 1
"""The trait of what has such an operation somewhere."""

POSITION, VELOCITY, ACCELERATION, PARAMETER, TIME, RATE, OTHER = 2, 4, 8, 16, 32, 64, 128
"""Kinds of symbols, and the traits of what depends on one: what lacks a trait of a symbol does not depend on it."""

JUMPING: Final = frozenset(row.code for row in OPERATIONS if row.jumps)
"""Operations whose value jumps."""
