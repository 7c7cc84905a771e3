# SPDX-License-Identifier: Apache-2.0
"""A batch of poses by the Python package and by a program in C++: equal bits, and how long each takes.

batch_against_cpp.py [POSES [ROUNDS [LIMIT]]]: the two take turns. With LIMIT the exit code is 1 where Python takes more
than LIMIT times as long, in the round in which it is least disturbed.
HAPTIC_LIBRARY, HAPTIC_HOST_SIM, HAPTIC_BATCH_PROGRAM: files of the build.
"""

import os
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np

import haptic

count = int(sys.argv[1]) if len(sys.argv) > 1 else 20_000
rounds = int(sys.argv[2]) if len(sys.argv) > 2 else 1
limit = float(sys.argv[3]) if len(sys.argv) > 3 else None
folder = pathlib.Path(__file__).resolve().parents[3] / "host_sim" / "scenes" / "square_peg_five"
scene = haptic.compile(folder / "scene.toml")

with tempfile.TemporaryDirectory() as work:
    path = pathlib.Path(work)
    subprocess.run(
        [os.environ["HAPTIC_HOST_SIM"], "motion", folder / "motion.toml", "--out", path / "motion.csv"],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    motion = np.loadtxt(path / "motion.csv", delimiter=",", skiprows=1)
    once = np.hstack([motion[:, 1:4], motion[:, [5, 6, 7, 4]]])
    # There and back, so that the batch has no jump.
    poses = np.resize(np.vstack([once, once[::-1]]), (count, 7)).copy()
    scene.save(path / "scene.rtscene")
    poses.tofile(path / "poses")
    rows = []
    for _ in range(rounds):
        program = [os.environ["HAPTIC_BATCH_PROGRAM"], path / "scene.rtscene", path / "poses"]
        cpp_wall, cpp_cpu, cpp_hash = subprocess.run(program, check=True, capture_output=True, text=True).stdout.split()
        begin, begin_cpu = time.perf_counter(), time.process_time()
        result = scene.replay(poses)
        wall, cpu = time.perf_counter() - begin, time.process_time() - begin_cpu
        if int(result.hashes[-1]) != int(cpp_hash):
            sys.exit(f"the hash of all ticks is {result.hashes[-1]} in Python and {cpp_hash} in C++")
        rows.append((wall, float(cpp_wall), cpu, float(cpp_cpu)))

table = np.array(rows)
touching = np.count_nonzero(result.situations)
print(f"{count} poses of the peg, {touching} in contact; equal hashes; {rounds} rounds in turn")
print(f"{'':10s} {'Python':>9s} {'C++':>9s} {'ratio':>7s}")
for name, a, b in (("wall [s]", 0, 1), ("processor", 2, 3)):
    for which, of in (("least", np.min), ("median", np.median)):
        x, y = of(table[:, a]), of(table[:, b])
        print(f"{name:10s} {x:9.3f} {y:9.3f} {x / y:7.3f}  {which}")
ratio = (table[:, 0] / table[:, 1]).min() if rounds == 1 else table[:, 0].min() / table[:, 1].min()
if limit is not None and ratio > limit:
    sys.exit(f"Python takes {ratio:.3f} times as long, more than {limit}")
