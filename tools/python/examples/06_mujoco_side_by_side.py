# SPDX-License-Identifier: Apache-2.0
"""A peg in a hole and a lid on a bin, by MuJoCo and by us: what a hand would feel on one motion.

06_mujoco_side_by_side.py [--instructions] [--csv FILE]. --instructions counts what a tick costs, by valgrind (a minute).

Both engines are given the same poses and draw the part to them by the same spring; the hand feels the spring's pull. MuJoCo's
part is a free body of 50 g with critical damping, stepped ten times a millisecond (the spring's rotation is too stiff for
fewer), its contacts are soft and its solver iterates; ours has no mass, and overlaps nothing. Two rows of MuJoCo: its
contact parameters as they are by default, and as stiff as both cases stand.

The motions stay in the plane x z, so a third answer is known: the place of a rigid part of no mass at which the spring
has the least energy, found directly, without either engine (`exact`). Columns: standard deviation of the force while the
hand is still; peak to peak of the pressing force's difference from the exact one while an edge slides across a seam between
two boxes (x; along the way MuJoCo's damper drags);
largest change of the force from a tick to the next, less that of the exact force, while a tilted part comes to lie flat; mean
error of the torque while it is tilted and still; and how deep the parts overlap there.
Needs libmujoco-dev (2.2.2 in Debian 12) and a C compiler: 06_mujoco_peg.c is compiled at the start.
"""

import argparse
import ctypes
import ctypes.util
import csv
import itertools
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from typing import Callable

import numpy as np

import haptic

HERE = pathlib.Path(__file__).resolve().parent
STIFFNESS, MASS, PARTS = 800.0, 0.05, 10
STIFF = 'solref="0.002 1" solimp="0.999 0.9999 0.0001"'
CONTACTS = {"MuJoCo": "", "stiff": STIFF}
COUNTED = slice(1200, 1800)  # ticks whose instructions are counted


def box(half):
    corners = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)]) * 2.0 - 1.0
    triangles = [
        [0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4],
        [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5],
    ]  # fmt: skip
    return corners * half, triangles


def lid_mesh(outer, inner, top, rim):
    """A plate of 2 x outer edge, `top` thick above z = 0, with a rim of depth `rim` below: a box with a pocket."""
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    layers = [(outer, top), (outer, -rim), (inner, -rim), (inner, 0.0)]
    vertices = [(*(half * corner), z) for half, z in layers for corner in square]
    quads = [(0, 1, 2, 3)]  # the top, then walls downwards, the rim's lower side, walls upwards, the pocket's end
    for layer in range(3):
        a, b = 4 * layer, 4 * layer + 4
        quads += [(b + k, b + (k + 1) % 4, a + (k + 1) % 4, a + k) for k in range(4)]
    quads.append((15, 14, 13, 12))
    return np.array(vertices), [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]


@dataclass
class Case:
    """One part and its obstacles; lengths in metres. Windows are times in seconds."""

    mesh: tuple  # of the part in the hand
    geoms: list  # the same as boxes: (centre, half edges)
    fixed: list  # boxes
    stations: list  # (time, x, z, tilt about y)
    rest: tuple
    seam: tuple
    transition: tuple
    tilted: tuple
    limits: Callable  # tilt angles -> (normals n x m x 2, bounds n x m): normal . (x, z) <= bound
    depth: Callable  # (x, z, tilt) of felt poses -> overlap


def stack(*rows):
    """Rows of (normal x, normal z, bound), each an array over ticks."""
    normals = np.stack([np.stack(np.broadcast_arrays(x, z), axis=-1) for x, z, _ in rows], axis=-2)
    return normals, np.stack(np.broadcast_arrays(*[b for _, _, b in rows]), axis=-1)


