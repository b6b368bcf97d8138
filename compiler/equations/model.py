"""The equations of one model: what every later stage may ask for, and nothing else.

Normal form. State y = (q, v, x) with sizes nq, nv, nx; inputs u, discrete variables z, parameters p:

    q' = N(q) v          r(q, v, a, x, u, z, p, t) - K(q, t)^T lam = 0          v' = a
    x' = f(t, y, u, z, p)          phi(q, t, p) = 0,  K v + b = 0,  K a + gamma = 0

All functions of the emitted program share one signature (t, y, u, z, p) -> out; ``functions`` lists them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from msgspec import Struct

from mechc.lang.source import Span

from ..graph import Graph, Node
from .crowd_plan import CrowdPlan


class Slot(Struct, frozen=True):
    """Where a symbol of the graph lives at run time: ``array`` is t, y, u, z or p; of functions of crowds also g, what they
    are given behind the inputs."""

    array: str
    index: int


class Entry(Struct, frozen=True):
    """Description of one number of an array: state, parameter, input, discrete variable or output.

    ``unit`` is the SI unit as text (``""`` for a pure number), ``display`` the unit to show it in.
    ``kind``: time; coordinate, rate, state, account; parameter, idle (one that nothing uses); input; discrete, mode (a number of the kernel in z),
    seed (sensitivities.py); output, exact (the closed solution of what its name says), energy, momentum, quadrature (the estimated error of an integral), creep (the
    speed of a regularized friction that ought to stick). ``type``: real, integer or boolean.
    """

    name: str
    kind: str
    unit: str
    display: str = ""
    nominal: float | None = None
    minimum: float | None = None
    maximum: float | None = None
    doc: str = ""
    span: Span | None = None
    interpolation: str = "linear"
    type: str = "real"


class Function(Struct, frozen=True):
    """One function of the program: ``outputs`` are its results in order."""

    name: str
    doc: str
    outputs: tuple[Node, ...]


class ParameterRule(Struct, frozen=True):
    """How a parameter gets its value: a number, or an expression of other parameters."""

    index: int
    value: Node


class SettingTarget(Struct, frozen=True):
    """What one number of an experiment sets: ``array`` is p or y or u; y entries override initial values."""

    array: str
    index: int
    guess: bool


class ExperimentPlan(Struct, frozen=True):
    """``function`` names the function whose outputs are first the ``options``, then the ``settings``."""

    name: str
    doc: str
    function: str
    options: tuple[str, ...]
    words: Mapping[str, str]
    settings: tuple[SettingTarget, ...]
    sweeps: tuple[tuple[SettingTarget, tuple[float, ...]], ...]


EXCHANGED = "exchanged"
"""The part of a curve in which its independent variable is a coordinate, too, over a parameter that nothing knows."""


class Choice(Struct, frozen=True):
    """A decision and its reason, for ``mechc explain``: what was chosen or left out, and why.

    ``fact`` and ``part``: what it is about, where that has a name in needs.py.
    """

    topic: str
    decision: str
    reason: str
    fact: str = ""
    part: str = ""


class AssertionText(Struct, frozen=True):
    """What to say when an assertion fails, and where it stands; its condition is an output of ``assertions``."""

    message: str
    span: Span | None = None


class ConstraintEntry(Struct, frozen=True):
    """One scalar row of the constraints that are kept; ``level`` is position or velocity."""

    name: str
    level: str
    unit: str
    span: Span | None = None


class AssemblyEntry(Struct, frozen=True):
    """One row of the function ``assembly``: what an initial state must fulfil.

    ``stage`` 1: coordinates alone; 2: velocities. ``kind``: constraint, or initial (a condition on an expression,
    only wished where not ``known``).
    """

    name: str
    stage: int
    kind: str
    known: bool
    unit: str
    span: Span | None = None


class SwitchText(Struct, frozen=True):
    """A relation that is frozen between events: its index in z, and what it says. ``after``: see ``HybridPlan``."""

    index: int
    text: str
    after: int = 0


class BranchPlan(Struct, frozen=True):
    """One branch of event number ``event``: its function, condition as text, and the texts of its assertions.

    ``message`` is that of ``terminate``, None where the branch does not end the run. ``sampled``: only ticks of clocks fulfil
    the condition.
    """

    event: int
    function: str
    text: str
    checks: tuple[AssertionText, ...]
    message: str | None
    span: Span | None = None
    sampled: bool = False


class RowPlan(Struct, frozen=True):
    """A row that can be switched (``mech_row`` of the kernel); indices into z, -1 for none.

    ``kind``: contact, friction, freewheel, constraint, step. ``normal``: the row of the contact of a friction, the switch of a
    step.
    """

    kind: str
    name: str
    normal: int
    flag: int
    sign: int
    impulse: int
    enabled: int
    span: Span | None = None


class HybridPlan(Struct, frozen=True):
    """What switches, and the accounts that impacts are booked in (indices in y; -1: none).

    ``times``: switches that change at a known time, to ``after``; ``clocks``: (pulse, count) in z; ``initial``: the
    number in z that is 1 at the start only; ``total``: the output whose balance is kept; ``carried``: it has a part that is linear in
    the velocities, so that what drives the model works at impacts. The functions are
    indicators, indicator_rates, crossing_times, conditions, row_values, respond, and one for each branch. ``slides``: for each switch
    the one of the mode in which the motion slides along its surface, -1 where there is none; empty where no motion slides.
    """

    switches: tuple[SwitchText, ...]
    times: tuple[SwitchText, ...]
    clocks: tuple[tuple[int, int], ...]
    initial: int
    branches: tuple[BranchPlan, ...]
    rows: tuple[RowPlan, ...]
    simultaneous: bool
    dissipated: int
    supplied: int
    total: int
    crowd: CrowdPlan | None = None
    carried: bool = False
    slides: tuple[int, ...] = ()


class SceneShape(Struct, frozen=True):
    """One shape of the picture; ``numbers`` are places in what ``scene_still``, then ``scene`` give.

    Lengths in SI, in the axes of the world. Solids (box, sphere, cylinder, cone, torus, disk, polygon, mesh, frame) and
    curve and surface begin with origin and axes x, y, z (12 numbers); then box: 3 edges; sphere, mesh, frame: 1 length;
    cylinder, cone, torus: 2 lengths and the axis in these axes; disk: 1 length and the axis; polygon: 3 for each
    corner; curve and surface: 3 for each point of ``grid``, the last variable fastest. line: 3 for each point; spring:
    both ends, radius, turns; trail: 3; arrow: 3 and the vector; text: 3; mass: 3 and the mass [kg]; bead, dial: 1 value.
    ``relative``: its length is a factor of what suits the picture. ``colour``: ``#rrggbb``, or empty. ``name``: the
    instance it belongs to. ``text``: of a text; of a mesh the path of its file.
    """

    kind: str
    numbers: tuple[int, ...]
    name: str = ""
    colour: str = ""
    text: str = ""
    relative: bool = False
    grid: tuple[int, ...] = ()


class ScenePlan(Struct, frozen=True):
    """What is drawn. ``size``: 2 in the plane, 3 in space; ``by_rule``: the model itself says nothing of it."""

    size: int
    shapes: tuple[SceneShape, ...]
    n_still: int
    n_moving: int
    by_rule: bool


Labels = tuple[tuple[str, str], ...]
"""Names and SI units."""


class Offer(Struct, frozen=True):
    """A function that a model offers others (offered.py): what people call it, the name of its code, its shape.

    An entry of a matrix has the unit of its row per that of its column; ``columns`` is empty without. ``given``: it reads
    accelerations behind the discrete variables. ``kind``: own, output, jacobian (of an output).
    """

    name: str
    function: str
    doc: str
    shape: tuple[int, ...]
    rows: Labels
    columns: Labels
    given: bool
    kind: str = "own"


BALANCE = "balance"
"""The function of the laws of bodies and of what joints hold (reported/balance.py)."""
SOUGHT = "sought"
"""The function of the systems of equations for outputs."""


class Sought(Struct, frozen=True):
    """Outputs that a system of equations determines, by their indices, from so many ``rows``. The function ``sought`` gives
    for each the guesses, the rows, the sizes of their terms and their derivatives, of values that it is given behind u."""

    outputs: tuple[int, ...]
    rows: int

    @property
    def results(self) -> int:
        """How many numbers of the function belong to it."""
        return len(self.outputs) + 2 * self.rows + self.rows * len(self.outputs)


class CurveRow(Struct, frozen=True):
    """One number that belongs to a curve: an integral, a value at a place, a condition, a multiplier, a first integral.

    ``kind``: integral, lower, upper, inside (values at places); whole, initial, final (conditions on numbers of the whole);
    position, velocity (conditions at every place); momentum, energy (first integrals). ``bound``: an inequality.
    """

    name: str
    kind: str
    unit: str
    bound: bool = False
    span: Span | None = None


class CurvePlan(Struct, frozen=True):
    """A curve q(x), a <= x <= b, with x = a + (b - a) s; every function reads s in t and derivatives by s in y.

    y holds q and ``depth`` derivatives of all coordinates, then the densities of the multipliers of ``points``. z holds
    numbers: ``unknown`` ends of the range, then ``numbers`` (integrals first, then values at places); multipliers of
    ``numbers`` and of ``wholes``; with ``gauge`` the weights of the coordinates in the speed that is kept constant;
    ``further`` numbers, which decide nothing (integrals first).
    ``order``: the highest derivative in what is stationary. ``shared``: which numbers integrands read. Patterns hold places
    of entries that can differ from zero: (row, column), of second derivatives the upper triangle. Columns are derivatives
    (order * coordinates + coordinate), then ``shared``. ``varying``: outputs that differ from place to place. ``exchanged``:
    x is the last coordinate, over a parameter; ``exchangeable``: it could be.
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
    """What a model is told and tells, whatever form its functions have: names, sizes, starts, patterns, plans. Each later stage takes
    it over as it is (``interface_of``)."""

    name: str
    doc: str
    nq: int
    nv: int
    nx: int
    known: tuple[bool, ...]
    experiments: tuple[ExperimentPlan, ...] = ()
    rotations: tuple[int, ...] = ()
    """Indices in y of the first of the four entries of each unit quaternion."""
    conserved: tuple[int, ...] = ()
    """Indices of outputs that are constant along every motion."""
    energy_balance: tuple[int, ...] = ()
    """Indices of outputs (total, dissipated, supplied); -1 where the model has none."""
    assertions: tuple[AssertionText, ...] = ()
    jacobian_pattern: tuple[tuple[int, int], ...] = ()
    """(row, column) of each output of the function ``jacobian``."""
    patterns: Mapping[str, tuple[tuple[int, int], ...]] = {}
    """The same of further functions whose outputs are the entries of a matrix, by their names."""
    dependent: tuple[int, ...] = ()
    """Indices in y of initial values that are stated with those of others; ``initial_of_others`` gives them."""
    constraints: tuple[ConstraintEntry, ...] = ()
    """Independent rows, those of positions first."""
    start_spans: tuple[Span | None, ...] = ()
    """Where the initial value of each state is stated; None where it is not."""
    held_inputs: tuple[int, ...] = ()
    """Inputs that stay at a value, as the equations need their rates, which are zero."""
    found_states: tuple[int, ...] = ()
    """States (indices in y) that the start finds, by conditions on rates and accelerations."""
    found: tuple[int, ...] = ()
    """Parameters that the start finds, and what follows from them: the function ``found`` gives them for a start that is assembled."""
    assembly: tuple[AssemblyEntry, ...] = ()
    """Rows of the functions ``assembly`` and ``assembly_jacobian``, those of the first stage first."""
    separable: bool = False
    """q' = v, no first-order states, and accelerations that do not depend on velocities."""
    hybrid: HybridPlan | None = None
    """None where nothing switches."""
    scene: ScenePlan | None = None
    """None where nothing asks for a picture."""
    phase: tuple[Entry, ...] = ()
    """What the functions ``phase``, ``phase_rate`` and ``phase_gradient`` give (reported/phase.py); named by formulas."""
    curve: CurvePlan | None = None
    """None where the model moves."""
    matter: tuple[Entry, ...] = ()
    """Masses (each with its place) and inertias that the function ``matter`` gives (reported/matter.py)."""
    balance: tuple[Entry, ...] = ()
    """What its function checks, two numbers each."""
    offers: tuple[Offer, ...] = ()
    """What ``model.functions`` gives (offered.py)."""
    sought: tuple[Sought, ...] = ()
    """Systems of equations for outputs (reported/sought.py)."""


