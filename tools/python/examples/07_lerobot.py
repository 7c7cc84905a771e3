# SPDX-License-Identifier: Apache-2.0
"""A haptic device as a teleoperator of LeRobot: the loop that a recording script has, with a robot that is a stand-in.

The robot follows the part as it is felt and tells where the fixed parts are; its loop runs at 60 Hz and is blocked for
a second once: the force ramps to zero meanwhile. Needs lerobot (pip install lerobot).
"""

import pathlib
import sys
import time

tools = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(tools / "lerobot_teleoperator_haptic"))
try:
    import lerobot  # noqa: F401
except ImportError:
    print("skipped: needs lerobot; pip install lerobot")
    sys.exit(0)

from lerobot_teleoperator_haptic import HapticTeleoperator, HapticTeleoperatorConfig  # noqa: E402

scene = tools.parents[1] / "host_sim" / "scenes" / "tetrahedron_on_box" / "scene.toml"
teleoperator = HapticTeleoperator(HapticTeleoperatorConfig(id="left hand", scene=str(scene)))
teleoperator.connect()
start = teleoperator.get_action()
try:
    # The simulated hand presses; with a real device a person does.
    teleoperator.session.hand.move_to(z=start["z"] - 0.05, seconds=0.6, wait=False)
    largest, silent, table = 0.0, False, 0.0
    for step in range(240):
        action = teleoperator.get_action()  # what the robot is sent
        table += 0.0005 / 60 if step < 120 else 0.0  # where the robot sees the table
        teleoperator.send_feedback({"fixed.x": 0.0, "fixed.y": 0.0, "fixed.z": table})
        largest = max(largest, abs(action["fz"]))
        if step % 60 == 0:
            print(f"{step / 60:.0f} s: part at {1e3 * action['z']:.2f} mm, {action['fz']:+.2f} N")
        if step == 100:
            time.sleep(1.0)
            silent = teleoperator.get_action()["fz"] == 0.0
        time.sleep(1 / 60)
finally:
    teleoperator.disconnect()
print(f"largest force {largest:.2f} N; without news of the table: {'no force' if silent else 'force'}")
assert silent
