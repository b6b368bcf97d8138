"""Heaps of balls that fall into a box and bounce to rest, beside MuJoCo (extra ``peers``; left out where it is not installed)."""

from __future__ import annotations

import importlib.util
import math
import time

import mechc

from .machine import table, write

R, MASS, G, STOP, COLUMNS = 0.02, 0.1, 9.81, 2.0, 10
MODEL = f"""
structural parameter Integer n = 100;
structural parameter Integer columns = {COLUMNS};
parameter r = {R} m;
parameter a = 1 m;
parameter e = 0.5;
coordinate Length x[n] = {{a*(0.5 + mod(i - 1, columns))/columns + 3 mm*sin(7*i) for i in 1:n}};
coordinate Length y[n] = {{a*(0.5 + floor((i - 1)/columns))/columns + 3 mm*sin(5*i) for i in 1:n}};
for i in 1:n loop
  kinetic 1/2*{MASS} kg*(der(x[i])^2 + der(y[i])^2);
  potential {MASS} kg*{G} m/s^2*y[i];
  contact left[i]: x[i] - r restitution e, rest = 1 cm/s;
  contact right[i]: a - r - x[i] restitution e, rest = 1 cm/s;
  contact low[i]: y[i] - r restitution e, rest = 1 cm/s;
  for j in i+1:n loop
    contact hit[i,j]: norm({{x[i] - x[j], y[i] - y[j]}}) - 2*r restitution e, rest = 1 cm/s;
  end for;
end for;
experiment(stop = {STOP} s);
"""
BIN = """import mech.spatial.*;
import mech.shapes.*;
model Bin
  structural parameter Integer n = {n};
  parameter w = {w} m "width of the bin";
  parameter d = 5 cm "of the lattice that they fall from";
  gravity {{0, 0, -9.81}} m/s^2;
  Sphere ball[n](r = 2 cm, m = 0.1 kg);
  Free free[i in 1:n](world -> ball[i].a, position = {{d*(0.5 + mod(i - 1, {side})) + 3 mm*sin(7*i),
    d*(0.5 + mod(floor((i - 1)/{side}), {side})) + 3 mm*sin(5*i), d*(0.5 + floor((i - 1)/{square})) + 3 mm*sin(3*i)}});
  shape Sphere(r = 2 cm) on ball;
  shape floor: Plane on world;
  frame side[k in 1:4] = world * trans({{w/2, w/2, 0 m}}) * rotz(90 deg*k) * trans({{-w/2, 0 m, 0 m}}) * roty(90 deg);
  shape Plane on side;
  contact ball[*] with ball[*], floor, side friction 0.3 restitution 0.5;
  experiment(stop = 1.5 s, method = "moreau", step = 2 ms, tolerance = 2.5e-5);
end Bin;
"""
BALL = """<body pos="{x} 0 {y}"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
<geom type="sphere" size="{r}" mass="{m}" friction="0 0 0" condim="1" solref="{solref}"/></body>"""
WALL = '<geom type="plane" size="5 5 1" pos="{place}" zaxis="{normal}" condim="1" solref="{solref}"/>'
WORLD = '<mujoco><option timestep="{step}"/><size memory="200M"/><worldbody>{bodies}</worldbody></mujoco>'
STEPS = (2e-3, 5e-4, 1e-4)


def ours(n: int, columns: int, width: float, e: float, tolerance: float) -> list[str]:
    """Give a row of the table: processor seconds of compiling and of the run, instants, what the energy account lacks, heights."""
    text = MODEL.replace("n = 100", f"n = {n}").replace(f"columns = {COLUMNS}", f"columns = {columns}")
    text = text.replace("a = 1 m", f"a = {width} m").replace("e = 0.5", f"e = {e}")
    before = time.process_time()
    model = mechc.loads(text)
    model.simulate(estimate_error=False, stop=1e-3)
    compiling = time.process_time() - before
    before = time.process_time()
    run = model.simulate(estimate_error=False, tolerance=tolerance)
    taken = time.process_time() - before
    end = run.energy
    assert end is not None and end.dissipated is not None and end.supplied is not None, run.message
    lacks = abs(end.start + end.supplied - end.dissipated - end.end) / end.start
    instants = len({event.time for event in run.events if event.kind == "impact"})
    height = sum(float(run[f"y[{i}]"][-1]) for i in range(1, n + 1)) / n
    outcome = "" if run.outcome.name == "COMPLETED" else f": {run.message}"
    return [
        f"{n}",
        f"{e:g}",
        f"{tolerance:g}{outcome}",
        f"{instants}",
        f"{lacks:.0e}",
        f"{end.supplied / end.start:.0e}",
        f"{height:.5f} m",
        f"{compiling:.2f} + {taken:.2f} s",
    ]


