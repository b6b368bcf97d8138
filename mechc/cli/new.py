"""``mechc new``: write a first model."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import click

from .options import Command

TEMPLATE = """\
// A pendulum: a bob on a rod without mass, released at 60 deg.
//
//   mechc run {file} --plot                run it, draw the motion
//   mechc run {file} --set l="80 cm"       the same with another length
//   mechc equations {file}                 the equations of motion
//
// Only the energies are written; the equations of motion follow from them. The same pendulum made of
// parts begins with `import mech.planar.*;`.

model {name} "pendulum with a little friction in the hinge"
  parameter m = 1 kg "mass of the bob";
  parameter l = 1 m "length of the rod";
  parameter g = 9.81 m/s^2 "gravity";
  parameter c = 0.05 N.m.s "friction in the hinge; 0 keeps the energy constant";

  coordinate theta = 60 deg "angle from the vertical, released at rest";

  kinetic 1/2*m*l^2*der(theta)^2;
  potential -m*g*l*cos(theta);
  damping c on theta;

  output bob = {{l*sin(theta), -l*cos(theta)}} "position of the bob";

  experiment(stop = 10 s);
  experiment undamped(c = 0, stop = 10 s, tolerance = 1e-10);
end {name};
"""


DOUBLE = """\
// Two bars on hinges, released at an angle.
//
//   mechc run {file} --plot                run it, draw the motion
//   mechc run {file} --set c=0             the same without friction
//   mechc equations {file}                 the equations of motion
//
// It is made of parts of the library: a joint places the body after it. The language page says how energies are
// written instead, and how both mix.
import mech.planar.*;

model {name} "two uniform bars on hinges with a little friction"
  parameter c = 0.02 N.m.s "friction in both hinges; 0 keeps the energy constant";

  gravity {{0, -9.81}} m/s^2;
  Bar upper(m = 1 kg, l = 1 m);
  Bar lower(m = 0.5 kg, l = 80 cm);
  Revolute shoulder(world -> upper.a, angle = 30 deg);
  Revolute elbow(upper.b -> lower.a, angle = -60 deg);
  damping c on shoulder.angle;
  damping c on elbow.angle;

  output tip = pos(lower.b) "end of the lower bar";

  experiment(stop = 10 s);
  experiment undamped(c = 0, stop = 10 s, tolerance = 1e-10);
end {name};
"""


def template_for(stem: str) -> tuple[str, str]:
    """Return the model that a name asks for, and what it is."""
    words = re.sub(r"[^a-z]", "", stem.casefold())
    return (DOUBLE, "a double pendulum") if "doublependulum" in words else (TEMPLATE, "a pendulum")


def model_name(stem: str) -> str:
    """Make the name of a model from that of a file: ``my-pendulum`` gives ``MyPendulum``."""
    return "".join(word[:1].upper() + word[1:] for word in re.split(r"[^A-Za-z0-9]+", stem) if word)


@click.command(cls=Command, name="new", short_help="Write a first model to start from.")
@click.argument("name")
def command(name: str) -> None:
    """Write NAME.mech, a model that runs, to start from: a double pendulum if that is its name, else a pendulum.
    An existing file is never overwritten."""
    path = Path(name if name.endswith(".mech") else f"{name}.mech")
    title = model_name(path.stem)
    template, what = template_for(path.stem)
    if not re.fullmatch(r"[A-Za-z]\w*", title, re.ASCII):
        raise click.UsageError(
            f"'{path.stem}' gives no name for a model: begin it with a letter, as in 'pendulum'"
        )
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(template.format(file=shlex.quote(str(path)), name=title))
    except FileExistsError:
        raise click.UsageError(f"{path} exists and is left as it is; choose another name") from None
    except FileNotFoundError:
        raise click.UsageError(f"there is no folder {path.parent}") from None
    click.echo(f"wrote {path}, {what}; run it with: mechc run {shlex.quote(str(path))} --plot", err=True)
