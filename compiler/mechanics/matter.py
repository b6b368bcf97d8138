"""Masses, inertias and energies of a model, each lowered when first needed: by the build, or by a question about them."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

from mechc.lang.diagnostics import Reporter

from ..flat.model import Energy, Expression, FlatModel, Inertia, Mass, Query, friction_name
from ..graph import Graph, Node
from ..graph.differentiate import vjp
from .contacts import directions, gap_parts, keeps_distance, part_names, switched_names
from .drives import drive_rows
from .energies import kinetic_energy, momenta_of, potential_energy, total_energy
from .forces import damping_power, virtual_power
from .kinematics.frames import Frame, FrameKinematics
from .kinematics.pose import numbers_of
from .kinematics.rates import TotalDerivative
from .kinematics.reactions import virtual_rates
from .meaning.lower import Lowering
from .meaning.symbols import Scalar, Symbols
from .system import DriveRow, PointMass, RotaryInertia

STATED = "a mass, an inertia or an energy is a function of the state; write what follows a force as a 'force'"


class Matter:
    """What a model says of masses, inertias, energies and drives. It answers the questions that the state decides."""

    def __init__(self, lowering: Lowering, model: FlatModel, symbols: Symbols, reporter: Reporter) -> None:
        self._lowering = lowering
        self._model = model
        self._symbols = symbols
        self._reporter = reporter
        self._masses: tuple[PointMass, ...] | None = None
        self._inertias: tuple[RotaryInertia, ...] | None = None
        self._values: dict[int, Node] = {}
        self._placed: dict[int, Frame] = {}
        """Frames that no question places, by identity."""
        self._drives: tuple[DriveRow, ...] | None = None
        lowering.questions.answer = self._answer

    # ------------------------------------------------------------ what bodies.py and energies.py look at

    @property
    def graph(self) -> Graph:
        return self._lowering.graph

    @property
    def rate(self) -> TotalDerivative:
        return self._lowering.rate

    @property
    def kinematics(self) -> FrameKinematics:
        return self._lowering.kinematics

    @property
    def masses(self) -> tuple[PointMass, ...]:
        if self._masses is None:
            need = self._lowering.questions.need
            found = []
            for k, mass in enumerate(self._model.masses):
                with need(("mass", k), "a mass", mass.value.span):
                    found.append(self._mass(mass))
            self._masses = tuple(found)
        return self._masses

    @property
    def inertias(self) -> tuple[RotaryInertia, ...]:
        if self._inertias is None:
            need = self._lowering.questions.need
            found = []
            for k, inertia in enumerate(self._model.inertias):
                with need(("inertia", k), "an inertia", inertia.value.span):
                    found.append(self._inertia(inertia))
            self._inertias = tuple(found)
        return self._inertias

    @property
    def drives(self) -> tuple[DriveRow, ...]:
        if self._drives is None:
            self._drives = drive_rows(self._lowering, self._model, self._symbols, self._reporter)
        return self._drives

    @property
    def driven(self) -> frozenset[Node]:
        """Positions, velocities and accelerations of the coordinates that drives prescribe."""
        rates = {i for row in self.drives for i in row.v}
        places = {k for row in self.drives for k in row.q}
        found: set[Node] = set()
        first = begin = 0
        for c in self._symbols.coordinates:
            own = range(first, first + len(c.v))
            for n, i in enumerate(own):
                if i in rates:
                    found |= {c.v[n].node, c.a[n]}
            if all(i in rates for i in own):
                found |= {s.node for s in c.q}
            found |= {s.node for k, s in enumerate(c.q, begin) if k in places}
            first, begin = first + len(c.v), begin + len(c.q)
        return frozenset(found)

    def energies(self) -> tuple[Node, Node, Node, Node]:
        """Return T, V, further terms of the Lagrangian, and R."""
        kinetic, potential, lagrangian, dissipation = self._sums(
            "kinetic", "potential", "lagrangian", "dissipation"
        )
        return kinetic, potential, lagrangian, dissipation

    @property
    def statements(self) -> tuple[Node, ...]:
        """Return the formula of each statement of an energy."""
        return tuple(self._value(k) for k in range(len(self._model.energies)))

    # ------------------------------------------------------------ statements

    def _mass(self, mass: Mass) -> PointMass:
        graph, lowering = self.graph, self._lowering
        value = lowering.scalar(mass.value)
        self._check_fixed(
            (value,),
            "a mass",
            mass.value,
            "write the energy as 'kinetic'; 'mass' means m a = F: added matter has the velocity of the point",
        )
        field = None if mass.gravity is None else self._field(mass.gravity)
        if field is not None and all(graph.is_zero(x) for x in field):
            field = None
        point = lowering.point(mass.at)
        self._check_place(point.frame, mass.at)
        return PointMass(value, point, field, mass.origin)

    def _field(self, gravity: Expression) -> tuple[Node, ...]:
        field = self._lowering.numbers(gravity)
        if self.graph.depend(field, self._symbols.accelerations):
            raise self._reporter.fail(
                "E0519",
                "'gravity' must not depend on accelerations",
                gravity.span,
                caption="this contains a second derivative",
                help="write the inertia as 'kinetic', 'mass' or 'inertia'",
            )
        self._check_fixed(
            field,
            "'gravity'",
            gravity,
            "it is a uniform field: write what depends on the place as 'potential', or as a 'force' at the point",
        )
        return field

    def _inertia(self, inertia: Inertia) -> RotaryInertia:
        lowering = self._lowering
        entries = lowering.numbers(inertia.value)
        size = 1 if lowering.kinematics.size == 2 else 3
        rows = tuple(entries[i * size : (i + 1) * size] for i in range(size))
        self._check_fixed(
            entries,
            "an inertia",
            inertia.value,
            "state it in the axes of a frame that moves with the body, or write the energy as 'kinetic'",
        )
        frame = lowering.frame(inertia.on)
        self._check_place(frame, inertia.on)
        return RotaryInertia(rows, frame, inertia.origin)

    def _check_fixed(self, nodes: Sequence[Node], what: str, value: Expression, help: str) -> None:
        self._lowering.questions.refuse(nodes, what, value, STATED)
        if self.graph.depend(nodes, self._symbols.moving):
            self._reporter.error(
                "E0513",
                f"{what} must not depend on coordinates",
                value.span,
                caption="this does",
                help=help,
            )

    def _check_place(self, frame: Frame, place: Expression) -> None:
        """Report a body on a frame that a question places."""
        nodes: list[Node] = []
        passed: list[Frame] = []
        at: Frame | None = frame
        while at is not None and id(at) not in self._placed:
            nodes += [] if at.step is None else numbers_of(at.step)
            passed.append(at)
            at = at.parent
        allowed = self._lowering.questions.refuse_all(
            nodes, "the place of a mass", place, "let a joint or a constraint carry it there"
        )
        if allowed:
            self._placed.update((id(at), at) for at in passed)

    def _value(self, k: int) -> Node:
        """Return the formula of one statement of an energy."""
        if k not in self._values:
            energy = self._model.energies[k]
            words = "'dissipation'" if energy.kind == "dissipation" else f"a '{energy.kind}'"
            with self._lowering.questions.need(("energy", k), words, energy.value.span):
                value = self._lowering.scalar(energy.value)
            self._check_energy(energy, value)
            self._values[k] = value
        return self._values[k]

    def _check_energy(self, energy: Energy, value: Node) -> None:
        if energy.kind != "dissipation":
            self._lowering.questions.refuse((value,), f"'{energy.kind}'", energy.value, STATED)
        accelerations = self._symbols.accelerations
        if energy.kind != "lagrangian" and self.graph.depend([value], accelerations):
            self._reporter.error(
                "E0519",
                f"'{energy.kind}' must not depend on accelerations",
                energy.value.span,
                caption="this contains a second derivative",
                help="second derivatives are allowed in 'lagrangian' only",
            )

    def _sums(self, *kinds: str) -> tuple[Node, ...]:
        """Return the sum of each kind."""
        graph = self.graph
        sums = dict.fromkeys(kinds, graph.constant(0))
        for k, energy in enumerate(self._model.energies):
            if energy.kind in kinds:
                sums[energy.kind] = graph.add(sums[energy.kind], self._value(k))
        return tuple(sums.values())

    # ------------------------------------------------------------ answers

    def _answer(self, query: Query) -> Sequence[Node] | None:
        """Return the numbers of an answer that the state decides; None where there is none."""
        from .bodies import inertia_tensor, mass_centre

        match query.function:
            case "energy":
                return [self._total()]
            case "kinetic_energy":
                return [kinetic_energy(self, *self._sums("kinetic"))]
            case "potential_energy":
                return [potential_energy(self, *self._sums("potential"))]
            case "momentum":
                return self._momentum(query.target)
            case "power":
                return self._power(query.target)
            case "closed":
                return self._closed(query.target)
            case "mass_centre":
                frame = self._lowering.frame(query.arguments[0]) if query.arguments else None
                return mass_centre(self, frame)
            case "inertia_tensor":
                rows = inertia_tensor(self, self._lowering.frame(query.arguments[0]))
                return None if rows is None else [entry for row in rows for entry in row]
            case _:
                return None

    def _lagrangian(self) -> Node:
        """Return L, with answers instead of frames put in."""
        graph = self.graph
        kinetic, potential, further = self._sums("kinetic", "potential", "lagrangian")
        difference = graph.sub(kinetic_energy(self, kinetic), potential_energy(self, potential))
        return graph.add(difference, further)

    def _free(self) -> list[tuple[Scalar, Node]]:
        """Return the velocities that no drive prescribes, with their accelerations."""
        driven = {i for row in self.drives for i in row.v}
        pairs = [pair for c in self._symbols.coordinates for pair in zip(c.v, c.a, strict=True)]
        return [pair for i, pair in enumerate(pairs) if i not in driven]

    def _total(self) -> Node:
        lagrangian = self._lagrangian()
        velocities = [s.node for c in self._symbols.coordinates for s in c.v]
        accelerations = [a for c in self._symbols.coordinates for a in c.a]
        momenta, seconds = momenta_of(self.graph, self.rate, lagrangian, velocities, accelerations)
        total = total_energy(self.graph, lagrangian, velocities, accelerations, momenta, seconds)
        virtual = virtual_rates(self.graph, lagrangian)  # of what a reaction holds: they move, too
        parts = vjp(self.graph, [(lagrangian, self.graph.one)], virtual)
        return self.graph.add(total, self.graph.dot(parts, virtual)) if virtual else total

    def _momentum(self, target: str) -> Sequence[Node] | None:
        asked = [(s, a) for s, a in self._free() if s.variable.name == target]
        count = sum(s.variable.name == target for c in self._symbols.coordinates for s in c.v)
        if not asked or len(asked) < count:
            return None
        velocities, accelerations = [s.node for s, _ in asked], [a for _, a in asked]
        return momenta_of(self.graph, self.rate, self._lagrangian(), velocities, accelerations)[0]

    def _power(self, target: str) -> Sequence[Node] | None:
        graph, lowering = self.graph, self._lowering
        for load in self._model.loads:
            if load.name == target:
                return [graph.sum(graph.mul(r, e) for r, e in virtual_power(lowering, load, self._symbols))]
        for item in self._model.dampings:
            if item.name == target:
                return [damping_power(lowering, item, self._symbols)]
        return None

    def _closed(self, target: str) -> Sequence[Node]:
        """Return the flag of the mode: a contact presses, a friction sticks; what is never released is always closed."""
        if any(friction.name == target for friction in self._model.frictions):
            sticks = self.graph.symbol(f"sticks({target})")
            self._lowering.questions.modes[sticks] = None
            return [sticks]
        of_contact = next(
            (c for c in self._model.contacts if target in (c.name, friction_name(c.name))), None
        )
        if of_contact is None and target not in switched_names(self._model):
            return [self.graph.one]
        names: tuple[str, ...] = (target,)
        word, direction = "closed", ""
        if of_contact is not None:
            if of_contact.name not in switched_names(self._model) and keeps_distance(
                self._lowering, of_contact, self._symbols.moving - self.driven
            ):
                return [self.graph.zero]
            parts = gap_parts(self._lowering, of_contact, self._symbols.positions)
            names = part_names(of_contact.name, len(parts))
            if target != of_contact.name and of_contact.along is not None:  # in all directions at once
                word, direction = "sticks", directions(math.prod(of_contact.along.type.shape))[0]
        flags = [self.graph.symbol(f"{word}({name}){direction}") for name in names]
        self._lowering.questions.modes |= dict.fromkeys(flags)
        return [functools.reduce(self.graph.logical_or, flags)]
