"""Run a motion on a Panda or FR3: a row of `knotwork export … --format franka` each millisecond.

    python examples/run_on_franka.py motion.csv 172.16.0.2

Needs `pip install pylibfranka`, in the version for the arm. It has not run on an arm: keep the stop
button at hand.
"""

import sys

import numpy as np
import pylibfranka

NEAR = 1e-3  # [rad] the arm must stand so near to the first row

with open(sys.argv[1], encoding="utf-8") as file:
    lines = [line for line in file if not line.startswith("#")]
rows = np.loadtxt(lines[1:], delimiter=",")[:, 1:]

robot = pylibfranka.Robot(sys.argv[2])
control = robot.start_joint_position_control(pylibfranka.ControllerMode.JointImpedance)
state, _ = control.readOnce()
off = np.array(state.q_d) - rows[0]
if np.abs(off).max() > NEAR:
    robot.stop()
    sys.exit(f"the arm is {np.abs(off).max():.2g} rad off the first row; move it there: {rows[0]}")

row, last = 0, len(rows) - 1
while True:
    command = pylibfranka.JointPositions((rows[row] + off).tolist())  # so it begins without a jump
    command.motion_finished = row == last
    control.writeOnce(command)
    if row == last:
        break
    _, period = control.readOnce()
    row = min(row + round(1000 * period.to_sec()), last)  # a lost cycle is a lost row
