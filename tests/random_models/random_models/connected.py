"""What goes into parts and out of them: rates that forces act on, lists of signals, fields that are functions of the place, starts in
loops of bases, values that an event sets, and questions about what stands in a part.

Each statement holds what it means in plain words, which a twin says in its place.
"""

from __future__ import annotations

from random_models.lists import Chain
from random_models.scope import Scope
from random_models.tree import statement

SHARE = 0.05
"""Of the models."""
AXES = "xyz"


def connected(s: Scope, seed: int) -> None:
    """Write some of it. The random numbers are its own: models keep all else, and those that are known to catch a mutant have none."""
    with s.apart(f"connected 4335 of {seed}"):
        if s.chance(SHARE):
            _Connected(s).write()


class _Connected(Chain):
    """Writes parts that feel nothing of the rest."""

    def write(self) -> None:
        s = self.s
        every = [self._pushed, self._lists, self._starts, self._asked, self._set, self._told]
        if s.space:
            every.append(self._field)
        for part in s.random.sample(every, s.pick((1, 2, 2, 3))):
            part()

    def define(self, name: str, body: str) -> None:
        """Write a model beside that which runs."""
        self.s.file.items.append(statement("class", f"model {name} {body} end {name};", name=name))

    def _spring(self, q: str, start: str) -> str:
        """Return the text of a mass on a spring."""
        m, k = self.numbers(2)
        return f"coordinate Length {q} = {start}; kinetic 1/2*{m:g} kg*der({q})^2; potential 1/2*{k:g} N/m*{q}^2;"

    def _pushed(self) -> None:
        """A part, or one in it, that acts on what its inputs are connected to: rates, places, and names of these."""
        s, part, whole, a = self.s, self.s.fresh("Acts"), self.s.fresh("Holds"), self.s.fresh("a")
        x, y, u = s.fresh("q"), s.fresh("q"), s.fresh("l")
        c, f, k, g, mu = self.numbers(5)
        self.same(
            *(
                f"{one};"
                for q, v in ((x, 0.3), (y, -0.2))
                for one in self._spring(q, f"{v} m").split(";")[:-1]
            )
        )
        rate = s.pick((f"der({x})", f"der({x}) - der({y})", f"2*der({x}) + der({y})"))
        place = s.pick((x, f"{x} - {y}", f"{x} + 2*{y}"))
        said = {
            "damping": (f"damping brake: {c:g} N.s/m on v;", f"damping {c:g} N.s/m on {rate};"),
            "force": (f"force push: {f:g} N*cos(p/(1 m)) on v;", f"force {f:g} N*cos(({place})/(1 m)) on {rate};"),
            "spring": (f"force pull: -{k:g} N/m*p on p;", f"force -{k:g} N/m*({place}) on {place};"),
            "drag": (f"damping {g:g} N.s/m on p;", f"damping {g:g} N.s/m on {place};"),
            "friction": (f"friction rub: {mu:g} N on v;", f"friction {mu:g} N on {rate};"),
        }  # fmt: skip
        chosen = s.random.sample(tuple(said), s.pick((1, 2, 3)))
        names = {label: s.fresh("F") for label in ("brake", "push", "pull", "rub")}
        body = " ".join(said[kind][0] for kind in chosen)
        named, lines = [], []
        for inside, line in (said[kind] for kind in chosen):
            kind, _, label = inside.partition(":")[0].partition(" ")
            if ":" in inside:
                named.append(label)
                line = line.replace(f"{kind} ", f"{kind} {names[label]}: ", 1)
            lines.append(line)
        self.define(part, f"input Velocity v; input Length p; {body}")
        path = a
        if s.chance(0.5):
            self.define(
                whole,
                f"input Velocity speed; input Length way; let half = speed/2; {part} inside(v = 2*half, p = way);",
            )
            text, path = f"{whole} {a}(speed = {rate}, way = {place});", f"{a}.inside"
        elif s.chance(0.5):
            self.same(f"let {u} = {rate};")
            text = f"{part} {a}(v = {u}, p = {place});"
        else:
            text = f"{part} {a}(v = {rate}, p = {place});"
        self.say(text, *lines)
        for label in named:
            self.output(f"power({path}.{label})", f"power({names[label]})")

    def _lists(self) -> None:
        """Parts in arrays, whose inputs take their type and their element from a list."""
        s, part, row, a = self.s, self.s.fresh("Fed"), self.s.fresh("Row"), self.s.fresh("a")
        n, w = s.pick((2, 3)), self.numbers(1)[0]
        kind = s.pick(("input u = 0;", "input u;", "input Force u;", "input Force u = 0 N;"))
        body = "parameter Mass m = 1 kg; " + self._spring("q", "0.2 m").replace(
            "kinetic", "kinetic 1/2*m*der(q)^2; kinetic", 1
        )
        self.define(part, f"{kind} {body} force u on q;")
        self.define(f"{part}Plain", body)
        f, m = [self.numbers(n, -1, 1) for _ in range(2)], self.numbers(n)
        wave = f"cos({w:g} rad/s*time)"
        masses = "{" + ", ".join(f"{v:g}" for v in m) + "} kg"
        if s.chance(0.5):
            given = f"{{{', '.join(f'{v:g} N*{wave}' for v in f[0])}}}"
            self.say(
                f"{part} {a}[{n}](m = {masses}, u = {given});",
                f"{part}Plain {a}[{n}](m = {masses});",
                *(f"force {f[0][i]:g} N*{wave} on {a}[{i + 1}].q;" for i in range(n)),
            )
            return
        inner = f"{part} c[{n}](m = {masses});"
        self.define(row, inner)
        self.define(f"{row}Plain", inner.replace(part, f"{part}Plain"))
        each = s.chance(0.5)
        rows = [f[0], f[0]] if each else f
        given = ", ".join(
            "{" + ", ".join(f"{v:g} N*{wave}" for v in values) + "}" for values in rows[: 1 if each else 2]
        )
        self.say(
            f"{row} {a}[2](c.u = {given if each else f'{{{given}}}'});",
            f"{row}Plain {a}[2];",
            *(f"force {rows[j][i]:g} N*{wave} on {a}[{j + 1}].c[{i + 1}].q;" for j in range(2) for i in range(n)),
        )  # fmt: skip

    def _starts(self) -> None:
        """Starts that a base states in a loop, over which its heir goes, in a loop, of the whole or of an element."""
        s, base, heir, a = self.s, self.s.fresh("Base"), self.s.fresh("Heir"), self.s.fresh("a")
        n, (m, k) = s.pick((2, 3)), self.numbers(2)
        body = f"coordinate Length q[{n}]; kinetic 1/2*{m:g} kg*dot(der(q), der(q)); potential 1/2*{k:g} N/m*dot(q, q);"
        first, last, rates = (self.numbers(n, -0.8, 0.8) for _ in range(3))
        one = s.random.randrange(n)
        loop = f"for i in 1:{n} loop initial q[i] = {first[0]:g} m*i; initial der(q[i]) = {rates[0]:g} m/s*i; end for;"
        q = [first[0] * (i + 1) for i in range(n)]
        v = [rates[0] * (i + 1) for i in range(n)]
        how = s.pick(("loop", "whole", "element", "extends", "rates"))
        mods, own = "", ""
        if how == "loop":
            own = f"for i in 1:{n} loop initial q[i] = {last[0]:g} m*(i + 1); end for;"
            q = [last[0] * (i + 2) for i in range(n)]
        elif how == "element":
            own, q[one] = f"initial q[{one + 1}] = {last[one]:g} m;", last[one]
        elif how == "rates":
            own, v = f"for i in 1:{n} loop initial der(q[i]) = {last[0]:g} m/s/i; end for;", [last[0] / (i + 1) for i in range(n)]  # fmt: skip
        else:
            row = "{" + ", ".join(f"{x:g}" for x in last) + "} m"
            q = last
            own, mods = (f"initial q = {row};", "") if how == "whole" else ("", f"(q = {row})")
            with s.apart(f"both of {a} with {q}"):
                if how == "extends" and s.chance(0.5):  # which goes before what stands beside it
                    own = f"initial q = {self.numbers(1)[0]:g} m;"
        self.define(base, f"{body} {loop}")
        middle = base
        if s.chance(0.4):
            middle = s.fresh("Middle")
            self.define(middle, f"extends {base};")
        self.define(heir, f"extends {middle}{mods}; {own}")
        self.define(f"{heir}Plain", body)
        starts = (f"{{{', '.join(f'{x:.17g}' for x in row)}}} {unit}" for row, unit in ((q, "m"), (v, "m/s")))
        self.say(f"{heir} {a};", f"{heir}Plain {a};", *(f"initial {x} = {y};" for x, y in zip((f"{a}.q", f"der({a}.q)"), starts, strict=True)))  # fmt: skip

    def _asked(self) -> None:
        """Contacts, frictions and constraints in a part, whose names stand for other things around it, and which are asked about there."""
        s, part, whole, a = self.s, self.s.fresh("Slides"), self.s.fresh("Holds"), self.s.fresh("a")
        m, g, mu, e, start, k = self.numbers(6, 0.2, 0.9)
        tilt = s.pick(("x", "x - 0.4*y", "x + y"))
        self.define(
            part,
            f"coordinate Length x = {start:g} m; coordinate Length y ~ {start:g} m; coordinate Length w ~ 0 m; "
            f"kinetic 1/2*{m:g} kg*(der(x)^2 + der(y)^2 + der(w)^2); potential {g:g} N*y + 1/2*{k:g} N/m*x^2; "
            f"contact touch: y restitution {e:g} friction {mu:g} along der({tilt}); constraint hold: w = 0.3*x; "
            "output of_rub = power(touch.friction); output along = multiplier(touch.friction); "
            "output down = multiplier(touch); output held = multiplier(hold);",
        )
        self.define(whole, f"parameter Length x = 1 m; {part} inside;")
        path = a
        if s.chance(0.5):
            self.same(f"{whole} {a};")
            path = f"{a}.inside"
        else:
            self.same(f"{part} {a};")
        asked = (
            ("power({}.touch.friction)", "of_rub"), ("multiplier({}.touch.friction)", "along"), ("multiplier({}.touch)", "down"),
            ("multiplier({}.hold)", "held"),
        )  # fmt: skip
        for question, answer in s.random.sample(asked, 3):
            self.output(question.format(path), f"{path}.{answer}")

    def _set(self) -> None:
        """Events in parts and around them, which read and set what is in parts, of an array, too."""
        s, part, a, r = self.s, self.s.fresh("Counts"), self.s.fresh("a"), self.s.fresh("n")
        n, (m, k, jump, far) = s.pick((2, 3)), self.numbers(4, 0.3, 0.9)
        body = f"parameter Real f = 1; coordinate Length q = 0.2 m; kinetic 1/2*{m:g} kg*der(q)^2; potential 1/2*{k:g} N/m*q^2;"
        self.define(
            part,
            f"{body} discrete Real n = 0; output twice = 2*n; when initial() then n := f; reinit(der(q), {jump:g} m/s*f); end when; "
            f"when q > {far:g} m then n := pre(n) + 1; end when; force {jump:g} N*n on q;",
        )
        given = self.numbers(n)
        one = s.random.randint(1, n)
        factors = "{" + ", ".join(f"{x:g}" for x in given) + "}"
        self.define(
            f"{part}Plain", f"{body} discrete Real n = 0; output twice = 2*n; force {jump:g} N*n on q;"
        )
        self.say(
            f"{part} {a}[{n}](f = {factors});",
            f"{part}Plain {a}[{n}](f = {factors});",
            *(
                f"when initial() then {a}[{i}].n := {x:g}; reinit(der({a}[{i}].q), {jump * x:.17g} m/s); end when;"
                for i, x in enumerate(given, 1)
            ),
            *(f"when {a}[{i}].q > {far:g} m then {a}[{i}].n := pre({a}[{i}].n) + 1; end when;" for i in range(1, n + 1)),
        )  # fmt: skip
        self.same(
            f"discrete Real {r} = 1;",
            f"when {a}[{one}].q < -{far:g} m then {r} := pre({r}) + {a}[{one}].twice; end when;",
        )

    def _told(self) -> None:
        """A part with arrays, elements of which an experiment sweeps, and which a run may be given, whole and one by one."""
        s, part, a = self.s, self.s.fresh("Long"), self.s.fresh("a")
        n, (m, k) = s.pick((2, 3)), self.numbers(2)
        row = "{" + ", ".join(f"{v:g}" for v in self.numbers(n)) + "} m"
        self.define(
            part,
            f"parameter Length p[{n}] = {row}; coordinate Length q[{n}] = {row}; output far = q - p; "
            f"kinetic 1/2*{m:g} kg*dot(der(q), der(q)); potential 1/2*{k:g} N/m*dot(q - p, q - p);",
        )
        text = f"{part} {a}(p = {{}} m);"
        self.same(text.format("{" + ", ".join(f"{v:g}" for v in self.numbers(n)) + "}"))
        s.statements[-1].data["whole"] = (f"{a}.p", n, text)  # type: ignore[index]
        for one in s.random.sample((f"{a}.p[{{}}]", f"{a}.q[{{}}]", f"der({a}.q[{{}}])"), s.pick((1, 2))):
            name, values = one.format(s.random.randint(1, n)), self.numbers(3)
            unit = "m/s" if name.startswith("der") else "m"
            self.same(
                f"experiment {s.fresh('E')}({name} in {{{', '.join(f'{v:g}' for v in values)}}} {unit}, stop = 1 s);"
            )
            s.statements[-1].data["sweep"] = (name, tuple(values))  # type: ignore[index]

    def _field(self) -> None:
        """Fields that are functions of the place, of a part and of what is around it: the nearest holds."""
        s, n = self.s, self.s.space
        cabin, train, a, p = s.fresh("Cabin"), s.fresh("Train"), s.fresh("c"), s.fresh("f")
        inner, outer = (self._place_function(n) if s.chance(0.7) else None for _ in range(2))
        if inner is None and outer is None:
            inner = self._place_function(n)
        m, *start = self.numbers(1 + n, 0.3, 1)
        axes = AXES[:n]
        place = ", ".join(axes)
        own = " ".join(f"coordinate Length {q} = {v:g} m;" for q, v in zip(axes, start, strict=True))
        body = f"{own} frame f = world * trans({{{place}}}); mass {m:g} kg at f;"
        fields = [f"gravity {one[0]};" if one else "" for one in (inner, outer)]
        self.define(cabin, f"{fields[0]} {body}")
        self.define(train, f"{fields[1]} {cabin} c;")
        none = f"gravity {{{', '.join(['0'] * n)}}} m/s^2;"
        self.define(f"{train}Plain", f"{none} {cabin}Plain c;")
        self.define(f"{cabin}Plain", body)
        used = inner or outer
        assert used is not None
        force = ", ".join(f"{m:g} kg*({one.format(*(f'{a}.c.{q}' for q in axes))})" for one in used[1])
        law = f"potential {force};" if len(used[1]) == 1 else f"force {{{force}}} on {p};"
        self.same(f"frame {p} = {a}.c.f;")
        self.say(f"{train} {a};", f"{train}Plain {a};", law)

    def _place_function(self, n: int) -> tuple[str, list[str]]:
        """Write a field: a potential or an acceleration. Return what it is called, and its formulas of the components of the place."""
        s, name = self.s, self.s.fresh("field")
        g, h = self.numbers(2)
        if s.chance(0.5):
            square = " + ".join(f"({{{i}}})^2" for i in range(n))
            inside, said = (
                f"{g:g} m/s^2*r[{n}] + {h:g} s^-2*dot(r, r)",
                [f"{g:g} m/s^2*({{{n - 1}}}) + {h:g} s^-2*({square})"],
            )
        else:
            inside = f"-{h:g} s^-2*r + {{{', '.join([f'{g:g}'] * n)}}} m/s^2"
            said = [f"-{h:g} s^-2*({{{i}}}) + {g:g} m/s^2" for i in range(n)]
        text = f"function {name}(Length r[{n}]) = {inside};"
        s.file.items.append(statement("class", text, name=name))
        return name, said