def in_space(n: int, side: int) -> list[str]:
    """Give a row of balls that turn, with friction 0.3 and restitution 0.5, in a bin, by steps that solve for all contacts."""
    before = time.process_time()
    model = mechc.loads(BIN.format(n=n, side=side, square=side * side, w=side * 0.05))
    model.simulate(estimate_error=False, stop=0.002)
    compiling = time.process_time() - before
    before = time.process_time()
    run = model.simulate(estimate_error=False)
    taken = time.process_time() - before
    end, steps = run.energy, run.statistics.contact
    assert end is not None and end.dissipated is not None and end.supplied is not None and steps is not None
    lacks = abs(end.start + end.supplied - end.dissipated - end.end) / end.start
    return [
        f"{n}",
        f"{run.statistics.steps}, {steps.unsolved} not solved",
        f"{run.statistics.iterations / run.statistics.steps:.0f}",
        f"{steps.residual:.1e} m/s",
        f"{1000 * steps.overlap:.1f} mm",
        f"{lacks:.0e}",
        f"{compiling:.1f} + {taken:.1f} s",
    ]


def by_mujoco(n: int, columns: int, width: float, step: float, solref: str) -> tuple[float, float, float]:
    """Give the mean height at the end, the deepest overlap of two balls on the way, and processor seconds."""
    import mujoco

    walls = ((0, 0, 1), "0 0 0"), ((1, 0, 0), "0 0 0"), ((-1, 0, 0), f"{width} 0 0")
    bodies = "".join(
        WALL.format(normal="{} {} {}".format(*z), place=place, solref=solref) for z, place in walls
    )
    for i in range(1, n + 1):
        x = width * (0.5 + (i - 1) % columns) / columns + 0.003 * math.sin(7 * i)
        y = width * (0.5 + (i - 1) // columns) / columns + 0.003 * math.sin(5 * i)
        bodies += BALL.format(x=x, y=y, r=R, m=MASS, solref=solref)
    model = mujoco.MjModel.from_xml_string(WORLD.format(step=step, bodies=bodies))
    data, deepest = mujoco.MjData(model), 0.0
    begun = time.process_time()
    while data.time < STOP:
        mujoco.mj_step(model, data)
        if data.ncon:
            deepest = min(deepest, float(data.contact.dist.min()))
    taken = time.process_time() - begun
    return float(data.xpos[1:, 2].mean()), -deepest, taken


def main(quick: bool = False) -> None:
    rows, soft = [], []
    for n, columns, width in ((20, 5, 0.3), (100, 10, 1.0)):
        for e in (0.0, 0.5, 0.9):
            if not (quick and n > 20):
                rows.append(ours(n, columns, width, e, 1e-6))
        if n == 20:
            rows.append(ours(n, columns, width, 0.5, 1e-10))
        if importlib.util.find_spec("mujoco") is None:
            continue
        for step in STEPS[: 2 if quick else None]:
            for contacts, solref in (("default", "0.02 1"), ("stiffened", f"{2 * step} 1")):
                height, overlap, taken = by_mujoco(n, columns, width, step, solref)
                name = f"{contacts}, {step:g} s"
                soft.append(
                    [f"{n}", name, f"{100 * overlap / R:.1g} % of r", f"{height:.5f} m", f"{taken:.2f} s"]
                )
    write(
        "heap",
        "Heaps of balls",
        [
            "Balls fall from a lattice into a box in a plane and bounce to rest, without friction; their contacts rest below 1 cm/s. Of "
            "mechc for each tolerance: instants with impacts in 2 s, the share of the energy that its account lacks, and that the "
            "closing of gaps has supplied, the mean height of the balls at the end, and processor time to compile (goal: 10 s) and "
            "to run (20 s), without a companion run. MuJoCo has no coefficient of restitution: its "
            "compliant contacts with `solref` at its default, and at two steps, are damped critically; of two balls that meet the "
            "deepest overlap is told. Where balls lie in the end is "
            "chaotic: heights tell how densely, not which arrangement is right.",
            table(
                ["n", "restitution", "mechc", "instants", "energy lacks", "supplied", "mean height", "time"],
                rows,
            ),
            'Balls that turn, with friction 0.3 and restitution 0.5, fall into a bin in space (`method = "moreau"`, steps of 2 ms, 1.5 s). '
            "What is left of the problems of contact, as a rate (goal: 1e-4 m/s), and the deepest overlap:",
            table(
                ["n", "steps", "sweeps a step", "residual", "overlap", "energy lacks", "time"],
                [in_space(n, side) for n, side in ((100, 5), (1000, 8))[: 1 if quick else None]],
            ),
            *([table(["n", "MuJoCo", "overlap", "mean height", "time"], soft)] if soft else []),
        ],
    )


if __name__ == "__main__":
    main()
