# SPDX-License-Identifier: Apache-2.0
"""The same peg in the same hole, by MuJoCo and by us: what a hand would feel on one motion.

Both draw the peg to the hand's pose by the same spring and give the hand the spring's pull. MuJoCo's peg is a free body
of 50 g with critical damping, stepped ten times a millisecond (the spring's rotation is too stiff for fewer), its
contacts are soft and its solver iterates; ours has no mass, and overlaps nothing. Two rows of MuJoCo: its contact
parameters as they are by default, and as stiff as it stands here.
Needs libmujoco-dev (2.2.2 in Debian 12) and a C compiler: 06_mujoco_peg.c is compiled at the start.
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

HERE = pathlib.Path(__file__).resolve().parent
compiler = shutil.which("cc")
if compiler is None or ctypes.util.find_library("mujoco") is None or not os.path.exists("/usr/include/mujoco/mujoco.h"):
    print("skipped: needs a C compiler and MuJoCo; on Debian: apt-get install gcc libmujoco-dev")
    sys.exit(0)

STIFFNESS, MASS, PARTS = 800.0, 0.05, 10
HALF, GAP, LONG, DEEP = 0.010, 0.0002, 0.030, 0.030  # peg 20 x 20 x 60 mm, 0.2 mm of play, a hole of 30 mm
# Walls and floor of the hole: centre and half edges of five boxes; its rim is at z = 0.
OUT, INNER = 0.030, HALF + GAP
WIDE, MIDDLE = (OUT - INNER) / 2, (OUT + INNER) / 2
BOXES = [
    ((MIDDLE, 0, -DEEP / 2), (WIDE, OUT, DEEP / 2)),
    ((-MIDDLE, 0, -DEEP / 2), (WIDE, OUT, DEEP / 2)),
    ((0, MIDDLE, -DEEP / 2), (INNER, WIDE, DEEP / 2)),
    ((0, -MIDDLE, -DEEP / 2), (INNER, WIDE, DEEP / 2)),
    ((0, 0, -DEEP - 0.005), (OUT, OUT, 0.005)),
]


def box(half):
    corners = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)]) * 2.0 - 1.0
    triangles = [
        [0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4],
        [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5],
    ]  # fmt: skip
    return corners * half, triangles


def motion():
    """At 1 kHz: down into the hole, onto its floor by 3 mm, still for a second, against a wall, tilted, still."""
    stations = [  # seconds, x, z, tilt about y
        (0.0, 0.0, 0.035, 0.0), (0.8, 0.0, 0.005, 0.0), (1.6, 0.0, -0.003, 0.0), (2.6, 0.0, -0.003, 0.0),
        (3.2, 0.003, -0.003, 0.0), (4.2, 0.003, -0.003, 0.0), (4.8, 0.003, -0.003, 0.02), (5.8, 0.003, -0.003, 0.02),
    ]  # fmt: skip
    t = np.arange(0, stations[-1][0], 0.001)
    poses = np.zeros((len(t), 7))
    track = np.zeros((len(t), 3))
    for (begin, *a), (end, *b) in zip(stations, stations[1:]):
        within = (t >= begin) & (t < end)
        s = (t[within] - begin) / (end - begin)
        share = s**3 * (10 - 15 * s + 6 * s * s)
        track[within] = np.array(a) + share[:, None] * (np.array(b) - np.array(a))
    poses[:, 0], poses[:, 2] = track[:, 0], track[:, 1]
    poses[:, 4], poses[:, 6] = np.sin(track[:, 2] / 2), np.cos(track[:, 2] / 2)
    return t, poses


def by_mujoco(poses, turn_stiffness, contact, folder):
    library = pathlib.Path(folder) / "peg.so"
    subprocess.run(
        [compiler, "-O2", "-shared", "-fPIC", str(HERE / "06_mujoco_peg.c"), "-lmujoco", "-lm", "-o", str(library)],
        check=True,
    )
    geoms = "".join(
        '<geom type="box" pos="%g %g %g" size="%g %g %g"/>' % (*centre, *half) for centre, half in BOXES
    )
    model = pathlib.Path(folder) / "peg.xml"
    model.write_text(
        f'<mujoco><option timestep="{0.001 / PARTS}" gravity="0 0 0"/>'
        f'<default><geom friction="0 0 0" condim="1" {contact}/></default>'
        f'<worldbody>{geoms}<body><freejoint/><geom type="box" size="{HALF} {HALF} {LONG}" mass="{MASS}"/></body>'
        "</worldbody></mujoco>",
        encoding="utf-8",
    )
    inertia = MASS * ((2 * HALF) ** 2 + (2 * LONG) ** 2) / 12
    wrenches, felt = np.zeros((len(poses), 6)), np.zeros((len(poses), 7))
    error = ctypes.create_string_buffer(1000)
    call = ctypes.CDLL(str(library)).mujoco_replay
    call.argtypes = [ctypes.c_char_p, ctypes.c_int, ctypes.c_int, ctypes.c_void_p] + [ctypes.c_double] * 4 + [
        ctypes.c_void_p, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int,
    ]  # fmt: skip
    failed = call(
        str(model).encode(), len(poses), PARTS, poses.ctypes.data, STIFFNESS, turn_stiffness, 2 * np.sqrt(STIFFNESS * MASS),
        2 * np.sqrt(turn_stiffness * inertia), wrenches.ctypes.data, felt.ctypes.data, error, len(error),
    )  # fmt: skip
    if failed:
        raise RuntimeError(error.value.decode())
    return wrenches, felt


def row(name, t, wrenches, felt, expected):
    """Standard deviations while the hand is still, largest step while it moves, error of the force on the floor."""
    force, torque = wrenches[:, :3], wrenches[:, 3:]
    still = (t > 2.0) & (t < 2.6)
    tilted = (t > 5.2) & (t < 5.8)
    steps = np.linalg.norm(np.diff(force, axis=0), axis=1)
    overlap = -(felt[still, 2].mean() - LONG + DEEP)
    print(
        f"{name:8s} {1e3 * force[still].std(axis=0).max():12.4f} {1e3 * torque[tilted].std(axis=0).max():14.4f} "
        f"{steps.max():10.3f} {force[still, 2].mean():10.4f} {force[still, 2].mean() - expected:+9.4f} {1e6 * overlap:9.2f}"
    )
    return force[still, 2].mean()


parts = [haptic.Part(box(half), unit="m", at=centre) for centre, half in BOXES]
t, poses = motion()
scene = haptic.compile(
    box((HALF, HALF, LONG)), *parts, unit="m", start=poses[0, :3], grip=(0, 0, 0), stiffness=STIFFNESS
)
ours = scene.replay(poses, t)
turn_stiffness = STIFFNESS * (4.5 * np.sqrt(2 * HALF**2 + LONG**2)) ** 2  # as the core's coupling has it
STIFF = 'solref="0.0004 1" solimp="0.999 0.9999 0.0001"'
with tempfile.TemporaryDirectory() as folder:
    default, stiff = (by_mujoco(poses, turn_stiffness, contact, folder) for contact in ("", STIFF))

expected = STIFFNESS * 0.003
print(f"{'':8s} {'noise [mN]':>12s} {'noise [mN m]':>14s} {'step [N]':>10s} {'floor [N]':>10s} {'error':>9s} {'overlap':>9s}")
print(f"{'':8s} {'at rest':>12s} {'tilted, rest':>14s} {'largest':>10s} {expected:10.1f} {'[N]':>9s} {'[um]':>9s}")
our_wrenches = np.hstack([ours.forces, ours.torques])
force = row("haptic", t, our_wrenches, ours.felt_poses, expected)
row("MuJoCo", t, *default, expected)
row("stiff", t, *stiff, expected)
assert abs(force - expected) < 1e-3
assert np.isfinite(default[0]).all()
