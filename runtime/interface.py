"""The interface of a model, as plain data: what it is told and tells, in its own words.

The compiler builds it once, and every later stage carries it: equations, programs, problems. It knows nothing of the language;
places in the text are ``Origin``.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from typing import Any

from msgspec import Struct, field

BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd")

GROWTH = "ln(growth)"
"""The state that holds the logarithm of how far a change that goes along with the motion has grown."""
COMPLIANCE = "compliance"
"""The part of a model that gives multipliers a compliance and constraints weights although nothing was found beforehand that
needs them: where a run has met it."""
PURE = ("", "1", "rad")
"""Units of numbers that have a size of their own."""
_ELEMENT = re.compile(r"(.+)\[(\d+(?:,\d+)*)\]")


def array_of(name: str) -> tuple[str, tuple[int, ...]]:
    """Return the array of which a quantity is an element, and its subscripts: ``arm[1].tip`` and (3,) of ``arm[1].tip[3]``."""
    found = _ELEMENT.fullmatch(name)
    return (found[1], tuple(int(k) for k in found[2].split(","))) if found else (name, ())


class Origin(Struct, frozen=True):
    """A place in the user's text, as plain data."""

    file: str
    line: int
    column: int
    text: str


class Quantity(Struct, frozen=True):
    """One number of an array. ``kind``: coordinate, rate, state, account, parameter, input, discrete, output, exact (the closed solution of
    what stands in its name), energy, momentum. ``unit`` is SI; ``nominal`` None where the model gives none. ``interpolation``, of an
    input by a table: linear, step or spline. ``usual``: how the unit is usually written, empty where it is."""

    name: str
    kind: str
    unit: str
    display: str = ""
    nominal: float | None = None
    minimum: float | None = None
    maximum: float | None = None
    doc: str = ""
    origin: Origin | None = None
    interpolation: str = "linear"
    usual: str = ""
    type: str = "real"
    exponents: tuple[str, ...] = ()
    """Those of ``BASE_UNITS``, whole numbers or fractions; empty for a pure number."""

    @property
    def measure(self) -> str:
        """What its unit measures, in one text for units that are the same: ``m`` for ``J/N``, too."""
        return self.usual or self.unit


class Setting(Struct, frozen=True):
    """Sets entry ``index`` of ``array`` (p, y or u); a y entry overrides an initial value."""

    array: str
    index: int
    guess: bool = False


OF_ENSEMBLES = ("vary", "keep", "samples", "seed", "sampling", "errors")
"""Words of experiments that are many runs: one run knows nothing of them."""


class Experiment(Struct, frozen=True):
    """``function`` gives, from (t, y, u, z, p), first the values of ``options``, then those of ``settings``."""

    name: str
    doc: str
    function: str
    options: tuple[str, ...]
    words: Mapping[str, str]
    settings: tuple[Setting, ...]
    sweeps: tuple[tuple[Setting, tuple[float, ...]], ...] = ()


class AssertionEntry(Struct, frozen=True):
    """What has to hold; ``stated``: by an ``assert`` of the model."""

    message: str
    origin: Origin | None
    stated: bool = True


class HybridBranch(Struct, frozen=True):
    """A branch of a ``when``: its condition as text; ``message`` of ``terminate``, None where it goes on.

    ``sampled``: only ticks of clocks fulfil the condition.
    """

    text: str
    checks: tuple[AssertionEntry, ...]
    message: str | None
    origin: Origin | None = None
    sampled: bool = False


class SwitchedRow(Struct, frozen=True):
    """``kind``: contact, friction, freewheel (a friction that never gives way backwards), constraint, step."""

    name: str
    kind: str
    origin: Origin | None = None


class Delay(Struct, frozen=True):
    """A delay: the text of one expression that has it."""

    text: str
    origin: Origin | None = None


class ContactLine(Struct, frozen=True):
    """Contacts of a crowd with numbers from ``first`` on, called by ``head``, a label and ``end``: those of ``labels`` from ``start``
    to ``stop``."""

    first: int
    head: str
    labels: int
    start: int
    stop: int
    end: str
    origin: Origin | None = None


