# SPDX-License-Identifier: Apache-2.0
"""A device or simulator of your own: its loop calls the core once a tick.

Here a stand-in: a handle of 0.2 kg that a hand of 300 N/m leads down onto a box, integrated at 1 kHz. Replace
`Handle` by what reads your device's pose and sets its force; between core and motors belongs what limits and ramps the
force and asks for a deadman switch, which is what haptic.Session has and Core does not.
"""

import pathlib

import numpy as np

import haptic

scenes = pathlib.Path(__file__).resolve().parents[3] / "host_sim" / "scenes" / "tetrahedron_on_box"
scene = haptic.compile(scenes / "scene.toml")
PERIOD = 0.001


class Handle:
    """A mass in three directions, its damper, and the hand's spring."""

    def __init__(self, pose):
        self.pose = np.array(pose)
        self.velocity = np.zeros(3)

    def read(self):
        return self.pose

    def exert(self, force, hand):
        pull = 300.0 * (hand - self.pose[:3]) - 12.0 * self.velocity + force
        self.velocity += PERIOD * pull / 0.2
        self.pose[:3] += PERIOD * self.velocity


core, handle = scene.core(), Handle(scene.start)
for tick in range(2000):
    hand = scene.start[:3] - [0, 0, min(tick / 1000, 1) * 0.05]
    result = core.step(handle.read(), time=tick * PERIOD)
    handle.exert(result.force, hand)
    if tick % 250 == 0 or tick == 1999:
        print(f"{tick:4d} ms: hand wants {1e3 * hand[2]:6.2f} mm, handle {1e3 * handle.pose[2]:6.2f} mm, "
              f"{abs(result.force[2]):5.2f} N up, {result.situation}")  # fmt: skip

assert result.gap > -1e-6  # the part overlaps nothing
assert result.force[2] > 0.5
