# SPDX-License-Identifier: Apache-2.0
"""Two bodies that move at once, by MuJoCo and by us, against an exact answer.

12_mujoco_bodies.py [--instructions] [--csv FILE]. --instructions counts what a tick costs, by valgrind (some minutes).

squeeze: a block of 40 x 40 x 20 mm in the hand is pressed on a table with 1.6 N, and a driven plate comes down on it, 5 mm farther
than there is room. Exact: the block does not move, so the hand's force stays, and the plate stops on the block, 5 mm behind.
carry: a peg in a hole of 0.2 mm clearance is pressed on its floor and on two of its walls while the hole is carried along a
circle at 0.8 m/s and turned at 4 rad/s. Exact: in the hole's axes nothing changes, so the force is constant, with nothing behind.

Both engines are given the same poses of hand and driver, 1000 a second. The hand draws the part by a spring of 800 N/m, and
feels its pull. In MuJoCo the part has 50 g, a damper that acts on its speed beyond the hand's (critical), and ten steps a tick
(06_mujoco_side_by_side.py says why). Its driver is one of three:
mocap: a mocap body, which has no mass and yields to nothing;
welded: a body of 1 kg, welded to a mocap body; the weld knows no speed, so a driver that moves lags;
sprung: a body of 1 kg that a spring draws as ours is: 1e4 times as stiff as the hand's, 100 N at most, critical damping.
"Stiff": contacts, and the weld, are not as by default, but as stiff as 06_mujoco_side_by_side.py has them.

Columns, of the ticks in which the driver stands on the block or is carried at its full speed: the mean of the hand's force, less
the exact one, in the driver's axes; the standard deviation of the force; the largest difference from the exact force in any
tick since the driver has begun to move; how deep the part is in the driver, and in the table; how far the driver is behind its
commanded pose.
Needs libmujoco-dev (2.2.2 in Debian 12) and a C compiler: 12_mujoco_bodies.c is compiled at the start.
"""

import argparse
import ctypes
import importlib
import pathlib
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from typing import Callable

import numpy as np

import haptic

side_by_side = importlib.import_module("06_mujoco_side_by_side")
STIFFNESS, MASS, PARTS, STIFF = side_by_side.STIFFNESS, side_by_side.MASS, side_by_side.PARTS, side_by_side.STIFF
DRIVER_RATIO, DRIVER_PUSH, DRIVER_MASS, DRIVER_INERTIA = 1e4, 100.0, 1.0, 1e-3
ENGINES = ("haptic", "mocap", "mocap, stiff", "welded", "welded, stiff", "sprung", "sprung, stiff")


@dataclass
class Case:
    """Hand and driver; lengths in metres. Windows are times in seconds."""

    part: tuple  # meshes
    driver: tuple
    part_boxes: list  # the same as boxes: (centre, half edges)
    driver_boxes: list
    fixed: list  # boxes
    t: np.ndarray
    goals: np.ndarray  # poses of the hand, n x 7
    drives: np.ndarray  # of the driver
    begin: float  # of the driver's motion
    window: tuple
    force: np.ndarray  # exact, on the hand, in the driver's axes
    behind: float  # exact, of the driver
    depths: Callable  # (places n x 3 of the part's vertices in the driver's axes, the same in W) -> in the driver, in the table


def ramp(t, begin, end):
    """From 0 to 1, at rest at both ends."""
    s = np.clip((t - begin) / (end - begin), 0, 1)
    return s**3 * (10 - 15 * s + 6 * s * s)


def at(places):
    return np.hstack([places, np.tile([0.0, 0.0, 0.0, 1.0], (len(places), 1))])


def squeeze():
    t = 0.001 * np.arange(1, 2401)
    block, plate, high = (0.020, 0.020, 0.010), (0.025, 0.025, 0.005), 0.020
    goals, drives = np.zeros((len(t), 3)), np.zeros((len(t), 3))
    goals[:, 2] = high / 2 + 0.002 - 0.004 * ramp(t, 0.1, 0.4)
    drives[:, 2] = high + plate[2] + 0.010 - 0.015 * (ramp(t, 0.6, 1.0) - ramp(t, 1.6, 2.0))
    return Case(
        part=side_by_side.box(block), driver=side_by_side.box(plate),
        part_boxes=[((0, 0, 0), block)], driver_boxes=[((0, 0, 0), plate)],
        fixed=[((0, 0, -0.01), (0.05, 0.05, 0.01))],
        t=t, goals=at(goals), drives=at(drives), begin=0.6, window=(1.3, 1.6),
        force=np.array([0, 0, STIFFNESS * 0.002]), behind=0.005,
        depths=lambda own, world: (own[..., 2].max(axis=1) + plate[2], -world[..., 2].min(axis=1)),
    )  # fmt: skip


