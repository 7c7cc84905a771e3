# SPDX-License-Identifier: Apache-2.0
"""A robot in MuJoCo carries a socket, and a hand puts a peg into it: 11_mujoco_robot.py

MuJoCo simulates the arm (two hinges with position actuators) in steps of 2 ms, and knows no contact. 100 times a second the
socket's pose goes to the core, where the socket is a driven part, and the wrench of the peg on it goes back to the arm. So the
arm feels the hand, and yields by the stiffness of its actuators. The core's torque is about the origin of the socket, MuJoCo's
about its centre of mass, which a camera at its side moves off the axis: 11_mujoco_robot.c transfers it.

The hand puts the peg in while the socket moves to and fro. Then the hand stands while the arm goes on, and the socket pulls at
the peg. At last the arm stops, and the hand pushes sideways. How far the arm then yields has a closed form: the force times
J K^-1 J^T, with the arm's Jacobian J and the stiffnesses K of its joints.

One loop at 1 kHz, no threads: every run is the same. Needs libmujoco-dev (2.2.2 in Debian 12) and a C compiler:
11_mujoco_robot.c is compiled at the start.
"""

import ctypes
import ctypes.util
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import numpy as np

import haptic

UPPER, FORE, JOINT_STIFFNESS, JOINT_DAMPING = 0.30, 0.25, 500.0, 30.0  # [m], [N m/rad], [N m s/rad]
RADIUS, CLEARANCE, LONG, HIGH, SIDES = 0.010, 0.0003, 0.050, 0.030, 32  # of peg and socket [m]
STIFFNESS, PUSHED = 800.0, 0.006  # of the hand's spring, and how far it aims sideways
MIDDLE = np.array([0.30, 0.20])  # of the socket's way
EVERY, STEP = 10, 0.002  # ticks between two poses; a step of MuJoCo [s]

MODEL = f"""
<mujoco>
  <option timestep="{STEP}"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <body name="upper" pos="0 0 0.07">
      <joint name="shoulder" axis="0 0 1" damping="{JOINT_DAMPING}"/>
      <geom type="capsule" size="0.03" fromto="0 0 0 {UPPER} 0 0" mass="2"/>
      <body name="fore" pos="{UPPER} 0 0">
        <joint name="elbow" axis="0 0 1" damping="{JOINT_DAMPING}"/>
        <geom type="capsule" size="0.02" fromto="0 0 0 {FORE - 0.02} 0 0" mass="1"/>
        <body name="socket" pos="{FORE} 0 {-HIGH / 2}">
          <geom type="cylinder" size="0.02 {HIGH / 2}" pos="0 0 {HIGH / 2}" mass="0.3"/>
          <geom name="camera" type="box" size="0.015 0.02 0.01" pos="0 0.04 0.01" mass="0.3"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="shoulder" kp="{JOINT_STIFFNESS}"/>
    <position joint="elbow" kp="{JOINT_STIFFNESS}"/>
  </actuator>
</mujoco>"""


def tube(layers):
    """A solid of revolution about z with `layers` (radius, z): from the outer lower edge upwards, inwards and down again."""
    turn = 2 * np.pi * np.arange(SIDES) / SIDES
    vertices = [(r * np.cos(a), r * np.sin(a), z) for r, z in layers for a in turn]
    triangles = []
    for layer in range(len(layers)):
        low, high = SIDES * layer, SIDES * ((layer + 1) % len(layers))
        for k in range(SIDES):
            a, b = k, (k + 1) % SIDES
            triangles += [(low + a, low + b, high + b), (low + a, high + b, high + a)]
    return np.array(vertices), triangles


def peg():
    vertices, triangles = tube([(RADIUS, -LONG / 2), (RADIUS, LONG / 2)])
    sides = triangles[: 2 * SIDES]
    ends = [(0, k + 1, k) for k in range(1, SIDES - 1)] + [(SIDES, SIDES + k, SIDES + k + 1) for k in range(1, SIDES - 1)]
    return vertices, sides + ends


def socket():
    """Its origin is in the middle of its lower face."""
    inner = RADIUS + CLEARANCE
    return tube([(0.02, 0), (0.02, HIGH), (inner, HIGH), (inner, 0)])


def angles_at(place):
    """Of shoulder and elbow, with the socket at `place`."""
    x, y = place
    elbow = np.arccos((x * x + y * y - UPPER**2 - FORE**2) / (2 * UPPER * FORE))
    return np.array([np.arctan2(y, x) - np.arctan2(FORE * np.sin(elbow), UPPER + FORE * np.cos(elbow)), elbow])


def yield_of(angles, force, torque):
    """How far the socket is pushed in the plane x y by a force on its origin and a torque about it."""
    a, b = angles[0], angles.sum()
    jacobian = np.array([
        [-UPPER * np.sin(a) - FORE * np.sin(b), -FORE * np.sin(b)],
        [UPPER * np.cos(a) + FORE * np.cos(b), FORE * np.cos(b)],
    ])  # fmt: skip
    return jacobian @ (jacobian.T @ force[:2] + torque[2]) / JOINT_STIFFNESS


