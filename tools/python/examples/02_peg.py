# SPDX-License-Identifier: Apache-2.0
"""From two mesh files to a felt part: 02_peg.py [PART FIXED [UNIT [PLOT.png]]], UNIT "mm" where none is given.

Without arguments: the square peg and hole of host_sim/scenes. Any two parts will do: the one in the hand is let down from
above until it touches the other, starts 5 mm over that place or higher, and is pressed 10 mm beyond it. Another place to start is `start`.
"""

import pathlib
import sys

import numpy as np

import haptic

scenes = pathlib.Path(__file__).resolve().parents[3] / "host_sim" / "scenes" / "square_peg_five"
meshes = sys.argv[1:3] if len(sys.argv) > 2 else [scenes / "peg.off", scenes / "socket.obj"]
unit = sys.argv[3] if len(sys.argv) > 3 else "mm"

ABOVE = 0.5  # where the way down begins [m]
high = haptic.compile(*meshes, unit=unit, start=(0, 0, ABOVE))
way = np.zeros((10_000, 7))
way[:, 2], way[:, 6] = np.linspace(ABOVE, -ABOVE, len(way)), 1.0
touches = high.replay(way).situations > 0  # 0: nothing is touched
if touches[0] or not touches.any():
    sys.exit("the part does not meet the other one on its way down; give compile a start of your own")
touch = way[np.argmax(touches), 2]

for over in (0.005, 0.010, 0.020, 0.040):
    try:
        scene = haptic.compile(*meshes, unit=unit, start=(0, 0, touch + over), stiffness=800)
        break
    except haptic.CompileError as error:  # a start that grazes is refused
        trouble = error
else:
    raise trouble
for message in scene.messages:
    print(message)

with haptic.Session(scene, device="sim") as s:
    s.hand.move_to(x=0.001, seconds=0.5)  # a millimetre aside
    s.hand.move_to(z=touch - 0.010, seconds=1.5)  # pressed 10 mm beyond the touch
    state = s.state()
    print(f"part at {1e3 * state.felt_pose[2]:.2f} mm, gap {state.gap:.2g} m, situation {state.situation}")
    print(f"force {state.force.round(3)} N, torque {state.torque.round(4)} N m")
    s.hand.move_to(scene.start, seconds=0.5)
    if len(sys.argv) > 4:
        s.plot(sys.argv[4])

ticks = s.history()
print(f"{len(ticks)} ticks, largest force {max(abs(ticks['force']).max(axis=0)):.2f} N, {s.state().late_ticks} late")