def peg():
    half, gap, long, deep, out, seam = 0.010, 0.0002, 0.030, 0.030, 0.030, -0.015
    inner = half + gap
    wide, middle = (out - inner) / 2, (out + inner) / 2

    def limits(a):
        sin, cos, zero, one = np.sin(a), np.cos(a), np.zeros_like(a), np.ones_like(a)
        rows = []
        for side in (1.0, -1.0):
            x, z = side * half * cos - long * sin, -side * half * sin - long * cos  # a lower corner of the peg
            rows += [(one, zero, inner - x), (-one, zero, inner + x), (zero, -one, deep + z)]
            rows.append((side * cos, -side * sin, inner * cos - half))  # the hole's edge at that side
        return stack(*rows)

    return Case(
        mesh=box((half, half, long)),
        geoms=[((0, 0, 0), (half, half, long))],
        fixed=[
            ((middle, 0, seam / 2), (wide, out, -seam / 2)),
            ((middle, 0, (seam - deep) / 2), (wide, out, (seam + deep) / 2)),
            ((-middle, 0, -deep / 2), (wide, out, deep / 2)),
            ((0, middle, -deep / 2), (inner, wide, deep / 2)),
            ((0, -middle, -deep / 2), (inner, wide, deep / 2)),
            ((0, 0, -deep - 0.005), (out, out, 0.005)),
        ],
        stations=[
            (0.0, 0, 0.035, 0), (0.8, 0, 0.005, 0), (1.6, 0, -0.003, 0), (2.6, 0, -0.003, 0), (3.2, 0.003, -0.003, 0),
            (4.0, 0.003, -0.003, 0), (4.6, 0.003, -0.003, 0.02), (5.6, 0.003, -0.003, 0.02), (6.2, 0.003, -0.003, 0),
            (6.6, 0.003, -0.003, 0), (7.0, 0.003, 0.005, 0), (8.0, 0.003, 0.025, 0),
        ],
        rest=(2.0, 2.6), tilted=(5.0, 5.6), transition=(5.6, 6.6), seam=(7.1, 7.9),
        limits=limits, depth=lambda x, z, a: -(z - long * np.cos(a) - half * np.abs(np.sin(a)) + deep),
    )  # fmt: skip


def lid():
    wall, gap, thick, top, rim, deep, seam = 0.030, 0.0003, 0.004, 0.004, 0.012, 0.040, -0.006
    inner = wall + gap
    outer = inner + thick
    centre = wall - thick / 2

    def limits(a):
        sin, cos = np.sin(a), np.cos(a)
        rows = []
        for side in (1.0, -1.0):
            rows.append((-sin, -cos, -side * wall * sin))  # the plate above a wall's edge
            rows.append((-side * cos, side * sin, inner - wall * cos))  # that edge within the pocket
            rows.append((-side * np.ones_like(a), np.zeros_like(a), inner * cos - side * rim * sin - wall))
        return stack(*rows)

    return Case(
        mesh=lid_mesh(outer, inner, top, rim),
        geoms=[((0, 0, top / 2), (outer, outer, top / 2))]
        + [((s * (inner + thick / 2), 0, -rim / 2), (thick / 2, outer, rim / 2)) for s in (1, -1)]
        + [((0, s * (inner + thick / 2), -rim / 2), (inner, thick / 2, rim / 2)) for s in (1, -1)],
        fixed=[
            ((centre, 0, -deep / 2), (thick / 2, wall, deep / 2)),
            ((-centre, 0, seam / 2), (thick / 2, wall, -seam / 2)),
            ((-centre, 0, (seam - deep) / 2), (thick / 2, wall, (seam + deep) / 2)),
            ((0, centre, -deep / 2), (wall - thick, thick / 2, deep / 2)),
            ((0, -centre, -deep / 2), (wall - thick, thick / 2, deep / 2)),
            ((0, 0, -deep - 0.002), (wall, wall, 0.002)),
        ],
        stations=[
            (0.0, 0, 0.020, 0), (0.8, 0, 0.004, 0), (1.6, 0, -0.003, 0), (2.6, 0, -0.003, 0), (3.2, 0, -0.003, 0.02),
            (4.2, 0, -0.003, 0.02), (4.8, 0, -0.003, 0), (5.2, 0, -0.003, 0), (5.8, 0, 0.010, 0), (6.2, 0.003, 0.009, 0),
            (6.4, 0.003, 0.009, 0), (7.4, 0.003, 0.001, 0), (7.6, 0.003, 0.001, 0),
        ],
        rest=(2.0, 2.6), tilted=(3.6, 4.2), transition=(4.2, 5.2), seam=(6.5, 7.4),
        limits=limits, depth=lambda x, z, a: -(z + x * np.tan(a) - wall * np.abs(np.tan(a))),
    )  # fmt: skip


def motion(stations):
    """At 1 kHz, at rest at each station: times, poses, and (x, z, tilt)."""
    t = np.arange(0, stations[-1][0], 0.001)
    track = np.zeros((len(t), 3))
    for (begin, *a), (end, *b) in zip(stations, stations[1:]):
        within = (t >= begin) & (t < end)
        s = (t[within] - begin) / (end - begin)
        share = s**3 * (10 - 15 * s + 6 * s * s)
        track[within] = np.array(a) + share[:, None] * (np.array(b) - np.array(a))
    poses = np.zeros((len(t), 7))
    poses[:, 0], poses[:, 2] = track[:, 0], track[:, 1]
    poses[:, 4], poses[:, 6] = np.sin(track[:, 2] / 2), np.cos(track[:, 2] / 2)
    return t, poses, track


