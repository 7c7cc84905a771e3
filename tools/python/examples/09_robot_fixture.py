# SPDX-License-Identifier: Apache-2.0
"""A robot moves a socket while a hand puts a peg into it: 09_robot_fixture.py

The robot is a thread of its own that gives the socket's pose 60 times a second, as a simulator's loop or a robot's controller
does. It reads how hard it is pushed. Then it falls silent while the peg is in the socket: the force fades, and comes back
with its poses once the switch is pressed again (the simulated hand does that).
"""

import math
import pathlib
import threading
import time

import haptic

scenes = pathlib.Path(__file__).resolve().parents[3] / "host_sim" / "scenes" / "robot_fixture"
scene = haptic.compile(scenes / "scene.toml")


class Robot(threading.Thread):
    """Moves the socket to and fro by 10 mm in x, in 4 s, at its place over the table."""

    def __init__(self, session):
        super().__init__(daemon=True)
        self.session = session
        self.silent = threading.Event()
        self.ended = threading.Event()
        self.largest_push = 0.0

    def run(self):
        begin = time.monotonic()
        while not self.ended.is_set():
            if not self.silent.is_set():
                x = 0.005 * (1.0 - math.cos(0.5 * math.pi * (time.monotonic() - begin)))
                self.session.drive("socket", (x, 0.0, 0.085))
                push = self.session.driven["socket"].force
                self.largest_push = max(self.largest_push, math.sqrt(push @ push))
            time.sleep(1 / 60)


with haptic.Session(scene, device="sim") as s:
    robot = Robot(s)
    robot.start()
    time.sleep(0.3)
    s.hand.move_to(x=0.005, z=0.125, seconds=0.8)  # in the middle between both ends, over the rim
    s.hand.move_to(x=0.005, z=0.100, seconds=1.0)  # into the hole, which moves: the walls carry the peg along
    time.sleep(1.0)
    socket = s.driven["socket"]
    depth = 0.1 - (s.state().felt_pose[2] - 0.025)  # of the peg's lower end below the rim
    print(f"peg {1e3 * depth:.1f} mm deep; the robot was pushed by {robot.largest_push:.2f} N, lags by {1e6 * socket.lag:.2f} um")
    assert depth > 0.015 and robot.largest_push > 0.1 and socket.lag < 1e-4 and not socket.lost

    robot.silent.set()
    time.sleep(0.6)
    socket = s.driven["socket"]
    print(f"silent: lost {socket.lost}, {'released' if s.state().safety_faults else 'armed'}")
    assert socket.lost
    robot.silent.clear()
    time.sleep(0.5)
    assert not s.driven["socket"].lost
    robot.ended.set()
    robot.join()