def carry():
    half, inner, outer, deep, floor, long, far = 0.010, 0.0102, 0.030, 0.050, 0.010, 0.030, 0.2
    t = 0.001 * np.arange(1, 2901)
    offset = np.zeros((len(t), 3))  # of the peg's goal from the hole's origin, which is in the middle of its floor
    offset[:, 2] = deep + long + 0.002 - (deep + 0.004) * ramp(t, 0.05, 0.5)
    offset[:, 0] = offset[:, 1] = (inner - half + 0.001) * ramp(t, 0.5, 0.7)
    angle = np.cumsum(4.0 * ramp(t, 0.8, 1.2)) * 0.001
    cos, sin = np.cos(angle), np.sin(angle)
    drives = np.zeros((len(t), 7))
    drives[:, 0], drives[:, 1] = far * cos, far * sin
    drives[:, 5], drives[:, 6] = np.sin(angle / 2), np.cos(angle / 2)
    goals = drives.copy()
    goals[:, 0] += cos * offset[:, 0] - sin * offset[:, 1]
    goals[:, 1] += sin * offset[:, 0] + cos * offset[:, 1]
    goals[:, 2] = offset[:, 2]
    vertices, triangles = side_by_side.lid_mesh(outer, inner, floor, deep)
    wide, middle = (outer - inner) / 2, (outer + inner) / 2

    def depths(own, world):
        in_hole = np.where(own[..., 2] < deep, np.abs(own[..., :2]).max(axis=2) - inner, -np.inf)
        return np.maximum(in_hole.max(axis=1), -own[..., 2].min(axis=1)), np.zeros(len(own))

    return Case(
        part=side_by_side.box((half, half, long)), driver=(vertices * [1, -1, -1], triangles),  # a lid, upside down
        part_boxes=[((0, 0, 0), (half, half, long))],
        driver_boxes=[((s * middle, 0, deep / 2), (wide, outer, deep / 2)) for s in (1, -1)]
        + [((0, s * middle, deep / 2), (inner, wide, deep / 2)) for s in (1, -1)]
        + [((0, 0, -floor / 2), (outer, outer, floor / 2))],
        fixed=[], t=t, goals=goals, drives=drives, begin=0.8, window=(1.3, 2.9),
        force=STIFFNESS * np.array([-0.001, -0.001, 0.002]), behind=0.0, depths=depths,
    )  # fmt: skip


CASES = {"squeeze": squeeze, "carry": carry}


def by_us(case):
    """Forces n x 3, and the poses of part and driver."""
    scene = haptic.compile(
        [haptic.Part(case.part, at=case.goals[0, :3], turn=case.goals[0, 3:], name="part", role="hand")]
        + [haptic.Part(case.driver, at=case.drives[0, :3], turn=case.drives[0, 3:], name="driver", role="driven")]
        + [haptic.Part(side_by_side.box(half), at=centre, role="fixed") for centre, half in case.fixed],
        unit="m",
        grip=(0, 0, 0),
        stiffness=STIFFNESS,
    )
    core = scene.core()
    force, part, driver = np.zeros((len(case.t), 3)), np.zeros_like(case.goals), np.zeros_like(case.drives)
    for k, t in enumerate(case.t):
        core.drive("driver", case.drives[k], t, fastest=1.0, fastest_turn=5.0)
        result = core.step(case.goals[k], t)
        driven = core.driven["driver"]
        assert not driven.lost
        force[k], part[k], driver[k] = result.force, result.felt_pose, driven.pose
    assert core.verdict(), core.verdict()
    return force, part, driver


def geoms(boxes):
    return "".join('<geom type="box" pos="%g %g %g" size="%g %g %g"/>' % (*c, *h) for c, h in boxes)


def frame(pose):
    return 'pos="%.9g %.9g %.9g" quat="%.9g %.9g %.9g %.9g"' % (*pose[:3], pose[6], *pose[3:6])


def compiled(folder):
    library, source = str(pathlib.Path(folder) / "bodies.so"), str(pathlib.Path(__file__).with_suffix(".c"))
    subprocess.run(["cc", "-O2", "-shared", "-fPIC", source, "-lmujoco", "-o", library], check=True)
    calls = ctypes.CDLL(library)
    calls.mujoco_version.restype = ctypes.c_char_p
    return calls


def spring(stiffness, turn_stiffness, mass, inertia, most):
    """As 12_mujoco_bodies.c has it, with critical damping."""
    damping = 2 * np.sqrt(stiffness * mass), 2 * np.sqrt(turn_stiffness * inertia)
    return np.array([stiffness, turn_stiffness, *damping, most])