class Robot:
    """The arm in MuJoCo."""

    def __init__(self, folder):
        library, model = str(pathlib.Path(folder) / "robot.so"), pathlib.Path(folder) / "robot.xml"
        source = str(pathlib.Path(__file__).with_suffix(".c"))
        subprocess.run(["cc", "-O2", "-shared", "-fPIC", source, "-lmujoco", "-o", library], check=True)
        model.write_text(MODEL, encoding="utf-8")
        self.calls = ctypes.CDLL(library)
        self.calls.robot_open.restype = ctypes.c_void_p
        self.calls.robot_version.restype = ctypes.c_char_p
        error = ctypes.create_string_buffer(1000)
        handle = self.calls.robot_open(str(model).encode(), b"socket", error, len(error))
        if not handle:
            raise RuntimeError(error.value.decode())
        self.handle = ctypes.c_void_p(handle)
        self.version = self.calls.robot_version().decode()

    def place(self, angles):
        self.calls.robot_place(self.handle, angles.ctypes.data_as(ctypes.c_void_p))

    def step(self, steps, set_points):
        self.calls.robot_step(self.handle, steps, set_points.ctypes.data_as(ctypes.c_void_p))

    def push(self, force, torque):
        self.calls.robot_push(self.handle, force.ctypes.data_as(ctypes.c_void_p), torque.ctypes.data_as(ctypes.c_void_p))

    @property
    def pose(self):
        pose = np.zeros(7)
        self.calls.robot_pose(self.handle, pose.ctypes.data_as(ctypes.c_void_p))
        return pose

    def close(self):
        self.calls.robot_close(self.handle)


def ramp(t, begin, end):
    """0 before `begin`, 1 after `end`, smooth between."""
    s = min(max((t - begin) / (end - begin), 0.0), 1.0)
    return s * s * (3 - 2 * s)


def way(t):
    """Where the robot's program has the socket: to and fro by 6 mm in x, in 2 s; it stops after 5 s."""
    return MIDDLE + np.array([0.006 * np.sin(np.pi * min(t, 5.0)), 0.0])


def run(robot):
    robot.place(angles_at(MIDDLE))
    start = robot.pose  # of the socket
    above = start[2] + HIGH + LONG / 2 + 0.005
    scene = haptic.compile(
        haptic.Part(peg(), unit="m", at=(*MIDDLE, above), name="peg", role="hand"),
        haptic.Part(socket(), unit="m", at=start[:3], turn=start[3:], name="socket", role="driven"),
        stiffness=STIFFNESS,
    )
    core = scene.core()
    down = above - 0.025  # 20 mm deep
    rows, newest = [], start
    for tick in range(1, 9001):
        t = 1e-3 * tick
        if tick % EVERY == 0:
            robot.step(round(1e-3 * EVERY / STEP), angles_at(way(t)))
            newest = robot.pose
            core.drive("socket", newest, t, fastest=0.1, fastest_turn=1.0)
        # The eye follows the socket until the peg is in; then the hand stays in the middle.
        x, y = newest[:2] if t < 2.5 else newest[:2] + ramp(t, 2.5, 3.0) * (MIDDLE - newest[:2])
        goal = (x, y + PUSHED * ramp(t, 6.0, 7.0), above + ramp(t, 0.5, 2.0) * (down - above))
        felt = core.step(goal, t)
        driven = core.driven["socket"]
        robot.push(driven.force, driven.torque)  # at rest until the next pose
        rows.append((t, newest[:3], driven, felt))
    return rows


def main():
    with tempfile.TemporaryDirectory() as folder:
        robot = Robot(folder)
        print(f"MuJoCo {robot.version}, {1e3 * STEP:g} ms a step; {1000 / EVERY:g} poses a second; the core at 1 kHz")
        rows = run(robot)
        robot.close()
    t = np.array([row[0] for row in rows])
    place = np.array([row[1] for row in rows])
    push = np.array([row[2].force for row in rows])
    felt_at = np.array([row[2].pose[:3] for row in rows])
    lag = np.array([row[2].lag for row in rows])
    hand = np.array([row[3].force for row in rows])
    peg_at = np.array([row[3].felt_pose[:3] for row in rows])
    assert not any(row[2].lost for row in rows)

    depth = felt_at[-1, 2] + HIGH - (peg_at[-1, 2] - LONG / 2)
    carried = np.linalg.norm(push[(t > 3.0) & (t < 5.0)], axis=1).max()
    print(f"peg {1e3 * depth:.1f} mm deep; while the hand stands the moving socket is pushed by {carried:.2f} N at most")
    assert depth > 0.019 and carried > 2.0

    behind = np.linalg.norm(felt_at - place, axis=1)[t < 5.0].max()
    print(f"the socket is felt {1e3 * behind:.2f} mm behind MuJoCo's newest pose at most, {1e6 * lag.max():.2f} um behind the core's goal")
    assert behind < 0.5e-3 and lag.max() < 1e-6

    rest = t > 8.5
    force, yielded = push[rest].mean(axis=0), place[rest].mean(axis=0)[:2] - way(9.0)
    torque = np.mean([row[2].torque for row in rows if row[0] > 8.5], axis=0)
    closed = yield_of(angles_at(way(9.0)), force, torque)
    print(
        f"pushed by {force[0]:.3f} {force[1]:.3f} N the arm has yielded by {1e3 * yielded[0]:.3f} {1e3 * yielded[1]:.3f} mm, "
        f"in closed form {1e3 * closed[0]:.3f} {1e3 * closed[1]:.3f} mm; at rest it trembles by {1e6 * place[rest].std(axis=0).max():.2g} um"
    )
    assert np.linalg.norm(yielded - closed) < 0.005 * np.linalg.norm(closed)
    assert np.allclose(hand[rest].mean(axis=0), -force, atol=1e-3)
    assert place[rest].std(axis=0).max() < 1e-6


if __name__ == "__main__":
    if shutil.which("cc") is None or ctypes.util.find_library("mujoco") is None or not os.path.exists("/usr/include/mujoco/mujoco.h"):
        print("skipped: needs a C compiler and MuJoCo; on Debian: apt-get install gcc libmujoco-dev")
        sys.exit(0)
    main()