def nearest_allowed(goals, normals, bounds):
    """Of each row the point nearest to the goal with normal . point <= bound for every limit."""
    best, least = goals.copy(), np.full(len(goals), np.inf)

    def offer(points):
        nonlocal best, least
        free = (np.einsum("nmk,nk->nm", normals, points) <= bounds + 1e-12).all(axis=1)
        square = np.where(free, ((points - goals) ** 2).sum(axis=1), np.inf)
        better = square < least
        least = np.where(better, square, least)
        best = np.where(better[:, None], points, best)

    offer(goals)
    count = normals.shape[1]
    for k in range(count):
        n = normals[:, k]
        over = (n * goals).sum(axis=1) - bounds[:, k]
        offer(goals - over[:, None] * n / (n * n).sum(axis=1)[:, None])
    for i, k in itertools.combinations(range(count), 2):
        (a, b), (c, d) = normals[:, i].T, normals[:, k].T
        det = a * d - b * c
        with np.errstate(divide="ignore", invalid="ignore"):
            points = np.stack([d * bounds[:, i] - b * bounds[:, k], a * bounds[:, k] - c * bounds[:, i]], axis=1)
            points = points / det[:, None]
        offer(np.where(np.isfinite(points), points, goals))
    return best, least


def exact(case, track, turn_stiffness):
    """Forces and torques of the spring at the place of least energy: (n x 3, n x 3)."""
    goals, tilts = track[:, :2], track[:, 2]

    def energy(angle):
        place, square = nearest_allowed(goals, *case.limits(angle))
        return 0.5 * STIFFNESS * square + 0.5 * turn_stiffness * (angle - tilts) ** 2, place

    # The least of a row of angles, then by thirds about it.
    low, high = tilts - 0.03, tilts + 0.03
    steps = np.linspace(0, 1, 61)
    tried = np.stack([energy(low + s * (high - low))[0] for s in steps])
    at = steps[tried.argmin(axis=0)]
    low, high = low + (at - steps[1]) * 0.06, low + (at + steps[1]) * 0.06
    for _ in range(40):
        a, b = low + (high - low) / 3, high - (high - low) / 3
        left = energy(a)[0] <= energy(b)[0]
        low, high = np.where(left, low, a), np.where(left, b, high)
    angle = (low + high) / 2
    place = energy(angle)[1]
    force, torque = np.zeros((len(goals), 3)), np.zeros((len(goals), 3))
    force[:, [0, 2]] = STIFFNESS * (place - goals)
    torque[:, 1] = turn_stiffness * (angle - tilts)
    return force, torque


def by_mujoco(case, poses, turn_stiffness, contact, folder):
    library = pathlib.Path(folder) / "peg.so"
    if not library.exists():
        source = str(HERE / "06_mujoco_peg.c")
        subprocess.run(["cc", "-O2", "-shared", "-fPIC", source, "-lmujoco", "-lm", "-o", str(library)], check=True)

    def geoms(boxes):
        return "".join('<geom type="box" pos="%g %g %g" size="%g %g %g"/>' % (*c, *h) for c, h in boxes)

    size = np.ptp(np.asarray(case.mesh[0]), axis=0)
    inertia = MASS * (size[0] ** 2 + size[2] ** 2) / 12
    model = pathlib.Path(folder) / "case.xml"
    model.write_text(
        f'<mujoco><option timestep="{0.001 / PARTS}" gravity="0 0 0"/>'
        f'<default><geom friction="0 0 0" condim="1" {contact}/></default>'
        f'<worldbody>{geoms(case.fixed)}<body><freejoint/>'
        f'<inertial pos="0 0 0" mass="{MASS}" diaginertia="{inertia} {inertia} {inertia}"/>'
        f"{geoms(case.geoms)}</body></worldbody></mujoco>",
        encoding="utf-8",
    )
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


def by_us(case, t, poses):
    parts = [haptic.Part(box(half), unit="m", at=centre) for centre, half in case.fixed]
    scene = haptic.compile(case.mesh, *parts, unit="m", start=poses[0, :3], grip=(0, 0, 0), stiffness=STIFFNESS)
    result = scene.replay(poses, t)
    return np.hstack([result.forces, result.torques]), result.felt_poses


