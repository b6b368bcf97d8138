"""ns of mj_forward for N point masses on hinges, without contacts: mujoco_chain.py N"""

import sys
import time

import mujoco
import numpy as np

n = int(sys.argv[1])
text = (
    '<mujoco><compiler angle="radian" inertiafromgeom="false" boundmass="0" boundinertia="0"/>'
    '<option gravity="0 -9.81 0"><flag contact="disable" constraint="disable"/></option><worldbody>'
)
for i in range(n):
    text += f'<body pos="0 {-1 if i else 0} 0"><joint type="hinge" axis="0 0 1"/>'
    text += '<inertial pos="0 -1 0" mass="1" diaginertia="1e-10 1e-10 1e-10"/>'
model = mujoco.MjModel.from_xml_string(text + "</body>" * n + "</worldbody></mujoco>")
data = mujoco.MjData(model)
rng = np.random.default_rng(1)
data.qpos[:], data.qvel[:] = rng.uniform(-1, 1, n), rng.uniform(-1, 1, n)
best = float("inf")
for _ in range(40):
    begun = time.perf_counter()
    for _ in range(200):
        mujoco.mj_forward(model, data)
    best = min(best, (time.perf_counter() - begun) / 200)
print(best * 1e9)
