"""One random model for each seed."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from random import Random

from random_models import bodies, coordinates, decorations
from random_models.arithmetic import arithmetic
from random_models.bends import bends
from random_models.cases import cases
from random_models.closing import closing
from random_models.connected import connected
from random_models.deeds import deeds
from random_models.drags import drags
from random_models.driven import driven
from random_models.everyday import everyday
from random_models.fields import fields
from random_models.followers import followers
from random_models.forms import forms
from random_models.formulas import formulas
from random_models.grids import grids
from random_models.growing import growing
from random_models.hanging import hanging
from random_models.landing import landing
from random_models.leaning import leaning
from random_models.letting_go import letting_go
from random_models.linkages import followed, groups, linkages, pins
from random_models.lists import lists
from random_models.measured import measured
from random_models.narrow import narrow
from random_models.orbits import orbits
from random_models.orientations import orientations
from random_models.parts import parts
from random_models.placed import alone, is_alone, placed
from random_models.quantities import quantity
from random_models.quiet import is_quiet, quiet
from random_models.scope import File, Scope
from random_models.signals import signals
from random_models.sizes import sizes
from random_models.slider import slider
from random_models.stepped import stepped
from random_models.steps import steps
from random_models.tasks import tasks
from random_models.timed import timed
from random_models.together import together
from random_models.tree import TIME, Model, Seq, Slot, statement
from random_models.turns import turns
from random_models.unknown import unknowns
from random_models.weights import weights
from random_models.within import sized, within

LATE = 0.05
"""Of the models say when their output begins."""
TOLD = 0.4
"""Of the models with inputs have one that their experiment sets."""
F = Fraction


def skeleton(seed: int) -> Scope:
    """Write the statements of a model without components of its own."""
    random = Random(seed)
    s = Scope(File(random), space=random.choice((0, 0, 2, 2, 3, 3)))
    s.locked = s.chance(0.4)
    if s.space:
        bodies.tree(s)
        bodies.observe(s)
        if s.chance(0.25):
            coordinates.scalar_system(s)
    else:
        coordinates.scalar_system(s)
    table = list(decorations.EVERYWHERE) + (list(decorations.ON_BODIES) if s.space else [])
    if s.locked:
        for _ in range(s.random.choice((1, 1, 2))):
            s.weighted(decorations.HOLDING)(s)
    for _ in range(s.random.choice((0, 1, 2, 2, 3, 3, 4, 5, 6))):
        s.weighted(table)(s)
    decorations.outputs(s)
    unknowns(s, seed)
    cases(s, seed)
    tasks(s, seed)
    slider(s, seed)
    for further in (growing, deeds, letting_go, bends, turns, forms, grids, steps, lists, formulas, signals):
        further(s, seed)
    for further in (
        driven,
        drags,
        closing,
        together,
        parts,
        hanging,
        fields,
        stepped,
        measured,
        arithmetic,
        orientations,
        landing,
        everyday,
        timed,
        narrow,
        orbits,
        sizes,
        weights,
        leaning,
        linkages,
        followers,
        pins,
        within,
        sized,
        followed,
        connected,
        placed,
        groups,
    ):
        further(s, seed)
    return s


def finished(s: Scope, seed: int) -> Model:
    """Return the file."""
    imports = []
    if s.space:
        imports.append(statement("import", f"import mech.{'planar' if s.space == 2 else 'spatial'}.*;"))
        imports.append(statement("import", "import mech.fields.*;"))
    if "couplings" in s.notes:
        imports.append(statement("import", "import mech.couplings.*;"))
    beginning = _beginning(s, seed)
    if beginning or any("dissipation" in st.text() and "energy()" in st.text() for st in s.statements):
        s.statements[:] = [
            st for st in s.statements if not st.text().lstrip().startswith("exact ")
        ]  # of other motions
    s.add(
        "experiment",
        "experiment(stop = ",
        Slot("experiment.stop", quantity(s.pick(("0.5", "1", "1.5")), TIME, s.random)),
        *beginning,
        *_told(s, seed),
        ");",
        name="",
    )
    sized = "".join(
        st.data["in the experiment"] for st in s.statements if st.data and "in the experiment" in st.data
    )
    if sized:  # sizes of parts, which element by element are what their declarations say
        plain = s.statements[-1]
        s.statements[-1] = replace(plain, parts=(*plain.parts[:-1], sized, ");"), data={"plain": (plain,)})
    top = statement("model", "model M", Seq(tuple(s.statements)), "end M;", name="M")
    return Model((*imports, *s.file.items, top))


def _beginning(s: Scope, seed: int) -> tuple[str | Slot, ...]:
    """Let a few runs begin earlier, or tell of their motion from later on. The random numbers are its own: models keep all else."""
    with s.apart(f"beginning of {seed}"):
        if not s.chance(LATE):
            return ()
        return ", start = ", Slot(
            "experiment.start", s.literal(TIME, s.pick((F("-0.25"), F("0.125"), F("0.3"))))
        )


def _told(s: Scope, seed: int) -> tuple[str | Slot, ...]:
    """Let a run set an input, over what the model says of it. The random numbers are its own: models keep all else."""
    with s.apart(f"told to {seed}"):
        inputs = [
            st for st in s.statements if st.kind == "input" and "input.value" in {x.place for x in st.slots}
        ]
        if not inputs or not s.chance(TOLD):
            return ()
        one = s.pick(inputs)
        value = next(x.expression for x in one.slots if x.place == "input.value")
        if value.shape or value.type != "real":
            return ()
        return f", {one.name} = ", Slot("experiment.input", s.literal(value.dim, s.number(-1, 1) or F(1)))


def generate(seed: int) -> Model:
    """Return the random model of a seed."""
    if is_alone(seed):
        return finished(alone(seed), seed)
    return finished(quiet(seed) if is_quiet(seed) else skeleton(seed), seed)