def interface_of(value: ModelInterface) -> dict[str, Any]:
    """Return the fields of the interface of a stage's value, for the next one."""
    return {name: getattr(value, name) for name in ModelInterface.__struct_fields__}


class Equations(ModelInterface, frozen=True, kw_only=True):
    """Sizes agree; ``layout`` covers every symbol that ``functions`` use; the graph is acyclic and interned."""

    graph: Graph
    layout: Mapping[Node, Slot]
    time: Entry
    states: tuple[Entry, ...]
    parameters: tuple[Entry, ...]
    parameter_rules: tuple[ParameterRule, ...]
    inputs: tuple[Entry, ...]
    discretes: tuple[Entry, ...]
    outputs: tuple[Entry, ...]
    functions: tuple[Function, ...]
    needs: frozenset[str]
    choices: tuple[Choice, ...]
    given: tuple[Entry, ...] = ()
    """Numbers behind the inputs that functions of crowds and the outputs are given (hybrid/crowd.py), then those of ``sought``."""

    @property
    def matter_size(self) -> int:
        """How many numbers the function ``matter`` gives: of places and tensors in the plane or in space."""
        return sum(self.matter_width[x.kind] for x in self.matter)

    @property
    def matter_width(self) -> Mapping[str, int]:
        """How many numbers belong to a mass and to an inertia."""
        found = next((f for f in self.functions if f.name == "matter"), None)
        masses = sum(x.kind == "mass" for x in self.matter)
        planar = found is not None and len(found.outputs) == 3 * masses + (len(self.matter) - masses)
        return {"mass": 3, "inertia": 1} if planar else {"mass": 4, "inertia": 9}