def by_mujoco(case, engine, folder):
    given = STIFF if "stiff" in engine else ""
    start, body = frame(case.drives[0]), geoms(case.driver_boxes)
    driver, more = f'<body name="driver" mocap="true" {start}>{body}</body>', ""
    if "mocap" not in engine:
        driver = (
            f'<body name="driver" {start}><freejoint/><inertial pos="0 0 0" mass="{DRIVER_MASS}" '
            f'diaginertia="{DRIVER_INERTIA} {DRIVER_INERTIA} {DRIVER_INERTIA}"/>{body}</body>'
        )
    if "welded" in engine:
        driver += f'<body name="guide" mocap="true" {start}/>'
        more = f'<equality><weld body1="driver" body2="guide" {given}/></equality>'
    corners = np.asarray(case.part[0])
    size, radius = np.ptp(corners, axis=0), np.linalg.norm(corners, axis=1).max()
    inertia = MASS * (size[0] ** 2 + size[2] ** 2) / 12
    hand = spring(STIFFNESS, STIFFNESS * (4.5 * radius) ** 2, MASS, inertia, 0.0)  # turns as the core's coupling has it
    stiffness, reach = DRIVER_RATIO * STIFFNESS, np.linalg.norm(case.driver[0], axis=1).max() / 2
    guide = spring(stiffness, stiffness * reach**2, DRIVER_MASS, DRIVER_INERTIA, DRIVER_PUSH)
    model = pathlib.Path(folder) / "bodies.xml"
    model.write_text(
        f'<mujoco><option timestep="{0.001 / PARTS}" gravity="0 0 0"/>'
        f'<default><geom friction="0 0 0" condim="1" {given}/></default><worldbody>{geoms(case.fixed)}'
        f'<body name="part" {frame(case.goals[0])}><freejoint/>'
        f'<inertial pos="0 0 0" mass="{MASS}" diaginertia="{inertia} {inertia} {inertia}"/>{geoms(case.part_boxes)}</body>'
        f"{driver}</worldbody>{more}</mujoco>",
        encoding="utf-8",
    )
    goals, drives = np.ascontiguousarray(case.goals), np.ascontiguousarray(case.drives)
    wrenches, part, driven = np.zeros((len(goals), 6)), np.zeros_like(goals), np.zeros_like(drives)
    error = ctypes.create_string_buffer(1000)
    call = compiled(folder).mujoco_bodies
    call.argtypes = [ctypes.c_char_p, ctypes.c_int, ctypes.c_int] + [ctypes.c_void_p] * 7 + [ctypes.c_char_p, ctypes.c_int]
    arrays = [x.ctypes.data for x in (goals, drives, hand, guide, wrenches, part, driven)]
    failed = call(str(model).encode(), len(goals), PARTS, *arrays, error, len(error))
    if failed:
        raise RuntimeError(error.value.decode())
    return wrenches[:, :3], part, driven


def replay(name, engine):
    case = CASES[name]()
    if engine == "haptic":
        return case, by_us(case)
    with tempfile.TemporaryDirectory() as folder:
        return case, by_mujoco(case, engine, folder)


def rotations(poses):
    x, y, z, w = poses[:, 3:].T
    return np.stack([
        1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
        2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
        2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y),
    ], axis=1).reshape(-1, 3, 3)  # fmt: skip


def figures(case, force, part, driver):
    world = np.einsum("nij,kj->nki", rotations(part), np.asarray(case.part[0])) + part[:, None, :3]
    own = np.einsum("nji,nkj->nki", rotations(driver), world - driver[:, None, :3])
    in_driver, in_table = case.depths(own, world)
    error = np.einsum("nji,nj->ni", rotations(case.drives), force) - case.force
    behind = np.linalg.norm(case.drives[:, :3] - driver[:, :3], axis=1)
    w = (case.t > case.window[0]) & (case.t < case.window[1])
    return {
        "force error [mN]": 1e3 * np.linalg.norm(error[w].mean(axis=0)),
        "tremor [mN]": 1e3 * error[w].std(axis=0).max(),
        "largest error [mN]": 1e3 * np.linalg.norm(error[case.t > case.begin], axis=1).max(),
        "in the driver [um]": 1e6 * max(in_driver[w].max(), 0.0),
        "in the table [um]": 1e6 * max(in_table[w].max(), 0.0),
        "driver behind [mm]": 1e3 * behind[w].max(),
    }


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--instructions", action="store_true")
    parser.add_argument("--csv")
    parser.add_argument("--only", nargs=2, metavar=("CASE", "ENGINE"), help="for valgrind: nothing is printed")
    given = parser.parse_args()
    if given.only:
        replay(*given.only)
        return
    rows = []
    for name in CASES:
        for engine in ENGINES:
            case, told = replay(name, engine)
            row = {"case": name, "engine": engine, **figures(case, *told)}
            if given.instructions:
                count = side_by_side.instructions(name, engine, __file__, len(case.t))
                row["instructions a tick"] = "no valgrind" if count is None else f"{count:.0f}"
            rows.append(row)
    side_by_side.print_table(rows, given.csv)
    with tempfile.TemporaryDirectory() as folder:
        version = compiled(folder).mujoco_version().decode()
    print(f"MuJoCo {version}. One tick is a millisecond: {PARTS} steps of MuJoCo, one of ours.")
    for row in rows:
        assert all(np.isfinite(x) for x in row.values() if not isinstance(x, str)), row
        if row["engine"] == "haptic":
            assert row["force error [mN]"] < 1.0 and row["tremor [mN]"] < 0.1, row
            assert row["in the driver [um]"] < 1.0 and row["in the table [um]"] < 1.0, row
            assert abs(row["driver behind [mm]"] - 1e3 * CASES[row["case"]]().behind) < 0.01, row


if __name__ == "__main__":
    if not side_by_side.has_mujoco():
        sys.exit(0)
    main()