class Hybrid(Struct, frozen=True):
    """The names of what ``mech_hybrid`` of the kernel numbers: located switches, branches, rows, delays. A contact of a crowd has
    a row for its gap and one for its slip; these are told by ``lines`` and ``labels``."""

    switches: tuple[str, ...]
    branches: tuple[HybridBranch, ...]
    rows: tuple[SwitchedRow, ...]
    delays: tuple[Delay, ...] = ()
    lines: tuple[ContactLine, ...] = ()
    labels: tuple[tuple[str, ...], ...] = ()

    @property
    def n_rows(self) -> int:
        last = self.lines[-1] if self.lines else None
        return len(self.rows) if last is None else 2 * (last.first + last.stop - last.start)

    def row(self, index: int) -> SwitchedRow:
        """Return the row of a number."""
        if not self.lines:
            return self.rows[index]
        line = self.lines[bisect_right(self.lines, index // 2, key=lambda one: one.first) - 1]
        label = self.labels[line.labels][line.start + index // 2 - line.first]
        kind = "friction" if index % 2 else "contact"
        return SwitchedRow(f"{line.head}{label}{line.end}", kind, line.origin)


class ConstraintEntry(Struct, frozen=True):
    """One scalar row; ``level`` is position or velocity."""

    name: str
    level: str
    unit: str
    origin: Origin | None = None


class AssemblyRow(Struct, frozen=True):
    """One equation of the initial state: ``stage`` 1 for coordinates alone, 2 with velocities. ``kind``: constraint, or initial (a
    condition on an expression, only wished where not ``known``)."""

    name: str
    stage: int
    kind: str
    known: bool
    unit: str
    origin: Origin | None = None


class TimedPoints(Struct, frozen=True):
    """Points of a table whose argument is ``a + b*time``; the function ``timed_arguments`` gives a and b. ``bends``: how far the table
    leaves at each the parabola before it, over the shorter cell, as a share of its values. ``periodic``: it repeats."""

    points: tuple[float, ...]
    bends: tuple[float, ...]
    periodic: bool = False


class OfferedFunction(Struct, frozen=True):
    """A function that a model offers others: what people call it, the name of its code, its shape; names and units of its
    rows and columns (an entry has the unit of its row per that of its column; no columns: no matrix).

    ``given``: it reads accelerations after the discrete variables. ``kind``: own, output, jacobian (of an output). ``later``: its
    code is in a library of its own, which is built when somebody asks for it.
    """

    name: str
    function: str
    doc: str
    shape: tuple[int, ...]
    rows: tuple[tuple[str, str], ...]
    columns: tuple[tuple[str, str], ...]
    given: bool
    kind: str = "own"
    later: bool = False


class SoughtOutputs(Struct, frozen=True):
    """Outputs that a system of equations determines, by indices, from so many ``rows``. The function ``sought`` is given values
    after u, for all systems, and gives for each the guesses, the rows, the sizes of their terms and their derivatives."""

    outputs: tuple[int, ...]
    rows: int


class ShapeEntry(Struct, frozen=True):
    """One shape of the picture. ``numbers``: places in what ``scene_still``, then ``scene`` give, in SI and world axes.

    box, sphere, cylinder, cone, torus, disk, polygon, mesh, frame, curve and surface begin with origin and axes x, y, z
    (12 numbers); then box: 3 edges; sphere, mesh, frame: 1 length; cylinder, cone, torus: 2 lengths and the axis in
    these axes; disk: 1 length and the axis; polygon: 3 for each corner; curve and surface: 3 for each point of
    ``grid``, the last variable fastest. line: 3 for each point; spring: both ends, radius, turns; trail: 3; arrow:
    3 and the vector; text: 3; mass: 3 and the mass [kg]; bead, dial: 1 value, which has no place. ``relative``: its length is a factor of what
    suits the picture. ``colour``: ``#rrggbb``, or empty. ``text``: of a text; of a mesh the path of its file; of a bead or a dial what
    its value is called.
    """

    kind: str
    numbers: tuple[int, ...]
    name: str = ""
    colour: str = ""
    text: str = ""
    relative: bool = False
    grid: tuple[int, ...] = ()


class Scene(Struct, frozen=True):
    """What is drawn. ``size``: 2 in the plane, 3 in space; ``by_rule``: the model itself says nothing of it.

    The functions ``scene_still`` and ``scene`` give ``n_still`` numbers of the parameters and ``n_moving`` others.
    """

    size: int
    shapes: tuple[ShapeEntry, ...]
    n_still: int
    n_moving: int
    by_rule: bool


class CurveRow(Struct, frozen=True):
    """One number that belongs to a curve. ``kind``: integral, lower, upper, inside (values at places); whole, initial,
    final (conditions on numbers); position, velocity (conditions at every place); momentum, energy (first integrals).
    ``bound``: an inequality, not negative."""

    name: str
    kind: str
    unit: str
    bound: bool = False
    origin: Origin | None = None


class CurveInterface(Struct, frozen=True):
    """A curve q(x), a <= x <= b, with x = a + (b - a) s; every function reads s in t and derivatives by s in y, for many
    places at once.

    y: q and ``depth`` derivatives of all ``coordinates``, then densities of the multipliers of ``points``. z: ``unknown``
    ends of the range, then ``numbers`` (integrals first, then values at places); multipliers of ``numbers`` and of
    ``wholes``; with ``gauge`` the weights of the coordinates in the speed that is kept constant; ``further`` numbers, for
    reports only. ``order``: the highest derivative in the conditions. ``shared``: numbers that integrands read. Patterns hold
    places (row, column) of the entries of derivatives, of second ones the upper triangle; columns are derivatives (order *
    coordinates + coordinate), then ``shared``. ``varying``: outputs that vary along the curve. ``bends``: a formula in
    the conditions has a kink. ``guessed``: coordinates with a guess. ``exchanged``: x is the last coordinate, as a
    function of an arbitrary parameter; ``exchangeable``: it could be.
    """

    coordinates: int
    order: int
    depth: int
    unknown: int
    numbers: tuple[CurveRow, ...]
    further: tuple[CurveRow, ...]
    wholes: tuple[CurveRow, ...]
    points: tuple[CurveRow, ...]
    first: tuple[CurveRow, ...]
    shared: tuple[int, ...]
    gradient: tuple[tuple[int, int], ...]
    curvature: tuple[tuple[int, int], ...]
    point_gradient: tuple[tuple[int, int], ...]
    point_curvature: tuple[tuple[int, int], ...]
    place_gradient: tuple[tuple[int, int], ...]
    place_curvature: tuple[tuple[int, int], ...]
    whole_gradient: tuple[tuple[int, int], ...]
    whole_curvature: tuple[tuple[int, int], ...]
    varying: tuple[bool, ...]
    unit: str
    action: bool
    gauge: bool
    bends: bool
    guessed: tuple[bool, ...]
    exchanged: bool
    exchangeable: bool


class ModelInterface(Struct, frozen=True, kw_only=True):
    """What a model is told and tells, whatever form its functions have: names, sizes, starts, patterns. Plain data, which each stage takes
    over from the one before it (``interface_of``).

    Sizes: ny = nq + nv + nx = len(states); p holds len(parameters) values, then nh hoisted constants.
    ``known[i]``: the initial value of state i is prescribed, not guessed."""

    name: str
    doc: str
    nq: int
    nv: int
    nx: int
    nh: int = 0
    time: Quantity
    states: tuple[Quantity, ...]
    parameters: tuple[Quantity, ...]
    inputs: tuple[Quantity, ...]
    discretes: tuple[Quantity, ...]
    outputs: tuple[Quantity, ...]
    known: tuple[bool, ...]
    rotations: tuple[int, ...] = ()
    assertions: tuple[AssertionEntry, ...] = ()
    experiments: tuple[Experiment, ...] = ()
    held_inputs: tuple[int, ...] = ()
    """Inputs that stay at a value, as the equations need their rates, which are zero."""
    found_states: tuple[int, ...] = ()
    """States (indices in y) that the start finds, by conditions on rates and accelerations."""
    found: tuple[int, ...] = ()
    """Parameters that the start finds, and what follows from them: the function ``found`` gives them for a state on the constraints."""
    timed_points: tuple[TimedPoints, ...] = ()
    """Of tables of time at whose points second derivatives jump: steps end there."""
    dependent: tuple[int, ...] = ()
    """Indices of initial values that are stated with those of other states: the function ``initial_of_others`` gives
    them from y, so that they follow settings."""
    constraints: tuple[ConstraintEntry, ...] = ()
    """Independent rows, those of positions first."""
    starts: tuple[Origin | None, ...] = ()
    """Where the initial value of each state is stated; empty if nobody knows."""
    assembly: tuple[AssemblyRow, ...] = ()
    """Rows of the functions ``assembly`` (residuals) and ``assembly_jacobian`` (by the velocities, row by row)."""
    conserved: tuple[int, ...] = ()
    """Indices of outputs that are constant along every motion (momenta of cyclic coordinates, energy)."""
    energy_balance: tuple[int, ...] = ()
    """Indices of outputs (total, dissipated, supplied) with total + dissipated - supplied constant;
    dissipated and supplied are -1 where the model has none."""
    phase: tuple[Quantity, ...] = ()
    """What the functions ``phase``, ``phase_rate`` and ``phase_gradient`` (by q and v, row by row) give, named by its
    formula; kinds: momentum, energy, potential, spin, linear, angular, moment, place, atom, output. Empty unless asked for."""
    matter: tuple[Quantity, ...] = ()
    """Bodies: kind mass (the function ``matter`` gives the mass and its place) and inertia (the tensor in the axes of the
    world), ``matter_size`` numbers in all. Empty unless asked for."""
    matter_size: int = 0
    balance: tuple[Quantity, ...] = ()
    """What the function ``balance`` checks: kinds force, moment (names are bodies), place, direction (joints); of each the
    squares of what it is off by and of its size."""
    offers: tuple[OfferedFunction, ...] = ()
    """Functions for others (``local/model_functions.py``). Empty unless asked for; then ``discretes`` ends with a number for
    each velocity, of kind seed: the accelerations that some read."""
    sought: tuple[SoughtOutputs, ...] = ()
    """Systems of equations for outputs; empty where none is followed."""
    groups: tuple[int, ...] = ()
    """A number for each state, the same for those that feel each other; empty where all do."""
    followers: tuple[int, ...] = ()
    """Indices of states of first order on which the motion does not depend, as integrals that nothing reads."""
    narrow: bool = False
    """Derivatives hold formulas that may be narrow: exponentials, hyperbolic functions, tables; of the time itself also quotients, roots
    and high powers."""
    narrow_events: bool = False
    """So does what events are looked for in."""
    pulsed: bool = False
    """Derivatives hold formulas of the time alone that may be narrow elsewhere than at ends of steps."""
    bent: bool = False
    """Derivatives hold formulas with kinks that no event locates: ``abs``, ``min``, ``max``, tables."""
    no_series: str = ""
    """Why its code holds no Taylor series though they were asked for."""
    hybrid: Hybrid | None = None
    """None where nothing switches. ``discretes`` then ends with entries of kind "mode", which are not results."""
    scene: Scene | None = None
    """None where nobody asked for a picture."""
    patterns: Mapping[str, tuple[tuple[int, int], ...]] = field(default_factory=dict)
    """(row, column) of each output of functions that give the entries of a matrix, by the names of these."""
    curve: CurveInterface | None = None
    """None where the model moves; a curve has functions in Python only."""

    @property
    def ny(self) -> int:
        return self.nq + self.nv + self.nx

    @property
    def own(self) -> tuple[int, ...]:
        """Indices of the states on which the motion depends: all but accounts of energy and followers.

        Studies of the motion look at these alone.
        """
        following = set(self.followers)
        return tuple(k for k, q in enumerate(self.states) if q.kind != "account" and k not in following)

    @property
    def partner(self) -> tuple[int, ...]:
        """Index in y of the coordinate of each velocity [nv]; the three of a rotation belong to its first entry.

        By their names, as a coordinate whose rate is prescribed has no velocity; else in order.
        """
        names, nq, nv = [q.name for q in self.states], self.nq, self.nv
        places = {name: i for i, name in enumerate(names[:nq])}
        found: list[int] = []
        for name in names[nq : nq + nv]:
            base, _, _ = name.removeprefix("der(").rpartition(")")
            place = places.get(base, places.get(f"{base}[1]"))
            if place is None:
                return _partners_in_order(nq, nv, self.rotations)
            found.append(place)
        return tuple(found)


def interface_of(value: ModelInterface, kind: type[ModelInterface] = ModelInterface) -> dict[str, Any]:
    """Return the fields of an interface by name, for the next stage."""
    return {name: getattr(value, name) for name in kind.__struct_fields__}


def derived_among(inputs: Sequence[str]) -> dict[int, tuple[int, int]]:
    """Return the indices of the first and second derivative of each input that drives, by its own, among the names of inputs."""
    index = {name: k for k, name in enumerate(inputs)}
    return {
        k: (index[f"der({name})"], index[f"der(der({name}))"])
        for name, k in index.items()
        if f"der(der({name}))" in index
    }


def _partners_in_order(nq: int, nv: int, rotations: Sequence[int]) -> tuple[int, ...]:
    partner, coordinate = list[int](), 0
    while coordinate < nq and len(partner) < nv:
        partner += [coordinate] * (3 if coordinate in rotations else 1)
        coordinate += 4 if coordinate in rotations else 1
    return tuple(partner)
