# SPDX-License-Identifier: Apache-2.0
"""A device whose loop is yours: a session with device="external", one tick a period, read from anywhere.

Here a stand-in: a handle of 0.2 kg that a hand of 300 N/m leads down onto a box. Replace `read` and `exert` by what reads
your device's pose and buttons and sets its force. The tick arms by the deadman switch, limits and ramps: what it gives may be
sent as it is.
"""

import pathlib
import sys

import numpy as np

import haptic

PERIOD = 0.001
scenes = pathlib.Path(__file__).resolve().parents[3] / "host_sim" / "scenes" / "tetrahedron_on_box"


class Handle:
    """A mass in three directions, its damper, and the hand's spring."""

    def __init__(self):
        self.place, self.velocity = np.zeros(3), np.zeros(3)

    def read(self, t):
        return self.place, 1 if t > 0.1 else 0  # the deadman switch is pressed after 0.1 s

    def exert(self, force, t):
        hand = np.array([0, 0, -0.05 * min(max(t - 0.3, 0), 1)])
        pull = 300.0 * (hand - self.place) - 12.0 * self.velocity + force
        self.velocity += PERIOD * pull / 0.2
        self.place += PERIOD * self.velocity


scene = haptic.compile(scenes / "scene.toml")
handle, largest = Handle(), 0.0
with haptic.Session(scene, device="external", limits=haptic.Limits(max_force=2.5, axes=7)) as session:
    for k in range(2500):
        t = k * PERIOD
        place, switches = handle.read(t)
        tick = session.tick(place, t, switches=switches)
        handle.exert(tick.force, t)
        largest = max(largest, float(np.linalg.norm(tick.force)))
        if k % 500 == 499:
            print(f"{t:.1f} s: {tick.arming}, {tick.force[2]:5.2f} N up, {tick.situation} {tick.waits}")
    touching = session.contacts()
    for contact in touching:
        print(f"touches part {contact.part} at {1e3 * contact.point} mm with {contact.force} N")
    assert touching and tick.arming == "armed" and 0.5 < largest <= 2.5 + 1e-9

    # The end of a loop in the same thread: closed, the ticks ramp to zero, and then there is none.
    session.close()
    try:
        for k in range(2500, 2600):
            tick = session.tick(handle.read(k * PERIOD)[0], k * PERIOD, switches=1)
    except haptic.HapticError as error:
        assert error.name == "HAPTIC_ERROR_CLOSED" and not tick.force.any(), error
    else:
        sys.exit("the loop was not ended")
    print(session.verdict())
