"""Falling four-bar by MuJoCo's RK4, the loop closed by `connect`, over a ladder of steps; timed in one call of C.

Standard input and output as in exudyn_four_bar.py.
"""

import json
import sys
import time

import mujoco
import numpy as np

case = json.load(sys.stdin)
lengths, angles = case["lengths"], np.array(case["angles"])


def solve(step):
    # the constraint as hard as this step allows: its time constant is two steps
    text = (
        f'<mujoco><compiler angle="radian" inertiafromgeom="false" boundmass="0" boundinertia="0"/><option '
        f'timestep="{step!r}" gravity="0 {-case["gravity"]!r} 0" integrator="RK4" tolerance="1e-12" '
        'iterations="100"><flag contact="disable"/></option><worldbody>'
    )
    for i, length in enumerate(lengths):
        inertia = " ".join([repr(length**2 / 12)] * 3)
        text += (
            f'<body name="b{i}" pos="{lengths[i - 1] if i else 0!r} 0 0"><joint type="hinge" axis="0 0 1"/>'
        )
        text += f'<inertial pos="{length / 2!r} 0 0" mass="1" diaginertia="{inertia}"/>'
    text += "</body>" * len(lengths) + '</worldbody><equality><connect body1="b2" '
    text += f'anchor="{lengths[2]!r} 0 0" solref="{2.02 * step!r} 1" solimp="0.9999 0.9999 0.001"/>'
    model = mujoco.MjModel.from_xml_string(text + "</equality></mujoco>")
    data = mujoco.MjData(model)
    model.eq_data[0, 3:6] = [case["ground"], 0, 0]
    data.qpos[:] = np.diff(angles, prepend=0.0)
    begun = time.process_time()
    mujoco.mj_step(model, data, nstep=round(case["stop"] / step))
    seconds = time.process_time() - begun
    return seconds, [*np.cumsum(data.qpos), *np.cumsum(data.qvel)]


rows = []
for step in case["steps"]:
    seconds, state = solve(step)
    rows.append(["RK4", step, seconds, [float(x) for x in state]])
    if seconds > case["longest"]:
        break
print(json.dumps(rows))
