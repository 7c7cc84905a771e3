# SPDX-License-Identifier: Apache-2.0
"""Many motions without a device: 100 presses, each of 200 ticks in one call; and one call against one for each tick."""

import pathlib
import time

import numpy as np

import haptic

scenes = pathlib.Path(__file__).resolve().parents[3] / "host_sim" / "scenes" / "tetrahedron_on_box"
scene = haptic.compile(scenes / "scene.toml")
random = np.random.default_rng(1)
motions = []
for _ in range(100):
    poses = np.tile(scene.start, (200, 1))
    poses[:, :2] += random.uniform(-0.01, 0.01, 2)
    poses[:, 2] -= np.linspace(0, random.uniform(0.03, 0.06), 200)
    motions.append(poses)

begin = time.perf_counter()
results = [scene.replay(poses) for poses in motions]
seconds = time.perf_counter() - begin

largest = [np.linalg.norm(r.forces, axis=1).max() for r in results]
print(f"largest forces: from {min(largest):.2f} N to {max(largest):.2f} N")
print(f"{200 * len(motions)} ticks in {seconds:.2f} s: {1e6 * seconds / (200 * len(motions)):.1f} us each")
assert all((a.hashes == b.hashes).all() for a, b in zip(results, map(scene.replay, motions[:5])))

# Wrenches alone, by one call for all ticks and by one for each: the same bits.
poses = np.concatenate(motions)
times = np.arange(len(poses)) / 1000.0
wrenches, core = np.empty((len(poses), 6)), scene.core()
begin = time.perf_counter()
core.step_many(poses, times, out=wrenches)
in_one = len(poses) / (time.perf_counter() - begin)
core = scene.core()
begin = time.perf_counter()
steps = [core.step(pose, t) for pose, t in zip(poses[:4000], times)]
one_by_one = len(steps) / (time.perf_counter() - begin)
print(f"steps a second: {in_one:,.0f} by step_many, {one_by_one:,.0f} by step in a loop")
assert all((s.force == w[:3]).all() and (s.torque == w[3:]).all() for s, w in zip(steps, wrenches))
