"""Play a motion in MuJoCo: keyframes in a model made from the arm's URDF, and actuators.

    python examples/play_in_mujoco.py

Needs `pip install mujoco`. Prints how far the simulated arm is off the motion.
"""

from pathlib import Path

import mujoco
import numpy as np

import knotwork as kw
from knotwork.files.export import to_mujoco

plan = kw.plan("planar2_closed_form")
curve = plan.trajectory
KP, KV = 4000, 130
keyframes = mujoco.MjSpec.from_string(to_mujoco(curve, rate=500, lead=KV / KP))

arm = mujoco.MjSpec.from_file(str(Path(__file__).parents[1] / "robots" / "planar2.urdf"))
arm.option.timestep, arm.option.integrator = 0.002, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
arm.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT  # its links touch at the joints
for name in curve.joint_names:
    servo = arm.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    servo.set_to_position(kp=KP, kv=KV)
for key in keyframes.keys:
    arm.add_key(name=key.name, time=key.time, qpos=key.qpos, qvel=key.qvel, ctrl=key.ctrl)

model = arm.compile()
data = mujoco.MjData(model)
mujoco.mj_resetDataKeyframe(model, data, 0)
off = 0.0
for key in range(model.nkey):
    data.ctrl[:] = model.key_ctrl[key]
    mujoco.mj_step(model, data)
    position = curve.position(min(data.time + curve.start_time, curve.end_time))
    off = max(off, float(np.abs(data.qpos - position).max()))
print(f"{model.nkey} keyframes; the arm is at most {off:.2g} rad off")