CASES = {"peg": peg, "lid": lid}
ENGINES = ("haptic", *CONTACTS)


def replay(name, engine, part=slice(None)):
    case = CASES[name]()
    t, poses, track = motion(case.stations)
    t, poses, track = t[part], poses[part].copy(), track[part]
    radius = np.linalg.norm(np.asarray(case.mesh[0]), axis=1).max()
    turn_stiffness = STIFFNESS * (4.5 * radius) ** 2  # as the core's coupling has it
    if engine == "exact":
        return case, t, exact(case, track, turn_stiffness)
    if engine == "haptic":
        return case, t, by_us(case, t, poses)
    with tempfile.TemporaryDirectory() as folder:
        return case, t, by_mujoco(case, poses, turn_stiffness, CONTACTS[engine], folder)


def instructions(name, engine, script=__file__, ticks=COUNTED.stop - COUNTED.start):
    """Of a tick of a millisecond, by callgrind: mean over the ticks of --only, here COUNTED, from free to pressed. None: there
    is no valgrind."""
    if shutil.which("valgrind") is None:
        return None
    function = "haptic::HapticCore::step(*" if engine == "haptic" else "mj_step"
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", f"--toggle-collect={function}"]
    command += [sys.executable, script, "--only", name, engine]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stderr
    collected = int(re.search(r"Collected : (\d+)", said)[1])
    if collected == 0:
        raise RuntimeError(f"valgrind has not met {function}")
    return collected / ticks


def figures(case, t, wrenches, felt, ideal):
    def within(window):
        return (t > window[0]) & (t < window[1])

    force, torque = wrenches[:, :3] - ideal[0], wrenches[:, 3:] - ideal[1]
    tilted = within(case.tilted)
    angle = 2 * np.arctan2(felt[:, 4], felt[:, 6])
    steps = np.linalg.norm(np.diff(force[within(case.transition)], axis=0), axis=1)
    return {
        "noise at rest [mN]": 1e3 * wrenches[within(case.rest), :3].std(axis=0).max(),
        "ripple at a seam [mN]": 1e3 * np.ptp(force[within(case.seam), 0]),
        "step at a transition [mN]": 1e3 * steps.max(),
        "torque error [mN m]": 1e3 * np.linalg.norm(torque[tilted].mean(axis=0)),
        "force error [mN]": 1e3 * np.linalg.norm(force[tilted].mean(axis=0)),
        "overlap [um]": 1e6 * case.depth(felt[tilted, 0], felt[tilted, 2], angle[tilted]).mean(),
    }


def print_table(rows, csv_file=None):
    heads = list(rows[0])
    texts = [heads] + [[x if isinstance(x, str) else f"{x:.4g}" for x in row.values()] for row in rows]
    widths = [max(len(line[k]) for line in texts) for k in range(len(heads))]
    for line in texts:
        print("  ".join(x.rjust(w) for x, w in zip(line, widths)))
    if csv_file:
        with open(csv_file, "w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows(texts)


def has_mujoco():
    """Or says what is missing."""
    if shutil.which("cc") and ctypes.util.find_library("mujoco") and os.path.exists("/usr/include/mujoco/mujoco.h"):
        return True
    print("skipped: needs a C compiler and MuJoCo; on Debian: apt-get install gcc libmujoco-dev")
    return False


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--instructions", action="store_true")
    parser.add_argument("--csv")
    parser.add_argument("--only", nargs=2, metavar=("CASE", "ENGINE"), help="for valgrind: nothing is printed")
    given = parser.parse_args()
    if given.only:
        replay(*given.only, COUNTED)
        return
    rows = []
    for name in CASES:
        _, _, ideal = replay(name, "exact")
        for engine in ENGINES:
            case, t, (wrenches, felt) = replay(name, engine)
            row = {"case": name, "engine": engine, **figures(case, t, wrenches, felt, ideal)}
            if given.instructions:
                count = instructions(name, engine)
                row["instructions a tick"] = "no valgrind" if count is None else f"{count:.0f}"
            rows.append(row)
    print_table(rows, given.csv)
    print(f"One tick is a millisecond: {PARTS} steps of MuJoCo, one of ours.")
    for row in rows:
        assert all(np.isfinite(x) for x in row.values() if not isinstance(x, str)), row
        if row["engine"] == "haptic":
            assert row["noise at rest [mN]"] < 0.01 and row["force error [mN]"] < 1.0, row
            assert abs(row["torque error [mN m]"]) < 1.0, row


if __name__ == "__main__":
    if not has_mujoco():
        sys.exit(0)
    main()
