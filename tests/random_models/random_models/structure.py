"""The same model in more structured texts: heirs, components in arrays, blocks, functions, experiments.

The flat model that these are made from is the meaning that they must have. Every value that another text overrules is
another number, so that what wins is seen.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from random import Random

from random_models.operators import call, divide, multiply, relation
from random_models.quantities import quantity
from random_models.scope import TYPES
from random_models.tree import (
    LENGTH,
    NUMBER,
    E,
    Model,
    S,
    Seq,
    Slot,
    entire,
    map_expression,
    node,
    reference,
    statement,
    whole_of,
    without,
)
from random_models.twins import Twin


def mod(target: str, sign: str, place: str, e: E) -> S:
    """Return one modification."""
    return statement("mod", f"{target} {sign} ", Slot(place, e), name=target, data={"sign": sign})


def decoy(e: E, random: Random) -> E:
    """Return another value of the same dimension and shape, which must not count."""
    other = quantity(f"{random.uniform(2, 4):.2f}", e.dim, random)
    if not e.shape:
        return other
    return multiply(node("number", "7", value=lambda: 7), e)


def sign_of(s: S) -> str:
    """Return whether an initial value is known or guessed."""
    return "~" if (s.data or {}).get("guess") else "="


def with_value(s: S, e: E) -> S:
    """Exchange the only expression of a statement."""
    return replace(s, parts=tuple(Slot(p.place, e) if isinstance(p, Slot) else p for p in s.parts))


def model_statement(name: str, items: list[S], *, partial: bool = False) -> S:
    """Return a model of some statements."""
    return statement(
        "model", f"{'partial ' if partial else ''}model {name}", Seq(tuple(items)), f"end {name};", name=name
    )


def _overruled(s: S, random: Random) -> tuple[S, list[S]]:
    """Give a statement a value that does not count; returns it with the modifications that overrule it."""
    if (
        s.kind in ("parameter", "coordinate", "initial", "state")
        and len(s.slots) == 1
        and random.random() < 0.6
    ):
        e = s.slots[0].expression
        if e.type == "pose":
            return s, []
        place = {"parameter": "modification.parameter", "initial": "modification.initial"}.get(
            s.kind, "modification.initial"
        )
        sign = "=" if s.kind == "parameter" else sign_of(s)
        return with_value(s, decoy(e, random)), [mod(s.name, sign, place, e)]
    if s.kind == "component" and random.random() < 0.6:
        items = list(s.seq().items)
        chosen = [
            k
            for k, m in enumerate(items)
            if m.kind == "mod"
            and m.slots[0].place in ("modification.parameter", "modification.initial", "modification.rate")
        ]
        chosen = [k for k in chosen if items[k].slots[0].expression.type != "pose"]
        if chosen:
            k = random.choice(chosen)
            m = items[k]
            e = m.slots[0].expression
            items[k] = with_value(m, decoy(e, random))
            parts = tuple(Seq(tuple(items), "list") if isinstance(p, Seq) else p for p in s.parts)
            target = f"der({s.name}.{m.name[4:-1]})" if m.name.startswith("der(") else f"{s.name}.{m.name}"
            sign = (m.data or {}).get("sign", "=")
            return replace(s, parts=parts), [mod(target, sign, "modification.nested", e)]
    return s, []


def _in_turn(moved: list[S], rest: list[S]) -> list[S]:
    """Leave out each `when` before which another stays: bases come first, and what is due together acts in that order."""
    whens = [s for s in rest if s.kind == "when"]
    first = next(iter(without(whens, moved)), None)
    late = [] if first is None else whens[next(k for k, s in enumerate(whens) if s is first) :]
    return without(moved, late)


def inherited(model: Model, random: Random) -> Twin | None:
    """Move statements into models that the model extends, with values that it overrules."""
    rest = list(model.top.seq().items)
    bases: list[S] = []
    mods: list[S] = []
    below: list[S] = []
    for k in range(random.choice((1, 1, 2, 3))):
        own: list[S] = []
        if k:
            # what the heirs above will overrule may be given a second wrong value here
            wrong = [
                with_value(m, decoy(m.slots[0].expression, random)) for m in mods if random.random() < 0.5
            ]
            held = [m for m in mods if random.random() < 0.5]
            names = {m.name for m in held}
            given = held + [w for w in wrong if w.name not in names]
            mods = [m for m in mods if m.name not in names]
            own = [statement("extends", f"extends B{k - 1}", Seq(tuple(given), "list"), ";")]
        moved = entire([s for s in rest if random.random() < 0.45 and s.kind != "experiment"], rest)
        if any(s.kind == "extends" for s in rest):  # what is nearer would overrule it
            moved = [s for s in moved if s.kind != "gravity"]
        moved = _in_turn(moved, rest)
        rest = without(rest, moved)
        for s in moved:
            other, new = _overruled(s, random)
            if s.kind == "initial" and any(
                o is not s and o.kind == "initial" and whole_of(o) == whole_of(s) for o in moved
            ):  # what an heir says of the whole goes before what stands here of elements
                other, new = s, []
            for m in new:
                if (
                    m.name.startswith("der(")
                    or random.random() < 0.7
                    or m.slots[0].place != "modification.initial"
                ):
                    mods.append(m)
                else:
                    below.append(m)
            own.append(other)
        own += _experiment_of_a_base(own)
        bases.append(model_statement(f"B{k}", own, partial=random.random() < 0.7))
        late, below = below, []
        for m in late:  # `initial` of the heir overrules the base
            sign = (m.data or {}).get("sign", "=")
            rest.append(
                statement(
                    "initial",
                    f"initial {m.name} {sign} ",
                    Slot("initial.value", m.slots[0].expression),
                    ";",
                    name=m.name,
                    data={"guess": sign == "~"},
                )
            )
    place = random.randrange(len(rest) + 1)
    rest.insert(
        min([place, *(k for k, s in enumerate(rest) if s.kind == "when")]),
        statement("extends", f"extends B{len(bases) - 1}", Seq(tuple(mods), "list"), ";"),
    )
    items = (
        *model.items[:-1],
        *bases,
        replace(
            model.top, parts=tuple(Seq(tuple(rest)) if isinstance(p, Seq) else p for p in model.top.parts)
        ),
    )
    return Twin("inherited", Model(items))


def _experiment_of_a_base(own: list[S]) -> list[S]:
    """Let a base say how it is run, with other values; its heir says that anew. The random numbers are its own: twins keep all else."""
    numbers = [
        s for s in own if s.kind == "parameter" and len(s.slots) == 1 and not s.slots[0].expression.shape
    ]
    random = Random("".join(s.text() for s in numbers))
    if not numbers or random.random() < 0.5:
        return []
    parts: list[str | Slot] = []
    for s in random.sample(numbers, random.randint(1, len(numbers))):
        parts += [f", {s.name} = ", Slot("experiment.value", decoy(s.slots[0].expression, random))]
    return [statement("further", "experiment(stop = 0.7 s", *parts, ");")]


def blocks(model: Model, random: Random) -> Twin | None:
    """Put statements into for and if blocks that leave the sum of them as it was."""
    changed = False
    new: list[S] = []
    for s in model.top.seq().items:
        r = random.random()
        if s.kind in ("energy", "force", "damping") and not s.name and r < 0.3:
            place = s.slots[0].place
            i = f"k{len(new)}"
            index = reference(i, "index", NUMBER)
            e = s.slots[0].expression
            share = divide(multiply(index, e), node("number", "3", value=lambda: 3))
            first = True
            parts: list[str | Slot | Seq] = []
            for p in s.parts:
                if isinstance(p, Slot) and first:
                    parts.append(Slot(place, share))
                    first = False
                else:
                    parts.append(p)
            new.append(
                statement("for", f"for {i} in 1:2 loop", Seq((replace(s, parts=tuple(parts)),)), "end for;")
            )
            changed = True
        elif (
            s.kind
            in ("energy", "force", "damping", "torque", "friction", "constraint", "contact", "equation")
            and r < 0.5
        ):
            n = f"choice{len(new)}"
            number = random.randint(1, 4)
            new.append(statement("parameter", f"structural parameter Integer {n} = {number};", name=n))
            c = relation(
                random.choice(("==", "<=", ">=")),
                reference(n, "structural", NUMBER),
                node("number", str(number)),
            )
            other = (
                ()
                if not s.slots or s.kind == "equation" or s.name
                else (
                    replace(
                        s,
                        parts=tuple(
                            Slot(p.place, _tripled(p.expression))
                            if isinstance(p, Slot) and p is s.slots[0]
                            else p
                            for p in s.parts
                        ),
                    ),
                )
            )
            new.append(
                statement(
                    "if",
                    "if ",
                    Slot("if.condition", c),
                    " then",
                    Seq((s,)),
                    "else" if other else "",
                    *((Seq(other),) if other else ()),
                    "end if;",
                )
            )
            changed = True
        else:
            new.append(s)
    return Twin("blocks", model.with_top(tuple(new))) if changed else None


def _tripled(e: E) -> E:
    return multiply(node("number", "3"), e)


_OPAQUE = {"der", "der2", "index", "comprehension", "integral.over", "integral.time", "pre", "table"}


def as_functions(model: Model, random: Random) -> Twin | None:
    """Write parts of expressions as functions of the file."""
    functions: list[S] = []

    def change(e: E, place: str) -> E:
        if random.random() < 0.7 or place.startswith(("function", "modification.frame", "component")):
            return e
        candidates = [
            x
            for x in e.walk()
            if x.operands and not x.shape and x.type == "real" and x.kind not in _OPAQUE and len(str(x)) > 12
        ]
        if not candidates:
            return e
        chosen = random.choice(candidates)
        arguments: list[E] = []

        def formal(x: E) -> E:
            if (
                x.kind
                in ("ref:bound", "ref:index", "ref:load", "ref:joint", "ref:constraint", "ref:function")
                or x.type != "real"
                or x.shape
                or any("[i" in y.ref for y in x.walk())  # an element by the index of a sum
            ):
                raise LookupError
            if x.ref in ("world",):
                raise LookupError
            name = f"a{len(arguments)}"
            arguments.append(x)
            return reference(name, "formal", x.dim)

        def inside(x: E) -> E:
            if x.ref or x.kind in ("der", "index", "der2") or x.kind in _ASKED:
                return formal(x)
            if x.kind in _OPAQUE or x.type == "frame":
                raise LookupError
            return x.with_operands(tuple(inside(o) for o in x.operands)) if x.operands else x

        try:
            body = inside(chosen)
        except LookupError:
            return e
        if not arguments or body.ref:
            return e
        name = f"g{len(functions) + 1}"
        formals = []
        for k, a in enumerate(arguments):
            kind = TYPES.get(a.dim)
            formals.append(f"{random.choice(kind)} a{k}" if kind and random.random() < 0.6 else f"a{k}")
        functions.append(
            statement(
                "function",
                f"function {name}({', '.join(formals)}) = ",
                Slot("function.body", body),
                ";",
                name=name,
            )
        )
        asked = E("function", call(name, *arguments).parts, chosen.dim, (), chosen.level)
        done = False

        def exchange(x: E) -> E:
            nonlocal done
            if x is chosen and not done:
                done = True
                return asked
            return x.with_operands(tuple(exchange(o) for o in x.operands)) if x.operands else x

        return exchange(e)

    top = model.top.rebuilt(change)
    if not functions:
        return None
    return Twin("as functions", Model((*model.items[:-1], *functions, top)))


_ASKED = {
    "energy",
    "kinetic_energy",
    "potential_energy",
    "momentum",
    "power",
    "multiplier",
    "reaction",
    "moment",
    "mass_centre",
    "inertia_tensor",
}


def by_experiment(model: Model, random: Random) -> Twin | None:
    """Let the experiment give values."""
    new: list[S] = []
    given: list[S] = []
    for s in model.top.seq().items:
        if (
            s.kind in ("parameter", "coordinate", "state")
            and len(s.slots) == 1
            and random.random() < 0.4
            and not s.slots[0].expression.shape
        ):
            e = s.slots[0].expression
            if e.level <= frozenset("p") and not any(x.kind == "function" for x in e.walk()):
                sign = "=" if s.kind == "parameter" else sign_of(s)
                given.append(mod(s.name, sign, "experiment.value", e))
                wrong = decoy(e, random)
                if (
                    s.kind == "parameter" and e.dim == LENGTH
                ):  # bodies exist by default values: no hole outside
                    wrong = multiply(node("number", "0.9", value=lambda: Fraction("0.9")), e)
                s = with_value(s, wrong)
        new.append(s)
    if not given:
        return None
    place = next(k for k, s in enumerate(new) if s.kind == "experiment")
    parts = list(new[place].parts[:-1])
    for m in given:
        parts += [f", {m.name} {(m.data or {})['sign']} ", m.slots[0]]
    new[place] = statement("experiment", *parts, ");")
    return Twin("by experiment", model.with_top(tuple(new)))


def with_lets(model: Model, random: Random) -> Twin | None:
    """Give parts of expressions a name."""
    lets: list[S] = []

    def change(e: E, place: str) -> E:
        if place.startswith(
            (
                "function",
                "parameter",
                "component",
                "experiment",
                "when",
                "sample",
                "initial",
                "coordinate",
                "state",
                "modification",
                "drive.target",
            )
        ):
            return e

        def one(x: E) -> E:
            if (
                random.random() < 0.9
                or x.ref
                or not x.operands
                or x.type != "real"
                or any(y.kind in ("ref:bound", "ref:index") or "[i" in y.ref for y in x.walk())
            ):
                return x
            name = f"l{len(lets) + 1}"
            lets.append(statement("let", f"let {name} = ", Slot("let.value", x), ";", name=name))
            return reference(name, "let", x.dim, x.shape, "".join(x.level))

        return map_expression(e, one)

    top = [s if s.kind in ("when", "for", "let") else s.rebuilt(change) for s in model.top.seq().items]
    return Twin("with lets", model.with_top((*lets, *top))) if lets else None


STRUCTURES = (inherited, blocks, as_functions, by_experiment, with_lets)
