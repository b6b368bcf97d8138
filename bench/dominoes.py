"""Rows of dominoes that turn about their feet, beside MuJoCo (extra ``peers``; left out where it is not installed)."""

from __future__ import annotations

import importlib.util
import math
import time

import mechc

from .machine import table, write

H, W, D, M, MU, PUSH = 0.048, 0.0075, 0.024, 0.01, 0.2, 4.0
MODEL = f"""
structural parameter Integer n = 20;
parameter H = {H} m;
parameter w = {W} m;
parameter d = {D} m;
coordinate Angle lean[n] = 0 rad;
initial der(lean[1]) = {PUSH} rad/s;
for i in 1:n loop
  kinetic 1/2*{M} kg*(H^2 + w^2)/3*der(lean[i])^2;
  potential {M} kg*9.81 m/s^2*(H*cos(lean[i]) + w*sin(lean[i]))/2;
  contact stands[i]: lean[i];
  contact lies[i]: 90 deg - lean[i];
end for;
for i in 1:n-1 loop
  contact hits[i]: d*cos(lean[i+1]) - w - H*sin(lean[i] - lean[i+1])
    friction {MU} along der(H*cos(lean[i] - lean[i+1]) - d*sin(lean[i+1]));
end for;
when lean[n] > 89 deg then terminate("the last has fallen"); end when;
experiment(stop = 5 s);
"""
BODY = """<body pos="{x} 0 0"><joint type="hinge" axis="0 1 0" range="0 90" limited="true" solreflimit="{solref}"/>
<geom type="box" size="{w} 0.012 {h}" pos="-{w} 0 {h}" mass="{m}" friction="{mu} 0 0" solref="{solref}"/></body>"""
WORLD = '<mujoco><option timestep="{step}" cone="elliptic"/><worldbody>{bodies}</worldbody></mujoco>'
STEPS = (2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5)


def ours(n: int, tolerances: tuple[float, ...]) -> list[tuple[float, float, float, float]]:
    """Give fall time, what the energy account lacks, processor seconds of compiling and of the run for each tolerance."""
    before = time.process_time()
    model = mechc.loads(MODEL.replace("n = 20", f"n = {n}"))
    model.simulate(estimate_error=False, stop=1e-3)
    compiling = time.process_time() - before
    found = []
    for tolerance in tolerances:
        before = time.process_time()
        run = model.simulate(estimate_error=False, tolerance=tolerance)
        taken = time.process_time() - before
        end = run.energy
        assert end is not None and end.dissipated is not None, run.message
        lacks = abs(end.start - end.dissipated - end.end) / end.start
        found.append((float(run.time[-1]), lacks, compiling, taken))
    return found


def by_mujoco(n: int, step: float, solref: str) -> tuple[float, float]:
    """Give the fall time, not a number where the last does not fall in 5 s, and processor seconds."""
    import mujoco

    bodies = "".join(BODY.format(x=i * D, solref=solref, w=W / 2, h=H / 2, m=M, mu=MU) for i in range(n))
    model = mujoco.MjModel.from_xml_string(WORLD.format(step=step, bodies=bodies))
    data, goal = mujoco.MjData(model), math.radians(89)
    data.qvel[0] = PUSH
    begun = time.process_time()
    while data.time < 5:
        before = data.qpos[n - 1]
        mujoco.mj_step(model, data)
        if data.qpos[n - 1] > goal:
            part = (data.qpos[n - 1] - goal) / (data.qpos[n - 1] - before)
            return float(data.time - part * step), time.process_time() - begun
    return math.nan, time.process_time() - begun


def main(quick: bool = False) -> None:
    tolerances = (1e-3, 1e-5, 1e-7, 1e-9)
    rows = []
    for n in (20, 50):
        found = ours(n, tolerances)
        best = found[-1][0]
        for tolerance, (fall, lacks, compiling, taken) in zip(tolerances, found, strict=True):
            off = "" if tolerance == tolerances[-1] else f"{100 * abs(fall / best - 1):.1g} %"
            text = f"{compiling:.2f} + {taken:.3f} s"
            rows.append([f"{n}", f"mechc, {tolerance:g}", f"{fall:.8f} s", off, f"{lacks:.0e}", text])
        if importlib.util.find_spec("mujoco") is None:
            continue
        for step in STEPS[: 4 if quick or n > 20 else None]:
            for contacts, solref in (("default", "0.02 1"), ("stiffened", f"{2 * step} 1")):
                fall, taken = by_mujoco(n, step, solref)
                off = f"{100 * abs(fall / best - 1):.2f} %"
                off += "" if abs(fall / best - 1) <= 0.01 else ", not within 1 %"
                rows.append(
                    [f"{n}", f"MuJoCo {contacts}, {step:g} s", f"{fall:.6f} s", off, "", f"{taken:.3f} s"]
                )
    write(
        "dominoes",
        "Dominoes",
        [
            "Each turns about its foot without restitution, its corner slides on the face of the next with friction 0.2; the first is "
            "pushed at 4 rad/s, and the time is when the last leans by 89 degrees. Of mechc for each tolerance, without a companion "
            "run: the share of the energy that its account lacks, processor time to compile (little where the library is in the "
            "cache) and to run. Of MuJoCo for each step: boxes on hinges with limits, its compliant contacts with `solref` at its "
            "default, and at two steps. Off: from mechc's time at 1e-9.",
            table(["n", "solved by", "fall time", "off", "energy lacks", "time"], rows),
        ],
    )


if __name__ == "__main__":
    main()
