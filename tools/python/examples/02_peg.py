# SPDX-License-Identifier: Apache-2.0
"""From two mesh files to a felt peg: 02_peg.py [PEG HOLE [PLOT.png]], meshes in millimetres.

Without arguments: the square peg and hole of host_sim/scenes. The peg is 80 mm long below its grip, the hole starts at
height 0.
"""

import pathlib
import sys

import haptic

scenes = pathlib.Path(__file__).resolve().parents[3] / "host_sim" / "scenes" / "square_peg_five"
meshes = sys.argv[1:3] or [scenes / "peg.off", scenes / "socket.obj"]

scene = haptic.compile(*meshes, unit="mm", start=(0, 0, 0.005), grip=(0, 0, 0.05), stiffness=800)
for message in scene.messages:
    print(message)

with haptic.Session(scene, device="sim") as s:
    s.hand.move_to(x=0.001, seconds=0.5)  # a millimetre beside the hole
    s.hand.move_to(z=-0.010, seconds=1.5)  # pressed on the way in
    state = s.state()
    print(f"part at {1e3 * state.felt_pose[2]:.2f} mm, gap {state.gap:.2g} m, situation {state.situation}")
    print(f"force {state.force.round(3)} N, torque {state.torque.round(4)} N m")
    s.hand.move_to(scene.start, seconds=0.5)
    if len(sys.argv) > 3:
        s.plot(sys.argv[3])

ticks = s.history()
print(f"{len(ticks)} ticks, largest force {max(abs(ticks['force']).max(axis=0)):.2f} N, {s.state().late_ticks} late")
